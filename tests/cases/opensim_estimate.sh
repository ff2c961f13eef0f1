#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Models as labs have them, estimated back: a motion under known excitations is integrated, and found again from its markers
# and EMG, with exact and with fitted paths. Forces within 3 N RMS, angles within 0.05 degrees, every window converged.
#   opensim_estimate.sh PATH/mhe-sim PATH/mhe-run SOURCE_DIR
# arm26 is the demo that is shipped; the others are skipped without the shared data (MHE_SHARED or ../shared).
set -u
sim=$(realpath "$1") run=$(realpath "$2") source=$(realpath "$3")
shared=${MHE_SHARED:-$source/../shared}/data/opensim
. "$(dirname "$0")/../support/script.sh"
export XDG_CACHE_HOME="$work/cache"

# lock FILE.osim COORDINATE...: the model with these and the dependent coordinates free, all others locked, as model.osim
lock() {
    file=$1
    shift
    free=" $* $(sed -n 's/.*<dependent_coordinate_name>\([^<]*\)<.*/\1/p' "$file" | tr '\n' ' ') "
    awk -v free="$free" '
        /<Coordinate name="/ {
            name = $0; sub(/.*<Coordinate name="/, "", name); sub(/".*/, "", name)
            on = 1; said = 0; locked = "<locked>" (index(free, " " name " ") ? "false" : "true") "</locked>"
        }
        on && /<locked>/ {said = 1; sub(/<locked>.*<\/locked>/, locked)}
        on && /<\/Coordinate>/ {if (!said) sub(/<\/Coordinate>/, locked "</Coordinate>"); on = 0}
        {print}' "$file" > model.osim
}

# excite SECONDS LEAST MOST: smooth excitations of every muscle, each with its own phase and size
excite() {
    awk -v last="$1" -v least="$2" -v most="$3" '
        /<Millard2012EquilibriumMuscle name="/ {
            name = $0; sub(/.* name="/, "", name); sub(/".*/, "", name); if (name != "default") names[n++] = name
        }
        END {
            printf "excitations\nnRows=13\nnColumns=%d\ninDegrees=no\nendheader\ntime", n + 1
            for (i = 0; i < n; i++) printf "\t%s", names[i]
            for (k = 0; k < 13; k++) {
                t = last * k / 12
                printf "\n%.6f", t
                for (i = 0; i < n; i++) {
                    size = least + (most - least) * ((i * 7) % 11) / 10
                    printf "\t%.5f", 0.02 + size * (0.5 + 0.5 * sin(7.85 * t + 2.4 * i))
                }
            }
            print ""
        }' model.osim > excitations.sto
}

# config Q: of model.osim from the posture Q
config() {
    still=$(echo "$1" | sed 's/[-0-9.]\{1,\}/0/g')
    cat > config.yaml << END
model: {file: model.osim, paths_range: 0.5}
data: {markers: truth/markers.trc, emg: truth/emg.sto, reference: truth/reference.sto}
initial: {q: [$1], qdot: [$still]}
horizon: {window: 7, ratio: 3}
integrator: {plugin: mhe.integrator.rk}
costs: [{plugin: mhe.cost.emg-markers-high}]
solver: {plugin: mhe.solver.ipopt, tolerance: 1e-4, max_iterations: 15}
END
    sed '/^data/d' config.yaml > motion.yaml
}

# judge NAME CONFIG
judge() {
    for paths in exact fitted; do
        "$run" "$2" --set model.paths=$paths --out "$paths" --quiet > said.txt 2>&1 || fail "$1, $paths: $(cat said.txt)"
        echo "$1, $paths: forces $(number force_n $paths) N, angles $(number q_deg $paths) deg, converged" \
            "$(number converged $paths), rate $(sed -n 's/.*"mean":[[:space:]]*\([0-9.]*\).*/\1/p' $paths/summary.json | head -n 1) Hz"
        awk -v f="$(number force_n $paths)" -v q="$(number q_deg $paths)" -v c="$(number converged $paths)" \
            'BEGIN {exit !(f != "" && f <= 3 && q != "" && q <= 0.05 && c == 1)}' || fail "$1, $paths: not what is asked"
    done
}

judge arm26 "$source/models/arm26/demo.yaml"
if [ -d "$shared" ]; then
    lock "$shared/MOBL_ARMS_41.osim" elv_angle shoulder_elv shoulder_rot elbow_flexion
    excite 0.5 0.02 0.12
    config "0.9, 0.5, 0.0, 0.6"
    "$sim" forward motion.yaml --input excitations.sto --out truth > said.txt 2>&1 || fail "MOBL_ARMS_41: $(cat said.txt)"
    judge MOBL_ARMS_41 config.yaml
    legs=
    for side in r l; do
        legs="$legs hip_flexion_$side hip_adduction_$side hip_rotation_$side knee_angle_$side ankle_angle_$side subtalar_angle_$side"
    done
    # shellcheck disable=SC2086 # a list
    lock "$shared/Rajagopal2016.osim" $legs
    excite 0.4 0.005 0.03
    config "0.3, -0.05, -0.1, 0.9, -0.1, 0, 0.1, -0.05, -0.1, 1, -0.1, 0"
    "$sim" forward motion.yaml --input excitations.sto --out truth > said.txt 2>&1 || fail "Rajagopal2016: $(cat said.txt)"
    judge Rajagopal2016 config.yaml
else
    echo "no shared data: arm26 alone"
fi
finish opensim_estimate

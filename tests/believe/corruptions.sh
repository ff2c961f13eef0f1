#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Is a wrong recording ever called usable, or a clean one doubtful? Four recordings (the demo, the demo's raw EMG, two
# simulated ones) in each kind of systematic error that `corrupt` makes, and twenty clean runs. Wrong is an estimate whose
# joint angles are more than 2 degrees or whose muscle forces are more than 10 N (RMSE over all) from the known truth, which
# the verdict does not look at. Prints the table of docs/believability.md.
#   corruptions.sh PATH/mhe-run PATH/corrupt SOURCE_DIR all|some
set -u
run=$(realpath "$1") corrupt=$(realpath "$2") models=$(realpath "$3")/models/arm19 scope=$4
. "$(dirname "$0")/../support/script.sh"
sim=$(dirname "$run")/mhe-sim

# ---- the four recordings: NAME/markers, NAME/emg, NAME.yaml; the truth is the demo's ----

# simulate NAME SEED MARKER_SD EMG_LEVEL
simulate() {
    cat > "$1-noise.yaml" <<END
model: {file: $models/arm19.osim}
reference: $models/demo_reference.sto
noise: {seed: $2, markers: {sd: $3}, emg: {level: $4}}
output: {levels: []}
END
    "$sim" noise "$1-noise.yaml" --out "$1-made" > sim.txt 2>&1 || fail "mhe-sim noise: $(cat sim.txt)"
}
head='model: {file: '$models/arm19.osim'}
muscle: {plugin: mhe.muscle.hill, curves: paper2021}
horizon: {window: 7, ratio: 3}
output: {picture: false}
solver: {plugin: mhe.solver.rti, preset: speed, tolerance: 1e-5}'
data() { echo "data: {markers: $1/markers.trc, emg: $1/emg.sto, reference: $models/demo_reference.sto}"; }
# config NAME FOLDER
config() {
    {
        echo "$head"
        data "$2"
        case $1 in
        raw)
            sed -n '/^emg:/,/^horizon/p;/^costs/,/^solver/p' "$models/demo_raw.yaml" | grep -v '^horizon\|^solver'
            ;;
        noisy) printf 'formulation: activation\nbounds: {residual_torques: true}\ncosts: [{plugin: mhe.cost.emg-markers-high, residual_torque: 1e5}]\n' ;;
        *) echo 'costs: [mhe.cost.emg-markers-high]' ;;
        esac
    } > "$2.yaml"
}
simulate quiet 11 0.0005 0
simulate noisy 12 0.001 0.05
# source NAME: files of the clean recording
source_of() {
    case $1 in
    demo) echo "$models/demo_markers.trc $models/demo_emg.sto" ;;
    raw) echo "$models/demo_recording.c3d $models/demo_recording.c3d" ;;
    *) echo "$1-made/markers.trc $1-made/emg.sto" ;;
    esac
}

# value KEY FILE
value() { sed -n "s/.*\"$1\":[[:space:]]*\"\{0,1\}\\([-0-9a-z.]*\\).*/\\1/p" "$2" | head -n 1; }

# try NAME KIND: sets usable, q and f; "refused" where the run ends with 2
try() {
    folder=$1-$2
    mkdir -p "$folder"
    # shellcheck disable=SC2046
    "$corrupt" "$2" $(source_of "$1") "$folder" || fail "corrupt $2"
    config "$1" "$folder"
    # What is refused or doubted before anything is estimated needs no estimate: it cannot become usable.
    "$run" --check "$folder.yaml" > "$folder.txt" 2> "$folder.err" < /dev/null
    status=$?
    q=- f=-
    usable=$(sed -n 's/^usable: //p' "$folder.txt")
    if [ $status -eq 2 ] || { [ -n "$usable" ] && [ "$usable" != yes ]; }; then
        [ $status -ne 2 ] || usable=refused
        rm -rf "$folder"
        return
    fi
    timeout 120 "$run" "$folder.yaml" --out "out/$folder" --quiet > "$folder.txt" 2> "$folder.err" < /dev/null
    status=$?
    if [ $status -eq 2 ]; then
        usable=refused
    elif [ -f "out/$folder/summary.json" ]; then
        usable=$(value usable "out/$folder/summary.json")
        q=$(value q_deg "out/$folder/summary.json")
        f=$(value force_n "out/$folder/summary.json")
    else
        usable=failed
    fi
    rm -rf "$folder" "out/$folder"
}

recordings='demo raw quiet noisy'
echo '| kind | demo | demo_raw | simulated | simulated, noisy |'
echo '|---|---|---|---|---|'
n=0 n_wrong=0
"$corrupt" --list | grep -v '^clean' > kinds.txt
[ "$scope" = all ] || awk 'NR % 12 == 1' kinds.txt > some.txt
[ "$scope" = all ] || mv some.txt kinds.txt
while IFS='|' read -r kind what; do
    row="| $what |"
    for name in $recordings; do
        [ "$scope" = all ] || [ "$name" = demo ] || [ "$name" = raw ] || continue
        try "$name" "$kind"
        n=$((n + 1))
        wrong=$(awk -v q="$q" -v f="$f" 'BEGIN {print (q != "-" && (q + 0 > 2 || f + 0 > 10)) ? 1 : 0}')
        n_wrong=$((n_wrong + wrong))
        if [ "$wrong" = 1 ] && [ "$usable" = yes ]; then
            fail "$name, $kind: $q degrees, $f N wrong and called usable"
        fi
        if [ "$q" = - ]; then
            row="$row $usable |"
        else
            row=$(printf '%s %s (%.1f deg, %.0f N) |' "$row" "$usable" "$q" "$f")
        fi
    done
    echo "$row"
done < kinds.txt

# ---- clean ones: as they are, other seeds, windows, solvers, formulations ----

n_clean=0
# is_clean LABEL CONFIG [--set ...]
is_clean() {
    label=$1 file=$2
    shift 2
    n_clean=$((n_clean + 1))
    timeout 300 "$run" "$file" --out out/clean --quiet --set output.picture=false "$@" > clean.txt 2> clean.err < /dev/null
    usable=$(value usable out/clean/summary.json 2> /dev/null)
    [ "$usable" = yes ] || fail "clean: $label is called '$usable': $(grep -A1 'doubtful:\|not usable:' clean.txt) $(cat clean.err)"
    [ "$scope" != all ] || echo "clean: $label: $usable ($(value q_deg out/clean/summary.json) degrees, $(value force_n out/clean/summary.json) N)"
    rm -rf out/clean
}
rti='solver={plugin: mhe.solver.rti, preset: speed, tolerance: 1e-5}'
is_clean demo "$models/demo.yaml"
is_clean demo_raw "$models/demo_raw.yaml"
if [ "$scope" = all ]; then
    is_clean 'demo, RTI' "$models/demo.yaml" --set "$rti"
    is_clean 'demo, every frame' "$models/demo.yaml" --set "$rti" --set horizon.ratio=1
    is_clean 'demo, window of 4' "$models/demo.yaml" --set "$rti" --set horizon.window=4
    is_clean 'demo, window of 12' "$models/demo.yaml" --set "$rti" --set horizon.window=12
    is_clean 'demo, activation-driven' "$models/demo.yaml" --set "$rti" --set formulation=activation
    is_clean 'demo, residual torques' "$models/demo.yaml" --set "$rti" --set bounds.residual_torques=true
    is_clean 'demo, without EMG' "$models/demo.yaml" --set "$rti" --set 'costs=[mhe.cost.min-excitation]'
    is_clean 'demo, newest node' "$models/demo.yaml" --set "$rti" --set output.node=last
    is_clean 'demo_raw, 0.02 s of delay' "$models/demo_raw.yaml" --set emg.delay=0.02
    is_clean 'demo_raw, zero phase' "$models/demo_raw.yaml" --set emg.zero_phase=true
    is_clean 'demo_raw, window of 5' "$models/demo_raw.yaml" --set horizon.window=5
    for seed in 1 2 3; do
        simulate "seed$seed" $seed 0.001 0
        echo "$head
$(data "seed$seed-made")
costs: [mhe.cost.emg-markers-high]" > "seed$seed.yaml"
        is_clean "simulated, 1 mm, seed $seed" "seed$seed.yaml"
    done
    simulate five 5 0.002 0
    echo "$head
$(data five-made)
costs: [mhe.cost.emg-markers-high]" > five.yaml
    is_clean 'simulated, 2 mm' five.yaml
    for name in quiet noisy; do
        config $name $name-made
        is_clean "$name" $name-made.yaml
    done
    config demo quiet-made
    is_clean 'simulated, low marker weight' quiet-made.yaml --set 'costs=[mhe.cost.emg-markers-low]'
fi
echo "$n corrupted runs, $n_wrong of them wrong; $n_clean clean ones"
finish "believability"

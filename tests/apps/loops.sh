#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# A loop in a model: a motion is simulated on it and estimated back, and the loop stays closed. First four bars, with
# Simbody's own constraints in the simulation too; then the Thoracoscapular shoulder, where it is at hand, with exact and
# with fitted paths.
#   loops.sh BIN_DIR SOURCE_DIR
set -u
bin=$1
source=$2
. "$(dirname "$0")/../support/script.sh"

# holds 'EXPRESSION' for awk
holds() { awk "BEGIN { exit !($1) }"; }

# excitations FILE SECONDS BASE SWING MUSCLE...
excitations() {
    file=$1 seconds=$2 base=$3 swing=$4
    shift 4
    awk -v names="$*" -v end="$seconds" -v base="$base" -v swing="$swing" 'BEGIN {
        n = split(names, m, " "); rows = end / 0.1 + 1
        printf "e\nversion=1\nnRows=%d\nnColumns=%d\ninDegrees=no\nendheader\ntime", rows, n + 1
        for (i = 1; i <= n; i++) printf "\t%s", m[i]
        for (k = 0; k < rows; k++) {
            printf "\n%.1f", k * 0.1
            for (i = 1; i <= n; i++) printf "\t%.4f", base + swing * sin(6.2832 * (0.08 * k + 0.31 * i))
        }
        print "" }' > "$file"
}

# config FILE MODEL DATA_DIR MORE_OF_MODEL RATIO
config() {
    cat > "$1" <<YAML
model: {file: "$2"$4, unsupported: stop}
data: {markers: $3/markers.trc, emg: $3/emg.sto, reference: $3/reference.sto}
horizon: {window: 7, ratio: $5}
integrator: {plugin: mhe.integrator.rk}
costs: [{plugin: mhe.cost.emg-markers-high}]
solver: {plugin: mhe.solver.ipopt, tolerance: 1e-4, max_iterations: 60}
YAML
}

# estimate NAME DEGREES NEWTONS: all windows converge, within these
estimate() {
    "$bin/mhe-run" "$1.yaml" --out "$1" --quiet > "$1.txt" 2>&1 || fail "$1: exit status $?: $(cat "$1.txt")"
    holds "$(number converged "$1") == 1" || fail "$1: converged $(number converged "$1")"
    holds "$(number q_deg "$1") < $2" || fail "$1: joint angles $(number q_deg "$1") deg"
    holds "$(number force_n "$1") < $3" || fail "$1: forces $(number force_n "$1") N"
}

# gap MOTION: the largest distance of the four bars' pin, m
gap() {
    awk 'head { for (i = 1; i <= NF; i++) at[$i] = i; head = 0; next } /^endheader/ { head = 1; next } at["crank"] {
        a = $at["crank"]; b = a + $at["coupler"]; c = $at["rocker"]
        x = 0.25 * cos(a) + 0.4 * cos(b) - 0.4 - 0.3 * cos(c); y = 0.25 * sin(a) + 0.4 * sin(b) - 0.3 * sin(c)
        d = sqrt(x * x + y * y); if (d > most) most = d } END { printf "%.3g", most }' "$1"
}

excitations e.sto 1.0 0.25 0.2 pull_left pull_right lift across
for dynamics in recursive simbody; do
    config "$dynamics.yaml" "$source/tests/apps/linkage.osim" sim "" 3 # dynamics are the simulation's
    "$bin/mhe-sim" forward "$dynamics.yaml" --input e.sto --rate 100 --out sim --set "model.dynamics=$dynamics" \
        > sim.txt 2>&1 || fail "mhe-sim, $dynamics: $(cat sim.txt)"
    sed 's/q_//g' sim/reference.sto > reference.sto
    holds "$(gap reference.sto) < 1e-7" || fail "the simulation's pin opens by $(gap reference.sto) m"
    estimate "$dynamics" 0.05 3
    holds "$(gap "$dynamics/motion.sto") < 1e-4" || fail "the estimate's pin opens by $(gap "$dynamics/motion.sto") m"
done

shoulder=${MHE_SHARED:-$source/../shared}/data/opensim/ThoracoscapularShoulderModel.osim
if [ -r "$shoulder" ]; then
    muscles=$("$bin/mhe-model" info "$shoulder" | awk '/^muscles:/ { on = 1; next } /^$/ { on = 0 } on { print $1 }')
    # shellcheck disable=SC2086 # names without blanks
    excitations e.sto 1.0 0.1 0.05 $muscles
    config shoulder.yaml "$shoulder" shoulder-sim "" 3
    "$bin/mhe-sim" forward shoulder.yaml --input e.sto --rate 100 --out shoulder-sim > sim.txt 2>&1 || fail "$(cat sim.txt)"
    estimate shoulder 0.05 3
    export XDG_CACHE_HOME="$PWD/cache" # the fits are made here, not found
    config shoulder-fitted.yaml "$shoulder" shoulder-sim ", paths: fitted" 3
    estimate shoulder-fitted 0.05 3
fi
finish loops

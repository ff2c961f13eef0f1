#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Configs whose sizes or bounds are at their ends: mhe.solver.rti (`robust`) and mhe.solver.ipopt, both converged to 1e-12,
# give the same estimates to 1e-9 (of 1 + the value in rad, rad/s, 1, kN), and `speed` answers; what contradicts itself both tell in the
# same words. The motions are made here by mhe-sim.
#   ends.sh PATH/mhe-sim PATH/mhe-run [whole]
# `whole`: longer recordings, 300 muscles for 40 and windows of 200 for 60 (a minute).
set -u
sim=$(realpath "$1") run=$(realpath "$2") whole=${3:-}
. "$(dirname "$0")/../support/script.sh"
count=0

# model HINGES MUSCLES: a chain of hinges about y that hangs down, its muscles on both sides of each in turn
model() {
    awk -v hinges="$1" -v muscles="$2" 'BEGIN {
        print "version 4\ngravity 0 0 -9.81\nsegment S0\nmass 1\ninertia 1 0 0 0 1 0 0 0 1\ncom 0 0 0\nendsegment"
        for (i = 1; i <= hinges; i++) {
            m = 4 / i
            printf "segment S%d\nparent S%d\nrt 0 0 0 xyz 0 0 %g\nrotations y\nranges -3 3\nmass %g\n", i, i - 1, (i > 1 ? -0.4 : 0), m
            printf "inertia %g 0 0 0 %g 0 0 0 %g\ncom 0 0 -0.18\nendsegment\n", 0.016 * m, 0.016 * m, 0.002 * m
            printf "marker m%da\nparent S%d\nposition 0.05 0.02 -0.1\nendmarker\n", i, i
            printf "marker m%db\nparent S%d\nposition 0 0.05 -0.35\nendmarker\n", i, i
        }
        for (i = 1; i <= hinges && muscles > 0; i++)
            printf "musclegroup g%d\nOriginParent S%d\nInsertionParent S%d\nendmusclegroup\n", i, i - 1, i
        for (k = 0; k < muscles; k++) {
            i = 1 + k % hinges; side = int(k / hinges) % 2 ? -1 : 1; y = 0.01 * (k % 7 - 3)
            printf "muscle mu%d\ntype hilldegroote\nmusclegroup g%d\n", k, i
            printf "OriginPosition %g %g %g\nInsertionPosition %g 0 -0.1\n", 0.04 * side, y, (i > 1 ? -0.3 : 0.1), 0.03 * side
            printf "optimalLength 0.15\nmaximalForce %g\ntendonSlackLength 0.05\npennationAngle 0\nendmuscle\n", 900 * hinges / muscles
        }}'
}

# excite MUSCLES SECONDS SIZE CHANGE: their excitations, each with its own phase
excite() {
    awk -v n="$1" -v last="$2" -v size="$3" -v change="$4" 'BEGIN {
        rows = int(50 * last + 1.5)
        printf "excitations\nnRows=%d\nnColumns=%d\ninDegrees=no\nendheader\ntime", rows, n + 1
        for (i = 0; i < n; i++) printf "\tmu%d", i
        for (k = 0; k < rows; k++) {
            printf "\n%.2f", k / 50
            for (i = 0; i < n; i++) printf "\t%.6f", size + change * sin(0.12 * k + 0.7 * i)
        }
        print ""}'
}

# motion NAME HINGES MUSCLES SECONDS SIZE CHANGE: model and recordings in that folder
motion() {
    mkdir "$1"
    model "$2" "$3" > "$1/model.bioMod"
    excite "$3" "$4" "$5" "$6" > "$1/excitations.sto"
    at=$(awk -v n="$2" 'BEGIN {for (i = 0; i < n; i++) printf (i ? ", 0.3" : "0.4")}')
    cat > "$1/sim.yaml" <<END
model: {file: model.bioMod}
muscle: {curves: degroote2016}
initial: {q: [$at]}
costs: [mhe.cost.min-excitation]
END
    "$sim" forward "$1/sim.yaml" --input "$1/excitations.sto" --out "$1/sim" > "$1/sim.txt" 2>&1 || fail "$1: $(cat "$1/sim.txt")"
}

# swing NAME: the same of one hinge without muscles, q(t) = 0.5 + 0.3 sin(1.6 pi t), which takes a torque
swing() {
    mkdir -p "$1/sim"
    model 1 0 > "$1/model.bioMod"
    awk 'BEGIN {
        pi = atan2(0, -1)
        print "PathFileType\t4\t(X/Y/Z)\tmarkers.trc"
        print "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames"
        print "100\t100\t40\t2\tm\t100\t1\t40\nFrame#\tTime\tm1a\t\t\tm1b\t\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n"
        for (k = 0; k < 40; k++) {
            q = 0.5 + 0.3 * sin(1.6 * pi * k / 100); c = cos(q); s = sin(q)
            printf "%d\t%.2f\t%.9f\t%.9f\t%.9f\t%.9f\t%.9f\t%.9f\n", k + 1, k / 100,
                c * 0.05 - s * 0.1, 0.02, -s * 0.05 - c * 0.1, -s * 0.35, 0.05, -c * 0.35
        }}' > "$1/sim/markers.trc"
}

# config NAME FOLDER WINDOW RATIO [LINES]: an estimate of that motion
config() {
    cat > "$2/$1.yaml" <<END
model: {file: model.bioMod}
muscle: {curves: degroote2016}
data: {markers: sim/markers.trc, emg: sim/emg.sto}
horizon: {window: $3, ratio: $4}
output: {picture: false}
integrator: {tolerance: 0, stages: 2, max_step: 0.03, activation_step: 3.4}
${5:-}
END
    grep -q '^costs' "$2/$1.yaml" ||
        echo 'costs: [{plugin: mhe.cost.track, signal: markers, sigma: 0.002}, {plugin: mhe.cost.track, signal: excitation, sigma: 0.02}]' >> "$2/$1.yaml"
}

# by NAME FOLDER WAY SOLVER: a run; its status
by() {
    rm -rf "$2/$1-$3"
    "$run" "$2/$1.yaml" --set "solver={plugin: mhe.solver.$4}" --out "$2/$1-$3" --quiet > "$2/$1-$3.txt" 2>&1
}

# settled NAME FOLDER WAY: all its windows converged; of `speed`, which need not: none is a prediction
settled() {
    ends=$(awk -v way="$3" '/^time/ {on = 1; next} on {n++; bad += way == "speed" ? $2 == 3 : $2 != 0; of[$2]++}
        END {if (n == 0 || bad > 0) {printf "%d windows,", n; for (s in of) printf " %d of status %s", of[s], s}}' "$2/$1-$3/quality.sto")
    [ -z "$ends" ] || fail "$1 $3: $ends"
}

# same NAME FOLDER [TOLERANCE]: all windows converge by both, to the same estimates; by `speed` all are answered
same() {
    count=$((count + 1))
    by "$1" "$2" robust "rti, preset: robust, tolerance: ${3:-1e-12}, max_iterations: 500" || fail "$1 robust: $(cat "$2/$1-robust.txt")"
    by "$1" "$2" ipopt "ipopt, tolerance: ${3:-1e-12}, max_iterations: 500" || fail "$1 ipopt: $(cat "$2/$1-ipopt.txt")"
    by "$1" "$2" speed 'rti, preset: speed' || fail "$1 speed: $(cat "$2/$1-speed.txt")"
    for way in robust ipopt speed; do
        settled "$1" "$2" $way
    done
    awk -v name="$1" 'FNR == 1 {file++; head = 1} /^time/ {head = 0; for (i = 1; i <= NF; i++) unit[i] = $i ~ /force|torque/ ? 1000 : 1; next}
        head {next} file == 1 {n++; for (i = 1; i <= NF; i++) a[FNR, i] = $i; next}
        {m++; for (i = 1; i <= NF; i++) {v = $i < 0 ? -$i : $i; d = a[FNR, i] - $i; d = (d < 0 ? -d : d) / (unit[i] + v); if (!(d <= most)) {most = d; where = i}}}
        END {printf "%-14s %4d estimates, %.1e apart at most\n", name, n, most; exit !(n > 0 && n == m && most <= 1e-9)}' \
        "$2/$1-robust/estimates.sto" "$2/$1-ipopt/estimates.sto" || fail "$1: robust and ipopt differ"
}

# answered NAME FOLDER: no optimum is the only one: all windows converge by default settings, to the same angles
answered() {
    count=$((count + 1))
    for solver in 'robust rti, preset: robust' 'speed rti, preset: speed' 'ipopt ipopt'; do
        by "$1" "$2" "${solver%% *}" "${solver#* }"
        settled "$1" "$2" "${solver%% *}"
    done
    paste "$2/$1-robust/estimates.sto" "$2/$1-ipopt/estimates.sto" | awk -v name="$1" '
        /^time/ {n = NF / 2; for (i = 2; i <= n; i++) angle[i] = $i ~ /^q_/; next}
        n {rows++; for (i = 2; i <= n; i++) if (angle[i]) {seen++; d = $i - $(i + n); d = d < 0 ? -d : d; if (!(d <= most)) most = d}}
        END {printf "%-14s %4d estimates, %.1e rad apart at most\n", name, rows, most; exit !(rows > 0 && seen == 2 * rows && most <= 1e-3)}' ||
        fail "$1: robust and ipopt differ in what markers say"
}

# told NAME FOLDER STATUS 'TEXT': all three end so, with this said
told() {
    count=$((count + 1))
    for solver in 'robust rti, preset: robust' 'speed rti, preset: speed' 'ipopt ipopt'; do
        by "$1" "$2" "${solver%% *}" "${solver#* }"
        status=$?
        [ $status -eq "$3" ] && grep -qF -- "$4" "$2/$1-${solver%% *}.txt" || fail "$1 $solver: status $status: $(cat "$2/$1-${solver%% *}.txt")"
    done
}

if [ "$whole" = whole ]; then
    seconds=2 muscles=300 window=200
else
    seconds=0.4 muscles=40 window=60
fi
motion usual 2 6 $seconds 0.15 0.1
motion loose 2 6 2 0.15 0.1
motion long 2 6 "$(awk -v n=$window 'BEGIN {print (n + 5) / 100}')" 0.15 0.1
motion still 2 6 $seconds 0.05 0
motion one 1 1 $seconds 0.15 0.1
motion many 2 $muscles $seconds 0.15 0.1

config usual usual 7 3
config window-2 usual 2 3
config window-long long $window 1
config one one 7 3
config many many 7 3
config fixed still 7 3 'bounds: {excitation_min: 0.05, excitation_max: 0.05}'
config equal still 7 3 'bounds: {excitation_min: 0.05, excitation_max: 0.05, activation_min: 0.05, activation_max: 0.05}'
same usual usual
same window-2 usual
same window-long long
same one one
same many many
same fixed still
same equal still

swing none
config none none 7 3 'bounds: {residual_torques: true, residual_torque_max: 100}
costs: [{plugin: mhe.cost.track, signal: markers, sigma: 0.002}, {plugin: mhe.cost.track, signal: residual_torque, value: [0], sigma: 3}]'
sed -i 's/, emg: [^}]*//' none/none.yaml
same none none 1e-9

config singular usual 7 3 'costs: [{plugin: mhe.cost.track, signal: markers, sigma: 0.002},
    {plugin: mhe.cost.track, signal: activation, value: [0.1], sigma: 0.1}]'
same singular usual
config flat loose 7 3 'costs: [{plugin: mhe.cost.track, signal: markers, sigma: 0.002}]'
answered flat loose
config upside-down usual 7 3 'bounds: {excitation_min: 0.6, excitation_max: 0.1}'
told upside-down usual 2 "bounds: 'excitation_min' is above 'excitation_max'"
config unreachable usual 7 3 'bounds: {excitation_max: 0.01, activation_min: 0.3}'
told unreachable usual 1 'every solve failed'
told unreachable usual 1 'within its bounds; activation of'
config apart usual 7 3 'bounds: {excitation_min: 0.05, excitation_max: 0.05, activation_min: 0.3, activation_max: 0.3}'
told apart usual 1 'every solve failed'
told apart usual 1 'at their bounds: activation (all of one value), excitation (all of one value)'
told apart usual 1 'bounds: excitation_min and excitation_max are both 0.05: the controls are fixed'

echo "$count configs"
[ -n "${KEEP:-}" ] && cp -r . "$KEEP"
finish ends

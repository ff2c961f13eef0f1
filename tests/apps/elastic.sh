#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# A reach simulated with elastic tendons is estimated back with them, per curve set; rigid tendons are off by far more.
#   elastic.sh BIN_DIR SOURCE_DIR
set -u
bin=$1
arm=$2/models/arm19
. "$(dirname "$0")/../support/script.sh"

printf '%s\n' reach version=1 nRows=2 nColumns=5 inDegrees=no endheader \
    "time	Arm_RotY	Arm_RotX	Arm_RotY2	LowerArm1_RotZ" "0	-0.1	-0.3	-0.1	0.1" "0.3	0	-0.42	-0.08	0.35" > reach.sto
awk -F'[<>"]' '/Muscle name=/ { name = $3 } /<max_isometric_force>/ && name != "" { print name, $3; name = "" }' \
    "$arm/arm19.osim" > strength.txt
[ "$(wc -l < strength.txt)" -eq 19 ] || fail "$(wc -l < strength.txt) muscles in arm19.osim"

# worst FORCES TRUTH: the largest RMS error of a muscle in F_max, and whose, from 0.06 s on: before, no measurement says
# where the activations come from, and those that the simulation begins with die away in about that time.
worst() {
    awk 'FILENAME == "strength.txt" { strength[$1] = $2; next }
         FNR == 1 { file++; data = 0 }
         $1 == "time" { data = 1; for (i in column) { if (index(i, file ":") == 1) delete column[i] }
             for (i = 2; i <= NF; i++) { name = $i; if (sub(/^F_/, "", name) || file == 2) { column[file ":" name] = i } } next }
         data && file == 1 { for (m in strength) truth[$1 ":" m] = $column["1:" m] }
         data && file == 2 && $1 >= 0.06 && ($1 ":BRA") in truth { rows++
             for (m in strength) { d = ($column["2:" m] - truth[$1 ":" m]) / strength[m]; sum[m] += d * d } }
         END { for (m in sum) { rms = sqrt(sum[m] / rows); if (rms >= most) { most = rms; of = m } }
             print (rows > 15 ? most : "rows=" rows + 0), of }' strength.txt "$2" "$1"
}
# holds 'EXPRESSION' for awk
holds() { awk "BEGIN { exit !($1) }"; }

for curves in degroote2016 thelen2003 millard2012; do
    "$bin/mhe-sim" follow "$arm/demo_motion.yaml" --input reach.sto --out "truth-$curves" --set "muscle.curves=$curves" \
        --set muscle.tendon=elastic --set solver.plugin=mhe.solver.rti --set integrator.max_step=0.01 \
        --set horizon.window=6 > /dev/null 2> err.txt || fail "mhe-sim, $curves: $(cat err.txt)"
    cat > estimate.yaml << EOF
model: {file: $arm/arm19.osim}
muscle: {curves: $curves, tendon: elastic, damping: 0.1}
data: {markers: truth-$curves/markers.trc, emg: truth-$curves/emg.sto, reference: truth-$curves/reference.sto}
initial: {q: [-0.1, -0.3, -0.1, 0.1], qdot: [0, 0, 0, 0]}
horizon: {window: 7, ratio: 1}
integrator: {plugin: mhe.integrator.rk, max_step: 0.01}
costs: [{plugin: mhe.cost.emg-markers-high}]
solver: {plugin: mhe.solver.rti, preset: balanced}
EOF
    for tendon in elastic rigid; do
        "$bin/mhe-run" estimate.yaml --quiet --set "muscle.tendon=$tendon" --out "$tendon" > /dev/null 2> err.txt ||
            fail "mhe-run, $curves, $tendon: $(cat err.txt)"
        worst "$tendon/forces.sto" "truth-$curves/reference.sto" > "$tendon.txt"
    done
    echo "$curves: largest RMS error of a muscle in F_max: elastic $(cat elastic.txt), rigid $(cat rigid.txt)"
    holds "$(cut -d' ' -f1 elastic.txt) < 0.005" || fail "$curves, elastic: $(cat elastic.txt)"
    holds "$(cut -d' ' -f1 rigid.txt) > 0.02" || fail "$curves, rigid: $(cat rigid.txt)"
done

# Bad input: one line, status 2.
"$bin/mhe-run" estimate.yaml --quiet --set muscle.damping=0.001 --out bad > /dev/null 2> err.txt
[ $? -eq 2 ] || fail "damping 0.001 is taken"
grep -q 'an elastic tendon needs at least 0.01' err.txt || fail "damping 0.001: $(cat err.txt)"
"$bin/mhe-run" estimate.yaml --quiet --set integrator.scheme=gauss --out bad > /dev/null 2> err.txt
[ $? -eq 2 ] || fail "gauss is taken"
grep -q 'radau' err.txt || fail "gauss: $(cat err.txt)"
"$bin/mhe-run" estimate.yaml --quiet --set muscle.curves=paper2021 --set muscle.damping=-1 --out bad > /dev/null 2> err.txt
[ $? -eq 2 ] || fail "paper2021 has elastic tendons"

finish "elastic"

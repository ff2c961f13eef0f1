#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Plugins that the core has never heard of: muscles with three states and a force with inputs go through mhe-sim, mhe-run,
# mhe-bench and the conformance checks; mistakes in them, and in external loads, are one line with file:line and status 2.
#   seam.sh BIN_DIR CONFORMANCE PLUGIN_FOLDER SOURCE_DIR
set -u
bin=$1
conformance=$2
plugins=$3
arm=$4/models/arm19
. "$(dirname "$0")/../support/script.sh"
MHE_PLUGIN_PATH=$plugins
export MHE_PLUGIN_PATH

"$conformance" "$plugins/seam_plugins.so" > conformance.txt 2>&1 || fail "conformance: $(cat conformance.txt)"
grep -q '0 failed, 0 skipped' conformance.txt || fail "conformance: $(tail -n 1 conformance.txt)"

# A motion under excitations, then estimated with the same muscles and force.
cat > sim.yaml << END
model: {plugin: mhe.model.simbody, file: $arm/arm19.osim}
muscle: {plugin: test.muscle.three}
forces: [{plugin: test.force.push}]
costs: [mhe.cost.min-excitation]
initial: {q: [-0.1, -0.3, -0.1, 0.4], qdot: [0, 0, 0, 0]}
END
sed -n 's/^time/&/p' "$arm/demo_emg.sto" > muscles.txt
awk 'BEGIN {print "e\nversion=1\nnRows=19\nnColumns=19\ninDegrees=no\nendheader"; getline; print; n = NF
    for (k = 0; k <= 18; k++) {
        printf "%g", k / 100
        for (i = 2; i <= n; i++) printf "\t%g", 0.06 + 0.04 * sin(k / 5 + i)
        print ""
    }}' muscles.txt > e.sto
"$bin/mhe-sim" forward sim.yaml --input e.sto --rate 100 --out motion > sim.txt 2>&1 || fail "mhe-sim: $(cat sim.txt)"
head -n 12 motion/reference.sto | tr '\t' '\n' > columns.txt
grep -q '^lag_BRA$' columns.txt || fail "no column lag_BRA"
[ "$(grep -c '^lag_' columns.txt)" -eq 19 ] && [ "$(grep -c '^fatigue_' columns.txt)" -eq 18 ] || fail "columns of other states"
cat > run.yaml << END
model: {plugin: mhe.model.simbody, file: $arm/arm19.osim}
muscle: {plugin: test.muscle.three}
forces: [{plugin: test.force.push}]
data: {markers: motion/markers.trc, emg: motion/emg.sto, reference: motion/reference.sto}
horizon: {window: 3, ratio: 1}
costs: [mhe.cost.emg-markers-high]
output: {picture: false}
END
for formulation in excitation activation; do
    "$bin/mhe-run" run.yaml --quiet --set formulation=$formulation --out $formulation > run.txt 2>&1 ||
        fail "mhe-run, $formulation: $(cat run.txt)"
    # all windows answered, the markers met
    awk '/endheader/ {getline; data = 1; next} data {n++; bad += $2 == 3; far += $6 > 0.003}
        END {exit !(n > 12 && bad == 0 && far == 0)}' $formulation/quality.sto || fail "$formulation: $(cat $formulation/quality.sto)"
done
"$bin/mhe-bench" run.yaml --quick --repeats 1 --out bench > bench.txt 2>&1 || fail "mhe-bench: $(cat bench.txt)"
grep -q 'shooting interval with A and B' bench.txt || fail "mhe-bench: $(cat bench.txt)"

# Without the force the same estimate finds other moments: it does act.
"$bin/mhe-run" run.yaml --quiet --set 'forces=[]' --out without > run.txt 2>&1 || fail "without: $(cat run.txt)"
cmp -s without/forces.sto excitation/forces.sto && fail "the force makes no difference"

# refused NAME 'TEXT' ARGUMENTS: status 2 and one line that says TEXT
refused() {
    name=$1
    text=$2
    shift 2
    "$@" > refused.out 2> refused.txt
    [ $? -eq 2 ] || fail "$name: status is not 2: $(cat refused.txt)"
    [ "$(grep -c . refused.txt)" -eq 1 ] || fail "$name: not one line: $(cat refused.txt)"
    grep -qF -- "$text" refused.txt || fail "$name: $(cat refused.txt)"
}
refused 'no state' 'run.yaml:2: test.muscle.three: layout() gives 0 states a muscle; 1 to 8 can be' \
    "$bin/mhe-run" run.yaml --quiet --out bad --set muscle.states=0
refused 'many states' 'layout() gives 99 states' "$bin/mhe-run" run.yaml --quiet --out bad --set muscle.states=99
sed 's/push}/push, fault: nan}/' run.yaml > nan.yaml
refused NaN 'nan.yaml:3: forces.0: test.force.push: a force is not finite' "$bin/mhe-run" nan.yaml --quiet --out bad
sed 's/push}/push, fault: short}/' run.yaml > short.yaml
refused 'short inputs' 'short.yaml:3: forces.0: test.force.push: its inputs are known from 0 to 0.1 s' \
    "$bin/mhe-run" short.yaml --quiet --out bad
sed 's/push}/fed}/' run.yaml > fed.yaml
refused 'no data' "fed.yaml:3: forces.0: test.force.fed: its 2 inputs ('torque' ...) come with the frames" \
    "$bin/mhe-run" fed.yaml --quiet --out bad
refused 'no data, bench' 'fed.yaml:3: forces.0: test.force.fed: ' "$bin/mhe-bench" fed.yaml --quick --out bad
sed 's/push}/push}, {plugin: test.force.fed}/' run.yaml > twice.yaml
refused 'one name twice' "twice.yaml:3: forces.1: test.force.fed: a force before it has inputs named 'push' too" \
    "$bin/mhe-run" twice.yaml --quiet --out bad
sed 's/^forces:.*/forces: coordinate-limit/' run.yaml > list.yaml
refused 'no list' 'list.yaml:3: forces: a list is needed' "$bin/mhe-run" list.yaml --quiet --out bad

# External loads.
load() {
    cat > "$1" << END
<ExternalLoads name="loads"><objects>
<ExternalForce name="weight"><applied_to_body>$2</applied_to_body>
<point_expressed_in_body>$2</point_expressed_in_body>
<force_identifier>$3</force_identifier><point_identifier>p_</point_identifier></ExternalForce>
</objects><datafile>loads.mot</datafile></ExternalLoads>
END
}
table() {
    printf 'loads\nversion=1\nnRows=2\nnColumns=6\ninDegrees=no\nendheader\ntime\tf_x\tf_y\tf_z\tp_x\tp_y\tp_z\n'
    printf '0\t0\t-5\t0\t0\t-0.1\t0\n%s\t0\t-5\t0\t0\t-0.1\t0\n' "$1"
}
sed 's/^data: {/data: {external_loads: loads.xml, /; s/^forces:.*/forces: []/' run.yaml > loads.yaml
load loads.xml hand f_
table 2 > loads.mot
"$bin/mhe-run" loads.yaml --quiet --out loaded > run.txt 2>&1 || fail "loads: $(cat run.txt)"
cmp -s without/forces.sto loaded/forces.sto && fail "the load makes no difference"
"$bin/mhe-run" loaded/config.yaml --quiet --out again > run.txt 2>&1 || fail "resolved: $(cat run.txt)"
cmp -s again/forces.sto loaded/forces.sto || fail "the resolved configuration is another"
table 0.1 > loads.mot
refused 'short loads' 'loads.yaml:4: forces.0: mhe.force.external-loads: its inputs are known from 0 to 0.1 s, the motion is from 0 to 0.18 s' \
    "$bin/mhe-run" loads.yaml --quiet --out bad
table 2 > loads.mot
load loads.xml fist f_
refused 'no body' "loads.xml:2: applied_to_body: the model has no body 'fist'" "$bin/mhe-run" loads.yaml --quiet --out bad
load loads.xml hand force_
refused 'no column' "has no column 'force_x'" "$bin/mhe-run" loads.yaml --quiet --out bad
rm loads.xml
refused 'no file' 'loads.xml: ' "$bin/mhe-run" loads.yaml --quiet --out bad

finish seam

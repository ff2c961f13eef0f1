#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# mhe-model scale: an arm a tenth larger than the one shipped, and every kind of wrong setup.
#   scale.sh PATH/mhe-model SOURCE_DIR
set -u
model=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp "$2/models/arm19/arm19.osim" "$work"
awk 'NR < 7 { print; next } { for (i = 3; i <= NF; i++) $i = 1.1 * $i; print }' OFS='\t' "$2/models/arm19/demo_markers.trc" \
    > "$work/large.trc"
cd "$work" || exit 1
failed=0

fail() {
    echo "FAILED $1"
    failed=$((failed + 1))
}

# setup 'PAIR' 'BODY' 'RANGE': a setup.xml with one measurement
setup() {
    cat > setup.xml <<EOF
<OpenSimDocument Version="40000">
<ScaleTool name="large">
<mass>80</mass>
<GenericModelMaker><model_file>arm19.osim</model_file></GenericModelMaker>
<ModelScaler>
<apply>true</apply>
<scaling_order>measurements</scaling_order>
<MeasurementSet><objects><Measurement name="arm"><apply>true</apply>
<MarkerPairSet><objects><MarkerPair><markers>$1</markers></MarkerPair></objects></MarkerPairSet>
<BodyScaleSet><objects><BodyScale name="$2"><axes>X Y Z</axes></BodyScale></objects></BodyScaleSet>
</Measurement></objects></MeasurementSet>
<marker_file>large.trc</marker_file>
<time_range>$3</time_range>
<preserve_mass_distribution>true</preserve_mass_distribution>
</ModelScaler>
</ScaleTool>
</OpenSimDocument>
EOF
}

# refuses NAME 'TEXT' [setup]: status 2, one line with the text, no model
refuses() {
    rm -f out.osim
    "$model" scale "${3:-setup.xml}" --out out.osim > answer 2> stderr.txt
    status=$?
    [ $status -eq 2 ] || fail "$1: status $status"
    [ "$(grep -c . stderr.txt)" -eq 1 ] || fail "$1: not one line: $(cat stderr.txt)"
    grep -qF -- "$2" stderr.txt || fail "$1: '$2' is not in: $(cat stderr.txt)"
    [ ! -e out.osim ] || fail "$1: a model was written"
}

setup 'ARMl EPICl' Arm '0 1'
"$model" scale setup.xml --out out.osim > answer 2> stderr.txt || fail "scale: $(cat stderr.txt)"
grep -q '^Arm  *1.100000  *1.100000  *1.100000$' answer || fail "factors: $(cat answer)"
grep -q '^LowerArm1 .*(as it was)$' answer || fail "untouched: $(cat answer)"
grep -q '^mass 80.000 kg' answer || fail "mass: $(cat answer)"
"$model" info out.osim --json > scaled.json || fail 'the scaled model cannot be read'
grep -q -- '-0.19162' out.osim || fail 'ARMl is not 1.1 times as far'

setup 'ARMl EPIC' Arm '0 1'
refuses marker "setup.xml:9: measurement 'arm': the model has no marker 'EPIC'"
setup 'ARMl' Arm '0 1'
refuses pair 'setup.xml:9: <markers> of a MarkerPair takes two names'
setup 'ARMl ARMl' Arm '0 1'
refuses place "'ARMl' and 'ARMl' are at the same place in the model"
setup 'ARMl EPICl' Arm '10 11'
refuses range 'no frame of'
setup 'ARMl EPICl' Arm '0 1'
sed 's/<scaling_order>measurements/<scaling_order>measurement/' setup.xml > order.xml
refuses order "<scaling_order> takes measurements, manualScale or both, not 'measurement'" order.xml
sed 's/large.trc/small.trc/' setup.xml > trial.xml
refuses trial 'small.trc' trial.xml
sed 's/<apply>true/<apply>false/' setup.xml > nothing.xml
refuses nothing 'nothing.xml:2: nothing to do' nothing.xml
sed 's/ScaleTool/InverseKinematicsTool/' setup.xml > tool.xml
refuses tool 'no Scale setup: there is no <ScaleTool>' tool.xml
head -5 setup.xml > cut.xml
refuses cut 'not XML' cut.xml
refuses absent 'absent.xml' absent.xml
setup 'ARMl EPICl' Arms '0 1'
"$model" scale setup.xml --out out.osim > answer 2> stderr.txt || fail "body: $(cat stderr.txt)"
grep -qF "setup.xml:8: the model has no body 'Arms' (did you mean 'Arm'?): passed over" stderr.txt ||
    fail "body: $(cat stderr.txt)"
[ $failed -eq 0 ] || exit 1

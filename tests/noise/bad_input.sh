#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# mhe-sim noise: the shipped example, the same bits again, and every kind of wrong input: exit status 2, one line that
# names the fault, nothing written.
#   bad_input.sh PATH/mhe-sim SOURCE_DIR
set -u
sim=$1
arm=$2/models/arm19
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
failed=0
count=0
want=2

fresh() {
    cp "$arm"/arm19.osim "$arm"/demo_reference.sto "$arm"/noise.yaml .
}

wrong() {
    echo "FAILED $*"
    failed=$((failed + 1))
}

# expect NAME 'TEXT IN THE MESSAGE' [arguments behind the command, instead of noise.yaml]
expect() {
    name=$1 text=$2
    shift 2
    [ $# -gt 0 ] || set -- noise.yaml
    rm -rf result
    "$sim" noise --out result "$@" > stdout.txt 2> stderr.txt < /dev/null
    status=$?
    count=$((count + 1))
    message=$(grep -v 'warning:' stderr.txt)
    lines=$(printf '%s\n' "$message" | grep -c .)
    if [ "$status" -ne $want ] || [ "$lines" -ne 1 ] || [ -e result ]; then
        wrong "$name: status $status, $lines lines, $(find result 2>/dev/null | wc -l) files: $message"
    elif ! printf '%s' "$message" | grep -qF -- "$text"; then
        wrong "$name: '$text' is not in: $message"
    fi
    fresh
}

# same NAME: the files of `first` and `second` are equal
same() {
    count=$((count + 1))
    for file in markers.trc emg.sto noise.yaml; do
        cmp -s first/$file second/$file || wrong "$1: $file differs"
    done
}

fresh
no_picture='output.picture=false'
OMP_NUM_THREADS=1 "$sim" noise noise.yaml --out first > /dev/null || wrong "the shipped example"
OMP_NUM_THREADS=8 "$sim" noise noise.yaml --out second > /dev/null || wrong "the shipped example"
same "same seed"
"$sim" noise first/noise.yaml --out second --set $no_picture --set output.picture=true > /dev/null
same "the resolved configuration"
"$sim" noise noise.yaml --out second --set noise.seed=2 --set $no_picture > /dev/null
for file in markers.trc emg.sto; do
    cmp -s first/$file second/$file && wrong "another seed makes the same $file"
done

expect no-config 'nowhere.yaml' nowhere.yaml
expect no-arguments 'a config file is needed' --set a=b
expect unknown-option "did you mean '--out'" noise.yaml --ot x
expect option-of-another-command "unknown option '--rate'" noise.yaml --rate 3
expect two-configs 'one config file at a time' noise.yaml noise.yaml
expect out-without-folder '--out needs a value' noise.yaml --out
sed -i 's/level: 1.5/levl: 1.5/' noise.yaml
expect unknown-key "noise.yaml:9: noise.emg: unknown key 'levl' (did you mean 'level'?)"
sed -i 's/sd: 0.005/sd: 5/' noise.yaml
expect millimetres 'noise.yaml:8'
sed -i 's/sd: 0.005/sd: five/' noise.yaml
expect wrong-type 'noise.yaml:8'
sed -i 's/seed: 1/seed: -1/' noise.yaml
expect seed 'noise.yaml:7'
sed -i 's/level: 1.5/level: 1, failures: {BRX: 1..2}/' noise.yaml
expect unknown-muscle "noise.yaml:9: failures: 'BRX' is no muscle of the model (did you mean"
sed -i 's/level: 1.5/crosstalk: {BRA: BRD}/' noise.yaml
expect no-fraction "noise.yaml:9: crosstalk: 'BRD' of 'BRA'"
sed -i 's/sd: 0.005/gaps: {DELTT: 1..2}/' noise.yaml
expect unknown-marker "noise.yaml:8: gaps: 'DELTT' is no marker"
sed -i 's/sd: 0.005/segment_gaps: {Leg: 1..2}/' noise.yaml
expect unknown-segment "noise.yaml:8: segment_gaps: 'Leg' is no segment"
sed -i 's/sd: 0.005/gaps: {DELT: 2..1}/' noise.yaml
expect span-backwards "noise.yaml:8: gaps: '2..1' of 'DELT'"
expect set-unknown "gap" noise.yaml --set noise.markers.gap.DELT=1..2
expect set-span "gaps: 'soon' of 'DELT'" noise.yaml --set 'noise.markers.gaps={DELT: soon}'
expect too-few-samples 'more than 32 samples' noise.yaml --set noise.emg.rate=5
rm arm19.osim
expect missing-model 'arm19.osim'
rm demo_reference.sto
expect missing-reference 'demo_reference.sto'
sed -i 's/q_Arm_RotX/q_Leg/' demo_reference.sto
expect reference-without-angle 'demo_reference.sto: the reference has 3 of'
sed -i 's/e_BRA/x_BRA/' demo_reference.sto
expect reference-without-excitation "no excitation of 'BRA'"
sed -i '20s/^\([0-9.]*\)\t[-0-9.e]*/\1\tnan/' demo_reference.sto
expect reference-with-gap "no value of 'Arm_RotY' at 0.12 s"
head -c 4000 /dev/urandom > demo_reference.sto
expect random-bytes 'demo_reference.sto'
mkdir kept
mv noise.yaml kept
expect own-config 'kept/noise.yaml would be overwritten' kept/noise.yaml --set reference="$arm/demo_reference.sto" \
    --set model.file="$arm/arm19.osim" --out kept
cmp -s kept/noise.yaml "$arm/noise.yaml" || wrong "own-config: it was"
want=1
expect output-is-a-file 'stdout.txt' noise.yaml --out stdout.txt/x

echo "$((count - failed)) passed, $failed failed"
[ "$failed" -eq 0 ]

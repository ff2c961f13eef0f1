#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Every kind of wrong input: exit status 2, one line that names the fault, nothing written.
#   bad_input.sh PATH/mhe-run SOURCE_DIR
set -u
run=$1
demo=$2/models/arm19
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp "$demo"/arm19.osim "$demo"/demo* "$work"
cd "$work" || exit 1
failed=0
count=0
want=2

# expect NAME 'TEXT IN THE MESSAGE' [arguments of mhe-run, instead of demo.yaml]
expect() {
    name=$1 text=$2
    shift 2
    [ $# -gt 0 ] || set -- demo.yaml
    rm -rf result
    "$run" --out result --quiet "$@" > stdout.txt 2> stderr.txt < /dev/null
    status=$?
    count=$((count + 1))
    message=$(grep -v 'warning:' stderr.txt)
    lines=$(printf '%s\n' "$message" | grep -c .)
    files=$(find result -type f 2>/dev/null | wc -l)
    if [ "$status" -ne $want ] || [ "$lines" -ne 1 ] || [ "$files" -ne 0 ]; then
        echo "FAILED $name: status $status, $lines lines, $files files written: $message"
        failed=$((failed + 1))
    elif ! printf '%s' "$message" | grep -qF -- "$text"; then
        echo "FAILED $name: '$text' is not in: $message"
        failed=$((failed + 1))
    fi
    cp "$demo"/arm19.osim "$demo"/demo* .
}

# warn NAME 'TEXT IN A WARNING' [arguments]: it is said, and the run would go on
warn() {
    name=$1 text=$2
    shift 2
    [ $# -gt 0 ] || set -- demo.yaml
    count=$((count + 1))
    if ! "$run" --check "$@" > stdout.txt 2> stderr.txt || ! grep 'warning:' stderr.txt | grep -qF -- "$text"; then
        echo "FAILED $name: no warning with '$text': $(cat stderr.txt)"
        failed=$((failed + 1))
    fi
    cp "$demo"/arm19.osim "$demo"/demo* .
}

# edit FILE 'SED SCRIPT'
edit() { sed -i "$2" "$1"; }

expect no-config 'nowhere.yaml' nowhere.yaml
expect no-arguments 'config file' --set a=b
expect unknown-option "did you mean '--quiet'" demo.yaml --quit
expect folder-as-config 'models' "$2/models"

edit demo.yaml 's/demo_markers/demo_marker/'
expect absent-markers "demo.yaml:6: $work/demo_marker.trc: cannot be opened: No such file or directory (did you mean 'demo_markers.trc'?)"
edit demo.yaml 's/arm19.osim/arm91.osim/'
expect absent-model "demo.yaml:4: $work/arm91.osim: cannot be opened"

edit demo.yaml 's/^horizon:.*/horizon: {windw: 7}/'
expect unknown-key "did you mean 'window'"
edit demo.yaml 's/window: 7/window: seven/'
expect wrong-type 'demo.yaml:8'
edit demo.yaml 's/window: 7/window: -1/'
expect out-of-range 'window'
echo 'solver: mhe.solver.ipot' >> demo.yaml
expect unknown-plugin "did you mean 'mhe.solver.ipopt'"
echo 'solver: mhe.muscle.hill' >> demo.yaml
expect wrong-kind-of-plugin 'mhe.muscle.hill'
echo 'solver: {tolerence: 1e-4}' >> demo.yaml
expect plugin-option "did you mean 'tolerance'"
expect bad-set 'window' demo.yaml --set horizon.window=0
expect set-unknown 'horizon' demo.yaml --set horzon.window=3
edit demo.yaml 's/q: \[[^]]*\]/q: [0, 0]/'
expect initial-size 'has 2 values'
printf 'model: [unclosed\n' > demo.yaml
expect not-yaml 'demo.yaml:'

rm arm19.osim
expect missing-model 'arm19.osim'
printf '<OpenSimDocument><Model>' > arm19.osim
expect broken-model 'arm19.osim:1'
edit arm19.osim '0,/<mass>[0-9.]*</s//<mass>-1</'
expect negative-mass 'mass'
edit arm19.osim '0,/<PathPoint/!s#/bodyset/LowerArm1<#/bodyset/LoweArm1<#'
expect unknown-body "did you mean 'LowerArm1'"

rm demo_markers.trc
expect missing-markers 'demo_markers.trc'
edit demo_markers.trc 's/DELT/DELTT/'
warn typing-slip "did you mean 'DELT'"
edit demo_markers.trc '4s/\t\([A-Z][A-Za-z_]*\)/\t\1zzzzzzzzzzzz/g;4s/Timezzzzzzzzzzzz/Time/'
expect no-marker-matches 'no column is a marker'
edit demo_markers.trc '3s/mm/m/'
warn wrong-unit 'they are taken as mm'
awk -F '\t' -v OFS='\t' 'NR > 6 {for (i = 3; i <= NF; i++) $i += 9000} 1' "$demo"/demo_markers.trc > demo_markers.trc
expect another-place 'within a metre'
edit demo_markers.trc '20s/^\([0-9]*\)\t[0-9.e-]*/\1\tnan/'
expect nan-time 'demo_markers.trc:20'
edit demo_markers.trc '20s/^\([0-9]*\)\t[0-9.e-]*/\1\t0/'
expect decreasing-time 'demo_markers.trc:20'
edit demo_markers.trc '20s/$/\t1\t2\t3\t4/'
warn too-many-cells 'demo_markers.trc:20: this row has'
edit demo_markers.trc '20s/\t[0-9.-]*$/\tabc/'
expect no-number 'demo_markers.trc:20'
awk -F '\t' -v OFS='\t' 'NR == 3 {$1 = 0.1} NR > 6 {$2 *= 1000} 1' "$demo"/demo_markers.trc > demo_markers.trc
expect markers-in-ms 'demo_markers.trc:8: rows are 10 s apart (0.1 Hz): are its times in ms instead of s?'
awk -F '\t' -v OFS='\t' 'NR > 6 {$2 *= 1000} 1' "$demo"/demo_markers.trc > demo_markers.trc
warn markers-in-ms-by-the-header 'the header says 100 Hz, the times 0.1 Hz: they are taken as ms'
edit demo_markers.trc '10,$d'
expect three-frames '3 frames are too few'
: > demo_markers.trc
expect empty-markers 'demo_markers.trc'

rm demo_emg.sto
expect missing-emg 'demo_emg.sto'
edit demo_emg.sto 's/TricepsLong/TricepLong/'
warn emg-slip "did you mean 'TricepsLong'"
edit demo_emg.sto 's/endheader/endhead/'
expect no-endheader 'demo_emg.sto'
head -c 4000 /dev/urandom > demo_emg.sto
expect random-bytes 'demo_emg.sto'
awk -F '\t' -v OFS='\t' 'NR > 7 {$1 *= 1000} 1' "$demo"/demo_emg.sto > demo_emg.sto
expect emg-in-ms 'are its times in ms instead of s?'
awk -F '\t' -v OFS='\t' 'NR > 7 {$1 *= 1000} 1' "$demo"/demo_emg.sto > demo_emg.sto
sed 's/markers: demo_markers.trc, //' "$demo"/demo.yaml > demo.yaml
expect emg-alone-in-ms 'are its times in ms instead of s?'
awk 'BEGIN {print "endheader\ntime\tArm_RotX"; for (k = 0; k < 50; k++) print 10 * k "\t0.1"}' > angles.mot
sed 's/markers: demo_markers.trc, emg: demo_emg.sto/angles: angles.mot/' "$demo"/demo.yaml > demo.yaml
expect angles-in-ms 'angles.mot:4: rows are 10 s apart'
expect emg-elsewhere 'no time in common' demo.yaml --set data.emg_offset=100
head -c 3000 /dev/urandom > demo.c3d
expect c3d-random-bytes 'demo.c3d' demo.yaml --set data.markers=demo.c3d

# raw EMG: two seconds at 1000 Hz of two electrodes, in V
raw() { # [expression of a and b for each row k]
    awk "BEGIN {print \"endheader\\ntime\\tA\\tB\"; srand(1); for (k = 0; k < 3000; k++) {
        a = b = 1e-4 * (rand() - 0.5); $1; print k / 1000 \"\\t\" a \"\\t\" b}}" > raw.sto
    sed 's/emg: demo_emg.sto/emg: raw.sto/' "$demo"/demo.yaml > raw.yaml
    cat >> raw.yaml <<'END'
emg:
  channels:
    - {name: A, muscles: [BRA, BRD], mvc: 1e-4}
    - {name: B, muscles: [Deltoid1], mvc: 1e-4}
END
}
raw 'a *= 1000'
expect emg-in-mv 'are EMG and MVC in the same unit' raw.yaml
raw ''
sed -i 's/, mvc: 1e-4//' raw.yaml
expect emg-without-mvc "raw EMG needs an 'mvc' of each channel" raw.yaml
raw 'a *= 5e3'
sed -i '/name: A/s/, mvc: 1e-4//' raw.yaml
warn emg-one-without-mvc 'without an MVC, whose envelopes are taken as shares of it: A' raw.yaml
raw 'a /= 1e4; b /= 1e4'
expect emg-in-kv 'no channel reaches 1 % of its MVC' raw.yaml
raw ''
warn channel-slip 'no column for the channel: AA' raw.yaml --set emg.channels.0.name=AA
expect channel-muscle "did you mean 'BRA'" raw.yaml --set emg.channels.0.muscles=BRAA
expect band-too-high 'half of the rate' raw.yaml --set emg.band_high=600
raw 'if (b > 2e-5) b = 2e-5'
warn emg-saturated '(amplifier saturated?): B (' raw.yaml
raw 'a = 0'
warn emg-flat '(electrode off?) are not tracked there: A (100 %)' raw.yaml
raw 'if (k < 1000) b = "nan"'
warn emg-late 'not tracked there: B (33.3 %)' raw.yaml
edit demo_reference.sto 's/q_Arm_RotX/q_Leg/'
expect reference-columns 'demo_reference.sto'
want=1
expect output-is-a-file 'stdout.txt' demo.yaml --out stdout.txt/x

echo "$((count - failed)) passed, $failed failed"
[ "$failed" -eq 0 ]

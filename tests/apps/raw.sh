#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The shipped recording with raw EMG, whose truth is known: what the log names, and errors beside those of the same run
# without filters. The bounds are what was measured (in docs/raw-emg.md) and a tenth more; without EMG errors 'at least' too.
#   raw.sh BIN_DIR SOURCE_DIR
set -u
bin=$1
arm=$2/models/arm19
. "$(dirname "$0")/../support/script.sh"

# within NAME KEY LOW HIGH
within() {
    awk "BEGIN { exit !($(number "$2" "$1") > $3 && $(number "$2" "$1") < $4) }" ||
        fail "$1: $2 is $(number "$2" "$1"), not between $3 and $4"
}

# run NAME [arguments]
run() {
    name=$1
    shift
    "$bin/mhe-run" "$arm/demo_raw.yaml" --out "$name" --set output.picture=false "$@" > "$name.txt" 2>&1 ||
        fail "$name: exit status $?: $(cat "$name.txt")"
    within "$name" converged 0.99 1.01
}

run raw
grep -qF 'EMG 2000 Hz, markers 100 Hz, grid 100 Hz, offset 0 ms; 9 channels for 14 muscles' raw.txt ||
    fail "rates, grid and channels: $(cat raw.txt)"
grep -q 'EMG and estimate are 0\.[0-9]* apart (RMS, of 1; 14 muscles)' raw.txt || fail "EMG and estimate: $(cat raw.txt)"
grep -q "filters' delay is 38.4 ms" raw.txt || fail "the filters' delay: $(cat raw.txt)"
within raw filter_delay_ms 38.3 38.5
within raw lag_ms 38.3 38.5
grep -q 'from electrode to estimate: filters 38.4 ms, window 70 ms, then' raw.txt || fail "the latency: $(cat raw.txt)"
awk '/"latency_ms"/ {seen = 1} seen && /"p50"/ {gsub(/[^0-9.]/, "", $2); low = $2}
     seen && /"p99"/ {gsub(/[^0-9.]/, "", $2); high = $2; exit} END {exit !(low > 108.3 && high >= low && high < 5000)}' \
    raw/summary.json || fail "emg.latency_ms: $(grep -A 3 '"latency_ms"' raw/summary.json)"
within raw q_deg 0.11 0.133
within raw force_n 5.6 6.84
within raw marker_mm 0.44 0.54

# The same markers with the excitations themselves.
run normalised --set data.emg=demo_emg.sto --set 'emg={}'
within normalised q_deg 0.11 0.132
within normalised force_n 1.3 1.63

# Filters that look ahead have no delay.
run ahead --set emg.zero_phase=true
within ahead force_n 3.9 4.75
within ahead filter_delay_ms -0.001 0.001

# mhe-sim makes the shipped recording: the same bytes, but for the last digits of another mathematical library.
"$bin/mhe-sim" noise "$arm/demo_recording.yaml" --out made > /dev/null || fail "mhe-sim noise"
[ "$(wc -c < made/recording.c3d)" -eq "$(wc -c < "$arm/demo_recording.c3d")" ] || fail "recording.c3d has another size"
differing=$(cmp -l made/recording.c3d "$arm/demo_recording.c3d" | wc -l)
[ "$differing" -lt 100 ] || fail "recording.c3d differs in $differing bytes"
"$bin/mhe-sim" noise "$arm/demo_recording.yaml" --out other --set noise.seed=2 > /dev/null || fail "seed 2"
cmp -s made/recording.c3d other/recording.c3d && fail "another seed, the same recording"
"$bin/mhe-sim" noise "$arm/demo_recording.yaml" --out odd --set noise.raw_emg.rate=1999 > /dev/null 2> odd.txt
[ $? -eq 2 ] && grep -q 'must be a multiple of the markers' odd.txt || fail "1999 Hz: $(cat odd.txt)"

# The recording with every kind of error (docs/recording.md): made again, estimated, and believed.
"$bin/mhe-sim" noise "$arm/lab_recording.yaml" --out lab_made > /dev/null || fail "mhe-sim noise, lab"
[ "$(wc -c < lab_made/recording.c3d)" -eq "$(wc -c < "$arm/lab_recording.c3d")" ] || fail "lab: another size"
[ "$(cmp -l lab_made/recording.c3d "$arm/lab_recording.c3d" | wc -l)" -lt 100 ] || fail "lab: it is another recording"
"$bin/mhe-run" "$arm/lab.yaml" --out lab --set output.picture=false > lab.txt 2>&1 || fail "lab: $(cat lab.txt)"
grep -qx 'usable: yes' lab.txt || fail "lab: $(cat lab.txt)"
within lab q_deg 0.357 0.437
within lab force_n 9.2 11.2

finish "raw EMG"

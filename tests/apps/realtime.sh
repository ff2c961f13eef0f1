#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# mhe-run --realtime on the demo: takes as long as the recording lasts and says what came of it. No time is judged but that.
#   realtime.sh PATH/mhe-run SOURCE_DIR
set -u
run=$1
demo=$2/models/arm19/demo.yaml
. "$(dirname "$0")/../support/script.sh"

begin=$(date +%s%N)
"$run" "$demo" --realtime --quiet --out live --set 'solver={plugin: mhe.solver.rti, preset: speed}' \
    --set output.picture=false > out.txt 2> err.txt || fail "exit status $?: $(cat err.txt)"
lasted=$((($(date +%s%N) - begin) / 1000000))
[ "$lasted" -ge 3000 ] || fail "3 s of frames came within $lasted ms"
for text in 'by the clock' 'frames missed' 'latency' 'jitter'; do
    grep -qF -- "$text" out.txt || fail "'$text' is not on the terminal"
done
for key in realtime missed_frames latency_ms jitter_ms p99.9 rate_hz delay_s; do
    grep -qF "\"$key\"" live/summary.json || fail "no '$key' in summary.json"
done
grep -q '"node":[[:space:]]*7' live/summary.json || fail "estimates are not of the newest frame"
grep -q '"delay_s":[[:space:]]*0,' live/summary.json || fail "the newest frame is late"

# From the file the oldest node is given, 7 intervals of 30 ms late.
"$run" "$demo" --quiet --out file --set 'solver={plugin: mhe.solver.rti, preset: speed}' --set output.picture=false \
    > out.txt 2> err.txt || fail "exit status $?: $(cat err.txt)"
grep -q '"node":[[:space:]]*0' file/summary.json || fail "estimates are not of the oldest frame"
grep -q '"delay_s":[[:space:]]*0.2[01]' file/summary.json || fail "the delay is not 0.21 s"
grep -q '"realtime"' file/summary.json && fail "a run from files by the clock"
"$run" --check "$demo" --set output.node=8 > out.txt 2> err.txt && fail "node 8 of 7 was taken"
grep -qF "'8' is no node" err.txt || fail "the message: $(cat err.txt)"

finish "by the clock"

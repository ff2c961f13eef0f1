#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The shipped demo from beginning to end: every file, sound figures, --set, --check, Ctrl-C, the same again.
#   demo.sh BIN_DIR SOURCE_DIR
set -u
bin=$1
demo=$2/models/arm19/demo.yaml
. "$(dirname "$0")/../support/script.sh"

# holds 'EXPRESSION' for awk
holds() { awk "BEGIN { exit !($1) }"; }

"$bin/mhe-run" "$demo" --out result --quiet > out.txt 2> err.txt || fail "exit status $?: $(cat err.txt)"
for file in estimates.sto forces.sto markers.trc torques.sto quality.sto marker_residuals.sto emg.sto \
    report.html config.yaml summary.json; do
    [ -s "result/$file" ] || fail "no $file"
done
find result -name '.*' -type f | grep . && fail "temporary files are left"
holds "$(number converged result) == 1" || fail "converged $(number converged result)"
holds "$(number q_deg result) < 0.01" || fail "joint angles $(number q_deg result) deg"
holds "$(number force_n result) < 2" || fail "forces $(number force_n result) N"
holds "$(number marker_mm result) < 0.02" || fail "markers $(number marker_mm result) mm"
holds "$(number peak_rss_mb result) < 200" || fail "memory $(number peak_rss_mb result) MB"
[ "$(wc -l < result/forces.sto)" -eq "$(wc -l < result/torques.sto)" ] || fail "rows differ"

# The resolved configuration is the same run.
"$bin/mhe-run" result/config.yaml --out again --quiet > /dev/null 2>> err.txt || fail "config.yaml does not run"
for file in estimates.sto forces.sto markers.trc torques.sto; do
    cmp -s "result/$file" "again/$file" || fail "$file differs when run from config.yaml"
done

"$bin/mhe-run" --check "$demo" > check.txt 2>&1 || fail "--check: $(cat check.txt)"
[ ! -e out ] || fail "--check wrote files"
for set in formulation=activation costs.0=mhe.cost.min-excitation bounds.residual_torques=true; do
    "$bin/mhe-run" "$demo" --out other --quiet --set "$set" --set horizon.ratio=6 \
        --set horizon.window=3 > /dev/null 2> err.txt || fail "--set $set: $(cat err.txt)"
done

# Two labels exchanged are named; a run without mistakes names none.
grep -q 'look exchanged' out.txt && fail "labels are said to be exchanged: $(cat out.txt)"
sed '4{s/EPICl/OTHER/;s/STYLu/EPICl/;s/OTHER/STYLu/}' "$2/models/arm19/demo_markers.trc" > exchanged.trc
"$bin/mhe-run" "$demo" --out exchanged --quiet --set "data.markers=$PWD/exchanged.trc" --set costs.0.markers=1e5 \
    > exchanged.txt 2>> err.txt || fail "exchanged labels: $(cat err.txt)"
grep -q 'markers EPICl and STYLu look exchanged' exchanged.txt || fail "exchanged: $(cat exchanged.txt)"
grep -q 'look exchanged' exchanged/report.html || fail "report.html does not tell of exchanged labels"

# A marker that the model has 15 mm from its place: what is learnt of it is told; nothing without the key.
sed '/Marker name="EPICl"/,/fixed/s/-0.00240456 -0.308306 0.0312526/0.01259544 -0.308306 0.0312526/' \
    "$2/models/arm19/arm19.osim" > moved.osim
"$bin/mhe-run" "$demo" --out moved --quiet --set model.file="$PWD/moved.osim" --set data.marker_offset=0.01 \
    > moved.txt 2>> err.txt || fail "moved marker: $(cat err.txt)"
grep -q 'farthest EPICl: 15.0 mm (-15.0, ' moved.txt || fail "moved marker: $(cat moved.txt)"
grep -q 'farthest EPICl: 15.0 mm (-15.0, ' moved/report.html || fail "report.html does not tell of the moved marker"
holds "$(tr -d '\n\t' < moved/summary.json | sed 's/.*"EPICl":\[\([^,]*\),.*/\1/') + 15 < 0.1" || fail "summary.json: moved marker"
grep -q 'marker_offsets' result/summary.json && fail "offsets are told though none are learnt"

# Ctrl-C: the files are complete as far as they go, and the message says how far.
timeout 100 "$bin/mhe-run" "$demo" --out cut --quiet --set horizon.ratio=1 --set horizon.window=22 > /dev/null 2> cut.txt &
pid=$!
until ls cut/.*.tmp > /dev/null 2>&1 || ! kill -0 $pid 2> /dev/null; do sleep 0.1; done
kill -INT $pid
wait $pid
status=$?
if [ $status -eq 1 ]; then
    grep -q interrupted cut.txt || fail "Ctrl-C: $(cat cut.txt)"
    [ -z "$(find . -path './cut/.*' -type f)" ] || fail "Ctrl-C leaves temporary files"
elif [ $status -eq 130 ]; then # when all was written: what is left to do is the shell's to end
    [ -s cut/estimates.sto ] || fail "Ctrl-C: ended without results"
elif [ $status -ne 0 ]; then
    fail "Ctrl-C: exit status $status"
fi

# The demo's motion is what mhe-sim makes of its postures.
"$bin/mhe-sim" follow "$2/models/arm19/demo_motion.yaml" --input "$2/models/arm19/demo_postures.sto" \
    --out motion > /dev/null || fail "mhe-sim follow"
awk 'FNR == NR && FNR > 7 { q[FNR] = $2; next }
     FNR > 7 { d = $2 - q[FNR]; if (d < 0) d = -d; if (d > worst) worst = d }
     END { exit !(worst < 1e-2) }' motion/reference.sto "$2/models/arm19/demo_reference.sto" ||
    fail "mhe-sim follow makes another motion"

finish "demo"

#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Twenty times kill -9 of the runner at random moments, torn lines, a killed worker, Ctrl-C: nothing is lost, and the
# results are those of an undisturbed run, to the byte.
#   kill.sh PATH/mhe-study SOURCE_DIR
set -u
study=$1 source=$2
. "$source/tests/support/script.sh"
. "$source/tests/study/small.sh"
RANDOM=${MHE_TEST_SEED:-$$}
echo "MHE_TEST_SEED=$RANDOM repeats the moments"
RANDOM=$RANDOM

write_study 8 > small.yaml
"$study" run small.yaml --out calm --quiet > out.txt 2> err.txt || fail "undisturbed: $(cat err.txt)"
rows() { cat "$1"/rows/*.rows 2> /dev/null | wc -l; }

# compare FOLDER: completes it
compare() {
    "$study" run small.yaml --out "$1" --quiet > out.txt 2> err.txt || fail "completion of $1: $(cat err.txt)"
    cmp calm/results.csv "$1/results.csv" || fail "$1: the results are not those of an undisturbed run"
    [ -z "$(find "$1" -name '.*.tmp' -newer small.yaml | grep -v forces)" ] || fail "$1: temporary files are left"
}

kills=0 folder=0
while [ $kills -lt 20 ]; do
    "$study" run small.yaml --out "killed$folder" --quiet > out.txt 2> err.txt &
    pid=$!
    before=$(rows "killed$folder")
    for _ in $(seq $((RANDOM % 2 * 200))); do # half of them once there is something new
        [ "$(rows "killed$folder")" -eq "$before" ] && kill -0 $pid 2> /dev/null || break
        sleep 0.1
    done
    sleep "0.$(printf %03d $((RANDOM % 800 + 50)))"
    if kill -9 $pid 2> /dev/null; then
        wait $pid 2> /dev/null
        kills=$((kills + 1))
        # A power cut in the middle of a line, and of blocks that were never written.
        file=$(find "killed$folder/rows" -name '*.rows' 2> /dev/null | head -n 1)
        if [ -n "$file" ]; then
            case $((RANDOM % 3)) in
            0) printf '0123456789abcdef\t1\t2\tok,3' >> "$file" ;;
            1) head -c 300 /dev/zero >> "$file" ;;
            esac
        fi
    else
        wait $pid || fail "it ended by itself: $(cat err.txt)"
        folder=$((folder + 1))
    fi
done
echo "20 kills over $((folder + 1)) runs; $(rows "killed$folder") rows in the last"
for i in $(seq 0 $folder); do
    compare "killed$i"
done

# A worker that somebody kills: its trial is run again, nothing is a failure.
"$study" run small.yaml --out worker --quiet --workers 2 > out.txt 2> err.txt &
pid=$!
for _ in $(seq 100); do
    [ "$(rows worker)" -ge 2 ] && break
    sleep 0.1
done
worker=$(ps -o pid= --ppid $pid | sort -n | head -n 1)
[ -n "$worker" ] && kill -STOP "$worker"
printf '0123456789abcdef\t0\t1\tok' >> "$(find worker/rows -name '*-0.rows')" # killed in the middle of a line
[ -n "$worker" ] && kill -9 "$worker" || fail "no worker to kill"
wait $pid || fail "a killed worker stops the run: $(cat err.txt)"
cmp calm/results.csv worker/results.csv || fail "a killed worker changes results"

# One that crashes in its trial: a row with its reason.
"$study" run small.yaml --out crash --quiet --workers 2 > out.txt 2> err.txt &
pid=$!
for _ in $(seq 100); do
    [ "$(rows crash)" -ge 2 ] && break
    sleep 0.1
done
worker=$(ps -o pid= --ppid $pid | head -n 1)
[ -n "$worker" ] && kill -SEGV "$worker" || fail "no worker to crash"
wait $pid || fail "a crash stops the run: $(cat err.txt)"
[ "$(grep -cE 'ended its worker by (signal 11|exit status)' crash/results.csv)" -eq 1 ] || fail "the crash is no row"

# Ctrl-C: exit status 1, the line says how to go on, no tables yet.
"$study" run small.yaml --out cut --quiet > out.txt 2> err.txt &
pid=$!
for _ in $(seq 100); do
    [ "$(rows cut)" -ge 1 ] && break
    sleep 0.1
done
kill -INT $pid
wait $pid
status=$?
[ $status -eq 1 ] && grep -q 'trials are done, the same command does the rest' err.txt || fail "Ctrl-C: $status, $(cat err.txt)"
[ ! -e cut/results.csv ] || fail "tables of an interrupted study"
compare cut

finish "kill"

#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Whatever happens in the result folder: whole results of one run, or one line and what was there before.
#   folder.sh PATH/mhe-run SOURCE_DIR
set -u
run=$1
arm=$2/models/arm19
. "$(dirname "$0")/../support/script.sh"

# go FOLDER [arguments]: a fast run -> status, FOLDER.err
go() {
    into=$1
    shift
    "$run" "$arm/demo.yaml" --out "$into" --quiet --set output.picture=false \
        --set 'solver={plugin: mhe.solver.rti, preset: speed, tolerance: 1e-5}' "$@" > "$into.out" 2> "$into.err"
}

# one_line FILE 'TEXT': that it holds
one_line() {
    [ "$(grep -vc 'warning:' "$1")" -eq 1 ] || fail "$1 has not one line: $(cat "$1")"
    grep -qF -- "$2" "$1" || fail "'$2' is not in $1: $(cat "$1")"
}

# whole FOLDER: its tables have as many rows as they say, all of one width, and nothing else lies there
whole() {
    for file in "$1"/*.sto; do
        awk -F '\t' -v file="$file" '/^nRows=/ {split($0, part, "="); said = part[2]}
            table {rows++; if (NF != width) wrong = 1} /^time/ {table = 1; width = NF}
            END {if (wrong || rows != said) {print file " is not whole"; exit 1}}' "$file" || fail "$1"
    done
    [ -z "$(find "$1" -name '.*' -type f)" ] || fail "$1: hidden files are left: $(ls -A "$1")"
}

# Sixteen runs into one folder. While the first holds it (stopped, so that no machine is too fast), fifteen end at once.
"$run" "$arm/demo.yaml" --out sixteen --quiet --realtime > sixteen.out 2> sixteen.err & first=$!
until [ -e sixteen/.mhe-lock ] || ! kill -0 $first 2> /dev/null; do sleep 0.1; done
kill -STOP $first
for k in 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16; do
    (
        "$run" "$arm/demo.yaml" --out sixteen --quiet > "$k.out" 2> "$k.err"
        echo $? > "$k.status"
    ) &
    pids="${pids:-} $!"
done
for pid in $pids; do wait "$pid"; done
kill -CONT $first
wait $first || fail "the first of sixteen: $(cat sixteen.err)"
for k in 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16; do
    [ "$(cat $k.status)" -eq 1 ] || fail "run $k of sixteen: status $(cat $k.status)"
    one_line $k.err 'another run is writing its results here'
done
whole sixteen

# The same as they come: whoever is first ends well, and the tables are those of one run.
for window in 3 4 5; do
    (
        go "together" --set horizon.window=$window > /dev/null 2>&1
        echo $? > together.$window
    ) &
done
wait
grep -q '^0$' together.3 together.4 together.5 || fail "none of three runs ended well"
whole together

# A result's name is taken by a folder: told before the first frame.
mkdir -p taken/quality.sto
go taken && fail "a folder in the place of a result"
one_line taken.err 'taken/quality.sto: a folder stands where a result goes'
[ "$(ls -A taken)" = quality.sto ] || fail "taken: there is $(ls -A taken)"

# A file at its limit: no signal ends the run, no file stays.
( ulimit -f 10; go limit ) && fail "ulimit -f"
one_line limit.err 'File too large'
[ ! -e limit ] || fail "limit: there is $(ls -A limit)"

# A result would overwrite what the run reads.
mkdir own
cp "$arm"/demo* "$arm"/arm19.osim own
cp own/demo_markers.trc own/markers.trc
go own --set data.markers="$work/own/markers.trc" && fail "results over the recording"
one_line own.err 'own/markers.trc would be overwritten'
cmp -s own/markers.trc "$arm/demo_markers.trc" || fail "the recording was overwritten"

# What an earlier run left is named.
go again --set 'output.formats=[sto, csv, mat]' || fail "again: $(cat again.err)"
[ -s again/results.mat ] || fail "no results.mat"
sleep 0.1
go again || fail "again: $(cat again.err)"
grep -q 'warning: again: of an earlier run, not of this one: estimates.csv, .*results.mat' again.err || fail "stale files: $(cat again.err)"
go again --set data.markers=nowhere.trc && fail "a run without markers"
grep -q 'warning: again: of an earlier run, not of this one: .*summary.json' again.err || fail "stale results: $(cat again.err)"

finish "result folders"

#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# mhe-study: a trial is what mhe-sim and mhe-run make of the same, on any number of workers; failures are rows.
#   run.sh BIN_DIR SOURCE_DIR
set -u
bin=$1 source=$2
. "$source/tests/support/script.sh"
. "$source/tests/study/small.sh"

# cell FILE LINE COLUMN
cell() {
    awk -F, -v line="$2" -v name="$3" 'NR == 1 { for (i = 1; i <= NF; i++) { at[$i] = i } }
        NR == line { print $at[name] }' "$1"
}

write_study 3 > small.yaml
"$bin/mhe-study" run small.yaml --out one --workers 1 > out.txt 2> err.txt || fail "exit status $?: $(cat err.txt)"
grep -q '^9 trials in' out.txt || fail "what it says: $(cat out.txt)"
grep -q '^results in one' out.txt || fail "what it says: $(cat out.txt)"
"$bin/mhe-study" run small.yaml --out three --workers 3 > out.txt 2> err.txt || fail "three workers: $(cat err.txt)"
cmp one/results.csv three/results.csv || fail "results depend on the number of workers"
[ "$(wc -l < one/results.csv)" -eq 10 ] && [ "$(wc -l < one/timing.csv)" -eq 10 ] || fail "rows of the tables"
[ "$(find one/forces -name '*.sto' | wc -l)" -eq 3 ] || fail "kept forces: $(ls one/forces)"
cmp one/forces/0001-0002.sto three/forces/0001-0002.sto || fail "forces depend on the number of workers"
[ "$(sort -u -t, -k4,4 one/results.csv | wc -l)" -eq 10 ] || fail "two trials have the same seed"

# Run again, it has nothing to do.
cp one/results.csv before.csv
"$bin/mhe-study" run small.yaml --out one > out.txt || fail "run again"
grep -q '^9 of 9 trials are there already' out.txt || fail "run again: $(cat out.txt)"
cmp one/results.csv before.csv || fail "running again changes the results"

# Two shards in two processes, and shards of folders of their own, are the same study.
"$bin/mhe-study" run small.yaml --out shards --shard 0/2 > out.txt || fail "shard 0/2"
[ ! -e shards/results.csv ] || fail "tables of half a study"
"$bin/mhe-study" run small.yaml --out shards --shard 1/2 > out.txt || fail "shard 1/2"
cmp one/results.csv shards/results.csv || fail "results depend on shards"
"$bin/mhe-study" run small.yaml --out a --shard 0/2 > out.txt && "$bin/mhe-study" run small.yaml --out b --shard 1/2 > out.txt ||
    fail "shards apart"
"$bin/mhe-study" merge a > out.txt 2> err.txt && fail "merge of half a study succeeds"
grep -q '4 of 9 trials are missing' err.txt || fail "what is missing: $(cat err.txt)"
"$bin/mhe-study" merge a b > out.txt 2> err.txt || fail "merge: $(cat err.txt)"
cmp one/results.csv a/results.csv || fail "merged results differ"

# The last line's trial by the other programs, from files.
seed=$(cell one/results.csv 10 seed)
cat > noise.yaml << END_OF_NOISE
model: {file: $source/models/arm19/arm19.osim}
reference: motion.sto
noise: {seed: $seed, markers: {sd: 0.002}, emg: {level: 1}}
output: {picture: false}
END_OF_NOISE
"$bin/mhe-sim" noise noise.yaml --out data > out.txt || fail "mhe-sim noise"
"$bin/mhe-run" "$source/models/arm19/studies/estimate.yaml" --out estimate --quiet --set "data.markers=$work/data/markers.trc" \
    --set "data.emg=$work/data/emg.sto" --set "data.reference=$work/motion.sto" \
    --set output.picture=false --set formulation=activation --set horizon.window=4 --set horizon.ratio=3 --set costs.0=mhe.cost.emg-markers-low \
    > out.txt 2> err.txt || fail "mhe-run: $(cat err.txt)"
for key in q_deg force_n marker_mm activation solves converged; do
    echo "$(number $key estimate) $(cell one/results.csv 10 $key)" |
        awk '{ off = $1 - $2; if (off < 0) off = -off } END { exit !(NF == 2 && off <= 1e-4 * $1) }' ||
        fail "$key: mhe-run $(number $key estimate), mhe-study $(cell one/results.csv 10 $key)"
done

# A trial that cannot be: a row with its reason; the others are as before.
sed 's/horizon: \[3, 3\], emg_noise: none/horizon: [3, 3], emg_noise: none, set: {noise.markers.rate: 2}/' small.yaml > odd.yaml
"$bin/mhe-study" run odd.yaml --out odd > out.txt 2> err.txt || fail "a failed trial stops the rest: $(cat err.txt)"
[ "$(grep -c ',failed,' odd/results.csv)" -eq 3 ] && grep -q 'failed,0,.*too few for a window' odd/results.csv ||
    fail "failed trials: $(cut -c 1-200 odd/results.csv)"
tail -n 6 one/results.csv | cmp - "$(tail -n 6 odd/results.csv > rest.csv && echo rest.csv)" ||
    fail "other trials change with a failed one"
[ "$(cell odd/results.csv 2 counted)" = 0 ] || fail "a failed trial counts"

# A window of the whole recording is judged by all its nodes.
sed 's/^  - {horizon.*none}/  - {horizon: [30, 3], emg_noise: none, trials: 1}/; /costs.0/d; /keep_forces/d' small.yaml > whole.yaml
"$bin/mhe-study" run whole.yaml --out whole --set set='{formulation: activation, solver.max_iterations: 100, output.skip_last: 3}' > out.txt 2> err.txt ||
    fail "whole window: $(cat err.txt)"
awk -F, 'NR == 2 { for (i = 1; i <= NF; i++) { if ($i == "ok") { exit !($(i + 1) == 1 && $(i + 5) > 0 && $(i + 5) < 1) } } }' \
    whole/results.csv || fail "whole window: $(cat whole/results.csv)"

# Memory and locks.
awk -F, 'NR > 1 && $NF > 150 { exit 1 }' one/timing.csv || fail "a worker takes more than 150 MB"

finish "study"

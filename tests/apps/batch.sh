#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# mhe-run --batch: a list and folders; trials that fail, crash or are interrupted; going on; parts; what is wrong in a list.
#   batch.sh PATH/mhe-run SOURCE_DIR
set -u
run=$1
arm=$2/models/arm19
. "$(dirname "$0")/../support/script.sh"

sed "s#file: arm19#file: $arm/arm19#; s#demo_#$arm/demo_#g; s#mhe.solver.ipopt.*#mhe.solver.rti}#" "$arm/demo.yaml" > arm.yaml
echo 'output: {picture: false}' >> arm.yaml
mkdir session
cp "$arm/demo_markers.trc" session/reach.trc
cp "$arm/demo_emg.sto" session/reach.sto
cp "$arm/demo_markers.trc" "session/again & <once>.trc"
cat > trials.csv << 'END'
name,data.markers,data.emg,horizon.window
# a remark
first,session/reach.trc,session/reach.sto,
"short, window",session/reach.trc,session/reach.sto,5
END

# of TRIAL COLUMN: its cell in o/batch.csv
of() {
    /usr/bin/python3 -c 'import csv, sys
for row in csv.DictReader(open("o/batch.csv")):
    if row["trial"] == sys.argv[1]:
        print(row[sys.argv[2]])' "$1" "$2"
}

"$run" arm.yaml --batch trials.csv --out o --quiet > out.txt 2>&1 || fail "list: $(cat out.txt)"
[ "$(of first usable)" = yes ] && [ "$(of 'short, window' usable)" = yes ] || fail "list: $(cat o/batch.csv)"
grep -q 'window: 5' 'o/short, window/config.yaml' || fail "a trial's own key is not used"
[ -s o/first/report.html ] && grep -q 'href="short%2C%20window/report.html"' o/batch.html || fail "page: $(cat o/batch.html)"

# The bits of a run alone.
"$run" arm.yaml --out alone --quiet --set data.markers="$PWD/session/reach.trc" --set data.emg="$PWD/session/reach.sto" > /dev/null 2>&1
cmp -s alone/forces.sto o/first/forces.sto || fail "a trial's forces differ from those of a run alone"

# Again: nothing to do. One changed file, one lost end, one trial more: just these.
before=$(stat -c %Y.%i o/first/forces.sto)
"$run" arm.yaml --batch trials.csv --out o --quiet > out.txt 2>&1
grep -q '2 of 2 trials are there already' out.txt || fail "again: $(cat out.txt)"
echo 'gone,session/none.trc,session/reach.sto,' >> trials.csv
rm 'o/short, window/batch.txt'
"$run" arm.yaml --batch trials.csv --out o --quiet > out.txt 2>&1
[ $? -eq 1 ] || fail "a failed trial is no status 1: $(cat out.txt)"
grep -q '1 of 3 trials are there already' out.txt && grep -q '2 usable.*1 failed' out.txt || fail "more: $(cat out.txt)"
[ "$before" = "$(stat -c %Y.%i o/first/forces.sto)" ] || fail "a trial that was there was run again"
of gone reason | grep -q 'none.trc' || fail "the reason is missing: $(cat o/batch.csv)"
touch -d '2001-01-01' session/reach.sto
"$run" arm.yaml --batch trials.csv --out o --quiet > out.txt 2>&1
grep -q 'there already' out.txt && fail "a changed input is not seen: $(cat out.txt)"

# Parts, at once.
for part in 0 1 2; do
    "$run" arm.yaml --batch trials.csv --out parts --quiet --shard $part/3 > part$part.txt 2>&1 &
done
wait
sed -i 's/ *[0-9.]*$//' parts/batch.csv
grep -c '"first",yes\|"short, window",yes\|"gone",failed' parts/batch.csv | grep -qx 3 || fail "parts: $(cat parts/batch.csv part?.txt)"

# A folder of recordings, with the EMG beside; and one of configs.
"$run" arm.yaml --batch session --out folder --quiet > out.txt 2>&1 || fail "folder: $(cat out.txt)"
grep -q '"again & <once>",' folder/batch.csv && grep -q 'again &amp; &lt;once&gt;' folder/batch.html || fail "names: $(cat folder/batch.html)"
grep -q 'session/reach.sto' folder/reach/config.yaml || fail "the EMG beside is not taken"
mkdir configs
cp arm.yaml configs/one.yaml
cp arm.yaml configs/two.yaml
"$run" --batch configs --out c --quiet > out.txt 2>&1 || fail "configs: $(cat out.txt)"
grep -q '2 usable' out.txt || fail "configs: $(cat out.txt)"

# Interrupted: what is done stays, the rest follows.
{
    echo 'name,data.markers,data.emg'
    for i in 1 2 3 4 5 6 7 8; do echo "t$i,session/reach.trc,session/reach.sto"; done
} > many.csv
"$run" arm.yaml --batch many.csv --out m --quiet --workers 1 --set solver.plugin=mhe.solver.ipopt > out.txt 2>&1 &
pid=$!
for _ in $(seq 1 600); do
    [ -s m/t1/batch.txt ] && break
    sleep 0.1
done
kill -INT $pid
kill -TERM $pid 2> /dev/null
wait $pid
[ $? -eq 1 ] && grep -q 'interrupted; [1-7] of 8 trials are done' out.txt || fail "interrupted: $(cat out.txt)"
"$run" arm.yaml --batch many.csv --out m --quiet --set solver.plugin=mhe.solver.ipopt > out.txt 2>&1 || fail "goes on: $(cat out.txt)"
grep -q '[1-7] of 8 trials are there already' out.txt && grep -q '8 usable' out.txt || fail "goes on: $(cat out.txt)"

# Killed with no chance to say so: the same.
"$run" arm.yaml --batch many.csv --out k --quiet --workers 1 --set solver.plugin=mhe.solver.ipopt > /dev/null 2>&1 &
pid=$!
for _ in $(seq 1 600); do
    [ -s k/t1/batch.txt ] && break
    sleep 0.1
done
kill -9 $pid
wait $pid 2> /dev/null
"$run" arm.yaml --batch many.csv --out k --quiet --set solver.plugin=mhe.solver.ipopt > out.txt 2>&1 || fail "after kill -9: $(cat out.txt)"
grep -q '[1-7] of 8 trials are there already' out.txt && grep -q '8 usable' out.txt || fail "after kill -9: $(cat out.txt)"
for i in 1 2 3 4 5 6 7 8; do
    cmp -s m/t1/forces.sto k/t$i/forces.sto || fail "after kill -9: the forces of t$i differ"
done

# refused STATUS TEXT WORDS...: what is wrong is said before anything is estimated
refused() {
    status=$1 text=$2
    shift 2
    "$run" "$@" --out refused > out.txt 2>&1
    [ $? -eq "$status" ] && grep -q "$text" out.txt || fail "$*: $(cat out.txt)"
    [ ! -e refused/batch.csv ] || fail "$*: something was written"
}
list() {
    printf '%b' "$1" > bad.csv
}
refused 2 'none.csv' arm.yaml --batch none.csv
list ''
refused 2 'bad.csv: no trials' arm.yaml --batch bad.csv
list 'trial,data.markers\na,b\n'
refused 2 'bad.csv:1: the first line names the columns' arm.yaml --batch bad.csv
list 'name,data.markers\na,b,c\n'
refused 2 'bad.csv:2: 3 cells, where the first line has 2' arm.yaml --batch bad.csv
list 'name,name\na,b\n'
refused 2 "two columns are called 'name'" arm.yaml --batch bad.csv
list 'name\n../a\n'
refused 2 "bad.csv:2: '../a' cannot be a trial's name" arm.yaml --batch bad.csv
list 'name\na\na\n'
refused 2 "bad.csv:3: there are two trials 'a'" arm.yaml --batch bad.csv
list 'name,horizon.windw\na,3\n'
refused 2 "bad.csv:2: a: .*windw.*did you mean 'window'" arm.yaml --batch bad.csv
list 'name\na\n'
refused 2 "'a' has no config" --batch bad.csv
head -c 5000 /dev/urandom > bad.csv
refused 2 'bad.csv' arm.yaml --batch bad.csv
mkdir nothing
refused 2 'nothing: no trials' arm.yaml --batch nothing
refused 2 'is not like 0/8' arm.yaml --batch trials.csv --shard 8/8
refused 2 "unknown engine 'slurn'" arm.yaml --batch trials.csv --engine slurn

# As a job array: what sbatch is given (tests/study/slurm.sh runs one on a real Slurm).
mkdir bin
cat > bin/sbatch << 'END'
#!/bin/sh
echo "$@" > sbatch.words
for last; do :; done
cp "$last" job.sh
echo 17
END
chmod +x bin/sbatch
PATH=$PWD/bin:$PATH "$run" arm.yaml --batch trials.csv --out s --engine slurm --tasks 16 --option --partition=fast > out.txt 2>&1 ||
    fail "slurm: $(cat out.txt)"
grep -q 'job 17: 3 tasks, 3 trials' out.txt && grep -q -- '--parsable --partition=fast' sbatch.words || fail "slurm: $(cat out.txt)"
for task in 0 1 2; do
    SLURM_ARRAY_TASK_ID=$task sh job.sh > /dev/null 2>&1
done
grep -c '"first",yes\|"short, window",yes\|"gone",failed' s/batch.csv | grep -qx 3 || fail "job: $(cat s/batch.csv)"

finish "batch"

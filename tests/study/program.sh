#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# A study whose trials another program makes: what it is called with, what becomes of its answers, and what of wrong ones.
#   program.sh PATH/mhe-study SOURCE_DIR
set -u
study=$1 source=$2
. "$source/tests/support/script.sh"

cat > estimate.yaml << EOF
model: {file: $source/models/arm19/arm19.osim}
costs: [mhe.cost.emg-markers]
EOF
cat > study.yaml << 'EOF'
config: estimate.yaml
program: trial.sh
trials: 3
factors:
  amount: {values: [little, much]}
grids:
  - amount: little
  - {amount: much, set: {horizon.window: 9}}
EOF
cat > trial.sh << 'EOF'
#!/bin/sh
echo "$@" >> calls.txt
case "$*" in *amount=much*) much=1 ;; *) much=0 ;; esac
trial=${4}
[ $much = 1 ] && [ "$trial" = 2 ] && { echo "no draw" >&2; exit 1; }
printf 'converged 1\niterations_mean 7\nforce_n %s.5\nq_deg 0.25\n' "$((10 * much + trial))"
EOF
chmod +x trial.sh

"$study" run study.yaml --out out --quiet > stdout.txt 2> stderr.txt
[ $? = 2 ] && grep -q 'study.yaml:2: program: .*--trust' stderr.txt && [ ! -e calls.txt ] && [ ! -e out ] ||
    fail "a program runs unasked: $(cat stderr.txt)"
"$study" run study.yaml --trust --out out --workers 2 --quiet > stdout.txt 2> stderr.txt || fail "status $?: $(cat stderr.txt)"
[ "$(wc -l < calls.txt)" = 6 ] || fail "called $(wc -l < calls.txt) times, not 6"
grep -q -- '--condition amount=much --trial 1 --seed [0-9]* --out .*out --bin .* --set horizon.window=9 .*estimate.yaml$' calls.txt ||
    fail "not called as told: $(cat calls.txt)"
column() { head -1 out/results.csv | tr , '\n' | grep -n "^$1\$" | cut -d: -f1; }
rows=$(cut -d, -f"$(column amount)","$(column trial)","$(column status)","$(column force_n)","$(column q_deg)" out/results.csv | tail -n +2)
for row in little,0,ok,0.25,0.5 little,1,ok,0.25,1.5 much,1,ok,0.25,11.5; do
    printf '%s\n' "$rows" | grep -qxF "$row" || fail "no row $row in: $rows"
done
printf '%s\n' "$rows" | grep -q '^much,2,failed' || fail "the trial that failed is not marked: $rows"

# Rows that are there stay; another program is another study.
"$study" run study.yaml --trust --out out --quiet > stdout.txt 2>&1 || fail "second run: $(cat stdout.txt)"
[ "$(wc -l < calls.txt)" = 6 ] || fail "trials were made again"
echo "# changed" >> trial.sh
"$study" run study.yaml --trust --out out --quiet > stdout.txt 2>&1 && fail "another program went on in the same folder"

# An answer that is none is a failed trial, told with the line.
printf '#!/bin/sh\necho force 3\n' > trial.sh
"$study" run study.yaml --trust --out wrong --quiet > stdout.txt 2>&1
grep -q "no column 'force'" wrong/rows/* || fail "the wrong answer is not told: $(cat wrong/rows/* stdout.txt)"
rm trial.sh
"$study" run study.yaml --trust --out none --quiet > /dev/null 2> stderr.txt
[ $? = 2 ] && grep -q trial.sh stderr.txt || fail "a program that is not there: $(cat stderr.txt)"
finish program

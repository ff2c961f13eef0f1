#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Every kind of wrong study or results folder: exit status 2, one line that names the fault, nothing lost.
#   bad_input.sh PATH/mhe-study SOURCE_DIR
set -u
study=$1 source=$2
. "$source/tests/support/script.sh"
. "$source/tests/study/small.sh"
count=0

# expect NAME 'TEXT IN THE MESSAGE' [arguments of mhe-study, instead of run small.yaml]
expect() {
    name=$1 text=$2
    shift 2
    [ $# -gt 0 ] || set -- run small.yaml --out result
    "$study" "$@" > stdout.txt 2> stderr.txt < /dev/null
    status=$?
    count=$((count + 1))
    message=$(grep -v 'warning:' stderr.txt)
    lines=$(printf '%s\n' "$message" | grep -c .)
    if [ "$status" -ne 2 ] || [ "$lines" -ne 1 ] || [ -e result/results.csv ]; then
        fail "$name: status $status, $lines lines: $message"
    elif ! printf '%s' "$message" | grep -qF -- "$text"; then
        fail "$name: '$text' is not in: $message"
    fi
    rm -rf result
    write_study 2 > small.yaml
}
# edit 'SED SCRIPT'
edit() { sed -i "$1" small.yaml; }

write_study 2 > small.yaml
expect no-command "did you mean 'run'" runn
expect no-study 'nowhere.yaml' run nowhere.yaml
expect no-file 'no study file' run
expect unknown-option "did you mean '--workers'" run small.yaml --worker 2
expect workers-zero '--workers' run small.yaml --workers 0
expect shard-behind-last '--shard' run small.yaml --shard 2/2
edit 's/^trials/trails/'
expect unknown-key "small.yaml:4: unknown key 'trails' (did you mean 'trials'?)"
edit 's/^trials: 2/trials: two/'
expect wrong-type 'small.yaml:4'
edit 's/^config: .*/config: nowhere.yaml/'
expect missing-config 'nowhere.yaml'
edit 's/horizon: \[3, 3\], emg_noise/horizon: [3, 3], emg_nose/'
expect unknown-factor "small.yaml:10: grids: unknown factor 'emg_nose' (did you mean 'emg_noise'?)"
edit 's/emg_noise: none}/emg_noise: nonne}/'
expect unknown-level "small.yaml:10: factor 'emg_noise' has no value 'nonne' (did you mean 'none'?)"
edit 's/key: noise.emg.level/key: noise.emg.levle/'
expect unknown-noise-key "small.yaml:8: emg_noise 'none': noise.emg: unknown key 'levle' (did you mean 'level'?)"
edit 's/horizon.ratio\]/horizon.ration]/'
expect unknown-config-key "did you mean 'ratio'"
edit 's/horizon: \[3, 3\]/horizon: [1, 3]/'
expect refused-value "small.yaml:10: horizon '1/3': horizon: 'window'"
edit 's/mhe.cost.emg-markers-low/mhe.cost.emg-markers-lo/'
expect unknown-plugin "did you mean 'mhe.cost.emg-markers-low'"
edit 's/costs.0: mhe.cost.emg-markers-low/costs.0: {plugin: mhe.cost.emg-markers-low, emg: -1}/'
expect plugin-refuses-value "small.yaml:11: set 'costs.0': mhe.cost.emg-markers-low: 'emg'"
edit 's/costs.0: mhe.cost.emg-markers-low/costs.0: {plugin: mhe.cost.emg-markers-low, tracked: [BRAA]}/'
expect plugin-refuses-muscle 'BRAA'
edit 's/^noise: .*/noise: {markers: {sd: -1}}/'
expect refused-noise "small.yaml:12: noise.markers: 'sd'"
edit 's/^noise: .*/noise: {raw_emg: {rate: 1000}}/'
expect raw-emg "small.yaml:12: noise: 'raw_emg' is for recordings"
edit 's/\[3, 3\], emg_noise: none/[3], emg_noise: none/'
expect tuple-too-short 'a list of 2'
edit 's/emg_noise: low,/emg_noise: [low, none],/'
expect condition-twice 'is there twice'
edit 's/horizon: \[3, 3\]/horizon: [100, 3]/'
expect window-too-long 'too few for a window of 100'
edit 's/^reference: demo/reference: dmo/'
expect unknown-motion "small.yaml:3: reference: there is no motion 'dmo' (did you mean 'demo'?)"
edit 's/motion.sto/no_reference.sto/'
expect missing-motion 'no_reference.sto'
edit 's/^  emg_noise:.*/  "emg noise": {values: [a]}/'
expect bad-label 'cannot be a label'
edit 's/^  emg_noise:/  status:/'
expect taken-name "'status' is a column"
edit 's/{none: 0, low: 1}/[]/'
expect no-values "'values' is a list"
edit 's/^keep_forces.*/keep_forces: [{emg_noise: mid}]/'
expect unknown-kept "factor 'emg_noise' has no value 'mid'"
edit 's/^keep_forces.*/report: 5/'
expect report-of-nothing 'small.yaml:14: report: a mapping'
edit 's/^keep_forces.*/program: nowhere.py/'
expect missing-program 'nowhere.py: No such file or directory' run --trust --check small.yaml
expect bad-set "'trials' must lie in" run small.yaml --out result --set trials=0
printf 'config: [unclosed\n' > small.yaml
expect not-yaml 'small.yaml:'

# Folders of something else.
"$study" run small.yaml --out done --quiet > out.txt 2> err.txt || fail "the study itself: $(cat err.txt)"
cp -r done kept
expect another-study 'done/study.id:4: the results here are of another study' run small.yaml --out done --set seed=8
sed -i 's/^version.*/version 0.0.1/' done/study.id
expect another-version 'done/study.id:2: the results here were made by another version' run small.yaml --out done
cp kept/study.id done/study.id
sed -i 's/^program.*/program 0123456789abcdef/' done/study.id
expect another-build 'done/study.id:3: ' run small.yaml --out done
printf 'hello\n' > done/study.id
expect no-study-folder 'done/study.id:1: this is not the results folder of a study' run small.yaml --out done
cp kept/study.id done/study.id
diff -r done kept > diff.txt || fail "a refused folder was changed: $(cat diff.txt)"
expect merge-nothing 'study.json' merge nowhere
expect merge-other 'kept' merge done kept/rows
diff -r done kept > diff.txt || true

# A damaged row: its file and line; nothing is lost, and without the line the trial is run again.
file=$(find kept/rows -name '*.rows' | sort | head -n 1)
[ "$(wc -l < "$file")" -ge 2 ] || file=$(find kept/rows -name '*.rows' | sort | tail -n 1)
cp "$file" whole.rows
sed -i '2s/ok,/ok,1/' "$file"
cp "$file" damaged.rows
expect damaged-row "$file:2: damaged" run small.yaml --out kept
expect damaged-merge "$file:2: damaged" merge kept
cmp -s "$file" damaged.rows || fail "a damaged file was changed"
cp kept/results.csv before.csv
sed -i 2d "$file"
"$study" run small.yaml --out kept --quiet > out.txt 2> err.txt || fail "without the damaged row: $(cat err.txt)"
cmp kept/results.csv before.csv || fail "the trial of a removed row comes out differently"

echo "$((count - failed)) passed, $failed failed"
[ $failed -eq 0 ]

#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Inputs that once made whole programs take a minute, follow a planted link or print five million lines. Each ends soon, is named
# for what it is, and leaves what is not its own. (Names with control characters, plugin_path: trust.sh; two runs into one folder,
# limits of file size: folder.sh; hard data: estimator_bounded; sizes of structs: estimator_phases; failing allocations: torture.)
#   attack.sh PATH/mhe-run SOURCE_DIR
set -u
run=$1
arm=$2/models/arm19
. "$(dirname "$0")/../support/script.sh"

head -n 66 "$arm/demo_markers.trc" | sed '3s/301/60/' > markers.trc
# go FOLDER [arguments]: 0.6 s of the demo within a minute of processor time; for most of them a second is enough
go() {
    into=$1
    shift
    (ulimit -S -t 60 && exec "$run" "$arm/demo.yaml" --out "$into" --quiet --set output.picture=false \
        --set data.markers="$work/markers.trc" --set 'solver={plugin: mhe.solver.rti, preset: speed, tolerance: 1e-5}' "$@") \
        > "$into.txt" 2> "$into.err" < /dev/null
    status=$?
}

# model NAME 'SED SCRIPT' 'TEXT': no verdict but "no", and what is beyond belief is named
model() {
    sed "$2" "$arm/arm19.osim" > "$1.osim"
    go "$1" --set "model.file=$work/$1.osim"
    [ $status -le 1 ] || fail "$1: status $status: $(cat "$1.err")"
    grep -qx 'usable: no' "$1.txt" || fail "$1 is not called unusable: $(cat "$1.txt")"
    grep -qF -- "$3" "$1.err" || fail "$1: no '$3' in: $(cat "$1.err")"
}
model slack 's#<tendon_slack_length>[^<]*#<tendon_slack_length>0#' 'muscles with tendon slack length 0: Pectoral2'
model strong 's#<max_isometric_force>[^<]*#<max_isometric_force>1e9#' 'muscles beyond belief: Pectoral2 (line 222: 1e+09 N)'
model points 's#\(<location>\)[^<]*#\10 0 0#' 'muscles whose path points coincide: Pectoral2'

# Links at names that a run might take for temporary files, and at a result.
echo VICTIM > victim
mkdir planted
for name in .estimates.sto.tmp .estimates.sto.new .summary.json.tmp estimates.sto; do
    ln -s ../victim "planted/$name"
done
go planted
[ $status -eq 0 ] || fail "planted links: status $status: $(cat planted.err)"
[ "$(cat victim)" = VICTIM ] || fail "a planted link was followed"
[ ! -L planted/estimates.sto ] && [ -s planted/estimates.sto ] || fail "estimates.sto is a link"

# A million words that mean nothing are a few lines.
awk 'BEGIN {print "version 4"; for (k = 0; k < 100000; k++) printf "x x x x x x x x x x "}' > words.bioMod
(ulimit -S -t 60 && exec "$run" --check "$arm/demo.yaml" --set "model.file=$work/words.bioMod") > words.txt 2> words.err
status=$?
[ $status -eq 2 ] || fail "a million words: status $status"
[ "$(wc -l < words.err)" -le 8 ] || fail "a million words: $(wc -l < words.err) lines"
grep -q 'more of this kind' words.err || fail "a million words: $(head -n 5 words.err)"

finish attacks

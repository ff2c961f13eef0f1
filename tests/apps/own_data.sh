#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# "Your own data in five minutes" of the README, done: its configs, word by word, on a fresh folder with the demo's data
# under other names; from .trc and .sto and from one .c3d with raw EMG.
#   own_data.sh PATH/mhe-run SOURCE_DIR
set -u
run=$1
readme=$2/README.md
raw_page=$2/docs/raw-emg.md
demo=$2/models/arm19
. "$(dirname "$0")/../support/script.sh"

# block LINE [PAGE]: the indented block that follows the line in the README (the page), without its indent
block() {
    page=${2:-$readme}
    awk -v before="$1" 'index($0, before) {found = 1; next}
        found && /^ *(<!--.*)?$/ {if (n) exit; next}
        found {n++; match($0, /^ */); indent = n == 1 ? RLENGTH : indent; print substr($0, indent + 1)}' "$page"
}

# estimate CONFIG: --check, then the run; all windows answered, markers within 5 mm
estimate() {
    "$run" --check "$1.yaml" > check.txt 2>&1 || fail "$1: --check: $(cat check.txt)"
    "$run" "$1.yaml" --out "$1" --quiet --set output.picture=false > "$1.txt" 2>&1 || fail "$1: $(cat "$1.txt")"
    awk '/endheader/ {getline; data = 1; next} data {n++; bad += $2 == 3; far += $6 > 0.005}
        END {exit !(n > 80 && bad == 0 && far == 0)}' "$1/quality.sto" || fail "$1: $(cat "$1.txt")"
}

cp "$demo/arm19.osim" my_arm.osim
cp "$demo/demo_markers.trc" trial.trc
cp "$demo/demo_emg.sto" emg.sto
cp "$demo/demo_recording.c3d" trial.c3d

block 'A config beside them:' > my.yaml
grep -q '^costs:' my.yaml || fail "the README's config is not found: $(cat my.yaml)"
estimate my

# The variants that its text names.
without=$(sed -n 's/.*Without EMG: `\(costs: [^`]*\)`.*/\1/p' "$readme")
some=$(sed -n 's/^ *`\(costs: \[{plugin: mhe.cost.emg-markers, tracked: [^`]*\)`\..*/\1/p' "$readme")
[ -n "$without" ] && [ -n "$some" ] || fail "the README's variants are not found"
sed -e 's/, emg: emg.sto//' -e "s/^costs:.*/$without/" my.yaml > without.yaml
estimate without
sed "s/^costs:.*/$some/" my.yaml > some.yaml
estimate some

# Raw EMG.
{
    grep '^model:\|^horizon:' my.yaml
    block 'the data stay as recorded:' "$raw_page" | sed 's/trial.trc/trial.c3d/'
    echo 'costs: [{plugin: mhe.cost.emg-markers-high, tracked: [Deltoid2, BicepsLong, BicepsShort]}]'
} > raw.yaml
estimate raw
grep -q '2 channels for 3 muscles' raw.txt || fail "raw: $(cat raw.txt)"

finish "own data"

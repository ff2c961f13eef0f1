#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# What a config, a model or a folder from elsewhere may do: be read. Code runs only where the user said so.
#   trust.sh PATH/mhe-run FOLDER_OF_CONSTRUCTOR SOURCE_DIR
set -u
run=$1
arm=$3/models/arm19
constructor=$2
. "$(dirname "$0")/../support/script.sh"

cp "$arm"/demo* "$arm"/arm19.osim .
mkdir lib
cp "$constructor"/constructor.so lib
{ echo 'plugin_path: [lib]'; cat "$arm/demo.yaml"; } > stranger.yaml

# go STATUS RUNS 'TEXT' [arguments]: --check ends with STATUS, the library's code runs or not, and TEXT is told
go() {
    want=$1 runs=$2 text=$3
    shift 3
    "$run" --check "$@" > out.txt 2> err.txt
    status=$?
    [ $status -eq "$want" ] || fail "$*: status $status: $(cat err.txt)"
    [ "$(grep -c 'CODE OF THE CONFIG RUNS' out.txt)" -eq "$runs" ] || fail "$*: the code ran, or not: $(cat out.txt)"
    grep -qF -- "$text" err.txt || [ -z "$text" ] || fail "$*: '$text' is not in: $(cat err.txt)"
}

go 2 0 "stranger.yaml:1: plugin_path: '$work/lib' holds code that would run" stranger.yaml
go 0 1 '' stranger.yaml --trust
go 0 0 '' demo.yaml --trust
go 0 1 '' demo.yaml --set plugin_path=lib
go 2 0 'lib' stranger.yaml --set plugin_path.1=lib # one of two is the file's
before=$MHE_PLUGIN_PATH
MHE_PLUGIN_PATH=$before:$work/lib
go 0 1 '' demo.yaml
chmod 777 lib
go 0 0 '' demo.yaml
"$run" --list-plugins | grep -qF "$work/lib: everybody may write to it" || fail "--list-plugins does not name the folder"
MHE_PLUGIN_PATH=$before
go 2 0 'everybody may write to it' stranger.yaml --trust
chmod 755 lib
chmod 666 lib/constructor.so
go 0 0 '' stranger.yaml --trust
chmod 644 lib/constructor.so

# Whose code made the results stands in them.
"$run" demo.yaml --quiet --out o --set output.picture=false \
    --set 'solver={plugin: mhe.solver.rti, preset: speed, tolerance: 1e-5}' > out.txt 2> err.txt || fail "$(cat err.txt)"
for id in mhe.model.simbody mhe.muscle.hill mhe.integrator.rk mhe.solver.rti mhe.cost.emg-markers-high; do
    grep -q "\"$id\":.*\"/.*\.so\"" o/summary.json || fail "summary.json does not say where $id came from"
done

# A line break or an escape in a name would break tables and speak to terminals.
for bad in '&#10;' '&#9;' '&#127;'; do
    sed "s/\"Deltoid1\"/\"a\\${bad}b\"/" "$arm/arm19.osim" > arm19.osim
    line=$(grep -n "a${bad}b" arm19.osim | head -n 1 | cut -d: -f1)
    go 2 0 "arm19.osim:$line: muscle 'a" demo.yaml
    grep -q 'control character' err.txt || fail "$bad in a name: $(cat err.txt)"
done

finish "trust"

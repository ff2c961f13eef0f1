#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Whole runs of mhe-run, something failing in each: an allocation, or a call to open, read, write, rename or sync a file;
# once, and from then on. A run ends with the same results, or with one line that says why and without any.
#   whole.sh PATH/mhe-run PATH/torture PATH/faults.so SOURCE_DIR [RUNS OF EACH KIND, 0: every k]
set -u
run=$1
torture=$2
faults=$3
arm=$4/models/arm19
runs=${5:-8}
. "$(dirname "$0")/../support/script.sh"

head -n 24 "$arm/demo_markers.trc" > markers.trc
mkdir reference
once() { # KIND MODE FROM TO STEP
    "$torture" "$1" "$2" "$3" "$4" "$5" "$work" "$faults" "$run" "$arm/demo.yaml" --quiet --out "$work/out" \
        --set data.markers="$work/markers.trc" --set output.picture=false --set horizon.window=2 --set horizon.ratio=1 \
        --set 'output.formats=[sto, csv]' --set 'solver={plugin: mhe.solver.rti, preset: speed, tolerance: 1e-5}'
}

for kind in allocation open read write rename fsync; do
    n=$(once $kind once 0 0 0)
    status=$?
    [ $status -ne 2 ] || { echo "$kind: calls cannot be intercepted here; skipped"; continue; }
    [ $status -eq 0 ] || { fail "$kind: a run in which nothing fails: $(cat stderr)"; break; }
    [ -s reference/summary.json ] || { rmdir reference && mv out reference; }
    [ "$n" -gt 10 ] || fail "$kind: only $n of them in a run"
    step=1
    [ "$runs" -eq 0 ] || step=$((n / runs + 1))
    echo "$kind: $n in a run"
    for mode in once onwards; do
        once $kind $mode $((1 + step / 2)) "$n" "$step" || fail "$kind $mode"
    done
done

finish "torture"

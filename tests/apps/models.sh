#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The demos of the shipped OpenSim models: all windows converge, forces and angles are those of the simulation.
#   models.sh PATH/mhe-run SOURCE_DIR
set -u
run=$1
models=$2/models
. "$(dirname "$0")/../support/script.sh"

# holds 'EXPRESSION' for awk
holds() { awk "BEGIN { exit !($1) }"; }

# demo MODEL DEGREES NEWTONS
demo() {
    "$run" "$models/$1/demo.yaml" --out "$1" --quiet > "$1.txt" 2>&1 || fail "$1: exit status $?: $(cat "$1.txt")"
    holds "$(number converged "$1") == 1" || fail "$1: converged $(number converged "$1")"
    holds "$(number q_deg "$1") < $2" || fail "$1: joint angles $(number q_deg "$1") deg"
    holds "$(number force_n "$1") < $3" || fail "$1: forces $(number force_n "$1") N"
}

demo arm26 0.05 3
demo gait10dof 0.05 3
sha256sum "$models/arm26/arm26.osim" "$models/gait10dof/gait10dof18musc.osim" | while read -r sum file; do
    grep -q "$sum" "$(dirname "$file")/README.md" || echo "$file is not the file of its README"
done | grep . && fail "a model was changed"
finish models

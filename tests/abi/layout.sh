#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Where a state's parts begin stands in the layout that the system makes: nobody else counts [q, qdot, ...] by hand.
#   layout.sh SOURCE_DIR
cd "$1" || exit 1
found=$(grep -rnE '2 \* ([a-z]+(->|\.))?n_q' core apps plugins examples --include='*.c' --include='*.h' --include='*.cpp' | grep -v '^core/src/model/')
[ -z "$found" ] || {
    echo "$found"
    echo "ask the layout, or first_d and first_z of an integrator's dynamics, where the parts of x begin (docs/architecture.md)"
    exit 1
}

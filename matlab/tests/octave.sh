#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The package in Octave: the bits of mhe-run, and errors where something is wrong.
#   octave.sh OCTAVE FOLDER SOURCE_DIR PROGRAMS
set -u
octave=$1 folder=$2 source=$3 programs=$4
. "$source/tests/support/script.sh"
"$programs/mhe-run" "$source/models/arm19/demo.yaml" --out demo --quiet --set output.picture=false --set 'output.formats=[mat]' > run.txt 2>&1 ||
    fail "mhe-run: $(cat run.txt)"
(
    . "$source/tests/support/preload.sh"
    "$octave" --norc --no-gui --path "$folder" --eval "source('$source/matlab/tests/test_myohorizon.m'); \
    test_myohorizon('$source', '$work')" > out.txt 2>&1
) || fail "$(cat out.txt)"
grep -qx 'all as it should be' out.txt || fail "$(cat out.txt)"
finish "octave"

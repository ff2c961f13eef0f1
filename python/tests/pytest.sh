#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Runs a file of tests; 77 (skipped) where pytest is missing. Under a sanitizer its run time is loaded before the
# interpreter, whose own memory is none of ours.
#   pytest.sh PYTHON FILE
set -eu
"$1" -c 'import pytest' 2>/dev/null || { echo "python3-pytest is missing"; exit 77; }
case ${MHE_SANITIZE:-} in
*address*)
    LD_PRELOAD=$("$MHE_C_COMPILER" -print-file-name=libasan.so):$("$MHE_C_COMPILER" -print-file-name=libubsan.so)
    export LD_PRELOAD
    export ASAN_OPTIONS=detect_leaks=0
    ;;
thread) echo "the interpreter does not run under the thread sanitizer" && exit 77 ;;
esac
exec "$1" -B -m pytest -q -p no:cacheprovider "$2"

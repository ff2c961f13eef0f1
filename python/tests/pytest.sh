#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Runs a file of tests; 77 (skipped) where pytest is missing.
#   pytest.sh PYTHON FILE
set -eu
"$1" -c 'import pytest' 2>/dev/null || { echo "python3-pytest is missing"; exit 77; }
case ${MHE_SANITIZE:-} in
thread) echo "the interpreter does not run under the thread sanitizer" && exit 77 ;;
esac
. "$MHE_SOURCE/tests/support/preload.sh"
exec "$1" -B -m pytest -q -p no:cacheprovider "$2"

#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Whole runs of mhe-run in an address space that is too small (ulimit -v): plugins that cannot be mapped, files that
# cannot be read. Each ends with the same results as with all memory, or with one line that says what is short; a
# program that cannot even start is the linker's matter (127).
#   limits.sh PATH/mhe-run SOURCE_DIR
set -u
run=$1
arm=$2/models/arm19
. "$(dirname "$0")/../support/script.sh"

head -n 24 "$arm/demo_markers.trc" > markers.trc
once() { # FOLDER
    "$run" "$arm/demo.yaml" --quiet --out "$1" --set data.markers="$PWD/markers.trc" --set output.picture=false \
        --set horizon.window=2 --set horizon.ratio=1 > stdout 2> stderr < /dev/null
}
once reference || fail "with all memory: $(cat stderr)"
told=0
whole=0
kb=40000
while [ $kb -lt 400000 ] && [ $whole -lt 2 ]; do
    rm -rf out
    (ulimit -v $kb && once out)
    status=$?
    case $status in
    0)
        whole=$((whole + 1))
        cmp -s out/forces.sto reference/forces.sto || fail "$kb kB: other forces"
        ;;
    1)
        told=$((told + 1))
        grep -qiE 'memory' stderr || fail "$kb kB: not told as a lack of memory: $(cat stderr)"
        [ ! -e out/forces.sto ] || fail "$kb kB: results in spite of status 1"
        ;;
    127) ;;
    *) fail "$kb kB: status $status: $(cat stderr)" ;;
    esac
    kb=$((kb + 3000))
done
[ $whole -gt 0 ] || fail "no limit is enough"
[ $told -gt 1 ] || fail "only $told runs were short of memory"
finish "limits ($told short of memory)"

# SPDX-License-Identifier: Apache-2.0
# script.sh: what shell tests begin with; sourced. They then work in an empty folder of their own, removed at their end.
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
failed=0

fail() {
    echo "FAILED $*"
    failed=$((failed + 1))
}

# number KEY FOLDER: the first of that name in its summary.json
number() { sed -n "s/.*\"$1\":[[:space:]]*\\([-0-9.e]*\\).*/\\1/p" "$2/summary.json" | head -n 1; }

# finish NAME: the last command of a test
finish() {
    [ $failed -eq 0 ] && echo "$1: all as it should be"
    [ $failed -eq 0 ]
}

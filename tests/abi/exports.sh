#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# libmhe.so exports the functions that the public headers declare, each of them and nothing else, under its soname.
#   exports.sh LIBRARY INCLUDE_DIR
set -eu
library=$1 include=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
nm -D --defined-only "$library" | awk '{print $3}' | sort > "$work/exported"
# The name before the parenthesis of each MHE_API declaration, on its line or the next.
grep -hv '^#' "$include"/mhe/*.h | tr '\n' ' ' | grep -o 'MHE_API [^;(#]*(' | sed 's/.*[ *]\(mhe_[a-z0-9_]*\) *($/\1/' |
    sort > "$work/declared"
[ -s "$work/declared" ]
diff "$work/declared" "$work/exported" || {
    echo "FAILED: left is declared in include/mhe, right is exported by $library"
    exit 1
}
# Whoever declares a function of the core without MHE_API cannot be linked with.
if grep -nE '^(mhe_status|void|double|int32_t|size_t|const char \*) ?\*?mhe_[a-z_]+\(' "$include"/mhe/*.h | grep -v testkit.h; then
    echo "FAILED: declared without MHE_API"
    exit 1
fi
readelf -d "$library" | grep -q 'SONAME.*\[libmhe\.so\.[0-9]*\]' || { echo "FAILED: no soname" && exit 1; }
wc -l < "$work/exported"

#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# mhe-run stands on the public headers as anybody's program does: of ours it includes mhe/*.h, base/ (numbers, texts, no
# interface of the core) and what lies beside it.
#   includes.sh SOURCE_DIR
set -eu
cd "$1/apps"
bad=$(grep -n '#include "' mhe-run/*.[ch] common/*.[ch] | while IFS=: read -r file line text; do
    name=${text#*\"}
    name=${name%\"*}
    case $name in
    base/*) continue ;;
    esac
    [ -f "$(dirname "$file")/$name" ] || [ -f "common/$name" ] || echo "$file:$line: $text"
done)
[ -z "$bad" ] || {
    echo "$bad"
    echo "FAILED: private headers of the core"
    exit 1
}

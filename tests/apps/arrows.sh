#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The arrows of docs/architecture.md, apps -> core <- plugins, as far as includes and names show them.
#   arrows.sh SOURCE_DIR
set -u
cd "$1" || exit
failed=0

# tell WHAT LINES: nothing where there are none
tell() {
    [ -z "$2" ] && return
    echo "FAILED: $1:"
    echo "$2"
    failed=1
}

# Includes in quotes of files [...] that are neither beside them, nor in one of `more`, nor in base/.
foreign() {
    more=$1
    shift
    grep -n '#include "' "$@" /dev/null | while IFS=: read -r file line text; do
        name=${text#*\"}
        name=${name%\"*}
        case $name in
        base/*) continue ;;
        esac
        for folder in "$(dirname "$file")" $more; do
            [ -f "$folder/$name" ] && continue 2
        done
        echo "$file:$line: $text"
    done
}

# mhe-run stands on the public headers as anybody's program does; base/ is no interface of the core.
tell "mhe-run includes private headers" "$(foreign "apps/common page" apps/mhe-run/*.[ch] apps/mhe-live/*.[ch] apps/common/*.[ch])"
# A plugin sees the public headers, its own files, what plugins share (plugins/*.h), and the page.
for plugin in plugins/*/; do
    sources=$(find "$plugin" -name '*.[ch]' -not -path '*/tests/*' -not -name 'test_*')
    # Unquoted: file names without blanks.
    # shellcheck disable=SC2086
    tell "$plugin includes what is not its own" "$(foreign "$plugin page" $sources)"
done
tell "the core names plugins" "$(grep -rnE '"[^"]*mhe\.(model|muscle|force|cost|integrator|solver|source|sink)\.[a-z]' core/src |
    grep -vE '\.(hessian|jacobian)/[0-9]')"
exit $failed

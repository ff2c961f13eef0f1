#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Parts of the README files and of docs/ that are made from the program and from compiled files. Fails where one is stale.
#   docs.sh check|update PATH/mhe-run SOURCE_DIR
#
# Between "<!-- options ID -->" and "<!-- /options -->": what --describe ID says. Between "<!-- file: PATH -->" and
# "<!-- /file -->": that file, as a code block.
set -eu
mode=$1 run=$2 source=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$source"

fresh() {
    while IFS= read -r line; do
        case $line in
        '<!-- options '*)
            id=${line#<!-- options }
            printf '%s\n' "$line"
            "$run" --describe "${id% -->}" --markdown
            skip='<!-- /options -->'
            ;;
        '<!-- file: '*)
            path=${line#<!-- file: }
            path=${path% -->}
            printf '%s\n```%s\n' "$line" "$(case $path in *.c) echo c ;; *.txt) echo cmake ;; esac)"
            cat "$path"
            printf '```\n'
            skip='<!-- /file -->'
            ;;
        *)
            printf '%s\n' "$line"
            continue
            ;;
        esac
        while IFS= read -r line && [ "$line" != "$skip" ]; do :; done
        printf '%s\n' "$skip"
    done < "$1"
}

stale=0
for readme in README.md docs/*.md plugins/*/README.md; do
    fresh "$readme" > "$work/fresh.md"
    if cmp -s "$readme" "$work/fresh.md"; then
        continue
    fi
    if [ "$mode" = update ]; then
        cp "$work/fresh.md" "$readme"
        echo "updated $readme"
    else
        echo "$readme is stale; 'tests/docs/docs.sh update MHE_RUN .' renews it"
        diff "$readme" "$work/fresh.md" | head -20
        stale=1
    fi
done
exit $stale

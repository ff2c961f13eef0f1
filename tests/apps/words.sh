#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Command lines: wrong ones end with status 2 and one line; --help, man page and completions come from the same table.
#   words.sh BIN_DIR BUILD_DIR SOURCE_DIR
set -u
bin=$1 build=$2
failed=0

# refused TEXT PROGRAM WORDS...
refused() {
    local text=$1 program=$2
    shift 2
    output=$("$bin/$program" "$@" 2>&1)
    local status=$?
    if [ $status -ne 2 ] || [ "$(wc -l <<<"$output")" -ne 1 ] || [[ $output != *"$text"* ]]; then
        echo "FAILED: $program $*: status $status, '$output'; wanted: '$text'"
        failed=1
    fi
}

refused "no config file is given; 'mhe-run --help' shows the usage" mhe-run
refused "unknown option '--ouT' (did you mean '--out'?)" mhe-run x.yaml --ouT
refused "--out needs a value" mhe-run x.yaml --out
refused "one config file at a time: 'a.yaml' and 'b.yaml'" mhe-run a.yaml b.yaml
refused "--repeats: 'x' is no whole number from 1 to 1000" mhe-bench a.yaml --repeats x
refused "no command is given" mhe-sim
refused "unknown command 'forwrad' (did you mean 'forward'?)" mhe-sim forwrad
refused "unknown option '--input'" mhe-sim noise a.yaml --input b.sto
refused "--rate 'fast': a number of Hz above 0 is needed" mhe-sim follow a.yaml --rate fast
refused "a config file and --input are needed" mhe-sim forward a.yaml
refused "no study file is given" mhe-study run
refused "no config file is given" mhe-calibrate
refused "no results folder is given" mhe-study merge
refused "--shard: '8/8' is not like 0/8" mhe-study run a.yaml --shard 8/8
refused "--workers: '0' is no whole number from 1 to" mhe-study run a.yaml --workers 0

for program in mhe-run mhe-bench mhe-sim mhe-study mhe-calibrate; do
    page=$build/share/man/man1/$program.1 completion=$build/share/bash-completion/completions/$program
    options=$("$bin/$program" --help | grep -oE '^  --[a-z-]+' | sort -u)
    [ -n "$options" ] || { echo "FAILED: $program --help shows no option" && failed=1; }
    for option in $options; do
        grep -qF -- "\\fB${option//-/\\-}\\fR" "$page" || { echo "FAILED: $option is not in $page" && failed=1; }
    done
    if command -v man >/dev/null && [ -n "$(MANWIDTH=80 man --warnings -l "$page" 2>&1 >/dev/null)" ]; then
        echo "FAILED: $page is no clean man page"
        failed=1
    fi
    # shellcheck disable=SC1090
    source "$completion"
done

# completed TEXT WORDS...: the last word completes to (among others) TEXT
completed() {
    local text=$1
    shift
    COMP_WORDS=("$@")
    COMP_CWORD=$(($# - 1))
    COMPREPLY=()
    "$(complete -p "$1" | sed 's/.*-F \([^ ]*\) .*/\1/')"
    printf '%s\n' "${COMPREPLY[@]}" | grep -qxF -- "$text" || {
        echo "FAILED: '$*' does not complete to $text, but to ${COMPREPLY[*]}"
        failed=1
    }
}

completed --describe mhe-run --des
completed follow mhe-sim fo
completed --no-cache mhe-sim reference a.yaml --no
completed /usr mhe-run a.yaml --out /us
completed --shard mhe-study run --sh
exit $failed

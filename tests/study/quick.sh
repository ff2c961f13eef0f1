#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The shipped studies in short, from motions to the page: nothing fails, tables and figures are there and hold numbers; the
# long ones are sound.
#   quick.sh PATH/mhe-study SOURCE_DIR
set -u
study=$1 source=$2
. "$source/tests/support/script.sh"
export XDG_CACHE_HOME="$work/cache"

for file in "$source"/models/arm*/studies/study-*.yaml; do
    "$study" run --check "$file" > out.txt 2> err.txt || fail "--check $file: $(cat err.txt)"
done

python=${MHE_PYTHON:-/usr/bin/python3}
"$python" -c 'import pandas, statsmodels, matplotlib' 2> /dev/null && reports=1 || reports=0
[ $reports -eq 1 ] || echo "no reports: python3-pandas, python3-statsmodels or python3-matplotlib is not installed"

# quick FILE FILES_OF_THE_REPORT...
quick() {
    name=$(basename "$1" .yaml)
    begin=$(date +%s)
    "$study" run "$1" --out "$name" --quiet > out.txt 2> err.txt || fail "$name: $(cat err.txt)"
    grep -q ' 0 trials failed' out.txt || fail "$name: $(cat out.txt)"
    shift
    if [ $reports -eq 1 ]; then
        "$study" report "$name" > out.txt 2> err.txt || fail "report of $name: $(cat err.txt)"
        [ -s err.txt ] && fail "report of $name warns: $(cat err.txt)"
        for made in "$@" conditions.csv conditions.md report.html; do
            [ -s "$name/report/$made" ] || fail "$name: no $made"
        done
        # All in one file.
        grep -Eq '(src|href)="?(http|[a-z]*\.(png|css|js))' "$name/report/report.html" && fail "$name: the page needs other files"
        grep -c '<img' "$name/report/report.html" | awk '$1 < 1 { exit 1 }' || fail "$name: no figure on the page"
    fi
    echo "$name: $(($(date +%s) - begin)) s"
}

quick "$source/models/arm19/studies/study-noise-quick.yaml" figure2.pdf figure5.png figure6.pdf figure7.png figure8.pdf \
    anova-force.csv anova-angles.md pairs-force.csv
quick "$source/models/arm19/studies/study-window-quick.yaml" figure3.pdf figure4.png rate.csv
quick "$source/models/arm19/studies/study-emg-subset-quick.yaml" force.pdf anova-force.csv
quick "$source/models/arm35/studies/study-muscles-quick.yaml" rate.png

# The page of the comparison with the paper is filled from the tables, again and again the same.
if [ $reports -eq 1 ]; then
    page() { "$python" -B "$source/docs/study/update.py" --to page "$@" > out.txt 2> err.txt; }
    mkdir page
    cp "$source/docs/study.md" page
    page study-noise-quick study-window-quick study-emg-subset-quick study-muscles-quick || fail "page: $(cat err.txt)"
    for row in 'about 24 Hz | [0-9]' '3.7 × real time | `mhe.solver.ipopt`' 'force errors of 1 to 30 N | tracking [0-9]' 'excitation | 7 | 3 | [0-9]' \
        'mid | subset | [0-9]' 'noise | 48 of 48 '; do
        grep -q "^| .*$row" page/study.md || grep -q "^| $row" page/study.md || fail "the page lacks '$row'"
    done
    [ -s page/study/window/figure3.png ] && cmp page/study/noise/results.csv study-noise-quick/results.csv || fail "tables are not taken over"
    page --check || fail "a page just filled is stale: $(cat out.txt err.txt)"
    sed -i 's/^| about 24 Hz | [0-9]*/| about 24 Hz | 1/' page/study.md
    page --check && fail "a changed page is taken for fresh"
    page small && fail "a folder without a report is taken over"
    grep -q 'mhe-study report small' err.txt || fail "a folder without a report: $(cat err.txt)"
fi

# What the section may say is told where it is wrong, and what it shows can change without running anything again.
if [ $reports -eq 1 ]; then
    cp "$source"/models/arm19/studies/*.yaml .
    sed -i "s|: \.\./|: $source/models/arm19/|" ./*.yaml
    "$study" run study-emg-subset-quick.yaml --out changed --set trials=1 --quiet > out.txt 2> err.txt || fail "changed: $(cat err.txt)"
    sed -i 's/y: force_n, x: cocontraction/y: q_deg, x: cocontraction/; s/name: force, y: q_deg/name: angles, y: q_deg/' study-emg-subset-quick.yaml
    "$study" report changed --quiet > out.txt 2> err.txt || fail "changed report: $(cat err.txt)"
    [ -s changed/report/angles.pdf ] || fail "the changed section is not used"
    sed -i 's/y: q_deg, x/y: q_degg, x/' study-emg-subset-quick.yaml
    "$study" report changed --quiet > out.txt 2> err.txt
    status=$?
    [ $status -eq 2 ] && grep -q "no column 'q_degg'" err.txt || fail "an unknown column: $status, $(cat err.txt)"
    sed -i 's/^seed:.*/seed: 5/' study-emg-subset-quick.yaml
    "$study" report changed --quiet > out.txt 2> err.txt
    status=$?
    [ $status -eq 2 ] && grep -q 'study.id:4' err.txt || fail "a changed study: $status, $(cat err.txt)"
fi

finish "quick"

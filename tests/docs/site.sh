#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# The site builds without warnings; no link of README.md, docs/ or the READMEs leads nowhere; the search finds what it should.
#   site.sh SOURCE_DIR WORK_DIR PROGRAMS
set -eu
/usr/bin/python3 -c 'import mkdocs' 2> /dev/null || { echo "skipped: mkdocs is missing" && exit 77; }
mkdir -p "$2"
/usr/bin/python3 -B "$1/docs/site/make.py" "$1" "$2" "$3"
for page in index.html config.html python.html plugins/solver_rti.html headers/estimator_h.html programs/mhe-run.html; do
    [ -s "$2/html/$page" ] || { echo "FAILED: there is no $page" && exit 1; }
done
grep -q 'marker_outlier' "$2/html/search/search_index.json" || { echo "FAILED: the search finds no key of the config" && exit 1; }
grep -q 'muscles at full activation' "$2/html/faq.html" && [ "$(grep -c '<tr>' "$2/html/faq.html")" -gt 30 ] ||
    { echo "FAILED: the page of findings has none" && exit 1; }
/usr/bin/python3 -B "$1/tests/docs/links.py" "$2/html" "$1/docs/site/links.txt"

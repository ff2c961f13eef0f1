#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Slips of the keyboard in pages, headers and docstrings. Left out are file endings and names of muscles and options.
#   spelling.sh SOURCE_DIR
set -eu
command -v codespell > /dev/null || { echo "skipped: codespell is missing" && exit 77; }
cd "$1"
codespell --ignore-words-list=mot,fro,trimed,thre,ot,te ./*.md docs/*.md plugins/*/README.md models/*/README.md core/include/mhe/*.h \
    python/myohorizon/*.py matlab/+myohorizon/*.m

#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Installs the packages in a clean Debian and tries the first examples of the pages there. Needs root, mmdebstrap and a
# mirror; ends with 77 where it cannot run.
#   try.sh FOLDER_OF_DEBS SOURCE_DIR [SUITE]
set -u
debs=$(realpath "$1") source=$(realpath "$2") suite=${3:-bookworm}
skip() {
    echo "skipped: $*"
    exit 77
}
[ "$(id -u)" -eq 0 ] || skip "a chroot needs root"
command -v mmdebstrap > /dev/null || skip "mmdebstrap is missing"
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT
mmdebstrap --variant=apt "$suite" "$root" > "$root.log" 2>&1 || skip "no Debian could be made: $(tail -3 "$root.log")"
mkdir "$root/debs"
cp "$debs"/*.deb "$root/debs"
cp "$source/docs/python.md" "$source/docs/matlab.md" "$root/debs"
inside() {
    chroot "$root" /usr/bin/env DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 sh -euc "$1" || {
        echo "FAILED: $1"
        exit 1
    }
}
inside 'apt-get install -y --no-install-recommends /debs/*.deb > /debs/log 2>&1 || { tail -20 /debs/log; exit 1; }'
inside 'mhe-run /usr/share/mhe/models/arm19/demo.yaml --out /tmp/demo --quiet | grep -q "usable"'
inside 'cd /usr/share/mhe && python3 -c "import myohorizon; r = myohorizon.run(\"models/arm19/demo.yaml\"); assert r.verdict == \"yes\", r.verdict"'
inside 'cd /usr/share/mhe && ! command -v octave-cli > /dev/null || octave-cli --norc --path /usr/share/mhe/matlab --eval "
    r = myohorizon.run(\"models/arm19/demo.yaml\"); assert(strcmp(r.verdict, \"yes\"))"'
inside 'apt-get purge -y libmhe0 > /debs/log 2>&1 && [ ! -e /usr/share/mhe ]'
echo "installed, tried and removed in $suite"

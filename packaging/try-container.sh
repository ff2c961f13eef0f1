#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Builds the container recipe and does in the image what the pages say first. No registry is needed: the image of Debian is made by
# mmdebstrap. Needs root, buildah, mmdebstrap and a mirror; ends with 77 where it cannot run. It takes the time of a whole build.
#   try-container.sh SOURCE_DIR [FOLDER_FOR_IMAGES]
set -u
source=$(realpath "$1")
skip() {
    echo "skipped: $*"
    exit 77
}
[ "$(id -u)" -eq 0 ] || skip "images are built as root here"
for program in buildah mmdebstrap; do
    command -v "$program" > /dev/null || skip "$program is missing"
done
work=$(mktemp -d)
images=${2:-$work/images}
trap 'rm -rf --one-file-system "$work"' EXIT
# chroot and vfs: no namespaces, no overlays, so that it runs in a container itself.
export BUILDAH_ISOLATION=chroot STORAGE_DRIVER=vfs
images() {
    buildah --root "$images" --runroot "$work/run" "$@"
}
step() {
    local title=$1
    shift
    "$@" > "$work/log" 2>&1 || {
        tail -30 "$work/log"
        echo "FAILED: $title"
        exit 1
    }
    echo "ok: $title: $(tail -1 "$work/log")"
}
base=docker.io/library/debian:bookworm
if ! images inspect --type image "$base" > /dev/null 2>&1; then
    mmdebstrap --variant=minbase bookworm "$work/debian.tar" > "$work/log" 2>&1 || skip "no Debian could be made: $(tail -3 "$work/log")"
    debian=$(images from scratch)
    step "an image of Debian" images add "$debian" "$work/debian.tar" /
    step "its name" images commit "$debian" "$base"
    images rm "$debian" > /dev/null
    rm "$work/debian.tar"
fi
step "the recipe" images bud --pull-never -f "$source/packaging/Containerfile" -t myohorizon "$source"

here=$(images from --pull-never myohorizon)
inside() {
    step "$1" images run "$here" -- sh -euc "$2"
}
inside "the README's demo" 'cd /tmp && cp -r /usr/share/mhe/models . && mhe-run models/arm19/demo.yaml --out out/demo --quiet &&
    [ -s out/demo/report.html ] && [ "$(sed "1,/endheader/d" out/demo/estimates.sto | grep -c .)" -eq 95 ]'
awk '$0 == "```python" {on = 1; next} on && /^```/ {exit} on' "$source/docs/python.md" > "$work/first.py"
step "the Python page's first block, copied" images copy "$here" "$work/first.py" /tmp/first.py
inside "the Python page's first block" 'cd /tmp && python3 first.py'
echo "built and tried"

#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Installs the packages in a clean Debian and does there what the pages say first: the README's demo, the Python page's and the
# Octave page's first block, word by word; an example plugin is built; all is removed again without a trace. Needs root,
# mmdebstrap and a mirror; ends with 77 where it cannot run.
#   try.sh FOLDER_OF_DEBS SOURCE_DIR [SUITE]
set -u
debs=$(realpath "$1") source=$(realpath "$2") suite=${3:-bookworm}
skip() {
    echo "skipped: $*"
    exit 77
}
[ "$(id -u)" -eq 0 ] || skip "a chroot needs root"
command -v mmdebstrap > /dev/null || skip "mmdebstrap is missing"
[ -e "$(echo "$debs"/myohorizon_*.deb)" ] || skip "there are no packages in $debs"
work=$(mktemp -d)
root=$work/root
trap 'umount "$root/proc" 2> /dev/null; rm -rf --one-file-system "$work"' EXIT
mmdebstrap --variant=apt --skip=cleanup/apt/lists "$suite" "$root" > "$work/log" 2>&1 || skip "no Debian could be made: $(tail -3 "$work/log")"
mount -t proc proc "$root/proc" 2> /dev/null || true # where it is allowed
mkdir "$root/debs"
cp "$debs"/*.deb "$root/debs"

# first LANGUAGE PAGE: the page's first block of the language
first() {
    awk -v fence="\`\`\`$1" '$0 == fence {on = 1; next} on && /^```/ {exit} on' "$2"
}
first python "$source/docs/python.md" > "$root/debs/first.py"
first octave "$source/docs/matlab.md" > "$root/debs/first.m"
grep -q myohorizon.run "$root/debs/first.py" && grep -q myohorizon.run "$root/debs/first.m" || {
    echo "FAILED: the pages' first blocks are not found"
    exit 1
}

# inside TITLE COMMANDS: in the new Debian, as a user would
inside() {
    if chroot "$root" /usr/bin/env -i PATH=/usr/bin:/usr/sbin:/bin:/sbin HOME=/root \
        ${http_proxy+http_proxy="$http_proxy"} ${https_proxy+https_proxy="$https_proxy"} DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 \
        sh -euc "$2" > "$work/out" 2>&1; then
        echo "ok: $1: $(tail -1 "$work/out")"
    else
        tail -30 "$work/out"
        echo "FAILED: $1"
        exit 1
    fi
}
inside "apt install" 'cd /debs && apt-get install -y ./myohorizon_*.deb'
inside "the README's demo" 'cd /tmp && cp -r /usr/share/mhe/models . && mhe-run models/arm19/demo.yaml --out out/demo &&
    [ -s out/demo/report.html ] && [ "$(sed "1,/endheader/d" out/demo/estimates.sto | grep -c .)" -eq 95 ]'
inside "a man page and completion of every program" 'for program in /usr/bin/mhe-*; do
        name=$(basename $program)
        [ -s /usr/share/man/man1/$name.1.gz ]
        [ -s /usr/share/bash-completion/completions/$name ]
    done'
inside "apt install, Python" 'cd /debs && apt-get install -y --no-install-recommends ./python3-myohorizon_*.deb python3-pandas'
inside "the Python page's first block" 'cd /tmp && python3 /debs/first.py'
if [ -e "$(echo "$debs"/octave-myohorizon_*.deb)" ]; then
    inside "apt install, Octave" 'cd /debs && apt-get install -y --no-install-recommends ./octave-myohorizon_*.deb'
    inside "the Octave page's first block" 'cd /tmp && octave-cli --norc --no-gui /debs/first.m'
fi
inside "apt install, development" 'cd /debs && apt-get install -y --no-install-recommends ./libmhe0_*.deb ./libmhe-dev_*.deb \
    cmake gcc g++ make pkg-config libcmocka-dev dpkg-dev'
inside "an example plugin, by the plugin page" 'cd /tmp && cp -r /usr/share/mhe/examples/cost_effort mine && cd mine &&
    cmake -S . -B build && cmake --build build && ctest --test-dir build &&
    MHE_PLUGIN_PATH=$PWD/build mhe-run --describe org.example.cost.effort'
inside "a program that embeds the library, and what a package of it would depend on" 'cd /tmp &&
    cc /usr/share/mhe/examples/stream/stream.c -D_POSIX_C_SOURCE=200809L $(pkg-config --cflags --libs mhe) -o stream &&
    ldd stream | grep -q "libmhe.so.0 => /lib/x86_64-linux-gnu/libmhe.so.0\|libmhe.so.0 => /usr/lib" &&
    [ "$(./stream models/arm19/demo.yaml solver.plugin=mhe.solver.rti | wc -l)" -eq 94 ] &&
    mkdir -p debian && printf "Source: s\n\nPackage: s\nArchitecture: any\n" > debian/control &&
    dpkg-shlibdeps -O stream 2> /dev/null | grep -q "libmhe0 (>= 0" && dpkg-shlibdeps -O stream'
inside "apt purge" 'apt-get purge -y libmhe0 myohorizon && [ ! -e /usr/share/mhe ] && [ ! -e /usr/lib/*/mhe ] && [ ! -e /usr/lib/python3/dist-packages/myohorizon ]'
echo "installed, tried and removed in $suite"

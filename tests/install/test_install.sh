#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Installs into a folder, moves that elsewhere, and works with it as a stranger would: a cost plugin and an application
# built with find_package, the same plugin with pkg-config alone; listed, described, checked, run.
# usage: test_install.sh CMAKE CC SOURCE_DIR BUILD_DIR LIBDIR SANITIZERS
set -eu
cmake=$1 cc=$2 source=$3 build=$4 libdir=$5 sanitizers=$6
here=$source/tests/install
work=$build/tests/install_package
# Outside of the build tree: what lies in that looks for plugins there too.
elsewhere=$(mktemp -d)
trap 'rm -rf "$elsewhere"' EXIT
prefix=$elsewhere/moved
id=org.example.cost.effort
export CMAKE_BUILD_PARALLEL_LEVEL=2

give_up() {
    printf 'FAILED: %s\n' "$*" >&2
    exit 1
}

# expect TEXT FILE
expect() {
    grep -qF -- "$1" "$2" || { cat "$2"; give_up "'$1' is not in $2"; }
}

# build_project FOLDER: into work/<its name> against the installation; its programs are instrumented as the core is
build_project() {
    folder=$1
    set -- "$(basename "$1")"
    {
        "$cmake" -S "$folder" -B "$work/$1" -DCMAKE_C_COMPILER="$cc" -DCMAKE_PREFIX_PATH="$prefix" \
            -DCMAKE_BUILD_TYPE=Release -DCMAKE_C_FLAGS="-Wall -Wextra -Wpedantic -Werror" \
            -DCMAKE_EXE_LINKER_FLAGS="${sanitizers:+-fsanitize=$sanitizers}"
        "$cmake" --build "$work/$1"
    } >"$work/$1.log" 2>&1 || give_up "$1 is not built; see $work/$1.log"
}

install_and_move() {
    rm -rf "$work"
    mkdir -p "$work"
    "$cmake" --install "$build" --prefix "$work/first" >"$work/install.log"
    mv "$work/first" "$prefix"
    if grep -rlF "$source" "$prefix/$libdir/cmake" "$prefix/$libdir/pkgconfig" "$prefix/include"; then
        give_up "these installed files name the source tree"
    fi
    if grep -l mhe_flags "$prefix/$libdir"/cmake/mhe/*Targets*.cmake; then
        give_up "the build's own flags leak into the package"
    fi
}

plugin_by_pkg_config() {
    mkdir -p "$work/by_pkg_config"
    # Unquoted: flags are words.
    # shellcheck disable=SC2046
    "$cc" -std=c11 -O2 -fPIC -shared -fvisibility=hidden -Wl,-z,defs $(pkg-config --cflags mhe-plugin) \
        "$source/examples/cost_effort/cost_effort.c" -o "$work/by_pkg_config/cost_effort.so"
    symbols=$(nm -D --defined-only "$work/by_pkg_config/cost_effort.so" | awk '{print $3}')
    [ "$symbols" = mhe_plugin_entry ] || give_up "the plugin exports: $symbols"
    plugins=$(pkg-config --variable=plugindir mhe-plugin)
    [ "$(cd "$plugins" && pwd)" = "$prefix/$libdir/mhe/plugins/abi0" ] || give_up "plugindir is $plugins"
    "$prefix/bin/mhe-conformance" "$work/by_pkg_config/cost_effort.so"
}

application_by_pkg_config() {
    # shellcheck disable=SC2046
    "$cc" -std=c11 ${sanitizers:+-fsanitize=$sanitizers} "$here/external_app/embed.c" $(pkg-config --cflags --libs mhe) \
        -o "$work/embed_by_pkg_config"
    LD_LIBRARY_PATH="$prefix/$libdir" "$work/embed_by_pkg_config" "$source/models/arm19/demo.yaml" >"$work/embed.txt"
    expect "4 coordinates, 19 muscles" "$work/embed.txt"
}

run_with_plugin() {
    run=$prefix/bin/mhe-run
    "$run" --list-plugins >"$work/list.txt"
    expect "$id" "$work/list.txt"
    expect mhe.solver.ipopt "$work/list.txt"
    "$run" --list-plugins --json >"$work/list.json"
    expect "\"$prefix/" "$work/list.json" # the installed plugins, found from the program
    for format in "" --json --markdown; do
        # shellcheck disable=SC2086
        "$run" --describe "$id" $format >"$work/describe.txt"
        expect "Activation that costs nothing." "$work/describe.txt"
    done
    # The first 0.6 s of the demo, with the new cost beside the usual one.
    demo=$source/models/arm19
    head -n 66 "$demo/demo_markers.trc" >"$work/markers.trc"
    head -n 67 "$demo/demo_emg.sto" >"$work/emg.sto"
    costs="costs=[{plugin: mhe.cost.emg-markers-high}, {plugin: $id, rest: 0.01, weight: 0.1}]"
    "$run" "$demo/demo.yaml" --quiet --out "$work/out" --set "data.markers=$work/markers.trc" \
        --set "data.emg=$work/emg.sto" --set "$costs" >"$work/run.txt" 2>&1 || { cat "$work/run.txt"; give_up "no run"; }
    expect "$id" "$work/out/config.yaml"
    expect '"converged"' "$work/out/summary.json"
    if "$run" --check "$demo/demo.yaml" --set "costs=[{plugin: $id, rest: 2}]" >"$work/check.txt" 2>&1; then
        give_up "rest = 2 is out of range, yet accepted"
    fi
    expect rest "$work/check.txt"
}

# Which plugin stands where a configuration names none is said by an installed file, not by the core.
defaults() {
    file=$prefix/share/mhe/defaults.yaml
    cp "$file" "$work/defaults.yaml"
    sed -i 's/^solver:.*/solver: mhe.solver.rti/' "$file"
    "$prefix/bin/mhe-run" --describe config >"$work/describe.txt"
    expect "mhe.solver.rti" "$work/describe.txt"
    echo "sovler: x" >>"$file"
    if "$prefix/bin/mhe-run" --check "$source/models/arm19/demo.yaml" --set solver= >"$work/check.txt" 2>&1; then
        give_up "a wrong line in defaults.yaml is accepted"
    fi
    expect "defaults.yaml:11: defaults are lines like" "$work/check.txt"
    rm "$file"
    if "$prefix/bin/mhe-run" --check "$source/models/arm19/demo.yaml" --set solver= >"$work/check.txt" 2>&1; then
        give_up "no plugin is named anywhere, yet one is used"
    fi
    expect "model: the id of a plugin is missing" "$work/check.txt"
    cp "$work/defaults.yaml" "$file"
}

# The first half second of the demo by the example's muscles and integrator, streamed by the example's program: numbers
# on every line, and not those of the usual muscles.
stream_examples() {
    demo=$source/models/arm19
    set -- "$demo/demo.yaml" "data.markers=$work/markers.trc" "data.emg=$work/emg.sto" horizon.window=3
    "$work/stream/stream" "$@" >"$work/usual.txt" || give_up "stream"
    MHE_PLUGIN_PATH="$work/muscle_gauss:$work/integrator_midpoint" "$work/stream/stream" "$@" \
        "muscle={plugin: org.example.muscle.gauss}" "integrator={plugin: org.example.integrator.midpoint, steps: 4}" \
        >"$work/own.txt" || give_up "stream with plugins of its own"
    for file in usual own; do
        awk 'NF != 20 || /nan|inf/ {exit 1} {n++} END {exit n < 10}' "$work/$file.txt" || give_up "stream: $file.txt"
    done
    if cmp -s "$work/usual.txt" "$work/own.txt"; then
        give_up "other muscles, the same forces"
    fi
}

install_and_move
defaults
# The examples as a stranger has them: from the installed package, each built and checked for itself.
for example in cost_effort muscle_gauss force_spring integrator_midpoint; do
    build_project "$prefix/share/mhe/examples/$example"
    (cd "$work/$example" && ctest --output-on-failure) >"$work/ctest.log" || { cat "$work/ctest.log"; give_up "$example"; }
done
build_project "$prefix/share/mhe/examples/stream"
build_project "$here/external_app"
# It lies outside of bin/ and knows of no variable: the plugins are found as seen from libmhe.so.
env -u MHE_PLUGIN_PATH "$work/external_app/embed" "$source/models/arm19/demo.yaml" >"$work/embed.txt" || give_up embed
expect "4 coordinates, 19 muscles" "$work/embed.txt"
export MHE_PLUGIN_PATH="$work/cost_effort"
"$work/external_app/embed" "$source/models/arm19/demo.yaml" --set=solver.plugin=no.such.plugin >"$work/none.txt" 2>&1 &&
    give_up "a plugin that is not there was found"
expect "no plugin 'no.such.plugin'" "$work/none.txt"
expect "searched: $work/cost_effort, $prefix/$libdir/mhe/plugins/abi0, " "$work/none.txt"
export PKG_CONFIG_PATH="$prefix/$libdir/pkgconfig"
plugin_by_pkg_config
application_by_pkg_config
run_with_plugin
stream_examples
echo "installed package: all as it should be"

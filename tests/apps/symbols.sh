#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# libSimTKmath exports old copies of Ipopt's and SUNDIALS' functions. Inside a running mhe-run that has Simbody loaded,
# IpoptSolve and CVode must come from libipopt and libsundials all the same: the dynamic linker tells what it bound.
#   symbols.sh MHE_RUN SOURCE_DIR
set -u
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
LD_DEBUG=bindings LD_DEBUG_OUTPUT=$work/bindings "$1" "$2/models/arm19/demo.yaml" --out "$work/out" --quiet \
    --set integrator.plugin=mhe.integrator.sundials --set horizon.window=2 --set horizon.ratio=100 --set formulation=activation \
    --set 'solver={plugin: mhe.solver.ipopt, max_iterations: 1}' --set output.picture=false > /dev/null 2> "$work/err.txt"
# One iteration with intervals of a second solves nothing (status 1): what counts is that all parts ran.
[ -f "$work/out/summary.json" ] || {
    cat "$work/err.txt"
    exit 1
}
failed=0
# bound PLUGIN SYMBOL LIBRARY: what the plugin's own reference was bound to (Simbody's inner calls are its affair)
bound() {
    to=$(cat "$work"/bindings.* |
        sed -n "s/.*binding file [^ ]*$1.so [^ ]* to \\([^ ]*\\) .*symbol \`$2'.*/\\1/p" | sort -u)
    case $to in
    *"/$3".so*) echo "$2 from $(basename "$to")" ;;
    *) echo "FAILED $2 comes from '$to', not from $3" && failed=1 ;;
    esac
}
bound mhe_solver_ipopt IpoptSolve libipopt
bound mhe_solver_ipopt CreateIpoptProblem libipopt
bound mhe_integrator_sundials CVode libsundials_cvodes
bound mhe_integrator_sundials CVodeInit libsundials_cvodes
cat "$work"/bindings.* | grep -q 'libSimTKsimbody' || { echo "FAILED Simbody was not loaded" && failed=1; }
exit $failed

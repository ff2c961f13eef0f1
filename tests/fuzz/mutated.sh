#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Whole runs of mhe-run over spoilt inputs: each ends with 0, 1 or 2, within a limit of processor time, without a
# report of a sanitizer. The inputs are short parts of shipped files, one of them spoilt at a time.
#   mutated.sh PATH/mhe-run PATH/mutate SOURCE_DIR [COUNT [FIRST_SEED]]
# A build with sanitizers and ten thousand runs: MHE_MUTATED_SECONDS=2 mutated.sh build/asan-ubsan/bin/mhe-run build/asan-ubsan/tests/mutate . 10000
# What fails stays in ./mutated-SEED.* of the folder that it was called from. MHE_MUTATED_LOG names a file that gets a
# line a run: seed, file, status, ms of processor time.
set -u
run=$1 mutate=$2 source=$3 count=${4:-150} first=${5:-1} home=$PWD
case $mutate in /*) ;; *) mutate=$PWD/$mutate ;; esac
case $run in /*) ;; *) run=$PWD/$run ;; esac
source=$(cd "$source" && pwd)
. "$source/tests/support/script.sh"
export ASAN_OPTIONS=detect_leaks=1:exitcode=99 UBSAN_OPTIONS=print_stacktrace=1:exitcode=99
seconds=${MHE_MUTATED_SECONDS:-30} # by default only what never ends fails: machines differ

arm=$source/models/arm19
cp "$arm/arm19.osim" model.osim
cat > model.bioMod <<'END'
version 4 // header
gravity 0 -9.81 0
variables
 $l 0.25
endvariables
segment Trunk
 RTinMatrix 1
 RT 1 0 0 0  0 1 0 0.1  0 0 1 0  0 0 0 1
endsegment
segment Arm
 parent Trunk
 RT 0 0 0 xyz 0 -0.1 0
 rotations zx
 ranges -0.2 2.6 -1 1
 mass 1.5
 inertia 0.012 0 0 0 0.002 0 0 0 0.012
 com 0 -0.13 0
 meshfile a.vtp
endsegment
/* marker N endmarker */
marker M
 parent Arm
 position 0.02 -$l 0.03
 technical 1
endmarker
musclegroup G
 OriginParent Trunk
 InsertionParent Arm
endmusclegroup
muscle Flex
 Type hilldegroote
 musclegroup G
 OriginPosition 0.05 0.2 0
 InsertionPosition 0.02 -0.1 0
 optimalLength 0.2
 maximalForce 500
 tendonSlackLength 0.1
 pennationAngle 0.1
 maxVelocity 10
endmuscle
viapoint v
 parent Arm
 muscle Flex
 musclegroup G
 position 0.03 -0.02 0.01
endviapoint
wrapping W
 parent Arm
endwrapping
END
sed '/^nRows/s/=.*/=30/' "$arm/demo_reference.sto" | awk '/^time/ { data = NR } !data || NR <= data + 30' > reference.sto
"$(dirname "$run")/mhe-sim" noise "$arm/demo_recording.yaml" --set "reference=$PWD/reference.sto" --out made > made.txt 2>&1 &&
    cp made/recording.c3d data.c3d || fail "no recording: $(cat made.txt)"
head -n 36 "$arm/demo_markers.trc" | sed '3s/301/30/' > data.trc
head -n 37 "$arm/demo_emg.sto" | sed 's/nRows=301/nRows=30/' > data.sto
cat > config.yaml <<'END'
model: {file: model.osim, unsupported: warn}
muscle: {curves: paper2021}
data: {markers: data.trc, emg: data.sto}
initial: {q: [-0.1, -0.3, -0.1, 0.1], qdot: [0, 0, 0, 0]}
horizon: {window: 4, ratio: 2}
costs: [mhe.cost.emg-markers-high]
output: {picture: false}
END
cat > angles.yaml <<'END'
model: {file: model.bioMod, unsupported: warn}
data: {angles: angles.sto}
formulation: activation
horizon: {window: 4, ratio: 2}
bounds: {residual_torques: true}
costs: [{plugin: mhe.cost.track, signal: q, sigma: 0.01}, {plugin: mhe.cost.track, signal: activation, value: [0]},
        {plugin: mhe.cost.track, signal: residual_torque, value: [0], sigma: 10}]
output: {picture: false}
END
awk 'BEGIN { print "angles\nversion=1\nnRows=20\nnColumns=3\ninDegrees=no\nendheader\ntime\tArm_RotZ\tArm_RotX"
    for (k = 0; k < 20; k++) print 0.01 * k "\t" 0.3 + 0.1 * sin(k / 8) "\t" 0.1 + 0.003 * k }' > angles.sto
{ grep -vE '^(data|horizon):' config.yaml 
    echo 'sources: [{plugin: mhe.source.recording, markers: data.trc, emg: data.sto, speed: 0}]'; } > live.yaml
"$(dirname "$run")/mhe-live" live.yaml --record data.xdf > live.txt 2>&1 || cp "$source/tests/fuzz/corpus/xdf/two_streams.xdf" data.xdf
# As they are they run, or what follows would say nothing.
for set in config.yaml 'config.yaml --set data.markers=data.c3d' 'config.yaml --set data.markers=data.xdf' angles.yaml; do
    # shellcheck disable=SC2086
    "$run" $set --quiet --out out > out.txt 2> err.txt < /dev/null || fail "$set, unspoilt: $(cat err.txt)"
    rm -rf out
done
# cpu_ms: processor time of all children until now, in ms
cpu_ms() {
    times > times.txt
    { read -r line && read -r user system; } < times.txt
    ms=0
    for part in "$user" "$system"; do
        part=${part%s}
        thousandths=$(printf '%.3s' "${part#*.}00")
        part=${part%.*}
        ms=$((ms + (${part%m*} * 60 + ${part#*m}) * 1000 + 1$thousandths - 1000))
    done
}
n_kinds=7
seed=$first
done=0
refused=0
longest=0
longest_seed=none
while [ $done -lt "$count" ]; do
    set -- config.yaml --quiet --out out
    case $((seed % n_kinds)) in
    0) file=model.osim what=model.file ;;
    1) file=data.trc what=data.markers ;;
    2) file=data.sto what=data.emg ;;
    3) file=config.yaml what= ;;
    4) file=data.c3d what=data.markers ;;
    5) file=model.bioMod what=model.file ;;
    6) file=data.xdf what=data.markers ;;
    esac
    spoilt=spoilt.${file##*.}
    "$mutate" "$file" "$spoilt" "$seed" || fail "mutate $file $seed"
    [ $file != model.bioMod ] || set -- angles.yaml --quiet --out out
    if [ -z "$what" ]; then
        set -- "$spoilt" --quiet --out out
    else
        set -- "$@" --set "$what=$spoilt"
    fi
    cpu_ms && before=$ms
    (ulimit -S -t $seconds && exec "$run" "$@") > out.txt 2> err.txt < /dev/null
    status=$?
    cpu_ms && took=$((ms - before))
    [ $took -le $longest ] || { longest=$took && longest_seed=$seed; }
    [ -z "${MHE_MUTATED_LOG:-}" ] || echo "$seed $file $status $took" >> "$MHE_MUTATED_LOG"
    if [ $status -gt 2 ] || grep -qE 'Sanitizer|runtime error' err.txt; then
        fail "seed $seed, $file: status $status: $(grep -E 'Sanitizer|runtime error|mhe-run:' err.txt | head -n 2)"
        cp "$spoilt" "$home/mutated-$seed.${file##*.}"
    fi
    [ $status -ne 2 ] || refused=$((refused + 1))
    [ $status -eq 2 ] || echo "$file" >> went.txt
    rm -rf out
    done=$((done + 1))
    seed=$((seed + 1))
done
echo "$done runs, $refused refused, $failed failed; longest $longest ms of processor time (seed $longest_seed); went on:$(sort went.txt | uniq -c | tr -s ' \n' ' ')"
finish mutated

#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# mhe-sim reference on a short motion: files, consistency, and every kind of refusal.
#   reference.sh PATH/mhe-sim SOURCE_DIR
set -u
sim=$1
model=$2/models/arm19/arm19.osim
. "$(dirname "$0")/../support/script.sh"
export XDG_CACHE_HOME="$work/cache"

write_config() {
    cat > short.yaml << END
model: {file: $model}
muscle: {curves: paper2021}
solver: {plugin: mhe.solver.ipopt, tolerance: 1e-6, max_iterations: 300, adapt_curvature: true, acceptable_tolerance: 1e-3,
  acceptable_iterations: 8, options: {acceptable_obj_change_tol: 1e-9, acceptable_constr_viol_tol: 1e-7}}
steps:
  - name: reach
    output: short
    duration: 1
    intervals: 100
    toward: [-0.2, -1.3, -0.5, 0.5]
    bounds:
      - {signal: q, value: [-0.1, -0.3, -0.1, 0.1], to: 0}
      - {signal: qdot, value: [0], to: 0}
      - {signal: excitation, of: [BRA], min: [0.05]}
    costs:
      - {plugin: mhe.cost.track, signal: q, value: [0], nodes: running, weight: 10}
      - {plugin: mhe.cost.track, signal: qdot, value: [0], nodes: running, weight: 10}
      - {plugin: mhe.cost.track, signal: excitation, value: [0], weight: 10}
      - {plugin: mhe.cost.track, signal: activation, value: [0], nodes: running, weight: 10}
      - {plugin: mhe.cost.track, signal: qdot, value: [0], nodes: last, weight: 1e4}
      - {plugin: mhe.cost.track, signal: q, value: [-0.2, -1.3, -0.5, 0.5], nodes: last, weight: 1e4}
END
}

write_config
"$sim" reference short.yaml --out result > out.txt 2> err.txt || fail "exit status $?: $(cat err.txt)"
cat out.txt
for file in reference.sto forces.sto markers.trc emg.sto; do
    [ -s "result/short/$file" ] || fail "no $file"
done
if command -v gnuplot > /dev/null; then
    [ "$(grep -c '^set title\|^plot' result/motion.gp)" -ge 12 ] && grep -q '</svg>' result/motion.svg || fail "no picture"
fi
"$sim" reference short.yaml --out plain --set output.picture=false > out2.txt 2> err.txt || fail "no picture: $(cat err.txt)"
find plain -name 'motion*' | grep . && fail "a picture nobody asked for"
find result -name '.*' -type f | grep . && fail "temporary files are left"
# The feedback is small and leaves the motion on its solution.
awk '/feedback up to/ { for (i = 1; i < NF; i++) {
         if ($i == "up" && $(i + 2) + 0 < 5e-3) { small = 1 }
         if ($i == "within" && $(i + 1) + 0 < 1e-4) { near = 1 } } }
     END { exit !(small && near) }' out.txt || fail "the feedback: $(cat out.txt)"
# 101 rows; it starts where the config says and ends near the target; excitations are those of emg.sto.
awk -F '\t' '$1 == "time" { for (i = 1; i <= NF; i++) { column[$i] = i } next }
     FNR > 6 && $1 + 0 == $1 { rows++; q = $column["q_Arm_RotX"]; if (rows == 1) { first = q } }
     END { exit !(rows == 101 && first == -0.3 && q < -1.28 && q > -1.32) }' result/short/reference.sto ||
    fail "rows or posture of reference.sto"
[ "$(awk -F '\t' '$1 + 0 == $1 && NF > 5 { print $29 }' result/short/reference.sto)" = \
    "$(awk -F '\t' '$1 + 0 == $1 && NF > 5 { print $2 }' result/short/emg.sto)" ] || fail "emg.sto is not the excitation"

# Without its first 25 samples: time starts anew, the posture is that of the sample.
posture() { # ROW: time and elevation there
    awk -F '\t' -v row="$1" '$1 == "time" { for (i = 1; i <= NF; i++) { column[$i] = i } next }
        FNR > 6 && $1 + 0 == $1 && ++rows == row { print $1, $column["q_Arm_RotX"] }' "$2"
}
"$sim" reference short.yaml --out dropped --set steps.0.drop=25 > out.txt 2> err.txt || fail "drop: $(cat err.txt)"
echo "$(posture 26 result/short/reference.sto) $(posture 1 dropped/short/reference.sto)" \
    "$(posture 76 dropped/short/reference.sto) $(posture 77 dropped/short/reference.sto)" |
    awk '{ off = $2 - $4 } END { exit !($1 == 0.25 && $3 == 0 && off * off < 1e-8 && $5 == 0.75 && NF == 6) }' ||
    fail "the dropped samples"

# What was solved before is read back, to the bit; a damaged file, other inputs and --no-cache are solved.
# solved NAME 1|0 ARGUMENTS...
solved() {
    name=$1
    before=$2
    shift 2
    "$sim" reference short.yaml --out again "$@" > out.txt 2> err.txt || fail "cache, $name: $(cat err.txt)"
    [ "$(grep -c 'solved before' out.txt)" -eq "$before" ] || fail "cache, $name: $(cat out.txt)"
}
solved same 1
for file in reference.sto forces.sto markers.trc emg.sto; do
    cmp -s "result/short/$file" "again/short/$file" || fail "$file of a motion that was read back"
done
solved no-cache 0 --no-cache
solved bound 0 --set 'steps.0.bounds.2.min=[0.06]'
cp "$model" other.osim
solved model-file 0 --set model.file="$work/other.osim"
solved model-file 1 --set model.file="$work/other.osim"
sed -i 's#<max_isometric_force>#<max_isometric_force> #' other.osim
solved model-contents 0 --set model.file="$work/other.osim"
for file in cache/mhe/*.solution; do
    printf '%s' "$(tr '7' '8' < "$file")" > "$file"
done
solved damaged 0
solved repaired 1
for file in cache/mhe/*.solution; do
    : > "$file"
done
solved empty 0
rm -rf again

# expect NAME STATUS 'TEXT IN THE MESSAGE' 'SED SCRIPT'
expect() {
    write_config
    sed -i "$4" short.yaml
    rm -rf result
    "$sim" reference short.yaml --out result > out.txt 2> err.txt < /dev/null
    status=$?
    if [ "$status" -ne "$2" ] || [ "$(grep -c . err.txt)" -ne 1 ] || [ -e result ]; then
        fail "$1: status $status: $(cat err.txt)"
    elif ! grep -qF -- "$3" err.txt; then
        fail "$1: '$3' is not in: $(cat err.txt)"
    fi
}

expect unknown-muscle 2 "step 'reach': bounds: 'excitation' has no entry 'BRE'" 's/\[BRA\]/[BRE]/'
expect crossed-bounds 2 "leaves nothing" 's/min: \[0.05\]/min: [0.5], max: [0.4]/'
expect unknown-step 2 "'other' is no step before this one" 's/    toward: .*/    start: [other]/'
expect unknown-key 2 "did you mean 'intervals'" 's/    intervals:/    interval:/'
expect unknown-signal 2 "no signal 'torque'" 's/signal: qdot, value: \[0\], nodes: last/signal: torque, nodes: last/'
expect all-dropped 2 'leave nothing' 's/    intervals:.*/    intervals: 20\n    drop: 20/'
expect no-steps 2 'steps: a list' '/^steps/,$d'
expect no-convergence 1 "step 'reach' did not converge in 3 iterations" 's/max_iterations: 300/max_iterations: 3/'
expect impossible 1 "step 'reach'" "/signal: qdot, value: \[0\], to/a\\
\      - {signal: q, value: [-0.2, -1.3, -0.5, 0.5], from: 0.02, to: 0.02}
s/max_iterations: 300/max_iterations: 60/"

# The shipped config, from end to end, with two reaches in place of eight and two levels in place of four.
shipped=$2/models/arm19
awk '/- name: / { skip = $3 ~ /^(whole|co)[23]$/ } !skip' "$shipped/reference.yaml" |
    sed "s#arm19.osim#$model#; s/duration: 8/duration: 2/; s/intervals: 800/intervals: 200/
        s/there, back, .*\]/there, back]/; s/there back .*}/there back}/" > levels.yaml
"$sim" reference levels.yaml --out levels > out.txt 2> err.txt || fail "short variant of the shipped config: $(cat err.txt)"
[ "$(grep -c iterations out.txt)" -eq 6 ] && [ "$(grep -c integrated out.txt)" -eq 2 ] || fail "its steps: $(cat out.txt)"
# Without the first 25 of 201 samples; the same joint angles (0.003 rad), the triceps near its bound at level 0.1.
paste levels/co0/reference.sto levels/co1/reference.sto |
    awk -F '\t' '$1 == "time" { for (i = 1; i <= NF / 2; i++) { column[$i] = i } width = NF / 2; next }
        $1 + 0 == $1 && NF > 50 { rows++; last = $1; triceps += $(width + column["e_TricepsLat"])
            for (i = 2; i <= 5; i++) { off = $i - $(width + i); if (off * off > most) { most = off * off } } }
        END { exit !(rows == 176 && last == 1.75 && most < 1e-5 && triceps / rows > 0.08) }' ||
    fail "the levels of the short variant"
"$sim" reference "$shipped/reference.yaml" --set solver.max_iterations=1 > out.txt 2> err.txt
[ $? -eq 1 ] && grep -qF "step 'there' did not converge in 1 iterations" err.txt || fail "shipped config: $(cat err.txt)"

finish "reference"

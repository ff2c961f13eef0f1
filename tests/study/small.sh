# SPDX-License-Identifier: Apache-2.0
# small.sh: a study whose trials take a moment, for the tests beside it; sourced after script.sh, with $source set.

# The demo's first 0.9 s.
sed -e 's/^nRows=.*/nRows=91/' -e '99,$d' "$source/models/arm19/demo_reference.sto" > motion.sto

# write_study TRIALS > study.yaml
write_study() {
    cat << END_OF_STUDY
config: $source/models/arm19/studies/estimate.yaml
motions: {demo: motion.sto}
reference: demo
trials: $1
seed: 7
factors:
  horizon: {keys: [horizon.window, horizon.ratio]}
  emg_noise: {key: noise.emg.level, values: {none: 0, low: 1}}
grids:
  - {horizon: [3, 3], emg_noise: none}
  - {horizon: [[3, 3], [4, 3]], emg_noise: low, set: {costs.0: mhe.cost.emg-markers-low}}
noise: {markers: {sd: 0.002}}
set: {formulation: activation}
keep_forces: [{horizon: [[3, 3]], emg_noise: low}]
END_OF_STUDY
}

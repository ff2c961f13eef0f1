/* SPDX-License-Identifier: Apache-2.0 */
/* config.h: the file that says what motion is recorded with what noise.
 *
 *     model: {file: arm19.osim}
 *     reference: reference.sto        # q_*, qdot_* and e_*, as mhe-sim writes it
 *     noise:
 *       seed: 1
 *       markers: {sd: 0.002}
 *       emg: {level: 1}
 */
#ifndef MHI_NOISE_CONFIG_H
#define MHI_NOISE_CONFIG_H

#include "base/arena.h"
#include "noise/noise.h"

#define MHI_NOISE_LEVELS_MAX 4

typedef struct mhi_noise_output {
    int32_t picture;
    mhe_real_list levels; /* at most MHI_NOISE_LEVELS_MAX: EMG levels in the picture; none: the one
                             of noise.emg */
} mhi_noise_output;

typedef struct mhi_noise_config {
    mhi_run *run; /* name, tree and model section of the file; owns all memory */
    const char *reference;
    mhi_noise noise;
    mhi_noise_output output;
} mhi_noise_config;

/* Reads and checks a file with `set` [n_set] assignments applied, as mhi_run_read does. Give it
 * back with mhi_noise_config_free, also after a failure. [cold] */
mhe_status mhi_noise_config_read(const char *path, const char *const *set, int32_t n_set,
                                 mhi_registry *registry, mhi_noise_config *config, mhe_error *err);
void mhi_noise_config_free(mhi_noise_config *config);

/* The section `noise` of another program's file, all defaults where there is none. Texts live in
 * `arena`; the tree must outlive the noise. MHE_E_CONFIG. [cold] */
mhe_status mhi_noise_read(const mhi_tree *tree, mhi_arena *arena, mhi_noise *noise, mhe_error *err);

/* Every key with its value: YAML that reads back the same. */
void mhi_noise_config_write(const mhi_noise_config *config, mhi_text *out);
/* Every key with its meaning, for people; the model section's are those of mhe-run. */
void mhi_noise_config_describe(mhi_text *out);

#endif

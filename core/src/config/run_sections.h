/* SPDX-License-Identifier: Apache-2.0 */
/* run_sections.h: structs behind the sections that are not handed to the estimator as they are. */
#ifndef MHI_RUN_SECTIONS_H
#define MHI_RUN_SECTIONS_H

#include "config/run.h"

/* The top level of the file. */
typedef struct mhi_top_section {
    int32_t formulation;
    mhe_text_list plugin_path;
} mhi_top_section;

/* The core's own keys of all sections that name a plugin; each section's table has some of them. */
typedef struct mhi_use_section {
    const char *plugin;
    const char *file;            /* model */
    int32_t unsupported;         /* model */
    mhe_text_list locked;        /* model */
    mhe_text_map locked_at;      /* model */
    const char *motion;          /* model */
    double weight, sigma, huber; /* costs */
    double delay;                /* sources */
} mhi_use_section;

/* The file, or `text` where it is not NULL, into run->tree, its path, name and folder into `run`;
 * then the assignments `set` [n_set] from the command line, as SECTION.KEY=VALUE (run_tree.c).
 * [cold] */
mhe_status mhi_run_read_tree(mhi_run *run, const mhi_run_text *text, const char *path,
                             const char *const *set, int32_t n_set, mhe_error *err);
/* The list `channels` of the emg section, and what its keys must agree on (run_emg.c). [cold] */
mhe_status mhi_run_read_channels(mhi_run *run, mhe_error *err);
/* That list as YAML, within its section. */
void mhi_run_write_channels(const mhi_run *run, mhi_text *out);

/* What data.transform means (run_transform.c): lists are made flat before the section is read, and
 * the turn computed after it. [cold] */
void mhi_run_flatten_rotate(const mhi_run *run);
/* data.marker_weights as one text becomes {file: TEXT} (run_weights.c). [cold] */
mhe_status mhi_run_flatten_weights(mhi_run *run, mhe_error *err);
mhe_status mhi_run_check_transform(mhi_run *run, mhe_error *err);

/* The plugins of a section that is a list; the costs' pair is kept as two fields. */
mhi_use_list mhi_run_list(const mhi_run *run, const mhi_section *section);

/* Is every output.formats one that there is? (run_output.c). [cold] */
mhe_status mhi_run_check_formats(const mhi_run *run, mhe_error *err);

#endif

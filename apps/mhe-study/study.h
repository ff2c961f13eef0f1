/* SPDX-License-Identifier: Apache-2.0 */
/* study.h: a study file: factors and their levels, crossed to conditions, so many trials each.
 *
 *     config: estimate.yaml                 # of mhe-run; its data section is not used
 *     reference_config: reference.yaml      # of mhe-sim reference: makes the motions
 *     trials: 30
 *     factors:
 *       cocontraction: {key: reference, values: {none: co0, low: co1}}
 *       marker_noise: {key: noise.markers.sd, values: {none: 0, low: 0.002}}
 *       horizon: {keys: [horizon.window, horizon.ratio]}
 *       objective: {values: [track, minimise]}
 *     grids:
 *       - {objective: track, horizon: [[7, 3], [9, 4]], set: {costs.0: mhe.cost.emg-markers-high}}
 *       - {objective: minimise, horizon: [7, 3], set: {costs.0: mhe.cost.min-excitation}}
 */
#ifndef STUDY_H
#define STUDY_H

#include "config/run.h"
#include "noise/noise.h"

#include <mhe/host.h>

#define MEASURE_ERRORS 0
#define MEASURE_TIMING 1

/* One key with a value, and where it stands in the study file. */
typedef struct assignment {
    const char *text;   /* "path.to.key=value" */
    const char *factor; /* what it belongs to, for messages: "window", "set" */
    const char *label;
    const mhi_node *node;
} assignment;

typedef struct level {
    const char *label;
    const mhi_node *value; /* scalar, or a list of as many values as the factor has keys */
} level;

typedef struct factor {
    const char *name;
    const char **keys; /* [n_keys]: "reference", "noise....", else of the estimator's config */
    int32_t n_keys;
    level *levels; /* [n_levels]; of a factor without values those that the grids use */
    int32_t n_levels, capacity;
    int32_t open; /* its values stand in the grids */
    const mhi_node *node;
} factor;

typedef struct condition {
    const int32_t *level;  /* [n_factors] */
    const assignment *set; /* [n_set] */
    int32_t n_set, trials;
    const mhi_node *node;  /* its grid */
    const char *reference; /* motion's name */
    int32_t keep_forces;
    /* study_resolve */
    mhi_run *run;
    mhi_tree *noise_tree;
    mhi_noise noise;
    /* material_load; lent */
    const mhe_description *model;
    const mhi_recording *motion;
    const char *motion_path;
} condition;

typedef struct task {
    int32_t condition, trial;
} task;

/* The plain keys at the top of the file. */
typedef struct study_keys {
    const char *config, *reference_config, *reference;
    const char *program; /* makes the trials; NULL: the estimator does */
    mhe_text_list reference_set;
    mhe_text_map motions;
    int32_t trials, seed, measure;
    double exclude_below;
} study_keys;

typedef struct study {
    const char *path, *dir, *name;
    const char *text; /* of the file, for trees that are changed */
    mhi_tree *tree;
    const char *const *override; /* --set, lent */
    int32_t n_override;
    study_keys keys;
    factor *factors;
    int32_t n_factors;
    condition *conditions;
    int32_t n_conditions;
    int32_t n_trials; /* of all conditions */
    mhi_arena arena;
} study;

/* Reads and crosses; no file but the study's is opened. Zero `s` before; give it back with
 * study_free, also after a failure. MHE_E_CONFIG, MHE_E_INPUT: "file:line: ...". */
mhe_status study_read(const char *path, const char *const *set, int32_t n_set, study *s,
                      mhe_error *err);
/* MHE_E_CONFIG where it names a program, which could do anything. */
mhe_status study_is_harmless(const study *s, mhe_error *err);
/* Reads every condition's config and noise: what a key or its plugin refuses is told with the line
 * of the study file. */
mhe_status study_resolve(study *s, mhi_registry *registry, mhe_error *err);
void study_free(study *s);

const char *study_label(const study *s, const condition *c, int32_t factor);
/* "objective=track weight=high": for people, and what the seeds come from. */
void study_condition_text(const study *s, const condition *c, mhi_text *out);
/* Seed of the noise of a trial: of the study's seed, the condition's labels and the trial alone. */
int32_t study_seed(const study *s, const condition *c, int32_t trial);
/* All [n_trials]: trial by trial through all conditions, so that an unfinished study holds
 * something of each. */
mhe_status study_order(study *s, task **tasks, mhe_error *err);

/* Keys of the file, for people. */
void study_describe(mhi_text *out);

#endif

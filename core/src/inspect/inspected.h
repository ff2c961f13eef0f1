/* SPDX-License-Identifier: Apache-2.0 */
/* inspected.h: a model file opened for questions: both readings, and instances of the default model
 * and muscle plugins. */
#ifndef MHI_INSPECTED_H
#define MHI_INSPECTED_H

#include "base/arena.h"
#include "plugin/registry.h"

#include <mhe/model.h>
#include <mhe/muscle.h>

#include <cjson/cJSON.h>

/* Instances for one description. */
typedef struct mhi_skeleton {
    const mhe_description *description;
    const mhe_model_ops *ops;
    void *self, *context;
} mhi_skeleton;

typedef struct mhi_inspected {
    const mhe_host *host;
    mhi_registry *registry;
    mhi_arena arena;
    mhe_description *file; /* as a run sees it */
    mhe_description *all;  /* the coordinates that the file locks are free */
    int32_t *place;        /* [file->n_coordinates] in all */
    const mhe_plugin *model;
    const void *model_config;
    mhi_skeleton skeleton; /* of all */
    const mhe_muscle_ops *muscle;
    const mhe_plugin *muscle_plugin;
    const void *muscle_config;
    void *muscles;
    mhe_muscle_layout layout;
} mhi_inspected;

/* Reads `file` and makes the instances; `paths`: MHE_PATHS_*. mhi_inspected_close() in any case. */
mhe_status mhi_inspected_open(mhi_inspected *m, const mhe_host *host, const char *file,
                              int32_t paths, mhe_error *err);
/* The same of an .osim file in memory; `name` for messages. */
mhe_status mhi_inspected_parse(mhi_inspected *m, const mhe_host *host, const char *name,
                               const char *text, size_t length, int32_t paths, mhe_error *err);
void mhi_inspected_close(mhi_inspected *m);
mhe_status mhi_skeleton_open(const mhi_inspected *m, const mhe_description *description,
                             mhi_skeleton *skeleton, mhe_error *err);
void mhi_skeleton_close(mhi_skeleton *skeleton);

/* A pose, over all->... [n_coordinates], muscles, actuators. */
typedef struct mhi_pose {
    double *q, *v, *a;
    double *activation;  /* [n_muscles]; NaN: not given */
    double *force;       /* [n_paths] tension, positive pulls */
    double *actuator;    /* [n_actuators] force or torque */
    mhe_load *loads;     /* [n_loads] in ground */
    double *load_values; /* [n_loads x 9] */
    int32_t n_loads, has_forces;
} mhi_pose;

/* Reads the k-th entry of "poses"; memory of the arena. `name` of the JSON for messages. */
mhe_status mhi_pose_read(mhi_inspected *m, const char *name, const cJSON *node, int32_t k,
                         mhi_pose *pose, mhe_error *err);

/* Adds "reactions" to the answer of a pose. */
mhe_status mhi_pose_reactions(mhi_inspected *m, const mhi_pose *pose, cJSON *out, mhe_error *err);

/* A JSON object's number, null where it is not finite. */
void mhi_json_number(cJSON *object, const char *name, double value);
cJSON *mhi_json_numbers(const double *values, int32_t n);

#endif

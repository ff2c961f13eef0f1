/* SPDX-License-Identifier: Apache-2.0 */
/* run_rig.h: configurations read with plugins of the tests' own. */
#ifndef TEST_RUN_RIG_H
#define TEST_RUN_RIG_H

#include "config/run.h"
#include "support.h"

/* Of each test its own: they run beside each other. */
#define FILE_NAME TEST_FOLDER "/" TEST_RUN ".yaml"
/* Enough for a run; the path is relative to the file's folder. */
#define BASE                                                   \
    "model: {plugin: org.test.model.a, file: arm.osim}\n"      \
    "muscle: org.test.muscle.a\n"                              \
    "integrator: org.test.integrator.a\n"                      \
    "solver: {plugin: org.test.solver.a, max_iterations: 5}\n" \
    "plugin_path: plugins\n"
#define COSTS "costs: [org.test.cost.b]\n"

extern const mhe_host run_host; /* says nothing */

void write_file(const char *path, const char *text);

struct outcome {
    mhi_registry *registry;
    mhi_run *run;
    mhe_status status;
    mhe_error err;
};

struct outcome read_path(const char *path, const char *const *set, int32_t n_set);
struct outcome read_good(const char *yaml, const char *const *set, int32_t n_set);
void release(struct outcome *o);

/* `message` stands behind the file name. */
void assert_refused_set(const char *yaml, const char *set, mhe_status code, const char *message);
void assert_refused(const char *yaml, const char *message);

#endif

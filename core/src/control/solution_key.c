/* SPDX-License-Identifier: Apache-2.0 */
/* solution_key.c: all that a step's solution depends on, as text. */
#include "base/digest.h"
#include "config/options.h"
#include "config/options_value.h"
#include "control/solution_cache.h"
#include "control/step_private.h"
#include "io/slurp.h"
#include "plugin/loader.h"

#include <inttypes.h>
#include <mhe/version.h>
#include <string.h>

static mhe_status add_file(mhi_text *key, const char *path, mhe_error *err) {
    size_t length = 0;
    uint64_t digest = 0;
    mhe_status status = mhi_file_digest(path, &length, &digest, err);
    if (status == MHE_OK) {
        mhi_text_add(key, "# %s: %zu bytes, %016" PRIx64 "\n", path, length, digest);
    }
    return status;
}

/* A library that is built anew is another. */
static mhe_status add_plugin(mhi_text *key, const mhe_plugin *plugin, mhe_error *err) {
    const char *library = NULL;
    mhe_status status = mhi_plugin_library(plugin, &library, err);
    if (status != MHE_OK) {
        return status;
    }
    mhi_text_add(key, "# %s %s\n", plugin->id, plugin->version);
    return add_file(key, library, err);
}

static mhe_status add_program(const mhi_run *run, mhi_text *key, mhe_error *err) {
    const mhe_plugin *const plugins[] = {run->model.plugin, run->muscle.plugin,
                                         run->integrator.plugin, run->solver.plugin};
    mhi_text_add(key, "# Myohorizon %s\n", MHE_VERSION);
    mhe_status status = add_file(key, "/proc/self/exe", err);
    for (size_t i = 0; i < sizeof plugins / sizeof plugins[0] && status == MHE_OK; i++) {
        status = add_plugin(key, plugins[i], err);
    }
    if (status == MHE_OK) {
        status = add_file(key, run->model_file.file, err);
    }
    if (status == MHE_OK && run->model_file.motion != NULL) {
        status = add_file(key, run->model_file.motion, err);
    }
    mhi_run_write(run, key);
    return status;
}

static mhe_status add_step(const mhi_step *step, mhi_text *key, mhe_error *err) {
    int32_t n = 0;
    const mhe_option *options = mhi_step_options(&n);
    mhi_step named = *step; /* its name and what is written of it do not change the solution */
    named.name = "";
    named.output = NULL;
    named.drop = 0;
    mhi_options_write(options, n, &named, 0, key);
    options = mhi_step_bound_options(&n);
    for (int32_t i = 0; i < step->n_bounds; i++) {
        mhi_text_add(key, "bound:\n");
        mhi_options_write(options, n, &step->bounds[i], 2, key);
    }
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < step->n_costs && status == MHE_OK; i++) {
        const mhi_use *cost = &step->costs[i];
        mhi_text_add(key, "cost: # %s, weight %a, sigma %a, huber %a\n", cost->plugin->id,
                     cost->weight, cost->sigma, cost->huber);
        mhi_options_write(cost->plugin->options, (int32_t)cost->plugin->option_count, cost->config,
                          2, key);
        status = add_plugin(key, cost->plugin, err);
    }
    return status;
}

static void add_solution(const mhi_step_setup *setup, const char *name, mhi_text *key) {
    const int32_t number = mhi_step_find(setup->steps, setup->number, name);
    if (number >= 0) {
        const mhi_trajectory *t = &setup->done[number];
        const size_t x = sizeof(double) * (size_t)(t->n + 1) * (size_t)t->n_x;
        const size_t u = sizeof(double) * (size_t)t->n * (size_t)t->n_u;
        mhi_text_add(key, "# %s: %a s, %zu bytes, %016" PRIx64 ", %zu bytes, %016" PRIx64 "\n",
                     name, t->interval, x, mhi_digest(t->x, x), u, mhi_digest(t->u, u));
    }
}

/* What the step starts from and is to be close to. */
static mhe_status add_sources(const mhi_step_setup *setup, mhi_arena *arena, mhi_text *key,
                              mhe_error *err) {
    const mhi_step *step = &setup->steps[setup->number];
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < step->start.n; i++) {
        add_solution(setup, step->start.values[i], key);
    }
    for (int32_t i = 0; i < step->targets.n && status == MHE_OK; i++) {
        const char *source = step->targets.values[i];
        char *rest = NULL, *text = mhi_arena_text(arena, source);
        const char *path = mhi_path_absolute(setup->run->dir, source, arena);
        if (text == NULL || path == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
        if (mhi_step_is_file(source)) {
            status = add_file(key, path, err);
            continue;
        }
        for (char *word = strtok_r(text, " ", &rest); word != NULL;
             word = strtok_r(NULL, " ", &rest)) {
            add_solution(setup, word, key);
        }
    }
    return status;
}

mhe_status mhi_solution_key(const mhi_step_setup *setup, mhi_text *key, mhe_error *err) {
    mhi_arena arena = {0};
    mhe_status status = add_program(setup->run, key, err);
    if (status == MHE_OK) {
        status = add_step(&setup->steps[setup->number], key, err);
    }
    if (status == MHE_OK) {
        status = add_sources(setup, &arena, key, err);
    }
    mhi_arena_free(&arena);
    return status == MHE_OK && key->failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : status;
}

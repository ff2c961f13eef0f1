/* SPDX-License-Identifier: Apache-2.0 */
#include "config/run_steps.h"

#include "config/options.h"

#include <float.h>
#include <math.h>
#include <string.h>

static const mhe_option step_options[] = {
    MHE_OPT_TEXT(mhi_step, name, MHE_OPT_REQUIRED, NULL, "What other steps call this one."),
    MHE_OPT_REAL(mhi_step, duration, 1, 1e-6, 1e6, "s", "How long the motion takes."),
    MHE_OPT_INT(mhi_step, intervals, 100, 1, 1000000, "1", "Intervals of the motion."),
    MHE_OPT_TEXTS(mhi_step, start, 0,
                  "Earlier steps whose motions, one behind the other, the solver starts from."),
    MHE_OPT_REALS(mhi_step, toward, 0, -DBL_MAX, DBL_MAX, "rad or m",
                  "Coordinates that the solver's start moves to where no earlier step gives one."),
    MHE_OPT_MAP(mhi_step, targets, 0,
                "Signal: earlier steps, one behind the other and separated by blanks, or a .sto."),
    MHE_OPT_TEXT(mhi_step, output, 0, NULL, "Folder of the result; none: for later steps alone."),
    MHE_OPT_INT(mhi_step, drop, 0, 0, 1000000, "samples",
                "Left out at the begin of the result, whose time then starts at 0."),
};

static const mhe_option bound_options[] = {
    MHE_OPT_TEXT(mhi_step_bound, signal, MHE_OPT_REQUIRED, NULL,
                 "q, qdot, activation, excitation or residual_torque."),
    MHE_OPT_TEXTS(mhi_step_bound, of, 0, "Muscles or coordinates; empty: all."),
    MHE_OPT_REALS(mhi_step_bound, value, 0, -DBL_MAX, DBL_MAX, "of the signal",
                  "Fixed values: one for all or one each."),
    MHE_OPT_REALS(mhi_step_bound, min, 0, -DBL_MAX, DBL_MAX, "of the signal", "Lower bounds."),
    MHE_OPT_REALS(mhi_step_bound, max, 0, -DBL_MAX, DBL_MAX, "of the signal", "Upper bounds."),
    MHE_OPT_REAL(mhi_step_bound, from, 0, 0, INFINITY, "s", "First time, from the step's begin."),
    MHE_OPT_REAL(mhi_step_bound, to, INFINITY, 0, INFINITY, "s", "Last time."),
};

#define COUNT(table) ((int32_t)(sizeof(table) / sizeof((table)[0])))

const mhe_option *mhi_step_options(int32_t *n) {
    *n = COUNT(step_options);
    return step_options;
}

const mhe_option *mhi_step_bound_options(int32_t *n) {
    *n = COUNT(bound_options);
    return bound_options;
}

int32_t mhi_step_find(const mhi_step *steps, int32_t n, const char *name) {
    for (int32_t i = 0; i < n; i++) {
        if (strcmp(steps[i].name, name) == 0) {
            return i;
        }
    }
    return -1;
}

static mhe_status read_bounds(mhi_run *run, mhi_step *step, mhe_error *err) {
    const mhi_node *list = mhi_node_find(step->node, "bounds");
    if (list == NULL) {
        return MHE_OK;
    }
    if (list->kind != MHI_SEQUENCE) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, list,
                           "bounds: a list is needed, like [{signal: q, value: [0], to: 0}]");
    }
    step->n_bounds = mhi_node_count(list);
    step->bounds = MHI_TAKE(&run->arena, mhi_step_bound, step->n_bounds);
    if (step->bounds == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = MHE_OK;
    mhi_step_bound *bound = step->bounds;
    for (const mhi_node *node = list->first; node != NULL && status == MHE_OK;
         node = node->next, bound++) {
        bound->node = node;
        status = mhi_options_fill(bound_options, COUNT(bound_options), run->tree, node, NULL, 0,
                                  "bounds", run->dir, &run->arena, bound, err);
    }
    return status;
}

static mhe_status unknown_step(const mhi_run *run, const mhi_step *steps, const mhi_step *step,
                               const char *name, mhe_error *err) {
    const char *names[64];
    int32_t n = 0;
    char hint[256] = "; there is none before this one";
    while (steps + n < step && n < 64) {
        names[n] = steps[n].name;
        n++;
    }
    if (n > 0) {
        mhi_suggest(hint, sizeof hint, name, names, n);
    }
    return mhi_fail_at(err, MHE_E_CONFIG, run->tree, step->node,
                       "%s: '%s' is no step before this one%s", step->name, name, hint);
}

static mhe_status read_step(mhi_run *run, mhi_registry *registry, const mhi_step *steps,
                            mhi_step *step, const mhi_node *node, mhe_error *err) {
    static const char *const lists[] = {"costs", "bounds"};
    const int32_t before = (int32_t)(step - steps);
    step->node = node;
    mhe_status status = mhi_options_fill(step_options, COUNT(step_options), run->tree, node, lists,
                                         2, "steps", run->dir, &run->arena, step, err);
    if (status == MHE_OK && mhi_step_find(steps, before, step->name) >= 0) {
        status =
            mhi_fail_at(err, MHE_E_CONFIG, run->tree, node, "there are two steps '%s'", step->name);
    }
    if (status == MHE_OK && step->drop >= step->intervals) {
        status = mhi_fail_at(err, MHE_E_CONFIG, run->tree, node,
                             "%s: drop: %d samples of a motion of %d intervals leave nothing",
                             step->name, (int)step->drop, (int)step->intervals);
    }
    for (int32_t i = 0; i < step->start.n && status == MHE_OK; i++) {
        if (mhi_step_find(steps, before, step->start.values[i]) < 0) {
            status = unknown_step(run, steps, step, step->start.values[i], err);
        }
    }
    if (status == MHE_OK) {
        status = mhi_run_read_costs(run, registry, node, &step->costs, &step->n_costs, err);
    }
    return status == MHE_OK ? read_bounds(run, step, err) : status;
}

mhe_status mhi_run_read_steps(mhi_run *run, mhi_registry *registry, mhi_step **steps, int32_t *n,
                              mhe_error *err) {
    const mhi_node *list = mhi_node_find(mhi_tree_root(run->tree), "steps");
    if (list == NULL || list->kind != MHI_SEQUENCE || list->first == NULL) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, list,
                           "steps: a list of optimal-control problems is needed, each with name, "
                           "duration, intervals and costs");
    }
    *n = mhi_node_count(list);
    *steps = MHI_TAKE(&run->arena, mhi_step, *n);
    if (*steps == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = MHE_OK;
    int32_t i = 0;
    for (const mhi_node *node = list->first; node != NULL && status == MHE_OK; node = node->next) {
        status = read_step(run, registry, *steps, *steps + i++, node, err);
    }
    return status;
}

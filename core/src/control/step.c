/* SPDX-License-Identifier: Apache-2.0 */
/* step.c: a step's problem from its config: bounds, start, solve. */
#include "control/solution_cache.h"
#include "control/step_private.h"
#include "plugin/instance.h"

#include <math.h>
#include <string.h>

/* Activations and excitations to start from where no earlier step has any. */
#define START_EFFORT 0.1

mhe_status mhi_step_fail(const mhi_step_work *w, mhe_status code, mhe_error *err,
                         const char *format, ...) {
    char text[512];
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return mhi_fail_at(err, code, w->setup->run->tree, w->step->node, "step '%s': %s",
                       w->step->name, text);
}

static mhe_status create_problem(mhi_step_work *w, mhe_error *err) {
    const mhi_bounds_section *b = &w->setup->run->bounds;
    if (b->residual_torque_at.n > 0 || b->residual_torque_limits.n > 0) {
        return mhi_step_fail(w, MHE_E_CONFIG, err,
                             "residual_torque_at and residual_torque_limits are for mhe-run; a "
                             "step's own bounds take {signal: residual_torque, of: [...]}");
    }
    const mhi_step_setup *s = w->setup;
    mhi_term_setup *terms = MHI_TAKE(&w->arena, mhi_term_setup, w->step->n_costs);
    w->x = MHI_TAKE(&w->arena, double, w->face->n_x);
    w->u = MHI_TAKE(&w->arena, double, w->face->n_u);
    if (terms == NULL || w->x == NULL || w->u == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < w->step->n_costs; i++) {
        const mhi_use *cost = &w->step->costs[i];
        terms[i] =
            (mhi_term_setup){cost->plugin, cost->config, cost->weight, cost->sigma, cost->huber};
    }
    const mhi_ocp_setup setup = {.host = s->host,
                                 .system = s->system,
                                 .integrator = s->run->integrator.plugin,
                                 .integrator_config = s->run->integrator.config,
                                 .terms = terms,
                                 .n_terms = w->step->n_costs,
                                 .n_intervals = w->step->intervals,
                                 .interval = w->interval,
                                 .n_workers = 1};
    mhe_error why = {0};
    mhe_status status = mhi_ocp_create(&setup, &w->ocp, &why);
    return status == MHE_OK ? MHE_OK : mhi_step_fail(w, status, err, "%s", why.text);
}

/* ---- bounds ---- */

/* Those of the whole run, at every node. */
static void general_bounds(const mhi_step_work *w, int32_t k) {
    mhi_layout_bounds(w->face->layout, MHE_ROLE_STATE, mhi_ocp_x_lower(w->ocp, k),
                      mhi_ocp_x_upper(w->ocp, k));
    if (k < w->step->intervals) {
        mhi_layout_bounds(w->face->layout, MHE_ROLE_CONTROL, mhi_ocp_u_lower(w->ocp, k),
                          mhi_ocp_u_upper(w->ocp, k));
    }
}

/* Which entries of the part a bound names: `chosen` [part->n]. */
static mhe_status choose(const mhi_step_work *w, const mhi_step_bound *bound, const mhi_part *part,
                         uint8_t *chosen, mhe_error *err) {
    memset(chosen, bound->of.n == 0, (size_t)part->n);
    for (int32_t k = 0; k < bound->of.n; k++) {
        int32_t i = 0;
        while (i < part->n && strcmp(part->names[i], bound->of.values[k]) != 0) {
            i++;
        }
        if (i == part->n) {
            return mhi_step_fail(w, MHE_E_CONFIG, err, "bounds: '%s' has no entry '%s'",
                                 bound->signal, bound->of.values[k]);
        }
        chosen[i] = 1;
    }
    return MHE_OK;
}

static mhe_status check_bound(const mhi_step_work *w, const mhi_step_bound *b, mhi_part *part,
                              mhe_error *err) {
    if (!mhi_part_find(w->face, b->signal, part)) {
        return mhi_step_fail(w, MHE_E_CONFIG, err,
                             "bounds: '%s' is not q, qdot, activation, excitation or "
                             "residual_torque of this problem",
                             b->signal);
    }
    const mhe_real_list *lists[] = {&b->value, &b->min, &b->max};
    for (int32_t i = 0; i < 3; i++) {
        if (lists[i]->n > 1 && lists[i]->n != part->n) {
            return mhi_step_fail(w, MHE_E_CONFIG, err, "bounds: %d values; '%s' has %d entries",
                                 (int)lists[i]->n, b->signal, (int)part->n);
        }
    }
    return MHE_OK;
}

static double entry(const mhe_real_list *list, int32_t i, double otherwise) {
    return list->n == 0 ? otherwise : list->values[list->n == 1 ? 0 : i];
}

static mhe_status apply_bound(mhi_step_work *w, const mhi_step_bound *b, mhe_error *err) {
    mhi_part part;
    mhe_status status = check_bound(w, b, &part, err);
    uint8_t *chosen = status == MHE_OK ? MHI_TAKE(&w->arena, uint8_t, part.n) : NULL;
    if (status == MHE_OK) {
        status = chosen == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                : choose(w, b, &part, chosen, err);
    }
    const double slack = 1e-6 * w->interval;
    for (int32_t k = 0; k <= w->step->intervals && status == MHE_OK; k++) {
        const double time = k * w->interval;
        if (time < b->from - slack || time > b->to + slack ||
            (part.in_u && k == w->step->intervals)) {
            continue;
        }
        double *lower = part.in_u ? mhi_ocp_u_lower(w->ocp, k) : mhi_ocp_x_lower(w->ocp, k);
        double *upper = part.in_u ? mhi_ocp_u_upper(w->ocp, k) : mhi_ocp_x_upper(w->ocp, k);
        for (int32_t i = 0; i < part.n && status == MHE_OK; i++) {
            const int32_t at = part.offset + i;
            if (!chosen[i]) {
                continue;
            }
            const double low = entry(&b->value, i, entry(&b->min, i, lower[at]));
            const double high = entry(&b->value, i, entry(&b->max, i, upper[at]));
            if (low > high || high < lower[at] || low > upper[at]) {
                status = mhi_step_fail(
                    w, MHE_E_CONFIG, err,
                    "bounds of '%s', %s, at %g s: %g .. %g within %g .. %g leaves nothing",
                    b->signal, part.names[i], time, low, high, lower[at], upper[at]);
            }
            lower[at] = low;
            upper[at] = high;
        }
    }
    return status;
}

static mhe_status set_bounds(mhi_step_work *w, mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t k = 0; k <= w->step->intervals; k++) {
        general_bounds(w, k);
    }
    for (int32_t i = 0; i < w->step->n_bounds && status == MHE_OK; i++) {
        status = apply_bound(w, &w->step->bounds[i], err);
    }
    return status;
}

/* ---- start ---- */

const mhi_trajectory **mhi_step_motions(mhi_step_work *w, const char *const *names, int32_t n) {
    const mhi_trajectory **motions = MHI_TAKE(&w->arena, const mhi_trajectory *, n);
    for (int32_t i = 0; i < n && motions != NULL; i++) {
        motions[i] = w->setup->done + mhi_step_find(w->setup->steps, w->setup->number, names[i]);
    }
    return motions;
}

static mhe_status start_from_steps(mhi_step_work *w, mhi_trajectory *t, mhe_error *err) {
    const mhe_text_list *names = &w->step->start;
    const mhi_trajectory **motions = mhi_step_motions(w, names->values, names->n);
    if (motions == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t k = 0; k <= t->n; k++) {
        mhi_trajectory_at(motions, names->n, k * w->interval, t->x + (ptrdiff_t)k * t->n_x,
                          k < t->n ? t->u + (ptrdiff_t)k * t->n_u : NULL);
    }
    return MHE_OK;
}

/* From the middle of the first bounds to `toward`, smoothly (minimum jerk). */
static mhe_status start_anew(mhi_step_work *w, mhi_trajectory *t, mhe_error *err) {
    const mhe_real_list *toward = &w->step->toward;
    const int32_t n_q = w->face->n_q;
    if (toward->n != 0 && toward->n != n_q) {
        return mhi_step_fail(w, MHE_E_CONFIG, err,
                             "toward: %d values; the model has %d coordinates", (int)toward->n,
                             (int)n_q);
    }
    double *effort = MHI_TAKE(&w->arena, double, w->face->n_m);
    if (effort == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    const double duration = t->n * t->interval;
    for (int32_t k = 0; k <= t->n; k++) {
        const double s = (double)k / t->n;
        const double way = s * s * s * (10 - 15 * s + 6 * s * s);
        const double speed = s * s * (30 - 60 * s + 30 * s * s) / duration;
        double *x = t->x + (ptrdiff_t)k * t->n_x;
        for (int32_t i = 0; i < n_q; i++) {
            const double low = mhi_ocp_x_lower(w->ocp, 0)[i], high = mhi_ocp_x_upper(w->ocp, 0)[i];
            const double from = isfinite(low) && isfinite(high) ? 0.5 * (low + high) : 0;
            const double to = toward->n == 0 ? from : toward->values[i];
            x[i] = from + (to - from) * way;
            x[n_q + i] = (to - from) * speed;
        }
        for (int32_t i = 0; i < w->face->n_m; i++) {
            effort[i] = START_EFFORT;
        }
        mhe_status status =
            mhi_system_equilibrium(mhi_ocp_context(w->ocp), x, x + n_q, effort, x, err);
        if (status != MHE_OK) {
            return status;
        }
        if (k < t->n) {
            memcpy(t->u + (ptrdiff_t)k * t->n_u, effort, sizeof *effort * (size_t)w->face->n_m);
        }
    }
    return MHE_OK;
}

/* ---- solve ---- */

/* Room for the solution; its states are wider than the motion's where costs carry something. */
static mhe_status take_solution(mhi_step_work *w, mhi_trajectory *t, mhe_solution *out,
                                mhe_error *err) {
    const int32_t wide = mhi_ocp_face(w->ocp)->n_x;
    const ptrdiff_t n_x = (ptrdiff_t)(t->n + 1) * wide, n_u = (ptrdiff_t)t->n * t->n_u;
    *out = (mhe_solution){.size = sizeof *out,
                          .x = wide == t->n_x ? t->x : MHI_TAKE(&w->arena, double, n_x),
                          .u = t->u,
                          .lambda = MHI_TAKE(&w->arena, double, n_x),
                          .zx_lower = MHI_TAKE(&w->arena, double, n_x),
                          .zx_upper = MHI_TAKE(&w->arena, double, n_x),
                          .zu_lower = MHI_TAKE(&w->arena, double, n_u),
                          .zu_upper = MHI_TAKE(&w->arena, double, n_u)};
    if (!out->x || !out->lambda || !out->zx_lower || !out->zx_upper || !out->zu_lower ||
        !out->zu_upper) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t k = 0; k <= t->n && wide > t->n_x; k++) {
        memcpy(out->x + (ptrdiff_t)k * wide, t->x + (ptrdiff_t)k * t->n_x,
               sizeof(double) * (size_t)t->n_x);
    }
    return mhi_ocp_carry(w->ocp, out->x, out->u, err);
}

/* The motion without what was carried. */
static void give_solution(const mhi_step_work *w, const mhe_solution *solution, mhi_trajectory *t) {
    const int32_t wide = mhi_ocp_face(w->ocp)->n_x;
    for (int32_t k = 0; k <= t->n && wide > t->n_x; k++) {
        memcpy(t->x + (ptrdiff_t)k * t->n_x, solution->x + (ptrdiff_t)k * wide,
               sizeof(double) * (size_t)t->n_x);
    }
}

static mhe_status solve(mhi_step_work *w, mhi_trajectory *t, mhe_solve_info *info, mhe_error *err) {
    const mhi_use *use = &w->setup->run->solver;
    const mhe_solver_ops *ops = use->plugin->ops;
    mhe_solution solution;
    void *self = NULL;
    mhe_error why = {0};
    mhe_status status = take_solution(w, t, &solution, err);
    if (status != MHE_OK) {
        return status;
    }
    status = mhi_solver_create(use->plugin, w->setup->host, mhi_ocp_face(w->ocp), use->config,
                               &self, &why);
    if (status == MHE_OK) {
        *info = (mhe_solve_info){.size = sizeof *info};
        status = ops->solve(self, w->setup->control, &solution, info, &why);
        give_solution(w, &solution, t);
    }
    if (self != NULL) {
        ops->destroy(self);
    }
    return status == MHE_OK ? MHE_OK : mhi_step_fail(w, status, err, "%s", why.text);
}

static void store(const mhi_step_work *w, const mhi_text *key, const mhi_trajectory *t,
                  const mhe_solve_info *info) {
    const mhe_host *host = w->setup->host;
    mhe_error why = {0};
    if (info->outcome == MHE_SOLVE_CONVERGED &&
        mhi_solution_write(w->setup->cache, key, t, info, &why) != MHE_OK) {
        char text[1200];
        (void)snprintf(text, sizeof text, "step '%s' is not kept for the next time: %s",
                       w->step->name, why.text);
        host->log(host, MHE_LOG_WARNING, text);
    }
}

/* A step that was solved before, from the very same, is read back. */
static mhe_status solve_once(mhi_step_work *w, mhi_trajectory *t, mhe_solve_info *info,
                             mhe_error *err) {
    const mhi_step_setup *s = w->setup;
    mhi_text key = {0};
    mhe_error why = {0};
    const int32_t keyed = s->cache != NULL && mhi_solution_key(s, &key, &why) == MHE_OK;
    const int32_t known = keyed && mhi_solution_read(s->cache, &key, t, info);
    mhe_status status = MHE_OK;
    if (s->read_back != NULL) {
        *s->read_back = known;
    }
    if (!known) {
        status = w->step->start.n > 0 ? start_from_steps(w, t, err) : start_anew(w, t, err);
        if (status == MHE_OK) {
            status = solve(w, t, info, err);
        }
        if (status == MHE_OK && keyed) {
            store(w, &key, t, info);
        }
    }
    mhi_text_free(&key);
    return status;
}

/* A and B of every interval; the same whether the solution was found now or read back. */
static mhe_status linearise(mhi_step_work *w, mhi_arena *arena, mhi_trajectory *t, mhe_error *err) {
    const ptrdiff_t n_A = (ptrdiff_t)t->n_x * t->n_x, n_B = (ptrdiff_t)t->n_x * t->n_u;
    mhe_status status = MHE_OK;
    t->A = MHI_TAKE(arena, double, t->n *n_A);
    t->B = MHI_TAKE(arena, double, t->n *n_B);
    if (t->A == NULL || t->B == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhi_ocp_forget(w->ocp);
    for (int32_t k = 0; k < t->n && status == MHE_OK; k++) {
        status =
            mhi_ocp_linearise(w->ocp, k, t->x + (ptrdiff_t)k * t->n_x, t->u + (ptrdiff_t)k * t->n_u,
                              w->x, t->A + k * n_A, t->B + k * n_B, err);
    }
    return status;
}

mhe_status mhi_step_solve(const mhi_step_setup *setup, mhi_arena *arena, mhi_trajectory *result,
                          mhe_solve_info *info, mhe_error *err) {
    mhi_step_work w = {.setup = setup,
                       .step = &setup->steps[setup->number],
                       .face = mhi_system_face(setup->system),
                       .description = mhi_system_description(setup->system)};
    w.interval = w.step->duration / w.step->intervals;
    mhe_status status =
        mhi_trajectory_take(arena, w.face, w.step->intervals, w.interval, result, err);
    if (status == MHE_OK) {
        status = create_problem(&w, err);
    }
    if (status == MHE_OK) {
        status = set_bounds(&w, err);
    }
    if (status == MHE_OK) {
        status = mhi_step_targets(&w, err);
    }
    if (status == MHE_OK) {
        status = solve_once(&w, result, info, err);
    }
    if (status == MHE_OK && setup->linearise) {
        status = linearise(&w, arena, result, err);
    }
    mhi_ocp_free(w.ocp);
    mhi_arena_free(&w.arena);
    return status;
}

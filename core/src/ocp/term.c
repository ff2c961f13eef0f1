/* SPDX-License-Identifier: Apache-2.0 */
#include "ocp/term_sum.h"

#include "plugin/instance.h"

#include <math.h>
#include <string.h>

/* Row of the table that entry i of layout() means; -1: none. */
static int32_t find_row(const mhe_cost_layout *l, int32_t i, mhi_signals *signals) {
    const int32_t signal = l->n_signals == 0 ? l->signal : l->signals[i];
    if (signal < 0 || signal >= MHI_N_SIGNALS || signals->signal[signal].n_y == 0) {
        return -1;
    }
    return l->at[i] == MHE_AT_PREVIOUS ? mhi_signals_carry(signals, signal) : signal;
}

static mhe_status check_layout(mhi_term *t, mhi_signals *signals, mhe_error *err) {
    const mhe_cost_layout *l = &t->layout;
    t->n_signals = l->n_signals == 0 ? 1 : l->n_signals;
    if (t->n_signals < 0 || t->n_signals > MHE_COST_MAX_SIGNALS) {
        return mhe_fail(err, MHE_E_PLUGIN, "%s: layout() gave %d signals", t->id, l->n_signals);
    }
    for (int32_t i = 0; i < t->n_signals; i++) {
        if (l->at[i] < MHE_AT_NODE || l->at[i] > MHE_AT_FIRST) {
            return mhe_fail(err, MHE_E_PLUGIN, "%s: layout() gave %d for `at`", t->id, l->at[i]);
        }
        t->signals[i] = find_row(l, i, signals);
        if (t->signals[i] < 0) {
            return mhe_fail(err, MHE_E_PLUGIN, "%s: layout() gave a signal that does not exist",
                            t->id);
        }
        t->ny += signals->signal[t->signals[i]].n_y;
    }
    if (l->n_res < 1 || (l->jacobian == MHE_JACOBIAN_DIAGONAL && l->n_res != t->ny)) {
        return mhe_fail(err, MHE_E_PLUGIN, "%s: layout() gave %d residuals for %d signal values",
                        t->id, l->n_res, t->ny);
    }
    return MHE_OK;
}

/* Roots of what each entry counts. A cost that mixes entries in a residual is left as it is. */
static mhe_status take_tasks(mhi_term *t, const mhi_tasks *tasks, const mhi_signals *signals,
                             mhi_arena *arena, mhe_error *err) {
    const int32_t first = signals->signal[MHI_SIGNAL_MARKERS].offset;
    int32_t n = 0;
    if (tasks == NULL || t->layout.jacobian != MHE_JACOBIAN_DIAGONAL) {
        return MHE_OK;
    }
    t->root = MHI_TAKE(arena, double, t->ny);
    for (int32_t j = 0; j < t->ny && t->root != NULL; j++) {
        const int32_t of_marker = t->y_signal[j] % MHI_N_SIGNALS == MHI_SIGNAL_MARKERS;
        t->root[j] = of_marker ? sqrt(tasks->marker[(t->y_target[j] - first) / 3]) : 1;
        n += of_marker;
    }
    t->tasks = n > 0 ? tasks : NULL;
    return t->root == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
}

mhe_status mhi_term_create(const mhe_host *host, const mhi_term_setup *setup,
                           const mhe_problem *problem, mhi_signals *signals, const mhi_tasks *tasks,
                           mhi_arena *arena, mhi_term *t, mhe_error *err) {
    *t = (mhi_term){.ops = setup->plugin->ops,
                    .id = setup->plugin->id,
                    .self = setup->config,
                    .factor = setup->weight / (setup->sigma * setup->sigma),
                    .limit = setup->huber > 0 ? setup->huber * setup->sigma : INFINITY};
    mhe_status status =
        mhi_cost_create(setup->plugin, host, problem, setup->config, &t->created, &t->layout, err);
    if (t->ops->create != NULL) {
        t->self = t->created;
    }
    if (status == MHE_OK) {
        status = check_layout(t, signals, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    t->y_index = MHI_TAKE(arena, int32_t, t->ny);
    t->y_target = MHI_TAKE(arena, int32_t, t->ny);
    t->y_signal = MHI_TAKE(arena, int32_t, t->ny);
    t->y_at = MHI_TAKE(arena, int32_t, t->ny);
    if (!t->y_index || !t->y_target || !t->y_signal || !t->y_at) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t s = 0, j = 0; s < t->n_signals; s++) {
        const mhi_signal *signal = &signals->signal[t->signals[s]];
        t->elsewhere |= t->layout.at[s] != MHE_AT_NODE;
        for (int32_t i = 0; i < signal->n_y; i++, j++) {
            t->y_index[j] = signal->offset + i;
            t->y_target[j] = signals->signal[t->signals[s] % MHI_N_SIGNALS].offset + i;
            t->y_signal[j] = t->signals[s];
            t->y_at[j] = t->layout.at[s];
        }
    }
    status = take_tasks(t, tasks, signals, arena, err);
    if (status != MHE_OK) {
        return status;
    }
    t->differenced = t->ops->jacobian == NULL;
    if (t->differenced) {
        char text[160];
        (void)snprintf(text, sizeof text,
                       "%s has no jacobian(): central differences are used, which is slower",
                       t->id);
        host->log(host, MHE_LOG_WARNING, text);
    }
    return MHE_OK;
}

void mhi_term_destroy(mhi_term *t) {
    if (t->created != NULL) {
        t->ops->destroy(t->created);
    }
}

mhe_status mhi_term_workspace_create(const mhi_term *t, int32_t n_z, mhi_arena *arena,
                                     mhi_term_workspace *w, mhe_error *err) {
    const int32_t n_res = t->layout.n_res;
    const int diagonal = t->layout.jacobian == MHE_JACOBIAN_DIAGONAL;
    w->y = MHI_TAKE(arena, double, t->ny);
    w->y_ref = MHI_TAKE(arena, double, t->ny);
    w->y_spread = MHI_TAKE(arena, double, t->ny);
    w->r = MHI_TAKE(arena, double, n_res);
    w->r_shift = MHI_TAKE(arena, double, n_res);
    w->share = MHI_TAKE(arena, double, n_res);
    w->jacobian = MHI_TAKE(arena, double, diagonal ? t->ny : n_res * t->ny);
    w->row = MHI_TAKE(arena, double, n_z);
    w->scratch = mhi_arena_take(arena, t->layout.scratch_bytes);
    if (w->y == NULL || w->y_ref == NULL || w->y_spread == NULL || w->r == NULL ||
        w->r_shift == NULL || w->share == NULL || w->jacobian == NULL || w->row == NULL ||
        w->scratch == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    return MHE_OK;
}

uint32_t mhi_term_reads(const mhi_term *t) {
    uint32_t reads = 0;
    for (int32_t i = 0; i < t->n_signals; i++) {
        reads |= 1u << t->signals[i] % MHI_N_SIGNALS;
    }
    const int32_t of_q = t->tasks != NULL && t->tasks->n_coordinates > 0;
    return of_q ? reads | 1u << MHI_SIGNAL_Q : reads;
}

static void mark_columns(const mhi_signal *s, int32_t row, uint8_t *columns) {
    if (s->n_columns == 0) {
        columns[s->column + row] = 1;
    } else {
        memset(columns + s->column, 1, (size_t)s->n_columns);
    }
}

void mhi_term_pattern(const mhi_term *t, const mhi_signals *signals, int32_t n_z, uint8_t *columns,
                      uint8_t *pattern) {
    const int diagonal = t->layout.jacobian == MHE_JACOBIAN_DIAGONAL;
    memset(columns, 0, (size_t)n_z);
    for (int32_t j = 0; j < t->ny; j++) {
        const mhi_signal *s = &signals->signal[t->y_signal[j]];
        mark_columns(s, t->y_index[j] - s->offset, columns);
        if (!diagonal && j + 1 < t->ny) {
            continue;
        }
        for (int32_t a = 0; a < n_z; a++) {
            for (int32_t b = 0; b < n_z && columns[a]; b++) {
                pattern[a * n_z + b] |= columns[b];
            }
        }
        memset(columns, 0, (size_t)n_z);
    }
}

/* Central differences for plugins without jacobian(); step (eps)^(1/3) relative to |y| or 1. */
static mhe_status difference(const mhi_term *t, mhi_term_workspace *w, mhe_stage *stage,
                             mhe_error *err) {
    const int32_t n_res = t->layout.n_res, ny = t->ny;
    const int diagonal = t->layout.jacobian == MHE_JACOBIAN_DIAGONAL;
    for (int32_t j = 0; j < ny; j++) {
        const double y = w->y[j], step = 6e-6 * fmax(1, fabs(y));
        w->y[j] = y + step;
        mhe_status status = t->ops->residual(t->self, stage, w->r_shift, err);
        for (int32_t i = 0; i < n_res && !diagonal; i++) {
            w->jacobian[i * ny + j] = w->r_shift[i];
        }
        double plus = diagonal ? w->r_shift[j] : 0;
        w->y[j] = y - step;
        if (status == MHE_OK) {
            status = t->ops->residual(t->self, stage, w->r_shift, err);
        }
        w->y[j] = y;
        if (status != MHE_OK) {
            return status;
        }
        if (diagonal) {
            w->jacobian[j] = (plus - w->r_shift[j]) / (2 * step);
        }
        for (int32_t i = 0; i < n_res && !diagonal; i++) {
            w->jacobian[i * ny + j] = (w->jacobian[i * ny + j] - w->r_shift[i]) / (2 * step);
        }
    }
    return MHE_OK;
}

/* A NaN residual is missing data where an input is NaN; without one it is the plugin's fault. */
static mhe_status check_residuals(const mhi_term *t, const mhi_term_workspace *w, mhe_error *err) {
    int bad = 0;
    for (int32_t i = 0; i < t->layout.n_res; i++) {
        if (isinf(w->r[i])) {
            return mhe_fail(err, MHE_RETRY, "%s: residual %d is infinite", t->id, i);
        }
        bad |= isnan(w->r[i]);
    }
    for (int32_t j = 0; j < t->ny && bad; j++) {
        if (isnan(w->y[j]) || isnan(w->y_ref[j])) {
            bad = 0;
        }
    }
    return bad ? mhe_fail(err, MHE_RETRY, "%s: a residual is NaN although no input is", t->id)
               : MHE_OK;
}

static double squares_of(const double *r, int32_t n) {
    double squares = 0;
    for (int32_t i = 0; i < n; i++) {
        squares += isnan(r[i]) ? 0 : r[i] * r[i];
    }
    return squares;
}

/* The loss of all rows with a finite limit. Rows beyond it get their share and are scaled by it, so
 * that their squares have the loss's gradient once the Jacobian is scaled too. */
static double robust_loss(const mhi_term *t, mhi_term_workspace *w) {
    const int diagonal = t->layout.jacobian == MHE_JACOBIAN_DIAGONAL;
    double loss = 0;
    for (int32_t i = 0, n = 1; i < t->layout.n_res; i += n) {
        n = diagonal && t->y_signal[i] % MHI_N_SIGNALS == MHI_SIGNAL_MARKERS ? 3 : 1;
        const double size = sqrt(squares_of(w->r + i, n));
        const int beyond = size > t->limit;
        const double share = beyond ? sqrt(t->limit / size) : 1;
        loss += beyond ? t->limit * (size - 0.5 * t->limit) : 0.5 * size * size;
        for (int32_t j = i; j < i + n; j++) {
            w->share[j] = share;
            w->r[j] *= share;
        }
    }
    return loss;
}

static void scale_jacobian(const mhi_term *t, mhi_term_workspace *w) {
    const int32_t width = t->layout.jacobian == MHE_JACOBIAN_DIAGONAL ? 1 : t->ny;
    for (int32_t i = 0; i < t->layout.n_res; i++) {
        for (int32_t j = 0; j < width; j++) {
            w->jacobian[i * width + j] *= w->share[i];
        }
    }
}

/* What tasks make of residuals and Jacobian. A coordinate's weighs as that of a marker in metres:
 * with the square of the largest entry that a marker has there. */
static void add_tasks(const mhi_term *t, mhi_term_workspace *w, const mhi_signals *signals,
                      const double *y, double scale, int32_t n_z, mhi_term_sum *sum) {
    const mhi_signal *q = &signals->signal[MHI_SIGNAL_Q];
    double of_marker = 0;
    for (int32_t j = 0; j < t->ny; j++) {
        if (t->y_signal[j] % MHI_N_SIGNALS == MHI_SIGNAL_MARKERS) {
            of_marker = fmax(of_marker, fabs(w->jacobian[j]));
        }
        w->r[j] *= t->root[j];
        w->jacobian[j] *= t->root[j];
    }
    for (int32_t i = 0; i < q->n_y && t->tasks->n_coordinates > 0; i++) {
        const double weight = scale * of_marker * of_marker * t->tasks->coordinate[i];
        const double r = y[q->offset + i] - t->tasks->value[i];
        const int32_t c = q->column + i;
        sum->cost += 0.5 * weight * r * r;
        if (sum->gradient != NULL) {
            sum->gradient[c] += weight * r;
            sum->hessian[c * n_z + c] += weight;
        }
    }
}

/* Entries of the node before have its targets; those of the first node are missing at others. */
static void gather_elsewhere(const mhi_term *t, mhi_term_workspace *w, int32_t node,
                             const double *before) {
    for (int32_t j = 0; j < t->ny; j++) {
        if (t->y_at[j] == MHE_AT_PREVIOUS) {
            w->y_ref[j] = before == NULL ? NAN : before[t->y_target[j]];
        } else if (t->y_at[j] == MHE_AT_FIRST && node > 0) {
            w->y[j] = w->y_ref[j] = NAN;
        }
    }
}

static mhe_status evaluate_jacobian(const mhi_term *t, mhi_term_workspace *w, mhe_stage *stage,
                                    mhe_error *err) {
    const int32_t n = t->layout.jacobian == MHE_JACOBIAN_DIAGONAL ? t->ny : t->layout.n_res * t->ny;
    if (t->differenced) {
        return difference(t, w, stage, err);
    }
    memset(w->jacobian, 0, sizeof(double) * (size_t)n);
    return t->ops->jacobian(t->self, stage, w->jacobian, err);
}

mhe_status mhi_term_add(const mhi_term *t, mhi_term_workspace *w, const mhi_signals *signals,
                        const mhe_stage *node, const double *y, const double *target,
                        const double *before, const double *spread, const double *jacobian,
                        double scale, int32_t n_z, mhi_term_sum *sum, mhe_error *err) {
    for (int32_t j = 0; j < t->ny; j++) {
        w->y[j] = y[t->y_index[j]];
        w->y_ref[j] = target[t->y_target[j]];
        w->y_spread[j] = spread[t->y_target[j]];
    }
    if (t->elsewhere) {
        gather_elsewhere(t, w, node->node, before);
    }
    mhe_stage stage = *node;
    stage.ny = t->ny;
    stage.y = w->y;
    stage.y_ref = w->y_ref;
    stage.scratch = w->scratch;
    stage.y_spread = w->y_spread;
    mhe_status status = t->ops->residual(t->self, &stage, w->r, err);
    if (status == MHE_OK) {
        status = check_residuals(t, w, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    const int robust = isfinite(t->limit), diagonal = t->layout.jacobian == MHE_JACOBIAN_DIAGONAL;
    scale *= t->factor;
    if (sum->gradient != NULL || t->tasks != NULL) {
        status = evaluate_jacobian(t, w, &stage, err);
        if (status != MHE_OK) {
            return status;
        }
    }
    if (t->tasks != NULL) {
        add_tasks(t, w, signals, y, scale, n_z, sum);
    }
    sum->cost += scale * (robust ? robust_loss(t, w) : 0.5 * squares_of(w->r, t->layout.n_res));
    if (sum->gradient == NULL) {
        return MHE_OK;
    }
    if (robust) {
        scale_jacobian(t, w);
    }
    (diagonal ? mhi_term_sum_diagonal : mhi_term_sum_dense)(t, w, signals, jacobian, scale, n_z,
                                                            sum);
    return MHE_OK;
}

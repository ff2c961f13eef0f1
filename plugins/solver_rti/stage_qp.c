/* SPDX-License-Identifier: Apache-2.0 */
#include "stage_qp.h"

#include <string.h>

/* Does row i of the dynamics hold its own state and one control at most? Which control goes to
 * `control`. */
static int32_t is_simple(const mhe_stage_problem *p, int32_t i, int32_t *control) {
    *control = -1;
    for (int32_t j = 0; j < p->n_x; j++) {
        if (p->A_pattern[i * p->n_x + j] && j != i) {
            return 0;
        }
    }
    for (int32_t j = 0; j < p->n_u; j++) {
        if (p->B_pattern[i * p->n_u + j]) {
            if (*control >= 0) {
                return 0;
            }
            *control = j;
        }
    }
    return 1;
}

/* Are the costs of controls and of simple states squares of each of them alone? */
static int32_t has_diagonal_costs(const mhe_stage_problem *p, int32_t n_dense) {
    if (p->uu_pattern == NULL || p->xx_pattern == NULL || p->ux_pattern == NULL) {
        return 0;
    }
    for (int32_t i = 0; i < p->n_u; i++) {
        for (int32_t j = 0; j < p->n_u; j++) {
            if (p->uu_pattern[i * p->n_u + j] && j != i) {
                return 0;
            }
        }
        for (int32_t j = 0; j < p->n_x; j++) {
            if (p->ux_pattern[i * p->n_x + j]) {
                return 0;
            }
        }
    }
    for (int32_t i = n_dense; i < p->n_x; i++) {
        for (int32_t j = 0; j < p->n_x; j++) {
            if (j != i && (p->xx_pattern[i * p->n_x + j] || p->xx_pattern[j * p->n_x + i])) {
                return 0;
            }
        }
    }
    return 1;
}

/* Dense states before a tail of those whose costs are squares of each alone: of velocities, as a
 * rule. */
static int32_t count_tied(const mhe_stage_problem *p, int32_t n_dense) {
    int32_t n = n_dense, alone = 1;
    while (n > 0 && alone) {
        for (int32_t j = 0; j < n_dense; j++) {
            alone &= j == n - 1 ||
                     !(p->xx_pattern[(n - 1) * p->n_x + j] || p->xx_pattern[j * p->n_x + n - 1]);
        }
        n -= alone;
    }
    return n;
}

void qp_shape_of(const mhe_stage_problem *problem, int32_t *control_of, qp_shape *shape) {
    const int32_t n_x = problem->n_x, n_u = problem->n_u;
    *shape = (qp_shape){.N = problem->n_intervals,
                        .n_x = n_x,
                        .n_u = n_u,
                        .n_z = n_x + n_u,
                        .ld_z = KERNEL_LD(n_x + n_u),
                        .ld_x = KERNEL_LD(n_x),
                        .n_p = problem->n_p,
                        .ld_p = problem->n_p > 0 ? KERNEL_LD(problem->n_p) : 0,
                        .n_dense = n_x,
                        .control_of = control_of,
                        .kernels = kernels_best()};
    while (shape->n_dense > 0 &&
           is_simple(problem, shape->n_dense - 1, &control_of[shape->n_dense - 1])) {
        shape->n_dense--;
    }
    shape->in_order = shape->n_dense < n_x && control_of[shape->n_dense] >= 0;
    for (int32_t i = shape->n_dense + 1; i < n_x; i++) {
        shape->in_order &= control_of[i] == control_of[i - 1] + 1;
    }
    shape->separable =
        (shape->in_order || shape->n_dense == n_x) && has_diagonal_costs(problem, shape->n_dense);
    shape->n_tied = shape->separable ? count_tied(problem, shape->n_dense) : shape->n_dense;
}

/* D and d of a stage, and its list of parameters, to the next multiple of 8. */
static size_t small_size(const qp_shape *s) {
    const size_t n_p = (size_t)s->n_p;
    return (n_p * (n_p + 1) + (n_p * sizeof(int32_t) + 7) / 8 + 7) / 8 * 8;
}

size_t qp_stages_size(const qp_shape *s) {
    const size_t matrices = (size_t)(s->n_z + s->n_dense) * (size_t)s->ld_z;
    const size_t columns = (size_t)s->n_p * (size_t)(s->ld_z + s->ld_x) + small_size(s);
    return (size_t)(s->N + 1) * (matrices + (size_t)s->ld_z + 3 * (size_t)s->ld_x + columns);
}

void qp_stages_place(const qp_shape *s, double *memory, qp_stage *stages) {
    memset(memory, 0, sizeof(double) * qp_stages_size(s));
    for (int32_t k = 0; k <= s->N; k++) {
        qp_stage *stage = &stages[k];
        stage->H = memory;
        stage->F = stage->H + s->n_z * s->ld_z;
        stage->g = stage->F + s->n_dense * s->ld_z;
        stage->by_state = stage->g + s->ld_z;
        stage->by_control = stage->by_state + s->ld_x;
        stage->b = stage->by_control + s->ld_x;
        stage->C = stage->b + s->ld_x;
        stage->Pt = stage->C + s->n_p * s->ld_z;
        stage->D = stage->Pt + s->n_p * s->ld_x;
        stage->d = stage->D + s->n_p * s->n_p;
        stage->costly = (int32_t *)(stage->d + s->n_p);
        stage->n_costly = 0;
        stage->n_reached = s->n_x;
        memory = stage->D + small_size(s);
    }
}

void qp_forward(const qp_shape *s, const qp_stage *stage, const double *w, double *next) {
    s->kernels->add(s->n_dense, s->n_z, 1, stage->F, s->ld_z, w, next);
    for (int32_t i = s->n_dense; i < s->n_x; i++) {
        next[i] += stage->by_state[i] * w[s->n_u + i];
        if (s->control_of[i] >= 0) {
            next[i] += stage->by_control[i] * w[s->control_of[i]];
        }
    }
}

void qp_backward(const qp_shape *s, const qp_stage *stage, double alpha, const double *lambda,
                 double *w_out) {
    s->kernels->add_transposed(s->n_dense, s->n_z, alpha, stage->F, s->ld_z, lambda, w_out);
    for (int32_t i = s->n_dense; i < s->n_x; i++) {
        w_out[s->n_u + i] += alpha * stage->by_state[i] * lambda[i];
        if (s->control_of[i] >= 0) {
            w_out[s->control_of[i]] += alpha * stage->by_control[i] * lambda[i];
        }
    }
}

void qp_forward_p(const qp_shape *s, const qp_stage *stage, const double *p, double *next) {
    s->kernels->add_transposed(s->n_p, stage->n_reached, 1, stage->Pt, s->ld_x, p, next);
}

void qp_backward_p(const qp_shape *s, const qp_stage *stage, const double *p, double *w_out) {
    for (int32_t i = 0; i < stage->n_costly; i++) {
        const double *row = stage->C + (ptrdiff_t)stage->costly[i] * s->ld_z;
        const double value = p[stage->costly[i]];
        for (int32_t j = 0; j < s->n_z; j++) {
            w_out[j] += value * row[j];
        }
    }
}

/* How many of the list from place i on stand one behind the other. */
static int32_t run_of(const qp_stage *stage, int32_t i) {
    int32_t n = 1;
    while (i + n < stage->n_costly && stage->costly[i + n] == stage->costly[i] + n) {
        n++;
    }
    return n;
}

void qp_add_costs_p(const qp_shape *s, const qp_stage *stage, const double *w, const double *p,
                    double of_p, double *out) {
    for (int32_t i = 0, n = 0; i < stage->n_costly; i += n) {
        const int32_t at = stage->costly[i];
        n = run_of(stage, i);
        s->kernels->add(n, s->n_z, 1, stage->C + (ptrdiff_t)at * s->ld_z, s->ld_z, w, out + at);
    }
    for (int32_t i = 0; i < stage->n_costly && of_p != 0; i++) {
        const int32_t at = stage->costly[i];
        const double *D = stage->D + at * s->n_p;
        double by_p = 0;
        for (int32_t j = 0; j < stage->n_costly; j++) {
            by_p += D[stage->costly[j]] * p[stage->costly[j]];
        }
        out[at] += of_p * by_p;
    }
}

static int32_t is_zero(const double *values, int32_t n) {
    int32_t zero = 1;
    for (int32_t i = 0; i < n && zero; i++) {
        zero = values[i] == 0;
    }
    return zero;
}

void qp_sum_p(const qp_shape *s, const qp_stage *stages, const double *w, const double *lambda,
              double *out) {
    const double *p = w + (ptrdiff_t)(s->N + 1) * s->ld_z;
    const double of_p = is_zero(p, s->n_p) ? 0 : 1;
    for (int32_t k = 0; k <= s->N && s->n_p > 0; k++) {
        qp_add_costs_p(s, &stages[k], w + (ptrdiff_t)k * s->ld_z, p, of_p, out);
        if (k < s->N) {
            s->kernels->add(s->n_p, stages[k].n_reached, -1, stages[k].Pt, s->ld_x,
                            lambda + (ptrdiff_t)k * s->ld_x, out);
        }
    }
}

/* The slope's row of p; `w` NULL: 0. */
static void slope_p(const qp_shape *s, const qp_stage *stages, const double *w,
                    const double *lambda, double *out) {
    double *slope = row_p(s, out);
    memset(slope, 0, sizeof(double) * (size_t)s->ld_p);
    for (int32_t k = 0; k <= s->N; k++) {
        for (int32_t i = 0; i < s->n_p; i++) {
            slope[i] += stages[k].d[i];
        }
        if (w == NULL && k < s->N) {
            s->kernels->add(s->n_p, stages[k].n_reached, -1, stages[k].Pt, s->ld_x,
                            lambda + (ptrdiff_t)k * s->ld_x, slope);
        }
        if (w != NULL) {
            qp_backward_p(s, &stages[k], w + (ptrdiff_t)(s->N + 1) * s->ld_z, row_z(s, out, k));
        }
    }
    if (w != NULL) {
        qp_sum_p(s, stages, w, lambda, slope);
    }
}

void qp_add_curvature(const qp_shape *s, const qp_stage *stage, double factor, const double *w,
                      double *w_out) {
    if (!s->separable) {
        s->kernels->add_transposed(s->n_z, s->n_z, factor, stage->H, s->ld_z, w, w_out);
        return;
    }
    const int32_t first = s->n_u, end = s->n_u + s->n_tied;
    for (int32_t i = 0; i < first; i++) {
        w_out[i] += factor * stage->H[(ptrdiff_t)i * (s->ld_z + 1)] * w[i];
    }
    for (int32_t i = end; i < s->n_z; i++) {
        w_out[i] += factor * stage->H[(ptrdiff_t)i * (s->ld_z + 1)] * w[i];
    }
    s->kernels->add_transposed(s->n_tied, s->n_tied, factor, stage->H + first * s->ld_z + first,
                               s->ld_z, w + first, w_out + first);
}

void qp_gaps(const qp_shape *s, const qp_stage *stages, const double *w, double *gap) {
    for (int32_t k = 0; k < s->N; k++) {
        const double *next = w + (ptrdiff_t)(k + 1) * s->ld_z + s->n_u;
        double *out = row_x(s, gap, k);
        for (int32_t i = 0; i < s->n_x; i++) {
            out[i] = stages[k].b[i] - next[i];
        }
        qp_forward(s, &stages[k], w + (ptrdiff_t)k * s->ld_z, out);
        if (s->n_p > 0) {
            qp_forward_p(s, &stages[k], w + (ptrdiff_t)(s->N + 1) * s->ld_z, out);
        }
    }
}

void qp_slope(const qp_shape *s, const qp_stage *stages, const double *w, const double *lambda,
              double *out) {
    for (int32_t k = 0; k <= s->N; k++) {
        double *slope = out + (ptrdiff_t)k * s->ld_z;
        memcpy(slope, stages[k].g, sizeof(double) * (size_t)s->ld_z);
        if (w != NULL) {
            qp_add_curvature(s, &stages[k], 1, w + (ptrdiff_t)k * s->ld_z, slope);
        }
        for (int32_t i = 0; lambda != NULL && k > 0 && i < s->n_x; i++) {
            slope[s->n_u + i] += lambda[(ptrdiff_t)(k - 1) * s->ld_x + i];
        }
        if (lambda != NULL && k < s->N) {
            qp_backward(s, &stages[k], -1, lambda + (ptrdiff_t)k * s->ld_x, slope);
        }
    }
    if (s->n_p > 0) {
        slope_p(s, stages, w, lambda, out);
    }
}

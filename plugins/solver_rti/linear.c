/* SPDX-License-Identifier: Apache-2.0 */
/* linear.c: the problem at an iterate, from evaluate() into the form of the quadratic program. */
#include "rti.h"

#include <math.h>
#include <string.h>
#include <time.h>

static double now(void) {
    struct timespec time;
    (void)clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

/* 0, or NaN where one of the values is not finite. */
static double finiteness(const double *values, int32_t n) {
    double sum = 0;
    for (int32_t i = 0; i < n; i++) {
        sum += values[i] - values[i];
    }
    return sum;
}

static void pack_hessian(const rti_solver *s, int32_t has_u, double *grad, qp_stage *stage) {
    const int32_t n_x = s->shape.n_x, n_u = s->shape.n_u, ld = s->shape.ld_z;
    for (int32_t i = 0; i < n_x; i++) {
        double *row = stage->H + (n_u + i) * ld + n_u;
        for (int32_t j = 0; j < n_x; j++) {
            row[j] = s->scale * s->xx[i * n_x + j];
        }
        stage->g[n_u + i] = s->scale * grad[i];
    }
    for (int32_t i = 0; i < n_u && has_u; i++) {
        double *row = stage->H + i * ld;
        for (int32_t j = 0; j < n_u; j++) {
            row[j] = s->scale * s->uu[i * n_u + j];
        }
        for (int32_t j = 0; j < n_x; j++) {
            row[n_u + j] = stage->H[(n_u + j) * ld + i] = s->scale * s->ux[i * n_x + j];
        }
        stage->g[i] = s->scale * s->grad_u[i];
    }
}

static void pack_dynamics(const rti_solver *s, qp_stage *stage) {
    const int32_t n_x = s->shape.n_x, n_u = s->shape.n_u;
    for (int32_t i = 0; i < s->shape.n_dense; i++) {
        double *row = stage->F + i * s->shape.ld_z;
        memcpy(row, s->B + i * n_u, sizeof(double) * (size_t)n_u);
        memcpy(row + n_u, s->A + i * n_x, sizeof(double) * (size_t)n_x);
    }
    for (int32_t i = s->shape.n_dense; i < n_x; i++) {
        const int32_t control = s->shape.control_of[i];
        stage->by_state[i] = s->A[i * n_x + i];
        stage->by_control[i] = control >= 0 ? s->B[i * n_u + control] : 0;
    }
}

static mhe_status evaluate_stage(rti_solver *s, rti_point *point, int32_t k, int32_t derivatives,
                                 double *cost) {
    const int32_t n_x = s->shape.n_x, n_u = s->shape.n_u, has_u = k < s->shape.N;
    const double *u = row_z(&s->shape, point->w, k), *x = u + n_u;
    double *grad_x = s->slope; /* not in use while points are evaluated */
    mhe_stage_values out = {.size = sizeof out, .cost = cost, .x_next = has_u ? s->x_next : NULL};
    if (derivatives) {
        out.grad_x = grad_x;
        out.hess_xx = s->xx;
        out.grad_u = has_u ? s->grad_u : NULL;
        out.hess_ux = has_u ? s->ux : NULL;
        out.hess_uu = has_u ? s->uu : NULL;
        out.A = has_u ? s->A : NULL;
        out.B = has_u ? s->B : NULL;
    }
    mhe_status status = s->problem->evaluate(s->problem, 0, k, x, has_u ? u : NULL, &out, s->err);
    if (status != MHE_OK) {
        return status;
    }
    double sum = *cost - *cost;
    if (derivatives) {
        sum += finiteness(grad_x, n_x) + finiteness(s->xx, n_x * n_x);
        pack_hessian(s, has_u, grad_x, &point->stages[k]);
    }
    if (has_u) {
        double *b = point->stages[k].b;
        const double *next = row_z(&s->shape, point->w, k + 1) + n_u;
        for (int32_t i = 0; i < n_x; i++) {
            b[i] = s->x_next[i] - next[i];
        }
        sum += finiteness(b, n_x);
    }
    if (has_u && derivatives) { /* the arrays of this stage lie one behind the other */
        sum += finiteness(s->ux, n_u * n_x) + finiteness(s->uu, n_u * n_u) +
               finiteness(s->grad_u, n_u) + finiteness(s->A, n_x * n_x) +
               finiteness(s->B, n_x * n_u);
        pack_dynamics(s, &point->stages[k]);
    }
    return sum == 0 ? MHE_OK : MHE_RETRY;
}

int32_t rti_evaluate(rti_solver *s, rti_point *point, int32_t derivatives) {
    const double start = now();
    mhe_status status = MHE_OK;
    point->cost = 0;
    for (int32_t k = 0; k <= s->shape.N && status == MHE_OK; k++) {
        double cost = 0;
        status = evaluate_stage(s, point, k, derivatives, &cost);
        point->cost += s->scale * cost;
    }
    point->damping = derivatives ? 0 : point->damping;
    s->seconds += now() - start;
    s->failure = status < 0 ? status : MHE_OK;
    return status == MHE_OK;
}

/* Calls for each diagonal element of the Hessians that belongs to controls or to states. */
static double sum_of_logarithms(const rti_solver *s, const rti_point *point, int32_t from,
                                int32_t to, int32_t *n) {
    double sum = 0;
    for (int32_t k = 0; k < s->shape.N; k++) {
        for (int32_t i = from; i < to; i++) {
            const double curvature = point->stages[k].H[i * s->shape.ld_z + i];
            sum += curvature > 0 ? log(curvature) : 0;
            *n += curvature > 0;
        }
    }
    return sum;
}

double rti_scale_of(const rti_solver *s, const rti_point *point) {
    int32_t n = 0;
    double sum = sum_of_logarithms(s, point, 0, s->shape.n_u, &n);
    if (n == 0) {
        sum = sum_of_logarithms(s, point, s->shape.n_u, s->shape.n_z, &n);
    }
    return n > 0 ? exp(-sum / n) : 1;
}

void rti_rescale(rti_solver *s, rti_point *point, double factor) {
    for (int32_t k = 0; k <= s->shape.N; k++) {
        for (int32_t i = 0; i < s->shape.n_z * s->shape.ld_z; i++) {
            point->stages[k].H[i] *= factor;
        }
        for (int32_t i = 0; i < s->shape.n_z; i++) {
            point->stages[k].g[i] *= factor;
        }
    }
    point->cost *= factor;
}

void rti_set_damping(rti_solver *s, rti_point *point, double damping) {
    const double more = damping - point->damping;
    for (int32_t k = 0; k <= s->shape.N && more != 0; k++) {
        for (int32_t i = k < s->shape.N ? 0 : s->shape.n_u; i < s->shape.n_z; i++) {
            point->stages[k].H[i * s->shape.ld_z + i] += more;
        }
    }
    point->damping = damping;
}

double rti_gap_sum(const rti_solver *s, const rti_point *point) {
    double sum = 0;
    for (int32_t k = 0; k < s->shape.N; k++) {
        for (int32_t i = 0; i < s->shape.n_x; i++) {
            sum += fabs(point->stages[k].b[i]);
        }
    }
    return sum;
}

void rti_measure(rti_solver *s) {
    rti_residuals *r = &s->residuals;
    *r = (rti_residuals){0};
    qp_slope(&s->shape, s->here.stages, NULL, s->lambda, s->slope);
    for (int32_t k = 0; k <= s->shape.N; k++) {
        for (int32_t i = k < s->shape.N ? 0 : s->shape.n_u; i < s->shape.n_z; i++) {
            const ptrdiff_t at = (ptrdiff_t)k * s->shape.ld_z + i;
            if (s->lower[at] == s->upper[at]) {
                continue; /* its multiplier bears any slope */
            }
            const double below = s->z_lower[at], above = s->z_upper[at];
            r->stationarity = fmax(r->stationarity, fabs(s->slope[at] - below + above));
            r->complementarity =
                fmax(r->complementarity, below > 0 ? below * (s->here.w[at] - s->lower[at]) : 0);
            r->complementarity =
                fmax(r->complementarity, above > 0 ? above * (s->upper[at] - s->here.w[at]) : 0);
        }
        for (int32_t i = 0; k < s->shape.N && i < s->shape.n_x; i++) {
            r->gap = fmax(r->gap, fabs(s->here.stages[k].b[i]));
        }
    }
    s->gap_sum = rti_gap_sum(s, &s->here);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* linear.c: the problem at an iterate, from evaluate() into the form of the quadratic program. */
#include "rti.h"

#include <math.h>
#include <string.h>

/* 0, or NaN where one of the values is not finite; in lanes, for a sum has to wait for itself. */
static double finiteness(const double *values, int32_t n) {
    double lanes[8] = {0}, sum = 0;
    int32_t i = 0;
    for (; i + 8 <= n; i += 8) {
        for (int32_t j = 0; j < 8; j++) {
            lanes[j] += values[i + j] - values[i + j];
        }
    }
    for (; i < n; i++) {
        sum += values[i] - values[i];
    }
    for (int32_t j = 0; j < 8; j++) {
        sum += lanes[j];
    }
    return sum;
}

/* The same where nothing but the block of the tied states and diagonals can stand in H; its other
 * entries are 0 for good. */
static double pack_separable(const rti_solver *s, const rti_worker *of, int32_t has_u,
                             qp_stage *stage) {
    const int32_t n_x = s->shape.n_x, n_u = s->shape.n_u, ld = s->shape.ld_z;
    const int32_t n = s->shape.n_tied;
    const double scale = s->scale;
    double sum = finiteness(of->grad_x, n_x) + (has_u ? finiteness(of->grad_u, n_u) : 0);
    for (int32_t i = 0; i < n; i++) {
        double *row = stage->H + (n_u + i) * ld + n_u;
        for (int32_t j = 0; j < n; j++) {
            row[j] = scale * of->xx[i * n_x + j];
        }
        sum += finiteness(of->xx + i * n_x, n);
    }
    for (int32_t i = n; i < n_x; i++) {
        const double h = of->xx[i * (n_x + 1)];
        stage->H[(n_u + i) * (ld + 1)] = scale * h;
        sum += h - h;
    }
    for (int32_t i = 0; i < n_x; i++) {
        stage->g[n_u + i] = scale * of->grad_x[i];
    }
    for (int32_t i = 0; i < n_u && has_u; i++) {
        const double h = of->uu[i * (n_u + 1)];
        stage->H[i * (ld + 1)] = scale * h;
        stage->g[i] = scale * of->grad_u[i];
        sum += h - h;
    }
    return sum;
}

static double pack_costs(const rti_solver *s, const rti_worker *of, int32_t has_u,
                         qp_stage *stage) {
    const int32_t n_x = s->shape.n_x, n_u = s->shape.n_u, ld = s->shape.ld_z;
    const double scale = s->scale;
    if (s->shape.separable) {
        return pack_separable(s, of, has_u, stage);
    }
    for (int32_t i = 0; i < n_x; i++) {
        double *row = stage->H + (n_u + i) * ld + n_u;
        for (int32_t j = 0; j < n_x; j++) {
            row[j] = scale * of->xx[i * n_x + j];
        }
        stage->g[n_u + i] = scale * of->grad_x[i];
    }
    double sum = finiteness(of->grad_x, n_x) + finiteness(of->xx, n_x * n_x);
    if (!has_u) {
        return sum;
    }
    for (int32_t i = 0; i < n_u; i++) {
        double *row = stage->H + i * ld;
        for (int32_t j = 0; j < n_u; j++) {
            row[j] = scale * of->uu[i * n_u + j];
        }
        for (int32_t j = 0; j < n_x; j++) {
            row[n_u + j] = stage->H[(n_u + j) * ld + i] = scale * of->ux[i * n_x + j];
        }
        stage->g[i] = scale * of->grad_u[i];
    }
    return sum + finiteness(of->ux, n_u * n_x) + finiteness(of->uu, n_u * n_u) +
           finiteness(of->grad_u, n_u);
}

static int32_t is_zero(const double *row, int32_t n) {
    int32_t zero = 1;
    for (int32_t i = 0; i < n; i++) {
        zero &= row[i] == 0;
    }
    return zero;
}

/* Which parameters the costs of a stage see; `all`: the first stage, which holds the priors and
 * Levenberg's term. */
static void list_costly(const qp_shape *shape, int32_t all, qp_stage *stage) {
    stage->n_costly = 0;
    for (int32_t i = 0; i < shape->n_p; i++) {
        if (all || !is_zero(stage->C + (ptrdiff_t)i * shape->ld_z, shape->n_z) ||
            !is_zero(stage->D + i * shape->n_p, shape->n_p)) {
            stage->costly[stage->n_costly++] = i;
        }
    }
}

static double pack_parameter_costs(const rti_solver *s, const rti_worker *of, int32_t has_u,
                                   qp_stage *stage) {
    const int32_t n_x = s->shape.n_x, n_u = s->shape.n_u, n_p = s->shape.n_p;
    for (int32_t i = 0; i < n_p; i++) {
        double *row = stage->C + i * s->shape.ld_z;
        for (int32_t j = 0; j < n_u && has_u; j++) {
            row[j] = s->scale * of->pu[i * n_u + j];
        }
        for (int32_t j = 0; j < n_x; j++) {
            row[n_u + j] = s->scale * of->px[i * n_x + j];
        }
        for (int32_t j = 0; j < n_p; j++) {
            stage->D[i * n_p + j] = s->scale * of->pp[i * n_p + j];
        }
        stage->d[i] = s->scale * of->grad_p[i];
    }
    list_costly(&s->shape, stage == s->here.stages || stage == s->trial.stages, stage);
    return finiteness(of->px, n_p * n_x) + finiteness(of->pu, has_u ? n_p * n_u : 0) +
           finiteness(of->pp, n_p * n_p) + finiteness(of->grad_p, n_p);
}

static double pack_parameter_dynamics(const rti_solver *s, const rti_worker *of, qp_stage *stage) {
    const int32_t n_x = s->shape.n_x, n_p = s->shape.n_p;
    for (int32_t i = 0; i < n_x; i++) {
        for (int32_t j = 0; j < n_p; j++) {
            stage->Pt[j * s->shape.ld_x + i] = of->P[i * n_p + j];
        }
    }
    const int32_t dense = s->shape.n_dense;
    stage->n_reached = is_zero(of->P + dense * n_p, (n_x - dense) * n_p) ? dense : n_x;
    return finiteness(of->P, n_p * n_x);
}

static double pack_dynamics(const rti_solver *s, const rti_worker *of, qp_stage *stage) {
    const int32_t n_x = s->shape.n_x, n_u = s->shape.n_u;
    for (int32_t i = 0; i < s->shape.n_dense; i++) {
        double *row = stage->F + i * s->shape.ld_z;
        memcpy(row, of->B + i * n_u, sizeof(double) * (size_t)n_u);
        memcpy(row + n_u, of->A + i * n_x, sizeof(double) * (size_t)n_x);
    }
    for (int32_t i = s->shape.n_dense; i < n_x; i++) {
        const int32_t control = s->shape.control_of[i];
        stage->by_state[i] = of->A[i * n_x + i];
        stage->by_control[i] = control >= 0 ? of->B[i * n_u + control] : 0;
    }
    const int32_t dense =
        s->shape.n_dense; /* of the other rows the factors alone can be anything */
    return finiteness(of->A, dense * n_x) + finiteness(of->B, dense * n_u) +
           finiteness(stage->by_state + dense, n_x - dense) +
           finiteness(stage->by_control + dense, n_x - dense);
}

static double pack_gap(const rti_solver *s, const rti_worker *of, const double *next, double *b) {
    for (int32_t i = 0; i < s->shape.n_x; i++) {
        b[i] = of->x_next[i] - next[i];
    }
    return finiteness(b, s->shape.n_x);
}

/* What the threads share of one evaluation. */
typedef struct task {
    rti_solver *s;
    rti_point *point;
    int32_t wanted;
} task;

static mhe_stage_values values_wanted(const rti_worker *to, int32_t wanted, int32_t has_u,
                                      const qp_shape *shape, double *cost) {
    const int32_t has_p = shape->n_p > 0, separable = shape->separable;
    /* Workers' matrices are 0 at first, and nothing but evaluate() writes there. */
    mhe_stage_values out = {.size = sizeof out, .hess_clear = 1};
    if (has_p && (wanted & RTI_DERIVATIVES)) {
        const int32_t costs = wanted & RTI_COSTS, dynamics = wanted & RTI_DYNAMICS;
        out.grad_p = costs ? to->grad_p : NULL;
        out.hess_px = costs ? to->px : NULL;
        out.hess_pp = costs ? to->pp : NULL;
        out.hess_pu = costs && has_u ? to->pu : NULL;
        out.P = dynamics && has_u ? to->P : NULL;
    }
    if (wanted & RTI_COSTS) {
        out.cost = cost;
        if (wanted & RTI_DERIVATIVES) {
            out.grad_x = to->grad_x;
            out.hess_xx = to->xx;
            out.grad_u = has_u ? to->grad_u : NULL;
            out.hess_ux = has_u && !separable ? to->ux : NULL;
            out.hess_uu = has_u ? to->uu : NULL;
        }
    }
    if ((wanted & RTI_DYNAMICS) && has_u) {
        out.x_next = to->x_next;
        if (wanted & RTI_DERIVATIVES) {
            out.A = to->A;
            out.B = to->B;
        }
    }
    return out;
}

static mhe_status evaluate_stage(const task *t, int32_t worker, int32_t k) {
    rti_solver *s = t->s;
    rti_worker *of = &s->workers[worker];
    qp_stage *stage = &t->point->stages[k];
    const int32_t has_u = k < s->shape.N, derivatives = t->wanted & RTI_DERIVATIVES;
    const double *u = row_z(&s->shape, t->point->w, k), *x = u + s->shape.n_u;
    const mhe_stage_values out = values_wanted(of, t->wanted, has_u, &s->shape, &s->stage_cost[k]);
    mhe_status status =
        s->problem->evaluate(s->problem, worker, k, x, has_u ? u : NULL, &out, &of->error);
    if (status != MHE_OK) {
        of->error_stage = k;
        return status;
    }
    double sum = 0;
    if (t->wanted & RTI_COSTS) {
        sum += s->stage_cost[k] - s->stage_cost[k];
        sum += derivatives ? pack_costs(s, of, has_u, stage) : 0;
        sum += derivatives ? pack_parameter_costs(s, of, has_u, stage) : 0;
    }
    if (out.x_next != NULL) {
        const double *next = row_z(&s->shape, t->point->w, k + 1) + s->shape.n_u;
        sum += pack_gap(s, of, next, stage->b);
        sum += derivatives ? pack_dynamics(s, of, stage) : 0;
        sum += derivatives ? pack_parameter_dynamics(s, of, stage) : 0;
    }
    return sum == 0 ? MHE_OK : MHE_RETRY;
}

static int32_t work(void *data, int32_t worker, int32_t k) {
    const task *t = data;
    t->s->stage_status[k] = evaluate_stage(t, worker, k);
    return t->s->stage_status[k] != MHE_OK;
}

/* The status of the first stage that has no values, with its reason: all before it were tried. */
static mhe_status first_failure(rti_solver *s) {
    for (int32_t k = 0; k <= s->shape.N; k++) {
        if (s->stage_status[k] == MHE_OK) {
            continue;
        }
        for (int32_t i = 0; i < s->problem->n_workers && s->err != NULL; i++) {
            if (s->workers[i].error_stage == k) {
                *s->err = s->workers[i].error;
            }
        }
        return s->stage_status[k];
    }
    return MHE_OK;
}

/* The parameters of w hold for the evaluations that follow. 0: they have no value. */
static int32_t set_parameters(rti_solver *s, const double *w) {
    const double *p = w + (ptrdiff_t)(s->shape.N + 1) * s->shape.ld_z;
    const mhe_status status =
        s->shape.n_p > 0 ? s->problem->set_parameters(s->problem, p, s->err) : MHE_OK;
    s->failure = status < 0 ? status : MHE_OK;
    return status == MHE_OK;
}

int32_t rti_evaluate(rti_solver *s, rti_point *point, int32_t wanted) {
    const double start = rti_now();
    rti_tick(s);
    if (!set_parameters(s, point->w)) {
        return 0;
    }
    task t = {.s = s, .point = point, .wanted = wanted};
    memset(s->stage_status, 0, sizeof(mhe_status) * (size_t)(s->shape.N + 1));
    for (int32_t i = 0; i < s->problem->n_workers; i++) {
        s->workers[i].error_stage = -1;
    }
    /* Costs alone are quicker done than others are woken; the last stage has no dynamics. */
    const int32_t n_stages = s->shape.N + ((wanted & RTI_COSTS) != 0);
    rti_pool_run(wanted & RTI_DYNAMICS ? s->pool : NULL, n_stages, work, &t);
    const mhe_status status = first_failure(s);
    if (wanted & RTI_COSTS) {
        point->cost = 0;
        for (int32_t k = 0; k <= s->shape.N && status == MHE_OK; k++) {
            point->cost += s->scale * s->stage_cost[k];
        }
        point->damping = wanted & RTI_DERIVATIVES ? 0 : point->damping;
    }
    s->seconds += rti_now() - start;
    s->failure = status < 0 ? status : MHE_OK;
    return status == MHE_OK;
}

double rti_first_gap(rti_solver *s, const double *w) {
    const double start = rti_now();
    rti_tick(s);
    const rti_worker *of = &s->workers[0];
    const mhe_stage_values out = {.size = sizeof out, .x_next = of->x_next};
    const double *x = w + s->shape.n_u, *next = w + s->shape.ld_z + s->shape.n_u;
    if (!set_parameters(s, w)) {
        return INFINITY;
    }
    const mhe_status status = s->problem->evaluate(s->problem, 0, 0, x, w, &out, s->err);
    const int32_t known = status == MHE_OK && finiteness(of->x_next, s->shape.n_x) == 0;
    double gap = known ? 0 : INFINITY;
    for (int32_t i = 0; known && i < s->shape.n_x; i++) {
        gap = larger(gap, fabs(of->x_next[i] - next[i]));
    }
    s->seconds += rti_now() - start;
    s->failure = status < 0 ? status : MHE_OK;
    return gap;
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
        for (int32_t i = 0; i < s->shape.n_p * s->shape.ld_z; i++) {
            point->stages[k].C[i] *= factor;
        }
        for (int32_t i = 0; i < s->shape.n_p; i++) {
            point->stages[k].d[i] *= factor;
            for (int32_t j = 0; j < s->shape.n_p; j++) {
                point->stages[k].D[i * s->shape.n_p + j] *= factor;
            }
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
    for (int32_t i = 0; i < s->shape.n_p; i++) {
        point->stages[0].D[i * s->shape.n_p + i] += more;
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

double rti_weighted_gaps(const rti_solver *s, const rti_point *point) {
    double sum = 0;
    for (int32_t k = 0; k < s->shape.N; k++) {
        for (int32_t i = 0; i < s->shape.n_x; i++) {
            sum += row_x(&s->shape, s->weight, k)[i] * fabs(point->stages[k].b[i]);
        }
    }
    return sum;
}

/* Optimality of the variable at place `at` of all w. */
static void add_variable(const rti_solver *s, const rti_point *point, ptrdiff_t at,
                         const double *z_lower, const double *z_upper, rti_residuals *r) {
    if (s->lower[at] == s->upper[at]) {
        return; /* its multiplier bears any slope */
    }
    const double below = z_lower[at], above = z_upper[at], w = point->w[at];
    r->stationarity = larger(r->stationarity, fabs(s->slope[at] - below + above));
    r->complementarity = larger(r->complementarity, below > 0 ? below * (w - s->lower[at]) : 0);
    r->complementarity = larger(r->complementarity, above > 0 ? above * (s->upper[at] - w) : 0);
}

rti_residuals rti_residuals_of(rti_solver *s, const rti_point *point, const double *lambda,
                               const double *z_lower, const double *z_upper) {
    rti_residuals r = {0};
    qp_slope(&s->shape, point->stages, NULL, lambda, s->slope);
    for (int32_t k = 0; k <= s->shape.N; k++) {
        for (int32_t i = k < s->shape.N ? 0 : s->shape.n_u; i < s->shape.n_z; i++) {
            add_variable(s, point, (ptrdiff_t)k * s->shape.ld_z + i, z_lower, z_upper, &r);
        }
        for (int32_t i = 0; k < s->shape.N && i < s->shape.n_x; i++) {
            r.gap = larger(r.gap, fabs(point->stages[k].b[i]));
        }
    }
    for (int32_t i = 0; i < s->shape.n_p; i++) {
        add_variable(s, point, (ptrdiff_t)(s->shape.N + 1) * s->shape.ld_z + i, z_lower, z_upper,
                     &r);
    }
    return r;
}

double rti_excess(const rti_residuals *r) {
    return fmax(r->stationarity, 10 * fmax(r->gap, r->complementarity));
}

void rti_measure(rti_solver *s) {
    s->residuals = rti_residuals_of(s, &s->here, s->lambda, s->z_lower, s->z_upper);
    s->least_excess = fmin(s->least_excess, rti_excess(&s->residuals));
    s->gap_sum = rti_gap_sum(s, &s->here);
}

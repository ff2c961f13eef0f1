/* SPDX-License-Identifier: Apache-2.0 */
#include "ocp/ocp.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Memory of one thread. */
typedef struct worker {
    mhi_system_context *system;
    void *integrator;
    mhi_term_workspace *terms;  /* [n_terms] */
    double *y, *jacobian;       /* of all signals */
    double *gradient, *hessian; /* [n_z], [n_z x n_z] */
} worker;

struct mhi_ocp {
    mhe_stage_problem face;
    mhe_problem problem;
    mhi_signals signals;
    const mhi_system *system;
    const mhe_integrator_ops *integrator;
    void *integrator_self;
    mhi_term *terms;
    int32_t n_terms, n_terms_created, n_workers_created;
    uint32_t wanted; /* signals any term reads */
    double interval;
    double *x_lower, *x_upper, *u_lower, *u_upper;
    double *targets;                     /* [(N+1) x n_y] */
    double *times;                       /* [N+1] */
    double *prior_centre, *prior_weight; /* [n_x] */
    worker *workers;
    mhi_arena arena;
};

static int32_t find_signal(const mhe_problem *problem, const char *name, int32_t *n_y,
                           const char **unit) {
    const mhi_ocp *ocp = problem->data;
    for (int32_t i = 0; i < MHI_N_SIGNALS; i++) {
        const mhi_signal *s = &ocp->signals.signal[i];
        if (s->n_y > 0 && strcmp(s->name, name) == 0) {
            if (n_y != NULL) {
                *n_y = s->n_y;
            }
            if (unit != NULL) {
                *unit = s->unit;
            }
            return i;
        }
    }
    return -1;
}

static int all_finite(const double *values, int32_t n) {
    double sum = 0;
    for (int32_t i = 0; i < n; i++) {
        sum += values[i] - values[i]; /* NaN for NaN and infinities */
    }
    return sum == 0;
}

/* The lower triangle of the z Hessian, given out as full blocks xx, ux, uu. */
static void spread(const worker *w, int32_t n_x, int32_t n_u, const mhe_stage_values *out) {
    const int32_t n_z = n_x + n_u;
    memcpy(out->grad_x, w->gradient, sizeof(double) * (size_t)n_x);
    for (int32_t i = 0; i < n_x; i++) {
        for (int32_t j = 0; j <= i; j++) {
            out->hess_xx[i * n_x + j] = out->hess_xx[j * n_x + i] = w->hessian[i * n_z + j];
        }
    }
    if (n_u == 0) {
        return;
    }
    memcpy(out->grad_u, w->gradient + n_x, sizeof(double) * (size_t)n_u);
    for (int32_t i = 0; i < n_u; i++) {
        const double *row = w->hessian + (n_x + i) * n_z;
        memcpy(out->hess_ux + i * n_x, row, sizeof(double) * (size_t)n_x);
        for (int32_t j = 0; j <= i; j++) {
            out->hess_uu[i * n_u + j] = out->hess_uu[j * n_u + i] = row[n_x + j];
        }
    }
}

static void add_prior(const mhi_ocp *ocp, const double *x, int32_t n_z, mhi_term_sum *sum) {
    for (int32_t i = 0; i < ocp->face.n_x; i++) {
        const double weight = ocp->prior_weight[i], difference = x[i] - ocp->prior_centre[i];
        sum->cost += 0.5 * weight * difference * difference;
        if (sum->gradient != NULL) {
            sum->gradient[i] += weight * difference;
            sum->hessian[i * n_z + i] += weight;
        }
    }
}

static mhe_status evaluate_cost(const mhi_ocp *ocp, worker *w, int32_t k, const double *x,
                                const double *u, const mhe_stage_values *out, mhe_error *err) {
    const int derivatives = out->hess_xx != NULL;
    const int32_t n_x = ocp->face.n_x, n_u = u == NULL ? 0 : ocp->face.n_u, n_z = n_x + n_u;
    mhe_status status = mhi_signals_evaluate(&ocp->signals, ocp->system, w->system, ocp->wanted, x,
                                             u, w->y, derivatives ? w->jacobian : NULL, err);
    if (status != MHE_OK) {
        return status;
    }
    mhi_term_sum sum = {0};
    if (derivatives) {
        sum.gradient = w->gradient;
        sum.hessian = w->hessian;
        memset(w->gradient, 0, sizeof(double) * (size_t)n_z);
        memset(w->hessian, 0, sizeof(double) * (size_t)(n_z * n_z));
    }
    const mhe_stage stage = {.size = sizeof stage,
                             .node = k,
                             .n_intervals = ocp->face.n_intervals,
                             .time = ocp->times[k]};
    const double scale = u == NULL ? 1 : ocp->interval;
    for (int32_t i = 0; i < ocp->n_terms && status == MHE_OK; i++) {
        status = mhi_term_add(&ocp->terms[i], &w->terms[i], &ocp->signals, &stage, w->y,
                              ocp->targets + (ptrdiff_t)k * ocp->signals.n_y, w->jacobian, scale,
                              n_z, &sum, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    if (k == 0) {
        add_prior(ocp, x, n_z, &sum);
    }
    if (out->cost != NULL) {
        *out->cost = sum.cost;
    }
    if (derivatives) {
        spread(w, n_x, n_u, out);
    }
    return MHE_OK;
}

static mhe_status evaluate(const mhe_stage_problem *problem, int32_t worker_index, int32_t k,
                           const double *x, const double *u, const mhe_stage_values *out,
                           mhe_error *err) {
    const mhi_ocp *ocp = problem->data;
    worker *w = &ocp->workers[worker_index];
    if (!all_finite(x, problem->n_x) || (u != NULL && !all_finite(u, problem->n_u))) {
        return mhe_fail(err, MHE_RETRY, "a state or control is not finite");
    }
    mhe_status status = MHE_OK;
    if (out->cost != NULL || out->hess_xx != NULL) {
        status = evaluate_cost(ocp, w, k, x, u, out, err);
    }
    if (status == MHE_OK && u != NULL && out->x_next != NULL) {
        status = ocp->integrator->step(w->integrator, x, u, ocp->interval, out->x_next, out->A,
                                       out->B, err);
    }
    return status;
}

/* Velocities and positions move with everything; an activation with itself and its excitation. */
static void dynamics_pattern(const mhe_system *f, uint8_t *A, uint8_t *B) {
    for (int32_t i = 0; i < f->n_x; i++) {
        const int32_t muscle = i - 2 * f->n_q;
        for (int32_t j = 0; j < f->n_x; j++) {
            A[i * f->n_x + j] = muscle < 0 || i == j;
        }
        for (int32_t j = 0; j < f->n_u; j++) {
            B[i * f->n_u + j] = muscle < 0 || muscle == j;
        }
    }
}

static mhe_status set_patterns(mhi_ocp *ocp, const mhe_system *f, mhe_error *err) {
    const int32_t n_x = f->n_x, n_u = f->n_u, n_z = n_x + n_u;
    uint8_t *A = MHI_TAKE(&ocp->arena, uint8_t, n_x * n_x);
    uint8_t *B = MHI_TAKE(&ocp->arena, uint8_t, n_x * n_u);
    uint8_t *xx = MHI_TAKE(&ocp->arena, uint8_t, n_x * n_x);
    uint8_t *ux = MHI_TAKE(&ocp->arena, uint8_t, n_u * n_x);
    uint8_t *uu = MHI_TAKE(&ocp->arena, uint8_t, n_u * n_u);
    uint8_t *zz = MHI_TAKE(&ocp->arena, uint8_t, n_z * n_z);
    uint8_t *columns = MHI_TAKE(&ocp->arena, uint8_t, n_z);
    if (!A || !B || !xx || !ux || !uu || !zz || !columns) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    dynamics_pattern(f, A, B);
    for (int32_t i = 0; i < n_x; i++) {
        zz[i * n_z + i] = 1; /* the prior */
    }
    for (int32_t i = 0; i < ocp->n_terms; i++) {
        mhi_term_pattern(&ocp->terms[i], &ocp->signals, n_z, columns, zz);
    }
    for (int32_t i = 0; i < n_z; i++) {
        for (int32_t j = 0; j < n_z; j++) {
            uint8_t set = zz[i * n_z + j];
            if (i < n_x && j < n_x) {
                xx[i * n_x + j] = set;
            } else if (i >= n_x && j < n_x) {
                ux[(i - n_x) * n_x + j] = set;
            } else if (i >= n_x) {
                uu[(i - n_x) * n_u + (j - n_x)] = set;
            }
        }
    }
    ocp->face.A_pattern = A;
    ocp->face.B_pattern = B;
    ocp->face.xx_pattern = xx;
    ocp->face.ux_pattern = ux;
    ocp->face.uu_pattern = uu;
    return MHE_OK;
}

static double *filled(mhi_arena *arena, ptrdiff_t n, double value) {
    double *array = MHI_TAKE(arena, double, n);
    for (ptrdiff_t i = 0; i < n && array != NULL; i++) {
        array[i] = value;
    }
    return array;
}

static mhe_status create_worker(mhi_ocp *ocp, worker *w, mhe_error *err) {
    const int32_t n_z = ocp->face.n_x + ocp->face.n_u;
    w->terms = MHI_TAKE(&ocp->arena, mhi_term_workspace, ocp->n_terms);
    w->y = MHI_TAKE(&ocp->arena, double, ocp->signals.n_y);
    w->jacobian = MHI_TAKE(&ocp->arena, double, ocp->signals.n_jacobian);
    w->gradient = MHI_TAKE(&ocp->arena, double, n_z);
    w->hessian = MHI_TAKE(&ocp->arena, double, n_z *n_z);
    if (!w->terms || !w->y || !w->jacobian || !w->gradient || !w->hessian) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = mhi_system_context_create(ocp->system, &w->system, err);
    if (status == MHE_OK) {
        status =
            ocp->integrator->context_create(ocp->integrator_self, w->system, &w->integrator, err);
    }
    for (int32_t i = 0; i < ocp->n_terms && status == MHE_OK; i++) {
        status = mhi_term_workspace_create(&ocp->terms[i], n_z, &ocp->arena, &w->terms[i], err);
    }
    return status;
}

static mhe_status name_list(mhi_arena *arena, int32_t n, const char *const **names, mhe_error *err,
                            const char *(*name)(const mhe_description *, int32_t),
                            const mhe_description *d) {
    const char **list = MHI_TAKE(arena, const char *, n);
    if (list == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < n; i++) {
        list[i] = name(d, i);
    }
    *names = list;
    return MHE_OK;
}

static const char *coordinate_name(const mhe_description *d, int32_t i) {
    return d->coordinates[i].name;
}

static const char *muscle_name(const mhe_description *d, int32_t i) {
    return d->muscles[i].name;
}

static const char *marker_name(const mhe_description *d, int32_t i) {
    return d->markers[i].name;
}

static mhe_status set_problem(mhi_ocp *ocp, const mhi_ocp_setup *setup, mhe_error *err) {
    const mhe_description *d = mhi_system_description(setup->system);
    mhe_problem *p = &ocp->problem;
    *p = (mhe_problem){.size = sizeof *p,
                       .formulation = mhi_system_formulation(setup->system),
                       .n_q = d->n_coordinates,
                       .n_muscles = d->n_muscles,
                       .n_markers = d->n_markers,
                       .n_residual_torques = mhi_system_face(setup->system)->n_r,
                       .n_intervals = setup->n_intervals,
                       .interval = setup->interval,
                       .data = ocp,
                       .find_signal = find_signal};
    mhe_status status =
        name_list(&ocp->arena, p->n_q, &p->coordinate_names, err, coordinate_name, d);
    if (status == MHE_OK) {
        status = name_list(&ocp->arena, p->n_muscles, &p->muscle_names, err, muscle_name, d);
    }
    if (status == MHE_OK) {
        status = name_list(&ocp->arena, p->n_markers, &p->marker_names, err, marker_name, d);
    }
    return status;
}

static mhe_status take_arrays(mhi_ocp *ocp, mhe_error *err) {
    const ptrdiff_t n = ocp->face.n_intervals;
    ocp->x_lower = filled(&ocp->arena, (n + 1) * ocp->face.n_x, -INFINITY);
    ocp->x_upper = filled(&ocp->arena, (n + 1) * ocp->face.n_x, INFINITY);
    ocp->u_lower = filled(&ocp->arena, n * ocp->face.n_u, -INFINITY);
    ocp->u_upper = filled(&ocp->arena, n * ocp->face.n_u, INFINITY);
    ocp->targets = filled(&ocp->arena, (n + 1) * ocp->signals.n_y, NAN);
    ocp->times = filled(&ocp->arena, n + 1, 0);
    ocp->prior_centre = filled(&ocp->arena, ocp->face.n_x, 0);
    ocp->prior_weight = filled(&ocp->arena, ocp->face.n_x, 0);
    for (int32_t k = 0; k <= n && ocp->times != NULL; k++) {
        ocp->times[k] = k * ocp->interval;
    }
    ocp->face.x_lower = ocp->x_lower;
    ocp->face.x_upper = ocp->x_upper;
    ocp->face.u_lower = ocp->u_lower;
    ocp->face.u_upper = ocp->u_upper;
    ocp->workers = MHI_TAKE(&ocp->arena, worker, ocp->face.n_workers);
    ocp->terms = MHI_TAKE(&ocp->arena, mhi_term, ocp->n_terms);
    if (!ocp->x_lower || !ocp->x_upper || !ocp->u_lower || !ocp->u_upper || !ocp->targets ||
        !ocp->times || !ocp->prior_centre || !ocp->prior_weight || !ocp->workers || !ocp->terms) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    return MHE_OK;
}

static mhe_status build(mhi_ocp *ocp, const mhi_ocp_setup *setup, mhe_error *err) {
    const mhe_system *f = mhi_system_face(setup->system);
    mhi_signals_layout(setup->system, &ocp->signals);
    mhe_status status = take_arrays(ocp, err);
    if (status == MHE_OK) {
        status = set_problem(ocp, setup, err);
    }
    for (int32_t i = 0; i < setup->n_terms && status == MHE_OK; i++) {
        status = mhi_term_create(setup->host, &setup->terms[i], &ocp->problem, &ocp->signals,
                                 &ocp->arena, &ocp->terms[i], err);
        ocp->n_terms_created = i + 1;
        if (status == MHE_OK) {
            ocp->wanted |= mhi_term_reads(&ocp->terms[i]);
        }
    }
    if (status == MHE_OK) {
        status = set_patterns(ocp, f, err);
    }
    if (status == MHE_OK) {
        status = ocp->integrator->create(setup->host, f, setup->integrator_config,
                                         &ocp->integrator_self, err);
    }
    for (int32_t i = 0; i < ocp->face.n_workers && status == MHE_OK; i++) {
        ocp->n_workers_created = i + 1;
        status = create_worker(ocp, &ocp->workers[i], err);
    }
    return status;
}

mhe_status mhi_ocp_create(const mhi_ocp_setup *setup, mhi_ocp **result, mhe_error *err) {
    *result = NULL;
    mhi_ocp *ocp = calloc(1, sizeof *ocp);
    if (ocp == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    const mhe_system *f = mhi_system_face(setup->system);
    ocp->face = (mhe_stage_problem){.size = sizeof ocp->face,
                                    .n_intervals = setup->n_intervals,
                                    .n_x = f->n_x,
                                    .n_u = f->n_u,
                                    .n_workers = setup->n_workers,
                                    .data = ocp,
                                    .evaluate = evaluate};
    ocp->system = setup->system;
    ocp->integrator = setup->integrator->ops;
    ocp->n_terms = setup->n_terms;
    ocp->interval = setup->interval;
    mhe_status status = build(ocp, setup, err);
    if (status != MHE_OK) {
        mhi_ocp_free(ocp);
        return status;
    }
    *result = ocp;
    return MHE_OK;
}

void mhi_ocp_free(mhi_ocp *ocp) {
    if (ocp == NULL) {
        return;
    }
    for (int32_t i = 0; i < ocp->n_workers_created; i++) {
        if (ocp->workers[i].integrator != NULL) {
            ocp->integrator->context_destroy(ocp->workers[i].integrator);
        }
        mhi_system_context_free(ocp->workers[i].system);
    }
    if (ocp->integrator_self != NULL) {
        ocp->integrator->destroy(ocp->integrator_self);
    }
    for (int32_t i = 0; i < ocp->n_terms_created; i++) {
        mhi_term_destroy(&ocp->terms[i]);
    }
    mhi_arena_free(&ocp->arena);
    free(ocp);
}

const mhe_stage_problem *mhi_ocp_face(const mhi_ocp *ocp) {
    return &ocp->face;
}

const mhe_problem *mhi_ocp_problem(const mhi_ocp *ocp) {
    return &ocp->problem;
}

const mhi_signals *mhi_ocp_signals(const mhi_ocp *ocp) {
    return &ocp->signals;
}

double *mhi_ocp_x_lower(mhi_ocp *ocp, int32_t k) {
    return ocp->x_lower + (ptrdiff_t)k * ocp->face.n_x;
}

double *mhi_ocp_x_upper(mhi_ocp *ocp, int32_t k) {
    return ocp->x_upper + (ptrdiff_t)k * ocp->face.n_x;
}

double *mhi_ocp_u_lower(mhi_ocp *ocp, int32_t k) {
    return ocp->u_lower + (ptrdiff_t)k * ocp->face.n_u;
}

double *mhi_ocp_u_upper(mhi_ocp *ocp, int32_t k) {
    return ocp->u_upper + (ptrdiff_t)k * ocp->face.n_u;
}

double *mhi_ocp_target(mhi_ocp *ocp, int32_t signal, int32_t k) {
    const mhi_signal *s = &ocp->signals.signal[signal];
    return s->n_y == 0 ? NULL : ocp->targets + (ptrdiff_t)k * ocp->signals.n_y + s->offset;
}

void mhi_ocp_set_interval(mhi_ocp *ocp, double interval) {
    ocp->interval = interval;
    ocp->problem.interval = interval;
}

void mhi_ocp_set_prior(mhi_ocp *ocp, const double *centre, const double *weight) {
    memcpy(ocp->prior_centre, centre, sizeof(double) * (size_t)ocp->face.n_x);
    memcpy(ocp->prior_weight, weight, sizeof(double) * (size_t)ocp->face.n_x);
}

void mhi_ocp_set_time(mhi_ocp *ocp, int32_t k, double time) {
    ocp->times[k] = time;
}

mhe_status mhi_ocp_predict(mhi_ocp *ocp, const double *x, const double *u, double *x_next,
                           mhe_error *err) {
    return ocp->integrator->step(ocp->workers[0].integrator, x, u, ocp->interval, x_next, NULL,
                                 NULL, err);
}

mhi_system_context *mhi_ocp_context(mhi_ocp *ocp) {
    return ocp->workers[0].system;
}

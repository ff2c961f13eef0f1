/* SPDX-License-Identifier: Apache-2.0 */
#include "model/system.h"

#include "base/arena.h"
#include "base/cholesky.h"
#include "plugin/instance.h"

#include <math.h>
#include <string.h>

struct mhi_system {
    mhe_system face;
    const mhe_description *description;
    int32_t formulation;
    const mhe_model_ops *model;
    const mhe_muscle_ops *muscle;
    void *model_self, *muscle_self;
    mhi_arena arena;
};

struct mhi_system_context {
    const mhi_system *system;
    void *model;
    int32_t n_q, n_m;
    double *zero;                                /* [n_q] */
    double *mass, *bias;                         /* [n_q x n_q], [n_q] */
    double *length, *length_q, *length_qq;       /* [n_m], [n_m x n_q], [n_m x n_q x n_q] */
    double *velocity;                            /* [n_m] */
    double *force, *force_a, *force_l, *force_w; /* [n_m] */
    double *force_q, *force_v;                   /* [n_m x n_q] */
    double *moment, *moment_q, *moment_v;        /* [n_q], [n_q x n_q] */
    double *tau_q, *tau_v;                       /* [n_q x n_q] */
    mhi_arena arena;
};

/* Ldot, forces and moments from the kinematics in the context; with derivatives if asked. */
static mhe_status muscles(mhi_system_context *c, const double *v, const double *a,
                          int32_t derivatives, mhe_error *err) {
    const mhi_system *s = c->system;
    const int32_t n_q = c->n_q, n_m = c->n_m;
    for (int32_t m = 0; m < n_m; m++) {
        double sum = 0;
        for (int32_t j = 0; j < n_q; j++) {
            sum += c->length_q[m * n_q + j] * v[j];
        }
        c->velocity[m] = sum;
    }
    mhe_muscle_force out = {.size = sizeof out, .force = c->force};
    if (derivatives) {
        out.force_a = c->force_a;
        out.force_l = c->force_l;
        out.force_w = c->force_w;
    }
    mhe_status status = s->muscle->force(s->muscle_self, a, c->length, c->velocity, &out, err);
    if (status != MHE_OK) {
        return status;
    }
    memset(c->moment, 0, sizeof(double) * (size_t)n_q);
    for (int32_t m = 0; m < n_m; m++) {
        for (int32_t j = 0; j < n_q; j++) {
            c->moment[j] -= c->length_q[m * n_q + j] * c->force[m];
        }
    }
    return MHE_OK;
}

/* dF/dq = F_l L_q + F_w dLdot/dq with dLdot/dq = L_qq v,  dF/dv = F_w L_q,
 * d moment/dq = -(L_qq F + L_q^T dF/dq),  d moment/dv = -L_q^T dF/dv. */
static void muscle_derivatives(mhi_system_context *c, const double *v) {
    const int32_t n_q = c->n_q, n_m = c->n_m;
    memset(c->moment_q, 0, sizeof(double) * (size_t)(n_q * n_q));
    memset(c->moment_v, 0, sizeof(double) * (size_t)(n_q * n_q));
    for (int32_t m = 0; m < n_m; m++) {
        const double *l_q = c->length_q + m * n_q;
        const double *l_qq = c->length_qq + m * n_q * n_q;
        double *f_q = c->force_q + m * n_q, *f_v = c->force_v + m * n_q;
        for (int32_t i = 0; i < n_q; i++) {
            double w_q = 0;
            for (int32_t j = 0; j < n_q; j++) {
                w_q += l_qq[i * n_q + j] * v[j];
            }
            f_q[i] = c->force_l[m] * l_q[i] + c->force_w[m] * w_q;
            f_v[i] = c->force_w[m] * l_q[i];
        }
        for (int32_t i = 0; i < n_q; i++) {
            for (int32_t j = 0; j < n_q; j++) {
                c->moment_q[i * n_q + j] -= c->force[m] * l_qq[i * n_q + j] + l_q[i] * f_q[j];
                c->moment_v[i * n_q + j] -= l_q[i] * f_v[j];
            }
        }
    }
}

static mhe_status kinematics(mhi_system_context *c, const double *q, const double *v,
                             int32_t dynamics, int32_t derivatives, mhe_error *err) {
    const mhe_kinematics out = {.size = sizeof out,
                                .mass = dynamics ? c->mass : NULL,
                                .bias = dynamics ? c->bias : NULL,
                                .length = c->length,
                                .length_q = c->length_q,
                                .length_qq = derivatives ? c->length_qq : NULL};
    return c->system->model->kinematics(c->model, q, v, &out, err);
}

/* out = M^-1 (moment' - tau') with the factor of M in place */
static void acceleration_derivative(const mhi_system_context *c, const double *moment_d,
                                    const double *tau_d, double *out) {
    const int32_t n_q = c->n_q;
    for (int32_t i = 0; i < n_q * n_q; i++) {
        out[i] = moment_d[i] - tau_d[i];
    }
    mhi_cholesky_solve(c->mass, n_q, out, n_q);
}

static mhe_status acceleration(const mhe_system *face, void *context, const double *q,
                               const double *v, const double *a, const double *r,
                               const mhe_acceleration *out, mhe_error *err) {
    mhi_system_context *c = context;
    const int32_t n_q = face->n_q, n_m = face->n_m;
    const int32_t derivatives =
        out->vdot_q != NULL || out->vdot_v != NULL || out->vdot_a != NULL || out->vdot_r != NULL;
    mhe_status status = kinematics(c, q, v, 1, derivatives, err);
    if (status == MHE_OK) {
        status = muscles(c, v, a, derivatives, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    if (mhi_cholesky_factor(c->mass, n_q) != 0) {
        return mhe_fail(err, MHE_RETRY, "the mass matrix is singular at this posture");
    }
    for (int32_t i = 0; i < n_q; i++) {
        out->vdot[i] = c->moment[i] - c->bias[i] + (face->n_r > 0 ? r[i] : 0.0);
    }
    mhi_cholesky_solve(c->mass, n_q, out->vdot, 1);
    if (!derivatives) {
        return MHE_OK;
    }
    /* With tau held, vdot' = M^-1 (moment' - dID/d.(q, v, vdot)): differentiate ID(q, v, vdot) =
     * tau. */
    status = c->system->model->inverse_dynamics(c->model, out->vdot, NULL, c->tau_q, c->tau_v, err);
    if (status != MHE_OK) {
        return status;
    }
    muscle_derivatives(c, v);
    if (out->vdot_q != NULL) {
        acceleration_derivative(c, c->moment_q, c->tau_q, out->vdot_q);
    }
    if (out->vdot_v != NULL) {
        acceleration_derivative(c, c->moment_v, c->tau_v, out->vdot_v);
    }
    if (out->vdot_a != NULL) {
        for (int32_t i = 0; i < n_q; i++) {
            for (int32_t m = 0; m < n_m; m++) {
                out->vdot_a[i * n_m + m] = -c->length_q[m * n_q + i] * c->force_a[m];
            }
        }
        mhi_cholesky_solve(c->mass, n_q, out->vdot_a, n_m);
    }
    if (out->vdot_r != NULL && face->n_r > 0) {
        memset(out->vdot_r, 0, sizeof(double) * (size_t)(n_q * n_q));
        for (int32_t i = 0; i < n_q; i++) {
            out->vdot_r[i * n_q + i] = 1;
        }
        mhi_cholesky_solve(c->mass, n_q, out->vdot_r, n_q);
    }
    return MHE_OK;
}

static mhe_status activation_rate(const mhe_system *face, const double *e, const double *a,
                                  double *rate, double *rate_e, double *rate_a, mhe_error *err) {
    const mhi_system *s = face->data;
    return s->muscle->activation_rate(s->muscle_self, e, a, rate, rate_e, rate_a, err);
}

mhe_status mhi_system_muscles(mhi_system_context *c, const double *q, const double *v,
                              const double *a, int32_t derivatives, mhi_muscle_state *out,
                              mhe_error *err) {
    mhe_status status = kinematics(c, q, v, 0, derivatives, err);
    if (status == MHE_OK) {
        status = muscles(c, v, a, derivatives, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    if (derivatives) {
        muscle_derivatives(c, v);
    }
    *out = (mhi_muscle_state){.length = c->length,
                              .length_q = c->length_q,
                              .velocity = c->velocity,
                              .force = c->force,
                              .force_q = c->force_q,
                              .force_v = c->force_v,
                              .force_a = c->force_a,
                              .moment = c->moment,
                              .moment_q = c->moment_q,
                              .moment_v = c->moment_v};
    return MHE_OK;
}

mhe_status mhi_system_markers(mhi_system_context *c, const double *q, double *marker,
                              double *marker_q, mhe_error *err) {
    const mhe_kinematics out = {.size = sizeof out, .marker = marker, .marker_q = marker_q};
    return c->system->model->kinematics(c->model, q, c->zero, &out, err);
}

static void set_sizes(mhi_system *s, const mhi_system_setup *setup) {
    const mhe_description *d = setup->description;
    const int32_t n_q = d->n_coordinates, n_m = d->n_muscles;
    const int32_t n_a = setup->formulation == MHE_FORMULATION_EXCITATION ? n_m : 0;
    const int32_t n_r = setup->residual_torques ? n_q : 0;
    s->face = (mhe_system){.size = sizeof s->face,
                           .n_q = n_q,
                           .n_m = n_m,
                           .n_r = n_r,
                           .n_a = n_a,
                           .n_x = 2 * n_q + n_a,
                           .n_u = n_m + n_r,
                           .data = s,
                           .acceleration = acceleration,
                           .activation_rate = activation_rate};
}

/* Far above any body, and low enough for every size of a problem to be an int32_t. */
#define MOST_COORDINATES 500
#define MOST_MUSCLES 5000
#define MOST_MARKERS 5000

static mhe_status check_sizes(const mhe_description *d, mhe_error *err) {
    if (d->n_coordinates == 0) {
        return mhe_fail(err, MHE_E_INPUT, "%s: the model has no free coordinate", d->source);
    }
    if (d->n_coordinates > MOST_COORDINATES || d->n_muscles > MOST_MUSCLES ||
        d->n_markers > MOST_MARKERS) {
        return mhe_fail(err, MHE_E_INPUT,
                        "%s: %d free coordinates, %d muscles, %d markers; at most %d, %d, %d are "
                        "possible",
                        d->source, d->n_coordinates, d->n_muscles, d->n_markers, MOST_COORDINATES,
                        MOST_MUSCLES, MOST_MARKERS);
    }
    return MHE_OK;
}

mhe_status mhi_system_create(const mhi_system_setup *setup, mhi_system **system, mhe_error *err) {
    *system = NULL;
    const mhe_description *d = setup->description;
    mhe_status sizes = check_sizes(d, err);
    if (sizes != MHE_OK) {
        return sizes;
    }
    mhi_arena arena = {0};
    mhi_system *s = MHI_TAKE(&arena, mhi_system, 1);
    if (s == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    s->arena = arena;
    s->description = d;
    s->formulation = setup->formulation;
    s->model = setup->model->ops;
    s->muscle = setup->muscle->ops;
    set_sizes(s, setup);
    mhe_status status =
        mhi_model_create(setup->model, setup->host, d, setup->model_config, &s->model_self, err);
    if (status == MHE_OK) {
        status = mhi_muscle_create(setup->muscle, setup->host, d->muscles, d->n_muscles,
                                   setup->muscle_config, &s->muscle_self, err);
    }
    if (status != MHE_OK) {
        mhi_system_free(s);
        return status;
    }
    *system = s;
    return MHE_OK;
}

void mhi_system_free(mhi_system *s) {
    if (s == NULL) {
        return;
    }
    if (s->muscle_self != NULL) {
        s->muscle->destroy(s->muscle_self);
    }
    if (s->model_self != NULL) {
        s->model->destroy(s->model_self);
    }
    mhi_arena arena = s->arena; /* the system lies in its own arena */
    mhi_arena_free(&arena);
}

const mhe_description *mhi_system_description(const mhi_system *s) {
    return s->description;
}

int32_t mhi_system_formulation(const mhi_system *s) {
    return s->formulation;
}

const mhe_system *mhi_system_face(const mhi_system *s) {
    return &s->face;
}

mhe_status mhi_system_context_create(const mhi_system *s, mhi_system_context **context,
                                     mhe_error *err) {
    *context = NULL;
    const int32_t n_q = s->face.n_q, n_m = s->face.n_m;
    mhi_arena arena = {0};
    mhi_system_context *c = MHI_TAKE(&arena, mhi_system_context, 1);
    if (c == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    c->system = s;
    c->n_q = n_q;
    c->n_m = n_m;
    struct {
        double **array;
        int32_t n;
    } wanted[] = {
        {&c->zero, n_q},           {&c->mass, n_q * n_q},     {&c->bias, n_q},
        {&c->length, n_m},         {&c->length_q, n_m * n_q}, {&c->length_qq, n_m * n_q * n_q},
        {&c->velocity, n_m},       {&c->force, n_m},          {&c->force_a, n_m},
        {&c->force_l, n_m},        {&c->force_w, n_m},        {&c->force_q, n_m * n_q},
        {&c->force_v, n_m * n_q},  {&c->moment, n_q},         {&c->moment_q, n_q * n_q},
        {&c->moment_v, n_q * n_q}, {&c->tau_q, n_q * n_q},    {&c->tau_v, n_q * n_q}};
    mhe_status status = MHE_OK;
    for (size_t i = 0; i < sizeof wanted / sizeof wanted[0] && status == MHE_OK; i++) {
        *wanted[i].array = MHI_TAKE(&arena, double, wanted[i].n);
        status = *wanted[i].array == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    }
    c->arena = arena;
    if (status == MHE_OK) {
        status = s->model->context_create(s->model_self, &c->model, err);
    }
    if (status != MHE_OK) {
        mhi_system_context_free(c);
        return status;
    }
    *context = c;
    return MHE_OK;
}

void mhi_system_context_free(mhi_system_context *c) {
    if (c == NULL) {
        return;
    }
    if (c->model != NULL) {
        c->system->model->context_destroy(c->model);
    }
    mhi_arena arena = c->arena;
    mhi_arena_free(&arena);
}

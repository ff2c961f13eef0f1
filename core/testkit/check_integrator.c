/* SPDX-License-Identifier: Apache-2.0 */
/* check_integrator.c: a damped pendulum pulled by one muscle whose force depends on angle and
 * speed; both formulations, with and without a residual torque. */
#include "kit.h"

#include <math.h>
#include <mhe/integrator.h>
#include <string.h>

#define MAX_X 3
#define MAX_U 2

typedef struct pendulum {
    mhe_status refuse; /* what acceleration() is to return */
} pendulum;

static mhe_status acceleration(const mhe_system *system, void *context, const double *q,
                               const double *v, const double *a, const double *r,
                               const mhe_acceleration *out, mhe_error *err) {
    const pendulum *p = system->data;
    (void)context;
    if (p->refuse != MHE_OK) {
        return mhe_fail(err, p->refuse, "the test asked for it");
    }
    const double pull = 40.0 * a[0] * cos(q[0]) * (1.0 - 0.05 * v[0]);
    out->vdot[0] = -15.0 * sin(q[0]) - 0.8 * v[0] + pull + (system->n_r > 0 ? 2.0 * r[0] : 0.0);
    if (out->vdot_q != NULL) {
        out->vdot_q[0] = -15.0 * cos(q[0]) - 40.0 * a[0] * sin(q[0]) * (1.0 - 0.05 * v[0]);
    }
    if (out->vdot_v != NULL) {
        out->vdot_v[0] = -0.8 - 2.0 * a[0] * cos(q[0]);
    }
    if (out->vdot_a != NULL) {
        out->vdot_a[0] = 40.0 * cos(q[0]) * (1.0 - 0.05 * v[0]);
    }
    if (out->vdot_r != NULL && system->n_r > 0) {
        out->vdot_r[0] = 2.0;
    }
    return MHE_OK;
}

/* As stiff as muscles are: time constants from 9 to 20 ms. */
static mhe_status activation_rate(const mhe_system *system, const double *e, const double *a,
                                  double *rate, double *rate_e, double *rate_a, mhe_error *err) {
    (void)system, (void)err;
    const double z = 0.5 + 1.5 * a[0], d = e[0] - a[0];
    const double speed = 50.0 / z + 12.5 * z;
    rate[0] = speed * d;
    if (rate_e != NULL) {
        rate_e[0] = speed;
    }
    if (rate_a != NULL) {
        rate_a[0] = 1.5 * (12.5 - 50.0 / (z * z)) * d - speed;
    }
    return MHE_OK;
}

static mhe_system make_system(pendulum *p, int32_t n_a, int32_t n_r) {
    return (mhe_system){.size = sizeof(mhe_system),
                        .n_q = 1,
                        .n_m = 1,
                        .n_r = n_r,
                        .n_a = n_a,
                        .n_x = 2 + n_a,
                        .n_u = 1 + n_r,
                        .data = p,
                        .acceleration = acceleration,
                        .activation_rate = activation_rate};
}

/* ---- reference: classical Runge-Kutta with steps of 5 microseconds, exact to rounding ---- */

static void flow(const mhe_system *s, const double *x, const double *u, double *dx) {
    const double *a = s->n_a > 0 ? x + 2 : u;
    const mhe_acceleration out = {.size = sizeof out, .vdot = &dx[1]};
    dx[0] = x[1];
    (void)acceleration(s, NULL, x, x + 1, a, u + 1, &out, NULL);
    if (s->n_a > 0) {
        (void)activation_rate(s, u, x + 2, &dx[2], NULL, NULL, NULL);
    }
}

static void reference_step(const mhe_system *s, const double *x, const double *u, double dt,
                           double *next) {
    const int n = (int)ceil(dt / 5e-6);
    const double h = dt / n;
    double k[4][MAX_X], at[MAX_X];
    memcpy(next, x, sizeof *x * (size_t)s->n_x);
    for (int step = 0; step < n; step++) {
        flow(s, next, u, k[0]);
        for (int stage = 1; stage < 4; stage++) {
            for (int32_t i = 0; i < s->n_x; i++) {
                at[i] = next[i] + (stage < 3 ? 0.5 : 1.0) * h * k[stage - 1][i];
            }
            flow(s, at, u, k[stage]);
        }
        for (int32_t i = 0; i < s->n_x; i++) {
            next[i] += h / 6.0 * (k[0][i] + 2 * k[1][i] + 2 * k[2][i] + k[3][i]);
        }
    }
}

/* ---- checks ---- */

typedef struct integrator_case {
    const char *title;
    const mhe_integrator_ops *ops;
    mhe_system system;
    double dt;
} integrator_case;

static mhe_status call_step(void *data, void *context, void *scratch, const double *const *in,
                            double *const *out, mhe_error *err) {
    const integrator_case *c = data;
    (void)scratch;
    return c->ops->step(context, in[0], in[1], c->dt, NULL, out[0], out[1], out[2], err);
}

/* Largest error of n steps of dt / n against the reference. */
static double flow_error(const integrator_case *c, void *context, const double *x, const double *u,
                         int n) {
    double next[MAX_X], exact[MAX_X], worst = 0;
    memcpy(next, x, sizeof next);
    for (int i = 0; i < n; i++) {
        double from[MAX_X];
        memcpy(from, next, sizeof from);
        if (c->ops->step(context, from, u, c->dt / n, NULL, next, NULL, NULL, NULL) != MHE_OK) {
            return NAN;
        }
    }
    reference_step(&c->system, x, u, c->dt, exact);
    for (int32_t i = 0; i < c->system.n_x; i++) {
        worst = fmax(worst, fabs(next[i] - exact[i]) / fmax(1.0, fabs(exact[i])));
    }
    return worst;
}

static void check_accuracy(mhi_kit *kit, integrator_case *c, void *context, const double *x,
                           const double *u) {
    /* The interface promises no accuracy: a step far too long for a scheme may be this poor,
     * another equation is worse. What an estimator needs of it is a matter of its options. */
    const double coarse = flow_error(c, context, x, u, 1), fine = flow_error(c, context, x, u, 8);
    (void)mhi_kit_limit(kit, mhi_arena_format(&kit->arena, "error over 30 ms (%s)", c->title),
                        coarse, 1e-3);
    /* at least first order, down to what an adaptive integrator was asked for below */
    (void)mhi_kit_limit(kit, mhi_arena_format(&kit->arena, "shorter steps converge (%s)", c->title),
                        fine, fmax(coarse / 8.0, 1e-8));
}

/* What acceleration() says must reach the caller: positive stays positive, negative negative. */
static void check_statuses(mhi_kit *kit, integrator_case *c, void *context, const double *x,
                           const double *u) {
    pendulum *p = c->system.data;
    double next[MAX_X];
    p->refuse = MHE_RETRY;
    const mhe_status retry = c->ops->step(context, x, u, c->dt, NULL, next, NULL, NULL, NULL);
    p->refuse = MHE_E_NUMERIC;
    const mhe_status failure = c->ops->step(context, x, u, c->dt, NULL, next, NULL, NULL, NULL);
    p->refuse = MHE_OK;
    const mhe_status after = c->ops->step(context, x, u, c->dt, NULL, next, NULL, NULL, NULL);
    if (retry > 0 && failure < 0 && after == MHE_OK) {
        mhi_kit_pass(kit, "the system's statuses are handed on");
    } else {
        mhi_kit_fail(kit, "the system's statuses are handed on",
                     "retry gave %d, failure %d, a good step after them %d", (int)retry,
                     (int)failure, (int)after);
    }
}

/* Steps along a line of starts, with a memory and without: the same results, nothing written behind
 * the memory, and a call that fails leaves it fit for use. */
static void check_memory(mhi_kit *kit, integrator_case *c, void *context, int32_t size) {
    const int32_t n_x = c->system.n_x, n_u = c->system.n_u;
    double *memory = MHI_TAKE(&kit->arena, double, size + 1), worst = 0, worst_d = 0;
    pendulum *p = c->system.data;
    mhe_status status = MHE_OK;
    if (memory == NULL) {
        mhi_kit_fail(kit, "memory", "out of memory (%s)", c->title);
        return;
    }
    memory[size] = 12345;
    for (int k = 0; k < 12 && status == MHE_OK; k++) {
        const double move = k < 6 ? 0.1 * k : 0.6 + 1e-3 * k;
        const double x[MAX_X] = {0.4 + move, -1.3 - move, 0.25 + 0.2 * move};
        const double u[MAX_U] = {0.7 - move, -1.1 + move};
        double next[2][MAX_X], A[2][MAX_X * MAX_X], B[2][MAX_X * MAX_U];
        double *const d[2][2] = {{A[0], B[0]}, {A[1], B[1]}};
        const int linear = k % 3 != 1; /* values alone between them */
        p->refuse = k == 4 ? MHE_RETRY : MHE_OK;
        for (int i = 0; i < 2 && status == MHE_OK; i++) {
            status = c->ops->step(context, x, u, c->dt, i == 0 ? NULL : memory, next[i],
                                  linear ? d[i][0] : NULL, linear ? d[i][1] : NULL, NULL);
            status = p->refuse == MHE_OK || status <= 0 ? status : MHE_OK;
        }
        if (p->refuse != MHE_OK) {
            p->refuse = MHE_OK;
            continue;
        }
        for (int32_t i = 0; i < n_x; i++) {
            worst = fmax(worst, fabs(next[0][i] - next[1][i]));
        }
        for (int32_t i = 0; linear && i < n_x * n_x; i++) {
            worst_d = fmax(worst_d, fabs(A[0][i] - A[1][i]));
        }
        for (int32_t i = 0; linear && i < n_x * n_u; i++) {
            worst_d = fmax(worst_d, fabs(B[0][i] - B[1][i]));
        }
    }
    if (status != MHE_OK || memory[size] != 12345) {
        mhi_kit_fail(kit, "memory", "status %d, %s written behind it (%s)", (int)status,
                     memory[size] == 12345 ? "nothing" : "something", c->title);
    }
    (void)mhi_kit_limit(kit, mhi_arena_format(&kit->arena, "values with a memory (%s)", c->title),
                        worst, 1e-8);
    (void)mhi_kit_limit(kit,
                        mhi_arena_format(&kit->arena, "derivatives with a memory (%s)", c->title),
                        worst_d, 1e-5);
}

static void check_steps(mhi_kit *kit, integrator_case *c, void *const *contexts) {
    const int32_t n_x = c->system.n_x, n_u = c->system.n_u;
    const double x[MAX_X] = {0.4, -1.3, 0.25}, u[MAX_U] = {0.7, -1.1};
    const double *const in[] = {x, u};
    double next[MAX_X], A[MAX_X * MAX_X], B[MAX_X * MAX_U];
    mhi_probe probe = {.name = mhi_arena_format(&kit->arena, "step (%s)", c->title),
                       .n_in = 2,
                       .n_out = 3,
                       .in = {{.n = n_x}, {.n = n_u}},
                       .out = {{.n = n_x}, {.n = n_x * n_x}, {.n = n_x * n_u}},
                       .data = c,
                       .call = call_step};
    memcpy(probe.worker, contexts, sizeof probe.worker);
    mhi_probe_check(kit, &probe, in);
    mhe_error err = {0};
    const mhe_status status = c->ops->step(contexts[0], x, u, c->dt, NULL, next, A, B, &err);
    if (status != MHE_OK) {
        mhi_kit_fail(kit, "step", "status %d (%s): %s", (int)status, c->title, err.text);
        return;
    }
    mhi_probe_jacobian(kit, &probe, in, 0, 0, A, "A against differences");
    mhi_probe_jacobian(kit, &probe, in, 1, 0, B, "B against differences");
    check_accuracy(kit, c, contexts[0], x, u);
    check_statuses(kit, c, contexts[0], x, u);
}

static void check_system(mhi_kit *kit, const char *title, int32_t n_a, int32_t n_r) {
    pendulum p = {MHE_OK};
    integrator_case c = {
        .title = title, .ops = kit->plugin->ops, .system = make_system(&p, n_a, n_r), .dt = 0.03};
    void *self = NULL, *contexts[MHI_WORKERS] = {NULL};
    int n = 0;
    mhe_error err = {0};
    mhe_status status = c.ops->create(&kit->host, &c.system, kit->config, &self, &err);
    if (status != MHE_OK) {
        mhi_kit_fail(kit, "create", "status %d (%s): %s", (int)status, title, err.text);
        return;
    }
    while (n < MHI_WORKERS && status == MHE_OK) {
        status = c.ops->context_create(self, NULL, &contexts[n], &err);
        n += status == MHE_OK;
    }
    const int32_t size = c.ops->memory_size != NULL ? c.ops->memory_size(self) : 0;
    if (status == MHE_OK) {
        check_steps(kit, &c, contexts);
        if (size > 0) {
            check_memory(kit, &c, contexts[0], size);
        }
    } else {
        mhi_kit_fail(kit, "contexts", "status %d (%s): %s", (int)status, title, err.text);
    }
    while (n > 0) {
        c.ops->context_destroy(contexts[--n]);
    }
    c.ops->destroy(self);
}

void mhi_check_integrator(mhi_kit *kit) {
    mhi_kit_set_number(kit, "rtol", 1e-10); /* where it has them */
    mhi_kit_set_number(kit, "atol", 1e-12);
    check_system(kit, "excitation-driven", 1, 0);
    check_system(kit, "excitation-driven, residual torque", 1, 1);
    check_system(kit, "activation-driven", 0, 0);
    check_system(kit, "activation-driven, residual torque", 0, 1);
}

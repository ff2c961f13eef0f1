/* SPDX-License-Identifier: Apache-2.0 */
/* check_integrator.c: a damped pendulum pulled by one muscle whose force depends on angle and
 * speed; both formulations, with and without a residual torque, an input, states of the muscle
 * beside its activation, a parameter. */
#include "kit.h"

#include <math.h>
#include <mhe/integrator.h>
#include <string.h>

#define MAX_X 5
#define MAX_U 2

typedef struct pendulum {
    mhe_status refuse; /* what acceleration() is to return */
    double strength;   /* the parameter */
} pendulum;

/* What forces see of the muscle: its activation, stretched by z where it has such states. */
static double level_of(const mhe_system *s, const mhe_system_point *at) {
    return s->n_z > 0 ? at->a[0] * (1.0 + 0.4 * at->z[0]) + 0.1 * at->z[1] : at->a[0];
}

static void rates(const mhe_system *s, const mhe_system_point *at, const mhe_acceleration *out) {
    const pendulum *p = s->data;
    const double q = at->q[0], v = at->v[0], a = at->a[0], c = at->c[0], *z = at->z;
    const struct {
        double *to;
        double value[4];
        int n;
    } all[] = {
        {out->zdot,
         {-60.0 * (z[0] - p->strength * a) + 4.0 * sin(q) * v, -25.0 * z[1] + 6.0 * z[0] * c},
         2},
        {out->zdot_q, {4.0 * cos(q) * v, 0}, 2},
        {out->zdot_v, {4.0 * sin(q), 0}, 2},
        {out->zdot_a, {60.0 * p->strength, 0}, 2},
        {out->zdot_c, {0, 6.0 * z[0]}, 2},
        {out->zdot_z, {-60.0, 0, 6.0 * c, -25.0}, 4},
        {s->n_p > 0 ? out->zdot_p : NULL, {60.0 * a, 0}, 2}};
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        for (int k = 0; k < all[i].n && all[i].to != NULL; k++) {
            all[i].to[k] = all[i].value[k];
        }
    }
}

static mhe_status acceleration(const mhe_system *system, void *context, const mhe_system_point *at,
                               const mhe_acceleration *out, mhe_error *err) {
    const pendulum *p = system->data;
    const double q = at->q[0], v = at->v[0];
    (void)context;
    if (p->refuse != MHE_OK) {
        return mhe_fail(err, p->refuse, "the test asked for it");
    }
    const double arm = 40.0 * cos(q) * (1.0 - 0.05 * v), level = level_of(system, at);
    const double pull = p->strength * arm;
    out->vdot[0] = -15.0 * sin(q) - 0.8 * v + pull * level +
                   (system->n_r > 0 ? 2.0 * at->r[0] : 0.0) +
                   (system->n_w > 0 ? 3.0 * at->w[0] * cos(q) : 0.0);
    if (out->vdot_q != NULL) {
        out->vdot_q[0] = -15.0 * cos(q) - p->strength * level * 40.0 * sin(q) * (1.0 - 0.05 * v) -
                         (system->n_w > 0 ? 3.0 * at->w[0] * sin(q) : 0.0);
    }
    if (out->vdot_v != NULL) {
        out->vdot_v[0] = -0.8 - p->strength * 2.0 * level * cos(q);
    }
    if (out->vdot_a != NULL) {
        out->vdot_a[0] = pull * (system->n_z > 0 ? 1.0 + 0.4 * at->z[0] : 1.0);
    }
    if (out->vdot_z != NULL && system->n_z > 0) {
        out->vdot_z[0] = pull * 0.4 * at->a[0];
        out->vdot_z[1] = pull * 0.1;
    }
    if (out->vdot_r != NULL && system->n_r > 0) {
        out->vdot_r[0] = 2.0;
    }
    if (out->vdot_p != NULL && system->n_p > 0) {
        out->vdot_p[0] = arm * level;
    }
    if (system->n_z > 0 && out->zdot != NULL) {
        rates(system, at, out);
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

/* What a kind of system has beside the pendulum and its muscle. */
typedef struct kind {
    const char *title;
    int32_t n_d, n_r, n_w, n_z, n_p;
} kind;

static mhe_system make_system(const kind *k, pendulum *p) {
    static const int32_t z_muscle[] = {0, 0}, z_of[] = {0, 1};
    static const mhe_layout layout = {.size = sizeof layout, .block_size = sizeof(mhe_block)};
    return (mhe_system){.size = sizeof(mhe_system),
                        .layout = &layout,
                        .n_x = 2 + k->n_d + k->n_z,
                        .n_u = 1 + k->n_r,
                        .n_w = k->n_w,
                        .n_p = k->n_p,
                        .n_q = 1,
                        .n_m = 1,
                        .n_a = 1,
                        .n_d = k->n_d,
                        .n_z = k->n_z,
                        .n_r = k->n_r,
                        .n_k = k->n_z,
                        .first_d = 2,
                        .first_z = 2 + k->n_d,
                        .z_muscle = z_muscle,
                        .z_of = z_of,
                        .data = p,
                        .acceleration = acceleration,
                        .activation_rate = activation_rate};
}

/* ---- reference: classical Runge-Kutta with steps of 5 microseconds, exact to rounding ---- */

static void flow(const mhe_system *s, const double *x, const double *u, const double *w,
                 double *dx) {
    const mhe_system_point at = {.size = sizeof at,
                                 .q = x,
                                 .v = x + 1,
                                 .a = s->n_d > 0 ? x + 2 : u,
                                 .z = x + 2 + s->n_d,
                                 .c = u,
                                 .r = u + 1,
                                 .w = w};
    const mhe_acceleration out = {.size = sizeof out, .vdot = &dx[1], .zdot = dx + 2 + s->n_d};
    dx[0] = x[1];
    (void)acceleration(s, NULL, &at, &out, NULL);
    if (s->n_d > 0) {
        (void)activation_rate(s, u, x + 2, &dx[2], NULL, NULL, NULL);
    }
}

static void reference_step(const mhe_system *s, const double *x, const double *u, const double *w,
                           double dt, double *next) {
    const int n = (int)ceil(dt / 5e-6);
    const double h = dt / n;
    double k[4][MAX_X], at[MAX_X];
    memcpy(next, x, sizeof *x * (size_t)s->n_x);
    for (int step = 0; step < n; step++) {
        flow(s, next, u, w, k[0]);
        for (int stage = 1; stage < 4; stage++) {
            for (int32_t i = 0; i < s->n_x; i++) {
                at[i] = next[i] + (stage < 3 ? 0.5 : 1.0) * h * k[stage - 1][i];
            }
            flow(s, at, u, w, k[stage]);
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
    const double *w;
} integrator_case;

/* A step without derivatives. */
static mhe_status plain_step(const integrator_case *c, void *context, const double *x,
                             const double *u, double dt, double *next) {
    return c->ops->step(context, x, u, c->w, dt, NULL, next, NULL, NULL);
}

static mhe_status call_step(void *data, void *context, void *scratch, const double *const *in,
                            double *const *out, mhe_error *err) {
    const integrator_case *c = data;
    (void)scratch;
    const mhe_step_derivatives d = {sizeof d, out[1], out[2], c->system.n_p > 0 ? out[3] : NULL};
    return c->ops->step(context, in[0], in[1], c->w, c->dt, NULL, out[0], &d, err);
}

/* Largest error of n steps of dt / n against the reference. */
static double flow_error(const integrator_case *c, void *context, const double *x, const double *u,
                         int n) {
    double next[MAX_X], exact[MAX_X], worst = 0;
    memcpy(next, x, sizeof next);
    for (int i = 0; i < n; i++) {
        double from[MAX_X];
        memcpy(from, next, sizeof from);
        if (plain_step(c, context, from, u, c->dt / n, next) != MHE_OK) {
            return NAN;
        }
    }
    reference_step(&c->system, x, u, c->w, c->dt, exact);
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
    const mhe_status retry = plain_step(c, context, x, u, c->dt, next);
    p->refuse = MHE_E_NUMERIC;
    const mhe_status failure = plain_step(c, context, x, u, c->dt, next);
    p->refuse = MHE_OK;
    const mhe_status after = plain_step(c, context, x, u, c->dt, next);
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
        const double x[MAX_X] = {0.4 + move, -1.3 - move, 0.25 + 0.2 * move, 0.3, 0.1 - move};
        const double u[MAX_U] = {0.7 - move, -1.1 + move};
        double next[2][MAX_X], A[2][MAX_X * MAX_X], B[2][MAX_X * MAX_U];
        const mhe_step_derivatives d[2] = {{sizeof d[0], A[0], B[0], NULL},
                                           {sizeof d[0], A[1], B[1], NULL}};
        const int linear = k % 3 != 1; /* values alone between them */
        p->refuse = k == 4 ? MHE_RETRY : MHE_OK;
        for (int i = 0; i < 2 && status == MHE_OK; i++) {
            status = c->ops->step(context, x, u, c->w, c->dt, i == 0 ? NULL : memory, next[i],
                                  linear ? &d[i] : NULL, NULL);
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

/* x_next at [x; p]; the state is there to say how large the derivatives of a row are. */
typedef struct parameter_case {
    integrator_case *c;
    void *context;
    const double *u;
} parameter_case;

static int with_parameter(void *data, const double *xp, double *next) {
    const parameter_case *d = data;
    pendulum *pendulum_of = d->c->system.data;
    pendulum_of->strength = xp[d->c->system.n_x];
    const mhe_status status = plain_step(d->c, d->context, xp, d->u, d->c->dt, next);
    pendulum_of->strength = 1;
    return status != MHE_OK;
}

static void check_parameter(mhi_kit *kit, integrator_case *c, void *context, const double *x,
                            const double *u, const double *A, const double *P) {
    const int32_t n_x = c->system.n_x, n = n_x + 1;
    double xp[MAX_X + 1], jacobian[MAX_X * (MAX_X + 1)];
    parameter_case data = {c, context, u};
    memcpy(xp, x, sizeof *x * (size_t)n_x);
    xp[n_x] = 1;
    for (int32_t i = 0; i < n_x; i++) {
        memcpy(jacobian + i * n, A + i * n_x, sizeof *A * (size_t)n_x);
        jacobian[i * n + n_x] = P[i];
    }
    (void)mhi_kit_limit(kit, "P against differences",
                        mhi_jacobian_error(kit, with_parameter, &data, xp, n, n_x, jacobian),
                        MHI_JACOBIAN_LIMIT);
}

static void check_steps(mhi_kit *kit, integrator_case *c, void *const *contexts) {
    const int32_t n_x = c->system.n_x, n_u = c->system.n_u, n_p = c->system.n_p;
    const double x[MAX_X] = {0.4, -1.3, 0.25, 0.3, -0.1}, u[MAX_U] = {0.7, -1.1};
    const double *const in[] = {x, u};
    double next[MAX_X], A[MAX_X * MAX_X], B[MAX_X * MAX_U], P[MAX_X];
    double *const out[] = {next, A, B, P};
    mhi_probe probe = {.name = mhi_arena_format(&kit->arena, "step (%s)", c->title),
                       .n_in = 2,
                       .n_out = 4,
                       .in = {{.n = n_x}, {.n = n_u}},
                       .out = {{.n = n_x}, {.n = n_x * n_x}, {.n = n_x * n_u}, {.n = n_x * n_p}},
                       .data = c,
                       .call = call_step};
    memcpy(probe.worker, contexts, sizeof probe.worker);
    mhi_probe_check(kit, &probe, in);
    mhe_error err = {0};
    const mhe_status status = call_step(c, contexts[0], NULL, in, out, &err);
    if (status != MHE_OK) {
        mhi_kit_fail(kit, "step", "status %d (%s): %s", (int)status, c->title, err.text);
        return;
    }
    mhi_probe_jacobian(kit, &probe, in, 0, 0, A, "A against differences");
    mhi_probe_jacobian(kit, &probe, in, 1, 0, B, "B against differences");
    if (n_p > 0) {
        check_parameter(kit, c, contexts[0], x, u, A, P);
    }
    check_accuracy(kit, c, contexts[0], x, u);
    check_statuses(kit, c, contexts[0], x, u);
}

static void check_system(mhi_kit *kit, const kind *k) {
    static const double w[] = {1.7};
    pendulum p = {MHE_OK, 1};
    integrator_case c = {.title = k->title,
                         .ops = kit->plugin->ops,
                         .system = make_system(k, &p),
                         .dt = 0.03,
                         .w = k->n_w > 0 ? w : NULL};
    void *self = NULL, *contexts[MHI_WORKERS] = {NULL};
    int n = 0;
    mhe_error err = {0};
    mhe_status status = MHE_OK;
    if (c.ops->accepts != NULL && c.ops->accepts(&c.system, kit->config, &err) != MHE_OK) {
        mhi_kit_note(kit, "not taken", "%s: \"%s\"", k->title, err.text);
        return;
    }
    status = c.ops->create(&kit->host, &c.system, kit->config, &self, &err);
    if (status != MHE_OK) {
        mhi_kit_fail(kit, "create", "status %d (%s): %s", (int)status, k->title, err.text);
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
        mhi_kit_fail(kit, "contexts", "status %d (%s): %s", (int)status, k->title, err.text);
    }
    while (n > 0) {
        c.ops->context_destroy(contexts[--n]);
    }
    c.ops->destroy(self);
}

void mhi_check_integrator(mhi_kit *kit) {
    static const kind kinds[] = {
        {"excitation-driven", 1, 0, 0, 0, 0},
        {"excitation-driven, residual torque", 1, 1, 0, 0, 0},
        {"activation-driven", 0, 0, 0, 0, 0},
        {"activation-driven, residual torque", 0, 1, 0, 0, 0},
        {"excitation-driven, input", 1, 1, 1, 0, 0},
        {"excitation-driven, two more states a muscle", 1, 1, 0, 2, 0},
        {"activation-driven, two more states a muscle", 0, 0, 1, 2, 0},
        {"excitation-driven, parameter", 1, 1, 0, 0, 1},
        {"activation-driven, parameter", 0, 1, 0, 0, 1},
        {"excitation-driven, two more states a muscle, parameter", 1, 0, 0, 2, 1}};
    mhi_kit_set_number(kit, "rtol", 1e-10); /* where it has them */
    mhi_kit_set_number(kit, "atol", 1e-12);
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        check_system(kit, &kinds[i]);
    }
}

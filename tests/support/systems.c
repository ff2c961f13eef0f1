/* SPDX-License-Identifier: Apache-2.0 */
#include "systems.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define Q SYSTEM_Q
#define M SYSTEM_M

static void shape(int32_t flags, mhe_system *out) {
    out->size = sizeof *out;
    out->n_q = Q;
    out->n_m = M;
    out->n_r = flags & SYSTEM_RESIDUALS ? Q : 0;
    out->n_a = M;
    out->n_d = flags & SYSTEM_EXCITATION ? M : 0;
    out->first_d = 2 * Q;
    out->first_z = 2 * Q + out->n_d;
    out->n_x = out->first_z;
    out->n_u = M + out->n_r;
}

/* ---- pendulum ---- */

static const double alpha = 0.25, beta = 0.06, delta = 0.05, g_1 = 6.0, g_2 = 2.0;
static const double arm[M][Q] = {{0.03, 0.01}, {-0.04, 0.0}, {0.0, -0.02}};
static const double f_max[M] = {600, 400, 300};

/* Force of muscle m and its derivatives by a, q and v. */
static double muscle(int m, const double *q, const double *v, double a, double *f_a, double *f_q,
                     double *f_v) {
    double shift = (arm[m][0] * q[0] + arm[m][1] * q[1]) / 0.05;
    double speed = arm[m][0] * v[0] + arm[m][1] * v[1];
    double bell = exp(-shift * shift), th = tanh(2 * speed), fv = 1 - 0.7 * th;
    *f_a = f_max[m] * bell * fv;
    for (int j = 0; j < Q; j++) {
        f_q[j] = -2 * shift * arm[m][j] / 0.05 * a * *f_a;
        f_v[j] = -0.7 * 2 * (1 - th * th) * arm[m][j] * a * f_max[m] * bell;
    }
    return a * *f_a;
}

static void solve(const double mass[Q][Q], const double *b, int columns, double *x) {
    double det = mass[0][0] * mass[1][1] - mass[0][1] * mass[1][0];
    for (int j = 0; j < columns; j++) {
        double first = b[j], second = b[columns + j];
        x[j] = (mass[1][1] * first - mass[0][1] * second) / det;
        x[columns + j] = (mass[0][0] * second - mass[1][0] * first) / det;
    }
}

static mhe_status pendulum_acceleration(const mhe_system *system, void *context,
                                        const mhe_system_point *at, const mhe_acceleration *out,
                                        mhe_error *err) {
    const double *q = at->q, *v = at->v, *a = at->a, *r = at->r;
    (void)context, (void)err;
    double s = sin(q[1]), c = cos(q[1]), s12 = sin(q[0] + q[1]), c12 = cos(q[0] + q[1]);
    double mass[Q][Q] = {{alpha + 2 * beta * c, delta + beta * c}, {delta + beta * c, delta}};
    double bias[Q] = {-beta * s * (2 * v[0] * v[1] + v[1] * v[1]) + g_1 * cos(q[0]) + g_2 * c12,
                      beta * s * v[0] * v[0] + g_2 * c12};
    double right[Q] = {-bias[0], -bias[1]}, by_a[Q][M], by_q[Q][Q], by_v[Q][Q];
    double bias_q[Q][Q] = {
        {-g_1 * sin(q[0]) - g_2 * s12, -beta * c * (2 * v[0] * v[1] + v[1] * v[1]) - g_2 * s12},
        {-g_2 * s12, beta * c * v[0] * v[0] - g_2 * s12}};
    double bias_v[Q][Q] = {{-2 * beta * s * v[1], -2 * beta * s * (v[0] + v[1])},
                           {2 * beta * s * v[0], 0}};
    for (int i = 0; i < Q; i++) {
        for (int j = 0; j < Q; j++) {
            by_q[i][j] = -bias_q[i][j];
            by_v[i][j] = -bias_v[i][j];
        }
        right[i] += system->n_r > 0 ? r[i] : 0;
    }
    for (int m = 0; m < M; m++) {
        double f_a, f_q[Q], f_v[Q], f = muscle(m, q, v, a[m], &f_a, f_q, f_v);
        for (int i = 0; i < Q; i++) {
            right[i] += arm[m][i] * f;
            by_a[i][m] = arm[m][i] * f_a;
            for (int j = 0; j < Q; j++) {
                by_q[i][j] += arm[m][i] * f_q[j];
                by_v[i][j] += arm[m][i] * f_v[j];
            }
        }
    }
    solve((const double(*)[Q])mass, right, 1, out->vdot);
    /* d(M vdot) = d right: the change of M goes to the right-hand side */
    by_q[0][1] += beta * s * (2 * out->vdot[0] + out->vdot[1]);
    by_q[1][1] += beta * s * out->vdot[0];
    if (out->vdot_q != NULL) {
        solve((const double(*)[Q])mass, &by_q[0][0], Q, out->vdot_q);
    }
    if (out->vdot_v != NULL) {
        solve((const double(*)[Q])mass, &by_v[0][0], Q, out->vdot_v);
    }
    if (out->vdot_a != NULL) {
        solve((const double(*)[Q])mass, &by_a[0][0], M, out->vdot_a);
    }
    if (out->vdot_r != NULL && system->n_r > 0) {
        static const double unit[Q * Q] = {1, 0, 0, 1};
        solve((const double(*)[Q])mass, unit, Q, out->vdot_r);
    }
    return MHE_OK;
}

double test_pendulum_energy(const double *q, const double *v) {
    double c = cos(q[1]);
    return 0.5 * (alpha + 2 * beta * c) * v[0] * v[0] + (delta + beta * c) * v[0] * v[1] +
           0.5 * delta * v[1] * v[1] + g_1 * sin(q[0]) + g_2 * sin(q[0] + q[1]);
}

static mhe_status pendulum_rate(const mhe_system *system, const double *e, const double *a,
                                double *rate, double *rate_e, double *rate_a, mhe_error *err) {
    (void)system, (void)err;
    for (int i = 0; i < M; i++) {
        const double b = 0.1, up = 1 / 0.010, down = 1 / 0.040;
        double d = e[i] - a[i], th = tanh(b * d), f = 0.5 * th, z = 0.5 + 1.5 * a[i];
        double f_d = 0.5 * b * (1 - th * th);
        double speed = (0.5 + f) * up / z + (0.5 - f) * down * z;
        double by_d = speed + d * f_d * (up / z - down * z);
        rate[i] = speed * d;
        if (rate_e != NULL) {
            rate_e[i] = by_d;
        }
        if (rate_a != NULL) {
            rate_a[i] = -by_d + 1.5 * d * ((0.5 - f) * down - (0.5 + f) * up / (z * z));
        }
    }
    return MHE_OK;
}

void test_pendulum_system(int32_t flags, mhe_system *out) {
    *out = (mhe_system){.acceleration = pendulum_acceleration, .activation_rate = pendulum_rate};
    shape(flags, out);
}

/* ---- linear ---- */

static const double stiff[Q][Q] = {{90, -20}, {-30, 160}}, damp[Q][Q] = {{6, 1}, {-2, 9}};
static const double gain[Q][M] = {{50, -30, 10}, {5, 40, -60}};
static const double tau[M] = {0.009, 0.018, 0.05};

static mhe_status linear_acceleration(const mhe_system *system, void *context,
                                      const mhe_system_point *at, const mhe_acceleration *out,
                                      mhe_error *err) {
    const double *q = at->q, *v = at->v, *a = at->a, *r = at->r;
    (void)context, (void)err;
    for (int i = 0; i < Q; i++) {
        out->vdot[i] = system->n_r > 0 ? r[i] : 0;
        for (int j = 0; j < Q; j++) {
            out->vdot[i] -= stiff[i][j] * q[j] + damp[i][j] * v[j];
            if (out->vdot_q != NULL) {
                out->vdot_q[i * Q + j] = -stiff[i][j];
            }
            if (out->vdot_v != NULL) {
                out->vdot_v[i * Q + j] = -damp[i][j];
            }
            if (out->vdot_r != NULL) {
                out->vdot_r[i * Q + j] = i == j;
            }
        }
        for (int m = 0; m < M; m++) {
            out->vdot[i] += gain[i][m] * a[m];
            if (out->vdot_a != NULL) {
                out->vdot_a[i * M + m] = gain[i][m];
            }
        }
    }
    return MHE_OK;
}

static mhe_status linear_rate(const mhe_system *system, const double *e, const double *a,
                              double *rate, double *rate_e, double *rate_a, mhe_error *err) {
    (void)system, (void)err;
    for (int i = 0; i < M; i++) {
        rate[i] = (e[i] - a[i]) / tau[i];
        if (rate_e != NULL) {
            rate_e[i] = 1 / tau[i];
        }
        if (rate_a != NULL) {
            rate_a[i] = -1 / tau[i];
        }
    }
    return MHE_OK;
}

void test_linear_system(int32_t flags, mhe_system *out) {
    *out = (mhe_system){.acceleration = linear_acceleration, .activation_rate = linear_rate};
    shape(flags, out);
}

void test_linear_matrix(const mhe_system *system, double *out) {
    int32_t n_x = system->n_x, n = n_x + system->n_u;
    memset(out, 0, sizeof(double) * (size_t)(n_x * n));
    for (int i = 0; i < Q; i++) {
        double *rate = out + (Q + i) * n;
        out[i * n + Q + i] = 1;
        for (int j = 0; j < Q; j++) {
            rate[j] = -stiff[i][j];
            rate[Q + j] = -damp[i][j];
        }
        memcpy(rate + 2 * Q, gain[i], sizeof gain[i]); /* states or controls: the next columns */
        if (system->n_r > 0) {
            rate[n_x + M + i] = 1;
        }
    }
    for (int i = 0; i < system->n_d; i++) {
        out[(2 * Q + i) * n + 2 * Q + i] = -1 / tau[i];
        out[(2 * Q + i) * n + n_x + i] = 1 / tau[i];
    }
}

/* ---- integrators ---- */

struct test_integrator test_integrator_open(const char *id, const char *yaml,
                                            const mhe_system *system, void *system_context) {
    const mhe_plugin *plugin = test_plugin(id, MHE_INTEGRATOR_IFACE);
    struct test_integrator integrator = {.system = system};
    mhe_error err = {0};
    if (plugin == NULL) {
        return integrator;
    }
    integrator.ops = plugin->ops;
    if (integrator.ops->create(test_host(), system, test_config(plugin, yaml), &integrator.self,
                               &err) != MHE_OK ||
        integrator.ops->context_create(integrator.self, system_context, &integrator.context,
                                       &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    return integrator;
}

void test_integrator_close(struct test_integrator *integrator) {
    if (integrator->ops != NULL) {
        integrator->ops->context_destroy(integrator->context);
        integrator->ops->destroy(integrator->self);
    }
}

void test_integrate(const struct test_integrator *integrator, const double *x, const double *u,
                    double dt, double *x_next, double *A, double *B) {
    mhe_error err = {0};
    const mhe_step_derivatives out = {.size = sizeof out, .A = A, .B = B};
    if (integrator->ops->step(integrator->context, x, u, NULL, dt, NULL, x_next, &out, &err) !=
        MHE_OK) {
        fail_msg("%s", err.text);
    }
}

double test_relative(const double *value, const double *expected, int32_t n) {
    double worst = 0;
    for (int32_t i = 0; i < n; i++) {
        double error = fabs(value[i] - expected[i]) / fmax(1, fabs(expected[i]));
        worst = error <= worst ? worst : error;
    }
    return worst;
}

struct step_data {
    const struct test_integrator *integrator;
    double dt;
};

static int step_of(void *data, const double *xu, double *y) {
    const struct step_data *d = data;
    const struct test_integrator *i = d->integrator;
    return i->ops->step(i->context, xu, xu + i->system->n_x, NULL, d->dt, NULL, y, NULL, NULL);
}

double test_step_derivatives(const struct test_integrator *integrator, const double *x,
                             const double *u, double dt) {
    int32_t n_x = integrator->system->n_x, n_u = integrator->system->n_u, n = n_x + n_u;
    double *memory = calloc((size_t)(n + n_x + 2 * n_x * n), sizeof(double));
    assert_non_null(memory);
    double *xu = memory, *next = xu + n, *A = next + n_x, *B = A + n_x * n_x, *J = B + n_x * n_u;
    memcpy(xu, x, sizeof(double) * (size_t)n_x);
    memcpy(xu + n_x, u, sizeof(double) * (size_t)n_u);
    test_integrate(integrator, x, u, dt, next, A, B);
    for (int32_t i = 0; i < n_x; i++) {
        memcpy(J + i * n, A + i * n_x, sizeof(double) * (size_t)n_x);
        memcpy(J + i * n + n_x, B + i * n_u, sizeof(double) * (size_t)n_u);
    }
    struct step_data data = {integrator, dt};
    double error = test_jacobian_error(step_of, &data, xu, n, n_x, J);
    free(memory);
    return error;
}

void test_pendulum_state(uint64_t *seed, const mhe_system *system, double *x, double *u) {
    for (int32_t i = 0; i < system->n_x; i++) {
        x[i] = i < 4 ? test_random(seed, -1.2, 1.2) * (i < 2 ? 1 : 4) : test_random(seed, 0, 1);
    }
    for (int32_t i = 0; i < system->n_u; i++) {
        u[i] = i < SYSTEM_M ? test_random(seed, 0, 1) : test_random(seed, -3, 3);
    }
}

void test_derivatives_of_steps(const char *id, const char *const *configs, size_t n_configs,
                               int n_trials, double shortest, double longest, double most) {
    uint64_t seed = 5;
    double worst = 0;
    for (int32_t flags = 0; flags < SYSTEM_N_FLAGS; flags++) {
        mhe_system system;
        test_pendulum_system(flags, &system);
        for (size_t k = 0; k < n_configs; k++) {
            struct test_integrator one = test_integrator_open(id, configs[k], &system, NULL);
            for (int trial = 0; trial < n_trials; trial++) {
                double x[SYSTEM_X], u[SYSTEM_U];
                test_pendulum_state(&seed, &system, x, u);
                const double dt = test_random(&seed, shortest, longest);
                const double error = test_step_derivatives(&one, x, u, dt);
                assert_true(error >= 0);
                worst = fmax(worst, error);
            }
            test_integrator_close(&one);
        }
    }
    print_message("A, B against differences: %.1e\n", worst);
    assert_true(worst < most);
}

/* ---- a system that answers badly ---- */

static mhe_system inner;

static mhe_status domain_acceleration(const mhe_system *system, void *context,
                                      const mhe_system_point *at, const mhe_acceleration *out,
                                      mhe_error *err) {
    (void)system;
    if (at->q[0] > 100) {
        return mhe_fail(err, MHE_E_NUMERIC, "stop");
    }
    if (at->q[0] > 10) {
        return mhe_fail(err, MHE_RETRY, "outside");
    }
    return inner.acceleration(&inner, context, at, out, err);
}

void test_integrator_meets_bad_points(const char *plugin) {
    test_pendulum_system(SYSTEM_EXCITATION, &inner);
    mhe_system system = inner;
    system.acceleration = domain_acceleration;
    struct test_integrator flow = test_integrator_open(plugin, "", &system, NULL);
    double x[SYSTEM_X] = {11, 0, 0, 0, 0.5, 0.5, 0.5}, u[SYSTEM_M] = {0, 0, 0}, next[SYSTEM_X];
    mhe_error err = {0};
    assert_int_equal(flow.ops->step(flow.context, x, u, NULL, 0.03, NULL, next, NULL, &err),
                     MHE_RETRY);
    assert_string_equal(err.text, "outside");
    x[0] = 101;
    assert_int_equal(flow.ops->step(flow.context, x, u, NULL, 0.03, NULL, next, NULL, &err),
                     MHE_E_NUMERIC);
    const double bad[] = {NAN, INFINITY};
    for (int i = 0; i < SYSTEM_X; i++) {
        for (int k = 0; k < 2; k++) {
            double y[SYSTEM_X] = {0, 0, 0, 0, 0.5, 0.5, 0.5};
            y[i] = bad[k];
            assert_true(flow.ops->step(flow.context, y, u, NULL, 0.03, NULL, next, NULL, &err) !=
                        MHE_OK);
        }
    }
    x[0] = 0; /* and it goes on */
    test_integrate(&flow, x, u, 0.03, next, NULL, NULL);
    test_integrator_close(&flow);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* toy_models.c: the pendulum and the arm-sized toy. */
#include "toy.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void pendulum_rate(const toy *t, const double *x, const double *u, double *f, double *fx,
                          double *fu) {
    (void)t;
    f[0] = x[1];
    f[1] = -9.81 * sin(x[0]) - 0.1 * x[1] + u[0];
    fx[1] = 1;
    fx[2] = -9.81 * cos(x[0]);
    fx[3] = -0.1;
    fu[1] = 1;
}

static void pendulum_residual(const toy *t, int k, const double *x, const double *u, double *r,
                              double *w, double *rx, double *ru) {
    (void)t, (void)k;
    r[0] = x[0] - acos(-1);
    r[1] = x[1];
    w[0] = u != NULL ? 1 : 100;
    w[1] = u != NULL ? 0.1 : 10;
    rx[0] = rx[3] = 1;
    if (u != NULL) {
        r[2] = u[0];
        w[2] = 0.01;
        ru[2] = 1;
    }
}

void toy_pendulum(toy *t, int n_intervals) {
    toy_init(t, n_intervals, 2, 1, 2.0 / n_intervals, 4, pendulum_rate, pendulum_residual, 3, 2);
    for (int k = 0; k < n_intervals; k++) {
        *toy_u_lower(t, k) = -8;
        *toy_u_upper(t, k) = 8;
    }
    for (int i = 0; i < 2; i++) { /* hangs at rest */
        toy_x_lower(t, 0)[i] = toy_x_upper(t, 0)[i] = 0;
    }
}

enum { N_Q = 4, N_M = 19, N_MARKER = 8 };

/* Made-up, fixed numbers in [-1, 1]. */
static double number(int i, int j) {
    return sin(1 + 37 * i * i + 91 * j * j + 13 * i * j);
}

static void arm_rate(const toy *t, const double *x, const double *u, double *f, double *fx,
                     double *fu) {
    (void)t;
    const double *q = x, *v = x + N_Q, *a = x + 2 * N_Q;
    for (int i = 0; i < N_Q; i++) {
        double *row = fx + (N_Q + i) * TOY_ARM_X, *f_v = f + N_Q + i;
        f[i] = v[i];
        fx[i * TOY_ARM_X + N_Q + i] = 1;
        *f_v = -20 * sin(q[i]) - 3 * v[i];
        row[i] = -20 * cos(q[i]);
        row[N_Q + i] = -3;
        for (int m = 0; m < N_M; m++) { /* moment arm x force-length x force-velocity */
            double arm = 8 * number(i, m) * cos(q[i] + m),
                   arm_q = -8 * number(i, m) * sin(q[i] + m);
            double shape = tanh(number(m, i) * v[i] / 10),
                   slope = (1 - shape * shape) * number(m, i) / 10;
            *f_v += arm * a[m] * (1 - 0.5 * shape);
            row[i] += arm_q * a[m] * (1 - 0.5 * shape);
            row[N_Q + i] -= arm * a[m] * 0.5 * slope;
            row[2 * N_Q + m] = arm * (1 - 0.5 * shape);
        }
    }
    for (int m = 0; m < N_M; m++) { /* faster up than down */
        int i = 2 * N_Q + m;
        double up = 0.5 + 0.5 * tanh(10 * (u[m] - a[m])), up_e = 5 * (1 - pow(2 * up - 1, 2));
        double rate = 25 + 50 * up;
        f[i] = rate * (u[m] - a[m]);
        fu[i * TOY_ARM_U + m] = rate + 50 * up_e * (u[m] - a[m]);
        fx[i * TOY_ARM_X + i] = -fu[i * TOY_ARM_U + m];
    }
}

/* Marker i: a point of a crooked linkage; coordinate d. */
static double marker(int i, const double *q, double *by_q) {
    double angle = 0, length = 0.2 + 0.05 * (i / 3);
    for (int j = 0; j < N_Q; j++) {
        angle += number(i, j + 40) * q[j];
    }
    double phase = angle + 1.3 * (i % 3);
    for (int j = 0; by_q != NULL && j < N_Q; j++) {
        by_q[j] = length * cos(phase) * number(i, j + 40);
    }
    return length * sin(phase);
}

static void arm_excitations(double time, double *u) {
    for (int m = 0; m < N_M; m++) {
        double wave = 0.2 + 0.25 * sin(2 * acos(-1) * time * (0.5 + 0.03 * m) + m);
        u[m] = wave > 0.01 ? wave : 0.01;
    }
}

/* Weights of the EMG-markers cost: markers 1e9, excitations 1e6, q 1, qdot 10, a 1. */
static void arm_residual(const toy *t, int k, const double *x, const double *u, double *r,
                         double *w, double *rx, double *ru) {
    const double *target = t->target + k * TOY_ARM_TARGET;
    double length = u != NULL ? t->dt : 1;
    int n = 0;
    for (int i = 0; i < 3 * N_MARKER; i++, n++) {
        w[n] = 1e9 * length;
        r[n] = marker(i, x, rx + n * TOY_ARM_X) - target[i];
    }
    for (int i = 0; i < TOY_ARM_X; i++, n++) {
        w[n] = length * (i < N_Q || i >= 2 * N_Q ? 1 : 10);
        r[n] = x[i];
        rx[n * TOY_ARM_X + i] = 1;
    }
    for (int m = 0; u != NULL && m < N_M; m++, n++) {
        w[n] = 1e6 * length;
        r[n] = u[m] - target[3 * N_MARKER + m];
        ru[n * TOY_ARM_U + m] = 1;
    }
}

/* Patterns as an estimator knows them: activations are scalar equations of their own. */
static void arm_patterns(toy *t) {
    enum { N_X = TOY_ARM_X, N_U = TOY_ARM_U };
    uint8_t *A = t->pattern = realloc(t->pattern, 2 * N_X * N_X + 2 * N_X * N_U + N_U * N_U);
    if (A == NULL) {
        abort();
    }
    uint8_t *B = A + N_X * N_X, *xx = B + N_X * N_U, *ux = xx + N_X * N_X, *uu = ux + N_U * N_X;
    for (int i = 0; i < N_X; i++) {
        for (int j = 0; j < N_X; j++) {
            A[i * N_X + j] = i < 2 * N_Q || i == j;
            xx[i * N_X + j] = (i < N_Q && j < N_Q) || i == j;
        }
        for (int j = 0; j < N_U; j++) {
            B[i * N_U + j] = i < 2 * N_Q || i - 2 * N_Q == j;
            ux[j * N_X + i] = 0;
        }
    }
    for (int i = 0; i < N_U * N_U; i++) {
        uu[i] = i % (N_U + 1) == 0;
    }
    t->problem.A_pattern = A;
    t->problem.B_pattern = B;
    t->problem.xx_pattern = xx;
    t->problem.ux_pattern = ux;
    t->problem.uu_pattern = uu;
}

void toy_arm(toy *t, int n_intervals, double dt) {
    toy_init(t, n_intervals, TOY_ARM_X, TOY_ARM_U, dt, 5, arm_rate, arm_residual,
             3 * N_MARKER + TOY_ARM_X + TOY_ARM_U, 3 * N_MARKER + TOY_ARM_X);
    arm_patterns(t);
    for (int k = 0; k <= n_intervals; k++) {
        for (int i = 0; i < TOY_ARM_X; i++) {
            double limit = i < N_Q ? 2.5 : 31.4;
            toy_x_lower(t, k)[i] = i < 2 * N_Q ? -limit : 0;
            toy_x_upper(t, k)[i] = i < 2 * N_Q ? limit : 1;
        }
        for (int m = 0; k < n_intervals && m < N_M; m++) {
            toy_u_lower(t, k)[m] = 0;
            toy_u_upper(t, k)[m] = 1;
        }
    }
}

void toy_arm_motion(const toy *t, int n, double *x, double *target) {
    for (int k = 0; k < n; k++, x += TOY_ARM_X, target += TOY_ARM_TARGET) {
        double *u = target + TOY_ARM_TARGET - TOY_ARM_U;
        for (int i = 0; i < 3 * N_MARKER; i++) {
            target[i] = marker(i, x, NULL);
        }
        arm_excitations(k * t->dt, u);
        toy_step(t, x, u, x + TOY_ARM_X, NULL, NULL);
    }
}

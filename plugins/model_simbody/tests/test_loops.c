/* SPDX-License-Identifier: Apache-2.0 */
/* Loops: gaps, rates and accelerations against differences, and against Simbody's constraints. */
#include "test_models.h"
#include "vector.h"

#include <math.h>
#include <string.h>

#define MAX_Q 6
#define MAX_B 16
#define N_C 9 /* a point and a weld */
#define LIMIT 1e-6

static mhe_loop pair[2];

/* The tangle with the end of one branch pinned to that of another and, at the posture `q`, closed;
 * then a frame of the last body welded to ground. */
static mhe_description closed_tangle(const double *q) {
    mhe_description d = *test_tangle();
    const int32_t last = d.n_bodies - 1, other = d.n_bodies / 2;
    static const double zero[MAX_Q];
    double body[12 * MAX_B];
    test_instance t;
    assert_true(d.n_bodies <= MAX_B);
    test_open(&t, test_tangle(), SIMBODY_DYNAMICS_RECURSIVE);
    mhe_kinematics out = {.size = sizeof out, .body = body};
    assert_int_equal(t.ops->kinematics(t.context, q, zero, &out, NULL), MHE_OK);
    test_close(&t);
    const int32_t bodies[2][2] = {{other, last}, {-1, last}};
    for (int i = 0; i < 2; i++) {
        mhe_loop *loop = &pair[i];
        *loop = (mhe_loop){.name = i == 0 ? "pin" : "weld",
                           .kind = i == 0 ? MHE_LOOP_POINT : MHE_LOOP_WELD,
                           .body = {bodies[i][0], bodies[i][1]},
                           .r = {{0.36, 0.48, -0.8, -0.8, 0.6, 0, 0.48, 0.64, 0.6}},
                           .p = {{0.03, -0.05, 0.11}}};
        static const double ground[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
        const double *one = loop->body[0] < 0 ? ground : body + 12 * loop->body[0];
        const double *two = body + 12 * loop->body[1];
        double r[9], p[3];
        multiply3(one + 3, loop->r[0], r);
        place3(one + 3, one, loop->p[0], p);
        for (int row = 0; row < 3; row++) { /* into body 2: its rotation transposed */
            loop->p[1][row] = 0;
            for (int k = 0; k < 3; k++) {
                loop->p[1][row] += two[3 + 3 * k + row] * (p[k] - two[k]);
                loop->r[1][3 * row + k] =
                    two[3 + row] * r[k] + two[6 + row] * r[3 + k] + two[9 + row] * r[6 + k];
            }
        }
    }
    d.n_loops = 2;
    d.loops = pair;
    return d;
}

typedef struct probe {
    test_instance *t;
    const double *q, *v, *vdot;
} probe;

static int values(const probe *p, const double *q, const double *v, mhe_loop_values *out) {
    const mhe_kinematics none = {.size = sizeof none};
    out->size = sizeof *out;
    int status = p->t->ops->kinematics(p->t->context, q, v, &none, NULL);
    return status != 0 ? status : p->t->ops->loops(p->t->context, p->vdot, out, NULL);
}

static int gap_of_q(void *data, const double *q, double *y) {
    return values(data, q, ((probe *)data)->v, &(mhe_loop_values){.gap = y});
}
static int rate_of_q(void *data, const double *q, double *y) {
    return values(data, q, ((probe *)data)->v, &(mhe_loop_values){.rate = y});
}
static int rate_of_v(void *data, const double *v, double *y) {
    return values(data, ((probe *)data)->q, v, &(mhe_loop_values){.rate = y});
}
static int acceleration_of_q(void *data, const double *q, double *y) {
    return values(data, q, ((probe *)data)->v, &(mhe_loop_values){.acceleration = y});
}
static int acceleration_of_v(void *data, const double *v, double *y) {
    return values(data, ((probe *)data)->q, v, &(mhe_loop_values){.acceleration = y});
}

static double worst[5];

static void check(int what, test_function f, probe *p, const double *x, const double *jacobian) {
    static const char *const names[] = {"gap_q", "rate_q", "rate_v", "acceleration_q",
                                        "acceleration_v"};
    const double error = test_jacobian_error(f, p, x, p->t->n_q, N_C, jacobian);
    if (!(error >= 0 && error < LIMIT)) {
        fail_msg("%s: relative error %g", names[what], error);
    }
    worst[what] = fmax(worst[what], error);
}

static void random_state(uint64_t *seed, int i, double *q, double *v, double *vdot) {
    double unused[MAX_Q];
    test_tangle_state(seed, q, v);
    test_tangle_state(seed, vdot, unused);
    /* away from the spline's knots, where its third derivative jumps */
    q[2] = (double[]){-0.8, 0.1, 0.9}[i % 3] + test_random(seed, -0.2, 0.2);
}

/* Anywhere, closed or not. */
static void derivatives_are_exact(void **state) {
    (void)state;
    uint64_t seed = 21;
    double q[MAX_Q], v[MAX_Q], vdot[MAX_Q];
    random_state(&seed, 0, q, v, vdot);
    const mhe_description d = closed_tangle(q);
    test_instance t;
    assert_int_equal(mhe_loop_rows(&d), N_C);
    test_open(&t, &d, SIMBODY_DYNAMICS_RECURSIVE);
    for (int i = 0; i < 20; i++) {
        double gap_q[N_C * MAX_Q], rate_q[N_C * MAX_Q], rate_v[N_C * MAX_Q];
        double by_q[N_C * MAX_Q], by_v[N_C * MAX_Q];
        random_state(&seed, i, q, v, vdot);
        probe p = {&t, q, v, vdot};
        mhe_loop_values out = {.gap_q = gap_q,
                               .rate_q = rate_q,
                               .rate_v = rate_v,
                               .acceleration_q = by_q,
                               .acceleration_v = by_v};
        assert_int_equal(values(&p, q, v, &out), MHE_OK);
        check(0, gap_of_q, &p, q, gap_q);
        check(1, rate_of_q, &p, q, rate_q);
        check(2, rate_of_v, &p, v, rate_v);
        check(3, acceleration_of_q, &p, q, by_q);
        check(4, acceleration_of_v, &p, v, by_v);
    }
    test_close(&t);
    print_message("gap_q %.1e, rate_q %.1e, rate_v %.1e, acceleration_q %.1e, acceleration_v "
                  "%.1e\n",
                  worst[0], worst[1], worst[2], worst[3], worst[4]);
}

/* d rate/dt along the motion q + v s + vdot s^2 / 2, by a fourth-order difference. */
static void acceleration_is_the_rate_of_the_rate(void **state) {
    (void)state;
    uint64_t seed = 22;
    double q[MAX_Q], v[MAX_Q], vdot[MAX_Q], rate[4][N_C], acceleration[N_C];
    random_state(&seed, 1, q, v, vdot);
    const mhe_description d = closed_tangle(q);
    test_instance t;
    test_open(&t, &d, SIMBODY_DYNAMICS_RECURSIVE);
    random_state(&seed, 1, q, v, vdot);
    const double h = 1e-3, steps[4] = {-2 * h, -h, h, 2 * h};
    for (int k = 0; k < 4; k++) {
        double at[MAX_Q], speed[MAX_Q];
        for (int i = 0; i < t.n_q; i++) {
            at[i] = q[i] + v[i] * steps[k] + 0.5 * vdot[i] * steps[k] * steps[k];
            speed[i] = v[i] + vdot[i] * steps[k];
        }
        const probe p = {&t, at, speed, vdot};
        assert_int_equal(values(&p, at, speed, &(mhe_loop_values){.rate = rate[k]}), MHE_OK);
    }
    const probe p = {&t, q, v, vdot};
    assert_int_equal(values(&p, q, v, &(mhe_loop_values){.acceleration = acceleration}), MHE_OK);
    for (int i = 0; i < N_C; i++) {
        const double expected =
            (rate[0][i] - 8 * rate[1][i] + 8 * rate[2][i] - rate[3][i]) / (12 * h);
        assert_true(fabs(acceleration[i] - expected) < 1e-6 * (1 + fabs(expected)));
    }
    test_close(&t);
}

/* The force that closes a loop does the work that the loop's rate takes from it: rate_v^T lambda is
 * what loads on the two bodies do. */
static void forces_on_loops_are_loads(void **state) {
    (void)state;
    uint64_t seed = 23;
    double q[MAX_Q], v[MAX_Q], vdot[MAX_Q], rate_v[N_C * MAX_Q], lambda[N_C];
    random_state(&seed, 2, q, v, vdot);
    const mhe_description d = closed_tangle(q);
    test_instance t;
    test_open(&t, &d, SIMBODY_DYNAMICS_RECURSIVE);
    random_state(&seed, 2, q, v, vdot);
    const probe p = {&t, q, v, vdot};
    assert_int_equal(values(&p, q, v, &(mhe_loop_values){.rate_v = rate_v}), MHE_OK);
    double tau[MAX_Q] = {0};
    for (int i = 0; i < N_C; i++) {
        lambda[i] = test_random(&seed, -10, 10);
    }
    for (int i = 0; i < 2; i++) {
        for (int k = 0; k < 2; k++) {
            const mhe_load load = {pair[i].body[k], -1, pair[i].body[k]};
            double value[9] = {0};
            for (int j = 0; j < 3; j++) {
                value[j] = (k == 0 ? -1 : 1) * lambda[3 * i + j];
                value[3 + j] = pair[i].p[k][j];
                value[6 + j] = i == 0 ? 0 : (k == 0 ? -1 : 1) * lambda[6 + j];
            }
            if (load.body >= 0) {
                assert_int_equal(t.ops->loads(t.context, &load, 1, value, tau, NULL, NULL, NULL),
                                 MHE_OK);
            }
        }
    }
    for (int j = 0; j < t.n_q; j++) {
        double sum = 0;
        for (int i = 0; i < N_C; i++) {
            sum += rate_v[i * t.n_q + j] * lambda[i];
        }
        assert_true(fabs(sum - tau[j]) < 1e-12 * (1 + fabs(tau[j])));
    }
    test_close(&t);
}

/* The part of v that opens no loop: v - G^T (G G^T)^-1 G v, by Gram and Schmidt on the rows. */
static void project(const double *rows, int n_c, int n, double *v) {
    double basis[N_C][MAX_Q];
    int n_basis = 0;
    for (int i = 0; i < n_c; i++) {
        double *b = basis[n_basis], length = 0;
        memcpy(b, rows + i * n, sizeof *b * (size_t)n);
        for (int twice = 0; twice < 2; twice++) {
            for (int k = 0; k < n_basis; k++) {
                double dot = 0;
                for (int j = 0; j < n; j++) {
                    dot += b[j] * basis[k][j];
                }
                for (int j = 0; j < n; j++) {
                    b[j] -= dot * basis[k][j];
                }
            }
        }
        for (int j = 0; j < n; j++) {
            length += b[j] * b[j];
        }
        if (length < 1e-16) {
            continue;
        }
        for (int j = 0; j < n; j++) {
            b[j] /= sqrt(length);
        }
        n_basis++;
    }
    for (int k = 0; k < n_basis; k++) {
        double dot = 0;
        for (int j = 0; j < n; j++) {
            dot += v[j] * basis[k][j];
        }
        for (int j = 0; j < n; j++) {
            v[j] -= dot * basis[k][j];
        }
    }
}

/* Where the loops are closed: at the posture that they were made at, moving so that they stay so.
 * Point and weld, each by itself: together they leave the tangle no motion. */
static void simbody_says_the_same(void **state) {
    (void)state;
    uint64_t seed = 24;
    double off = 0;
    for (int i = 0; i < 20; i++) {
        double q[MAX_Q], v[MAX_Q], vdot[MAX_Q], rate_v[N_C * MAX_Q];
        double own[3][N_C], simbody[3][N_C];
        random_state(&seed, i, q, v, vdot);
        mhe_description d = closed_tangle(q);
        d.loops = &pair[i % 2];
        d.n_loops = 1;
        const int n_c = mhe_loop_rows(&d);
        test_instance t[2];
        for (int32_t k = 0; k < 2; k++) {
            test_open(&t[k], &d, k);
        }
        const probe p = {&t[0], q, v, vdot}, ps = {&t[1], q, v, vdot};
        assert_int_equal(values(&p, q, v, &(mhe_loop_values){.rate_v = rate_v}), MHE_OK);
        for (int open = 1; open >= 0; open--) {
            if (!open) {
                project(rate_v, n_c, t[0].n_q, v);
            }
            mhe_loop_values out = {.gap = own[0], .rate = own[1], .acceleration = own[2]};
            assert_int_equal(values(&p, q, v, &out), MHE_OK);
            out = (mhe_loop_values){
                .gap = simbody[0], .rate = simbody[1], .acceleration = simbody[2]};
            assert_int_equal(values(&ps, q, v, &out), MHE_OK);
            for (int k = 0; k < (open ? 2 : 3); k++) {
                for (int j = 0; j < n_c; j++) {
                    const double error = fabs(own[k][j] - simbody[k][j]) / (1 + fabs(own[k][j]));
                    if (!(error < 1e-11)) {
                        fail_msg("%s, value %d, row %d: %g, Simbody %g", d.loops->name, k, j,
                                 own[k][j], simbody[k][j]);
                    }
                    off = fmax(off, error);
                }
            }
        }
        test_close(&t[0]);
        test_close(&t[1]);
    }
    print_message("Simbody's constraints: %.1e\n", off);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(derivatives_are_exact),
        cmocka_unit_test(acceleration_is_the_rate_of_the_rate),
        cmocka_unit_test(forces_on_loops_are_loads),
        cmocka_unit_test(simbody_says_the_same),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* The feedback along a motion: known scalar solution, optimality, failure. */
#include "control/feedback.h"
#include "support.h"

#include <math.h>

/* x' = a x + b u for ever: the gain of the algebraic Riccati equation. */
static void test_scalar(void **state) {
    (void)state;
    enum { N = 200 };
    const double a = 1.1, b = 0.5, q = 1, r = 2;
    double A[N], B[N], R[N], gain[N], p = q;
    for (int k = 0; k < N; k++) {
        A[k] = a;
        B[k] = b;
        R[k] = r;
    }
    const mhi_feedback_setup setup = {N, 1, 1, A, B, &q, R};
    assert_int_equal(mhi_feedback_gains(&setup, gain, NULL), MHE_OK);
    for (int i = 0; i < 1000; i++) {
        p = q + a * a * p - a * a * b * b * p * p / (r + b * b * p);
    }
    assert_true(fabs(gain[0] - a * b * p / (r + b * b * p)) < 1e-12);
    assert_true(fabs(a - b * gain[0]) < 1); /* stable, although a alone is not */
}

enum { STEPS = 12, NX = 5, NU = 2 };

typedef struct plant {
    double A[STEPS * NX * NX], B[STEPS * NX * NU], R[STEPS * NU], Q[NX];
    double gain[STEPS * NU * NX];
} plant;

static void make(plant *p, uint64_t seed) {
    for (int i = 0; i < STEPS * NX * NX; i++) {
        p->A[i] = test_random(&seed, -0.8, 0.8);
    }
    for (int i = 0; i < STEPS * NX * NU; i++) {
        p->B[i] = test_random(&seed, -1, 1);
    }
    for (int i = 0; i < STEPS * NU; i++) {
        p->R[i] = test_random(&seed, 0.1, 10);
    }
    for (int i = 0; i < NX; i++) {
        p->Q[i] = test_random(&seed, 0, 2);
    }
    const mhi_feedback_setup setup = {STEPS, NX, NU, p->A, p->B, p->Q, p->R};
    assert_int_equal(mhi_feedback_gains(&setup, p->gain, NULL), MHE_OK);
}

/* Cost of a start under gains. */
static double cost(const plant *p, const double *gain, const double *start) {
    const double track[NX] = {0};
    double x[NX], next[NX], sum = 0;
    for (int i = 0; i < NX; i++) {
        x[i] = start[i];
    }
    for (int k = 0; k <= STEPS; k++) {
        double u[NU] = {0};
        for (int i = 0; i < NX; i++) {
            sum += p->Q[i] * x[i] * x[i];
        }
        if (k == STEPS) {
            break;
        }
        mhi_feedback_apply(gain + k * NU * NX, NX, NU, x, track, u);
        for (int i = 0; i < NX; i++) {
            next[i] = 0;
            for (int j = 0; j < NX; j++) {
                next[i] += p->A[(k * NX + i) * NX + j] * x[j];
            }
            for (int j = 0; j < NU; j++) {
                next[i] += p->B[(k * NX + i) * NU + j] * u[j];
            }
        }
        for (int i = 0; i < NU; i++) {
            sum += p->R[k * NU + i] * u[i] * u[i];
        }
        for (int i = 0; i < NX; i++) {
            x[i] = next[i];
        }
    }
    return sum;
}

/* Every other gain costs more. */
static void test_optimal(void **state) {
    (void)state;
    plant p;
    make(&p, 3);
    uint64_t seed = 4;
    for (int trial = 0; trial < 50; trial++) {
        double start[NX], other[STEPS * NU * NX];
        for (int i = 0; i < NX; i++) {
            start[i] = test_random(&seed, -1, 1);
        }
        for (int i = 0; i < STEPS * NU * NX; i++) {
            other[i] = p.gain[i] + test_random(&seed, -0.01, 0.01);
        }
        assert_true(cost(&p, other, start) > cost(&p, p.gain, start));
    }
}

static void test_not_finite(void **state) {
    (void)state;
    const double good = 0.5, bad = NAN;
    for (int broken = 0; broken < 4; broken++) { /* A, B, Q, R */
        double gain[1];
        mhe_error err = {0};
        const mhi_feedback_setup setup = {1,
                                          1,
                                          1,
                                          broken == 0 ? &bad : &good,
                                          broken == 1 ? &bad : &good,
                                          broken == 2 ? &bad : &good,
                                          broken == 3 ? &bad : &good};
        assert_int_equal(mhi_feedback_gains(&setup, gain, &err), MHE_E_NUMERIC);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_scalar),
                                       cmocka_unit_test(test_optimal),
                                       cmocka_unit_test(test_not_finite)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

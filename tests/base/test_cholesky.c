/* SPDX-License-Identifier: Apache-2.0 */
/* A = L L^T, of the sizes that go by single sums and those that go by vectors. */
#include "base/cholesky.h"
#include "support.h"

#include <math.h>
#include <string.h>

#define MOST 131

/* B^T B + I: positive definite, nothing in it repeats. */
static void fill(double *A, int32_t n, uint64_t seed) {
    static double B[MOST * MOST];
    for (int32_t i = 0; i < n * n; i++) {
        B[i] = test_random(&seed, -1, 1);
    }
    for (int32_t i = 0; i < n; i++) {
        for (int32_t j = 0; j < n; j++) {
            A[i * n + j] = i == j;
            for (int32_t k = 0; k < n; k++) {
                A[i * n + j] += B[k * n + i] * B[k * n + j];
            }
        }
    }
}

/* Row i of L, whose diagonal holds reciprocals, times row j. */
static double product(const double *L, int32_t n, int32_t i, int32_t j) {
    double sum = 0;
    for (int32_t k = 0; k <= (i < j ? i : j); k++) {
        const double a = k == i ? 1 / L[i * n + k] : L[i * n + k];
        sum += a * (k == j ? 1 / L[j * n + k] : L[j * n + k]);
    }
    return sum;
}

static void factors_and_solves(void **state) {
    static const int32_t sizes[] = {1, 4, 31, 63, 64, 65, 66, 67, 68, 98, 131};
    static double A[MOST * MOST], L[MOST * MOST], x[MOST];
    (void)state;
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        const int32_t n = sizes[s];
        fill(A, n, 7 + s);
        memcpy(L, A, sizeof A);
        assert_int_equal(mhi_cholesky_factor(L, n), 0);
        for (int32_t i = 0; i < n; i++) {
            x[i] = 0;
            for (int32_t j = 0; j < n; j++) {
                assert_true(fabs(product(L, n, i, j) - A[i * n + j]) < 1e-12 * n);
                x[i] += A[i * n + j] * (1 + j % 7);
            }
        }
        mhi_cholesky_solve(L, n, x, 1);
        for (int32_t i = 0; i < n; i++) {
            assert_true(fabs(x[i] - (1 + i % 7)) < 1e-10);
        }
    }
}

static void what_is_not_definite_is_told(void **state) {
    static double A[MOST * MOST];
    (void)state;
    for (int32_t n = 2; n <= MOST; n += 3) {
        fill(A, n, 3);
        for (int32_t j = 0; j < n; j++) { /* the last row repeats the first */
            A[(n - 1) * n + j] = A[j];
        }
        A[n * n - 1] = A[0] - 1e-3;
        assert_int_equal(mhi_cholesky_factor(A, n), -1);
        fill(A, n, 3);
        A[(n - 1) * n] = NAN;
        assert_int_equal(mhi_cholesky_factor(A, n), -1);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(factors_and_solves),
        cmocka_unit_test(what_is_not_definite_is_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

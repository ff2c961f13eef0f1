/* SPDX-License-Identifier: Apache-2.0 */
/* support.h: what several tests need: cmocka, reference data, derivative checks. */
#ifndef TEST_SUPPORT_H
#define TEST_SUPPORT_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
/* cmocka wants the four above first */
#include <cmocka.h>

#define TEST_SKIPPED 77

/* Path of a file of the reference data (below `data` of MHE_SHARED, or of ../shared beside the
 * source tree), in `out`; NULL where it is absent: the test should then return TEST_SKIPPED from
 * main or call skip(). */
const char *test_data_path(char *out, size_t size, const char *file);

/* A new folder of the test's own, below $TMPDIR or /tmp, in `out`, and what is in it; it is removed
 * when the process ends. NULL: it cannot be made. */
const char *test_folder(char *out, size_t size);

/* y = f(x) with n_x inputs and n_y outputs. */
typedef int (*test_function)(void *data, const double *x, double *y);

/* Largest difference between `jacobian` [n_y x n_x] and central differences of f at x, each entry
 * relative to max(|entry|, scale of its row), taken for the best of a range of steps (step study);
 * -1 where f fails. */
double test_jacobian_error(test_function f, void *data, const double *x, int n_x, int n_y,
                           const double *jacobian);

/* Uniform in [lower, upper], from a small generator of its own (splitmix64): same seed, same
 * numbers anywhere. */
double test_random(uint64_t *seed, double lower, double upper);

#endif

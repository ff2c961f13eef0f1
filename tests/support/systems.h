/* SPDX-License-Identifier: Apache-2.0 */
/* systems.h: small systems with closed-form accelerations, for tests of integrators. */
#ifndef TEST_SYSTEMS_H
#define TEST_SYSTEMS_H

#include "use.h"

#include <mhe/integrator.h>

#define SYSTEM_Q 2
#define SYSTEM_M 3
#define SYSTEM_X 7 /* at most */
#define SYSTEM_U 5 /* at most */

#define SYSTEM_EXCITATION 1 /* activations are states; else controls */
#define SYSTEM_RESIDUALS 2  /* residual torques are controls too */

/* Two links under gravity with three muscle-like actuators: force-length, force-velocity and the
 * De Groote activation dynamics. Angles from the horizontal. */
void test_pendulum_system(int32_t flags, mhe_system *out);
#define SYSTEM_N_FLAGS 4 /* all combinations of the two flags */
/* Angles, velocities, activations and controls anywhere they may be; u[0..SYSTEM_M) are muscles'.
 */
void test_pendulum_state(uint64_t *seed, const mhe_system *system, double *x, double *u);
double test_pendulum_energy(const double *q, const double *v);

/* vdot = -K q - D v + G a + r, adot = (e - a) / tau. */
void test_linear_system(int32_t flags, mhe_system *out);
/* Its right-hand side as a matrix [n_x x (n_x + n_u)], row-major. */
void test_linear_matrix(const mhe_system *system, double *out);

/* An integrator on a system: "mhe.integrator.rk" with "stages: 2". */
struct test_integrator {
    const mhe_integrator_ops *ops; /* NULL: the plugin was not built */
    void *self, *context;
    const mhe_system *system;
};
struct test_integrator test_integrator_open(const char *id, const char *yaml,
                                            const mhe_system *system, void *system_context);
void test_integrator_close(struct test_integrator *integrator);
/* Points where the system asks to retry or gives up, and such as are no numbers, are answered by
 * the status; the next good one is integrated. */
void test_integrator_meets_bad_points(const char *plugin);

/* x+ = F(x, u); fails the test unless the step is done. */
void test_integrate(const struct test_integrator *integrator, const double *x, const double *u,
                    double dt, double *x_next, double *A, double *B);

/* Largest difference over max(1, |expected|). */
double test_relative(const double *value, const double *expected, int32_t n);

/* Error of A and B against central differences of the step (test_jacobian_error). */
double test_step_derivatives(const struct test_integrator *integrator, const double *x,
                             const double *u, double dt);

/* The same of an integrator with each of its configurations on the pendulum of all flags, from
 * n_trials random states over steps of `shortest` to `longest` s; fails the test unless all are
 * below `most`. */
void test_derivatives_of_steps(const char *id, const char *const *configs, size_t n_configs,
                               int n_trials, double shortest, double longest, double most);

#endif

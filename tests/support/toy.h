/* SPDX-License-Identifier: Apache-2.0 */
/* toy.h: small stage problems with known structure, for tests of solvers.
 *
 * A toy is a differential equation with exact derivatives, integrated by RK4 with substeps, and
 * residuals with weights. */
#ifndef TOY_H
#define TOY_H

#include <mhe/solver.h>
#include <stdatomic.h>

#define TOY_MAX_X 32
#define TOY_MAX_U 24
#define TOY_MAX_R 128

typedef struct toy toy;

/* xdot = f(x, u), fx [n_x x n_x] and fu [n_x x n_u], zeroed before the call. */
typedef void (*toy_rate)(const toy *t, const double *x, const double *u, double *f, double *fx,
                         double *fu);
/* Residuals r at node k, weights w, Jacobians rx [n_r x n_x], ru [n_r x n_u] (zeroed before the
 * call); u is NULL at the last node, where n_r_last residuals are wanted. */
typedef void (*toy_residual)(const toy *t, int k, const double *x, const double *u, double *r,
                             double *w, double *rx, double *ru);

struct toy {
    mhe_stage_problem problem;
    toy_rate rate;
    toy_residual residual;
    int n_r, n_r_last;
    double dt; /* length of an interval */
    int substeps;
    double *bounds; /* memory of the four bound arrays */
    uint8_t *pattern;
    const double *target;       /* for the residuals */
    double retry_above;         /* MHE_RETRY where x[0] is above this */
    double nan_above;           /* cost NaN where x[0] is above this */
    mhe_status failure;         /* returned by every evaluation, if not MHE_OK */
    atomic_long evaluations;    /* of all stages */
    atomic_long linearisations; /* those with derivatives */
    atomic_long steps;          /* those of the dynamics */
    atomic_long retries;        /* evaluations that had no value */
};

/* Sets up sizes, infinite bounds and full patterns; free with toy_free. */
void toy_init(toy *t, int n_intervals, int n_x, int n_u, double dt, int substeps, toy_rate rate,
              toy_residual residual, int n_r, int n_r_last);
void toy_free(toy *t);

/* x_next after one interval, with A and B if not NULL. */
void toy_step(const toy *t, const double *x, const double *u, double *x_next, double *A, double *B);

/* Writable views of the bounds. */
double *toy_x_lower(toy *t, int k);
double *toy_x_upper(toy *t, int k);
double *toy_u_lower(toy *t, int k);
double *toy_u_upper(toy *t, int k);

/* Pendulum swung up by a bounded torque: x = [angle, rate], u = [torque]. */
void toy_pendulum(toy *t, int n_intervals);

/* Same sizes, structure and weights as the arm with 19 muscles: n_x = 27, n_u = 19, 8 markers.
 * Targets per node: 24 markers, 19 excitations. */
#define TOY_ARM_X 27
#define TOY_ARM_U 19
#define TOY_ARM_TARGET 43
void toy_arm(toy *t, int n_intervals, double dt);
/* The true motion from the state in row 0 of x [(n + 1) x TOY_ARM_X], whose other rows are filled;
 * markers and excitations of its first n nodes -> target [n x TOY_ARM_TARGET]. */
void toy_arm_motion(const toy *t, int n, double *x, double *target);

#endif

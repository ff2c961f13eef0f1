/* SPDX-License-Identifier: Apache-2.0 */
/* integrator.h: interface of integrator plugins (kind "integrator").
 *
 * An integrator carries the state over one shooting interval with constant controls and inputs,
 * x_next = F(x, u; w, p), and gives the exact derivatives of what it computed (of the discrete map,
 * not an approximation of the flow's).
 *
 * The system is musculoskeletal in shape and integrators may use that:
 *
 *     x = [q (n_q), v (n_q), d (n_d), z (n_z)]        u = [c (n_m), r (n_r)]
 *     qdot = v,   vdot = f(q, v, a, z, r),   ddot_i = g_i(c_i, d_i),   zdot = h(q, v, a, z, c)
 *
 * d are the activations where these are states of their own scalar equations (n_d = n_m or 0); a,
 * what forces see of activation, is d, or c where the system is activation-driven, or (n_a = 0) is
 * among z. z are the muscles' other states (fibre lengths), state by state: those of one muscle see
 * each other, their muscle's a and c, and through its length and velocity q and v. They may be
 * stiff (eigenvalues of 1e4 1/s and more). Derivatives are partial: activation-driven, a and c are
 * the same numbers, and what a control does to z is the sum of both. r are controls that act on the
 * skeleton: residual joint torques and actuators. What keeps loops of the model closed is part of
 * f. The layout names all of them.
 */
#ifndef MHE_INTEGRATOR_H
#define MHE_INTEGRATOR_H

#include <mhe/layout.h>
#include <mhe/plugin.h>

#ifdef __cplusplus
extern "C" {
#endif

#define MHE_INTEGRATOR_IFACE "mhe.integrator/2"

/* Where to evaluate the system. Lent for the call. */
typedef struct mhe_system_point {
    uint32_t size;
    const double *q, *v; /* [n_q] */
    const double *a;     /* [n_a] activations; NULL where n_a = 0 */
    const double *z;     /* [n_z]; NULL where n_z = 0 */
    const double *c;     /* [n_m] the muscles' controls; may be NULL where n_z = 0 */
    const double *r;     /* [n_r]; NULL where n_r = 0 */
    const double *w;     /* [n_w] inputs; NULL where n_w = 0 */
} mhe_system_point;

/* What is wanted; all but vdot may be NULL. Row-major. Where n_z = 0 nothing of zdot is touched. */
typedef struct mhe_acceleration {
    uint32_t size;
    double *vdot;   /* [n_q], rad/s^2 (m/s^2) */
    double *vdot_q; /* [n_q x n_q] */
    double *vdot_v; /* [n_q x n_q] */
    double *vdot_a; /* [n_q x n_a] */
    double *vdot_r; /* [n_q x n_r]; untouched when n_r = 0 */
    double *vdot_z; /* [n_q x n_z] */
    double *vdot_p; /* [n_q x n_p] by the parameters of the layout */
    double *zdot;   /* [n_z] */
    double *zdot_q; /* [n_z x n_q] */
    double *zdot_v; /* [n_z x n_q] */
    double *zdot_a; /* [n_z] by its own muscle's activation; untouched when n_a = 0 */
    double *zdot_c; /* [n_z] by its own muscle's control */
    double *zdot_z; /* [n_z x n_k]: entry (i, j) by the j-th entry in z of its own muscle, z_of */
    double *zdot_p; /* [n_z x n_p] */
} mhe_acceleration;

typedef struct mhe_system mhe_system;
struct mhe_system {
    uint32_t size;
    const mhe_layout *layout;
    int32_t n_x, n_u, n_w, n_p; /* those of the layout */
    int32_t n_q, n_m;
    int32_t n_a; /* n_m, or 0 where activations are among z */
    int32_t n_d; /* n_m, or 0: activation-driven, or activations are among z */
    int32_t n_z;
    int32_t n_r;              /* controls that follow the muscles' */
    int32_t n_k;              /* most entries of z that one muscle has */
    int32_t first_d, first_z; /* where d and z begin in x; q and v fill what is before d */
    const int32_t *z_muscle;  /* [n_z] whose entry it is */
    const int32_t *z_of;      /* [n_m x n_k] places in z of a muscle's entries, then -1 */
    void *data;               /* the core's own */
    /* Accelerations and rates of z. `context` is the thread's own system context, which also holds
     * the values of parameters. MHE_RETRY where the state is out of the domain. [hot] */
    mhe_status (*acceleration)(const mhe_system *system, void *context, const mhe_system_point *at,
                               const mhe_acceleration *out, mhe_error *err);
    /* rate, rate_c, rate_d [n_d] at (c, d) [n_d]; the derivatives may be NULL. Only when n_d > 0.
     * [hot] */
    mhe_status (*activation_rate)(const mhe_system *system, const double *c, const double *d,
                                  double *rate, double *rate_c, double *rate_d, mhe_error *err);
};

/* Derivatives that step() is to give; row-major, NULL: not wanted. A and B both or neither. */
typedef struct mhe_step_derivatives {
    uint32_t size;
    double *A; /* dx_next/dx [n_x x n_x] */
    double *B; /* dx_next/du [n_x x n_u] */
    double *P; /* dx_next/dp [n_x x n_p]; only with A and B */
} mhe_step_derivatives;

typedef struct mhe_integrator_ops {
    uint32_t size;
    /* `system` lives until after destroy(). [cold] */
    mhe_status (*create)(const mhe_host *host, const mhe_system *system, const void *config,
                         void **self, mhe_error *err);
    void (*destroy)(void *self); /* [cold] */
    /* Memory for one thread. `system_context` is handed on to mhe_system.acceleration. [cold] */
    mhe_status (*context_create)(const void *self, void *system_context, void **context,
                                 mhe_error *err);
    void (*context_destroy)(void *context); /* [cold] */
    /* x_next [n_x] after dt > 0 seconds from x [n_x] under u [n_u] and inputs w [n_w] (NULL where
     * n_w = 0). `out` may be NULL: no derivatives. MHE_RETRY: no solution from this point.
     *
     * `memory` [memory_size()], NULL allowed: belongs to one interval and one call at a time, and
     * carries what a call found to the next on this interval or one near it, which then starts
     * there. All zero: nothing is known. It may change the result within the integrator's tolerance
     * and nothing else, whatever calls it comes from; a call that fails leaves it fit for use.
     * [hot] */
    mhe_status (*step)(void *context, const double *x, const double *u, const double *w, double dt,
                       double *memory, double *x_next, const mhe_step_derivatives *out,
                       mhe_error *err);
    /* Doubles of memory that an interval is worth; the function may be NULL: none. [cold] */
    int32_t (*memory_size)(const void *self);
    /* Why it cannot integrate this kind of system, asked before create(): a sentence in err and a
     * negative status. NULL: it takes all. [cold] */
    mhe_status (*accepts)(const mhe_system *system, const void *config, mhe_error *err);
} mhe_integrator_ops;

#ifdef __cplusplus
}
#endif
#endif

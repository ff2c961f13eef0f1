/* SPDX-License-Identifier: Apache-2.0 */
/* integrator.h: interface of integrator plugins (kind "integrator").
 *
 * An integrator carries the state over one shooting interval with constant controls,
 * x_next = F(x, u), and gives the exact derivatives of what it computed (of the discrete map, not
 * an approximation of the flow's).
 *
 * The system is musculoskeletal in shape and integrators may use that:
 *   excitation-driven  x = [q (n_q), v (n_q), a (n_m)]   u = [e (n_m), r (n_r)]
 *   activation-driven  x = [q (n_q), v (n_q)]            u = [a (n_m), r (n_r)]
 *   qdot = v,  vdot = f(q, v, a, r),  adot_i = g_i(e_i, a_i)
 *
 * Each activation is a scalar equation of its own. r are residual joint torques (n_r = 0 or n_q).
 */
#ifndef MHE_INTEGRATOR_H
#define MHE_INTEGRATOR_H

#include <mhe/plugin.h>

#ifdef __cplusplus
extern "C" {
#endif

#define MHE_INTEGRATOR_IFACE "mhe.integrator/1"

/* Result of mhe_system.acceleration; all but vdot may be NULL. Row-major. */
typedef struct mhe_acceleration {
    uint32_t size;
    double *vdot;   /* [n_q], rad/s^2 (m/s^2) */
    double *vdot_q; /* [n_q x n_q] */
    double *vdot_v; /* [n_q x n_q] */
    double *vdot_a; /* [n_q x n_m] */
    double *vdot_r; /* [n_q x n_r] = M^-1 columns; untouched when n_r = 0 */
} mhe_acceleration;

typedef struct mhe_system mhe_system;
struct mhe_system {
    uint32_t size;
    int32_t n_q, n_m, n_r;
    int32_t n_a;      /* activations among the states: n_m (excitation-driven), else 0 */
    int32_t n_x, n_u; /* 2 n_q + n_a, n_m + n_r */
    void *data;       /* the core's own */
    /* vdot = f(q, v, a, r). `context` is the thread's own system context. `r` may be NULL when n_r
     * = 0. MHE_RETRY where the state is out of the domain. [hot] */
    mhe_status (*acceleration)(const mhe_system *system, void *context, const double *q,
                               const double *v, const double *a, const double *r,
                               const mhe_acceleration *out, mhe_error *err);
    /* rate, rate_e, rate_a [n_m] at (e, a) [n_m]; the derivatives may be NULL. Only when n_a > 0.
     * [hot] */
    mhe_status (*activation_rate)(const mhe_system *system, const double *e, const double *a,
                                  double *rate, double *rate_e, double *rate_a, mhe_error *err);
};

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
    /* x_next [n_x] after dt > 0 seconds from x [n_x] under u [n_u]. A = dx_next/dx [n_x x n_x] and
     * B = dx_next/du [n_x x n_u], row-major, both or neither NULL. MHE_RETRY: no solution from this
     * point.
     *
     * `memory` [memory_size()], NULL allowed: belongs to one interval and one call at a time, and
     * carries what a call found to the next on this interval or one near it, which then starts
     * there. All zero: nothing is known. It may change the result within the integrator's tolerance
     * and nothing else, whatever calls it comes from; a call that fails leaves it fit for use.
     * [hot] */
    mhe_status (*step)(void *context, const double *x, const double *u, double dt, double *memory,
                       double *x_next, double *A, double *B, mhe_error *err);
    /* Doubles of memory that an interval is worth; the function may be NULL: none. [cold] */
    int32_t (*memory_size)(const void *self);
} mhe_integrator_ops;

#ifdef __cplusplus
}
#endif
#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* model.h: interface of skeleton plugins (kind "model").
 *
 * A model turns a description into kinematics and dynamics of a tree of rigid bodies, musculotendon
 * paths and markers. It knows no muscle force and no cost. n_q, n_m (muscles) and n_k (markers) are
 * those of the description. Equation of motion: M(q) vdot + bias(q, v) = tau. */
#ifndef MHE_MODEL_H
#define MHE_MODEL_H

#include <mhe/description.h>
#include <mhe/plugin.h>

#ifdef __cplusplus
extern "C" {
#endif

#define MHE_MODEL_IFACE "mhe.model/1"

/* What kinematics() is to compute at (q, v). NULL: not wanted. The arrays are the caller's. All
 * derivatives exact. */
typedef struct mhe_kinematics {
    uint32_t size;
    double *mass;      /* M [n_q x n_q], symmetric, kg m^2 (or kg, kg m) */
    double *bias;      /* [n_q]: Coriolis, centrifugal and gravity terms, N m (or N) */
    double *length;    /* musculotendon lengths [n_m], m */
    double *length_q;  /* dL/dq [n_m x n_q], row-major, m/rad; the moment arm is its negative */
    double *length_qq; /* d2L/dq2 [n_m x n_q x n_q], row-major */
    double *marker;    /* positions in ground [n_k x 3], m */
    double *marker_q;  /* d marker/dq [3 n_k x n_q], row-major */
} mhe_kinematics;

typedef struct mhe_model_ops {
    uint32_t size;
    /* `description` lives until after destroy(). [cold] */
    mhe_status (*create)(const mhe_host *host, const mhe_description *description,
                         const void *config, void **self, mhe_error *err);
    void (*destroy)(void *self); /* [cold] */
    /* Memory for one thread; evaluations on different contexts may run at the same time. [cold] */
    mhe_status (*context_create)(const void *self, void **context, mhe_error *err);
    void (*context_destroy)(void *context); /* [cold] */
    /* Sets the context's state to (q [n_q], v [n_q]) and computes what `out` asks for. MHE_RETRY: a
     * non-finite input or result. [hot] */
    mhe_status (*kinematics)(void *context, const double *q, const double *v,
                             const mhe_kinematics *out, mhe_error *err);
    /* tau = M vdot + bias [n_q] and its derivatives tau_q, tau_v [n_q x n_q, row-major] with vdot
     * held, at the state of the last kinematics() call of this context. Outputs may be NULL. [hot]
     */
    mhe_status (*inverse_dynamics)(void *context, const double *vdot, double *tau, double *tau_q,
                                   double *tau_v, mhe_error *err);
    /* vdot [n_q] = M^-1 (tau - bias) at the state of the last kinematics() call. [hot] */
    mhe_status (*forward_dynamics)(void *context, const double *tau, double *vdot, mhe_error *err);
} mhe_model_ops;

#ifdef __cplusplus
}
#endif
#endif

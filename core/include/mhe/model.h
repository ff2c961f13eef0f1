/* SPDX-License-Identifier: Apache-2.0 */
/* model.h: interface of skeleton plugins (kind "model").
 *
 * A model turns a description into kinematics and dynamics of a tree of rigid bodies, lengths of
 * paths and positions of markers. It knows no muscle force and no cost. n_q (free coordinates), n_b
 * (bodies), n_p (paths, the muscles' first) and n_k (markers) are those of the description.
 * Equation of motion: M(q) vdot + bias(q, v) = tau. Loops of the description are open here: the
 * model says how far, and the core finds the force that keeps them closed. */
#ifndef MHE_MODEL_H
#define MHE_MODEL_H

#include <mhe/description.h>
#include <mhe/plugin.h>

#ifdef __cplusplus
extern "C" {
#endif

#define MHE_MODEL_IFACE "mhe.model/2"

/* What kinematics() is to compute at (q, v). NULL: not wanted. The arrays are the caller's. All
 * derivatives exact. */
typedef struct mhe_kinematics {
    uint32_t size;
    double *mass;      /* M [n_q x n_q], symmetric, kg m^2 (or kg, kg m) */
    double *bias;      /* [n_q]: Coriolis, centrifugal and gravity terms, N m (or N) */
    double *length;    /* of paths [n_p], m */
    double *length_q;  /* dL/dq [n_p x n_q], row-major, m/rad; the moment arm is its negative */
    double *length_qq; /* d2L/dq2 [n_p x n_q x n_q], row-major */
    double *marker;    /* positions in ground [n_k x 3], m */
    double *marker_q;  /* d marker/dq [3 n_k x n_q], row-major */
    double *body;   /* [n_b x 12]: origin in ground (m), then the rotation, body to ground, row by
                     * row */
    double *body_q; /* [n_b x 6 x n_q]: angular velocity and velocity of the body's origin, in
                     * ground axes, per unit of each coordinate's rate */
    double *dependent; /* values of the dependent coordinates [n_dependents], rad (m) */
    /* 1: length_q and length_qq hold 0 already wherever a path cannot depend on a coordinate
     * (path_pattern); elsewhere there may be anything. A model may pass over those entries. */
    int32_t lengths_clear;
} mhe_kinematics;

/* Rows of a description's loops, loop by loop: three of a point, six of a weld (the point's first).
 * [any] */
static inline int32_t mhe_loop_rows(const mhe_description *description) {
    int32_t n = 0;
    for (int32_t i = 0; i < description->n_loops; i++) {
        n += description->loops[i].kind == MHE_LOOP_WELD ? 6 : 3;
    }
    return n;
}

/* How far the loops are open, in ground axes: frame 2's origin less frame 1's (m), and of a weld
 * half the sum of axis 1 x axis 2 over the three axes, which is the sine of the angle between the
 * frames times its axis. n_c rows; NULL: not wanted. All derivatives exact, row-major. A force (or
 * moment) lambda [n_c] that pulls body 2 so and body 1 the other way does rate_v^T lambda. */
typedef struct mhe_loop_values {
    uint32_t size;
    double *gap, *gap_q;            /* [n_c], [n_c x n_q] */
    double *rate, *rate_q, *rate_v; /* velocity of origin 2 less origin 1, and the relative angular
                                     * velocity: d gap/dt where the loop is closed; [n_c], the
                                     * derivatives [n_c x n_q] */
    double *acceleration;           /* d rate/dt at vdot [n_c] */
    double *acceleration_q, *acceleration_v; /* with vdot held [n_c x n_q] */
} mhe_loop_values;

/* A force at a point and a torque that act on a body. `axes`: the body in whose axes force and
 * torque are given; `origin`: the body in whose frame (axes and origin) the point is; -1: ground.
 */
typedef struct mhe_load {
    int32_t body, axes, origin;
} mhe_load;

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
    /* Generalised force tau [n_q] of n loads at the state of the last kinematics() call, added to
     * what stands in tau; `value` [n x 9]: force, point, torque. tau_q [n_q x n_q] (added too) and
     * tau_l [n_q x 9 n] (set) may be NULL. [hot] */
    mhe_status (*loads)(void *context, const mhe_load *loads, int32_t n, const double *value,
                        double *tau, double *tau_q, double *tau_l, mhe_error *err);
    /* Which coordinates a path can depend on: pattern [n_p x n_q], 1 or 0. [cold] */
    mhe_status (*path_pattern)(const void *self, uint8_t *pattern, mhe_error *err);
    /* Points of the path `path` as it runs now, [at most n x 3] in ground, for drawing: path points
     * that are on, and points along what it wraps around. Returns their number, which may be
     * larger than n. At the state of the last kinematics() call. [hot] */
    int32_t (*path_points)(void *context, int32_t path, double *points, int32_t n);
    /* What `out` asks for at the state of the last kinematics() call and vdot [n_q] (NULL: 0). NULL
     * or missing: the plugin takes no description with loops. [hot] */
    mhe_status (*loops)(void *context, const double *vdot, const mhe_loop_values *out,
                        mhe_error *err);
} mhe_model_ops;

#ifdef __cplusplus
}
#endif
#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* rk.h: fixed-step Runge-Kutta schemes on the musculoskeletal shape of mhe/integrator.h.
 *
 * A step of length h is split by structure. Activations are scalar equations that see neither q nor
 * v: they are carried first, by collocation on steps of their own (activation.c). What remains, q''
 * = f(q, v, a(t), r), is solved for the stage accelerations K_j alone (mechanics.c): v_j = v + h
 * sum_k A_jk K_k,   q_j = q + h c_j v
 * + h^2 sum_k (A A)_jk K_k,   K_j = f(q_j, v_j, a_j, r) v+ = v + h sum_j b_j K_j,     q+ = q + h v
 * + h^2 sum_j (b A)_j K_j */
#ifndef INTEGRATOR_RK_H
#define INTEGRATOR_RK_H

#include <mhe/integrator.h>

#define RK_MAX_STAGES 6
#define RK_ACTIVATION_STAGES 4
#define RK_GAUSS 0
#define RK_RK4 1

/* Filled by the core from the option table in plugin.c. */
struct rk_config {
    int32_t scheme; /* RK_GAUSS, RK_RK4 */
    int32_t stages; /* Gauss only */
    double max_step;
    double newton_tolerance;
    int32_t max_newton;
};

/* Row-major, `stages` wide. Stage times c do not decrease. */
struct rk_tableau {
    int32_t stages;
    int32_t is_explicit;
    int32_t terms; /* of the polynomial that stands for an activation over a step */
    double c[RK_MAX_STAGES], b[RK_MAX_STAGES];
    double A[RK_MAX_STAGES * RK_MAX_STAGES];
    double AA[RK_MAX_STAGES * RK_MAX_STAGES]; /* A A */
    double bA[RK_MAX_STAGES];                 /* b A */
};

void rk_tableau_gauss(int32_t stages, struct rk_tableau *out); /* 1..RK_MAX_STAGES */
void rk_tableau_rk4(struct rk_tableau *out);

struct rk {
    const mhe_system *system;
    struct rk_config config;
    struct rk_tableau mechanics, activation;
    double activation_step; /* longest step of the activations, s */
};

/* One thread's memory; s is mechanics.stages. The carried state is (q, v, a); `sens` is its
 * derivative by (q, v, a, controls) at the start of the interval. */
struct rk_context {
    const struct rk *rk;
    void *system_context;
    double *memory; /* all arrays below */

    /* activations */
    double *a, *a_a, *a_e;             /* [n_m] value now; its derivatives by start and control */
    double *a_start;                   /* [n_m] at the start of the mechanical step */
    double *stage_a;                   /* [s x n_m] as the stages of the mechanical step see them */
    double *stage_a_a, *stage_a_e;     /* [s x n_m] */
    double *slope, *slope_a, *slope_e; /* [4 x n_m] stage slopes of an activation step */
    double *guess, *guess_a, *guess_e; /* [4 x n_m] stage values of an activation step */

    /* mechanics */
    double *q, *v;                 /* [n_q] */
    double *K;                     /* [s x n_q] */
    double *stage_q, *stage_v;     /* [n_q] of the stage in work */
    double *f;                     /* [s x n_q] */
    double *f_q, *f_v, *f_a, *f_r; /* [s x ...] derivatives at the stages */
    double *jacobian;              /* [s n_q x s n_q] of the stage equations, then its LU */
    int32_t *pivots;               /* [s n_q] */
    double *residual;              /* [s n_q] */
    double *adjoint;               /* [2 n_q x s n_q] d(q+, v+)/d(right-hand sides) */
    double *carry;                 /* [2 n_q x 2 n_q] d(q+, v+)/d(q, v) */
    double *sens, *sens_next;      /* [2 n_q x columns] */
    int32_t columns;               /* 2 n_q + n_a + n_m + n_r */
};

/* Stage activations and their derivatives for the mechanical step [0, h]; moves a, a_a, a_e to its
 * end. [hot] */
mhe_status rk_activations(struct rk_context *c, const double *e, double h, int32_t derivatives,
                          mhe_error *err);

/* Moves q, v over one step of length h with the stage activations as they are. With `derivatives`
 * also `sens`. [hot] */
mhe_status rk_mechanics(struct rk_context *c, const double *r, double h, int32_t derivatives,
                        mhe_error *err);

/* Chains the derivatives of the step just solved onto `sens`. [hot] */
void rk_chain(struct rk_context *c, double h);

extern const mhe_integrator_ops rk_ops;

#endif

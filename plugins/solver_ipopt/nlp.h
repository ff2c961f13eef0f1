/* SPDX-License-Identifier: Apache-2.0 */
/* nlp.h: the stage problem as a sparse nonlinear program, whoever solves it.
 *
 * All variables w = (x_0, u_0, x_1, u_1, ..., x_N, p), stage by stage, so that the matrices are
 * banded but for the columns of the parameters p. Variables with equal bounds are parameters: the
 * program sees the free ones only, so its structure and bounds stay the same while the first state
 * of a moving horizon is fixed to ever new values. Constraints g_k = x_{k+1} - F_k(x_k, u_k) = 0.
 */
#ifndef NLP_H
#define NLP_H

#include <mhe/solver.h>

typedef struct nlp_entry { /* a non-zero of a sparse matrix */
    int32_t row, col;
    int32_t at; /* of its value in nlp.store; -1: the constant 1 */
} nlp_entry;

/* What is known at nlp.w. */
enum { NLP_NOTHING, NLP_VALUES, NLP_ALL };

typedef struct nlp {
    const mhe_stage_problem *problem;
    int32_t n_all, n, m;           /* variables, free ones, constraints */
    int32_t *of;                   /* [n] position in w of a free variable */
    int32_t *number;               /* [n_all] number of a free variable; -1: fixed */
    uint8_t *constant;             /* [m] equations in which nothing is free */
    int32_t n_constant;            /* so many, where there are fewer variables than equations; 0 */
    uint8_t *full;                 /* pattern of the blocks of parameters, which have no zeros */
    double *w;                     /* [n_all] the point evaluated last */
    double *lower, *upper;         /* [n_all] */
    double *store;                 /* what evaluate() wrote, node by node */
    int32_t stride;                /* doubles of a node in store */
    nlp_entry *jacobian, *hessian; /* [n_jacobian]; lower triangle [n_hessian] */
    int32_t n_jacobian, n_hessian;

    int32_t known;      /* NLP_* at w */
    int32_t all_next;   /* the next new point is wanted with derivatives at once */
    int32_t no_value;   /* w has none: MHE_RETRY or not finite */
    mhe_status failure; /* negative status of evaluate(): nothing is evaluated any more */
    mhe_error error;    /* ... with its text */
    double seconds;     /* spent in evaluate() */
} nlp;

mhe_status nlp_create(nlp *p, const mhe_stage_problem *problem, mhe_error *err);
void nlp_free(nlp *p);

#define NLP_SAME 0
#define NLP_CHANGED 1 /* the free variables or their bounds are others than last time */
#define NLP_EMPTY 2   /* a lower bound lies above its upper bound */

/* Reads the problem's bounds; renumbers variables and matrices where another set is fixed. Returns
 * NLP_*. */
int32_t nlp_read_bounds(nlp *p);

/* Between the arrays of a solution and w: x [(N+1) x n_x], u [N x n_u]. */
/* `parameters` [n_p] is not looked at where there are none. */
void nlp_gather(const nlp *p, const double *x, const double *u, const double *parameters,
                double *w);
void nlp_scatter(const nlp *p, const double *w, double *x, double *u, double *parameters);

/* Starts a solve from this iterate, with fixed variables at their bounds; nothing is known any
 * more. */
void nlp_begin(nlp *p, const double *x, const double *u, const double *parameters);

/* Makes `level` known at the point with free variables `v` [n]. 0: the point has no value. */
int32_t nlp_evaluate(nlp *p, const double *v, int32_t level);

/* Read what nlp_evaluate made known. */
double nlp_cost(const nlp *p);
void nlp_constraints(const nlp *p, double *g);          /* [m] */
double nlp_constant_gap(const nlp *p, const double *g); /* largest of what is constant in it */
void nlp_cost_gradient(const nlp *p, double *grad);     /* [n_all], fixed variables too */
/* Slope of the Lagrangian without bounds in every variable [n_all], for lambda [m]. */
void nlp_lagrangian_gradient(const nlp *p, const double *lambda, double *grad);
/* One over the geometric mean of the positive curvatures of the controls (of the states where there
 * are none) at v; 1 where v has no value. */
double nlp_scale(nlp *p, const double *v);
double nlp_jacobian_value(const nlp *p, const nlp_entry *entry);

/* CLOCK_MONOTONIC in seconds. */
double nlp_now(void);

#endif

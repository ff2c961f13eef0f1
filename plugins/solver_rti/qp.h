/* SPDX-License-Identifier: Apache-2.0 */
/* qp.h: a staged quadratic program with bounds by a primal-dual interior-point method.
 *
 * Predictor and corrector of Mehrotra (1992, doi:10.1137/0802028) with one factorisation each
 * iteration; slacks t of the bounds are variables of their own, so any start will do. Each Newton
 * system is proximal in the variables and in the multipliers of bounds (weights `regularisation`
 * and `softness`; Pougkakiotis and Gondzio 2021, doi:10.1007/s10589-020-00240-9): it stays solvable
 * with flat directions and with bounds that the dynamics cannot meet, and the solution is not
 * changed by it. */
#ifndef QP_H
#define QP_H

#include "kalman.h"
#include "riccati.h"

typedef struct qp_limits { /* largest residuals of a solved program */
    double stationarity, feasibility, complementarity;
    int32_t max_iterations;
    double regularisation;
    int32_t unsettled; /* bounds that may still come and go in a set that is taken */
    int32_t (*is_late)(const void *data); /* asked before each iteration; NULL: never */
    const void *data;
} qp_limits;

#define QP_SOLVED 0
#define QP_LIMIT 1      /* iterations are used up */
#define QP_INFEASIBLE 2 /* ... and bounds are violated: w violates them least */
#define QP_FAILED 3     /* a Newton system could not be solved */
#define QP_LATE 4       /* is_late() said so: the iterate so far */

/* One side of a bound: sign * (w[at] - bound) >= 0, or = 0 with slack 0. */
typedef struct qp_side {
    int32_t at;
    double sign, bound;
    double t, z;     /* slack and multiplier */
    double dt, dz;   /* their steps */
    double residual; /* sign * (w - bound) - t */
    double weight;   /* of the step of w in that of z */
    double shift;    /* ... and its constant part */
} qp_side;

/* What the factors answer to changes of the set that they were made for (active_update.c). */
#define QP_MOST_CHANGES (KALMAN_GROUPS * KALMAN_LANES)
typedef struct qp_update {
    int32_t at_once;                   /* groups of answers that cost less than factors; 0: none */
    int32_t known;                     /* all of the next line is */
    double *side, *w, *slope, *lambda; /* that set, its solution and the slope there */
    int32_t n[KALMAN_GROUPS];          /* answers so far, to changes at these places: */
    ptrdiff_t at[KALMAN_GROUPS][KALMAN_LANES];
} qp_update;

typedef struct qp {
    const qp_shape *shape;
    const qp_stage *stages;
    double *lower, *upper; /* [size_z] */
    /* Start and result: variables [size_z], multipliers [size_x] of the dynamics and [size_z] of
     * the bounds, signs as in solver.h. */
    double *w, *lambda, *z_lower, *z_upper;
    int32_t iterations;
    double stationarity, feasibility, complementarity; /* residuals reached */
    double open; /* sum of t z: what of the cost is left to gain where the others are 0 */

    uint8_t *fixed;         /* [size_z] controls and first states with equal bounds: constants */
    int32_t first_is_fixed; /* all of the first state */
    qp_side *sides;
    int32_t n_sides, n_inequalities; /* equalities (later states with equal bounds) come last */
    double regularisation, softness; /* now */
    int32_t refine;                  /* a Newton system needs a second solve */
    double *slope, *gap;             /* residuals of w [size_z] and of the dynamics [size_x] */
    double *diagonal, *rhs, *dw, *dlambda;        /* of a Newton system */
    double *rest_w, *rest_x, *fix_w, *fix_lambda; /* of its refinement */
    int32_t recursion; /* whose numbers stand in the memory that both share: QP_RICCATI ... */
    double *recursion_memory;
    riccati riccati;
    kalman kalman;
    double *side;  /* [size_z] active.c: -1, 1: held at the lower, the upper bound; 0: at none */
    uint8_t *held; /* [size_z] controls and fixed variables that are constants */
    qp_update update;
    int32_t ahead;    /* bounds ahead of its tail that the last program's first system changed */
    double *because;  /* [ld_x] scratch of active.c */
    uint8_t *turned;  /* [n_x] simple states with bounds, or a control with bounds, that changed */
    int32_t programs; /* solved since qp_place(), and those of them in which no set was found */
    int32_t fallbacks;
    int32_t updates; /* of all these, sets solved by the factors of one before */
    int32_t tails;   /* programs that began with what their last stages alone had come to */
    /* Of Newton systems, with what their factors take, since that was told (qp_take_work()); and
     * sweeps along chains, many of which make one. */
    int32_t solutions, sweeps;
    int32_t skipped, to_skip; /* programs after one whose sets cycled: twice as many each time */
    struct qp_border *border; /* of the parameters (border.c); NULL where there are none */
} qp;

/* ---- border.c: parameters, by the Schur complement of their columns ----
 *
 * Where w minimises the program for given p, its cost is 1/2 p^T S p + ...: S = sum D + diag d_p,
 * less what the stages give way. */
typedef struct qp_border {
    double *W;     /* [n_p][size_z] the stages' answer to each parameter, see border_answers() */
    double *g, *b; /* [size_z], [size_x] scratch of a solve */
    double *D;     /* [n_p x ld_p] sum over the stages */
    double *sum;   /* [n_p x ld_p] S while it grows, upper triangle */
    double *S;     /* [n_p x n_p] its Cholesky factor, lower */
    double *dp;    /* [ld_p] */
    double *room;  /* of a stage */
    const uint8_t *held; /* [size_z] of border_factor() */
} qp_border;

size_t border_size(const qp_shape *s); /* doubles */
void border_place(qp_border *border, const qp_shape *s, double *memory);
/* Once for new stages. */
void border_begin(qp *q);
/* After riccati_factor(); parameters that are `held` [size_z] are constants. 0: S is not positive
 * definite. */
int32_t border_factor(qp *q, const uint8_t *held);
/* S^-1 of `p` [n_p], in place. */
void border_solve(const qp *q, double *p);
/* riccati_solve() with p: g ends with its row, and so does w. */
void border_newton(qp *q, const double *g, const double *b, double *w, double *lambda);
/* W, for covariances; overwrites rest_w, rest_x, dlambda. */
void border_answers(qp *q);

#define QP_RICCATI 1
#define QP_KALMAN 2

/* The recursion that the Newton systems from now on are solved by; what another one knew is lost.
 */
void qp_use(qp *q, int32_t recursion);
/* Factorises H + diag(q->diagonal) with what is `held` [size_z]; solves with g, b (riccati.h). */
int32_t qp_factor(qp *q, const uint8_t *held);
/* In solutions, since it was last asked. */
int32_t qp_take_work(qp *q);
void qp_newton(qp *q, const double *g, const double *b, double *w, double *lambda);
/* Where costs allow it: on covariances. */
int32_t qp_best(const qp *q);

/* active_update.c */
size_t update_size(const qp_shape *s); /* doubles */
void update_place(qp_update *update, const qp_shape *s, double *memory);

/* active.c: the program by a primal-dual active set, from the bounds at which the multipliers
 * z_lower and z_upper say w will stay: QP_SOLVED within the limits, QP_LATE, or QP_LIMIT: no set
 * found, w, lambda and z as they came. */
int32_t active_solve(qp *q, const qp_limits *limits);

/* inside.c: by the interior point, which any program can end with. */
int32_t inside_solve(qp *q, const qp_limits *limits, int32_t warm);

size_t qp_size(const qp_shape *s); /* bytes, a multiple of 64 */
void qp_place(qp *q, const qp_shape *s, void *memory);

/* Reads which variables are fixed from lower and upper. */
void qp_read_bounds(qp *q);
/* Solves the program of `stages` from q->w ... (`warm`: with the multipliers); gives QP_*. */
int32_t qp_solve(qp *q, const qp_stage *stages, const qp_limits *limits, int32_t warm);

#endif

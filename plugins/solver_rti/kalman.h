/* SPDX-License-Identifier: Apache-2.0 */
/* kalman.h: the Newton system of a separable program by a recursion forwards, on covariances.
 *
 * Where controls and simple states (activations) have diagonal costs, all that ties muscles
 * together is what they do to the dense states. So controls are eliminated one by one and no matrix
 * of their size is factorised:
 *
 * 1. Each simple state with its control is a scalar problem of its own. Completing its square
 *    backwards (a scalar Riccati recursion) takes the cost off the state: e = e' - K a, with
 *    curvature R' of e' and none of a.
 * 2. What is left has costs on the dense states alone. With x_k = m_k + Sigma_k eta_k, eta_k what
 *    later stages pull with, m and Sigma follow from a Kalman filter (Kalman 1960,
 *    doi:10.1115/1.3662552) whose noise are the controls, of covariance 1/R', and whose measurement
 *    is the cost of the dense states:
 *        Sigma+ = F Sigma' F^T + B R'^-1 B^T,   Sigma' = (I + Sigma Q)^-1 Sigma
 * 3. Multipliers and controls follow backwards (a smoother in the form of Bryson and Frazier 1963).
 *
 * A free first state has the covariance that its own cost leaves it: of a dense one the inverse of
 * that cost, of a simple one that of its cost to go.
 *
 * A stage costs n_x^2 n_dense instead of n_z^2 n_dense and a factorisation of n_u rows: two to
 * three times less where muscles have activations, five to ten where they are the controls. A
 * control that is held is noise without variance; a weight of any size on an activation is exact.
 */
#ifndef KALMAN_H
#define KALMAN_H

#include "stage_qp.h"

/* One unit of a right-hand side (kalman_answers.c). */
#define KALMAN_LANES 8
#define KALMAN_GROUPS 3 /* of eight, there is room for */
typedef struct kalman_unit {
    ptrdiff_t at;  /* its place among all w; no first state */
    double g;      /* slope there */
    int32_t moves; /* a control that is held there moves by 1 */
} kalman_unit;

/* Memory for eight of them: each number is eight, one behind the other. */
typedef struct kalman_units {
    double *g, *b;            /* right-hand sides [size_z], [size_x]: 0 but in kalman_answer() */
    int32_t dense;            /* a slope of g is one of a dense state */
    double *s, *z, *x;        /* [size_x], [N+1][ld_d], [size_x] */
    double *row, *eta, *pull; /* [ld_d], [ld_x], [ld_z] */
    double *answers;          /* [KALMAN_GROUPS], each of [size_z] and [size_x] */
} kalman_units;

typedef struct kalman {
    const qp_shape *shape;
    const uint8_t *held; /* [size_z] of the last factorisation: constants */
    int32_t free;        /* the first state is a variable */
    int32_t n, m;        /* dense and simple states */
    int32_t known;       /* stages that the last factorisation of this program got through */
    int32_t ld_d, ld_w;
    double *FT;         /* [N][n_z x ld_d] dense rows of F, transposed */
    double *h;          /* [size_z] diagonals of H */
    double *C;          /* [N][n_x x ld_d] the same of x, of the closed loop; none: rows of FT */
    double *U;          /* [N+1][n x ld_d] Q = U^T U of the dense states: a block of those that are
                         * tied with zeros around it, and the diagonal of the others */
    double *U_inverse;  /* [N+1][ld_d] of its diagonal */
    double *W;          /* [N+1][n x ld_w] factor of S = I + U Sigma U^T, and its U^-T U Sigma */
    double *W_inverse;  /* [N+1][ld_d] */
    double *D;          /* [N+1][n x ld_x] rows of the dense states of Sigma' */
    double *used;       /* [size_z] diagonals that it was made with */
    double *p;          /* [size_x + ld_x] curvatures of the costs to go of simple states */
    double *K, *closed; /* [size_x] */
    double *inverse;    /* [size_z] 1/R' */
    double *before, *after; /* [n_x x ld_x] Sigma, Sigma'; without simple states that is D */
    double *T, *L, *noise;  /* [n_x x ld_d], [n x ld_d], [n_u x ld_d] scratch */
    double *s, *v, *z, *x;  /* of a solution: [size_x + ld_x], [size_z], [N+1][ld_d], [N+1][ld_x] */
    double *pull, *eta, *lambda, *row, *next; /* [ld_z], [ld_x], [ld_d], [ld_w], [ld_x] scratch */
    kalman_units units;
} kalman;

/* May it be used for this shape? */
int32_t kalman_takes(const qp_shape *s);
size_t kalman_size(const qp_shape *s); /* doubles */
void kalman_place(kalman *f, const qp_shape *s, double *memory);
/* Before the first factorisation of a program; `free`: its first state is a variable. */
void kalman_begin(kalman *f, const qp_stage *stages, int32_t free);
/* As riccati_factor() and riccati_solve(); `held` [size_z] are controls, and of a free first state
 * what of it, that are 0. Where all
 * states are dense, what has not changed since the last factorisation of the program, from the
 * first stage on, stays: sets differ in a few places. */
int32_t kalman_factor(kalman *f, const qp_stage *stages, const double *diagonal,
                      const uint8_t *held);
void kalman_solve(kalman *f, const qp_stage *stages, const double *g, const double *b, double *w,
                  double *lambda);

/* Solutions with the factors to n <= 8 units, of a first state that is fixed: w [size_z][8] and
 * lambda [size_x][8], those behind n without a meaning. */
void kalman_answer(kalman *f, const qp_stage *stages, int32_t n, const kalman_unit *list, double *w,
                   double *lambda);

/* Blocks of a stage. */
static inline double *kalman_FT_of(const kalman *f, int32_t k) {
    return f->FT + (ptrdiff_t)k * f->shape->n_z * f->ld_d;
}
static inline double *kalman_C_of(const kalman *f, int32_t k) {
    return f->m > 0 ? f->C + (ptrdiff_t)k * f->shape->n_x * f->ld_d
                    : kalman_FT_of(f, k) + f->shape->n_u * f->ld_d;
}
/* The simple states' part of a row of x. */
static inline const double *kalman_simple_x(const kalman *f, const double *rows, int32_t k) {
    return rows + (ptrdiff_t)k * f->shape->ld_x + f->n;
}
/* The first of the controls of simple states, which stand in their order. */
static inline int32_t kalman_first_control(const kalman *f) {
    return f->m > 0 ? f->shape->control_of[f->n] : 0;
}

/* Blocks of a node. */
static inline double *kalman_U_of(const kalman *f, int32_t k) {
    return f->U + (ptrdiff_t)k * f->n * f->ld_d;
}
static inline double *kalman_W_of(const kalman *f, int32_t k) {
    return f->W + (ptrdiff_t)k * f->n * f->ld_w;
}
static inline double *kalman_D_of(const kalman *f, int32_t k) {
    return f->D + (ptrdiff_t)k * f->n * f->shape->ld_x;
}
/* Sigma' while it is the last one. */
static inline double *kalman_after(const kalman *f, int32_t k) {
    return f->m > 0 ? f->after : kalman_D_of(f, k);
}
static inline double *kalman_of_d(const kalman *f, double *rows, int32_t k) {
    return rows + (ptrdiff_t)k * f->ld_d;
}

/* Sigma' of node k from Sigma (kalman_measure.c); 0: the cost is not positive definite. */
int32_t kalman_measure(kalman *f, const qp_stage *stage, const double *diagonal, int32_t k);

#endif

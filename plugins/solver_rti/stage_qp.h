/* SPDX-License-Identifier: Apache-2.0 */
/* stage_qp.h: a quadratic program in stages, and where its numbers lie.
 *
 *     minimise   sum_{k=0}^{N} 1/2 w_k^T H_k w_k + g_k^T w_k              w_k = (u_k, x_k)
 *     subject to x_{k+1} = F_k w_k + b_k,  lower_k <= w_k <= upper_k      F_k = [B_k A_k]
 *
 * At the last stage the part of u is there but empty. Vectors of all w have rows of ld_z doubles,
 * those of states rows of ld_x; everything behind n_z or n_x is zero.
 *
 * With global parameters p, each stage has also p^T C_k w_k + 1/2 p^T D_k p + d_k^T p, and its
 * dynamics P_k p. Vectors of all w then end with a row of p. */
#ifndef STAGE_QP_H
#define STAGE_QP_H

#include "kernels.h"

#include <mhe/solver.h>

/* Of two numbers, `a` where b is NaN: without the calls that fmax and fmin are. */
static inline double larger(double a, double b) {
    return b > a ? b : a;
}
static inline double smaller(double a, double b) {
    return b < a ? b : a;
}

typedef struct qp_shape {
    int32_t N, n_x, n_u, n_z; /* n_z = n_u + n_x */
    int32_t ld_z, ld_x;
    int32_t n_p, ld_p; /* ld_p = 0 where there are none */
    /* States from n_dense on depend on themselves and on one control at most (activations), or on
     * none. */
    int32_t n_dense;
    const int32_t *control_of; /* [n_x]; -1: none */
    int32_t in_order; /* each of them depends on the control behind that of the state before it */
    /* Costs hold no products of a control or one of those states with anything else, and each of
     * those states has a control that no other one has: kalman.h. */
    int32_t separable;
    int32_t n_tied; /* of a separable one: dense states from here on, too, have squares alone */
    const kernels *kernels;
} qp_shape;

/* One stage. */
typedef struct qp_stage {
    double *H; /* [n_z x ld_z], symmetric, both triangles */
    double *F; /* first n_dense rows [n_dense x ld_z] */
    double *by_state,
        *by_control; /* the other rows: factors of the state and of its control [n_x] */
    double *g;       /* [ld_z] */
    double *b;       /* [ld_x] */
    double *C, *Pt;  /* [n_p x ld_z], and P^T [n_p x ld_x] */
    double *D, *d;   /* [n_p x n_p], [n_p] */
    /* Parameters whose rows of C and D can be other than 0, and how many of the first rows of P
     * can: a stage costs what few parameters change, and these reach few states. */
    int32_t *costly, n_costly, n_reached;
} qp_stage;

/* Rows of a stage's vectors. */
static inline double *row_z(const qp_shape *s, double *w, int32_t k) {
    return w + (ptrdiff_t)k * s->ld_z;
}
static inline double *row_x(const qp_shape *s, double *w, int32_t k) {
    return w + (ptrdiff_t)k * s->ld_x;
}
/* The parameters, behind all stages. */
static inline double *row_p(const qp_shape *s, double *w) {
    return w + (ptrdiff_t)(s->N + 1) * s->ld_z;
}
/* Doubles of such vectors over all stages. */
static inline size_t size_z(const qp_shape *s) {
    return (size_t)(s->N + 1) * (size_t)s->ld_z + (size_t)s->ld_p;
}
static inline size_t size_x(const qp_shape *s) {
    return (size_t)(s->N + 1) * (size_t)s->ld_x;
}

/* Sizes and structure of a problem; control_of [n_x] is the caller's memory. */
void qp_shape_of(const mhe_stage_problem *problem, int32_t *control_of, qp_shape *shape);
/* Doubles of all stages' matrices and vectors; hands them out from `memory`, zeroed. */
size_t qp_stages_size(const qp_shape *s);
void qp_stages_place(const qp_shape *s, double *memory, qp_stage *stages);

/* next [n_x] += F w, and w_out [n_z] += alpha F^T lambda. */
void qp_forward(const qp_shape *s, const qp_stage *stage, const double *w, double *next);
void qp_backward(const qp_shape *s, const qp_stage *stage, double alpha, const double *lambda,
                 double *w_out);
/* next [n_x] += P p, and w_out [n_z] += C^T p. */
void qp_forward_p(const qp_shape *s, const qp_stage *stage, const double *p, double *next);
void qp_backward_p(const qp_shape *s, const qp_stage *stage, const double *p, double *w_out);
/* out [n_p] += C w + of_p D p of a stage. */
void qp_add_costs_p(const qp_shape *s, const qp_stage *stage, const double *w, const double *p,
                    double of_p, double *out);
/* out [n_p] += sum over stages of C_k w_k + D_k p - P_k^T lambda_k; `w` with its p. */
void qp_sum_p(const qp_shape *s, const qp_stage *stages, const double *w, const double *lambda,
              double *out);
/* Slope of the Lagrangian without bounds: out = H w + g + (lambda_{k-1} on x) - F^T lambda_k, all
 * stages. `w` NULL: 0; `lambda` NULL: 0, without parameters. */
void qp_slope(const qp_shape *s, const qp_stage *stages, const double *w, const double *lambda,
              double *out);
/* gap [size_x] = F_k w_k + P_k p + b_k - x_{k+1} */
void qp_gaps(const qp_shape *s, const qp_stage *stages, const double *w, double *gap);
/* w_out [n_z] += factor H w, of a stage. */
void qp_add_curvature(const qp_shape *s, const qp_stage *stage, double factor, const double *w,
                      double *w_out);

#endif

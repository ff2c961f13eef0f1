/* SPDX-License-Identifier: Apache-2.0 */
/* kalman_answers.c: eight solutions at once, each of a system whose right-hand side is one unit.
 *
 * What kalman_solve() does, with eight numbers in the place of each: products with a vector become
 * products with eight, which cost hardly more. */
#include "kalman.h"

#include "../clones.h"

#include <string.h>

#define L KALMAN_LANES
#define ROW (sizeof(double) * L)

/* Eight doubles, wherever they lie; machines take as many instructions as they need. */
typedef double eight __attribute__((vector_size(64), aligned(8), may_alias));

#define AT(p) (*(const eight *)(p))
#define PUT(p) (*(eight *)(p))

/* Eight numbers at a place of a vector of so many times eight. */
static inline double *lanes(double *rows, ptrdiff_t at) {
    return rows + at * L;
}

static inline double *block_of(double *rows, int32_t k, int32_t ld, int32_t from) {
    return rows + ((ptrdiff_t)k * ld + from) * L;
}

/* Slopes of the costs to go of simple states, and what controls do without any pull -> w. */
CLONES static void sweep_simple(kalman *f, const qp_stage *stages, kalman_units *units, double *w) {
    const qp_shape *s = f->shape;
    const int32_t n = f->n, u = kalman_first_control(f), a = s->n_u + n;
    for (int32_t k = s->N; k >= 0; k--) {
        double *g = block_of(units->g, k, s->ld_z, 0), *to_go = block_of(units->s, k, s->ld_x, n);
        double *v = block_of(w, k, s->ld_z, 0);
        if (k == s->N) {
            memcpy(to_go, lanes(g, a), ROW * (size_t)f->m);
            memset(v, 0, ROW * (size_t)s->n_u);
            continue;
        }
        const double *alpha = stages[k].by_state + n, *beta = stages[k].by_control + n;
        const double *inverse = f->inverse + (ptrdiff_t)k * s->ld_z;
        const double *K = f->K + (ptrdiff_t)k * s->ld_x + n;
        const double *p_next = f->p + (ptrdiff_t)(k + 1) * s->ld_x + n;
        const double *s_next = block_of(units->s, k + 1, s->ld_x, n);
        const double *c = block_of(units->b, k, s->ld_x, n);
        for (int32_t i = 0; i < s->n_u; i++) {
            PUT(v + i * L) = -inverse[i] * AT(g + i * L);
        }
        for (int32_t j = 0; j < f->m; j++) {
            const eight t = p_next[j] * AT(c + j * L) + AT(s_next + j * L);
            const eight e = AT(lanes(g, u + j)) + beta[j] * t;
            PUT(lanes(v, u + j)) = -inverse[u + j] * e;
            PUT(to_go + j * L) = AT(lanes(g, a + j)) + alpha[j] * t - K[j] * e;
        }
    }
}

/* Rows of a triangle that are solved together; what they see of the others is a product. */
#define AT_ONCE 4

/* y = U^-T y, [n x 8] */
CLONES static void substitute(const kernels *by, int32_t n, const double *U, int32_t ld,
                              const double *inverse, double *y) {
    for (int32_t i = 0; i < n; i += AT_ONCE) {
        const int32_t end = i + AT_ONCE < n ? i + AT_ONCE : n;
        double *rows = lanes(y, i);
        by->product(end - i, L, i, -1, U + i, ld, y, L, rows, rows, L, 0);
        for (int32_t r = i; r < end; r++) {
            eight row = AT(lanes(y, r));
            for (int32_t j = i; j < r; j++) {
                row -= U[j * ld + r] * AT(lanes(y, j));
            }
            PUT(lanes(y, r)) = inverse[r] * row;
        }
    }
}

/* y = -U^-1 y */
CLONES static void substitute_back(const kernels *by, int32_t n, const double *U, int32_t ld,
                                   const double *inverse, double *y) {
    for (int32_t end = n; end > 0;) {
        const int32_t i = (end - 1) / AT_ONCE * AT_ONCE;
        double *rows = lanes(y, i);
        by->product_rows(end - i, L, n - end, 1, U + i * ld + end, ld, lanes(y, end), L, rows, rows,
                         L);
        for (int32_t r = end - 1; r >= i; r--) {
            eight row = AT(lanes(y, r));
            for (int32_t j = r + 1; j < end; j++) {
                row += U[r * ld + j] * AT(lanes(y, j));
            }
            PUT(lanes(y, r)) = -inverse[r] * row;
        }
        end = i;
    }
}

/* Means behind each measurement, from stage `from` on: there is nothing before it. */
CLONES static void sweep_forward(kalman *f, const qp_stage *stages, kalman_units *units,
                                 int32_t from, double *w) {
    const qp_shape *s = f->shape;
    const int32_t n = f->n, n_b = s->n_tied, ld_d = f->ld_d, u = kalman_first_control(f);
    const size_t none = ROW * (size_t)(from + 1);
    memset(units->x, 0, none * (size_t)s->ld_x);
    memset(units->z, 0, none * (size_t)ld_d);
    for (int32_t k = from; k < s->N; k++) {
        const int32_t width = k + 1 == s->N ? n : s->n_x;
        const double *beta = stages[k].by_control + n;
        const double *closed = f->closed + (ptrdiff_t)k * s->ld_x + n;
        const double *v = block_of(w, k, s->ld_z, 0), *x = block_of(units->x, k, s->ld_x, 0);
        double *m = block_of(units->x, k + 1, s->ld_x, 0), *z = units->row;
        double *y = block_of(units->z, k + 1, ld_d, 0);
        const double *U = kalman_U_of(f, k + 1), *U_inverse = kalman_of_d(f, f->U_inverse, k + 1);
        memcpy(m, block_of(units->b, k, s->ld_x, 0), ROW * (size_t)s->n_x);
        for (int32_t j = 0; j < f->m; j++) {
            const double by_state = k > from ? closed[j] : 0;
            PUT(m + (n + j) * L) += beta[j] * AT(v + (u + j) * L) + by_state * AT(x + (n + j) * L);
        }
        s->kernels->product(n, L, s->n_u, 1, kalman_FT_of(f, k), ld_d, v, L, m, z, L, 0);
        if (k > from) {
            s->kernels->product(n, L, s->n_x, 1, kalman_C_of(f, k), ld_d, x, L, z, z, L, 0);
        }
        memcpy(m, z, ROW * (size_t)n);
        memcpy(y, block_of(units->g, k + 1, s->ld_z, s->n_u), ROW * (size_t)n);
        if (units->dense) {
            substitute(s->kernels, n_b, U, ld_d, U_inverse, y);
            for (int32_t i = n_b; i < n; i++) {
                PUT(lanes(y, i)) = U_inverse[i] * AT(lanes(y, i));
            }
        }
        s->kernels->product_rows(n_b, L, n_b, 1, U, ld_d, z, L, y, y, L);
        for (int32_t i = n_b; i < n; i++) {
            PUT(lanes(y, i)) += U[i * (ld_d + 1)] * AT(lanes(z, i));
        }
        substitute(s->kernels, n, kalman_W_of(f, k + 1), f->ld_w,
                   kalman_of_d(f, f->W_inverse, k + 1), y);
        s->kernels->product(width, L, n, -1, kalman_W_of(f, k + 1) + n, f->ld_w, y, L, m, m, L, 0);
    }
}

/* Pulls: dense states, multipliers of the closed loop, controls of the closed loop -> w. */
CLONES static void sweep_back(kalman *f, const qp_stage *stages, kalman_units *units, double *w,
                              double *lambda) {
    const qp_shape *s = f->shape;
    const int32_t n = f->n, n_b = s->n_tied, n_x = s->n_x, u = kalman_first_control(f);
    double *eta = units->eta, *pull = units->pull;
    memset(eta, 0, ROW * (size_t)n_x);
    for (int32_t k = s->N; k > 0; k--) {
        double *x = block_of(w, k, s->ld_z, s->n_u), *y = block_of(units->z, k, f->ld_d, 0);
        double *out = block_of(lambda, k - 1, s->ld_x, 0), *v = block_of(w, k - 1, s->ld_z, 0);
        const double *U = kalman_U_of(f, k), *W = kalman_W_of(f, k);
        memcpy(x, block_of(units->x, k, s->ld_x, 0), ROW * (size_t)n);
        if (k < s->N) {
            s->kernels->product_rows(n, L, n_x, 1, kalman_D_of(f, k), s->ld_x, eta, L, x, x, L);
            s->kernels->product_rows(n, L, n_x, 1, W + n, f->ld_w, eta, L, y, y, L);
        }
        substitute_back(s->kernels, n, W, f->ld_w, kalman_of_d(f, f->W_inverse, k), y);
        memcpy(lanes(out, n), lanes(eta, n), ROW * (size_t)f->m);
        s->kernels->product(n_b, L, n_b, 1, U, f->ld_d, y, L, eta, out, L, 0);
        for (int32_t i = n_b; i < n; i++) {
            PUT(lanes(out, i)) = AT(lanes(eta, i)) + U[i * (f->ld_d + 1)] * AT(lanes(y, i));
        }
        s->kernels->product_rows(s->n_u, L, n, 1, kalman_FT_of(f, k - 1), f->ld_d, out, L, NULL,
                                 pull, L);
        const double *beta = stages[k - 1].by_control + n;
        const double *closed = f->closed + (ptrdiff_t)(k - 1) * s->ld_x + n;
        const double *inverse = f->inverse + (ptrdiff_t)(k - 1) * s->ld_z;
        memset(eta, 0, ROW * (size_t)n);
        for (int32_t j = 0; j < f->m; j++) {
            const eight of_state = AT(lanes(out, n + j));
            PUT(lanes(pull, u + j)) += beta[j] * of_state;
            PUT(lanes(eta, n + j)) = closed[j] * of_state;
        }
        for (int32_t i = 0; i < s->n_u; i++) {
            PUT(lanes(v, i)) += inverse[i] * AT(lanes(pull, i));
        }
        if (k > 1) {
            s->kernels->product_rows(n_x, L, n, 1, kalman_C_of(f, k - 1), f->ld_d, out, L, eta, eta,
                                     L);
        }
    }
}

/* Simple states and their controls, and the multipliers of the former as they are with their costs.
 */
CLONES static void follow_simple(kalman *f, const qp_stage *stages, kalman_units *units, double *w,
                                 double *lambda) {
    const qp_shape *s = f->shape;
    const int32_t n = f->n, u = kalman_first_control(f), a = s->n_u + n;
    memset(lanes(w, s->n_u), 0, ROW * (size_t)s->n_x);
    for (int32_t k = 0; k < s->N && f->m > 0; k++) {
        const double *alpha = stages[k].by_state + n, *beta = stages[k].by_control + n;
        const double *K = f->K + (ptrdiff_t)k * s->ld_x + n;
        const double *p_next = f->p + (ptrdiff_t)(k + 1) * s->ld_x + n;
        const double *s_next = block_of(units->s, k + 1, s->ld_x, n);
        const double *c = block_of(units->b, k, s->ld_x, n);
        double *now = block_of(w, k, s->ld_z, 0), *next = block_of(w, k + 1, s->ld_z, a);
        double *multiplier = block_of(lambda, k, s->ld_x, n);
        for (int32_t j = 0; j < f->m; j++) {
            const eight state = AT(lanes(now, a + j));
            const eight control = AT(lanes(now, u + j)) - K[j] * state;
            const eight then = alpha[j] * state + beta[j] * control + AT(c + j * L);
            PUT(lanes(now, u + j)) = control;
            PUT(next + j * L) = then;
            PUT(multiplier + j * L) -= p_next[j] * then + AT(s_next + j * L);
        }
    }
}

void kalman_answer(kalman *f, const qp_stage *stages, int32_t n, const kalman_unit *list, double *w,
                   double *lambda) {
    const qp_shape *s = f->shape;
    kalman_units *units = &f->units;
    int32_t first = s->N;
    units->dense = 0;
    for (int32_t i = 0; i < n; i++) {
        const int32_t k = (int32_t)(list[i].at / s->ld_z), j = (int32_t)(list[i].at % s->ld_z);
        const int32_t from = j < s->n_u ? k : k - 1; /* a state moves with what comes before it */
        first = from < first ? from : first;
        units->dense |= j >= s->n_u && j < s->n_u + f->n;
        lanes(units->g, list[i].at)[i] = list[i].g;
        for (int32_t x = 0; list[i].moves && x < s->n_x; x++) {
            lanes(units->b, (ptrdiff_t)k * s->ld_x + x)[i] =
                x < f->n                ? stages[k].F[(ptrdiff_t)x * s->ld_z + j]
                : s->control_of[x] == j ? stages[k].by_control[x]
                                        : 0;
        }
    }
    sweep_simple(f, stages, units, w);
    /* Through their costs to go simple states have earlier controls move, too. */
    sweep_forward(f, stages, units, f->m > 0 ? 0 : first, w);
    sweep_back(f, stages, units, w, lambda);
    follow_simple(f, stages, units, w, lambda);
    for (int32_t i = 0; i < n; i++) {
        const ptrdiff_t k = list[i].at / s->ld_z;
        lanes(units->g, list[i].at)[i] = 0;
        for (int32_t x = 0; x < s->n_x; x++) {
            lanes(units->b, k * s->ld_x + x)[i] = 0;
        }
        if (list[i].moves) {
            lanes(w, list[i].at)[i] = 1;
        }
    }
}

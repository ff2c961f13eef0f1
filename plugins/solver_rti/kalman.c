/* SPDX-License-Identifier: Apache-2.0 */
#include "kalman.h"

#include <math.h>
#include <string.h>

int32_t kalman_takes(const qp_shape *s) {
    return s->separable && s->n_dense > 0 && s->n_p == 0;
}

/* ---- memory: [count] blocks of so many doubles, in the order of the struct ---- */

typedef struct piece {
    double **at;
    size_t n;
} piece;

enum { N_PIECES = 36 };

static void pieces(const qp_shape *s, kalman *f, piece *out) {
    const size_t N = (size_t)s->N, n = (size_t)s->n_dense, n_x = (size_t)s->n_x;
    const size_t n_z = (size_t)s->n_z, n_u = (size_t)s->n_u;
    const size_t ld_d = (size_t)KERNEL_LD(s->n_dense), ld_x = (size_t)s->ld_x;
    const size_t ld_w = (size_t)KERNEL_LD(s->n_dense + s->n_x), ld_z = (size_t)s->ld_z;
    const size_t x = size_x(s), z = size_z(s), simple = s->n_dense < s->n_x ? n_x : 0;
    const piece all[N_PIECES] = {{&f->FT, N * n_z * ld_d},
                                 {&f->h, z},
                                 {&f->C, N * simple * ld_d},
                                 {&f->U, (N + 1) * n * ld_d},
                                 {&f->U_inverse, (N + 1) * ld_d},
                                 {&f->W, (N + 1) * n * ld_w},
                                 {&f->W_inverse, (N + 1) * ld_d},
                                 {&f->D, (N + 1) * n * ld_x},
                                 {&f->used, z},
                                 {&f->p, x + ld_x},
                                 {&f->K, x},
                                 {&f->closed, x},
                                 {&f->inverse, z},
                                 {&f->before, n_x * ld_x},
                                 {&f->after, simple * ld_x},
                                 {&f->T, n_x * ld_d},
                                 {&f->L, n * ld_d},
                                 {&f->noise, n_u * ld_d},
                                 {&f->s, x + ld_x},
                                 {&f->v, z},
                                 {&f->z, (N + 1) * ld_d},
                                 {&f->x, (N + 1) * ld_x},
                                 {&f->pull, ld_z},
                                 {&f->eta, ld_x},
                                 {&f->lambda, ld_d},
                                 {&f->row, ld_w},
                                 {&f->next, ld_x},
                                 {&f->units.g, KALMAN_LANES * z},
                                 {&f->units.b, KALMAN_LANES * x},
                                 {&f->units.s, KALMAN_LANES * x},
                                 {&f->units.z, KALMAN_LANES * (N + 1) * ld_d},
                                 {&f->units.x, KALMAN_LANES * x},
                                 {&f->units.row, KALMAN_LANES * ld_d},
                                 {&f->units.eta, KALMAN_LANES * ld_x},
                                 {&f->units.pull, KALMAN_LANES * ld_z},
                                 {&f->units.answers, KALMAN_GROUPS * KALMAN_LANES * (z + x)}};
    memcpy(out, all, sizeof all);
}

size_t kalman_size(const qp_shape *s) {
    piece all[N_PIECES];
    kalman f;
    size_t sum = 0;
    pieces(s, &f, all);
    for (int32_t i = 0; i < N_PIECES && kalman_takes(s); i++) {
        sum += all[i].n;
    }
    return sum;
}

void kalman_place(kalman *f, const qp_shape *s, double *memory) {
    piece all[N_PIECES];
    *f = (kalman){.shape = s,
                  .n = s->n_dense,
                  .m = s->n_x - s->n_dense,
                  .ld_d = KERNEL_LD(s->n_dense),
                  .ld_w = KERNEL_LD(s->n_dense + s->n_x)};
    if (!kalman_takes(s)) {
        return;
    }
    pieces(s, f, all);
    memset(memory, 0, sizeof(double) * (kalman_size(s) - all[N_PIECES - 1].n)); /* but answers */
    for (int32_t i = 0; i < N_PIECES; i++) {
        *all[i].at = memory;
        memory += all[i].n;
    }
}

void kalman_begin(kalman *f, const qp_stage *stages, int32_t free) {
    const qp_shape *s = f->shape;
    f->known = 0;
    f->free = free;
    for (int32_t k = 0; k <= s->N; k++) {
        double *h = row_z(s, f->h, k);
        for (int32_t i = 0; i < s->n_z; i++) {
            h[i] = stages[k].H[(ptrdiff_t)i * (s->ld_z + 1)];
        }
        if (k < s->N) {
            s->kernels->transpose(f->n, s->n_z, stages[k].F, s->ld_z, kalman_FT_of(f, k), f->ld_d);
        }
    }
}

/* ---- factorisation ---- */

/* Takes the costs off the simple states of stage k; 0: a curvature is not positive. */
static int32_t complete_squares(kalman *f, const qp_stage *stage, const double *diagonal,
                                int32_t k) {
    const qp_shape *s = f->shape;
    const ptrdiff_t z = (ptrdiff_t)k * s->ld_z, a = s->n_u + f->n, u = kalman_first_control(f);
    const double *h = f->h + z, *d = diagonal + z;
    const double *alpha = stage->by_state + f->n, *beta = stage->by_control + f->n;
    const double *p_next = kalman_simple_x(f, f->p, k + 1);
    double *inverse = f->inverse + z, *p = f->p + (ptrdiff_t)k * s->ld_x + f->n;
    double *K = f->K + (ptrdiff_t)k * s->ld_x + f->n;
    double *closed = f->closed + (ptrdiff_t)k * s->ld_x + f->n;
    int32_t positive = 1;
    for (int32_t i = 0; i < s->n_u; i++) {
        const double r = h[i] + d[i];
        inverse[i] = f->held[z + i] ? 0 : 1 / r;
        positive &= f->held[z + i] || (r > 0 && inverse[i] > 0);
    }
    for (int32_t j = 0; j < f->m; j++) {
        const double r = h[u + j] + d[u + j], all = r + beta[j] * beta[j] * p_next[j];
        const double by = f->held[z + u + j] ? 0 : 1 / all;
        const double left = f->held[z + u + j] ? 1 : r * by;
        inverse[u + j] = by;
        K[j] = beta[j] * alpha[j] * p_next[j] * by;
        closed[j] = alpha[j] * left;
        p[j] = h[a + j] + d[a + j] + alpha[j] * alpha[j] * p_next[j] * left;
    }
    return positive;
}

/* Rows of F^T for the closed loop. */
static void close_loop(kalman *f, int32_t k) {
    const qp_shape *s = f->shape;
    const double *FT = kalman_FT_of(f, k), *K = kalman_simple_x(f, f->K, k);
    const ptrdiff_t u = kalman_first_control(f);
    double *C = kalman_C_of(f, k);
    if (f->m == 0) {
        return;
    }
    memcpy(C, FT + s->n_u * f->ld_d, sizeof(double) * (size_t)(s->n_x * f->ld_d));
    for (int32_t j = 0; j < f->m; j++) {
        double *to = C + (f->n + j) * f->ld_d;
        const double *from = FT + (u + j) * f->ld_d, by = K[j];
        for (int32_t i = 0; i < f->ld_d; i++) {
            to[i] -= by * from[i];
        }
    }
}

/* What the controls bring, on and above the diagonal of `next`: half of each covariance on either
 * side, and nothing of those that are held. */
static void add_noise(kalman *f, int32_t k, double *next) {
    const qp_shape *s = f->shape;
    const double *FT = kalman_FT_of(f, k), *inverse = f->inverse + (ptrdiff_t)k * s->ld_z;
    int32_t n = 0;
    for (int32_t j = 0; j < s->n_u; j++) {
        if (inverse[j] == 0) {
            continue;
        }
        double *to = f->noise + n * f->ld_d;
        const double *from = FT + j * f->ld_d, by = sqrt(inverse[j]);
        for (int32_t i = 0; i < f->ld_d; i++) {
            to[i] = by * from[i];
        }
        n++;
    }
    s->kernels->product(f->n, f->n, n, 1, f->noise, f->ld_d, f->noise, f->ld_d, NULL, next, s->ld_x,
                        1);
}

/* Sigma' of a first node that is a variable; 0: its cost is not positive definite. */
static int32_t begin_free(kalman *f, const qp_stage *stage, const double *diagonal) {
    const qp_shape *s = f->shape;
    const int32_t n = f->n, ld_w = f->ld_w;
    const double *p = kalman_simple_x(f, f->p, 0);
    const uint8_t *held = f->held + s->n_u;
    double *W = kalman_W_of(f, 0); /* [Q, I], without what is held */
    memset(W, 0, sizeof(double) * (size_t)(n * ld_w));
    for (int32_t i = 0; i < n; i++) {
        const double *from = stage->H + (s->n_u + i) * s->ld_z + s->n_u;
        for (int32_t j = i; j < n; j++) {
            W[i * ld_w + j] = held[i] || held[j] ? 0 : from[j];
        }
        W[i * (ld_w + 1)] = held[i] ? 1 : from[i] + diagonal[s->n_u + i];
        W[i * (ld_w + 1) + n] = !held[i];
    }
    if (!s->kernels->factor(n, 2 * n, W, ld_w, kalman_of_d(f, f->W_inverse, 0))) {
        return 0;
    }
    double *after = kalman_after(f, 0);
    memset(after, 0, sizeof(double) * (size_t)(s->n_x * s->ld_x));
    s->kernels->product(n, n, n, 1, W + n, ld_w, W + n, ld_w, NULL, after, s->ld_x, 1);
    s->kernels->mirror(n, after, s->ld_x);
    for (int32_t j = 0; j < f->m; j++) {
        if (!held[n + j] && !(p[j] > 0)) {
            return 0;
        }
        after[(n + j) * (s->ld_x + 1)] = held[n + j] ? 0 : 1 / p[j];
    }
    if (f->m > 0) {
        memcpy(kalman_D_of(f, 0), after, sizeof(double) * (size_t)(n * s->ld_x));
    }
    return 1;
}

/* Sigma of the next node from Sigma' of node k; that of a first one that is fixed is 0. */
static void predict(kalman *f, const qp_stage *stage, int32_t k) {
    const qp_shape *s = f->shape;
    const int32_t n = f->n, n_x = s->n_x, ld_x = s->ld_x, ld_d = f->ld_d;
    const double *C = kalman_C_of(f, k), *closed = kalman_simple_x(f, f->closed, k);
    const double *beta = stage->by_control + n, *after = kalman_after(f, k);
    const double *inverse = f->inverse + (ptrdiff_t)k * s->ld_z + kalman_first_control(f);
    const double *of_control = kalman_FT_of(f, k) + kalman_first_control(f) * ld_d;
    const int32_t spread = k > 0 || f->free;
    double *next = f->before;
    add_noise(f, k, next);
    if (spread) {
        s->kernels->product(n_x, n, n_x, 1, after, ld_x, C, ld_d, NULL, f->T, ld_d, 0);
        s->kernels->product(n, n, n_x, 1, C, ld_d, f->T, ld_d, next, next, ld_x, 1);
    }
    for (int32_t j = 0; j < f->m; j++) {
        double *row = next + (n + j) * ld_x;
        const double *t = f->T + (n + j) * ld_d, *e = of_control + j * ld_d;
        const double by_t = spread ? closed[j] : 0, by_e = beta[j] * inverse[j];
        for (int32_t i = 0; i < n; i++) {
            row[i] = by_t * t[i] + by_e * e[i];
        }
        const double *old = after + (n + j) * ld_x + n;
        for (int32_t i = 0; i < f->m; i++) {
            row[n + i] = by_t * closed[i] * old[i];
        }
        row[n + j] += beta[j] * beta[j] * inverse[j];
    }
    s->kernels->transpose(f->m, n, next + n * ld_x, ld_x, next + n, ld_x);
    s->kernels->mirror(n, next, ld_x);
}

/* Whether stage k would come to what it was: its controls' covariances and the measurement after
 * it. Takes note of the diagonals. */
static int32_t is_kept(kalman *f, const double *diagonal, int32_t k) {
    const qp_shape *s = f->shape;
    const ptrdiff_t of_u = (ptrdiff_t)k * s->ld_z, of_x = of_u + s->ld_z + s->n_u;
    const size_t u = sizeof(double) * (size_t)s->n_u, x = sizeof(double) * (size_t)f->n;
    const int32_t kept = k < f->known && memcmp(f->used + of_u, f->inverse + of_u, u) == 0 &&
                         memcmp(f->used + of_x, diagonal + of_x, x) == 0;
    memcpy(f->used + of_u, f->inverse + of_u, u);
    memcpy(f->used + of_x, diagonal + of_x, x);
    return kept;
}

/* The first stage that has to be factorised. */
static int32_t first_changed(kalman *f, const double *diagonal) {
    int32_t first = f->shape->N;
    for (int32_t k = f->shape->N - 1; k >= 0; k--) {
        first = is_kept(f, diagonal, k) ? first : k;
    }
    return f->m == 0 && !f->free ? first : 0;
}

int32_t kalman_factor(kalman *f, const qp_stage *stages, const double *diagonal,
                      const uint8_t *held) {
    const qp_shape *s = f->shape;
    const ptrdiff_t end = (ptrdiff_t)s->N * s->ld_z + s->n_u + f->n;
    double *p = f->p + (ptrdiff_t)s->N * s->ld_x + f->n;
    f->held = held;
    for (int32_t j = 0; j < f->m; j++) {
        p[j] = f->h[end + j] + diagonal[end + j];
    }
    for (int32_t k = s->N - 1; k >= 0; k--) {
        if (!complete_squares(f, &stages[k], diagonal, k)) {
            f->known = 0;
            return 0;
        }
    }
    const int32_t first = first_changed(f, diagonal);
    f->known = 0;
    if (f->free && !begin_free(f, &stages[0], diagonal)) {
        return 0;
    }
    for (int32_t k = first; k < s->N; k++) {
        close_loop(f, k);
        predict(f, &stages[k], k);
        if (!kalman_measure(f, &stages[k + 1], diagonal, k + 1)) {
            return 0;
        }
    }
    f->known = s->N;
    return 1;
}

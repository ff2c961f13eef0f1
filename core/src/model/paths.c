/* SPDX-License-Identifier: Apache-2.0 */
/* paths.c: velocities, moments and accelerations of the paths, each over the few coordinates that
 * it sees: a stretch of whole fours where the model has so many (system_build.c), four side by
 * side.
 *
 * Compiled without loop vectorisation (CMakeLists.txt): what is worth it stands here as vectors;
 * the loops over the one to three that are left cost more with it. */
#include "base/clones.h"
#include "model/system_private.h"

/* Four doubles, wherever they lie. */
typedef double lanes __attribute__((vector_size(32), aligned(8), may_alias));

#define AT(p) (*(lanes *)(p))
#define FROM(p) (*(const lanes *)(p))
#define INLINED static inline __attribute__((always_inline))

/* What the loops below read of a context, out of the compiler's doubts about aliases. */
typedef struct paths_view {
    int32_t n_q, from, to;
    const int32_t *first, *end;
    const double *length_q, *length_qq;
} paths_view;

static paths_view view(const mhi_system_context *c, int32_t from, int32_t to) {
    const mhi_system *s = c->system;
    return (paths_view){s->face.n_q, from, to, s->first, s->end, c->length_q, c->length_qq};
}

/* ---- velocities ---- */

INLINED double dot(const double *a, const double *b, int32_t first, int32_t end) {
    lanes sum = {0};
    int32_t j = first;
    for (; j + 4 <= end; j += 4) {
        sum += FROM(a + j) * FROM(b + j);
    }
    double rest = (sum[0] + sum[1]) + (sum[2] + sum[3]);
    for (; j < end; j++) {
        rest += a[j] * b[j];
    }
    return rest;
}

/* out = L_qq v; L_qq is symmetric. */
INLINED void bend(const double *l_qq, int32_t n_q, const double *v, int32_t first, int32_t end,
                  double *out) {
    int32_t j = first;
    for (; j + 4 <= end; j += 4) {
        lanes sum = {0};
        for (int32_t i = first; i < end; i++) {
            sum += v[i] * FROM(l_qq + i * n_q + j);
        }
        AT(out + j) = sum;
    }
    for (; j < end; j++) {
        double sum = 0;
        for (int32_t i = first; i < end; i++) {
            sum += v[i] * l_qq[i * n_q + j];
        }
        out[j] = sum;
    }
}

/* Of a model of four coordinates: vectors that never leave their registers. */
INLINED void velocities4(const paths_view *p, const double *v, double *velocity,
                         double *velocity_q) {
    const lanes by = FROM(v);
    const double v0 = v[0], v1 = v[1], v2 = v[2], v3 = v[3];
    for (int32_t m = p->from; m < p->to; m++) {
        const lanes product = by * FROM(p->length_q + 4 * m);
        velocity[m] = (product[0] + product[1]) + (product[2] + product[3]);
    }
    for (int32_t m = p->from; m < p->to && velocity_q != NULL; m++) {
        const double *l_qq = p->length_qq + 16 * m;
        AT(velocity_q + 4 * m) =
            (v0 * FROM(l_qq) + v1 * FROM(l_qq + 4)) + (v2 * FROM(l_qq + 8) + v3 * FROM(l_qq + 12));
    }
}

CLONES static void velocities(const paths_view *p, const double *v, double *velocity,
                              double *velocity_q) {
    const int32_t n_q = p->n_q;
    if (n_q == 4) {
        velocities4(p, v, velocity, velocity_q);
        return;
    }
    for (int32_t m = p->from; m < p->to; m++) {
        const int32_t first = p->first[m], end = p->end[m];
        velocity[m] = dot(p->length_q + m * n_q, v, first, end);
        if (velocity_q != NULL) {
            bend(p->length_qq + m * n_q * n_q, n_q, v, first, end, velocity_q + m * n_q);
        }
    }
}

void mhi_path_velocities(mhi_system_context *c, int32_t from, int32_t to, const double *v,
                         int32_t derivatives) {
    const paths_view p = view(c, from, to);
    velocities(&p, v, c->velocity, derivatives ? c->velocity_q : NULL);
}

/* ---- moments ---- */

CLONES static void moments(const paths_view *p, const double *force, double *moment) {
    const int32_t n_q = p->n_q;
    if (n_q == 4) {
        lanes sum = FROM(moment);
        for (int32_t m = p->from; m < p->to; m++) {
            sum -= force[m - p->from] * FROM(p->length_q + 4 * m);
        }
        AT(moment) = sum;
        return;
    }
    for (int32_t m = p->from; m < p->to; m++) {
        const double *l_q = p->length_q + m * n_q, f = force[m - p->from];
        const int32_t end = p->end[m];
        int32_t j = p->first[m];
        for (; j + 4 <= end; j += 4) {
            AT(moment + j) -= f * FROM(l_q + j);
        }
        for (; j < end; j++) {
            moment[j] -= f * l_q[j];
        }
    }
}

void mhi_path_moments(const mhi_system_context *c, int32_t from, int32_t to, const double *force,
                      double *moment) {
    const paths_view p = view(c, from, to);
    moments(&p, force, moment);
}

INLINED void moment_derivatives4(const paths_view *p, const double *velocity_q,
                                 const mhi_path_forces *f) {
    lanes sum_q[4], sum_v[4];
    for (int32_t i = 0; i < 4; i++) {
        sum_q[i] = FROM(f->moment_q + 4 * i);
        sum_v[i] = FROM(f->moment_v + 4 * i);
    }
    for (int32_t m = p->from; m < p->to; m++) {
        const int32_t k = m - p->from;
        const double *l_q = p->length_q + 4 * m, *l_qq = p->length_qq + 16 * m;
        const lanes of_v = f->force_w[k] * FROM(l_q);
        const lanes of_q = f->force_l[k] * FROM(l_q) + f->force_w[k] * FROM(velocity_q + 4 * m);
        const double force = f->force[k];
        AT(f->force_v + 4 * k) = of_v;
        AT(f->force_q + 4 * k) = of_q;
        for (int32_t i = 0; i < 4; i++) {
            sum_q[i] -= force * FROM(l_qq + 4 * i) + l_q[i] * of_q;
            sum_v[i] -= l_q[i] * of_v;
        }
    }
    for (int32_t i = 0; i < 4; i++) {
        AT(f->moment_q + 4 * i) = sum_q[i];
        AT(f->moment_v + 4 * i) = sum_v[i];
    }
}

/* dF/dq = F_l L_q + F_w dLdot/dq,  dF/dv = F_w L_q,
 * d moment/dq = -(L_qq F + L_q^T dF/dq),  d moment/dv = -L_q^T dF/dv. */
CLONES static void moment_derivatives(const paths_view *p, const double *velocity_q,
                                      const mhi_path_forces *f) {
    const int32_t n_q = p->n_q;
    if (n_q == 4) {
        moment_derivatives4(p, velocity_q, f);
        return;
    }
    for (int32_t m = p->from; m < p->to; m++) {
        const int32_t first = p->first[m], end = p->end[m], k = m - p->from;
        const double *l_q = p->length_q + m * n_q, *w_q = velocity_q + m * n_q;
        const double force = f->force[k], by_l = f->force_l[k], by_w = f->force_w[k];
        double *f_q = f->force_q + k * n_q, *f_v = f->force_v + k * n_q;
        int32_t j = first;
        for (; j + 4 <= end; j += 4) {
            const lanes of_v = by_w * FROM(l_q + j);
            const lanes of_q = by_l * FROM(l_q + j) + by_w * FROM(w_q + j);
            AT(f_v + j) = of_v;
            AT(f_q + j) = of_q;
            for (int32_t i = first; i < end; i++) {
                const int32_t at = i * n_q + j;
                AT(f->moment_q + at) -=
                    force * FROM(p->length_qq + m * n_q * n_q + at) + l_q[i] * of_q;
                AT(f->moment_v + at) -= l_q[i] * of_v;
            }
        }
        for (; j < end; j++) {
            f_v[j] = by_w * l_q[j];
            f_q[j] = by_l * l_q[j] + by_w * w_q[j];
            for (int32_t i = first; i < end; i++) {
                const int32_t at = i * n_q + j;
                f->moment_q[at] -= force * p->length_qq[m * n_q * n_q + at] + l_q[i] * f_q[j];
                f->moment_v[at] -= l_q[i] * f_v[j];
            }
        }
    }
}

void mhi_path_moment_derivatives(const mhi_system_context *c, int32_t from, int32_t to,
                                 const mhi_path_forces *f) {
    const paths_view p = view(c, from, to);
    moment_derivatives(&p, c->velocity_q, f);
}

/* ---- accelerations ---- */

/* Rows i ... i + 3 of `columns` (4 or 1) columns from k on; all loops over columns unroll. */
INLINED void pull(const paths_view *p, const double *inverse, int32_t ld, const double *by,
                  const int32_t *muscle, int32_t i, int32_t k, int32_t columns, int32_t n,
                  double *out) {
    lanes sum[4] = {{0}};
    for (int32_t c = 0; c < columns; c++) {
        const int32_t m = muscle == NULL ? k + c : muscle[k + c];
        const double *l_q = p->length_q + m * p->n_q;
        for (int32_t j = p->first[m]; j < p->end[m]; j++) {
            sum[c] -= (l_q[j] * by[k + c]) * FROM(inverse + j * ld + i); /* symmetric */
        }
    }
    for (int32_t r = 0; r < 4; r++) {
        for (int32_t c = 0; c < columns; c++) {
            out[(i + r) * n + k + c] = sum[c][r];
        }
    }
}

INLINED void accelerations4(const paths_view *p, const double *inverse, int32_t ld,
                            const double *by, const int32_t *muscle, int32_t n, double *out) {
    const lanes r0 = FROM(inverse), r1 = FROM(inverse + ld), r2 = FROM(inverse + 2 * ld),
                r3 = FROM(inverse + 3 * ld);
    for (int32_t k = 0; k < n; k++) {
        const double *l_q = p->length_q + 4 * (muscle == NULL ? k : muscle[k]);
        const lanes column = -by[k] * ((l_q[0] * r0 + l_q[1] * r1) + (l_q[2] * r2 + l_q[3] * r3));
        for (int32_t i = 0; i < 4; i++) {
            out[i * n + k] = column[i];
        }
    }
}

CLONES static void accelerations(const paths_view *p, const double *inverse, int32_t ld,
                                 const double *by, const int32_t *muscle, int32_t n, double *out) {
    int32_t i = 0;
    if (p->n_q == 4) {
        accelerations4(p, inverse, ld, by, muscle, n, out);
        return;
    }
    for (; i + 4 <= p->n_q; i += 4) {
        int32_t k = 0;
        for (; k + 4 <= n; k += 4) {
            pull(p, inverse, ld, by, muscle, i, k, 4, n, out);
        }
        for (; k < n; k++) {
            pull(p, inverse, ld, by, muscle, i, k, 1, n, out);
        }
    }
    for (; i < p->n_q; i++) {
        for (int32_t k = 0; k < n; k++) {
            const int32_t m = muscle == NULL ? k : muscle[k];
            double sum = 0;
            for (int32_t j = p->first[m]; j < p->end[m]; j++) {
                sum -= p->length_q[m * p->n_q + j] * by[k] * inverse[i * ld + j];
            }
            out[i * n + k] = sum;
        }
    }
}

void mhi_path_accelerations(const mhi_system_context *c, const double *inverse, int32_t ld,
                            const double *by, const int32_t *muscle, int32_t n, double *out) {
    const paths_view p = view(c, 0, c->system->face.n_m);
    accelerations(&p, inverse, ld, by, muscle, n, out);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* many.c: forces of muscles that follow each other on the same curves, four side by side.
 *
 * The same formulas as in hill.c and the curve sets, to the last few bits: both sides of every
 * choice are computed, exp is that of exponential.h. What the loops read of the muscles stands in
 * columns, one row a muscle (hill_columns). */
#include "hill.h"

#include "../clones.h"
#include "exponential.h"
#include "shapes.h"

#include <math.h>
#include <stdlib.h>

#define CHUNK 8 /* muscles whose intermediate values lie on the stack */
#define INLINED static inline __attribute__((always_inline))

/* Fibres and curves of a chunk. */
struct chunk {
    double n[CHUNK], n_l[CHUNK], s[CHUNK], s_l[CHUNK], s_w[CHUNK], pull[CHUNK], pull_l[CHUNK];
    double f[CHUNK], f_a[CHUNK], f_n[CHUNK], f_s[CHUNK];
};

mhe_status hill_make_columns(struct hill *hill) {
    const int32_t n = hill->n;
    double *memory = calloc((size_t)(HILL_COLUMNS * n) + 1, sizeof *memory);
    hill->columns = memory;
    for (int32_t i = 0; i < n && memory != NULL; i++) {
        const struct hill_muscle *m = &hill->m[i];
        const double values[HILL_COLUMNS] = {[HILL_F_MAX] = m->f_max,
                                             [HILL_L_SLACK] = m->l_slack,
                                             [HILL_INVERSE] = m->inverse,
                                             [HILL_SPEED] = m->speed,
                                             [HILL_DAMPING] = m->damping,
                                             [HILL_PULL] = m->pull,
                                             [HILL_INV_COS] = m->inv_cos,
                                             [HILL_HEIGHT] = m->height,
                                             [HILL_PASSIVE_FROM] = m->passive_from,
                                             [HILL_PASSIVE_RAMP] = m->passive_ramp,
                                             [HILL_PASSIVE_RATE] = m->passive_rate,
                                             [HILL_PASSIVE_OFFSET] = m->passive_offset,
                                             [HILL_PASSIVE_SCALE] = m->passive_scale};
        for (int32_t k = 0; k < HILL_COLUMNS; k++) {
            memory[k * n + i] = values[k];
        }
    }
    return memory != NULL ? MHE_OK : MHE_E_MEMORY;
}

/* ---- fibres ---- */

INLINED void fibres_at_angle(const struct hill_columns *m, int32_t n, const double *l,
                             const double *w, struct chunk *c) {
    for (int32_t i = 0; i < n; i++) {
        c->n_l[i] = m->at[HILL_INV_COS][i] * m->at[HILL_INVERSE][i];
        c->n[i] = (l[i] - m->at[HILL_L_SLACK][i]) * m->at[HILL_INV_COS][i] * m->at[HILL_INVERSE][i];
        c->s[i] = w[i] * m->at[HILL_SPEED][i];
        c->s_w[i] = m->at[HILL_SPEED][i];
        c->pull[i] = m->at[HILL_PULL][i];
        c->s_l[i] = c->pull_l[i] = 0;
    }
}

/* Constant thickness, where the height is not 0. */
INLINED void fibres_of_thickness(const struct hill_columns *m, int32_t n, const double *l,
                                 const double *w, struct chunk *c) {
    fibres_at_angle(m, n, l, w, c);
    for (int32_t i = 0; i < n; i++) {
        const double height = m->at[HILL_HEIGHT][i], along = l[i] - m->at[HILL_L_SLACK][i];
        const double inverse = m->at[HILL_INVERSE][i], speed = m->at[HILL_SPEED][i];
        const double square = along * along + height * height;
        const double length = sqrt(square), cosine = along / length;
        const double cosine_l = (1 - cosine * cosine) / length;
        const int flat = height == 0, slack = along <= 0;
        c->n[i] = flat ? c->n[i] : length * inverse;
        c->n_l[i] = flat ? c->n_l[i] : cosine * inverse;
        c->s[i] = flat ? c->s[i] : w[i] * cosine * speed;
        c->s_l[i] = flat ? 0 : w[i] * cosine_l * speed;
        c->s_w[i] = flat ? c->s_w[i] : cosine * speed;
        c->pull[i] = flat ? c->pull[i] : slack ? 0 : cosine;
        c->pull_l[i] = flat || slack ? 0 : cosine_l;
    }
}

/* ---- curves ---- */

INLINED void curves_paper(const struct hill_columns *m, int32_t n, const double *a,
                          struct chunk *c) {
    for (int32_t i = 0; i < n; i++) {
        /* hill_moving_bell */
        const double inverse = 1 / (0.15 * (1 - a[i]) + 1), x = c->n[i] * inverse - 1;
        const double fl = hill_exp(-x * x / 0.45), fl_n = -2 * x / 0.45 * fl * inverse;
        const double fl_a = fl_n * c->n[i] * 0.15 * inverse;
        /* hill_hyperbola */
        const double stretch = 0.0825, limit = 1.33, s = c->s[i];
        const double longer = 1 / (1 + s / stretch), shorter = 1 / (1 - s);
        const double fv = s > 0 ? (1 + limit * s / stretch) * longer : (1 + s) * shorter;
        const double fv_s = s > 0 ? (limit - 1) / stretch * longer * longer : 2 * shorter * shorter;
        /* paper_passive */
        const double from = m->at[HILL_PASSIVE_FROM][i], ramp = m->at[HILL_PASSIVE_RAMP][i];
        const double grown = hill_exp(10 * (c->n[i] - 1)) * m->at[HILL_PASSIVE_SCALE][i];
        const double t = (c->n[i] - from) / ramp + 1, part = t * t * (3 - 2 * t);
        const double part_n = 6 * t * (1 - t) / ramp;
        const int on = c->n[i] > from - ramp, whole = c->n[i] > from;
        const double fp = on ? whole ? grown : part * grown : 0;
        const double fp_n = on ? whole ? 10 * grown : part * (10 * grown) + part_n * grown : 0;
        /* hill_total */
        c->f[i] = a[i] * fl * fv + fp;
        c->f_a[i] = (fl + a[i] * fl_a) * fv;
        c->f_n[i] = a[i] * fl_n * fv + fp_n;
        c->f_s[i] = a[i] * fl * fv_s;
    }
}

/* The three bells, one after the other; beyond z^2 of 1400 a bell is 0 to the last bit. */
INLINED void bells_degroote(int32_t n, const double *at, double *fl, double *fl_n) {
    for (int32_t i = 0; i < n; i++) {
        fl[i] = fl_n[i] = 0;
    }
    for (int k = 0; k < 3; k++) {
        const double *b = hill_degroote_bells[k];
        for (int32_t i = 0; i < n; i++) {
            const double width = b[2] + b[3] * at[i], z = (at[i] - b[1]) / width;
            const double bell = b[0] * hill_exp(-0.5 * z * z);
            const int far = z * z > 1400;
            fl[i] += far ? 0 : bell;
            fl_n[i] -= far ? 0 : bell * z * (1 - z * b[3]) / width;
        }
    }
}

INLINED void curves_degroote(const struct hill_columns *m, int32_t n, const double *a,
                             struct chunk *c) {
    const double *d = hill_degroote_velocity;
    double fl[CHUNK], fl_n[CHUNK], sum[CHUNK], root[CHUNK];
    bells_degroote(n, c->n, fl, fl_n);
    for (int32_t i = 0; i < n; i++) {
        const double y = d[1] * c->s[i] + d[2];
        root[i] = sqrt(y * y + 1);
        sum[i] = fabs(y) + root[i];
    }
    for (int32_t i = 0; i < n; i++) { /* the one call */
        sum[i] = log(sum[i]);
    }
    for (int32_t i = 0; i < n; i++) {
        const double y = d[1] * c->s[i] + d[2], arsinh = y < 0 ? -sum[i] : sum[i];
        const double fv = d[0] * arsinh + d[3], fv_s = d[0] * d[1] / root[i];
        const double rate = m->at[HILL_PASSIVE_RATE][i], scale = m->at[HILL_PASSIVE_SCALE][i];
        const double grown = hill_exp(rate * (c->n[i] - 1)) * scale;
        c->f[i] = a[i] * fl[i] * fv + (grown - m->at[HILL_PASSIVE_OFFSET][i] * scale);
        c->f_a[i] = fl[i] * fv;
        c->f_n[i] = a[i] * fl_n[i] * fv + rate * grown;
        c->f_s[i] = a[i] * fl[i] * fv_s;
    }
}

/* ---- forces ---- */

INLINED void forces(const struct hill_columns *m, int32_t n, const struct chunk *c,
                    double *restrict force, double *restrict force_a, double *restrict force_l,
                    double *restrict force_w) {
    for (int32_t i = 0; i < n; i++) {
        const double along = c->f[i] + m->at[HILL_DAMPING][i] * c->s[i];
        force[i] = m->at[HILL_F_MAX][i] * along * c->pull[i];
    }
    for (int32_t i = 0; i < n && force_a != NULL; i++) {
        const double f_max = m->at[HILL_F_MAX][i];
        const double along = c->f[i] + m->at[HILL_DAMPING][i] * c->s[i];
        const double along_s = c->f_s[i] + m->at[HILL_DAMPING][i];
        force_a[i] = f_max * c->f_a[i] * c->pull[i];
        force_l[i] = f_max * ((c->f_n[i] * c->n_l[i] + along_s * c->s_l[i]) * c->pull[i] +
                              along * c->pull_l[i]);
        force_w[i] = f_max * along_s * c->s_w[i] * c->pull[i];
    }
}

/* One chunk; `n` is a constant where it is CHUNK. */
INLINED void chunk_of(int32_t kind, const struct hill *hill, int32_t i, int32_t n,
                      const mhe_muscle_point *at, const mhe_muscle_values *out) {
    struct hill_columns m;
    struct chunk c;
    for (int32_t k = 0; k < HILL_COLUMNS; k++) {
        m.at[k] = hill->columns + k * hill->n + i;
    }
    if (kind == HILL_MANY_PAPER) {
        fibres_at_angle(&m, n, at->length + i, at->velocity + i, &c);
        curves_paper(&m, n, at->state + i, &c);
    } else {
        fibres_of_thickness(&m, n, at->length + i, at->velocity + i, &c);
        curves_degroote(&m, n, at->state + i, &c);
    }
    forces(&m, n, &c, out->force + i, out->force_s != NULL ? out->force_s + i : NULL,
           out->force_l != NULL ? out->force_l + i : NULL,
           out->force_w != NULL ? out->force_w + i : NULL);
}

CLONES static void run(int32_t kind, const struct hill *hill, int32_t from, int32_t to,
                       const mhe_muscle_point *at, const mhe_muscle_values *out) {
    int32_t i = from;
    for (; i + CHUNK <= to; i += CHUNK) {
        if (kind == HILL_MANY_PAPER) {
            chunk_of(HILL_MANY_PAPER, hill, i, CHUNK, at, out);
        } else {
            chunk_of(HILL_MANY_DEGROOTE, hill, i, CHUNK, at, out);
        }
    }
    for (int32_t n; i < to; i += n) {
        n = to - i < 4 ? 1 : 4;
        chunk_of(kind, hill, i, n, at, out);
    }
}

int32_t hill_forces_of_many(const struct hill *hill, int32_t from, const mhe_muscle_point *at,
                            const mhe_muscle_values *out) {
    const int32_t kind = hill->m[from].many, all = out->force_s != NULL;
    if (kind == HILL_MANY_NONE || hill->m[from].elastic || out->force == NULL ||
        (out->force_l != NULL) != all || (out->force_w != NULL) != all) {
        return from;
    }
    int32_t to = from + 1;
    while (to < hill->n && hill->m[to].many == kind && !hill->m[to].elastic) {
        to++;
    }
    run(kind, hill, from, to, at, out);
    return to;
}

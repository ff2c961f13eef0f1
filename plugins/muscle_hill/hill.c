/* SPDX-License-Identifier: Apache-2.0 */
/* hill.c: fibre geometry, forces and activation dynamics. */
#include "hill.h"

#include "../clones.h"
#include "exponential.h"

#include <math.h>

/* The fibre of a muscle at a musculotendon length and velocity. */
struct hill_fibre {
    double n, n_l;       /* normalised length, its slope by L */
    double s, s_l, s_w;  /* normalised velocity, its slopes by L and Ldot */
    double pull, pull_l; /* share of the fibre force along the tendon */
};

static void hill_fibre_at(const struct hill_muscle *m, double l, double w,
                          struct hill_fibre *fibre) {
    double along = l - m->l_slack;
    if (m->height == 0) {
        *fibre = (struct hill_fibre){.n = along * m->inv_cos * m->inverse,
                                     .n_l = m->inv_cos * m->inverse,
                                     .s = w * m->speed,
                                     .s_w = m->speed,
                                     .pull = m->pull};
        return;
    }
    /* Constant thickness: fibre length hypot(along, height), cos(alpha) = along / length, fibre
     * velocity w cos(alpha). */
    double length = sqrt(along * along + m->height * m->height), cosine = along / length;
    double cosine_l = (1 - cosine * cosine) / length;
    *fibre = (struct hill_fibre){.n = length * m->inverse,
                                 .n_l = cosine * m->inverse,
                                 .s = w * cosine * m->speed,
                                 .s_l = w * cosine_l * m->speed,
                                 .s_w = cosine * m->speed,
                                 .pull = cosine,
                                 .pull_l = cosine_l};
    if (along <= 0) { /* a slack tendon: a pennate fibre cannot push */
        fibre->pull = fibre->pull_l = 0;
    }
}

static mhe_status hill_force(const void *self, const double *a, const double *l, const double *w,
                             const mhe_muscle_force *out, mhe_error *err) {
    const struct hill *hill = self;
    (void)err;
    for (int32_t i = 0; i < hill->n; i++) {
        const struct hill_muscle *m = &hill->m[i];
        struct hill_fibre fibre;
        struct hill_value value;
        hill_fibre_at(m, l[i], w[i], &fibre);
        m->curve(m, a[i], fibre.n, fibre.s, &value);
        double along = value.f + m->damping * fibre.s;
        double along_s = value.f_s + m->damping;
        out->force[i] = m->f_max * along * fibre.pull;
        if (out->force_a != NULL) {
            out->force_a[i] = m->f_max * value.f_a * fibre.pull;
        }
        if (out->force_l != NULL) {
            out->force_l[i] =
                m->f_max *
                ((value.f_n * fibre.n_l + along_s * fibre.s_l) * fibre.pull + along * fibre.pull_l);
        }
        if (out->force_w != NULL) {
            out->force_w[i] = m->f_max * along_s * fibre.s_w * fibre.pull;
        }
    }
    return MHE_OK;
}

/* De Groote et al. (2016): d = e - a, f = 0.5 tanh(b d), z = 0.5 + 1.5 a,
 * rate = ((0.5 + f) / (tau_act z) + (0.5 - f) z / tau_deact) d. No branch: the compiler takes
 * several muscles at a time. */
CLONES static void hill_rates(const struct hill *hill, const double *restrict e,
                              const double *restrict a, double *restrict rate,
                              double *restrict rate_e, double *restrict rate_a) {
    const double *restrict act = hill->rate_act, *restrict deact = hill->rate_deact;
    const double b = hill->smoothing;
    const int32_t n = hill->n;
    for (int32_t i = 0; i < n; i++) {
        double d = e[i] - a[i], f = 0.5 * hill_tanh(b * d), z = 0.5 + 1.5 * a[i];
        double up = act[i] / z, down = deact[i] * z;
        double speed = (0.5 + f) * up + (0.5 - f) * down;
        double by_d = speed + d * 0.5 * b * (1 - 4 * f * f) * (up - down);
        rate[i] = speed * d;
        rate_e[i] = by_d;
        rate_a[i] = 1.5 * d / z * ((0.5 - f) * down - (0.5 + f) * up) - by_d;
    }
}

static mhe_status hill_activation_rate(const void *self, const double *e, const double *a,
                                       double *rate, double *rate_e, double *rate_a,
                                       mhe_error *err) {
    const struct hill *hill = self;
    for (int32_t i = 0; i < hill->n; i++) {
        if (0.5 + 1.5 * a[i] <= 0) {
            return mhe_fail(err, MHE_RETRY, "muscle %d: activation %g is not above -1/3", i, a[i]);
        }
    }
    if (rate_e != NULL && rate_a != NULL) {
        hill_rates(hill, e, a, rate, rate_e, rate_a);
        return MHE_OK;
    }
    for (int32_t i = 0; i < hill->n; i++) {
        double unwanted[2];
        const struct hill one = {.n = 1,
                                 .smoothing = hill->smoothing,
                                 .rate_act = hill->rate_act + i,
                                 .rate_deact = hill->rate_deact + i};
        hill_rates(&one, e + i, a + i, rate + i, rate_e != NULL ? rate_e + i : &unwanted[0],
                   rate_a != NULL ? rate_a + i : &unwanted[1]);
    }
    return MHE_OK;
}

const mhe_muscle_ops hill_ops = {.size = sizeof hill_ops,
                                 .create = hill_create,
                                 .destroy = hill_destroy,
                                 .force = hill_force,
                                 .activation_rate = hill_activation_rate};

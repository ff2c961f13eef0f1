/* SPDX-License-Identifier: Apache-2.0 */
/* hill.c: fibre geometry, forces and activation dynamics. */
#include "hill.h"

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
 * rate = ((0.5 + f) / (tau_act z) + (0.5 - f) z / tau_deact) d. */
static mhe_status hill_activation_rate(const void *self, const double *e, const double *a,
                                       double *rate, double *rate_e, double *rate_a,
                                       mhe_error *err) {
    const struct hill *hill = self;
    double b = hill->smoothing;
    for (int32_t i = 0; i < hill->n; i++) {
        double d = e[i] - a[i], f = 0.5 * tanh(b * d), z = 0.5 + 1.5 * a[i];
        if (z <= 0) {
            return mhe_fail(err, MHE_RETRY, "muscle %d: activation %g is not above -1/3", i, a[i]);
        }
        double up = hill->rate_act[i] / z, down = hill->rate_deact[i] * z;
        double speed = (0.5 + f) * up + (0.5 - f) * down;
        rate[i] = speed * d;
        double by_d = speed + d * 0.5 * b * (1 - 4 * f * f) * (up - down);
        if (rate_e != NULL) {
            rate_e[i] = by_d;
        }
        if (rate_a != NULL) {
            rate_a[i] = 1.5 * d / z * ((0.5 - f) * down - (0.5 + f) * up) - by_d;
        }
    }
    return MHE_OK;
}

const mhe_muscle_ops hill_ops = {.size = sizeof hill_ops,
                                 .create = hill_create,
                                 .destroy = hill_destroy,
                                 .force = hill_force,
                                 .activation_rate = hill_activation_rate};

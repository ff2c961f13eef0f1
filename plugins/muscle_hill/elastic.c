/* SPDX-License-Identifier: Apache-2.0 */
#include "elastic.h"

#include <math.h>

/* Rate, 1/s, about which the stop tells shortening from lengthening. */
#define HILL_STOP_RATE 0.5
/* Rate, 1/s, of the push at HILL_STOP behind the stop. */
#define HILL_STOP_PUSH 10
/* Activations below 0 count as no less than this times the damping. */
#define HILL_NEGATIVE 0.01
#define HILL_ROUNDS 60

/* A value and its slope by its argument. */
struct hill_soft {
    double value, slope;
};

/* Below the shortest fibre, where only iterates get, geometry sees a length that stays above half
 * of it. Without pennation the shortest may be 0 (thelen2003), and curves go on below. */
static struct hill_soft hill_soft_length(const struct hill_muscle *m, double z) {
    double below = m->shortest - z, room = 0.5 * m->shortest;
    if (!(below > 0) || room == 0) {
        return (struct hill_soft){z, 1};
    }
    double under = 1 / (1 + below / room);
    return (struct hill_soft){m->shortest - below * under, under * under};
}

/* Fibre length from its part along the tendon; signed where there is no pennation. */
static double hill_fibre_length(const struct hill_muscle *m, double z) {
    return m->sine > 0 ? sqrt(z * z + m->sine * m->sine) : z;
}

static struct hill_soft hill_soft_activation(const struct hill_muscle *m, double a) {
    double least = HILL_NEGATIVE * m->beta;
    if (!(a < 0)) {
        return (struct hill_soft){a, 1};
    }
    return (struct hill_soft){least * expm1(a / least), exp(a / least)};
}

/* The rate with the stop: r (p + (1 - p) S(r)), p from 1 to 0 towards the stop, S from 0 for
 * shortening to 1 for lengthening; behind the stop, a push back. */
static void hill_stop(const struct hill_muscle *m, double z, double r, double *rate, double *by_r,
                      double *by_z) {
    double t = (z - m->shortest) / HILL_STOP;
    if (!(t < 1)) {
        *rate = r;
        *by_r = 1;
        *by_z = 0;
        return;
    }
    double p = t > 0 ? t * (2 - t) : 0, p_z = t > 0 ? (2 - 2 * t) / HILL_STOP : 0;
    double behind = t < 0 ? -t : 0;
    double inverse = 1 / sqrt(r * r + HILL_STOP_RATE * HILL_STOP_RATE);
    double sign = 0.5 * (1 + r * inverse);
    double sign_r = 0.5 * HILL_STOP_RATE * HILL_STOP_RATE * inverse * inverse * inverse;
    *rate = r * (p + (1 - p) * sign) + HILL_STOP_PUSH * behind * behind;
    *by_r = p + (1 - p) * sign + r * (1 - p) * sign_r;
    *by_z = r * (1 - sign) * p_z - 2 * HILL_STOP_PUSH * behind / HILL_STOP;
}

/* Root s of x fv(s) + beta s = pull, x = a fl, with fv and its slope there. */
static double hill_root(const struct hill_muscle *m, double a, double x, double pull,
                        struct hill_shape *fv, double *fv_a) {
    double s = 0;
    if (m->balance != NULL) {
        *fv_a = 0;
        *fv = m->balance(m, x, pull, &s);
        return s;
    }
    *fv = m->speeds(m, a, s, fv_a);
    if (x == 0) {
        s = pull / m->beta;
        *fv = m->speeds(m, a, s, fv_a);
        return s;
    }
    /* fv increases: between rest and where damping alone would balance what is left at rest */
    double off = x * fv->value - pull, far = -off / m->beta;
    double lower = far < 0 ? far : 0, upper = far < 0 ? 0 : far;
    if (x < 0) { /* the left side rises by half of the damping at least */
        lower = 2 * (far < 0 ? far : 0);
        upper = 2 * (far < 0 ? 0 : far);
    }
    for (int i = 0; i < HILL_ROUNDS; i++) {
        double next = s - off / (x * fv->slope + m->beta);
        if (!(next >= lower && next <= upper)) {
            next = 0.5 * (lower + upper);
        }
        double change = next - s;
        s = next;
        *fv = m->speeds(m, a, s, fv_a);
        off = x * fv->value + m->beta * s - pull;
        if (off > 0) {
            upper = s;
        } else {
            lower = s;
        }
        if (fabs(change) <= 1e-15 * fabs(s) || fabs(off) <= 1e-15 * (fabs(pull) + fabs(x))) {
            break;
        }
    }
    return s;
}

void hill_elastic_at(const struct hill_muscle *m, double a, double z, double l,
                     struct hill_elastic *out) {
    struct hill_soft length = hill_soft_length(m, z), activation = hill_soft_activation(m, a);
    double n = hill_fibre_length(m, length.value);
    double cosine = m->sine > 0 ? length.value / n : 1, sec = 1 / cosine;
    double n_z = cosine * length.slope;
    double cosine_z = m->sine > 0 ? (1 - cosine * cosine) / n * length.slope : 0;
    double x = (l - z * m->l_opt) * m->tendon_inverse;
    double x_z = -m->l_opt * m->tendon_inverse, x_l = m->tendon_inverse;
    struct hill_shape fl, fp, fv, tendon = m->tendon(m, x);
    double fv_a;
    m->lengths(m, n, &fl, &fp);
    double a_fl = activation.value * fl.value;
    double s = hill_root(m, activation.value, a_fl, tendon.value * sec - fp.value, &fv, &fv_a);
    double gain = 1 / (a_fl * fv.slope + m->beta); /* s per unit of pull */
    double s_x = gain * tendon.slope * sec;
    double s_z = s_x * x_z - gain * (tendon.value * sec * sec * cosine_z +
                                     (activation.value * fl.slope * fv.value + fp.slope) * n_z);
    double s_a = -gain * (fl.value * fv.value + a_fl * fv_a) * activation.slope;
    double r = m->vmax * s * sec, r_s = m->vmax * sec, r_z = -r * sec * cosine_z;
    double by_r, by_z;
    hill_stop(m, z, r, &out->rate, &by_r, &by_z);
    out->force = tendon.value;
    out->force_x = tendon.slope;
    out->force_z = tendon.slope * x_z;
    out->force_l = tendon.slope * x_l;
    out->rate_a = by_r * r_s * s_a;
    out->rate_x = by_r * r_s * s_x;
    out->rate_l = out->rate_x * x_l;
    out->rate_z = by_z + by_r * (r_s * s_z + r_z);
    out->x = x;
    out->n = n;
    out->s = s;
    out->cosine = cosine;
    out->active = a_fl * fv.value;
    out->passive = fp.value + m->beta * s;
}

/* Pull of the fibre along the tendon less that of the tendon, at z with the fibre moving along. */
static double hill_imbalance(const struct hill_muscle *m, double a, double z, double l, double w) {
    double n = hill_fibre_length(m, z), cosine = m->sine > 0 ? z / n : 1, fv_a;
    double s = w * cosine / (m->vmax * m->l_opt);
    struct hill_shape fl, fp;
    m->lengths(m, n, &fl, &fp);
    struct hill_shape fv = m->speeds(m, a, s, &fv_a);
    struct hill_shape tendon = m->tendon(m, (l - z * m->l_opt) * m->tendon_inverse);
    return (a * fl.value * fv.value + fp.value + m->beta * s) * cosine - tendon.value;
}

double hill_elastic_equilibrium(const struct hill_muscle *m, double a, double l, double w) {
    double lower = m->shortest; /* at the upper one the tendon is slack */
    double upper = (l - m->l_slack * m->tendon_zero) / m->l_opt;
    if (!(upper > lower) || hill_imbalance(m, a, lower, l, w) >= 0) {
        return lower;
    }
    if (hill_imbalance(m, a, upper, l, w) <= 0) {
        return upper;
    }
    for (int i = 0; i < 200 && upper - lower > 1e-15 * upper; i++) {
        double middle = 0.5 * (lower + upper);
        if (hill_imbalance(m, a, middle, l, w) >= 0) {
            upper = middle;
        } else {
            lower = middle;
        }
    }
    return 0.5 * (lower + upper);
}

void hill_elastic_prepare(const mhe_muscle *muscle, double shortest, struct hill_muscle *out) {
    double most = hill_or(muscle->maximum_pennation_angle, acos(0.1));
    out->l_opt = muscle->optimal_fiber_length;
    out->sine = sin(hill_or(muscle->pennation_angle, 0));
    out->tendon_inverse = 1 / muscle->tendon_slack_length;
    double n = fmax(shortest, out->sine / sin(most));
    out->shortest = sqrt(n * n - out->sine * out->sine);
}

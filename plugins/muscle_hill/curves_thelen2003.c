/* SPDX-License-Identifier: Apache-2.0 */
/* curves_thelen2003.c: Thelen (2003), doi:10.1115/1.1531112.
 *
 * fl = exp(-(n - 1)^2 / gamma); fp = (exp(k_PE (n - 1) / e0) - 1) / (exp(k_PE) - 1) for n > 1.
 *
 * Thelen gives the fibre velocity as a function of the active force F (eq. 6, 7), in fractions of
 * vmax and F_max, x = a fl:
 *     s = (0.25 + 0.75 a) (F - x) / b,   b = x + F / A_f                             for F <= x
 *                                        b = (2 + 2 / A_f) (x F_len - F) / (F_len - 1)   for F > x
 * A rigid tendon needs F as a function of s. With u = s / (0.25 + 0.75 a) both branches are linear
 * in F and give F = x fv(u):
 *     u <= 0:  fv = (1 + u) / (1 - u / A_f)
 *     u > 0:   fv = (1 + k F_len u) / (1 + k u),   k = (2 + 2 / A_f) / (F_len - 1)
 * Below u = -1, faster than the fibre can shorten, the active force is 0; without `damping` no
 * force is ever negative.
 *
 * Kinks: fv at u = 0 (slope of shortening taken there, 1 + 1 / A_f; lengthening has twice that) and
 * at u = -1 (slope of u > -1); fp at n = 1. Pennation at constant thickness; s is the fibre
 * velocity over vmax.
 *
 * Tendon, e = x - 1: an exponential toe up to 0.33 F_max, a straight line behind it; 0 below e = 0,
 * where its slope jumps (that of below is taken). Strain at F_max 0.04 where not stated; toe end
 * and slope as OpenSim has them, 99 e0 exp(3) / (166 exp(3) - 67) and 0.67 / (e0 - toe end). */
#include "elastic.h"
#include "hill.h"
#include "shapes.h"

static struct hill_shape thelen_velocity(const struct hill_muscle *muscle, double u) {
    if (u > 0) {
        double k = muscle->eccentric, under = 1 / (1 + k * u);
        return (struct hill_shape){(1 + k * muscle->eccentric_max * u) * under,
                                   k * (muscle->eccentric_max - 1) * under * under};
    }
    if (u < -1) {
        return (struct hill_shape){0, 0};
    }
    double under = 1 / (1 - u * muscle->concentric);
    return (struct hill_shape){(1 + u) * under, (1 + muscle->concentric) * under * under};
}

static void thelen_curve(const struct hill_muscle *muscle, double a, double n, double s,
                         struct hill_value *out) {
    double quickness = 1 / (0.25 + 0.75 * a), u = s * quickness;
    struct hill_shape fv = thelen_velocity(muscle, u), fp = {0, 0};
    if (n > 1) {
        fp = hill_exponential(n, muscle->passive_rate, 1, muscle->passive_scale);
    }
    struct hill_shape fl = hill_bell(n, muscle->active_width);
    hill_total(a, fl, 0, fv, fp, out);
    out->f_s *= quickness;
    out->f_a -= a * fl.value * fv.slope * 0.75 * u * quickness;
}

#define THELEN_TOE_FORCE 0.33
#define THELEN_TOE_SHAPE 3
#define THELEN_SHORTEST 0 /* where pennation sets no bound */

static void thelen_lengths(const struct hill_muscle *muscle, double n, struct hill_shape *fl,
                           struct hill_shape *fp) {
    *fl = hill_bell(n, muscle->active_width);
    *fp = (struct hill_shape){0, 0};
    if (n > 1) {
        *fp = hill_exponential(n, muscle->passive_rate, 1, muscle->passive_scale);
    }
}

static struct hill_shape thelen_speeds(const struct hill_muscle *muscle, double a, double s,
                                       double *by_a) {
    double quickness = 1 / (0.25 + 0.75 * a), u = s * quickness;
    struct hill_shape fv = thelen_velocity(muscle, u);
    *by_a = -fv.slope * 0.75 * u * quickness;
    return (struct hill_shape){fv.value, fv.slope * quickness};
}

static struct hill_shape thelen_tendon(const struct hill_muscle *muscle, double x) {
    double strain = x - 1;
    if (strain > muscle->tendon_toe) {
        return (struct hill_shape){THELEN_TOE_FORCE +
                                       muscle->tendon_line * (strain - muscle->tendon_toe),
                                   muscle->tendon_line};
    }
    if (!(strain > 0)) {
        return (struct hill_shape){0 * strain, 0}; /* NaN gives NaN */
    }
    double grown = muscle->tendon_scale * exp(muscle->tendon_rate * strain);
    return (struct hill_shape){grown - muscle->tendon_scale, muscle->tendon_rate * grown};
}

static void thelen_prepare(const mhe_muscle *muscle, const struct hill_config *config,
                           struct hill_muscle *out) {
    double shape = hill_or(muscle->passive_shape, 5);
    hill_published_geometry(muscle, config, out);
    out->curve = thelen_curve;
    /* a De Groote muscle's own shape is not this one's */
    const int32_t own = muscle->type != MHE_MUSCLE_DEGROOTE2016;
    out->active_width = own ? hill_or(muscle->active_shape, 0.45) : 0.45;
    out->passive_rate = shape / hill_or(muscle->passive_strain, 0.6);
    out->passive_scale = 1 / expm1(shape);
    out->concentric = 1 / hill_or(muscle->velocity_shape, 0.25);
    out->eccentric_max = hill_or(muscle->max_lengthening_force, 1.4);
    out->eccentric = (2 + 2 * out->concentric) / (out->eccentric_max - 1);
    double strain = hill_or(muscle->tendon_strain, 0.04), e3 = exp(3);
    out->lengths = thelen_lengths;
    out->speeds = thelen_speeds;
    out->tendon = thelen_tendon;
    out->tendon_zero = 1;
    out->tendon_toe = 99 * strain * e3 / (166 * e3 - 67);
    out->tendon_line = (1 - THELEN_TOE_FORCE) / (strain - out->tendon_toe);
    out->tendon_rate = THELEN_TOE_SHAPE / out->tendon_toe;
    out->tendon_scale = THELEN_TOE_FORCE / expm1(THELEN_TOE_SHAPE);
    hill_elastic_prepare(muscle, THELEN_SHORTEST, out);
}

const struct hill_curve_set hill_thelen2003 = {
    .name = "thelen2003", .published = 1, .prepare = thelen_prepare};

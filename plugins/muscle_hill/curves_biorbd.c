/* SPDX-License-Identifier: Apache-2.0 */
/* curves_biorbd.c: biorbd's current curves, type by type as the file states them.
 *
 * Pennation at constant angle, n = (L - l_slack) / (cos(alpha) l_opt), force times cos(alpha), no
 * damping. The velocity is the musculotendon's: s is its tenth [m/s] for "hill" and "hilldegroote",
 * and over 10 l_opt for "hillthelen".
 *
 * Kinks: fv of "hill" at s = 0 (slope of shortening taken there) and of "hillthelen" at s = 0
 * (slope of lengthening) and s = -1; fp at n = 0 ("hill", a jump) or n = 1 (others).
 *
 * Negative, a push, is the force of "hill" and "hilldegroote" alone, and only below s = -1: faster
 * than 10 m/s, where biorbd's fv goes on as it does. */
#include "hill.h"
#include "shapes.h"

static const struct hill_shape nothing = {0, 0};

static void biorbd_hill(const struct hill_muscle *muscle, double a, double n, double s,
                        struct hill_value *out) {
    double fl_a;
    struct hill_shape fl = hill_moving_bell(a, n, &fl_a);
    struct hill_shape fp = n > 0 ? hill_exponential(n, 10, 0, muscle->passive_scale) : nothing;
    hill_total(a, fl, fl_a, hill_hyperbola(s), fp, out);
}

static struct hill_shape biorbd_passive(const struct hill_muscle *muscle, double n) {
    return n > 1 ? hill_exponential(n, muscle->passive_rate, 1, muscle->passive_scale) : nothing;
}

static void biorbd_hill_thelen(const struct hill_muscle *muscle, double a, double n, double s,
                               struct hill_value *out) {
    const double fast = 0.06, limit = 1.6, curvature = 3.0 / 11;
    struct hill_shape fv = nothing;
    if (s >= 0) {
        double under = 1 / (1 + s / fast);
        fv.value = (1 + limit * s / fast) * under;
        fv.slope = (limit - 1) / fast * under * under;
    } else if (!(s < -1)) {
        double under = 1 / (curvature - s);
        fv.value = (1 + curvature) * curvature * under - curvature;
        fv.slope = (1 + curvature) * curvature * under * under;
    }
    hill_total(a, hill_bell(n, 0.45), 0, fv, biorbd_passive(muscle, n), out);
}

static void biorbd_hill_degroote(const struct hill_muscle *muscle, double a, double n, double s,
                                 struct hill_value *out) {
    static const double bells[3][4] = {
        {0.815, 1.055, 0.162, 0.063}, {0.433, 0.717, -0.030, 0.200}, {0.100, 1.000, 0.354, 0.000}};
    static const double velocity[4] = {-0.318, -8.149, -0.374, 0.886};
    hill_total(a, hill_three_bells(bells, n), 0, hill_log_velocity(velocity, s),
               biorbd_passive(muscle, n), out);
}

static void biorbd_prepare(const mhe_muscle *muscle, const struct hill_config *config,
                           struct hill_muscle *out) {
    (void)config;
    const double v_max = 10, strain = 0.6;
    double angle = hill_or(muscle->pennation_angle, 0);
    out->inv_cos = 1 / cos(angle);
    out->pull = cos(angle);
    out->speed = 1 / v_max;
    switch (muscle->type) {
    case MHE_MUSCLE_HILL_THELEN:
    case MHE_MUSCLE_THELEN2003:
        out->curve = biorbd_hill_thelen;
        out->speed = out->inverse / v_max;
        out->speed_o = -out->speed * out->inverse;
        out->passive_rate = 5 / strain;
        out->passive_scale = 1 / expm1(5);
        break;
    case MHE_MUSCLE_HILL_DEGROOTE:
    case MHE_MUSCLE_DEGROOTE2016:
        out->curve = biorbd_hill_degroote;
        out->passive_rate = 4 / strain;
        out->passive_scale = 1 / expm1(4);
        break;
    default:
        out->curve = biorbd_hill;
        out->passive_scale = exp(-5);
        break;
    }
}

const struct hill_curve_set hill_biorbd = {.name = "biorbd", .prepare = biorbd_prepare};

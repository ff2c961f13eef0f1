/* SPDX-License-Identifier: Apache-2.0 */
/* curves_degroote2016.c: De Groote et al. (2016), doi:10.1007/s10439-016-1591-9.
 *
 * Active and velocity curves with the constants in full precision. The passive curve is the
 * exponential with k_PE = 4, shifted as OpenSim's DeGrooteFregly2016Muscle does: 0 at n = 0.2 and 1
 * at n = 1 + e0 (the article's own passes 0 at n = 1 and would push below). e0 is the muscle's
 * passive strain, 0.6 where not stated. Pennation at constant thickness; s is the fibre velocity
 * over vmax. No kinks. OpenSim's active_force_width_scale w is there: fl(1 + (n - 1) / w).
 *
 * A rigid tendon's fibre pushes below n = 0.2 (by 0.02 F_max at n = 0, no length that a fibre has)
 * and faster than vmax, where the article's fv goes on below 0; with `damping` also where an idle
 * muscle shortens.
 *
 * Tendon: 0.2 (exp(k (x - 1)) - 1), k = ln 6 over its strain at F_max (0.049 where not stated), as
 * OpenSim has it. That curve goes on below x = 1 and would push with up to 0.2 F_max; here it bends
 * to 0 within a tenth of that strain about x = 1 (0.8 % of F_max there), and is a straight line
 * from twice that strain on (7 F_max), where no tendon is. */
#include "elastic.h"
#include "hill.h"
#include "shapes.h"

const double hill_degroote_bells[3][4] = {
    {.8150671134243542, 1.055033428970575, .162384573599574, .063303448465465},
    {.433004984392647, .716775413397760, -.029947116970696, .200356847296188},
    {.1, 1, .353553390593274, 0}};
const double hill_degroote_velocity[4] = {-0.3211346127989808, -8.149, -0.374, 0.8825327733249912};
#define DEGROOTE_SHORTEST 0.2 /* n at which the passive curve is 0 */

/* The three bells, stretched about n = 1. */
static struct hill_shape degroote_active(const struct hill_muscle *muscle, double n) {
    const double narrow = 1 / muscle->active_width;
    struct hill_shape fl = hill_three_bells(hill_degroote_bells, 1 + narrow * (n - 1));
    fl.slope *= narrow;
    return fl;
}

static void degroote_curve(const struct hill_muscle *muscle, double a, double n, double s,
                           struct hill_value *out) {
    struct hill_shape fp =
        hill_exponential(n, muscle->passive_rate, muscle->passive_offset, muscle->passive_scale);
    hill_total(a, degroote_active(muscle, n), 0, hill_log_velocity(hill_degroote_velocity, s), fp,
               out);
}

static void degroote_lengths(const struct hill_muscle *muscle, double n, struct hill_shape *fl,
                             struct hill_shape *fp) {
    *fl = degroote_active(muscle, n);
    *fp = hill_exponential(n, muscle->passive_rate, muscle->passive_offset, muscle->passive_scale);
}

static struct hill_shape degroote_speeds(const struct hill_muscle *muscle, double a, double s,
                                         double *by_a) {
    (void)muscle, (void)a;
    *by_a = 0;
    return hill_log_velocity(hill_degroote_velocity, s);
}

static struct hill_shape degroote_rise(double rate, double strain) {
    double grown = 0.2 * exp(rate * strain);
    return (struct hill_shape){grown - 0.2, rate * grown};
}

static struct hill_shape degroote_tendon(const struct hill_muscle *muscle, double x) {
    double strain = x - 1, toe = muscle->tendon_toe;
    if (strain >= muscle->tendon_line) {
        struct hill_shape end = degroote_rise(muscle->tendon_rate, muscle->tendon_line);
        end.value += end.slope * (strain - muscle->tendon_line);
        return end;
    }
    if (strain >= toe) {
        return degroote_rise(muscle->tendon_rate, strain);
    }
    if (!(strain > -toe)) {
        return (struct hill_shape){0 * strain, 0}; /* NaN gives NaN */
    }
    /* the cubic with value and slope of both ends */
    struct hill_shape end = degroote_rise(muscle->tendon_rate, toe);
    double t = 0.5 * (strain / toe + 1), rise = 2 * toe * end.slope;
    return (struct hill_shape){t * t * (3 * end.value - rise + t * (rise - 2 * end.value)),
                               t * (2 * (3 * end.value - rise) + 3 * t * (rise - 2 * end.value)) /
                                   (2 * toe)};
}

static void degroote_prepare(const mhe_muscle *muscle, const struct hill_config *config,
                             struct hill_muscle *out) {
    const double shape = 4;
    hill_published_geometry(muscle, config, out);
    out->curve = degroote_curve;
    /* a Thelen muscle's own shape is not this one's */
    const int32_t own = muscle->type == MHE_MUSCLE_DEGROOTE2016;
    out->active_width = own ? hill_or(muscle->active_shape, 1) : 1;
    out->many = out->active_width == 1 ? HILL_MANY_DEGROOTE : HILL_MANY_NONE;
    out->passive_rate = shape / hill_or(muscle->passive_strain, 0.6);
    out->passive_offset = exp(out->passive_rate * (DEGROOTE_SHORTEST - 1));
    out->passive_scale = 1 / (exp(shape) - out->passive_offset);
    double strain = hill_or(muscle->tendon_strain, 0.049);
    out->lengths = degroote_lengths;
    out->speeds = degroote_speeds;
    out->tendon = degroote_tendon;
    out->tendon_rate = log(6) / strain;
    out->tendon_toe = 0.1 * strain;
    out->tendon_line = 2 * strain;
    out->tendon_zero = 1 - out->tendon_toe;
    hill_elastic_prepare(muscle, DEGROOTE_SHORTEST, out);
}

const struct hill_curve_set hill_degroote2016 = {
    .name = "degroote2016", .published = 1, .prepare = degroote_prepare};

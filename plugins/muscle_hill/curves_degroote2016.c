/* SPDX-License-Identifier: Apache-2.0 */
/* curves_degroote2016.c: De Groote et al. (2016), doi:10.1007/s10439-016-1591-9.
 *
 * Active and velocity curves with the constants in full precision. The passive curve is the
 * exponential with k_PE = 4, shifted as OpenSim's DeGrooteFregly2016Muscle does: 0 at n = 0.2 and 1
 * at n = 1 + e0 (the article's own passes 0 at n = 1 and would push below). e0 is the muscle's
 * passive strain, 0.6 where not stated. Pennation at constant thickness; s is the fibre velocity
 * over vmax. No kinks. */
#include "hill.h"
#include "shapes.h"

static const double degroote_bells[3][4] = {
    {.8150671134243542, 1.055033428970575, .162384573599574, .063303448465465},
    {.433004984392647, .716775413397760, -.029947116970696, .200356847296188},
    {.1, 1, .353553390593274, 0}};
static const double degroote_velocity[4] = {-0.3211346127989808, -8.149, -0.374,
                                            0.8825327733249912};
#define DEGROOTE_SHORTEST 0.2 /* n at which the passive curve is 0 */

static void degroote_curve(const struct hill_muscle *muscle, double a, double n, double s,
                           struct hill_value *out) {
    struct hill_shape fp =
        hill_exponential(n, muscle->passive_rate, muscle->passive_offset, muscle->passive_scale);
    hill_total(a, hill_three_bells(degroote_bells, n), 0, hill_log_velocity(degroote_velocity, s),
               fp, out);
}

static void degroote_prepare(const mhe_muscle *muscle, const struct hill_config *config,
                             struct hill_muscle *out) {
    const double shape = 4;
    hill_published_geometry(muscle, config, out);
    out->curve = degroote_curve;
    out->passive_rate = shape / hill_or(muscle->passive_strain, 0.6);
    out->passive_offset = exp(out->passive_rate * (DEGROOTE_SHORTEST - 1));
    out->passive_scale = 1 / (exp(shape) - out->passive_offset);
}

const struct hill_curve_set hill_degroote2016 = {
    .name = "degroote2016", .published = 1, .prepare = degroote_prepare};

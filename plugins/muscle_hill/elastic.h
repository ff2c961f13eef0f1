/* SPDX-License-Identifier: Apache-2.0 */
/* elastic.h: a muscle with an elastic tendon.
 *
 * State: z, the fibre's length along the tendon over l_opt. The tendon, x = (L - z l_opt) / l_slack
 * of its slack length, pulls with T(x), in F_max. The fibre, n = hypot(z, h) long with h = sin of
 * the pennation at optimal length and cos = z / n, moves so that both pull alike:
 *     a fl(n) fv(s) + fp(n) + beta s = T(x) / cos,     zdot = vmax s / cos
 * With damping beta > 0 the left side increases with s: there is one s, whatever the activation and
 * however slack the tendon, and the implicit function theorem gives its derivatives. Neither force
 * nor rate sees the velocity of the muscle.
 *
 * At its shortest the fibre meets a stop: its shortening fades out over HILL_STOP above it.
 * Activations below 0 (iterates of a solver) count as a number just below 0, so that the left side
 * goes on increasing. */
#ifndef MUSCLE_HILL_ELASTIC_H
#define MUSCLE_HILL_ELASTIC_H

#include "shapes.h"

#define HILL_STOP 0.02
/* Bounds of z: how far behind the stop, and the longest fibre. */
#define HILL_BEHIND_STOP 0.02
#define HILL_LONGEST 2.5
/* Least damping that holds; tendons that are shorter, in l_opt, are taken as rigid. */
#define HILL_LEAST_DAMPING 0.01
#define HILL_SHORT_TENDON 0.5
#define HILL_USUAL_DAMPING 0.1

/* In F_max, l_opt and seconds, but by_l: per metre of musculotendon length. */
struct hill_elastic {
    double force, force_z, force_l;
    double rate, rate_a, rate_z, rate_l;
    double force_x, rate_x, x; /* by x, which is all that l_opt and l_slack act on */
    double n, s, cosine;       /* fibre, s without the stop */
    double active, passive;    /* along the fibre; passive with damping */
};

void hill_elastic_at(const struct hill_muscle *m, double a, double z, double l,
                     struct hill_elastic *out);

/* z in equilibrium at activation a, the fibre moving along with the muscle, Ldot = w m/s; the
 * shortest where the tendon is slack even there. */
double hill_elastic_equilibrium(const struct hill_muscle *m, double a, double l, double w);

/* Fills what elastic.c needs of `out`; the rest and the curves are there. */
void hill_elastic_prepare(const mhe_muscle *muscle, double shortest, struct hill_muscle *out);

#endif

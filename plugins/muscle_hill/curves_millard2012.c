/* SPDX-License-Identifier: Apache-2.0 */
/* curves_millard2012.c: Millard et al. (2013), doi:10.1115/1.4023390, with fibre damping: the
 * curves of millard.h. Pennation at constant thickness; s is the fibre velocity over vmax. Twice
 * continuously differentiable; no kinks.
 *
 * A rigid tendon's fibre is not held from pushing where an idle muscle shortens against its
 * damping: OpenSim sets a negative total to 0, and where nothing changes any more no estimator
 * finds back. */
#include "millard.h"

#include "elastic.h"
#include "hill.h"
#include "shapes.h"

static struct hill_shape millard_shape(const struct hill_chain *chain, double x) {
    struct hill_chain_value at = hill_chain_at(chain, x);
    return (struct hill_shape){at.value, at.slope};
}

static void millard_lengths(const struct hill_muscle *muscle, double n, struct hill_shape *fl,
                            struct hill_shape *fp) {
    *fl = millard_shape(&muscle->millard->active, n);
    *fp = millard_shape(&muscle->millard->passive, n);
    fp->value *= muscle->passive_scale;
    fp->slope *= muscle->passive_scale;
}

static struct hill_shape millard_speeds(const struct hill_muscle *muscle, double a, double s,
                                        double *by_a) {
    (void)a;
    *by_a = 0;
    return millard_shape(&muscle->millard->velocity, s);
}

static struct hill_shape millard_balance(const struct hill_muscle *muscle, double gain, double sum,
                                         double *s) {
    struct hill_chain_value fv =
        hill_chain_solve(&muscle->millard->velocity, gain, muscle->beta, sum, s);
    return (struct hill_shape){fv.value, fv.slope};
}

static struct hill_shape millard_tendon(const struct hill_muscle *muscle, double x) {
    return millard_shape(&muscle->millard->tendon, x);
}

static void millard_curve(const struct hill_muscle *muscle, double a, double n, double s,
                          struct hill_value *out) {
    struct hill_shape fl, fp;
    millard_lengths(muscle, n, &fl, &fp);
    hill_total(a, fl, 0, millard_shape(&muscle->millard->velocity, s), fp, out);
}

static void millard_prepare(const mhe_muscle *muscle, const struct hill_config *config,
                            struct hill_muscle *out) {
    hill_published_geometry(muscle, config, out);
    if (config->damping < 0) {
        out->damping = hill_or(muscle->fiber_damping, HILL_USUAL_DAMPING);
    }
    out->curve = millard_curve;
    out->passive_scale = 1;
    out->lengths = millard_lengths;
    out->speeds = millard_speeds;
    out->balance = millard_balance;
    out->tendon = millard_tendon;
    out->tendon_zero = 1;
    hill_elastic_prepare(muscle, out->millard->shortest, out);
}

const struct hill_curve_set hill_millard2012 = {
    .name = "millard2012", .published = 1, .millard = 1, .prepare = millard_prepare};

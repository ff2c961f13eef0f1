/* SPDX-License-Identifier: Apache-2.0 */
/* millard.c: the curves of Millard et al. (2013), doi:10.1115/1.4023390, as OpenSim builds them
 * from the properties of Millard2012EquilibriumMuscle.
 *
 * Always the damped or rigid form: the active curve ends at 0 (not at minimum_value), and the
 * force-velocity curve is flat beyond |s| = 1. */
#include "millard.h"

#include <math.h>

/* Half the width of the peak of the active curve. */
#define MILLARD_PEAK 0.05

static double millard_or(double stated, double otherwise) {
    return isnan(stated) ? otherwise : stated;
}

static mhe_status millard_refuse(const char *name, int32_t line, const char *what, double value,
                                 const char *must, mhe_error *err) {
    return mhe_fail(err, MHE_E_INPUT, "muscle '%s' (line %d): %s is %g, must be %s", name, line,
                    what, value, must);
}

/* Five corners: foot, steep and shallow ascending limb, peak at 1, descending limb. */
static mhe_status millard_active(const mhe_millard_curves *c, const char *name, int32_t line,
                                 struct hill_millard *out, mhe_error *err) {
    double x0 = millard_or(c->min_norm_active_fiber_length, 0.4441);
    double x1 = millard_or(c->transition_norm_fiber_length, 0.73);
    double x3 = millard_or(c->max_norm_active_fiber_length, 1.8123);
    double m = millard_or(c->shallow_ascending_slope, 0.8616), d = MILLARD_PEAK;
    if (!(x0 > 0 && x0 < 1 - d)) {
        return millard_refuse(name, line, "min_norm_active_fiber_length", x0, "in 0 .. 0.95", err);
    }
    if (!(x1 > x0 && x1 < 1 - d)) {
        return millard_refuse(name, line, "transition_norm_fiber_length", x1,
                              "between min_norm_active_fiber_length and 0.95", err);
    }
    if (!(x3 > 1 + 2 * d && x3 < INFINITY)) {
        return millard_refuse(name, line, "max_norm_active_fiber_length", x3, "above 1.1", err);
    }
    double y1 = 1 - m * (1 - d - x1), steep = 1.25 * y1 / (x1 - x0);
    if (!(m >= 0 && m < 1 / (1 - d - x1))) {
        return millard_refuse(name, line, "shallow_ascending_slope", m,
                              "at least 0 and so small that the transition stays above 0", err);
    }
    const struct hill_joint joints[] = {{x0, 0, 0},
                                        {0.5 * (x0 + x1), 0.5 * y1, steep},
                                        {0.5 * (x1 + 1 - d), 0.5 * (1 + y1), m},
                                        {1, 1, 0},
                                        {0.5 * (1 + d + x3), 0.5, -1 / ((x3 - d) - (1 + d))},
                                        {x3, 0, 0}};
    const double curviness[] = {1, 1, 1, 1, 1};
    hill_chain_make(joints, curviness, 5, &out->active);
    out->shortest = x0;
    return MHE_OK;
}

static mhe_status millard_velocity(const mhe_millard_curves *c, const char *name, int32_t line,
                                   struct hill_millard *out, mhe_error *err) {
    double near = millard_or(c->concentric_slope_near_vmax, 0.25);
    double isometric = millard_or(c->isometric_slope, 5);
    double far = millard_or(c->eccentric_slope_near_vmax, 0.15);
    double most = millard_or(c->max_eccentric_velocity_force_multiplier, 1.4);
    double concentric = millard_or(c->concentric_curviness, 0.6);
    double eccentric = millard_or(c->eccentric_curviness, 0.9);
    if (!(isometric > 1 && isometric < INFINITY)) {
        return millard_refuse(name, line, "isometric_slope", isometric, "above 1", err);
    }
    if (!(most > 1 && most < INFINITY)) {
        return millard_refuse(name, line, "max_eccentric_velocity_force_multiplier", most,
                              "above 1", err);
    }
    if (!(near >= 0 && near < 1)) {
        return millard_refuse(name, line, "concentric_slope_near_vmax", near, "in 0 .. 1", err);
    }
    if (!(far >= 0 && far < most - 1)) {
        return millard_refuse(name, line, "eccentric_slope_near_vmax", far,
                              "in 0 .. max_eccentric_velocity_force_multiplier - 1", err);
    }
    if (!(concentric >= 0 && concentric <= 1 && eccentric >= 0 && eccentric <= 1)) {
        int is_first = !(concentric >= 0 && concentric <= 1);
        return millard_refuse(name, line, is_first ? "concentric_curviness" : "eccentric_curviness",
                              is_first ? concentric : eccentric, "in 0 .. 1", err);
    }
    const struct hill_joint joints[] = {{-1, 0, 0},
                                        {-0.9, 0.05 * near, near},
                                        {0, 1, isometric},
                                        {0.9, most - 0.05 * far, far},
                                        {1, most, 0}};
    const double curviness[] = {concentric, concentric, eccentric, eccentric};
    hill_chain_make(joints, curviness, 4, &out->velocity);
    return MHE_OK;
}

/* How many of three quantities that belong together are stated. */
static int millard_stated(double a, double b, double c) {
    return !isnan(a) + !isnan(b) + !isnan(c);
}

static mhe_status millard_passive(const mhe_millard_curves *c, const char *name, int32_t line,
                                  struct hill_millard *out, mhe_error *err) {
    double e0 = millard_or(c->fiber_strain_at_zero_force, 0);
    double e1 = millard_or(c->fiber_strain_at_one_norm_force, 0.7), span = e1 - e0;
    int stated = millard_stated(c->fiber_stiffness_at_low_force,
                                c->fiber_stiffness_at_one_norm_force, c->fiber_curviness);
    if (stated != 0 && stated != 3) {
        return mhe_fail(err, MHE_E_INPUT,
                        "muscle '%s' (line %d): the passive curve needs stiffness_at_low_force, "
                        "stiffness_at_one_norm_force and curviness, or none of them",
                        name, line);
    }
    double low = millard_or(c->fiber_stiffness_at_low_force, 0.2);
    double k = millard_or(c->fiber_stiffness_at_one_norm_force, 2 / span);
    double curviness = millard_or(c->fiber_curviness, 0.75);
    if (!(span > 0 && e0 > -1 && span < INFINITY)) {
        return millard_refuse(name, line, "strain_at_one_norm_force of the fibre", e1,
                              "above strain_at_zero_force", err);
    }
    if (!(k > 1 / span && k < INFINITY)) {
        return millard_refuse(name, line, "stiffness_at_one_norm_force of the fibre", k,
                              "above 1 / (strain_at_one_norm_force - strain_at_zero_force)", err);
    }
    if (!(low > 0 && low < 1 / span)) {
        return millard_refuse(name, line, "stiffness_at_low_force", low,
                              "above 0 and below 1 / (strain_at_one_norm_force - "
                              "strain_at_zero_force)",
                              err);
    }
    if (!(curviness >= 0 && curviness <= 1)) {
        return millard_refuse(name, line, "curviness of the passive curve", curviness, "in 0 .. 1",
                              err);
    }
    double foot = fmin(0.1 / k, 0.1 * span);
    const struct hill_joint joints[] = {
        {1 + e0, 0, 0}, {1 + e0 + foot, 0.5 * low * foot, low}, {1 + e1, 1, k}};
    const double both[] = {curviness, curviness};
    hill_chain_make(joints, both, 2, &out->passive);
    return MHE_OK;
}

static mhe_status millard_tendon(const mhe_millard_curves *c, const char *name, int32_t line,
                                 struct hill_millard *out, mhe_error *err) {
    double e = millard_or(c->tendon_strain_at_one_norm_force, 0.049);
    int stated = millard_stated(c->tendon_stiffness_at_one_norm_force,
                                c->tendon_norm_force_at_toe_end, c->tendon_curviness);
    if (stated != 0 && stated != 3) {
        return mhe_fail(
            err, MHE_E_INPUT,
            "muscle '%s' (line %d): the tendon curve needs stiffness_at_one_norm_force, "
            "norm_force_at_toe_end and curviness, or none of them",
            name, line);
    }
    double k = millard_or(c->tendon_stiffness_at_one_norm_force, 1.375 / e);
    double f = millard_or(c->tendon_norm_force_at_toe_end, 2.0 / 3);
    double curviness = millard_or(c->tendon_curviness, 0.5);
    if (!(e > 0 && e < INFINITY)) {
        return millard_refuse(name, line, "strain_at_one_norm_force of the tendon", e, "above 0",
                              err);
    }
    if (!(k > 1 / e && k < INFINITY)) {
        return millard_refuse(name, line, "stiffness_at_one_norm_force of the tendon", k,
                              "above 1 / strain_at_one_norm_force", err);
    }
    double end = 1 + e + (f - 1) / k, foot = 1 + 0.1 * (end - 1);
    double middle = 1 + e + (0.5 * f - 1) / k, m = 0.5 * f / (middle - foot);
    if (!(f > 0 && f <= 1 && middle > foot)) {
        return millard_refuse(name, line, "norm_force_at_toe_end", f,
                              "in 0 .. 1 and a toe longer than 0", err);
    }
    if (!(curviness >= 0 && curviness <= 1)) {
        return millard_refuse(name, line, "curviness of the tendon curve", curviness, "in 0 .. 1",
                              err);
    }
    double joint = 0.5 * (foot + middle);
    const struct hill_joint joints[] = {{1, 0, 0}, {joint, m * (joint - foot), m}, {end, f, k}};
    const double both[] = {curviness, curviness};
    hill_chain_make(joints, both, 2, &out->tendon);
    return MHE_OK;
}

mhe_status hill_millard_make(const mhe_millard_curves *stated, const char *name, int32_t line,
                             struct hill_millard *out, mhe_error *err) {
    mhe_status status = millard_active(stated, name, line, out, err);
    if (status == MHE_OK) {
        status = millard_velocity(stated, name, line, out, err);
    }
    if (status == MHE_OK) {
        status = millard_passive(stated, name, line, out, err);
    }
    if (status == MHE_OK) {
        status = millard_tendon(stated, name, line, out, err);
    }
    return status;
}

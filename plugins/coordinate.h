/* SPDX-License-Identifier: Apache-2.0 */
/* coordinate.h: forces along coordinates, free or dependent (a coupler's), as generalised forces.
 *
 * A dependent coordinate has the value g(q_i) of one free coordinate, so that a force f(g, gdot)
 * along it, gdot = g' v_i, is tau_i = f g', with
 *     d tau_i/dq_i = (f_g g' + f_gdot g'' v_i) g' + f g'',   d tau_i/dv_i = f_gdot g'^2. */
#ifndef MHE_PLUGINS_COORDINATE_H
#define MHE_PLUGINS_COORDINATE_H

#include <mhe/force.h>

/* A coordinate at a point: whose it is, its value and slopes by that. */
struct coordinate_place {
    int32_t free; /* number of the free coordinate; -1: none is found */
    double value, slope, bend;
};

/* f and its first two derivatives at t. */
static inline void coordinate_function(const mhe_function *f, double t, double out[3]) {
    int32_t piece = 0;
    for (int32_t above = f->n_pieces; above - piece > 1;) {
        const int32_t middle = (piece + above) / 2;
        if (t >= f->origin[middle]) {
            piece = middle;
        } else {
            above = middle;
        }
    }
    const double *c = f->coef + piece * f->n_coef, s = t - f->origin[piece];
    double value = 0, slope = 0, half = 0;
    for (int32_t k = f->n_coef - 1; k >= 0; k--) {
        half = half * s + slope;
        slope = slope * s + value;
        value = value * s + c[k];
    }
    out[0] = value;
    out[1] = slope;
    out[2] = 2 * half;
}

static inline struct coordinate_place coordinate_at(const mhe_description *d, int32_t number,
                                                    const double *q) {
    struct coordinate_place place = {-1, 0, 1, 0};
    const mhe_function *chain[8];
    int32_t n = 0;
    while (number >= d->n_coordinates && n < 8) {
        const mhe_dependent *dependent = &d->dependents[number - d->n_coordinates];
        chain[n++] = &dependent->function;
        number = dependent->independent;
    }
    if (number < 0 || number >= d->n_coordinates) {
        return place;
    }
    place.free = number;
    place.value = q[number];
    while (n > 0) {
        double g[3];
        coordinate_function(chain[--n], place.value, g);
        place.bend = g[2] * place.slope * place.slope + g[1] * place.bend;
        place.slope *= g[1];
        place.value = g[0];
    }
    return place;
}

/* Adds a force f along the coordinate, with its derivatives by the value and its rate, whose free
 * coordinate moves at `speed`. */
static inline void coordinate_add(const struct coordinate_place *at, const double f[3],
                                  double speed, int32_t n_q, const mhe_force_values *out) {
    const int32_t i = at->free;
    const double g = at->slope, bend = at->bend;
    if (out->tau != NULL) {
        out->tau[i] += f[0] * g;
    }
    if (out->tau_q != NULL) {
        out->tau_q[i * n_q + i] += (f[1] * g + f[2] * bend * speed) * g + f[0] * bend;
    }
    if (out->tau_v != NULL) {
        out->tau_v[i * n_q + i] += f[2] * g * g;
    }
}

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* force_coordinate_limit: what keeps coordinates in their range, as OpenSim's CoordinateLimitForce
 * has it (Seth et al. 2018, doi:10.1371/journal.pcbi.1006223).
 *
 * With s(x) = 10 x^3 - 15 x^4 + 6 x^5 on [0, 1], 0 below and 1 above, u = s((q - upper) /
 * transition), l = s((lower - q) / transition):
 *     tau = -K_u u (q - upper) + K_l l (lower - q) - damping (u + l) qdot
 */
#include "../coordinate.h"

#include <stdlib.h>

struct limit_config {
    double scale;
};

/* An instance: the description and a factor. */
struct limit {
    const mhe_description *d;
    double scale;
};

static const mhe_option limit_options[] = {
    MHE_OPT_REAL(struct limit_config, scale, 1, 0, 1e6, "1",
                 "Factor of all limits of the model file; 0: none acts."),
};

static mhe_status limit_create(const mhe_host *host, const mhe_description *description,
                               const void *config, void **self, mhe_error *err) {
    struct limit *limit = calloc(1, sizeof *limit);
    (void)host;
    if (limit == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory for the limits");
    }
    limit->d = description;
    limit->scale = ((const struct limit_config *)config)->scale;
    *self = limit;
    return MHE_OK;
}

static void limit_destroy(void *self) {
    free(self);
}

static mhe_status limit_layout(const void *self, mhe_force_layout *out, mhe_error *err) {
    const struct limit *limit = self;
    (void)err;
    out->name = "coordinate_limit";
    out->generalised = limit->d->n_limits > 0 && limit->scale > 0;
    return MHE_OK;
}

/* s and its slope by x. */
static double limit_step(double x, double *slope) {
    if (!(x > 0)) {
        *slope = 0;
        return x > 0 || x <= 0 ? 0 : x; /* NaN stays NaN */
    }
    if (x >= 1) {
        *slope = 0;
        return 1;
    }
    *slope = 30 * x * x * (1 - x) * (1 - x);
    return x * x * x * (10 - 15 * x + 6 * x * x);
}

/* Adds one side of a limit, `beyond` it by so much: force, and its derivatives by value and speed;
 * `sign` of the way out. */
static void limit_side(const mhe_coordinate_limit *l, double beyond, double stiffness, double sign,
                       double speed, double f[3]) {
    double slope, on;
    if (l->transition > 0) {
        on = limit_step(beyond / l->transition, &slope);
        slope /= l->transition;
    } else {
        on = beyond > 0 ? 1 : 0;
        slope = 0;
    }
    f[0] -= sign * stiffness * on * beyond + l->damping * on * speed;
    f[1] -= stiffness * (slope * beyond + on) + sign * l->damping * slope * speed;
    f[2] -= l->damping * on;
}

static mhe_status limit_evaluate(const void *self, const mhe_force_point *at,
                                 const mhe_force_values *out, mhe_error *err) {
    const struct limit *limit = self;
    const mhe_description *d = limit->d;
    (void)err;
    for (int32_t k = 0; k < d->n_limits; k++) {
        const mhe_coordinate_limit *l = &d->limits[k];
        const struct coordinate_place place = coordinate_at(d, l->coordinate, at->q);
        if (place.free < 0) {
            continue; /* of one that does not move */
        }
        const double speed = place.slope * at->v[place.free];
        double f[3] = {0, 0, 0};
        limit_side(l, place.value - l->upper, l->upper_stiffness, 1, speed, f);
        limit_side(l, l->lower - place.value, l->lower_stiffness, -1, speed, f);
        for (int i = 0; i < 3; i++) {
            f[i] *= limit->scale;
        }
        coordinate_add(&place, f, at->v[place.free], d->n_coordinates, out);
    }
    return MHE_OK;
}

static const mhe_force_ops limit_ops = {.size = sizeof limit_ops,
                                        .create = limit_create,
                                        .destroy = limit_destroy,
                                        .layout = limit_layout,
                                        .evaluate = limit_evaluate};

static const mhe_plugin limit_plugin = {
    .size = sizeof limit_plugin,
    .id = "mhe.force.coordinate-limit",
    .version = "0.2.0",
    .summary = "Springs and dampers at the ends of coordinates' ranges, as the model file states "
               "them (OpenSim's CoordinateLimitForce).",
    .reference = "doi:10.1371/journal.pcbi.1006223",
    .iface = MHE_FORCE_IFACE,
    .ops = &limit_ops,
    MHE_PLUGIN_OPTIONS(struct limit_config, limit_options)};

MHE_PLUGIN_LIBRARY(&limit_plugin)

/* SPDX-License-Identifier: Apache-2.0 */
/* force_model_springs: springs along paths, ligaments and springs of coordinates, as the model file
 * states them.
 *
 * path spring: tension = k (l - rest) (1 + dissipation l'), 0 where that is not above 0 (OpenSim's
 * PathSpring); one between two points also pushes. Ligament: tension = scale curve(l / rest), 0
 * below the rest length (OpenSim's Ligament). Coordinate: f = -k (q - rest) - viscosity qdot.
 * Bushing: push = -K deflection - D rate, component by component (OpenSim's BushingForce). */
#include "../coordinate.h"

#include <stdlib.h>
#include <string.h>

struct springs_config {
    double scale;
};

struct springs {
    const mhe_description *d;
    double scale;
    int32_t n_paths;
    int32_t *paths;        /* those of the springs, then those of the ligaments */
    mhe_frame_pair *pairs; /* of the bushings */
};

static const mhe_option springs_options[] = {
    MHE_OPT_REAL(struct springs_config, scale, 1, 0, 1e6, "1",
                 "Factor of all springs, ligaments and bushings; 0: none acts."),
};

static void springs_destroy(void *self) {
    struct springs *s = self;
    if (s != NULL) {
        free(s->paths);
        free(s->pairs);
        free(s);
    }
}

static mhe_status springs_create(const mhe_host *host, const mhe_description *d, const void *config,
                                 void **self, mhe_error *err) {
    struct springs *s = calloc(1, sizeof *s);
    (void)host;
    if (s != NULL) {
        s->d = d;
        s->scale = ((const struct springs_config *)config)->scale;
        s->n_paths = d->n_path_springs + d->n_ligaments;
        s->paths = calloc((size_t)s->n_paths + 1, sizeof *s->paths);
        s->pairs = calloc((size_t)d->n_bushings + 1, sizeof *s->pairs);
    }
    if (s == NULL || s->paths == NULL || s->pairs == NULL) {
        springs_destroy(s);
        return mhe_fail(err, MHE_E_MEMORY, "no memory for the springs");
    }
    for (int32_t i = 0; i < s->n_paths; i++) {
        const int32_t ligament = i - d->n_path_springs;
        s->paths[i] = ligament < 0 ? d->path_springs[i].path : d->ligaments[ligament].path;
    }
    for (int32_t i = 0; i < d->n_bushings; i++) {
        for (int k = 0; k < 2; k++) {
            s->pairs[i].body[k] = d->bushings[i].body[k];
            memcpy(s->pairs[i].r[k], d->bushings[i].r[k], sizeof s->pairs[i].r[k]);
            memcpy(s->pairs[i].p[k], d->bushings[i].p[k], sizeof s->pairs[i].p[k]);
        }
    }
    *self = s;
    return MHE_OK;
}

static mhe_status springs_layout(const void *self, mhe_force_layout *out, mhe_error *err) {
    const struct springs *s = self;
    (void)err;
    out->name = "model_springs";
    if (s->scale > 0) {
        out->generalised = s->d->n_coordinate_springs > 0;
        out->n_paths = s->n_paths;
        out->paths = s->paths;
        out->n_pairs = s->d->n_bushings;
        out->pairs = s->pairs;
    }
    return MHE_OK;
}

/* Tension, and its derivatives by length and velocity. */
static void spring_tension(const mhe_path_spring *k, double l, double w, double f[3]) {
    const double stretch = l - k->rest;
    const double damping = k->pushes ? 0 : k->dissipation, rate = 1 + damping * w;
    f[0] = k->stiffness * stretch * rate;
    f[1] = k->stiffness * rate;
    f[2] = k->stiffness * stretch * damping;
    if (!k->pushes && (stretch < 0 || f[0] < 0)) {
        f[0] = f[1] = f[2] = 0;
    }
}

static void ligament_tension(const mhe_ligament *k, double l, double f[3]) {
    double curve[3];
    coordinate_function(&k->curve, l / k->rest, curve);
    f[0] = k->scale * curve[0];
    f[1] = k->scale * curve[1] / k->rest;
    f[2] = 0;
    if (l < k->rest) {
        f[0] = f[1] = 0;
    }
}

/* Pair i: diagonal in its six deflections. */
static void bushing_push(const struct springs *s, int32_t i, const mhe_force_point *at,
                         const mhe_force_values *out) {
    const mhe_bushing *b = &s->d->bushings[i];
    for (int32_t k = 0; k < 6; k++) {
        const double stiffness =
            s->scale * (k < 3 ? b->rotational_stiffness[k] : b->translational_stiffness[k - 3]);
        const double damping =
            s->scale * (k < 3 ? b->rotational_damping[k] : b->translational_damping[k - 3]);
        out->push[6 * i + k] =
            -stiffness * at->deflection[6 * i + k] - damping * at->deflection_rate[6 * i + k];
        if (out->push_d != NULL) {
            out->push_d[36 * i + 7 * k] = -stiffness;
        }
        if (out->push_w != NULL) {
            out->push_w[36 * i + 7 * k] = -damping;
        }
    }
}

static mhe_status springs_evaluate(const void *self, const mhe_force_point *at,
                                   const mhe_force_values *out, mhe_error *err) {
    const struct springs *s = self;
    const mhe_description *d = s->d;
    (void)err;
    for (int32_t i = 0; i < s->n_paths && s->scale > 0; i++) {
        const int32_t ligament = i - d->n_path_springs;
        double f[3];
        if (ligament < 0) {
            spring_tension(&d->path_springs[i], at->length[i], at->velocity[i], f);
        } else {
            ligament_tension(&d->ligaments[ligament], at->length[i], f);
        }
        double *const to[] = {out->tension, out->tension_l, out->tension_w};
        for (int k = 0; k < 3; k++) {
            if (to[k] != NULL) {
                to[k][i] = s->scale * f[k];
            }
        }
    }
    for (int32_t i = 0; i < d->n_bushings && s->scale > 0; i++) {
        bushing_push(s, i, at, out);
    }
    for (int32_t i = 0; i < d->n_coordinate_springs; i++) {
        const mhe_coordinate_spring *k = &d->coordinate_springs[i];
        const struct coordinate_place place = coordinate_at(d, k->coordinate, at->q);
        if (place.free < 0) {
            continue; /* of one that does not move */
        }
        const double speed = place.slope * at->v[place.free];
        const double f[3] = {-s->scale *
                                 (k->stiffness * (place.value - k->rest) + k->viscosity * speed),
                             -s->scale * k->stiffness, -s->scale * k->viscosity};
        coordinate_add(&place, f, at->v[place.free], d->n_coordinates, out);
    }
    return MHE_OK;
}

static const mhe_force_ops springs_ops = {.size = sizeof springs_ops,
                                          .create = springs_create,
                                          .destroy = springs_destroy,
                                          .layout = springs_layout,
                                          .evaluate = springs_evaluate};

static const mhe_plugin springs_plugin = {
    .size = sizeof springs_plugin,
    .id = "mhe.force.model-springs",
    .version = "0.2.0",
    .summary =
        "Springs along paths, ligaments, springs of coordinates and bushings of the model file.",
    .reference = "doi:10.1371/journal.pcbi.1006223",
    .iface = MHE_FORCE_IFACE,
    .ops = &springs_ops,
    MHE_PLUGIN_OPTIONS(struct springs_config, springs_options)};

MHE_PLUGIN_LIBRARY(&springs_plugin)

/* SPDX-License-Identifier: Apache-2.0 */
#include "test_models.h"

#include "plugin/registry.h"
#include "vector.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

char test_told[512];

static void log_last(const mhe_host *host, int32_t level, const char *text) {
    (void)host;
    (void)level;
    (void)snprintf(test_told, sizeof test_told, "%s", text);
}

static const void *no_service(const mhe_host *host, const char *id) {
    (void)host;
    (void)id;
    return NULL;
}

static const mhe_host host = {.size = sizeof host, .log = log_last, .service = no_service};

const mhe_model_ops *test_model_ops(void) {
    static mhi_registry *registry; /* until exit */
    mhe_error err = {0};
    const mhe_plugin *plugin = NULL;
    if (registry == NULL) {
        assert_int_equal(mhi_registry_create(&host, &registry, &err), MHE_OK);
        assert_int_equal(mhi_registry_add_folder(registry, MHE_TEST_PLUGIN_DIR, &err), MHE_OK);
    }
    if (mhi_registry_find(registry, "mhe.model.simbody", MHE_MODEL_IFACE, &plugin, &err) != 0) {
        fail_msg("%s", err.text);
    }
    return plugin->ops;
}

static void open_with(test_instance *out, const mhe_description *description,
                      const simbody_config *config) {
    mhe_error err = {0};
    memset(out, 0, sizeof *out);
    out->description = description;
    out->ops = test_model_ops();
    if (out->ops->create(&host, description, config, &out->self, &err) != MHE_OK ||
        out->ops->context_create(out->self, &out->context, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    out->n_q = description->n_coordinates;
    out->n_m = description->n_muscles;
    out->n_k = description->n_markers;
}

void test_open(test_instance *out, const mhe_description *description, int32_t dynamics) {
    simbody_config config = {.dynamics = dynamics};
    open_with(out, description, &config);
}

void test_open_fitted(test_instance *out, const mhe_description *description, double tolerance,
                      double range) {
    simbody_config config = {
        .paths = SIMBODY_PATHS_FITTED, .paths_tolerance = tolerance, .paths_range = range};
    open_with(out, description, &config);
}

void test_close(test_instance *instance) {
    instance->ops->context_destroy(instance->context);
    instance->ops->destroy(instance->self);
}

/* ---- pieces ---- */

#define UNIT \
    { 1, 0, 0, 0, 1, 0, 0, 0, 1 }

static const double zero_origin[] = {0};
static const double straight[] = {0, 1, 0, 0};
static const double affine[] = {0.3, -0.8, 0, 0};
static const double constant[] = {0.4, 0, 0, 0};
static const double cubic[] = {0.1, 0.5, -0.3, 0.2};
/* twice continuously differentiable at its knots -0.4 and 0.5, as a cubic spline is */
static const double spline_origin[] = {-0.4, -0.4, 0.5};
static const double spline[] = {0.2, 0.7, 0, 0, 0.2, 0.7, 0, 0.5, 1.1945, 1.9150, 0.5 * 2.7, -0.9};

#define FUNCTION(table, at)                                         \
    {                                                               \
        .origin = at, .coef = table, .n_coef = 4,                   \
        .n_pieces = (int32_t)(sizeof(table) / (4 * sizeof(double))) \
    }
#define PIN(c, f, x, y, z)                                               \
    {                                                                    \
        .kind = MHE_MOTION_ROTATION, .coordinate = c, .axis = {x, y, z}, \
        .function = FUNCTION(f, zero_origin)                             \
    }
#define SLIDER(c, f, x, y, z)                                               \
    {                                                                       \
        .kind = MHE_MOTION_TRANSLATION, .coordinate = c, .axis = {x, y, z}, \
        .function = FUNCTION(f, zero_origin)                                \
    }

const mhe_description *test_pendulum(void) {
    static const mhe_motion motions[] = {PIN(0, straight, 0, 0, 1), PIN(1, straight, 0, 0, 1)};
    static const mhe_body bodies[] = {{.name = "first",
                                       .parent = -1,
                                       .n_motions = 1,
                                       .motions = motions,
                                       .joint_r = UNIT,
                                       .body_r = UNIT,
                                       .mass = PENDULUM_M1,
                                       .com = {PENDULUM_C1},
                                       .inertia = {0.1, 0, 0, 0, 0.1, 0, 0, 0, PENDULUM_I1}},
                                      {.name = "second",
                                       .parent = 0,
                                       .n_motions = 1,
                                       .motions = motions + 1,
                                       .joint_r = UNIT,
                                       .joint_p = {PENDULUM_L1},
                                       .body_r = UNIT,
                                       .mass = PENDULUM_M2,
                                       .com = {PENDULUM_C2},
                                       .inertia = {0.1, 0, 0, 0, 0.1, 0, 0, 0, PENDULUM_I2}}};
    static const mhe_coordinate coordinates[] = {{.name = "q1", .rotational = 1},
                                                 {.name = "q2", .rotational = 1}};
    static const mhe_description d = {.size = sizeof d,
                                      .name = "pendulum",
                                      .gravity = {0, -PENDULUM_G, 0},
                                      .n_bodies = 2,
                                      .n_coordinates = 2,
                                      .bodies = bodies,
                                      .coordinates = coordinates};
    return &d;
}

/* ---- the tangle ---- */

#define N_BODIES 6
#define N_Q 6

static mhe_body tangle_bodies[N_BODIES];
static mhe_marker tangle_markers[N_BODIES * CLOUD];
static double tangle_masses[N_BODIES * CLOUD];

double test_tangle_mass(int32_t marker) {
    return tangle_masses[marker];
}

void test_tangle_state(uint64_t *seed, double *q, double *v) {
    for (int i = 0; i < N_Q; i++) {
        q[i] = test_random(seed, -1.2, 1.2);
        v[i] = test_random(seed, -3, 3);
    }
}

static void turn(const double *axis, double angle, double *r) {
    double k[9] = {0, -axis[2], axis[1], axis[2], 0, -axis[0], -axis[1], axis[0], 0}, kk[9];
    multiply3(k, k, kk);
    for (int i = 0; i < 9; i++) {
        r[i] = (i % 4 == 0) + sin(angle) * k[i] + (1 - cos(angle)) * kk[i];
    }
}

static void random_frame(uint64_t *seed, double *r, double *p) {
    double axis[3], norm = 0;
    for (int i = 0; i < 3; i++) {
        axis[i] = test_random(seed, -1, 1);
        p[i] = test_random(seed, -0.3, 0.3);
        norm += axis[i] * axis[i];
    }
    for (int i = 0; i < 3; i++) {
        axis[i] /= sqrt(norm);
    }
    turn(axis, test_random(seed, -3, 3), r);
}

/* Gives a body the mass properties of its point masses. */
static void set_cloud(int32_t b, uint64_t *seed) {
    mhe_body *body = &tangle_bodies[b];
    body->mass = 0;
    for (int32_t k = b * CLOUD; k < (b + 1) * CLOUD; k++) {
        tangle_markers[k].name = "mass";
        tangle_markers[k].body = b;
        tangle_masses[k] = test_random(seed, 0.1, 0.6);
        body->mass += tangle_masses[k];
        for (int i = 0; i < 3; i++) {
            tangle_markers[k].location[i] = test_random(seed, -0.2, 0.2);
            body->com[i] += tangle_masses[k] * tangle_markers[k].location[i];
        }
    }
    for (int i = 0; i < 3; i++) {
        body->com[i] /= body->mass;
    }
    for (int32_t k = b * CLOUD; k < (b + 1) * CLOUD; k++) {
        double d[3];
        for (int i = 0; i < 3; i++) {
            d[i] = tangle_markers[k].location[i] - body->com[i];
        }
        add_point_inertia(tangle_masses[k], d, body->inertia);
    }
}

const mhe_description *test_tangle(void) {
    static const mhe_motion base[] = {PIN(-1, constant, 0, 1, 0), SLIDER(-1, affine, 0.6, 0, 0.8)};
    static const mhe_motion arm[] = {PIN(0, affine, 0.48, 0.6, 0.64),
                                     SLIDER(1, straight, 0, -0.6, 0.8)};
    static const mhe_motion rhythm[] = {
        {MHE_MOTION_ROTATION, 2, {1, 0, 0}, FUNCTION(spline, spline_origin)},
        PIN(3, straight, 0, 0.8, -0.6),
        PIN(2, cubic, 0, 0, 1),
        {MHE_MOTION_TRANSLATION, 2, {0.6, 0.8, 0}, FUNCTION(spline, spline_origin)}};
    static const mhe_motion branch[] = {PIN(4, straight, 1, 0, 0), SLIDER(3, cubic, 0, 1, 0)};
    static const mhe_motion tip[] = {PIN(1, constant, 0, 0.6, 0.8), PIN(5, straight, 0.8, 0, 0.6),
                                     PIN(0, cubic, 0, 0, -1)};
    static const struct {
        const char *name;
        int32_t parent, n;
        const mhe_motion *motions;
    } shape[N_BODIES] = {{"base", -1, 2, base},    {"arm", 0, 2, arm},       {"plate", 1, 0, NULL},
                         {"rhythm", 2, 4, rhythm}, {"branch", 1, 2, branch}, {"tip", 3, 3, tip}};
    static const mhe_coordinate coordinates[N_Q] = {{.name = "a"}, {.name = "b"}, {.name = "c"},
                                                    {.name = "d"}, {.name = "e"}, {.name = "f"}};
    static const mhe_path_point points[] = {
        {.body = -1, .location = {0.1, 0.2, 0.3}}, {.body = 0, .location = {0.2, 0, 0.1}},
        {.body = 1, .location = {0, 0.3, 0.1}},    {.body = 2, .location = {0.1, 0.1, -0.2}},
        {.body = 3, .location = {0.2, -0.1, 0}},   {.body = 5, .location = {0, 0.2, 0.2}},
        {.body = 4, .location = {-0.2, 0.1, 0.1}}, {.body = -1, .location = {-0.2, 0, 0.4}},
        {.body = 5, .location = {0.1, 0, -0.1}},   {.body = 4, .location = {0.1, 0.3, -0.1}},
        {.body = 0, .location = {0.1, 0.1, 0.1}},  {.body = 1, .location = {0.3, 0, 0}}};
    static const mhe_muscle muscles[] = {
        {.name = "through all"}, {.name = "across"}, {.name = "still"}, {.name = "back"}};
    static const mhe_path paths[] = {{.name = "through all", .n_points = 7, .points = points},
                                     {.name = "across", .n_points = 3, .points = points + 7},
                                     {.name = "still", .n_points = 2, .points = points},
                                     {.name = "back", .n_points = 8, .points = points + 4}};
    static mhe_description d = {.size = sizeof d,
                                .name = "tangle",
                                .gravity = {1.3, -9.1, 2.7},
                                .n_bodies = N_BODIES,
                                .n_coordinates = N_Q,
                                .n_markers = N_BODIES * CLOUD,
                                .n_muscles = 4,
                                .bodies = tangle_bodies,
                                .coordinates = coordinates,
                                .markers = tangle_markers,
                                .muscles = muscles,
                                .n_paths = 4,
                                .paths = paths};
    if (tangle_bodies[0].name == NULL) {
        uint64_t seed = 7;
        for (int32_t b = 0; b < N_BODIES; b++) {
            mhe_body *body = &tangle_bodies[b];
            body->name = shape[b].name;
            body->parent = shape[b].parent;
            body->n_motions = shape[b].n;
            body->motions = shape[b].motions;
            random_frame(&seed, body->joint_r, body->joint_p);
            random_frame(&seed, body->body_r, body->body_p);
            set_cloud(b, &seed);
        }
    }
    return &d;
}

/* f(t) by its definition in description.h */
static double function_value(const mhe_function *f, double t) {
    int32_t piece = 0;
    for (int32_t i = 1; i < f->n_pieces; i++) {
        piece = t >= f->origin[i] ? i : piece;
    }
    double s = t - f->origin[piece], value = 0;
    for (int32_t k = f->n_coef - 1; k >= 0; k--) {
        value = value * s + f->coef[f->n_coef * piece + k];
    }
    return value;
}

void test_body_point(const mhe_description *d, int32_t body, const double *q, const double *at,
                     double *out) {
    double x[3] = {at[0], at[1], at[2]};
    for (int32_t b = body; b >= 0; b = d->bodies[b].parent) {
        const mhe_body *here = &d->bodies[b];
        place3(here->body_r, here->body_p, x, x);
        for (int32_t k = here->n_motions - 1; k >= 0; k--) {
            const mhe_motion *m = &here->motions[k];
            double value = function_value(&m->function, m->coordinate < 0 ? 0 : q[m->coordinate]);
            if (m->kind == MHE_MOTION_ROTATION) {
                double r[9];
                turn(m->axis, value, r);
                rotate3(r, x, x);
            } else {
                for (int i = 0; i < 3; i++) {
                    x[i] += value * m->axis[i];
                }
            }
        }
        place3(here->joint_r, here->joint_p, x, x);
    }
    memcpy(out, x, sizeof x);
}

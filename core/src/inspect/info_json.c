/* SPDX-License-Identifier: Apache-2.0 */
/* info_json.c: mhe_model_info() for programs. SI units. */
#include "inspect/info.h"
#include "inspect/inspected.h"

#include <stdlib.h>

static cJSON *coordinate(const mhe_coordinate *c) {
    cJSON *out = cJSON_CreateObject();
    (void)cJSON_AddStringToObject(out, "name", c->name);
    (void)cJSON_AddStringToObject(out, "unit", c->rotational ? "rad" : "m");
    mhi_json_number(out, "lower", c->lower);
    mhi_json_number(out, "upper", c->upper);
    mhi_json_number(out, "default", c->value);
    return out;
}

static void coordinates(const mhe_description *d, cJSON *out) {
    cJSON *free = cJSON_AddArrayToObject(out, "coordinates");
    cJSON *couplers = cJSON_AddArrayToObject(out, "couplers");
    cJSON *held = cJSON_AddArrayToObject(out, "held");
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        (void)cJSON_AddItemToArray(free, coordinate(&d->coordinates[i]));
    }
    for (int32_t i = 0; i < d->n_dependents; i++) {
        cJSON *item = coordinate(&d->dependents[i].coordinate);
        (void)cJSON_AddStringToObject(item, "follows",
                                      mhi_info_coordinate(d, d->dependents[i].independent));
        (void)cJSON_AddItemToArray(couplers, item);
    }
    for (int32_t i = 0; i < d->n_constants; i++) {
        cJSON *item = cJSON_CreateObject();
        (void)cJSON_AddStringToObject(item, "name", d->constants[i].name);
        (void)cJSON_AddStringToObject(item, "unit", d->constants[i].rotational ? "rad" : "m");
        mhi_json_number(item, "value", d->constants[i].value);
        (void)cJSON_AddItemToArray(held, item);
    }
}

static void bodies(const mhe_description *d, cJSON *out) {
    cJSON *list = cJSON_AddArrayToObject(out, "bodies");
    double total = 0;
    for (int32_t i = 0; i < d->n_bodies; i++) {
        cJSON *item = cJSON_CreateObject();
        (void)cJSON_AddStringToObject(item, "name", d->bodies[i].name);
        (void)cJSON_AddStringToObject(item, "parent", mhi_info_body(d, d->bodies[i].parent));
        if (d->joints != NULL && d->joints[i] != NULL) {
            (void)cJSON_AddStringToObject(item, "joint", d->joints[i]);
        }
        mhi_json_number(item, "mass", d->bodies[i].mass);
        (void)cJSON_AddItemToArray(list, item);
        total += d->bodies[i].mass;
    }
    mhi_json_number(out, "mass", total);
}

static cJSON *muscle(const mhe_description *d, int32_t i, uint8_t *crossed) {
    const mhe_muscle *m = &d->muscles[i];
    cJSON *out = cJSON_CreateObject(), *crosses, *around;
    (void)cJSON_AddStringToObject(out, "name", m->name);
    (void)cJSON_AddStringToObject(out, "type", mhi_info_muscle_type(m->type));
    mhi_json_number(out, "max_isometric_force", m->max_isometric_force);
    mhi_json_number(out, "optimal_fiber_length", m->optimal_fiber_length);
    mhi_json_number(out, "tendon_slack_length", m->tendon_slack_length);
    mhi_json_number(out, "pennation_angle", m->pennation_angle);
    crosses = cJSON_AddArrayToObject(out, "crosses");
    mhi_info_crossed(d, i, crossed);
    for (int32_t k = 0; k < d->n_coordinates; k++) {
        if (crossed[k]) {
            (void)cJSON_AddItemToArray(crosses, cJSON_CreateString(d->coordinates[k].name));
        }
    }
    around = cJSON_AddArrayToObject(out, "wraps");
    for (int32_t k = 0; k < d->paths[i].n_wraps; k++) {
        const mhe_obstacle *o = &d->obstacles[d->paths[i].wraps[k].obstacle];
        (void)cJSON_AddItemToArray(around, cJSON_CreateString(o->name));
    }
    (void)cJSON_AddNumberToObject(out, "line", m->line);
    return out;
}

static void obstacles(const mhe_description *d, cJSON *out) {
    cJSON *list = cJSON_AddArrayToObject(out, "obstacles");
    for (int32_t i = 0; i < d->n_obstacles; i++) {
        cJSON *item = cJSON_CreateObject();
        (void)cJSON_AddStringToObject(item, "name", d->obstacles[i].name);
        (void)cJSON_AddStringToObject(item, "kind", mhi_info_obstacles[d->obstacles[i].kind]);
        (void)cJSON_AddStringToObject(item, "body", mhi_info_body(d, d->obstacles[i].body));
        (void)cJSON_AddItemToArray(list, item);
    }
}

static void forces(const mhe_description *d, cJSON *out) {
    const struct {
        const char *name;
        int32_t n;
    } counts[] = {{"ligaments", d->n_ligaments},
                  {"path_springs", d->n_path_springs},
                  {"coordinate_springs", d->n_coordinate_springs},
                  {"coordinate_limits", d->n_limits},
                  {"bushings", d->n_bushings},
                  {"actuators", d->n_actuators},
                  {"loops", d->n_loops}};
    cJSON *list = cJSON_AddObjectToObject(out, "forces");
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        (void)cJSON_AddNumberToObject(list, counts[i].name, counts[i].n);
    }
}

static void lines(cJSON *out, const char *name, const char *const *texts, int32_t n) {
    cJSON *list = cJSON_AddArrayToObject(out, name);
    for (int32_t i = 0; i < n; i++) {
        (void)cJSON_AddItemToArray(list, cJSON_CreateString(texts[i]));
    }
}

cJSON *mhi_info_json(const mhe_description *d) {
    uint8_t *crossed = calloc((size_t)d->n_coordinates + 1, 1);
    cJSON *out = crossed != NULL ? cJSON_CreateObject() : NULL, *list;
    if (out == NULL) {
        free(crossed);
        return NULL;
    }
    (void)cJSON_AddStringToObject(out, "model", d->name);
    (void)cJSON_AddStringToObject(out, "file", d->source);
    (void)cJSON_AddItemToObject(out, "gravity", mhi_json_numbers(d->gravity, 3));
    coordinates(d, out);
    bodies(d, out);
    list = cJSON_AddArrayToObject(out, "muscles");
    for (int32_t i = 0; i < d->n_muscles; i++) {
        (void)cJSON_AddItemToArray(list, muscle(d, i, crossed));
    }
    obstacles(d, out);
    forces(d, out);
    list = cJSON_AddArrayToObject(out, "markers");
    for (int32_t i = 0; i < d->n_markers; i++) {
        (void)cJSON_AddItemToArray(list, cJSON_CreateString(d->markers[i].name));
    }
    lines(out, "unsupported", d->unsupported, d->n_unsupported);
    lines(out, "dropped", d->dropped, d->n_dropped);
    lines(out, "warnings", d->warnings, d->n_warnings);
    free(crossed);
    return out;
}

/* SPDX-License-Identifier: Apache-2.0 */
/* pose.c: one entry of the list of poses. */
#include "inspect/inspected.h"

#include "base/text.h"

#include <math.h>
#include <string.h>

/* Where a name is looked up: entry i of [n]. */
typedef struct names {
    const char *what;
    const char *(*at)(const mhe_description *, int32_t);
    int32_t n;
} names;

typedef struct place {
    mhi_inspected *m;
    const char *file;
    int32_t pose; /* for messages */
} place;

static const char *coordinate_at(const mhe_description *d, int32_t i) {
    return d->coordinates[i].name;
}

static const char *muscle_at(const mhe_description *d, int32_t i) {
    return d->muscles[i].name;
}

static const char *body_at(const mhe_description *d, int32_t i) {
    return d->bodies[i].name;
}

static int32_t number_of(const mhe_description *d, const names *list, const char *name) {
    for (int32_t i = 0; i < list->n; i++) {
        if (strcmp(list->at(d, i), name) == 0) {
            return i;
        }
    }
    return -1;
}

static mhe_status fail_unknown(const place *p, const names *list, const char *key, const char *name,
                               mhe_error *err) {
    const char **all = MHI_TAKE(&p->m->arena, const char *, list->n);
    char hint[256] = "";
    for (int32_t i = 0; all != NULL && i < list->n; i++) {
        all[i] = list->at(p->m->all, i);
    }
    if (all != NULL) {
        mhi_suggest(hint, sizeof hint, name, all, list->n);
    }
    return mhe_fail(err, MHE_E_INPUT, "%s: pose %d: \"%s\" names an unknown %s '%s'%s", p->file,
                    (int)p->pose, key, list->what, name, hint);
}

static mhe_status read_number(const place *p, const char *key, const cJSON *node, double *out,
                              mhe_error *err) {
    if (!cJSON_IsNumber(node) || !isfinite(node->valuedouble)) {
        return mhe_fail(err, MHE_E_INPUT, "%s: pose %d: \"%s\" of \"%s\" is no number", p->file,
                        (int)p->pose, node->string != NULL ? node->string : "an entry", key);
    }
    *out = node->valuedouble;
    return MHE_OK;
}

/* 1 where the name is a coordinate that has no value of its own to read. */
static int32_t is_computed(const mhe_description *d, const char *name) {
    int32_t found = 0;
    for (int32_t i = 0; i < d->n_dependents; i++) {
        found |= strcmp(d->dependents[i].coordinate.name, name) == 0;
    }
    for (int32_t i = 0; i < d->n_constants; i++) {
        found |= strcmp(d->constants[i].name, name) == 0;
    }
    return found;
}

/* {name: number} of coordinates into out. */
static mhe_status read_coordinates(const place *p, const cJSON *node, const char *key, double *out,
                                   mhe_error *err) {
    const mhe_description *d = p->m->all;
    const names list = {"coordinate", coordinate_at, d->n_coordinates};
    mhe_status status = MHE_OK;
    const cJSON *entry = NULL;
    cJSON_ArrayForEach(entry, cJSON_GetObjectItemCaseSensitive(node, key)) {
        const int32_t i = number_of(d, &list, entry->string != NULL ? entry->string : "");
        if (i < 0 && entry->string != NULL && is_computed(d, entry->string)) {
            continue;
        }
        status = i < 0 ? fail_unknown(p, &list, key, entry->string, err)
                       : read_number(p, key, entry, &out[i], err);
        if (status != MHE_OK) {
            return status;
        }
    }
    return status;
}

static mhe_status read_activation(const place *p, const cJSON *node, double *out, mhe_error *err) {
    const mhe_description *d = p->m->all;
    const names list = {"muscle", muscle_at, d->n_muscles};
    const cJSON *given = cJSON_GetObjectItemCaseSensitive(node, "activation"), *entry = NULL;
    for (int32_t i = 0; i < d->n_muscles; i++) {
        out[i] = cJSON_IsNumber(given) ? given->valuedouble : NAN;
    }
    if (!cJSON_IsObject(given)) {
        return MHE_OK;
    }
    cJSON_ArrayForEach(entry, given) {
        const int32_t i = number_of(d, &list, entry->string);
        mhe_status status = i < 0 ? fail_unknown(p, &list, "activation", entry->string, err)
                                  : read_number(p, "activation", entry, &out[i], err);
        if (status != MHE_OK) {
            return status;
        }
    }
    return MHE_OK;
}

static const char *path_at(const mhe_description *d, int32_t i) {
    return d->paths[i].name;
}

static const char *actuator_at(const mhe_description *d, int32_t i) {
    return d->actuators[i].name;
}

static mhe_status read_forces(const place *p, const cJSON *node, mhi_pose *pose, mhe_error *err) {
    const mhe_description *d = p->m->all;
    const names paths = {"muscle", path_at, d->n_paths};
    const names actuators = {"actuator", actuator_at, d->n_actuators};
    const cJSON *given = cJSON_GetObjectItemCaseSensitive(node, "forces"), *entry = NULL;
    pose->has_forces = given != NULL;
    cJSON_ArrayForEach(entry, given) {
        const int32_t i = number_of(d, &paths, entry->string);
        const int32_t k = number_of(d, &actuators, entry->string);
        mhe_status status = i < 0 && k < 0
                                ? fail_unknown(p, &paths, "forces", entry->string, err)
                                : read_number(p, "forces", entry,
                                              i >= 0 ? &pose->force[i] : &pose->actuator[k], err);
        if (status != MHE_OK) {
            return status;
        }
    }
    return MHE_OK;
}

/* [x, y, z]; absent: 0. */
static mhe_status read_vector(const place *p, const cJSON *node, const char *key, double out[3],
                              mhe_error *err) {
    const cJSON *given = cJSON_GetObjectItemCaseSensitive(node, key);
    if (given == NULL) {
        return MHE_OK;
    }
    if (cJSON_GetArraySize(given) != 3) {
        return mhe_fail(err, MHE_E_INPUT, "%s: pose %d: \"%s\" of an external load takes 3 numbers",
                        p->file, (int)p->pose, key);
    }
    for (int i = 0; i < 3; i++) {
        mhe_status status = read_number(p, key, cJSON_GetArrayItem(given, i), &out[i], err);
        if (status != MHE_OK) {
            return status;
        }
    }
    return MHE_OK;
}

static mhe_status read_loads(const place *p, const cJSON *node, mhi_pose *pose, mhe_error *err) {
    const mhe_description *d = p->m->all;
    const names bodies = {"body", body_at, d->n_bodies};
    const cJSON *given = cJSON_GetObjectItemCaseSensitive(node, "external"), *entry = NULL;
    const int32_t n = cJSON_GetArraySize(given);
    pose->loads = MHI_TAKE(&p->m->arena, mhe_load, n);
    pose->load_values = MHI_TAKE(&p->m->arena, double, 9 * n);
    if (pose->loads == NULL || pose->load_values == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    cJSON_ArrayForEach(entry, given) {
        const cJSON *body = cJSON_GetObjectItemCaseSensitive(entry, "body");
        const char *name = cJSON_IsString(body) ? body->valuestring : "";
        double *value = pose->load_values + (ptrdiff_t)9 * pose->n_loads;
        const int32_t i = number_of(d, &bodies, name);
        mhe_status status = i < 0 ? fail_unknown(p, &bodies, "external", name, err) : MHE_OK;
        static const char *const keys[] = {"force", "point", "torque"};
        for (int k = 0; k < 3 && status == MHE_OK; k++) {
            status = read_vector(p, entry, keys[k], value + (ptrdiff_t)3 * k, err);
        }
        if (status != MHE_OK) {
            return status;
        }
        pose->loads[pose->n_loads++] = (mhe_load){.body = i, .axes = -1, .origin = -1};
    }
    return MHE_OK;
}

mhe_status mhi_pose_read(mhi_inspected *m, const char *name, const cJSON *node, int32_t k,
                         mhi_pose *pose, mhe_error *err) {
    const mhe_description *d = m->all;
    const place p = {m, name, k};
    const int32_t n = d->n_coordinates;
    double *numbers =
        MHI_TAKE(&m->arena, double, 3 * n + d->n_muscles + d->n_paths + d->n_actuators);
    *pose = (mhi_pose){0};
    if (numbers == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    if (!cJSON_IsObject(node)) {
        return mhe_fail(err, MHE_E_INPUT, "%s: pose %d is no object", name, (int)k);
    }
    pose->q = numbers;
    pose->v = pose->q + n;
    pose->a = pose->v + n;
    pose->activation = pose->a + n;
    pose->force = pose->activation + d->n_muscles;
    pose->actuator = pose->force + d->n_paths;
    for (int32_t i = 0; i < n; i++) {
        pose->q[i] = d->coordinates[i].value;
    }
    mhe_status status = read_coordinates(&p, node, "q", pose->q, err);
    if (status == MHE_OK) {
        status = read_coordinates(&p, node, "u", pose->v, err);
    }
    if (status == MHE_OK) {
        status = read_coordinates(&p, node, "udot", pose->a, err);
    }
    if (status == MHE_OK) {
        status = read_activation(&p, node, pose->activation, err);
    }
    if (status == MHE_OK) {
        status = read_forces(&p, node, pose, err);
    }
    return status != MHE_OK ? status : read_loads(&p, node, pose, err);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* evaluate.c: what a model says at poses. */
#include "inspect/inspected.h"

#include "base/need.h"
#include "base/number.h"
#include "base/text.h"
#include "io/description_builder.h"

#include <mhe/inspect.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Results of one pose; sizes are those of the unlocked description. */
typedef struct results {
    double *mass, *bias, *length, *length_q, *marker, *body, *dependent; /* of mhe_kinematics */
    double *torque;                                                      /* [n_coordinates] */
    double *follow; /* [n_dependents x 3] value, rate, acceleration */
} results;

static mhe_status take_results(mhi_inspected *m, results *r, mhe_error *err) {
    const mhe_description *d = m->all;
    const int32_t n = d->n_coordinates;
    struct {
        double **out;
        int32_t n;
    } parts[] = {{&r->mass, n * n},
                 {&r->bias, n},
                 {&r->length, d->n_paths},
                 {&r->length_q, d->n_paths * n},
                 {&r->marker, 3 * d->n_markers},
                 {&r->body, 12 * d->n_bodies},
                 {&r->dependent, d->n_dependents},
                 {&r->torque, n},
                 {&r->follow, 3 * d->n_dependents}};
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        *parts[i].out = MHI_TAKE(&m->arena, double, parts[i].n);
        if (*parts[i].out == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
    }
    return MHE_OK;
}

/* Value, rate and acceleration of each dependent, from those of what it follows. */
static void follow(const mhe_description *d, const mhi_pose *pose, double *out) {
    const int32_t n = d->n_coordinates;
    for (int32_t i = 0; i < d->n_dependents; i++) {
        const mhe_dependent *dependent = &d->dependents[i];
        const int32_t k = dependent->independent;
        const double *leader = k < n ? NULL : out + (ptrdiff_t)3 * (k - n);
        const double q = leader != NULL ? leader[0] : pose->q[k];
        const double v = leader != NULL ? leader[1] : pose->v[k];
        const double a = leader != NULL ? leader[2] : pose->a[k];
        double f[3];
        mhi_function_derivatives(&dependent->function, q, f);
        out[3 * i] = f[0];
        out[3 * i + 1] = f[1] * v;
        out[3 * i + 2] = f[1] * a + f[2] * v * v;
    }
}

static mhe_status compute(mhi_inspected *m, const mhi_pose *pose, results *r, mhe_error *err) {
    const mhe_description *d = m->all;
    const mhi_skeleton *s = &m->skeleton;
    const mhe_kinematics wanted = {.size = sizeof wanted,
                                   .mass = r->mass,
                                   .bias = r->bias,
                                   .length = r->length,
                                   .length_q = r->length_q,
                                   .marker = r->marker,
                                   .body = r->body,
                                   .dependent = r->dependent};
    double *load = MHI_TAKE(&m->arena, double, d->n_coordinates);
    mhe_status status = load == NULL
                            ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                            : s->ops->kinematics(s->context, pose->q, pose->v, &wanted, err);
    if (status == MHE_OK) {
        status = s->ops->inverse_dynamics(s->context, pose->a, r->torque, NULL, NULL, err);
    }
    if (status == MHE_OK && pose->n_loads > 0) {
        status = s->ops->loads(s->context, pose->loads, pose->n_loads, pose->load_values, load,
                               NULL, NULL, err);
    }
    for (int32_t i = 0; i < d->n_coordinates && status == MHE_OK; i++) {
        r->torque[i] -= load[i];
    }
    follow(d, pose, r->follow);
    return status;
}

/* ---- the answer ---- */

/* Every coordinate: value 0 or acceleration 2 of dependents and constants with it. */
static cJSON *all_coordinates(const mhe_description *d, const double *free, const double *follow,
                              int32_t order) {
    cJSON *out = cJSON_CreateObject();
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        mhi_json_number(out, d->coordinates[i].name, free[i]);
    }
    for (int32_t i = 0; i < d->n_dependents; i++) {
        mhi_json_number(out, d->dependents[i].coordinate.name, follow[3 * i + order]);
    }
    for (int32_t i = 0; i < d->n_constants; i++) {
        mhi_json_number(out, d->constants[i].name, order == 0 ? d->constants[i].value : 0);
    }
    return out;
}

static double speed_of(const mhe_description *d, const results *r, const double *v, int32_t path) {
    double speed = 0;
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        speed += r->length_q[(ptrdiff_t)path * d->n_coordinates + i] * v[i];
    }
    return speed;
}

static cJSON *lines(const mhe_description *d, const results *r, const mhi_pose *pose) {
    cJSON *out = cJSON_CreateObject();
    for (int32_t k = 0; k < d->n_paths; k++) {
        cJSON *line = cJSON_AddObjectToObject(out, d->paths[k].name), *arms;
        mhi_json_number(line, "length", r->length[k]);
        mhi_json_number(line, "speed", speed_of(d, r, pose->v, k));
        arms = cJSON_AddObjectToObject(line, "moment_arm");
        for (int32_t i = 0; i < d->n_coordinates; i++) {
            const double slope = r->length_q[(ptrdiff_t)k * d->n_coordinates + i];
            if (slope != 0) {
                mhi_json_number(arms, d->coordinates[i].name, -slope);
            }
        }
    }
    return out;
}

/* Mass matrix and inverse dynamics of the free coordinates. */
static void dynamics(const mhi_inspected *m, const results *r, cJSON *out) {
    const int32_t n = m->file->n_coordinates, all = m->all->n_coordinates;
    cJSON *matrix = cJSON_AddArrayToObject(out, "mass_matrix"), *torque;
    for (int32_t i = 0; i < n; i++) {
        cJSON *row = cJSON_CreateArray();
        for (int32_t k = 0; k < n; k++) {
            const double value = r->mass[(ptrdiff_t)m->place[i] * all + m->place[k]];
            (void)cJSON_AddItemToArray(row, cJSON_CreateNumber(value));
        }
        (void)cJSON_AddItemToArray(matrix, row);
    }
    torque = cJSON_AddObjectToObject(out, "inverse_dynamics");
    for (int32_t i = 0; i < n; i++) {
        mhi_json_number(torque, m->file->coordinates[i].name, r->torque[m->place[i]]);
    }
}

/* A muscle's row of results. */
enum { FIBER_LENGTH, FIBER_VELOCITY, PENNATION, ACTIVE, PASSIVE, TENDON_FORCE, N_ROWS };

/* Curves of the muscle plugin go on smoothly where a muscle is slack; what is reported is, as in
 * OpenSim, a fibre that stands at its shortest and pulls nothing, and a tendon that never pushes:
 * then the passive part takes up the active one. Shortest: where Millard's active curve begins, or
 * at the steepest pennation. */
static void report_slack(const mhe_muscle *m, double *row, int32_t stride) {
    const double stated = m->millard.min_norm_active_fiber_length;
    const double steepest = m->maximum_pennation_angle == m->maximum_pennation_angle
                                ? m->maximum_pennation_angle
                                : acos(0.1);
    const double width = m->optimal_fiber_length * sin(m->pennation_angle);
    const double shortest =
        fmax(m->optimal_fiber_length * (stated == stated ? stated : 0.4441), width / sin(steepest));
    if (m->type != MHE_MUSCLE_MILLARD2012) {
        return;
    }
    const double along = row[FIBER_LENGTH * stride] * cos(row[PENNATION * stride]);
    if (!(along > sqrt(shortest * shortest - width * width))) {
        for (int k = 0; k < N_ROWS; k++) {
            row[k * stride] = 0;
        }
        row[FIBER_LENGTH * stride] = shortest;
        row[PENNATION * stride] = asin(width / shortest);
    } else if (row[TENDON_FORCE * stride] < 0) {
        row[PASSIVE * stride] = -row[ACTIVE * stride];
        row[TENDON_FORCE * stride] = 0;
    }
}

/* Muscles whose activation is given, at this length and speed. */
static mhe_status muscles(mhi_inspected *m, const results *r, const mhi_pose *pose, cJSON *out,
                          mhe_error *err) {
    const mhe_description *d = m->all;
    const int32_t n = d->n_muscles, n_s = m->layout.n_states;
    int32_t given = 0;
    double *state = MHI_TAKE(&m->arena, double, n *n_s), *velocity = MHI_TAKE(&m->arena, double, n);
    double *values = MHI_TAKE(&m->arena, double, N_ROWS *n);
    if (state == NULL || velocity == NULL || values == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < n; i++) {
        const int32_t known = pose->activation[i] == pose->activation[i];
        given += known;
        velocity[i] = speed_of(d, r, pose->v, i);
        state[m->layout.activation * n + i] = known ? pose->activation[i] : 0;
    }
    if (given == 0) {
        return MHE_OK;
    }
    const mhe_muscle_point at = {
        .size = sizeof at, .state = state, .length = r->length, .velocity = velocity};
    static const char *const names[] = {"fiber_length", "fiber_velocity", "pennation",
                                        "active",       "passive",        "tendon_force"};
    const mhe_muscle_values wanted = {.size = sizeof wanted,
                                      .force = values + (ptrdiff_t)TENDON_FORCE * n,
                                      .fiber_length = values + (ptrdiff_t)FIBER_LENGTH * n,
                                      .fiber_velocity = values + (ptrdiff_t)FIBER_VELOCITY * n,
                                      .pennation = values + (ptrdiff_t)PENNATION * n,
                                      .active = values + (ptrdiff_t)ACTIVE * n,
                                      .passive = values + (ptrdiff_t)PASSIVE * n};
    mhe_status status = m->muscle->evaluate(m->muscles, &at, &wanted, err);
    cJSON *all = status == MHE_OK ? cJSON_AddObjectToObject(out, "muscles") : NULL;
    for (int32_t i = 0; i < n && status == MHE_OK; i++) {
        if (pose->activation[i] != pose->activation[i]) {
            continue;
        }
        cJSON *muscle = cJSON_AddObjectToObject(all, d->muscles[i].name);
        report_slack(&d->muscles[i], values + i, n);
        for (int k = 0; k < N_ROWS; k++) {
            mhi_json_number(muscle, names[k], values[(ptrdiff_t)k * n + i]);
        }
    }
    return status;
}

static cJSON *named_rows(int32_t n, const char *(*name)(const mhe_description *, int32_t),
                         const mhe_description *d, const double *values, int32_t width) {
    cJSON *out = cJSON_CreateObject();
    for (int32_t i = 0; i < n; i++) {
        (void)cJSON_AddItemToObject(out, name(d, i),
                                    mhi_json_numbers(values + (ptrdiff_t)width * i, width));
    }
    return out;
}

static const char *body_name(const mhe_description *d, int32_t i) {
    return d->bodies[i].name;
}

static const char *marker_name(const mhe_description *d, int32_t i) {
    return d->markers[i].name;
}

static mhe_status answer(mhi_inspected *m, const mhi_pose *pose, results *r, cJSON *out,
                         mhe_error *err) {
    const mhe_description *d = m->all;
    mhe_status status = compute(m, pose, r, err);
    if (status != MHE_OK) {
        return status;
    }
    (void)cJSON_AddItemToObject(out, "q", all_coordinates(d, pose->q, r->follow, 0));
    (void)cJSON_AddItemToObject(out, "udot", all_coordinates(d, pose->a, r->follow, 2));
    (void)cJSON_AddItemToObject(out, "lines", lines(d, r, pose));
    dynamics(m, r, out);
    (void)cJSON_AddItemToObject(out, "bodies", named_rows(d->n_bodies, body_name, d, r->body, 12));
    (void)cJSON_AddItemToObject(out, "markers",
                                named_rows(d->n_markers, marker_name, d, r->marker, 3));
    if (m->muscles != NULL) {
        status = muscles(m, r, pose, out, err);
    }
    if (status == MHE_OK && pose->has_forces) {
        status = mhi_pose_reactions(m, pose, out, err);
    }
    return status;
}

/* ---- all poses ---- */

static int32_t line_of(const char *text, const char *at) {
    int32_t line = 1;
    for (; text < at; text++) {
        line += *text == '\n';
    }
    return line;
}

/* The list of poses; *root is to be deleted. */
static mhe_status parse(const char *name, const char *text, size_t length, cJSON **root,
                        const cJSON **list, mhe_error *err) {
    const char *end = text;
    mhi_c_locale saved = mhi_c_locale_begin();
    *root = cJSON_ParseWithLengthOpts(text, length, &end, 0);
    mhi_c_locale_end(saved);
    if (*root == NULL) {
        return mhe_fail(err, MHE_E_INPUT, "%s:%d: not JSON", name, (int)line_of(text, end));
    }
    *list = cJSON_GetObjectItemCaseSensitive(*root, "poses");
    if (!cJSON_IsArray(*list)) {
        return mhe_fail(err, MHE_E_INPUT, "%s: there is no list \"poses\"", name);
    }
    return MHE_OK;
}

static mhe_status print(const cJSON *out, char **text, mhe_error *err) {
    mhi_c_locale saved = mhi_c_locale_begin();
    char *printed = cJSON_PrintUnformatted(out);
    mhi_c_locale_end(saved);
    mhi_text copy = {0};
    if (printed == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhi_text_add(&copy, "%s\n", printed);
    free(printed);
    return mhi_text_give(&copy, text, err);
}

static mhe_status evaluate(mhi_inspected *m, const char *name, const cJSON *list, cJSON *out,
                           mhe_error *err) {
    cJSON *names = cJSON_AddArrayToObject(out, "coordinates");
    cJSON *poses = cJSON_AddArrayToObject(out, "poses");
    const cJSON *entry = NULL;
    int32_t k = 0;
    for (int32_t i = 0; i < m->file->n_coordinates; i++) {
        (void)cJSON_AddItemToArray(names, cJSON_CreateString(m->file->coordinates[i].name));
    }
    cJSON_ArrayForEach(entry, list) {
        mhi_pose pose;
        results r;
        cJSON *here = cJSON_CreateObject();
        (void)cJSON_AddItemToArray(poses, here);
        mhe_status status = mhi_pose_read(m, name, entry, k++, &pose, err);
        if (status == MHE_OK) {
            status = take_results(m, &r, err);
        }
        if (status == MHE_OK) {
            status = answer(m, &pose, &r, here, err);
        }
        if (status != MHE_OK) {
            return status;
        }
    }
    return MHE_OK;
}

mhe_status mhe_model_evaluate(const mhe_host *host, const char *file, const char *name,
                              const char *poses, size_t length, int32_t paths, char **text,
                              mhe_error *err) {
    mhe_status status =
        MHI_NEED(err, {"file", file}, {"name", name}, {"poses", poses}, {"text", text});
    if (status != MHE_OK) {
        return status;
    }
    mhi_inspected m = {0};
    cJSON *root = NULL, *out = cJSON_CreateObject();
    const cJSON *list = NULL;
    *text = NULL;
    status = mhi_inspected_open(&m, host, file, paths, err);
    if (status == MHE_OK) {
        status = parse(name, poses, length, &root, &list, err);
    }
    if (status == MHE_OK) {
        status = evaluate(&m, name, list, out, err);
    }
    if (status == MHE_OK) {
        status = print(out, text, err);
    }
    cJSON_Delete(root);
    cJSON_Delete(out);
    mhi_inspected_close(&m);
    return status;
}

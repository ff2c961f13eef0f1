/* SPDX-License-Identifier: Apache-2.0 */
/* info.c: what a user wants to know of a model before a run. */
#include "inspect/info.h"

#include "base/need.h"
#include "base/number.h"
#include "base/pi.h"
#include "io/model_file.h"

#include <mhe/inspect.h>

#include <math.h>
#include <stdlib.h>

const char *const mhi_info_obstacles[4] = {"sphere", "cylinder", "ellipsoid", "torus"};

const char *mhi_info_coordinate(const mhe_description *d, int32_t c) {
    return c < d->n_coordinates ? d->coordinates[c].name
                                : d->dependents[c - d->n_coordinates].coordinate.name;
}

const char *mhi_info_body(const mhe_description *d, int32_t body) {
    return body < 0 ? "ground" : d->bodies[body].name;
}

const char *mhi_info_muscle_type(int32_t type) {
    static const char *const names[] = {"unstated",           "hill",        "hillthelen",
                                        "hilldegroote",       "Thelen2003",  "Millard2012",
                                        "DeGrooteFregly2016", "Schutte1993", "RigidTendon"};
    return type >= 0 && type < (int32_t)(sizeof names / sizeof *names) ? names[type] : "unknown";
}

/* Angles of a range in degrees: what a reader has in mind. */
static void add_range(mhi_text *out, const mhe_coordinate *c) {
    const double unit = c->rotational ? 180 / MHI_PI : 1;
    const char *name = c->rotational ? "deg" : "m";
    if (isfinite(c->lower) || isfinite(c->upper)) {
        mhi_text_add(out, "%.4g .. %.4g %s, default %.4g", c->lower * unit, c->upper * unit, name,
                     c->value * unit);
    } else {
        mhi_text_add(out, "any %s, default %.4g", name, c->value * unit);
    }
}

static void add_coordinates(mhi_text *out, const mhe_description *d) {
    mhi_text_add(out, "\nfree coordinates: %d\n", (int)d->n_coordinates);
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        mhi_text_add(out, "  %-28s ", d->coordinates[i].name);
        add_range(out, &d->coordinates[i]);
        mhi_text_add(out, "\n");
    }
    if (d->n_dependents > 0) {
        mhi_text_add(out, "\ncoupled coordinates: %d\n", (int)d->n_dependents);
    }
    for (int32_t i = 0; i < d->n_dependents; i++) {
        mhi_text_add(out, "  %-28s follows %s\n", d->dependents[i].coordinate.name,
                     mhi_info_coordinate(d, d->dependents[i].independent));
    }
    if (d->n_constants > 0) {
        mhi_text_add(out, "\nheld coordinates: %d\n", (int)d->n_constants);
    }
    for (int32_t i = 0; i < d->n_constants; i++) {
        const mhe_constant *c = &d->constants[i];
        mhi_text_add(out, "  %-28s %.4g %s\n", c->name,
                     c->rotational ? c->value * 180 / MHI_PI : c->value,
                     c->rotational ? "deg" : "m");
    }
}

static void add_bodies(mhi_text *out, const mhe_description *d) {
    double total = 0;
    for (int32_t i = 0; i < d->n_bodies; i++) {
        total += d->bodies[i].mass;
    }
    mhi_text_add(out, "\nbodies: %d, %.4g kg\n", (int)d->n_bodies, total);
    for (int32_t i = 0; i < d->n_bodies; i++) {
        mhi_text_add(out, "  %-28s %8.4g kg, on %s\n", d->bodies[i].name, d->bodies[i].mass,
                     mhi_info_body(d, d->bodies[i].parent));
    }
}

static mhe_status add_muscles(mhi_text *out, const mhe_description *d, mhe_error *err) {
    uint8_t *crossed = calloc((size_t)d->n_coordinates + 1, 1);
    if (crossed == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhi_text_add(out, "\nmuscles: %d\n", (int)d->n_muscles);
    for (int32_t i = 0; i < d->n_muscles; i++) {
        const mhe_muscle *m = &d->muscles[i];
        mhi_text_add(out, "  %-28s %s, %.4g N, fibre %.4g m, tendon %.4g m; crosses", m->name,
                     mhi_info_muscle_type(m->type), m->max_isometric_force, m->optimal_fiber_length,
                     m->tendon_slack_length);
        mhi_info_crossed(d, i, crossed);
        int32_t n = 0;
        for (int32_t k = 0; k < d->n_coordinates; k++) {
            if (crossed[k]) {
                mhi_text_add(out, "%s %s", n++ > 0 ? "," : "", d->coordinates[k].name);
            }
        }
        mhi_text_add(out, "%s", n == 0 ? " nothing" : "");
        for (int32_t k = 0; k < d->paths[i].n_wraps; k++) {
            const mhe_obstacle *o = &d->obstacles[d->paths[i].wraps[k].obstacle];
            mhi_text_add(out, "%s %s %s", k == 0 ? "; around" : ",", mhi_info_obstacles[o->kind],
                         o->name);
        }
        mhi_text_add(out, "\n");
    }
    free(crossed);
    return MHE_OK;
}

static void add_forces(mhi_text *out, const mhe_description *d) {
    const struct {
        const char *what;
        int32_t n;
    } forces[] = {{"obstacles that paths wrap around", d->n_obstacles},
                  {"ligaments", d->n_ligaments},
                  {"springs along a path", d->n_path_springs},
                  {"springs on coordinates", d->n_coordinate_springs},
                  {"coordinate limits", d->n_limits},
                  {"bushings", d->n_bushings},
                  {"actuators", d->n_actuators},
                  {"loops", d->n_loops},
                  {"markers", d->n_markers}};
    mhi_text_add(out, "\n");
    for (size_t i = 0; i < sizeof forces / sizeof *forces; i++) {
        if (forces[i].n > 0) {
            mhi_text_add(out, "%s: %d\n", forces[i].what, (int)forces[i].n);
        }
    }
}

/* Paths whose lengths may jump. */
static void add_jumping(mhi_text *out, const mhe_description *d) {
    int32_t conditional = 0, several = 0;
    for (int32_t i = 0; i < d->n_paths; i++) {
        int32_t points = 0;
        for (int32_t k = 0; k < d->paths[i].n_points; k++) {
            points += d->paths[i].points[k].kind == MHE_POINT_CONDITIONAL;
        }
        conditional += points > 0;
        several += d->paths[i].n_wraps > 1;
    }
    if (conditional + several > 0) {
        mhi_text_add(out,
                     "paths with conditional points: %d, around several obstacles: %d; where their "
                     "lengths jump: mhe-model sweep\n",
                     (int)conditional, (int)several);
    }
}

static void add_lines(mhi_text *out, const char *what, const char *const *lines, int32_t n) {
    if (n > 0) {
        mhi_text_add(out, "\n%s: %d\n", what, (int)n);
    }
    for (int32_t i = 0; i < n; i++) {
        mhi_text_add(out, "  %s\n", lines[i]);
    }
}

static mhe_status add_all(mhi_text *out, const mhe_description *d, mhe_error *err) {
    mhi_text_add(out, "model '%s' (%s)\ngravity %.6g %.6g %.6g m/s^2\n", d->name, d->source,
                 d->gravity[0], d->gravity[1], d->gravity[2]);
    add_coordinates(out, d);
    add_bodies(out, d);
    mhe_status status = add_muscles(out, d, err);
    add_forces(out, d);
    add_jumping(out, d);
    add_lines(out, "not supported", d->unsupported, d->n_unsupported);
    add_lines(out, "left out, of no effect here", d->dropped, d->n_dropped);
    add_lines(out, "warnings", d->warnings, d->n_warnings);
    return status;
}

static mhe_status print_json(const mhe_description *d, mhi_text *out, mhe_error *err) {
    cJSON *json = mhi_info_json(d);
    char *printed = json != NULL ? cJSON_Print(json) : NULL;
    cJSON_Delete(json);
    if (printed == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhi_text_add(out, "%s\n", printed);
    free(printed);
    return MHE_OK;
}

mhe_status mhe_model_info(const mhe_host *host, const char *file, int32_t format, char **text,
                          mhe_error *err) {
    mhe_description *d = NULL;
    mhi_text out = {0};
    (void)host;
    mhe_status status = MHI_NEED(err, {"file", file}, {"text", text});
    if (status != MHE_OK) {
        return status;
    }
    *text = NULL;
    status = mhi_model_read(file, &d, err);
    if (status == MHE_OK) {
        const mhi_c_locale saved = mhi_c_locale_begin();
        status = format == MHE_FORMAT_JSON ? print_json(d, &out, err) : add_all(&out, d, err);
        mhi_c_locale_end(saved);
    }
    mhi_description_free(d);
    if (status != MHE_OK) {
        mhi_text_free(&out);
        return status;
    }
    return mhi_text_give(&out, text, err);
}

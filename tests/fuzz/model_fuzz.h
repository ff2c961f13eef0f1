/* SPDX-License-Identifier: Apache-2.0 */
/* model_fuzz.h: what every description must keep, whatever the reader was fed. */
#ifndef TEST_MODEL_FUZZ_H
#define TEST_MODEL_FUZZ_H

#include "io/model_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef mhe_status model_parser(const char *name, const char *text, size_t length,
                                mhe_description **description, mhe_error *err);

static void require(int condition) {
    if (!condition) {
        abort();
    }
}

static void require_body(int32_t body, int32_t n, const double location[3]) {
    require(body >= -1 && body < n);
    require(isfinite(location[0]) && isfinite(location[1]) && isfinite(location[2]));
}

static void require_function(const mhe_function *f) {
    require(f->n_pieces >= 1 && f->n_coef >= 1);
}

/* Every number of a coordinate means one that is there. */
static void require_coordinate(const mhe_description *d, int32_t coordinate, int32_t least) {
    require(coordinate >= least && coordinate < d->n_coordinates + d->n_dependents);
}

static void require_path(const mhe_description *d, const mhe_path *path) {
    require((path->n_points >= 2) != (path->length != NULL));
    for (int32_t k = 0; k < path->n_points; k++) {
        const mhe_path_point *p = &path->points[k];
        require_body(p->body, d->n_bodies, p->location);
        for (int i = 0; i < 3; i++) {
            require_coordinate(d, p->coordinate[i], -1);
            require(p->kind != MHE_POINT_MOVING || p->coordinate[i] < 0 ||
                    p->function[i].n_pieces >= 1);
        }
        require(p->kind != MHE_POINT_CONDITIONAL || p->lower <= p->upper);
    }
    for (int32_t k = 0; k < path->n_wraps; k++) {
        const mhe_path_wrap *w = &path->wraps[k];
        require(w->obstacle >= 0 && w->obstacle < d->n_obstacles);
        require(w->first >= -1 && w->first < path->n_points && w->last < path->n_points);
    }
    for (int32_t k = 0; path->length != NULL && k < path->length->n; k++) {
        require_coordinate(d, path->length->coordinate[k], 0);
    }
}

static void require_forces(const mhe_description *d) {
    require(d->n_paths == d->n_muscles + d->n_path_springs + d->n_ligaments);
    for (int32_t i = 0; i < d->n_paths; i++) {
        require_path(d, &d->paths[i]);
    }
    for (int32_t i = 0; i < d->n_obstacles; i++) {
        require(d->obstacles[i].size[0] > 0 && d->obstacles[i].body < d->n_bodies);
    }
    for (int32_t i = 0; i < d->n_limits; i++) {
        require_coordinate(d, d->limits[i].coordinate, 0);
    }
    for (int32_t i = 0; i < d->n_coordinate_springs; i++) {
        require_coordinate(d, d->coordinate_springs[i].coordinate, 0);
    }
    for (int32_t i = 0; i < d->n_actuators; i++) {
        require_coordinate(d, d->actuators[i].coordinate, -1);
    }
    for (int32_t i = 0; i < d->n_dependents; i++) {
        require(d->dependents[i].independent >= 0 &&
                d->dependents[i].independent < d->n_coordinates + i);
        require_function(&d->dependents[i].function);
    }
}

static void require_sound(const mhe_description *d) {
    for (int32_t i = 0; i < d->n_bodies; i++) {
        const mhe_body *body = &d->bodies[i];
        require(body->parent >= -1 && body->parent < i && body->mass >= 0);
        for (int32_t k = 0; k < body->n_motions; k++) {
            const mhe_motion *m = &body->motions[k];
            require_coordinate(d, m->coordinate, -1);
            require_function(&m->function);
            require(fabs(hypot(hypot(m->axis[0], m->axis[1]), m->axis[2]) - 1) < 1e-9);
        }
    }
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        require(d->coordinates[i].lower <= d->coordinates[i].upper);
    }
    for (int32_t i = 0; i < d->n_markers; i++) {
        require_body(d->markers[i].body, d->n_bodies, d->markers[i].location);
    }
    for (int32_t i = 0; i < d->n_muscles; i++) {
        require(d->muscles[i].max_isometric_force > 0);
    }
    require_forces(d);
}

static void model_fuzz(model_parser *parse, const uint8_t *data, size_t size) {
    mhe_description *d = NULL;
    mhe_error err = {0};
    char *text = malloc(size + 1); /* an exact copy: overruns show */
    require(text != NULL);
    memcpy(text, data, size);
    text[size] = '\0';
    mhe_status status = parse("fuzz", text, size, &d, &err);
    require((status == MHE_OK) == (d != NULL) && (status == MHE_OK) == (err.text[0] == '\0'));
    require(strchr(err.text, '\n') == NULL);
    if (d != NULL) {
        require_sound(d);
    }
    mhi_description_free(d);
    free(text);
}

#endif

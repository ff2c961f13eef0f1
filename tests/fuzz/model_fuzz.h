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

static void require_sound(const mhe_description *d) {
    for (int32_t i = 0; i < d->n_bodies; i++) {
        const mhe_body *body = &d->bodies[i];
        require(body->parent >= -1 && body->parent < i && body->mass >= 0);
        for (int32_t k = 0; k < body->n_motions; k++) {
            const mhe_motion *m = &body->motions[k];
            require(m->coordinate >= -1 && m->coordinate < d->n_coordinates);
            require(m->function.n_pieces >= 1 && m->function.n_coef >= 1);
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
        require(d->paths[i].n_points >= 2 && d->muscles[i].max_isometric_force > 0);
        for (int32_t k = 0; k < d->paths[i].n_points; k++) {
            const mhe_path_point *point = &d->paths[i].points[k];
            require_body(point->body, d->n_bodies, point->location);
        }
    }
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

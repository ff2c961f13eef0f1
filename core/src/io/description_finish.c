/* SPDX-License-Identifier: Apache-2.0 */
/* description_finish.c: from drafts to a description: bodies behind their parents, everything else
 * on its body, then what is locked made constant. */
#include "io/description_builder.h"
#include "io/model_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define BODY(b, i) ((mhi_body_draft *)(b)->bodies.items[i])
#define GROUND (-1)

void mhi_description_free(mhe_description *description) {
    if (description != NULL) {
        mhi_owned_description *owned = (mhi_owned_description *)(void *)description;
        mhi_arena_free(&owned->arena);
        free(owned);
    }
}

/* Fills place [n bodies] with each draft's position in a list with parents first, file order
 * otherwise. */
static void order_bodies(mhi_builder *b, int32_t *place, int32_t *parent) {
    int32_t n = b->bodies.n, placed = 0, progress = 1;
    for (int32_t i = 0; i < n; i++) {
        mhi_body_draft *draft = BODY(b, i);
        parent[i] = mhi_build_find_body(b, draft->parent, draft->line, "body", draft->body.name);
        place[i] = -1;
    }
    while (placed < n && progress && b->status == MHE_OK) {
        progress = 0;
        for (int32_t i = 0; i < n; i++) {
            if (place[i] < 0 && (parent[i] == GROUND || place[parent[i]] >= 0)) {
                place[i] = placed++;
                progress = 1;
            }
        }
    }
    for (int32_t i = 0; i < n && placed < n; i++) {
        if (place[i] < 0) {
            mhi_build_fail(b, BODY(b, i)->line, "body '%s' is its own ancestor",
                           BODY(b, i)->body.name);
        }
    }
}

static void place_motions(mhi_builder *b, const mhi_body_draft *draft, const int32_t *number,
                          mhe_body *body) {
    mhe_motion *motions = mhi_build_take(b, draft->motions.n, sizeof *motions);
    for (int32_t k = 0; k < draft->motions.n && motions != NULL; k++) {
        motions[k] = *(const mhe_motion *)draft->motions.items[k];
        int32_t coordinate = motions[k].coordinate;
        motions[k].coordinate = coordinate < 0 ? -1 : number[coordinate];
    }
    body->motions = motions;
    body->n_motions = draft->motions.n;
}

static void place_bodies(mhi_builder *b, mhe_description *d, const mhi_places *places) {
    mhe_body *bodies = mhi_build_take(b, b->bodies.n, sizeof *bodies);
    int32_t *parent = mhi_build_take(b, b->bodies.n, sizeof *parent);
    int32_t *line = mhi_build_take(b, b->bodies.n, sizeof *line);
    const char **joints = mhi_build_take(b, b->bodies.n, sizeof *joints);
    if (bodies == NULL || parent == NULL || line == NULL || joints == NULL) {
        return;
    }
    order_bodies(b, places->body, parent);
    for (int32_t i = 0; i < b->bodies.n && b->status == MHE_OK; i++) {
        mhe_body *body = &bodies[places->body[i]];
        *body = BODY(b, i)->body;
        line[places->body[i]] = BODY(b, i)->line;
        joints[places->body[i]] = BODY(b, i)->joint;
        body->parent = parent[i] == GROUND ? GROUND : places->body[parent[i]];
        place_motions(b, BODY(b, i), places->coordinate, body);
    }
    d->bodies = bodies;
    d->joints = joints;
    d->n_bodies = b->bodies.n;
    if (b->status == MHE_OK) {
        mhi_build_right_handed(b, bodies, d->n_bodies, line, places->mirrored);
    }
}

int32_t mhi_build_place(mhi_builder *b, const mhi_places *places, const char *body, int32_t line,
                        const char *what, const char *whose) {
    int32_t i = mhi_build_find_body(b, body, line, what, whose);
    return i < 0 ? GROUND : places->body[i];
}

/* "models/arm.osim" -> "arm" */
static const char *base_name(mhi_builder *b) {
    const char *slash = strrchr(b->source, '/');
    const char *start = slash != NULL ? slash + 1 : b->source;
    const char *dot = strrchr(start, '.');
    const char *copy =
        mhi_arena_text_n(&b->arena, start, dot != NULL ? (size_t)(dot - start) : strlen(start));
    return copy != NULL ? copy : "";
}

/* Values [n_coordinates] of the coordinates to be locked, NaN of the free ones. */
static double *locked_at(mhi_builder *b, const mhe_description *d, const int32_t *number) {
    double *at = mhi_build_take(b, d->n_coordinates, sizeof *at);
    for (int32_t i = 0; at != NULL && i < b->coordinates.n; i++) {
        const mhi_coordinate_draft *draft = b->coordinates.items[i];
        if (number[i] >= 0 && number[i] < d->n_coordinates) {
            const int32_t locked = b->unlocked ? draft->moves_nothing : draft->locked;
            at[number[i]] = locked ? draft->coordinate.value : NAN;
        }
    }
    return at;
}

/* Actuators do nothing unless they are driven. */
static void note_undriven(mhi_builder *b, const mhe_description *d) {
    if (d->n_actuators > 0) {
        mhi_build_dropped(b, 0, "%d actuator%s, driven only where bounds.actuators asks for it",
                          (int)d->n_actuators, d->n_actuators == 1 ? "" : "s");
    }
}

static void describe(mhi_builder *b, mhe_description *d) {
    mhi_build_count_kinds(b);
    d->size = sizeof *d;
    d->name = b->name != NULL ? b->name : base_name(b);
    d->source = b->source;
    memcpy(d->gravity, b->gravity, sizeof d->gravity);
    d->unsupported = (const char *const *)b->unsupported.items;
    d->n_unsupported = b->unsupported.n;
    d->warnings = (const char *const *)b->warnings.items;
    d->n_warnings = b->warnings.n;
    d->dropped = (const char *const *)b->dropped.items;
    d->n_dropped = b->dropped.n;
}

/* Fills `d`; *at: what is to be locked then. */
static void build(mhi_builder *b, mhe_description *d, double **at) {
    const mhi_places places = {.body = mhi_build_take(b, b->bodies.n, sizeof(int32_t)),
                               .mirrored = mhi_build_take(b, b->bodies.n, sizeof(int32_t)),
                               .coordinate = mhi_build_take(b, b->coordinates.n, sizeof(int32_t))};
    static void (*const steps[])(mhi_builder *, mhe_description *, const mhi_places *) = {
        place_bodies, mhi_build_markers, mhi_build_paths, mhi_build_forces};
    if (b->status == MHE_OK) {
        mhi_build_check(b);
    }
    if (b->status == MHE_OK) {
        mhi_build_coordinates(b, d, places.coordinate);
    }
    for (size_t i = 0; i < sizeof steps / sizeof *steps && b->status == MHE_OK; i++) {
        steps[i](b, d, &places);
    }
    if (b->status == MHE_OK) {
        *at = locked_at(b, d, places.coordinate);
        note_undriven(b, d);
        describe(b, d);
    }
}

mhe_status mhi_build_finish(mhi_builder *b, mhe_description **description) {
    *description = NULL;
    mhi_owned_description *owned = calloc(1, sizeof *owned);
    double *at = NULL;
    if (owned == NULL && b->status == MHE_OK) {
        b->status = mhe_fail(b->err, MHE_E_MEMORY, "out of memory");
    }
    if (b->status == MHE_OK) {
        build(b, &owned->description, &at);
    }
    if (b->status != MHE_OK || b->arena.failed) {
        free(owned);
        return mhi_build_abandon(b);
    }
    owned->arena = b->arena;
    mhe_status status = mhi_description_lock(&owned->description, at, b->err);
    if (status != MHE_OK) {
        mhi_description_free(&owned->description);
        return status;
    }
    *description = &owned->description;
    return MHE_OK;
}

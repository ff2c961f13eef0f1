/* SPDX-License-Identifier: Apache-2.0 */
/* description_coordinates.c: which coordinates are free, and in what order dependent ones follow
 * from them. */
#include "io/description_builder.h"

#include <string.h>

#define COORDINATE(b, i) ((mhi_coordinate_draft *)(b)->coordinates.items[i])
#define COUPLER(b, i) ((mhi_coupler_draft *)(b)->couplers.items[i])

/* coupler [coordinates]: the coupler that gives each coordinate its value; -1: none. */
static void find_couplers(mhi_builder *b, int32_t *coupler) {
    for (int32_t i = 0; i < b->coordinates.n; i++) {
        coupler[i] = -1;
    }
    for (int32_t k = 0; k < b->couplers.n; k++) {
        const mhi_coupler_draft *draft = COUPLER(b, k);
        const mhi_coordinate_draft *dependent = COORDINATE(b, draft->dependent);
        if (coupler[draft->dependent] >= 0) {
            mhi_build_fail(b, draft->line, "coordinate '%s' has a coupler already ('%s', line %d)",
                           dependent->coordinate.name, COUPLER(b, coupler[draft->dependent])->name,
                           (int)COUPLER(b, coupler[draft->dependent])->line);
        } else if (dependent->locked) {
            mhi_build_unsupported(b, draft->line,
                                  "coupler '%s' drives '%s', which is locked: it stays locked and "
                                  "'%s' moves without it",
                                  draft->name, dependent->coordinate.name,
                                  COORDINATE(b, draft->independent)->coordinate.name);
        } else {
            coupler[draft->dependent] = k;
        }
    }
}

/* Coordinates that move a body, or give another its value. */
static void find_used(mhi_builder *b, const int32_t *coupler, int32_t *used) {
    for (int32_t i = 0; i < b->bodies.n; i++) {
        const mhi_body_draft *body = b->bodies.items[i];
        for (int32_t k = 0; k < body->motions.n; k++) {
            const mhe_motion *motion = body->motions.items[k];
            if (motion->coordinate >= 0) {
                used[motion->coordinate] = 1;
            }
        }
    }
    for (int32_t i = 0; i < b->coordinates.n; i++) {
        if (coupler[i] >= 0) {
            used[COUPLER(b, coupler[i])->independent] = 1;
        }
    }
}

static void number_free(mhi_builder *b, const int32_t *coupler, const int32_t *used,
                        mhe_coordinate *out, mhe_description *d, int32_t *number) {
    for (int32_t i = 0; i < b->coordinates.n; i++) {
        mhi_coordinate_draft *draft = COORDINATE(b, i);
        number[i] = -1;
        if (coupler[i] >= 0) {
            continue;
        }
        draft->moves_nothing = !used[i];
        if (!used[i] && !draft->locked) {
            mhi_build_warn(b, draft->line, "coordinate '%s' moves nothing: held at its default, %g",
                           draft->coordinate.name, draft->coordinate.value);
            draft->locked = 1;
        }
        number[i] = d->n_coordinates;
        out[d->n_coordinates++] = draft->coordinate;
    }
    d->coordinates = out;
}

/* Dependents whose independent has a number, until none is left or a circle is. */
static void number_dependents(mhi_builder *b, const int32_t *coupler, mhe_dependent *out,
                              mhe_description *d, int32_t *number) {
    int32_t progress = 1;
    while (progress) {
        progress = 0;
        for (int32_t i = 0; i < b->coordinates.n; i++) {
            const mhi_coupler_draft *draft = coupler[i] >= 0 ? COUPLER(b, coupler[i]) : NULL;
            if (draft == NULL || number[i] >= 0 || number[draft->independent] < 0) {
                continue;
            }
            out[d->n_dependents] = (mhe_dependent){.coordinate = COORDINATE(b, i)->coordinate,
                                                   .independent = number[draft->independent],
                                                   .function = draft->function};
            number[i] = d->n_coordinates + d->n_dependents++;
            progress = 1;
        }
    }
    d->dependents = out;
    for (int32_t i = 0; i < b->coordinates.n; i++) {
        if (coupler[i] >= 0 && number[i] < 0) {
            const mhi_coupler_draft *draft = COUPLER(b, coupler[i]);
            mhi_build_fail(b, draft->line,
                           "coupler '%s' closes a circle: '%s' depends on '%s', which depends on "
                           "it",
                           draft->name, COORDINATE(b, i)->coordinate.name,
                           COORDINATE(b, draft->independent)->coordinate.name);
        }
    }
}

void mhi_build_coordinates(mhi_builder *b, mhe_description *d, int32_t *number) {
    int32_t n = b->coordinates.n;
    mhe_coordinate *coordinates = mhi_build_take(b, n, sizeof *coordinates);
    mhe_dependent *dependents = mhi_build_take(b, n, sizeof *dependents);
    int32_t *coupler = mhi_build_take(b, n, sizeof *coupler);
    int32_t *used = mhi_build_take(b, n, sizeof *used);
    if (b->status != MHE_OK) {
        return;
    }
    find_couplers(b, coupler);
    find_used(b, coupler, used);
    number_free(b, coupler, used, coordinates, d, number);
    number_dependents(b, coupler, dependents, d, number);
}

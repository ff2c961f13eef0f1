/* SPDX-License-Identifier: Apache-2.0 */
/* description_lock.c: coordinates of a finished description become constants. */
#include "io/description_builder.h"
#include "io/model_file.h"

#include <math.h>

/* f(at) as a function of its own; n_pieces 0 when memory is out. */
static mhe_function constant(mhi_arena *arena, const mhe_function *f, double at) {
    double *origin = MHI_TAKE(arena, double, 1), *coef = MHI_TAKE(arena, double, 1);
    if (origin == NULL || coef == NULL) {
        return (mhe_function){0};
    }
    coef[0] = mhi_function_value(f, at);
    return (mhe_function){.origin = origin, .coef = coef, .n_pieces = 1, .n_coef = 1};
}

/* The motions of a body with coordinates numbered anew, -1: locked; NULL when memory is out. */
static mhe_motion *lock_motions(mhi_arena *arena, const mhe_body *body, const int32_t *number,
                                const double *at) {
    mhe_motion *motions = MHI_TAKE(arena, mhe_motion, body->n_motions);
    for (int32_t k = 0; k < body->n_motions && motions != NULL; k++) {
        const int32_t i = body->motions[k].coordinate;
        motions[k] = body->motions[k];
        if (i < 0) {
            continue;
        }
        motions[k].coordinate = number[i];
        if (number[i] < 0) {
            motions[k].function = constant(arena, &body->motions[k].function, at[i]);
            motions = motions[k].function.n_pieces > 0 ? motions : NULL;
        }
    }
    return motions;
}

mhe_status mhi_description_lock(mhe_description *d, const double *at, mhe_error *err) {
    mhi_arena *arena = &((mhi_owned_description *)(void *)d)->arena;
    mhe_coordinate *coordinates = MHI_TAKE(arena, mhe_coordinate, d->n_coordinates);
    mhe_body *bodies = MHI_TAKE(arena, mhe_body, d->n_bodies);
    int32_t *number = MHI_TAKE(arena, int32_t, d->n_coordinates), n = 0;
    if (coordinates == NULL || bodies == NULL || number == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        number[i] = isfinite(at[i]) ? -1 : n;
        if (number[i] >= 0) {
            coordinates[n++] = d->coordinates[i];
        }
    }
    for (int32_t i = 0; i < d->n_bodies; i++) {
        bodies[i] = d->bodies[i];
        bodies[i].motions = lock_motions(arena, &d->bodies[i], number, at);
        if (bodies[i].motions == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
    }
    d->coordinates = coordinates;
    d->n_coordinates = n;
    d->bodies = bodies;
    return MHE_OK;
}

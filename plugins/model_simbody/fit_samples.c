/* SPDX-License-Identifier: Apache-2.0 */
/* fit_samples.c: poses that paths are fitted to, with what the paths are there. */
#include "fit_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MARGIN 0.05 /* of the coordinates' ranges, on both sides */
/* beyond a motion that is known, on both sides: of its width, and at least (rad or m) */
#define MOTION_MARGIN 0.2
#define LEAST_MARGIN 0.05
#define WIDEST_ANGLE 3.141592653589793
#define WIDEST_SHIFT 1.0 /* m */

/* splitmix64 */
static double uniform(uint64_t *seed) {
    *seed += 0x9e3779b97f4a7c15u;
    uint64_t z = *seed;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

void samples_free(samples *s) {
    free(s->q);
    free(s->length);
    free(s->gradient);
    free(s->lower);
}

void fit_range(const mhe_description *d, int32_t i, double share, double *lower, double *upper) {
    const mhe_coordinate *c = &d->coordinates[i];
    double widest = c->rotational ? WIDEST_ANGLE : WIDEST_SHIFT;
    *lower = fmax(c->lower, -widest);
    *upper = fmin(c->upper, widest);
    double width = *upper - *lower;
    if (d->motion_lower != NULL && d->motion_upper[i] >= d->motion_lower[i]) {
        double margin =
            fmax(LEAST_MARGIN, MOTION_MARGIN * (d->motion_upper[i] - d->motion_lower[i]));
        /* no farther than a fit of all goes, unless the motion itself does */
        *lower =
            fmax(d->motion_lower[i] - margin, fmin(*lower - MARGIN * width, d->motion_lower[i]));
        *upper =
            fmin(d->motion_upper[i] + margin, fmax(*upper + MARGIN * width, d->motion_upper[i]));
        return;
    }
    double middle = fmax(*lower, fmin(*upper, c->value));
    *lower = middle + share * (*lower - middle);
    *upper = middle + share * (*upper - middle);
    double margin = MARGIN * (*upper - *lower);
    *lower -= margin;
    *upper += margin;
    if (!(*upper > *lower)) {
        *lower = c->value - 0.01;
        *upper = c->value + 0.01;
    }
}

mhe_status samples_make(const mhe_description *d, void *model, double range, samples *s,
                        mhe_error *err) {
    size_t n_q = (size_t)d->n_coordinates, n_p = (size_t)d->n_paths;
    void *context = NULL;
    uint64_t seed = 2013;
    *s = (samples){.n_q = d->n_coordinates, .n_p = d->n_paths};
    s->q = calloc(POSES * n_q + 1, sizeof *s->q);
    s->length = calloc(POSES * n_p + 1, sizeof *s->length);
    s->gradient = calloc(POSES * n_p * n_q + 1, sizeof *s->gradient);
    s->lower = calloc(3 * n_q + 1, sizeof *s->lower);
    if (s->q == NULL || s->length == NULL || s->gradient == NULL || s->lower == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory to fit paths");
    }
    s->upper = s->lower + n_q;
    double *still = s->upper + n_q;
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        fit_range(d, i, range, &s->lower[i], &s->upper[i]);
    }
    mhe_status status = simbody_context_create(model, &context, err);
    for (size_t k = 0; k < POSES && status == MHE_OK; k++) {
        double *q = s->q + k * n_q;
        for (size_t i = 0; i < n_q; i++) {
            q[i] = s->lower[i] + (s->upper[i] - s->lower[i]) * uniform(&seed);
        }
        mhe_kinematics out = {.size = sizeof out,
                              .length = s->length + k * n_p,
                              .length_q = s->gradient + k * n_p * n_q};
        status = simbody_kinematics(context, q, still, &out, err);
    }
    simbody_context_destroy(context);
    return status;
}

/* Largest jump of the lengths where conditional points of path go on or off, over some poses. Only
 * where the coordinate is a free one. */
static double path_jump(const mhe_description *d, const samples *s, void *context, int32_t path,
                        double *length, double *q) {
    double largest = 0;
    for (int32_t k = 0; k < d->paths[path].n_points; k++) {
        const mhe_path_point *point = &d->paths[path].points[k];
        if (point->kind != MHE_POINT_CONDITIONAL || point->coordinate[0] >= d->n_coordinates) {
            continue;
        }
        int32_t c = point->coordinate[0];
        double edges[2] = {point->lower, point->upper};
        for (int e = 0; e < 2; e++) {
            for (int32_t i = 0; i < 20 && edges[e] > s->lower[c] && edges[e] < s->upper[c]; i++) {
                double value[2];
                for (int side = 0; side < 2; side++) {
                    memcpy(q, s->q + (size_t)i * (size_t)s->n_q, sizeof *q * (size_t)s->n_q);
                    q[c] = edges[e] + (side ? 1e-9 : -1e-9);
                    mhe_kinematics out = {.size = sizeof out, .length = length};
                    if (simbody_kinematics(context, q, q + s->n_q, &out, NULL) != MHE_OK) {
                        return largest;
                    }
                    value[side] = length[path];
                }
                largest = fmax(largest, fabs(value[1] - value[0]));
            }
        }
    }
    return largest;
}

mhe_status samples_jumps(const mhe_description *d, const samples *s, void *model, path_fits *fits,
                         mhe_error *err) {
    void *context = NULL;
    const size_t n = (size_t)(s->n_p + s->n_q + s->n_q); /* lengths, a pose, its velocities */
    double *scratch = calloc(n + 1, sizeof *scratch);
    mhe_status status = scratch == NULL ? mhe_fail(err, MHE_E_MEMORY, "no memory to fit paths")
                                        : simbody_context_create(model, &context, err);
    for (int32_t i = 0; i < s->n_p && status == MHE_OK; i++) {
        fits->fits[i].jump = path_jump(d, s, context, i, scratch, scratch + s->n_p);
    }
    simbody_context_destroy(context);
    free(scratch);
    return status;
}

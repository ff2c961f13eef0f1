/* SPDX-License-Identifier: Apache-2.0 */
/* crossed.c: which coordinates a path can depend on, by the description alone. */
#include "inspect/info.h"

int32_t mhi_info_root(const mhe_description *d, int32_t c) {
    while (c >= d->n_coordinates) {
        c = d->dependents[c - d->n_coordinates].independent;
    }
    return c;
}

/* 1 where `body` is `ancestor` or carried by it. */
static int32_t carried(const mhe_description *d, int32_t ancestor, int32_t body) {
    while (body >= 0 && body != ancestor) {
        body = d->bodies[body].parent;
    }
    return body >= 0;
}

/* 1 where the body carries some of what the path touches, but not all. */
static int32_t parts(const mhe_description *d, const mhe_path *path, int32_t body) {
    int32_t with = 0, without = 0;
    for (int32_t k = 0; k < path->n_points; k++) {
        const int32_t in = carried(d, body, path->points[k].body);
        with |= in;
        without |= !in;
    }
    for (int32_t k = 0; k < path->n_wraps; k++) {
        const int32_t in = carried(d, body, d->obstacles[path->wraps[k].obstacle].body);
        with |= in;
        without |= !in;
    }
    return with && without;
}

void mhi_info_crossed(const mhe_description *d, int32_t path, uint8_t *crossed) {
    const mhe_path *p = &d->paths[path];
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        crossed[i] = 0;
    }
    for (int32_t i = 0; i < d->n_bodies; i++) {
        const int32_t apart = p->length == NULL && parts(d, p, i);
        for (int32_t k = 0; apart && k < d->bodies[i].n_motions; k++) {
            const int32_t c = d->bodies[i].motions[k].coordinate;
            if (c >= 0) {
                crossed[mhi_info_root(d, c)] = 1;
            }
        }
    }
    for (int32_t k = 0; k < 3 * p->n_points; k++) {
        const int32_t c = p->points[k / 3].coordinate[k % 3];
        if (p->points[k / 3].kind != MHE_POINT_FIXED && c >= 0) {
            crossed[mhi_info_root(d, c)] = 1;
        }
    }
    for (int32_t k = 0; p->length != NULL && k < p->length->n; k++) {
        crossed[mhi_info_root(d, p->length->coordinate[k])] = 1;
    }
}

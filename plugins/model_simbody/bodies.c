/* SPDX-License-Identifier: Apache-2.0 */
/* bodies.c: where the bodies are, how they move with the coordinates, and which coordinates a path
 * depends on. */
#include "context.h"
#include "vector.h"

#include <string.h>

void bodies_pose(const simbody_context *c, int32_t body, double r[9], double p[3]) {
    static const double one[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    if (body < 0) {
        memcpy(r, one, sizeof one);
        memset(p, 0, 3 * sizeof *p);
        return;
    }
    const tree_place *place = &c->tree->bodies[body];
    if (place->link < 0) {
        memcpy(r, place->r, sizeof place->r);
        memcpy(p, place->p, sizeof place->p);
        return;
    }
    multiply3(c->r + 9 * place->link, place->r, r);
    place3(c->r + 9 * place->link, c->p + 3 * place->link, place->p, p);
}

/* Adds what the joints that carry the body do to its motion: [6 x n_q]. */
static void add_motion(const simbody_context *c, int32_t body, const double *p, double *out) {
    const tree *t = c->tree;
    for (int32_t i = t->bodies[body].link; i >= 0; i = t->joints[i].parent) {
        const double *axis = c->links[i].axis, slope = c->slopes[4 * i + 1];
        double velocity[3];
        cross3(axis, p, velocity);
        for (int k = 0; k < 3; k++) {
            double *at = out + k * t->n_q + t->joints[i].coordinate;
            at[0] += slope * axis[k];
            at[3 * t->n_q] += slope * (axis[3 + k] + velocity[k]);
        }
    }
}

void bodies_place(const simbody_context *c, double *body, double *body_q) {
    const int32_t n_q = c->tree->n_q;
    if (body == NULL && body_q == NULL) {
        return;
    }
    for (int32_t i = 0; i < c->tree->n_bodies; i++) {
        double r[9], p[3];
        bodies_pose(c, i, r, p);
        if (body != NULL) {
            memcpy(body + 12 * i, p, sizeof p);
            memcpy(body + 12 * i + 3, r, sizeof r);
        }
        if (body_q != NULL) {
            double *out = body_q + 6 * i * n_q;
            memset(out, 0, 6 * sizeof *out * (size_t)n_q);
            add_motion(c, i, p, out);
        }
    }
}

mhe_status simbody_path_pattern(const void *self, uint8_t *pattern, mhe_error *err) {
    const tree *t = ((const simbody_model *)self)->tree;
    (void)err;
    memset(pattern, 0, (size_t)t->n_muscles * (size_t)t->n_q);
    for (int32_t k = 0; k < t->n_segments; k++) {
        const tree_segment *s = &t->segments[k];
        for (int32_t i = 0; i < s->n_to + s->n_from; i++) {
            pattern[s->muscle * t->n_q + t->joints[s->joints[i]].coordinate] = 1;
        }
    }
    routes_pattern(((const simbody_model *)self)->routes, t->n_q, pattern);
    return MHE_OK;
}

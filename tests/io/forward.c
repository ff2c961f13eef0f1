/* SPDX-License-Identifier: Apache-2.0 */
#include "forward.h"

#include "io/description_builder.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What one coordinate does to the bodies behind it: a turn about or a shift along a line. */
typedef struct column {
    int body, kind, coordinate;
    double axis[3], at[3];
} column;

typedef struct pose {
    mhi_transform *bodies;
    column *columns;
    int n_columns;
} pose;

static mhi_transform motion_transform(const mhe_motion *m, const double *q) {
    mhi_transform x = mhi_transform_identity();
    double value = mhi_function_value(&m->function, m->coordinate < 0 ? 0 : q[m->coordinate]);
    if (m->kind == MHE_MOTION_TRANSLATION) {
        for (int i = 0; i < 3; i++) {
            x.p[i] = value * m->axis[i];
        }
        return x;
    }
    const double *a = m->axis, c = cos(value), s = sin(value);
    const double cross[9] = {0, -a[2], a[1], a[2], 0, -a[0], -a[1], a[0], 0};
    for (int i = 0; i < 3; i++) { /* Rodrigues */
        for (int j = 0; j < 3; j++) {
            x.r[3 * i + j] = c * (i == j) + (1 - c) * a[i] * a[j] + s * cross[3 * i + j];
        }
    }
    return x;
}

static pose place(const mhe_description *d, const double *q) {
    int motions = 0;
    for (int i = 0; i < d->n_bodies; i++) {
        motions += d->bodies[i].n_motions;
    }
    pose p = {.bodies = calloc((size_t)d->n_bodies + 1, sizeof *p.bodies),
              .columns = calloc((size_t)motions + 1, sizeof *p.columns)};
    for (int i = 0; i < d->n_bodies; i++) {
        const mhe_body *body = &d->bodies[i];
        mhi_transform x, part;
        memcpy(part.r, body->joint_r, sizeof part.r);
        memcpy(part.p, body->joint_p, sizeof part.p);
        x = body->parent < 0 ? part : mhi_transform_times(&p.bodies[body->parent], &part);
        for (int k = 0; k < body->n_motions; k++) {
            const mhe_motion *m = &body->motions[k];
            if (m->coordinate >= 0) {
                column *c = &p.columns[p.n_columns++];
                mhi_transform turn = x;
                memset(turn.p, 0, sizeof turn.p);
                *c = (column){.body = i, .kind = m->kind, .coordinate = m->coordinate};
                mhi_transform_point(&turn, m->axis, c->axis);
                memcpy(c->at, x.p, sizeof c->at);
            }
            part = motion_transform(m, q);
            x = mhi_transform_times(&x, &part);
        }
        memcpy(part.r, body->body_r, sizeof part.r);
        memcpy(part.p, body->body_p, sizeof part.p);
        p.bodies[i] = mhi_transform_times(&x, &part);
    }
    return p;
}

static void world(const pose *p, int body, const double location[3], double out[3]) {
    if (body < 0) {
        memcpy(out, location, 3 * sizeof *out);
    } else {
        mhi_transform_point(&p->bodies[body], location, out);
    }
}

static int carries(const mhe_description *d, int ancestor, int body) {
    while (body >= 0 && body != ancestor) {
        body = d->bodies[body].parent;
    }
    return body >= 0;
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Velocity of `point` and angular velocity of its body for a unit rate of the column. */
static void rates(const column *c, const double point[3], double linear[3], double angular[3]) {
    if (c->kind == MHE_MOTION_TRANSLATION) {
        memcpy(linear, c->axis, sizeof c->axis);
        memset(angular, 0, sizeof c->axis);
        return;
    }
    const double r[3] = {point[0] - c->at[0], point[1] - c->at[1], point[2] - c->at[2]};
    memcpy(angular, c->axis, sizeof c->axis);
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        linear[i] = c->axis[j] * r[k] - c->axis[k] * r[j];
    }
}

static void dynamics(const mhe_description *d, const pose *p, double *mass, double *gravity) {
    int n = d->n_coordinates;
    memset(mass, 0, sizeof *mass * (size_t)(n * n));
    memset(gravity, 0, sizeof *gravity * (size_t)n);
    for (int i = 0; i < d->n_bodies; i++) {
        const mhe_body *body = &d->bodies[i];
        double com[3], v[3], w[3], v2[3], w2[3], local[3], local2[3], iw[3];
        world(p, i, body->com, com);
        mhi_transform back = p->bodies[i];
        memset(back.p, 0, sizeof back.p);
        back = mhi_transform_inverse(&back);
        mhi_transform inertia = {.p = {0}};
        memcpy(inertia.r, body->inertia, sizeof inertia.r);
        for (int a = 0; a < p->n_columns; a++) {
            if (!carries(d, p->columns[a].body, i)) {
                continue;
            }
            rates(&p->columns[a], com, v, w);
            mhi_transform_point(&back, w, local);
            mhi_transform_point(&inertia, local, iw);
            gravity[p->columns[a].coordinate] -= body->mass * dot(d->gravity, v);
            for (int b = 0; b < p->n_columns; b++) {
                if (carries(d, p->columns[b].body, i)) {
                    rates(&p->columns[b], com, v2, w2);
                    mhi_transform_point(&back, w2, local2);
                    mass[p->columns[a].coordinate * n + p->columns[b].coordinate] +=
                        body->mass * dot(v, v2) + dot(iw, local2);
                }
            }
        }
    }
}

void test_forward(const mhe_description *d, const double *q, double *markers, double *lengths,
                  double *mass, double *gravity) {
    pose p = place(d, q);
    for (int i = 0; markers != NULL && i < d->n_markers; i++) {
        world(&p, d->markers[i].body, d->markers[i].location, &markers[3 * i]);
    }
    for (int i = 0; lengths != NULL && i < d->n_muscles; i++) {
        const mhe_path *m = &d->paths[i];
        double from[3], to[3];
        lengths[i] = 0;
        world(&p, m->points[0].body, m->points[0].location, from);
        for (int k = 1; k < m->n_points; k++) {
            world(&p, m->points[k].body, m->points[k].location, to);
            lengths[i] += hypot(hypot(to[0] - from[0], to[1] - from[1]), to[2] - from[2]);
            memcpy(from, to, sizeof from);
        }
    }
    if (mass != NULL && gravity != NULL) {
        dynamics(d, &p, mass, gravity);
    }
    free(p.bodies);
    free(p.columns);
}

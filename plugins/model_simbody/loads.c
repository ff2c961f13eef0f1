/* SPDX-License-Identifier: Apache-2.0 */
/* loads.c: generalised force of forces and torques on bodies.
 *
 * A load is, in ground axes at the ground origin, the spatial force F = [x x f + t, f]. With S_i
 * the axis of joint i, every joint that carries the body takes S_i . F, times its function's slope.
 * Turning joint j moves S_i by S_j x S_i where j carries joint i, f and t by w_j x where it carries
 * the body in whose axes they are given, and the point by w_j x + v_j where it carries the body in
 * whose frame that is. */
#include "context.h"
#include "vector.h"

#include <math.h>
#include <string.h>

/* A load in ground. */
typedef struct ground_load {
    int32_t link, axes, origin; /* links; -1: ground */
    double f[3], x[3], t[3];
} ground_load;

static int32_t link_of(const tree *t, int32_t body) {
    return body < 0 ? -1 : t->bodies[body].link;
}

static ground_load to_ground(const simbody_context *c, const mhe_load *load, const double *value) {
    ground_load out = {.link = link_of(c->tree, load->body),
                       .axes = link_of(c->tree, load->axes),
                       .origin = link_of(c->tree, load->origin),
                       .f = {value[0], value[1], value[2]},
                       .x = {value[3], value[4], value[5]},
                       .t = {value[6], value[7], value[8]}};
    double r[9], p[3];
    if (load->axes >= 0) { /* ground's axes stay as they are */
        bodies_pose(c, load->axes, r, p);
        rotate3(r, value, out.f);
        rotate3(r, value + 6, out.t);
    }
    if (load->origin >= 0) {
        bodies_pose(c, load->origin, r, p);
        place3(r, p, value + 3, out.x);
    }
    return out;
}

/* spatial force of force f at x and torque t; t may be NULL */
static void spatial(const double *f, const double *x, const double *t, double *out) {
    cross3(x, f, out);
    for (int k = 0; k < 3; k++) {
        out[k] += t == NULL ? 0 : t[k];
        out[3 + k] = f[k];
    }
}

/* Whether turning joint j moves link i. */
static int carries(const tree *t, int32_t j, int32_t i) {
    while (i > j) { /* parents have smaller numbers */
        i = t->joints[i].parent;
    }
    return i == j;
}

/* Change of the load's spatial force when a joint turns about `axis`, which carries the load's
 * axes, and its origin, or not. */
static void force_change(const ground_load *load, const double *axis, int with_axes,
                         int with_origin, double *out) {
    double change[3], moment[3];
    memset(out, 0, 6 * sizeof *out);
    if (with_axes) {
        cross3(axis, load->f, change);
        cross3(axis, load->t, moment);
        spatial(change, load->x, moment, out);
    }
    if (with_origin) {
        cross3(axis, load->x, change);
        add3(change, 1, axis + 3);
        cross3(change, load->f, moment);
        add3(out, 1, moment);
    }
}

static void add_force(const simbody_context *c, int32_t link, const double *force, int32_t stride,
                      double *tau) {
    const tree *t = c->tree;
    for (int32_t i = link; i >= 0; i = t->joints[i].parent) {
        tau[t->joints[i].coordinate * stride] +=
            c->slopes[4 * i + 1] * dot6(c->links[i].axis, force);
    }
}

/* What turning joint j changes: it carries the load's body (`below`), its axes, its origin, or not.
 * That it moves the axis of a joint i beyond it counts as (S_j x S_i) . F = -S_i . (S_j x* F). */
static inline void turn_joint(const simbody_context *c, const ground_load *load,
                              const double *force, int32_t j, int below, double *tau_q) {
    const tree *t = c->tree;
    const int with_axes = load->axes >= 0 && carries(t, j, load->axes);
    const int with_origin =
        load->origin == load->link ? below : load->origin >= 0 && carries(t, j, load->origin);
    const double *axis = c->links[j].axis, slope = c->slopes[4 * j + 1];
    double *column = tau_q + t->joints[j].coordinate, change[6] = {0}, turned[6];
    int32_t i = load->link;
    if (with_axes || with_origin) {
        force_change(load, axis, with_axes, with_origin, change);
    }
    if (below) {
        cross_force(axis, force, turned);
        for (int k = 0; k < 6; k++) {
            turned[k] = slope * (change[k] - turned[k]);
        }
        for (; i > j; i = t->joints[i].parent) {
            column[t->joints[i].coordinate * t->n_q] +=
                c->slopes[4 * i + 1] * dot6(c->links[i].axis, turned);
        }
        if (c->slopes[4 * j + 2] != 0) { /* the function's own slope */
            column[t->joints[j].coordinate * t->n_q] += c->slopes[4 * j + 2] * dot6(axis, force);
        }
    }
    for (; i >= 0 && (with_axes || with_origin); i = t->joints[i].parent) {
        column[t->joints[i].coordinate * t->n_q] +=
            slope * c->slopes[4 * i + 1] * dot6(c->links[i].axis, change);
    }
}

/* d tau/dq of one load, by the joints that move it: those that carry its body, and where its axes
 * or its origin are another body's, those that carry that one alone. */
static void add_derivative(const simbody_context *c, const ground_load *load, const double *force,
                           double *tau_q) {
    const tree *t = c->tree;
    for (int32_t j = load->link; j >= 0; j = t->joints[j].parent) {
        turn_joint(c, load, force, j, 1, tau_q);
    }
    const int elsewhere = (load->axes >= 0 && load->axes != load->link) ||
                          (load->origin >= 0 && load->origin != load->link);
    for (int32_t j = 0; j < t->n_joints && elsewhere; j++) {
        if (!carries(t, j, load->link)) {
            turn_joint(c, load, force, j, 0, tau_q);
        }
    }
}

/* Columns 0 .. 8 of tau_l, `width` wide: by force, point and torque in their frames. */
static void set_value_derivative(const simbody_context *c, const mhe_load *frames,
                                 const ground_load *load, int32_t width, double *tau_l) {
    double axes[9], origin[9], p[3];
    bodies_pose(c, frames->axes, axes, p);
    bodies_pose(c, frames->origin, origin, p);
    for (int32_t k = 0; k < 9; k++) {
        const double *r = k / 3 == 1 ? origin : axes;
        const double unit[3] = {r[k % 3], r[3 + k % 3], r[6 + k % 3]};
        double force[6] = {0};
        if (k / 3 == 0) {
            spatial(unit, load->x, NULL, force);
        } else if (k / 3 == 1) {
            cross3(unit, load->f, force);
        } else {
            memcpy(force, unit, sizeof unit);
        }
        for (int32_t i = 0; i < c->tree->n_q; i++) {
            tau_l[i * width + k] = 0;
        }
        add_force(c, load->link, force, width, tau_l + k);
    }
}

mhe_status simbody_loads(void *context, const mhe_load *loads, int32_t n, const double *value,
                         double *tau, double *tau_q, double *tau_l, mhe_error *err) {
    const simbody_context *c = context;
    if (!c->placed) {
        return mhe_fail(err, MHE_RETRY, "no state is set");
    }
    for (int32_t i = 0; i < n; i++) {
        const ground_load load = to_ground(c, &loads[i], value + 9 * i);
        double force[6], sum = 0;
        spatial(load.f, load.x, load.t, force);
        for (int k = 0; k < 6; k++) {
            sum += force[k] * 0.0;
        }
        if (sum != 0) {
            return mhe_fail(err, MHE_RETRY, "a load is not finite");
        }
        if (tau != NULL) {
            add_force(c, load.link, force, 1, tau);
        }
        if (tau_q != NULL) {
            add_derivative(c, &load, force, tau_q);
        }
        if (tau_l != NULL) {
            set_value_derivative(c, &loads[i], &load, 9 * n, tau_l + 9 * i);
        }
    }
    return MHE_OK;
}

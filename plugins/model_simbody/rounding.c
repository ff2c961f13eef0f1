/* SPDX-License-Identifier: Apache-2.0 */
/* rounding.c: torques by frames that are not quite rotations: one pass outwards for what strain
 * does to axes, velocities and momenta, one inwards that sums over the links beyond a joint. */
#include "rounding.h"

#include "vector.h"

#include <string.h>

/* E = ((y - z x x) (y x z)^T - (x - y x z) (z x x)^T) / det R, of R's columns x, y, z */
static void joint_strain(const double *r, double *strain) {
    double x[3] = {r[0], r[3], r[6]}, y[3] = {r[1], r[4], r[7]}, z[3] = {r[2], r[5], r[8]};
    double yz[3], zx[3];
    cross3(y, z, yz);
    cross3(z, x, zx);
    double scale = 1 / dot3(x, yz);
    add3(x, -1, yz);
    add3(y, -1, zx);
    memset(strain, 0, 9 * sizeof *strain);
    add_outer3(strain, scale, y, yz);
    add_outer3(strain, -scale, x, zx);
}

/* Rate of the axis S of a joint at p, by strain of its parent. */
static void axis_rate(const link_rounding *parent, int32_t kind, const double *p,
                      const double *axis, double *rate) {
    double moved[3], arm[3];
    if (kind != MHE_MOTION_ROTATION) {
        memset(rate, 0, 3 * sizeof *rate);
        rotate3(parent->strain, axis + 3, rate + 3);
        return;
    }
    rotate3(parent->strain, axis, rate);
    place3(parent->strain, parent->drift, p, moved);
    cross3(moved, axis, rate + 3);
    cross3(p, rate, arm);
    add3(rate + 3, 1, arm);
}

/* out = rate of the link's inertia about its centre of mass, by strain, times omega */
static void inertia_rate(const link_points *apart, const double *strain, const double *omega,
                         double *out) {
    double turned[3], untwisted[3] = {0}, widening = 0;
    rotate3(apart->rest, omega, turned);
    rotate3(strain, turned, out);
    for (int i = 0; i < 3; i++) {
        add3(untwisted, omega[i], strain + 3 * i);
        widening += 2 * dot3(strain + 3 * i, apart->points + 3 * i);
    }
    rotate3(apart->rest, untwisted, turned);
    add3(out, 1, turned);
    add3(out, widening, omega);
}

/* Momentum of the link alone, its rate, and the derivatives of its kinetic energy. */
static void link_momentum(const tree_joint *joint, const double *r, const double *p,
                          const link_motion *link, const link_points *apart, link_rounding *w) {
    double com[3], moved[3], rate[3], torque[3], spin[3];
    const double *omega = link->velocity, *force = w->momentum + 3;
    place3(r, p, joint->com, com);
    place3(w->strain, w->drift, com, moved);
    inertia_times(&link->own, link->velocity, w->momentum);

    inertia_times(&link->own, w->acceleration, w->force);
    cross3(omega, moved, rate);
    add3(w->force + 3, joint->mass, rate);
    cross3(com, rate, torque);
    add3(w->force, joint->mass, torque);
    cross3(moved, force, torque);
    add3(w->force, 1, torque);
    inertia_rate(apart, w->strain, omega, torque);
    add3(w->force, 1, torque);

    cross3(force, omega, w->energy_drift);
    rotate3(apart->rest, omega, spin);
    add_outer3(w->energy_strain, 1, w->energy_drift, com);
    add_outer3(w->energy_strain, 1, omega, spin);
    for (int i = 0; i < 3; i++) {
        add3(w->energy_strain + 3 * i, dot3(omega, omega), apart->points + 3 * i);
    }
}

/* Kinetic energy by strain that moves the axis of a joint, whose speed carries `momentum`. */
static void axis_energy(int32_t kind, const double *p, const double *axis, double speed,
                        link_rounding *w) {
    double moment[3], push[3];
    const double *momentum = w->momentum;
    if (kind != MHE_MOTION_ROTATION) {
        add_outer3(w->energy_strain, speed, momentum + 3, axis + 3);
        return;
    }
    cross3(momentum + 3, p, moment);
    add3(moment, 1, momentum);
    cross3(axis, momentum + 3, push);
    add_outer3(w->energy_strain, speed, moment, axis);
    add_outer3(w->energy_strain, speed, push, p);
    add3(w->energy_drift, speed, push);
}

static void outwards(const tree *t, const double *r, const double *p, const double *speed,
                     const link_motion *links, const link_points *points, link_rounding *work) {
    static const link_rounding ground;
    for (int32_t i = 0; i < t->n_joints; i++) {
        const tree_joint *joint = &t->joints[i];
        const link_rounding *parent = joint->parent < 0 ? &ground : &work[joint->parent];
        link_rounding *w = &work[i];
        double shift[3];
        *w = ground;
        axis_rate(parent, joint->kind, p + 3 * i, links[i].axis, w->axis_rate);
        memcpy(w->acceleration, parent->acceleration, sizeof w->acceleration);
        add6(w->acceleration, speed[i], w->axis_rate);
        memcpy(w->strain, parent->strain, sizeof w->strain);
        memcpy(w->drift, parent->drift, sizeof w->drift);
        if (joint->kind == MHE_MOTION_ROTATION) {
            joint_strain(r + 9 * i, w->joint);
            for (int k = 0; k < 9; k++) {
                w->strain[k] += speed[i] * w->joint[k];
            }
            rotate3(w->joint, p + 3 * i, shift);
            add3(w->drift, -speed[i], shift);
        }
        if (joint->mass > 0) {
            link_momentum(joint, r + 9 * i, p + 3 * i, &links[i], &points[i], w);
        }
    }
}

void rounding_torque(const tree *t, const double *r, const double *p, const double *speed,
                     const link_motion *links, const link_points *points, link_rounding *work,
                     double *torque) {
    outwards(t, r, p, speed, links, points, work);
    for (int32_t i = t->n_joints - 1; i >= 0; i--) {
        const tree_joint *joint = &t->joints[i];
        link_rounding *w = &work[i];
        torque[i] = dot6(w->axis_rate, w->momentum) + dot6(links[i].axis, w->force);
        for (int k = 0; k < 3; k++) { /* E moves points by E (x - p) */
            torque[i] -= dot3(w->joint + 3 * k, w->energy_strain + 3 * k) -
                         w->energy_drift[k] * dot3(w->joint + 3 * k, p + 3 * i);
        }
        if (joint->parent < 0) {
            continue;
        }
        axis_energy(joint->kind, p + 3 * i, links[i].axis, speed[i], w);
        link_rounding *parent = &work[joint->parent];
        add6(parent->momentum, 1, w->momentum);
        add6(parent->force, 1, w->force);
        add3(parent->energy_drift, 1, w->energy_drift);
        for (int k = 0; k < 9; k++) {
            parent->energy_strain[k] += w->energy_strain[k];
        }
    }
}

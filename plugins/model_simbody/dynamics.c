/* SPDX-License-Identifier: Apache-2.0 */
/* dynamics.c: recursive inverse dynamics and its derivatives, in ground coordinates.
 *
 * Symbols: S axis, v velocity, a acceleration, I inertia, F composite force; parent p of link j.
 * Turning joint j moves everything beyond it rigidly along S_j. Seen from a frame that is moved
 * along, the links beyond j keep their places and axes, while the motion of j's parent changes by
 *     v_p x S_j =: S'_j (axis_rate)        a_p x S_j,
 * so that link i beyond j sees dv_i = S'_j, da_i = S''_j - v_i x S'_j with
 *     S''_j = a_p x S_j + v_p x S'_j,
 * and its force I a + v x* I v changes by I_i S''_j + B_i S'_j with
 *     B_i x = v_i x* I_i x - I_i (v_i x x) + x x* I_i v_i     (rate).
 * Written out with I = (m, h, J), v = [w, u] and x = [a, b], Jacobi's identity leaves nothing of b:
 *     B x = [(2 w x J - tr(J) w x - 2 u h^T + 2 u.h) a, 2 a x p],     p = m u + w x h.
 * A change of the joint's speed gives dv_i = S_j, da_i = 2 S'_j - v_i x S_j, hence the force
 * changes by 2 I_i S'_j + B_i S_j. Sums over the links beyond a joint are the composites. */
#include "dynamics.h"

#include "vector.h"

#include <math.h>
#include <string.h>

static const double no_motion[6];

static inline void times(const rigid_inertia *inertia, const double *v, double *f) {
    double other[3];
    rotate3(inertia->second, v, f);
    cross3(inertia->first, v + 3, other);
    for (int i = 0; i < 3; i++) {
        f[i] += other[i];
    }
    cross3(v, inertia->first, other);
    for (int i = 0; i < 3; i++) {
        f[3 + i] = inertia->mass * v[3 + i] + other[i];
    }
}

void inertia_times(const rigid_inertia *inertia, const double *v, double *f) {
    times(inertia, v, f);
}

static void inertia_add(rigid_inertia *to, const rigid_inertia *from) {
    to->mass += from->mass;
    for (int i = 0; i < 3; i++) {
        to->first[i] += from->first[i];
    }
    for (int i = 0; i < 9; i++) {
        to->second[i] += from->second[i];
    }
}

void dynamics_place(const tree *t, const double *angle, double *r, double *p) {
    static const double one[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, zero[3] = {0, 0, 0};
    for (int32_t i = 0; i < t->n_joints; i++) {
        const tree_joint *joint = &t->joints[i];
        const double *base_r = joint->parent < 0 ? one : r + 9 * joint->parent;
        const double *base_p = joint->parent < 0 ? zero : p + 3 * joint->parent;
        double *own_r = r + 9 * i, *own_p = p + 3 * i;
        multiply3(base_r, joint->r, own_r);
        place3(base_r, base_p, joint->p, own_p);
        if (joint->kind == MHE_MOTION_ROTATION) {
            double c = cos(angle[i]), s = sin(angle[i]);
            for (int k = 0; k < 9; k += 3) {
                double x = own_r[k], y = own_r[k + 1];
                own_r[k] = c * x + s * y;
                own_r[k + 1] = c * y - s * x;
            }
        } else {
            for (int k = 0; k < 3; k++) {
                own_p[k] += angle[i] * own_r[3 * k];
            }
        }
    }
}

void dynamics_axes(const tree *t, const double *r, const double *p, link_motion *links) {
    for (int32_t i = 0; i < t->n_joints; i++) {
        double *axis = links[i].axis;
        int rotation = t->joints[i].kind == MHE_MOTION_ROTATION;
        int column = rotation ? 2 : 0; /* the joint's axis in its link's frame */
        double direction[3] = {r[9 * i + column], r[9 * i + 3 + column], r[9 * i + 6 + column]};
        memset(axis, 0, sizeof links[i].axis);
        memcpy(rotation ? axis : axis + 3, direction, sizeof direction);
        if (rotation) {
            cross3(p + 3 * i, direction, axis + 3);
        }
    }
}

/* out = r m r^T; bodies that only stand between two joints have no inertia. */
static void turn_inertia(const double *r, const double *m, double *out) {
    int any = 0;
    for (int i = 0; i < 9; i++) {
        any |= m[i] != 0;
    }
    if (any) {
        congruence3(r, m, out);
    } else {
        memset(out, 0, 9 * sizeof *out);
    }
}

static void add_diagonal(double *m, double value) {
    for (int i = 0; i < 9; i += 4) {
        m[i] += value;
    }
}

static void own_inertia(const tree_joint *joint, const double *r, const double *p,
                        rigid_inertia *own, link_points *apart) {
    double com[3];
    place3(r, p, joint->com, com);
    own->mass = joint->mass;
    for (int k = 0; k < 3; k++) {
        own->first[k] = joint->mass * com[k];
    }
    if (apart == NULL) {
        turn_inertia(r, joint->inertia, own->second);
    } else {
        double rest[9];
        memcpy(rest, joint->inertia, sizeof rest);
        add_diagonal(rest, -trace3(joint->points));
        turn_inertia(r, rest, apart->rest);
        turn_inertia(r, joint->points, apart->points);
        memcpy(own->second, apart->rest, sizeof own->second);
        add_diagonal(own->second, trace3(apart->points));
    }
    add_point_inertia(joint->mass, com, own->second);
}

void dynamics_inertias(const tree *t, const double *r, const double *p, link_motion *links,
                       link_points *points) {
    for (int32_t i = 0; i < t->n_joints; i++) {
        rigid_inertia *own = &links[i].own;
        memset(own, 0, sizeof *own);
        if (t->joints[i].mass > 0) {
            link_points *apart = points == NULL ? NULL : &points[i];
            own_inertia(&t->joints[i], r + 9 * i, p + 3 * i, own, apart);
        }
        links[i].composite = *own;
    }
    for (int32_t i = t->n_joints - 1; i >= 0; i--) {
        int32_t parent = t->joints[i].parent;
        if (parent >= 0) {
            inertia_add(&links[parent].composite, &links[i].composite);
        }
    }
}

void dynamics_mass(const tree *t, const link_motion *links, double *mass) {
    size_t n = (size_t)t->n_joints;
    memset(mass, 0, n * n * sizeof *mass);
    for (int32_t j = 0; j < t->n_joints; j++) {
        double momentum[6];
        times(&links[j].composite, links[j].axis, momentum);
        for (int32_t i = j; i >= 0; i = t->joints[i].parent) {
            double entry = dot6(links[i].axis, momentum);
            mass[(size_t)i * n + (size_t)j] = entry;
            mass[(size_t)j * n + (size_t)i] = entry;
        }
    }
}

void dynamics_velocities(const tree *t, const double *speed, link_motion *links) {
    for (int32_t i = 0; i < t->n_joints; i++) {
        int32_t parent = t->joints[i].parent;
        const double *base = parent < 0 ? no_motion : links[parent].velocity;
        cross_motion(base, links[i].axis, links[i].axis_rate);
        memcpy(links[i].velocity, base, sizeof links[i].velocity);
        add6(links[i].velocity, speed[i], links[i].axis);
    }
}

static void base_acceleration(const tree *t, const link_motion *links, int32_t i, double *a) {
    int32_t parent = t->joints[i].parent;
    if (parent >= 0) {
        memcpy(a, links[parent].acceleration, sizeof links[parent].acceleration);
        return;
    }
    for (int k = 0; k < 3; k++) {
        a[k] = 0;
        a[3 + k] = -t->gravity[k];
    }
}

void dynamics_inverse(const tree *t, const double *speed, const double *acceleration,
                      link_motion *links, double *torque) {
    for (int32_t i = 0; i < t->n_joints; i++) {
        link_motion *link = &links[i];
        base_acceleration(t, links, i, link->acceleration);
        add6(link->acceleration, acceleration[i], link->axis);
        add6(link->acceleration, speed[i], link->axis_rate);
        memset(link->force, 0, sizeof link->force);
        if (link->own.mass > 0) {
            double momentum[6], turning[6];
            times(&link->own, link->velocity, momentum);
            cross_force(link->velocity, momentum, turning);
            times(&link->own, link->acceleration, link->force);
            add6(link->force, 1, turning);
        }
    }
    for (int32_t i = t->n_joints - 1; i >= 0; i--) {
        torque[i] = dot6(links[i].axis, links[i].force);
        if (t->joints[i].parent >= 0) {
            add6(links[t->joints[i].parent].force, 1, links[i].force);
        }
    }
}

/* B of one link: rate, and p. */
static void own_rate(const link_motion *link, double *rate, double *momentum) {
    const double *w = link->velocity, *u = w + 3, *h = link->own.first, *j = link->own.second;
    const double along = 2 * dot3(u, h), trace = trace3(j);
    cross3(w, h, momentum);
    add3(momentum, link->own.mass, u);
    for (int k = 0; k < 3; k++) {
        const double column[3] = {j[k], j[3 + k], j[6 + k]};
        double turned[3];
        cross3(w, column, turned);
        for (int i = 0; i < 3; i++) {
            rate[3 * i + k] = 2 * (turned[i] - u[i] * h[k]);
        }
        rate[4 * k] += along;
    }
    rate[1] += trace * w[2];
    rate[2] -= trace * w[1];
    rate[3] -= trace * w[2];
    rate[5] += trace * w[0];
    rate[6] += trace * w[1];
    rate[7] -= trace * w[0];
}

void dynamics_rates(const tree *t, link_motion *links) {
    for (int32_t i = 0; i < t->n_joints; i++) {
        if (links[i].own.mass > 0) {
            own_rate(&links[i], links[i].rate, links[i].momentum);
        } else {
            memset(links[i].rate, 0, sizeof links[i].rate);
            memset(links[i].momentum, 0, sizeof links[i].momentum);
        }
    }
    for (int32_t i = t->n_joints - 1; i >= 0; i--) {
        if (t->joints[i].parent >= 0) {
            link_motion *sum = &links[t->joints[i].parent];
            for (int k = 0; k < 9; k++) {
                sum->rate[k] += links[i].rate[k];
            }
            add3(sum->momentum, 1, links[i].momentum);
        }
    }
}

/* out = I x + B y of the composite */
static void composite_change(const link_motion *link, const double *x, const double *y,
                             double *out) {
    double turned[3], moved[3];
    times(&link->composite, x, out);
    rotate3(link->rate, y, turned);
    cross3(y, link->momentum, moved);
    add3(out, 1, turned);
    add3(out + 3, 2, moved);
}

/* out [3]: the first half of B^T x of the composite; the other is 0. */
static void composite_rate_transposed(const link_motion *link, const double *x, double *out) {
    double moved[3];
    cross3(link->momentum, x + 3, moved);
    for (int i = 0; i < 3; i++) {
        out[i] = x[0] * link->rate[i] + x[1] * link->rate[3 + i] + x[2] * link->rate[6 + i] +
                 2 * moved[i];
    }
}

/* S'' of all joints */
static void second_axis_rates(const tree *t, link_motion *links) {
    for (int32_t j = 0; j < t->n_joints; j++) {
        int32_t parent = t->joints[j].parent;
        double base[6], turning[6];
        base_acceleration(t, links, j, base);
        cross_motion(base, links[j].axis, links[j].second);
        cross_motion(parent < 0 ? no_motion : links[parent].velocity, links[j].axis_rate, turning);
        add6(links[j].second, 1, turning);
    }
}

void dynamics_derivatives(const tree *t, link_motion *links, double *by_angle, double *by_speed) {
    size_t n = (size_t)t->n_joints;
    memset(by_angle, 0, n * n * sizeof *by_angle);
    memset(by_speed, 0, n * n * sizeof *by_speed);
    second_axis_rates(t, links);
    for (int32_t j = 0; j < t->n_joints; j++) {
        const link_motion *link = &links[j];
        double twice[6], angle[6], speed[6], carried[6], inertia[6], rate[3];
        for (int k = 0; k < 6; k++) {
            twice[k] = 2 * link->axis_rate[k];
        }
        /* column j, rows of j and of the joints that carry it */
        composite_change(link, link->second, link->axis_rate, angle);
        composite_change(link, twice, link->axis, speed);
        by_angle[(size_t)j * n + (size_t)j] = dot6(link->axis, angle);
        by_speed[(size_t)j * n + (size_t)j] = dot6(link->axis, speed);
        cross_force(link->axis, link->force, carried);
        add6(angle, 1, carried); /* seen from ground, the force itself is moved along */
        /* row j, columns of the joints that carry it */
        times(&link->composite, link->axis, inertia);
        composite_rate_transposed(link, link->axis, rate);
        for (int32_t i = t->joints[j].parent; i >= 0; i = t->joints[i].parent) {
            const link_motion *base = &links[i];
            size_t above = (size_t)i * n + (size_t)j, below = (size_t)j * n + (size_t)i;
            by_angle[above] = dot6(base->axis, angle);
            by_speed[above] = dot6(base->axis, speed);
            by_angle[below] = dot6(inertia, base->second) + dot3(rate, base->axis_rate);
            by_speed[below] = 2 * dot6(inertia, base->axis_rate) + dot3(rate, base->axis);
        }
    }
}

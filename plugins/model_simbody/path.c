/* SPDX-License-Identifier: Apache-2.0 */
/* path.c: points of links and straight muscle paths through them.
 *
 * A point p beyond joint i moves by dp/di = z_i x (p - o_i) with a pin, z_i with a slider. Turning
 * a pin i also turns the changes by all joints j outside it (and its own): d2p/didj = z_i x dp/dj;
 * a slider turns nothing. With d = to - from, u = d / |d| and d_i = dd/di: l_i = u . d_i,   l_ij =
 * (d_i . d_j - l_i l_j) / l + u . d_ij, where u . (z_i x d_j) = (u x z_i) . d_j. Joint functions
 * f(q) bring f' to each d_i and f'' to the diagonal. */
#include "path.h"

#include "vector.h"

#include <math.h>
#include <string.h>

#define COINCIDENT 1e-9 /* m: below this a segment has no direction */

static void point_place(const path_pose *pose, const tree_point *point, double *out) {
    if (point->link < 0) {
        memcpy(out, point->at, sizeof point->at);
    } else {
        place3(pose->r + 9 * point->link, pose->p + 3 * point->link, point->at, out);
    }
}

static int joint_axis(const tree *t, const path_pose *pose, int32_t joint, double *axis) {
    int rotation = t->joints[joint].kind == MHE_MOTION_ROTATION;
    const double *r = pose->r + 9 * joint;
    for (int k = 0; k < 3; k++) {
        axis[k] = r[3 * k + (rotation ? 2 : 0)];
    }
    return rotation;
}

/* out = change of a point at `at` beyond `joint` per unit of the joint */
static int point_change(const tree *t, const path_pose *pose, int32_t joint, const double *at,
                        double *axis, double *out) {
    int rotation = joint_axis(t, pose, joint, axis);
    if (rotation) {
        const double *o = pose->p + 3 * joint;
        double arm[3] = {at[0] - o[0], at[1] - o[1], at[2] - o[2]};
        cross3(axis, arm, out);
    } else {
        memcpy(out, axis, 3 * sizeof *out);
    }
    return rotation;
}

void path_markers(const tree *t, const path_pose *pose, double *position, double *position_q) {
    size_t n_q = (size_t)t->n_q;
    if (position_q != NULL) {
        memset(position_q, 0, sizeof *position_q * 3 * (size_t)t->n_markers * n_q);
    }
    for (int32_t m = 0; m < t->n_markers; m++) {
        double at[3];
        point_place(pose, &t->markers[m], at);
        if (position != NULL) {
            memcpy(position + 3 * m, at, sizeof at);
        }
        if (position_q == NULL) {
            continue;
        }
        for (int32_t i = t->markers[m].link; i >= 0; i = t->joints[i].parent) {
            double axis[3], change[3];
            (void)point_change(t, pose, i, at, axis, change);
            for (int k = 0; k < 3; k++) {
                position_q[(size_t)(3 * m + k) * n_q + (size_t)t->joints[i].coordinate] +=
                    pose->slopes[4 * i + 1] * change[k];
            }
        }
    }
}

/* Steps of one segment, and its share in dL/dq (and the f'' terms of d2L/dq2). */
static void segment_slopes(const tree *t, const path_pose *pose, const tree_segment *segment,
                           const double *to, const double *from, const double *u, double length,
                           path_step *steps, double *row_q, double *row_qq) {
    for (int32_t k = 0; k < segment->n_to + segment->n_from; k++) {
        path_step *step = &steps[k];
        int32_t joint = segment->joints[k];
        const double *f = pose->slopes + 4 * joint;
        double axis[3], change[3];
        step->side = k < segment->n_to;
        step->coordinate = t->joints[joint].coordinate;
        int rotation = point_change(t, pose, joint, step->side ? to : from, axis, change);
        double sign = step->side ? 1 : -1;
        double along = sign * dot3(u, change);
        row_q[step->coordinate] += f[1] * along;
        if (row_qq == NULL) {
            continue;
        }
        row_qq[step->coordinate * (t->n_q + 1)] += f[2] * along;
        cross3(u, axis, step->bend);
        for (int i = 0; i < 3; i++) {
            step->arm[i] = sign * f[1] * change[i];
            step->turn[i] = (step->arm[i] - f[1] * along * u[i]) / length;
            step->bend[i] *= rotation ? f[1] : 0;
        }
    }
}

/* The other terms of d2L/dq2 of one segment: pairs of its steps. */
static void segment_curvature(const path_step *steps, int32_t n, int32_t n_q, double *row_qq) {
    for (int32_t i = 0; i < n; i++) {
        for (int32_t j = i; j < n; j++) { /* on one side, i carries j */
            double entry = dot3(steps[i].turn, steps[j].arm);
            if (steps[i].side == steps[j].side) {
                entry += dot3(steps[i].bend, steps[j].arm);
            }
            row_qq[steps[i].coordinate * n_q + steps[j].coordinate] += entry;
            if (i != j) {
                row_qq[steps[j].coordinate * n_q + steps[i].coordinate] += entry;
            }
        }
    }
}

void path_lengths(const tree *t, const path_pose *pose, path_step *steps, double *length,
                  double *length_q, double *length_qq) {
    size_t n_q = (size_t)t->n_q, n_m = (size_t)t->n_muscles;
    if (length != NULL) {
        memcpy(length, t->fixed_length, sizeof *length * n_m);
    }
    if (length_q != NULL) {
        memset(length_q, 0, sizeof *length_q * n_m * n_q);
    }
    if (length_qq != NULL) {
        memset(length_qq, 0, sizeof *length_qq * n_m * n_q * n_q);
    }
    for (int32_t s = 0; s < t->n_segments; s++) {
        const tree_segment *segment = &t->segments[s];
        size_t m = (size_t)segment->muscle;
        double to[3], from[3], u[3];
        point_place(pose, &t->points[segment->to], to);
        point_place(pose, &t->points[segment->from], from);
        for (int k = 0; k < 3; k++) {
            u[k] = to[k] - from[k];
        }
        double l = sqrt(dot3(u, u));
        if (length != NULL) {
            length[m] += l;
        }
        if (length_q == NULL || l < COINCIDENT) {
            continue;
        }
        for (int k = 0; k < 3; k++) {
            u[k] /= l;
        }
        double *row_qq = length_qq == NULL ? NULL : length_qq + m * n_q * n_q;
        segment_slopes(t, pose, segment, to, from, u, l, steps, length_q + m * n_q, row_qq);
        if (row_qq != NULL) {
            segment_curvature(steps, segment->n_to + segment->n_from, t->n_q, row_qq);
        }
    }
}

/* SPDX-License-Identifier: Apache-2.0 */
/* path.c: points of links and straight muscle paths through them.
 *
 * A point p beyond joint i moves by dp/di = z_i x (p - o_i) with a pin, z_i with a slider. Turning
 * a pin i also turns the changes by all joints j outside it (and its own): d2p/didj = z_i x dp/dj;
 * a slider turns nothing. With d = to - from, u = d / |d| and d_i = dd/di: l_i = u . d_i,   l_ij =
 * (d_i . d_j - l_i l_j) / l + u . d_ij, where u . (z_i x d_j) = (u x z_i) . d_j. Joint functions
 * f(q) bring f' to each d_i and f'' to the diagonal. With 1 / l taken as 0 where the ends
 * coincide, all derivatives are 0 there. */
#include "path.h"

#include "../clones.h"
#include "vector.h"

#include <math.h>
#include <stdlib.h>
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

/* ---- bundles ---- */

static int32_t segment_link(const tree *t, const tree_segment *segment, int to) {
    return t->points[to ? segment->to : segment->from].link;
}

/* Puts the segment into a lane. */
static void bundle_add(const tree *t, const tree_segment *segment, path_bundle *bundle, int lane) {
    for (int k = 0; k < 3; k++) {
        bundle->to[k][lane] = t->points[segment->to].at[k];
        bundle->from[k][lane] = t->points[segment->from].at[k];
    }
    bundle->muscle[lane] = segment->muscle;
}

path_bundle *path_bundles(const tree *t, int32_t *n) {
    path_bundle *bundles = calloc((size_t)t->n_segments + 1, sizeof *bundles);
    *n = 0;
    for (int32_t s = 0; s < t->n_segments && bundles != NULL; s++) {
        const tree_segment *segment = &t->segments[s];
        int32_t to = segment_link(t, segment, 1), from = segment_link(t, segment, 0), i = 0;
        while (i < *n && (bundles[i].count == PATH_LANES || bundles[i].link_to != to ||
                          bundles[i].link_from != from)) {
            i++;
        }
        path_bundle *bundle = &bundles[i];
        if (i == *n) {
            *n += 1;
            bundle->segment = segment;
            bundle->link_to = to;
            bundle->link_from = from;
            for (int lane = 1; lane < PATH_LANES; lane++) {
                bundle_add(t, segment, bundle, lane);
            }
        }
        bundle_add(t, segment, bundle, bundle->count++);
    }
    return bundles;
}

/* ---- lengths ---- */

#define INLINED static inline __attribute__((always_inline))

/* (functions that took or gave vectors by value would have another calling convention with AVX) */
#define LANES_DOT3(a, b) ((a)[0] * (b)[0] + (a)[1] * (b)[1] + (a)[2] * (b)[2])

INLINED void lanes_place(const path_pose *pose, int32_t link, const path_lanes *at,
                         path_lanes *out) {
    const double *r = pose->r + 9 * (link < 0 ? 0 : link), *p = pose->p + 3 * (link < 0 ? 0 : link);
    for (int k = 0; k < 3; k++) {
        out[k] = at[k];
        if (link >= 0) {
            out[k] = p[k] + (r[3 * k] * at[0] + r[3 * k + 1] * at[1] + r[3 * k + 2] * at[2]);
        }
    }
}

/* Where each lane's muscle has its block. */
typedef struct lane_blocks {
    double *of[PATH_LANES];
} lane_blocks;

INLINED lane_blocks lanes_blocks(const path_bundle *bundle, size_t stride, double *out) {
    lane_blocks blocks;
    for (int lane = 0; lane < PATH_LANES; lane++) {
        blocks.of[lane] = out + (size_t)bundle->muscle[lane] * stride;
    }
    return blocks;
}

/* Adds the lanes to entry `at` of their muscles' blocks. */
INLINED void lanes_scatter(const path_bundle *bundle, const path_lanes *lanes,
                           const lane_blocks *blocks, int32_t at) {
    if (bundle->count == PATH_LANES) { /* unrolled */
        for (int lane = 0; lane < PATH_LANES; lane++) {
            blocks->of[lane][at] += (*lanes)[lane];
        }
        return;
    }
    for (int lane = 0; lane < bundle->count; lane++) {
        blocks->of[lane][at] += (*lanes)[lane];
    }
}

/* Steps of a bundle, and its share in dL/dq (and the f'' terms of d2L/dq2). */
INLINED void bundle_slopes(const tree *t, const path_pose *pose, const path_bundle *bundle,
                           const path_lanes *to, const path_lanes *from, const path_lanes *u,
                           const path_lanes *inverse, path_step *steps, const lane_blocks *first,
                           const lane_blocks *second_ones) {
    const tree_segment *segment = bundle->segment;
    const path_lanes none = {0};
    for (int32_t k = 0; k < segment->n_to + segment->n_from; k++) {
        path_step *step = &steps[k];
        int32_t joint = segment->joints[k];
        const double *f = pose->slopes + 4 * joint, *o = pose->p + 3 * joint;
        double axis[3];
        int rotation = joint_axis(t, pose, joint, axis);
        const path_lanes *end = k < segment->n_to ? to : from;
        double sign = k < segment->n_to ? 1 : -1;
        path_lanes change[3];
        for (int i = 0; i < 3; i++) {
            int next = (i + 1) % 3, last = (i + 2) % 3;
            change[i] =
                rotation ? axis[next] * (end[last] - o[last]) - axis[last] * (end[next] - o[next])
                         : axis[i] + none;
            step->bend[i] = (rotation ? f[1] : 0) * (u[next] * axis[last] - u[last] * axis[next]);
        }
        path_lanes along = sign * LANES_DOT3(u, change), slope = f[1] * along;
        step->side = k < segment->n_to;
        step->coordinate = t->joints[joint].coordinate;
        lanes_scatter(bundle, &slope, first, step->coordinate);
        if (second_ones == NULL) {
            continue;
        }
        path_lanes second = f[2] * along;
        if (f[2] != 0) {
            lanes_scatter(bundle, &second, second_ones, step->coordinate * (t->n_q + 1));
        }
        for (int i = 0; i < 3; i++) {
            step->arm[i] = sign * f[1] * change[i];
            step->turn[i] = (step->arm[i] - slope * u[i]) * *inverse;
        }
    }
}

/* The other terms of d2L/dq2: pairs of steps. */
INLINED void bundle_curvature(const path_bundle *bundle, const path_step *steps, int32_t n_q,
                              const lane_blocks *blocks) {
    int32_t n = bundle->segment->n_to + bundle->segment->n_from;
    for (int32_t i = 0; i < n; i++) {
        for (int32_t j = i; j < n; j++) { /* on one side, i carries j */
            int32_t row = steps[i].coordinate, column = steps[j].coordinate;
            path_lanes entry = LANES_DOT3(steps[i].turn, steps[j].arm);
            if (steps[i].side == steps[j].side) {
                entry += LANES_DOT3(steps[i].bend, steps[j].arm);
            }
            lanes_scatter(bundle, &entry, blocks, row * n_q + column);
            if (i != j) {
                lanes_scatter(bundle, &entry, blocks, column * n_q + row);
            }
        }
    }
}

CLONES static void bundle_lengths(const tree *t, const path_bundle *bundle, const path_pose *pose,
                                  path_step *steps, double *length, double *length_q,
                                  double *length_qq) {
    path_lanes to[3], from[3], u[3], l, inverse;
    lanes_place(pose, bundle->link_to, bundle->to, to);
    lanes_place(pose, bundle->link_from, bundle->from, from);
    for (int k = 0; k < 3; k++) {
        u[k] = to[k] - from[k];
    }
    l = LANES_DOT3(u, u);
    for (int lane = 0; lane < PATH_LANES; lane++) {
        l[lane] = sqrt(l[lane]);
        inverse[lane] = l[lane] < COINCIDENT ? 0 : 1 / l[lane];
    }
    if (length != NULL) {
        const lane_blocks at = lanes_blocks(bundle, 1, length);
        lanes_scatter(bundle, &l, &at, 0);
    }
    if (length_q == NULL) {
        return;
    }
    for (int k = 0; k < 3; k++) {
        u[k] *= inverse;
    }
    const size_t n_q = (size_t)t->n_q;
    const lane_blocks first = lanes_blocks(bundle, n_q, length_q);
    if (length_qq == NULL) {
        bundle_slopes(t, pose, bundle, to, from, u, &inverse, steps, &first, NULL);
        return;
    }
    const lane_blocks second = lanes_blocks(bundle, n_q * n_q, length_qq);
    bundle_slopes(t, pose, bundle, to, from, u, &inverse, steps, &first, &second);
    bundle_curvature(bundle, steps, t->n_q, &second);
}

void path_lengths(const tree *t, const path_bundle *bundles, int32_t n_bundles,
                  const path_pose *pose, path_step *steps, double *length, double *length_q,
                  double *length_qq) {
    if (length != NULL) {
        memcpy(length, t->fixed_length, sizeof *length * (size_t)t->n_muscles);
    }
    for (int32_t i = 0; i < n_bundles; i++) {
        bundle_lengths(t, &bundles[i], pose, steps, length, length_q, length_qq);
    }
}

/* SPDX-License-Identifier: Apache-2.0 */
/* strand.c: length of a path's pieces with its first and second derivatives.
 *
 * A piece is seen from the link of its obstacle (a straight one: from the link of its first point).
 * From there a way of joints leads to each end: out of the link towards ground, each joint
 * backwards, and on outwards. Joint i turns what is beyond it: with the way's steps numbered from
 * the link outwards, an end x has x_i = z_i x (x - o_i) (a pin; backwards with -z_i) or an axis (a
 * slider), and x_ij = z_i x x_j for i <= j. Functions that move a point on its body are sliders at
 * the way's end, and so are the two freedoms of a joint between strings. Those joints are where the
 * length is least, so that they fall out of the gradient and leave of the second derivatives
 *     L_qq - L_qy L_yy^-1 L_yq. */
#include "numbers.h"
#include "route.h"
#include "vector.h"

#include <math.h>
#include <string.h>

static int32_t common_ancestor(const tree *t, int32_t a, int32_t b) {
    while (a != b) { /* parents have smaller numbers */
        if (a > b) {
            a = t->joints[a].parent;
        } else {
            b = t->joints[b].parent;
        }
    }
    return a;
}

static void joint_step(const tree *t, const path_route *route, const path_pose *pose, int32_t joint,
                       double sign, const double *at, strand_step *step) {
    const double *r = pose->r + 9 * joint, *o = pose->p + 3 * joint, *f = pose->slopes + 4 * joint;
    int pin = t->joints[joint].kind == MHE_MOTION_ROTATION;
    double axis[3], change[3];
    for (int i = 0; i < 3; i++) {
        axis[i] = sign * r[3 * i + (pin ? 2 : 0)];
        change[i] = axis[i];
    }
    if (pin) {
        double arm[3] = {at[0] - o[0], at[1] - o[1], at[2] - o[2]};
        cross3(axis, arm, change);
    }
    for (int i = 0; i < 3; i++) {
        step->change[i] = f[1] * change[i];
        step->curve[i] = f[2] * change[i];
        step->turn[i] = pin ? f[1] * axis[i] : 0;
    }
    step->local = route->local[t->joints[joint].coordinate];
}

/* Steps of the way from link `from` to a point at `at` of link `to`; returns their number. */
static int32_t way_steps(const tree *t, const path_route *route, const path_pose *pose,
                         int32_t from, int32_t to, const double *at, strand_step *steps) {
    int32_t meet = common_ancestor(t, from, to), n = 0, outer = 0;
    for (int32_t i = from; i != meet; i = t->joints[i].parent) {
        joint_step(t, route, pose, i, -1, at, &steps[n++]);
    }
    for (int32_t i = to; i != meet; i = t->joints[i].parent) {
        outer++;
    }
    n += outer;
    for (int32_t i = to, k = n; i != meet; i = t->joints[i].parent) {
        joint_step(t, route, pose, i, 1, at, &steps[--k]);
    }
    return n;
}

static void slide(const double *axis, double slope, double curve, int32_t local,
                  strand_step *step) {
    for (int i = 0; i < 3; i++) {
        step->change[i] = slope * axis[i];
        step->curve[i] = curve * axis[i];
        step->turn[i] = 0;
    }
    step->local = local;
}

/* Functions that move point k on its body. */
static int32_t moving_steps(const path_route *route, const path_pose *pose, const route_work *work,
                            int32_t k, strand_step *steps) {
    const route_point *point = &route->points[k];
    int32_t n = 0, link = point->place->link;
    if (point->source->kind != MHE_POINT_MOVING) {
        return 0;
    }
    for (int i = 0; i < 3; i++) {
        if (point->local[i] < 0) {
            continue;
        }
        const double *f = work->slopes + 12 * k + 4 * i, *r = point->place->r;
        double axis[3] = {r[i], r[3 + i], r[6 + i]};
        if (link >= 0) {
            rotate3(pose->r + 9 * link, axis, axis);
        }
        slide(axis, f[1], f[2], point->local[i], &steps[n++]);
    }
    return n;
}

static int32_t end_link(const path_route *route, const route_work *work, const course_piece *piece,
                        int e) {
    return piece->joint[e] >= 0 ? work->joints[piece->joint[e]].link
                                : route->points[piece->point[e]].place->link;
}

static int32_t end_steps(const tree *t, const path_route *route, const path_pose *pose,
                         const route_work *work, const course_piece *piece, int e, int32_t from,
                         const double *at, strand_step *steps) {
    int32_t n = way_steps(t, route, pose, from, end_link(route, work, piece, e), at, steps);
    int32_t joint = piece->joint[e];
    if (joint < 0) {
        return n + moving_steps(route, pose, work, piece->point[e], steps + n);
    }
    for (int32_t k = 0; k < 2; k++) {
        slide(work->joints[joint].across[k], 1, 0, route->n_own + 2 * joint + k, &steps[n++]);
    }
    return n;
}

/* Adds one end's share: g is dL/dx, h is d2L/dx2 of the end x. */
static void end_add(const strand_step *steps, int32_t n, const double *g, const double *h,
                    int32_t stride, double *gradient, double *hessian) {
    for (int32_t k = 0; k < n; k++) {
        gradient[steps[k].local] += dot3(g, steps[k].change);
    }
    if (hessian == NULL) {
        return;
    }
    for (int32_t j = 0; j < n; j++) {
        double row[3], bent[3];
        int32_t cj = steps[j].local;
        rotate3(h, steps[j].change, row);
        cross3(g, steps[j].turn, bent); /* g . (turn x c) = (g x turn) . c */
        add3(row, 1, bent);
        hessian[cj * stride + cj] += dot3(g, steps[j].curve) + dot3(row, steps[j].change);
        for (int32_t k = j + 1; k < n; k++) {
            int32_t ck = steps[k].local;
            double entry = dot3(row, steps[k].change);
            hessian[cj * stride + ck] += entry;
            hessian[ck * stride + cj] += entry;
        }
    }
}

static void cross_add(strand_step *const steps[2], const int32_t *n, const double *ps,
                      int32_t stride, double *hessian) {
    for (int32_t k = 0; k < n[1]; k++) {
        double column[3];
        int32_t ck = steps[1][k].local;
        rotate3(ps, steps[1][k].change, column);
        for (int32_t j = 0; j < n[0]; j++) {
            int32_t cj = steps[0][j].local;
            double entry = dot3(steps[0][j].change, column);
            hessian[cj * stride + ck] += entry;
            hessian[ck * stride + cj] += entry;
        }
    }
}

static double piece_add(const tree *t, const path_route *route, const path_pose *pose,
                        route_work *work, const course_piece *piece, int32_t stride,
                        double *gradient, double *hessian) {
    const double *ends[2];
    piece_ends(work, piece, ends);
    int wraps = piece->wrap >= 0 && work->state[piece->wrap] > 0;
    int32_t from = wraps ? route->wraps[piece->wrap].link : end_link(route, work, piece, 0);
    int32_t n[2];
    double g[6], pp[9], ps[9], ss[9];
    if (gradient == NULL) {
        return piece_length(route, work, piece, ends, NULL, NULL, NULL, NULL);
    }
    double length = piece_length(route, work, piece, ends, g, pp, ps, ss);
    for (int e = 0; e < 2; e++) {
        n[e] = end_steps(t, route, pose, work, piece, e, from, ends[e], work->steps[e]);
    }
    if (n[0] + n[1] == 0) {
        return length;
    }
    end_add(work->steps[0], n[0], g, pp, stride, gradient, hessian);
    end_add(work->steps[1], n[1], g + 3, ss, stride, gradient, hessian);
    if (hessian != NULL) {
        cross_add(work->steps, n, ps, stride, hessian);
    }
    return length;
}

/* Takes the last rows and columns out of the n x n second derivatives: those are at their least. */
static void eliminate(double *hessian, int32_t n, int32_t n_kept) {
    for (int32_t y = n - 1; y >= n_kept; y--) {
        double pivot = hessian[y * n + y];
        if (!(pivot > 0)) {
            continue;
        }
        for (int32_t i = 0; i < y; i++) {
            double factor = hessian[i * n + y] / pivot;
            for (int32_t j = 0; j < y; j++) {
                hessian[i * n + j] -= factor * hessian[y * n + j];
            }
        }
    }
}

double strand_length(const tree *t, const path_route *route, const path_pose *pose,
                     route_work *work, int32_t *stride, double *gradient, double *hessian) {
    int32_t n = route->n_own + 2 * work->n_joints;
    double length = 0;
    *stride = n;
    if (gradient != NULL) {
        memset(gradient, 0, sizeof *gradient * (size_t)n);
    }
    if (hessian != NULL) {
        memset(hessian, 0, sizeof *hessian * (size_t)(n * n));
    }
    for (int32_t i = 0; i < work->n_pieces; i++) {
        length += piece_add(t, route, pose, work, &work->pieces[i], n, gradient, hessian);
    }
    if (hessian != NULL && work->n_joints > 0) {
        eliminate(hessian, n, route->n_own);
    }
    return length;
}

double strand_outside(const tree *t, const path_route *route, const path_pose *pose,
                      route_work *work, int32_t w, int32_t point, double *gradient,
                      double *hessian) {
    const double *at = work->places + 3 * point;
    double g[3], h[9], off = string_off_derivatives(route, w, work, at, g, h);
    int32_t n_own = route->n_own, n;
    if (gradient == NULL) {
        return off;
    }
    memset(gradient, 0, sizeof *gradient * (size_t)n_own);
    if (hessian != NULL) {
        memset(hessian, 0, sizeof *hessian * (size_t)(n_own * n_own));
    }
    n = way_steps(t, route, pose, route->wraps[w].link, route->points[point].place->link, at,
                  work->steps[0]);
    n += moving_steps(route, pose, work, point, work->steps[0] + n);
    end_add(work->steps[0], n, g, h, n_own, gradient, hessian);
    return off;
}

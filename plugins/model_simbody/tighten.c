/* SPDX-License-Identifier: Apache-2.0 */
/* tighten.c: strings in a row. The point where the path passes between two of them is moved across
 * the path until both pull along one line: Newton's method, with the second derivatives of wrap.h.
 */
#include "route.h"
#include "vector.h"

#include <math.h>
#include <string.h>

#define MAX_NEWTON 40
#define MAX_HALVINGS 12
#define MAX_CLEAR 20
#define MAX_AGAIN 3
#define OFF_CENTRE 0.2
#define FINE 1e-6    /* m: steps that lengths cannot judge */
#define TIGHT 1e-8   /* m: last step of Newton's method */
#define LONGEST 0.02 /* m: longest step */

/* In the middle between b and a, across the way from one to the other; `t`: its direction where
 * they are all but the same. */
static void joint_put(course_joint *joint, const double *b, const double *a, const double *t) {
    double u[3], least[3] = {0, 0, 0}, norm = 0;
    for (int i = 0; i < 3; i++) {
        joint->at[i] = 0.5 * (b[i] + a[i]);
        u[i] = a[i] - b[i];
    }
    norm = sqrt(dot3(u, u));
    for (int i = 0; i < 3; i++) {
        u[i] = norm > 1e-9 ? u[i] / norm : t[i];
    }
    int k = fabs(u[0]) <= fabs(u[1]) ? (fabs(u[0]) <= fabs(u[2]) ? 0 : 2)
                                     : (fabs(u[1]) <= fabs(u[2]) ? 1 : 2);
    least[k] = 1;
    cross3(u, least, joint->across[0]);
    norm = sqrt(dot3(joint->across[0], joint->across[0]));
    for (int i = 0; i < 3; i++) {
        joint->across[0][i] /= norm;
    }
    cross3(u, joint->across[0], joint->across[1]);
}

void joint_begin(const route_work *work, int32_t stop, course_joint *joint) {
    const course_stop *a = &work->stops[stop], *b = &work->stops[stop + 1];
    joint_put(joint, a->at, b->at, work->strings[a->wrap].t[1]);
    joint->link = a->link;
}

static double quadratic(const double *m, const double *a, const double *b) {
    double mb[3];
    rotate3(m, b, mb);
    return dot3(a, mb);
}

/* Adds a string's share to Newton's equations [2 n x (2 n + 1)]; joints -1: an end that stays. */
static void newton_add(const path_route *route, const route_work *work, int32_t stride,
                       const course_piece *piece, const double *const ends[2], double *equations) {
    double g[6], second[3][9];
    const int32_t *joints = piece->joint;
    (void)piece_length(route, work, piece, ends, g, second[0], second[1], second[2]);
    for (int e = 0; e < 2; e++) {
        if (joints[e] < 0) {
            continue;
        }
        const course_joint *own = &work->joints[joints[e]];
        for (int i = 0; i < 2; i++) {
            double *row = equations + (2 * joints[e] + i) * stride;
            row[stride - 1] -= dot3(own->across[i], g + 3 * e);
            for (int j = 0; j < 2; j++) {
                row[2 * joints[e] + j] +=
                    quadratic(second[e ? 2 : 0], own->across[i], own->across[j]);
                if (joints[1 - e] >= 0) {
                    const double *other = work->joints[joints[1 - e]].across[j];
                    row[2 * joints[1 - e] + j] += e ? quadratic(second[1], other, own->across[i])
                                                    : quadratic(second[1], own->across[i], other);
                }
            }
        }
    }
}

/* Solves the n equations, each row with its right-hand side; 0: done. */
static int newton_solve(double *m, int32_t n) {
    int32_t stride = n + 1;
    for (int32_t i = 0; i < n; i++) {
        if (!(m[i * stride + i] > 0)) {
            return -1;
        }
        for (int32_t k = i + 1; k < n; k++) {
            double factor = m[k * stride + i] / m[i * stride + i];
            for (int32_t j = i; j <= n; j++) {
                m[k * stride + j] -= factor * m[i * stride + j];
            }
        }
    }
    for (int32_t i = n - 1; i >= 0; i--) {
        for (int32_t k = i + 1; k < n; k++) {
            m[i * stride + n] -= m[i * stride + k] * m[k * stride + n];
        }
        m[i * stride + n] /= m[i * stride + i];
    }
    return 0;
}

/* Solves the strings between the joints; their length together. INFINITY: one has none, *lost. */
static double joints_length(const path_route *route, route_work *work, int32_t *lost) {
    double length = 0;
    for (int32_t i = 0; i < work->n_pieces; i++) {
        const course_piece *piece = &work->pieces[i];
        const double *ends[2];
        int32_t w = piece->wrap;
        if (piece->joint[0] < 0 && piece->joint[1] < 0) {
            continue;
        }
        piece_ends(work, piece, ends);
        wrap_string last = work->strings[w];
        last.keeps = 1;
        work->state[w] = string_between(route, w, ends[0], ends[1],
                                        work->state[w] > 0 ? &last : NULL, work, &work->strings[w]);
        if (work->state[w] < 0) {
            *lost = w;
            return INFINITY;
        }
        length += piece_length(route, work, piece, ends, NULL, NULL, NULL, NULL);
    }
    return length;
}

/* Newton's step in the last column; `shift` is added to the second derivatives. 0: there is one. */
static int joints_step(const path_route *route, route_work *work, double shift) {
    int32_t n = 2 * work->n_joints, stride = n + 1;
    memset(work->newton, 0, sizeof *work->newton * (size_t)(n * stride));
    for (int32_t i = 0; i < work->n_pieces; i++) {
        const course_piece *piece = &work->pieces[i];
        if (piece->joint[0] >= 0 || piece->joint[1] >= 0) {
            const double *ends[2];
            piece_ends(work, piece, ends);
            newton_add(route, work, stride, piece, ends, work->newton);
        }
    }
    for (int32_t j = 0; j < n; j++) {
        work->newton[j * stride + j] += shift;
    }
    return newton_solve(work->newton, n);
}

static void joints_move(route_work *work, double share) {
    int32_t n = 2 * work->n_joints;
    for (int32_t j = 0; j < n; j++) {
        course_joint *joint = &work->joints[j / 2];
        add3(joint->at, share * work->newton[j * (n + 1) + n], joint->across[j % 2]);
    }
}

/* The joint behind piece i, if it is inside one of its obstacles, is put beside it. */
static void joint_clear(const path_route *route, route_work *work, int32_t i) {
    const course_piece *before = &work->pieces[i], *after = before + 1;
    double *at = work->joints[before->joint[1]].at;
    for (int k = 0; k < MAX_CLEAR; k++) {
        int moved = string_clears(route, before->wrap, work, at);
        moved |= string_clears(route, after->wrap, work, at);
        if (!moved) {
            break;
        }
    }
}

static void joints_clear(const path_route *route, route_work *work) {
    for (int32_t i = 0; i + 1 < work->n_pieces; i++) {
        if (work->pieces[i].joint[1] >= 0) {
            joint_clear(route, work, i);
        }
    }
}

/* Joints that are near the end of the straight way between their strings, beyond which they could
 * not follow, are put into its middle. Returns the length then. */
static double joints_centre(const path_route *route, route_work *work, double length,
                            int32_t *again, int32_t *lost) {
    for (int32_t i = 0; i + 1 < work->n_pieces; i++) {
        int32_t j = work->pieces[i].joint[1], u = work->pieces[i].wrap;
        int32_t w = work->pieces[i + 1].wrap;
        if (j < 0 || j != work->pieces[i + 1].joint[0] || work->state[u] <= 0 ||
            work->state[w] <= 0) {
            continue;
        }
        const wrap_string *before = &work->strings[u], *after = &work->strings[w];
        double way[2] = {before->straight[1], after->straight[0]};
        if (fmin(way[0], way[1]) > OFF_CENTRE * (way[0] + way[1])) {
            continue;
        }
        course_joint last = work->joints[j];
        joint_put(&work->joints[j], before->b, after->a, before->t[1]);
        double now = joints_length(route, work, lost);
        if (now > length * (1 + 1e-12) && *again > 0) {
            joint_clear(route, work, i);
            now = joints_length(route, work, lost);
            *again -= 1;
            length = isfinite(now) ? now : length;
        }
        if (now <= length * (1 + 1e-12)) {
            length = now;
        } else {
            work->joints[j] = last;
            length = joints_length(route, work, lost);
        }
    }
    return length;
}

/* The row as it is, into place k. */
static void row_keep(const path_route *route, route_work *work, int32_t k) {
    size_t n = (size_t)route->n_wraps, at = (size_t)k * n;
    memcpy(work->row_joints + at, work->joints, sizeof *work->joints * n);
    memcpy(work->row_strings + at, work->strings, sizeof *work->strings * n);
    memcpy(work->row_states + at, work->state, sizeof *work->state * n);
}

static void row_restore(const path_route *route, route_work *work, int32_t k) {
    size_t n = (size_t)route->n_wraps, at = (size_t)k * n;
    memcpy(work->joints, work->row_joints + at, sizeof *work->joints * n);
    memcpy(work->strings, work->row_strings + at, sizeof *work->strings * n);
    memcpy(work->state, work->row_states + at, sizeof *work->state * n);
}

#define TIGHTENED 1
#define STUCK 0
#define LOST (-1) /* a string: *lost */

/* Newton's method, from where the joints are. */
static int row_pull(const path_route *route, route_work *work, int32_t again, int32_t *lost) {
    static const double shifts[] = {0, 30, 300, 3e3, 3e4}; /* 1/m */
    int32_t n = 2 * work->n_joints;
    double length = joints_length(route, work, lost), step = INFINITY;
    for (int32_t k = 0; k < MAX_NEWTON && isfinite(length) && step >= TIGHT; k++) {
        length = joints_centre(route, work, length, &again, lost);
        size_t s = 0;
        while (s < sizeof shifts / sizeof shifts[0] && joints_step(route, work, shifts[s]) != 0) {
            s++;
        }
        double now = INFINITY;
        step = 0;
        for (int32_t j = 0; j < n; j++) {
            step = fmax(step, fabs(work->newton[j * (n + 1) + n]));
        }
        if (isnan(step)) {
            return STUCK;
        }
        double share = step > LONGEST ? LONGEST / step : 1;
        double least = length * (1 + (step < FINE ? 1e-12 : 0)); /* rounding of lengths */
        joints_move(work, share);
        for (int half = 0; half < MAX_HALVINGS; half++) {
            now = joints_length(route, work, lost);
            if (now <= least) {
                break;
            }
            joints_move(work, -0.5 * share);
            share *= 0.5;
        }
        if (!(now <= least)) { /* no way down: at the end of the digits, or in a cleft */
            joints_move(work, -share);
            (void)joints_length(route, work, lost);
            return step < FINE ? TIGHTENED : STUCK;
        }
        length = now;
    }
    return !isfinite(length) ? LOST : step < FINE ? TIGHTENED : STUCK;
}

int32_t joints_tighten(const path_route *route, route_work *work) {
    int32_t lost = -1, none = -1;
    joints_clear(route, work);
    row_keep(route, work, 0);
    int done = row_pull(route, work, 0, &lost);
    if (done != STUCK) {
        return done == LOST ? lost : -1;
    }
    /* a joint may have gone past the place where the path comes onto an obstacle, which it does not
     * see from there: once more, with joints put back between their obstacles */
    row_keep(route, work, 1);
    row_restore(route, work, 0);
    if (row_pull(route, work, MAX_AGAIN, &none) != TIGHTENED) {
        row_restore(route, work, 1);
    }
    return -1;
}

/* SPDX-License-Identifier: Apache-2.0 */
/* tighten.c: strings in a row. The point where the path passes between two of them is moved across
 * the path until both pull along one line: Newton's method, with the second derivatives of wrap.h.
 */
#include "route.h"
#include "vector.h"

#include <math.h>
#include <string.h>

#define MAX_NEWTON 20
#define TIGHT 1e-13  /* m: last step of Newton's method */
#define LONGEST 0.02 /* m: longest step */

void joint_begin(const route_work *work, int32_t stop, course_joint *joint) {
    const course_stop *a = &work->stops[stop], *b = &work->stops[stop + 1];
    double u[3], least[3] = {0, 0, 0}, norm = 0;
    for (int i = 0; i < 3; i++) {
        joint->at[i] = 0.5 * (a->at[i] + b->at[i]);
        u[i] = b->at[i] - a->at[i];
    }
    norm = sqrt(dot3(u, u));
    for (int i = 0; i < 3; i++) { /* (nearly no distance: along the string) */
        u[i] = norm > 1e-9 ? u[i] / norm : work->strings[a->wrap].t[1][i];
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

void joints_tighten(const path_route *route, route_work *work) {
    int32_t n = 2 * work->n_joints, stride = n + 1;
    for (int32_t k = 0; k <= MAX_NEWTON; k++) {
        memset(work->newton, 0, sizeof *work->newton * (size_t)(n * stride));
        for (int32_t i = 0; i < work->n_pieces; i++) {
            const course_piece *piece = &work->pieces[i];
            if (piece->joint[0] < 0 && piece->joint[1] < 0) {
                continue;
            }
            const double *ends[2];
            int32_t w = piece->wrap;
            piece_ends(work, piece, ends);
            wrap_string last = work->strings[w];
            work->state[w] =
                string_between(route, w, ends[0], ends[1], work->state[w] > 0 ? &last : NULL, work,
                               &work->strings[w]);
            newton_add(route, work, stride, piece, ends, work->newton);
        }
        double step = 0;
        if (k == MAX_NEWTON || newton_solve(work->newton, n) != 0) {
            return;
        }
        for (int32_t j = 0; j < n; j++) {
            step = fmax(step, fabs(work->newton[j * stride + n]));
        }
        if (step < TIGHT) {
            return;
        }
        double share = step > LONGEST ? LONGEST / step : 1;
        for (int32_t j = 0; j < n; j++) {
            course_joint *joint = &work->joints[j / 2];
            add3(joint->at, share * work->newton[j * stride + n], joint->across[j % 2]);
        }
    }
}

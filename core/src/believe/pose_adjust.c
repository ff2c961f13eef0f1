/* SPDX-License-Identifier: Apache-2.0 */
/* pose_adjust.c: postures of all frames and one transform of their markers, as one least-squares
 * problem. By turns (postures, then the transform) it would take hundreds of rounds where joints
 * can do what a turn does; together it takes ten. A frame's posture meets the others in the
 * transform alone, so that it is eliminated first. */
#include "base/cholesky.h"
#include "believe/pose_private.h"

#include <math.h>
#include <string.h>

#define WIDTH (MHI_POSE_FREEDOMS + 1) /* the freedoms' columns and the gradient */
#define EASIEST 1e-9                  /* damping, of the diagonal */
#define HARDEST 1e4
#define ALWAYS 1e-3 /* of the largest diagonal entry, beside it */
#define NEARER 1e-6 /* m: less is not worth a step */
#define SMALLER 0.1 /* a step scales by this at most */

/* What a step of the transform is made of: turn about `centre`, shift, factor. */
typedef struct freedoms {
    int32_t names, n;
    double centre[3];
} freedoms;

static freedoms freedoms_of(const mhi_pose_search *s, int32_t names, const mhi_pose *pose) {
    freedoms out = {.names = names};
    int32_t seen = 0;
    out.n = (names & MHI_POSE_TURN ? 3 : 0) + (names & MHI_POSE_SHIFT ? 3 : 0) +
            (names & MHI_POSE_SCALE ? 1 : 0);
    memcpy(out.centre, pose->shift, sizeof out.centre);
    if (!(names & MHI_POSE_SHIFT)) {
        return out; /* the recording's origin stays where it is */
    }
    double sum[3] = {0};
    for (int32_t f = 0; f < s->n_frames; f += s->every) {
        for (int32_t i = 0; i < s->n_k; i++) {
            const double *raw = s->raw + 3 * ((ptrdiff_t)f * s->n_k + i);
            double at[3];
            mhi_pose_place(pose, raw, at);
            for (int32_t k = 0; k < 3 && !isnan(raw[0]); k++) {
                sum[k] += at[k];
                seen += k == 0;
            }
        }
    }
    for (int32_t k = 0; k < 3; k++) {
        out.centre[k] = sum[k] / seen;
    }
    return out;
}

/* By what a step of each freedom moves a point away from its marker on the model: the columns of
 * -dy, [3][n]. */
static void columns_of(const freedoms *to, const double at[3], double out[3][MHI_POSE_FREEDOMS]) {
    double arm[3];
    int32_t n = 0;
    for (int32_t k = 0; k < 3; k++) {
        arm[k] = at[k] - to->centre[k];
    }
    if (to->names & MHI_POSE_TURN) { /* axis e_n: -(e_n x arm) */
        for (int32_t a = 0; a < 3; a++, n++) {
            out[a][n] = 0;
            out[(a + 1) % 3][n] = arm[(a + 2) % 3];
            out[(a + 2) % 3][n] = -arm[(a + 1) % 3];
        }
    }
    if (to->names & MHI_POSE_SHIFT) {
        for (int32_t a = 0; a < 3; a++, n++) {
            out[0][n] = out[1][n] = out[2][n] = 0;
            out[a][n] = -1;
        }
    }
    for (int32_t k = 0; k < 3 && to->names & MHI_POSE_SCALE; k++) {
        out[k][n] = -arm[k];
    }
}

/* The transform after a step of the freedoms. */
static mhi_pose moved(const mhi_pose *pose, const freedoms *to, const double *step) {
    mhi_pose out = *pose;
    double turn[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, shift[3] = {0}, factor = 1;
    if (to->names & MHI_POSE_TURN) { /* Rodrigues */
        const double angle = sqrt(step[0] * step[0] + step[1] * step[1] + step[2] * step[2]);
        const double c = cos(angle), s = angle > 0 ? sin(angle) / angle : 1;
        const double v = angle > 0 ? (1 - c) / (angle * angle) : 0.5;
        const double cross[9] = {0, -step[2], step[1], step[2], 0, -step[0], -step[1], step[0], 0};
        for (int32_t i = 0; i < 9; i++) {
            turn[i] = (i % 4 == 0 ? c : 0) + s * cross[i] + v * step[i / 3] * step[i % 3];
        }
        step += 3;
    }
    if (to->names & MHI_POSE_SHIFT) {
        memcpy(shift, step, sizeof shift);
        step += 3;
    }
    if (to->names & MHI_POSE_SCALE) {
        factor = fmax(1 + step[0], SMALLER);
    }
    out.scale *= factor;
    for (int32_t i = 0; i < 3; i++) {
        out.shift[i] = to->centre[i] + shift[i];
        for (int32_t k = 0; k < 3; k++) {
            out.shift[i] += factor * turn[3 * i + k] * (pose->shift[k] - to->centre[k]);
            out.turn[3 * i + k] = 0;
            for (int32_t m = 0; m < 3; m++) {
                out.turn[3 * i + k] += turn[3 * i + m] * pose->turn[3 * m + k];
            }
        }
    }
    return out;
}

/* RMS distance of the postures' markers, which it leaves in s->model. */
static double distance(mhi_pose_search *s, const double *q, const mhi_pose *pose) {
    double squares = 0;
    int32_t seen = 0;
    for (int32_t f = 0; f < s->n_frames; f += s->every) {
        double *model = s->model + (ptrdiff_t)f * 3 * s->n_k;
        if (mhi_system_markers(s->context, q + (ptrdiff_t)f * s->n_q, model, NULL, NULL) !=
            MHE_OK) {
            return NAN;
        }
        for (int32_t i = 0; i < s->n_k; i++) {
            const double *raw = s->raw + 3 * ((ptrdiff_t)f * s->n_k + i);
            double at[3];
            mhi_pose_place(pose, raw, at);
            for (int32_t k = 0; k < 3 && !isnan(raw[0]); k++) {
                squares += (model[3 * i + k] - at[k]) * (model[3 * i + k] - at[k]);
                seen += k == 0;
            }
        }
    }
    return sqrt(squares / seen);
}

/* Adds what the derivatives j [n_q], p [n] of a residual r say. */
static void add_row(mhi_pose_search *s, double *normal, double whole[WIDTH][WIDTH], int32_t n,
                    const double *j, const double *p, double r) {
    for (int32_t a = 0; a < s->n_q; a++) {
        if (j[a] == 0) {
            continue;
        }
        for (int32_t b = 0; b <= a; b++) {
            normal[a * s->n_q + b] += j[a] * j[b];
        }
        for (int32_t b = 0; b < n; b++) {
            s->coupling[a * WIDTH + b] += j[a] * p[b];
        }
        s->coupling[a * WIDTH + n] += j[a] * r;
    }
    for (int32_t a = 0; a < n; a++) {
        for (int32_t b = 0; b <= a; b++) {
            whole[a][b] += p[a] * p[b];
        }
        whole[n][a] += p[a] * r;
    }
}

/* A coordinate that an end of its range holds is no unknown in this step. */
static void hold_at_ends(mhi_pose_search *s, const double *q, double *normal, int32_t n) {
    for (int32_t a = 0; a < s->n_q; a++) {
        const mhe_coordinate *c = &s->description->coordinates[a];
        const double gradient = s->coupling[a * WIDTH + n];
        if ((q[a] > c->lower || gradient <= 0) && (q[a] < c->upper || gradient >= 0)) {
            continue;
        }
        for (int32_t b = 0; b < s->n_q; b++) {
            normal[a > b ? a * s->n_q + b : b * s->n_q + a] = 0;
        }
        memset(s->coupling + (ptrdiff_t)a * WIDTH, 0, sizeof(double) * WIDTH);
        normal[a * s->n_q + a] = 1;
    }
}

static void damp(double *a, int32_t n, int32_t stride, double damping) {
    double largest = 1e-12;
    for (int32_t i = 0; i < n; i++) {
        largest = fmax(largest, a[i * stride + i]);
    }
    for (int32_t i = 0; i < n; i++) {
        a[i * stride + i] += damping * (a[i * stride + i] + ALWAYS * largest) + 1e-12 * largest;
    }
}

/* Eliminates the posture of frame f: its part of `whole` is taken off, s->solved keeps what its
 * step will be. 0: not possible. */
static int32_t eliminate(mhi_pose_search *s, int32_t f, const mhi_pose *pose, const freedoms *to,
                         double damping, double whole[WIDTH][WIDTH]) {
    const ptrdiff_t n_q = s->n_q, n_k = s->n_k;
    double *normal = s->factor + f * n_q * n_q, *solved = s->solved + f * n_q * WIDTH;
    const double *q = s->q + f * n_q;
    if (mhi_system_markers(s->context, q, s->model + f * 3 * n_k, s->marker_q, NULL) != MHE_OK) {
        return 0;
    }
    memset(normal, 0, sizeof(double) * (size_t)(n_q * n_q));
    memset(s->coupling, 0, sizeof(double) * (size_t)(n_q * WIDTH));
    for (int32_t i = 0; i < n_k; i++) {
        double at[3], p[3][MHI_POSE_FREEDOMS];
        mhi_pose_place(pose, s->raw + 3 * (f * n_k + i), at);
        columns_of(to, at, p);
        for (int32_t k = 0; k < 3 && !isnan(at[0]); k++) {
            add_row(s, normal, whole, to->n, s->marker_q + (3 * i + k) * n_q, p[k],
                    s->model[3 * (f * n_k + i) + k] - at[k]);
        }
    }
    hold_at_ends(s, q, normal, to->n);
    damp(normal, s->n_q, s->n_q, damping);
    memcpy(solved, s->coupling, sizeof(double) * (size_t)(n_q * WIDTH));
    if (mhi_cholesky_factor(normal, s->n_q) != 0) {
        return 0;
    }
    mhi_cholesky_solve(normal, s->n_q, solved, WIDTH);
    for (int32_t a = 0; a <= to->n; a++) {
        for (int32_t b = 0; b <= a && b < to->n; b++) {
            for (int32_t i = 0; i < n_q; i++) {
                whole[a][b] -= s->coupling[i * WIDTH + a] * solved[i * WIDTH + b];
            }
        }
    }
    return 1;
}

/* The step from s->q and *pose to s->trial and *next. 0: there is none. */
static int32_t propose(mhi_pose_search *s, const freedoms *to, double damping, const mhi_pose *pose,
                       mhi_pose *next) {
    double whole[WIDTH][WIDTH] = {{0}}, step[MHI_POSE_FREEDOMS];
    const int32_t n = to->n;
    for (int32_t f = 0; f < s->n_frames; f += s->every) {
        if (!eliminate(s, f, pose, to, damping, whole)) {
            return 0;
        }
    }
    double packed[MHI_POSE_FREEDOMS * MHI_POSE_FREEDOMS];
    for (int32_t a = 0; a < n; a++) {
        step[a] = -whole[n][a];
        memcpy(packed + a * n, whole[a], sizeof(double) * (size_t)n);
    }
    damp(packed, n, n, damping);
    if (mhi_cholesky_factor(packed, n) != 0) {
        return 0;
    }
    mhi_cholesky_solve(packed, n, step, 1);
    for (int32_t f = 0; f < s->n_frames; f += s->every) {
        for (int32_t i = 0; i < s->n_q; i++) {
            const mhe_coordinate *c = &s->description->coordinates[i];
            const ptrdiff_t at = (ptrdiff_t)f * s->n_q + i;
            const double *solved = s->solved + at * WIDTH;
            double q = s->q[at] - solved[n];
            for (int32_t a = 0; a < n; a++) {
                q -= solved[a] * step[a];
            }
            s->trial[at] = fmin(fmax(q, c->lower), c->upper);
        }
    }
    *next = moved(pose, to, step);
    return 1;
}

double mhi_pose_adjust(mhi_pose_search *s, int32_t freedom, int32_t rounds, mhi_pose *pose) {
    mhi_pose_superpose(s, freedom, pose);
    double now = distance(s, s->q, pose), damping = 1e-3;
    for (int32_t i = 0; i < rounds && !isnan(now) && !mhi_pose_spent(s); i++) {
        const freedoms to = freedoms_of(s, freedom, pose);
        mhi_pose next;
        const double there =
            propose(s, &to, damping, pose, &next) ? distance(s, s->trial, &next) : NAN;
        if (there < now) {
            const double gain = now - there;
            memcpy(s->q, s->trial, sizeof(double) * (size_t)(s->n_frames * s->n_q));
            *pose = next;
            now = there;
            damping = fmax(damping / 5, EASIEST);
            if (gain < NEARER) {
                break;
            }
        } else if (damping > HARDEST) {
            break;
        } else {
            damping *= 8;
        }
    }
    return distance(s, s->q, pose);
}

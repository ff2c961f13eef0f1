/* SPDX-License-Identifier: Apache-2.0 */
/* pose.c: inverse kinematics in a dozen frames, and the best common transform for given postures:
 * turn, shift and scale are those of Kabsch (Acta Cryst. A 34, 1978,
 * doi:10.1107/S0567739478001680) and Umeyama (IEEE PAMI 13, 1991, doi:10.1109/34.88573). */
#include "base/pi.h"
#include "believe/pose_private.h"

#include <math.h>
#include <string.h>

#define FRAMES 12
#define FEW 3        /* for a first look */
#define ENOUGH 2     /* markers of a frame */
#define FOUND 1e-5   /* rad or m: a posture that moves less is found ... */
#define ROUGHLY 1e-3 /* ... in a first look */
#define TRIES 12     /* postures a search begins from ... */
#define FEW_TRIES 3  /* ... in a first look */

static int32_t count_seen(const double *row, int32_t n_k) {
    int32_t n = 0;
    for (int32_t i = 0; i < n_k; i++) {
        n += !isnan(row[3 * i]);
    }
    return n;
}

/* Frames spread over the recording, each the next one that shows enough. */
static void choose_frames(mhi_pose_search *s, const mhi_recording *r) {
    const int32_t enough = s->n_k < ENOUGH ? s->n_k : ENOUGH;
    int32_t last = -1;
    for (int32_t f = 0; f < FRAMES; f++) {
        int32_t k = (int32_t)((2 * f + 1) * (int64_t)r->n_frames / (2 * FRAMES));
        const int32_t end = (int32_t)((2 * f + 3) * (int64_t)r->n_frames / (2 * FRAMES));
        k = k <= last ? last + 1 : k;
        while (k < end && k < r->n_frames &&
               count_seen(r->markers + 3 * (ptrdiff_t)k * s->n_k, s->n_k) < enough) {
            k++;
        }
        if (k < end && k < r->n_frames) {
            memcpy(s->raw + 3 * (ptrdiff_t)s->n_frames * s->n_k,
                   r->markers + 3 * (ptrdiff_t)k * s->n_k, sizeof(double) * 3 * (size_t)s->n_k);
            s->n_frames++;
            last = k;
        }
    }
}

mhe_status mhi_pose_open(const mhi_system *system, const mhi_recording *r, mhi_pose_search **out,
                         mhe_error *err) {
    const mhe_description *d = mhi_system_description(system);
    mhi_arena arena = {0};
    *out = NULL;
    if (r->markers == NULL || d->n_markers == 0 || d->n_coordinates == 0) {
        return MHE_OK;
    }
    mhi_pose_search *s = MHI_TAKE(&arena, mhi_pose_search, 1);
    if (s == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    s->description = d;
    s->n_q = d->n_coordinates;
    s->n_k = d->n_markers;
    s->every = 1;
    s->raw = MHI_TAKE(&arena, double, FRAMES * 3 * s->n_k);
    s->turned = MHI_TAKE(&arena, double, FRAMES * 3 * s->n_k);
    s->model = MHI_TAKE(&arena, double, FRAMES * 3 * s->n_k);
    s->q = MHI_TAKE(&arena, double, FRAMES * s->n_q);
    s->trial = MHI_TAKE(&arena, double, FRAMES * s->n_q);
    s->rest = MHI_TAKE(&arena, double, s->n_q);
    s->marker_q = MHI_TAKE(&arena, double, 3 * s->n_k * s->n_q);
    s->factor = MHI_TAKE(&arena, double, FRAMES * s->n_q * s->n_q);
    s->solved = MHI_TAKE(&arena, double, FRAMES * s->n_q * (MHI_POSE_FREEDOMS + 1));
    s->coupling = MHI_TAKE(&arena, double, s->n_q *(MHI_POSE_FREEDOMS + 1));
    s->arena = arena;
    mhe_status status = s->raw == NULL || s->turned == NULL || s->model == NULL || s->q == NULL ||
                                s->trial == NULL || s->rest == NULL || s->marker_q == NULL ||
                                s->factor == NULL || s->solved == NULL || s->coupling == NULL
                            ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                            : mhi_system_context_create(system, &s->context, err);
    if (status == MHE_OK) {
        status = mhi_start_create(system, s->context, &s->start, err);
    }
    if (status == MHE_OK) {
        mhi_work_begin(&s->work, mhi_start_affordable(s->start), 0);
        mhi_system_context_set_work(s->context, &s->work);
        mhi_start_set_enough(s->start, FOUND);
        for (int32_t i = 0; i < s->n_q; i++) {
            const mhe_coordinate *c = &d->coordinates[i];
            s->rest[i] = fmin(fmax(c->value, c->lower), c->upper);
        }
        choose_frames(s, r);
    }
    if (status != MHE_OK || s->n_frames == 0) {
        mhi_pose_close(s);
        return status;
    }
    *out = s;
    return MHE_OK;
}

void mhi_pose_look(mhi_pose_search *s, int32_t few) {
    s->every = few ? (s->n_frames + FEW - 1) / FEW : 1;
    mhi_start_set_enough(s->start, few ? ROUGHLY : FOUND);
    mhi_start_set_tries(s->start, few ? FEW_TRIES : TRIES);
}

int32_t mhi_pose_spent(const mhi_pose_search *s) {
    return mhi_work_spent(&s->work);
}

mhe_status mhi_pose_rest(mhi_pose_search *s) {
    mhe_status status = MHE_OK;
    for (int32_t f = 0; f < s->n_frames && status == MHE_OK; f += s->every) {
        memcpy(s->q + (ptrdiff_t)f * s->n_q, s->rest, sizeof(double) * (size_t)s->n_q);
        status = mhi_system_markers(s->context, s->rest, s->model + (ptrdiff_t)f * 3 * s->n_k, NULL,
                                    NULL);
    }
    return status;
}

void mhi_pose_close(mhi_pose_search *s) {
    if (s != NULL) {
        mhi_start_free(s->start);
        mhi_system_context_free(s->context);
        mhi_arena arena = s->arena;
        mhi_arena_free(&arena);
    }
}

mhi_pose mhi_pose_identity(void) {
    return (mhi_pose){.turn = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .scale = 1};
}

void mhi_pose_place(const mhi_pose *pose, const double in[3], double out[3]) {
    for (int32_t i = 0; i < 3; i++) {
        const double *row = &pose->turn[3 * i];
        out[i] = pose->scale * (row[0] * in[0] + row[1] * in[1] + row[2] * in[2]) + pose->shift[i];
    }
}

double mhi_pose_fit(mhi_pose_search *s, const mhi_pose *pose, int32_t anywhere) {
    double squares = 0;
    int32_t n = 0;
    for (int32_t f = 0; f < s->n_frames; f += s->every) {
        const ptrdiff_t at = (ptrdiff_t)f * 3 * s->n_k;
        double *q = s->q + (ptrdiff_t)f * s->n_q, rms = NAN;
        for (int32_t i = 0; i < s->n_k; i++) {
            mhi_pose_place(pose, s->raw + at + 3 * i, s->turned + at + 3 * i);
        }
        if (anywhere) {
            memcpy(q, f == 0 ? s->rest : q - (ptrdiff_t)s->every * s->n_q,
                   sizeof(double) * (size_t)s->n_q);
        }
        const mhe_status status = (anywhere && f == 0 ? mhi_start_search : mhi_start_posture)(
            s->start, s->turned + at, q, &rms, NULL);
        if (status != MHE_OK || isnan(rms) ||
            mhi_system_markers(s->context, q, s->model + at, NULL, NULL) != MHE_OK) {
            return NAN;
        }
        const int32_t seen = count_seen(s->raw + at, s->n_k);
        squares += seen * rms * rms;
        n += seen;
    }
    return sqrt(squares / n);
}

/* Eigenvectors (columns of v) and values of a symmetric matrix by Jacobi's rotations. */
static void eigen(double a[9], double v[9]) {
    const mhi_pose identity = mhi_pose_identity();
    memcpy(v, identity.turn, sizeof identity.turn);
    for (int sweep = 0; sweep < 30; sweep++) {
        for (int p = 0; p < 2; p++) {
            for (int q = p + 1; q < 3; q++) {
                if (fabs(a[3 * p + q]) < 1e-300) {
                    continue;
                }
                const double theta = 0.5 * atan2(2 * a[3 * p + q], a[4 * q] - a[4 * p]);
                const double c = cos(theta), s = sin(theta);
                for (int k = 0; k < 3; k++) { /* A := A J */
                    const double kp = a[3 * k + p], kq = a[3 * k + q];
                    a[3 * k + p] = c * kp - s * kq;
                    a[3 * k + q] = s * kp + c * kq;
                    const double vp = v[3 * k + p], vq = v[3 * k + q];
                    v[3 * k + p] = c * vp - s * vq;
                    v[3 * k + q] = s * vp + c * vq;
                }
                for (int k = 0; k < 3; k++) { /* A := J' A */
                    const double pk = a[3 * p + k], qk = a[3 * q + k];
                    a[3 * p + k] = c * pk - s * qk;
                    a[3 * q + k] = s * pk + c * qk;
                }
            }
        }
    }
}

static double determinant(const double r[9]) {
    return r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) +
           r[2] * (r[3] * r[7] - r[4] * r[6]);
}

static void cross(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* The orthogonal matrix of determinant `hand` that brings h = sum x y' nearest to a multiple of it:
 * of h = U S V', U diag(1, 1, +-1) V'. */
static void nearest_turn(const double h[9], double hand, double out[9]) {
    double square[9], v[9], u[3][3], w[3][3];
    for (int i = 0; i < 9; i++) {
        square[i] = 0;
        for (int k = 0; k < 3; k++) {
            square[i] += h[3 * k + i / 3] * h[3 * k + i % 3];
        }
    }
    eigen(square, v);
    int order[3] = {0, 1, 2};
    for (int i = 0; i < 3; i++) {
        for (int k = i + 1; k < 3; k++) {
            if (square[4 * order[k]] > square[4 * order[i]]) {
                const int swap = order[i];
                order[i] = order[k];
                order[k] = swap;
            }
        }
    }
    for (int i = 0; i < 2; i++) {
        double size = 0;
        for (int k = 0; k < 3; k++) {
            w[i][k] = v[3 * k + order[i]];
        }
        for (int k = 0; k < 3; k++) {
            u[i][k] = h[3 * k] * w[i][0] + h[3 * k + 1] * w[i][1] + h[3 * k + 2] * w[i][2];
        }
        for (int m = 0; m < i; m++) { /* against rounding */
            const double dot = u[i][0] * u[m][0] + u[i][1] * u[m][1] + u[i][2] * u[m][2];
            for (int k = 0; k < 3; k++) {
                u[i][k] -= dot * u[m][k];
            }
        }
        for (int k = 0; k < 3; k++) {
            size += u[i][k] * u[i][k];
        }
        for (int k = 0; k < 3; k++) {
            u[i][k] = size > 0 ? u[i][k] / sqrt(size) : NAN;
        }
    }
    cross(w[0], w[1], w[2]);
    cross(u[0], u[1], u[2]);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            out[3 * i + k] = u[0][i] * w[0][k] + u[1][i] * w[1][k] + hand * u[2][i] * w[2][k];
        }
    }
}

/* Was marker i of all frames looked at, and seen? */
static int32_t counts(const mhi_pose_search *s, int32_t i) {
    return i / s->n_k % s->every == 0 && !isnan(s->raw[3 * i]);
}

void mhi_pose_superpose(const mhi_pose_search *s, int32_t freedom, mhi_pose *pose) {
    const int32_t n = s->n_frames * s->n_k;
    double from[3] = {0}, to[3] = {0}, h[9] = {0}, spread = 0, along = 0;
    int32_t seen = 0;
    for (int32_t i = 0; i < n; i++) {
        for (int32_t k = 0; k < 3 && counts(s, i); k++) {
            from[k] += s->raw[3 * i + k];
            to[k] += s->model[3 * i + k];
        }
        seen += counts(s, i);
    }
    for (int32_t k = 0; k < 3; k++) { /* without a shift both turn about the origin */
        from[k] = freedom & MHI_POSE_SHIFT ? from[k] / seen : 0;
        to[k] = freedom & MHI_POSE_SHIFT ? to[k] / seen : 0;
    }
    for (int32_t i = 0; i < n; i++) {
        for (int32_t a = 0; a < 3 && counts(s, i); a++) {
            for (int32_t b = 0; b < 3; b++) {
                h[3 * a + b] += (s->model[3 * i + a] - to[a]) * (s->raw[3 * i + b] - from[b]);
            }
            spread += (s->raw[3 * i + a] - from[a]) * (s->raw[3 * i + a] - from[a]);
        }
    }
    if (freedom & MHI_POSE_TURN) {
        double turn[9];
        nearest_turn(h, determinant(pose->turn) < 0 ? -1 : 1, turn);
        if (!isnan(turn[0] + turn[4] + turn[8])) {
            memcpy(pose->turn, turn, sizeof turn);
        }
    }
    for (int32_t i = 0; i < 9; i++) {
        along += pose->turn[i] * h[i];
    }
    if (freedom & MHI_POSE_SCALE && spread > 0 && along > 0) {
        pose->scale = along / spread;
    }
    for (int32_t a = 0; a < 3 && freedom & MHI_POSE_SHIFT; a++) {
        const double *row = &pose->turn[3 * a];
        pose->shift[a] =
            to[a] - pose->scale * (row[0] * from[0] + row[1] * from[1] + row[2] * from[2]);
    }
}

const double *mhi_pose_postures(const mhi_pose_search *s, int32_t *n_frames) {
    *n_frames = s->n_frames;
    return s->q;
}

double mhi_pose_tilt(mhi_pose_search *s, const mhi_pose *pose) {
    const double *g = s->description->gravity;
    const double size = sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    double worst = NAN;
    if (!(size > 1e-6)) {
        return NAN;
    }
    for (int32_t f = 0; f < s->n_frames; f++) {
        mhi_pose body = mhi_pose_identity();
        mhi_pose_search one = *s;
        one.n_frames = 1;
        one.raw = s->model + (ptrdiff_t)f * 3 * s->n_k; /* from the rest to the recorded posture */
        (void)memcpy(s->turned, s->raw + (ptrdiff_t)f * 3 * s->n_k,
                     sizeof(double) * 3 * (size_t)s->n_k);
        if (mhi_system_markers(s->context, s->rest, one.raw, NULL, NULL) != MHE_OK) {
            return NAN;
        }
        one.model = s->turned;
        for (int32_t i = 0; i < s->n_k; i++) {
            double moved[3];
            mhi_pose_place(pose, s->turned + 3 * i, moved);
            memcpy(s->turned + 3 * i, moved, sizeof moved);
            for (int32_t k = 0; k < 3; k++) { /* what was not seen counts on neither side */
                one.raw[3 * i + k] = isnan(moved[k]) ? NAN : one.raw[3 * i + k];
            }
        }
        mhi_pose_superpose(&one, MHI_POSE_TURN | MHI_POSE_SHIFT, &body);
        double along = 0;
        for (int32_t i = 0; i < 9; i++) {
            along += g[i / 3] * body.turn[i] * g[i % 3] / (size * size);
        }
        const double tilt = acos(fmin(fmax(along, -1), 1)) * 180 / MHI_PI;
        worst = fmax(worst, tilt);
    }
    return worst;
}

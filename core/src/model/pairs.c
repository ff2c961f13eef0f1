/* SPDX-License-Identifier: Apache-2.0 */
/* pairs.c: what force plugins push between two frames, brought to the coordinates.
 *
 * Of frame 2 in frame 1: angles th (body-fixed x-y-z), place y = R1^T (x2 - x1). With w the
 * relative angular velocity in frame 2's axes, w = W v, y' = Y v, th' = N(th) w. A push f = [f_th,
 * f_y] does tau = W^T N^T f_th + Y^T f_y, which are loads on the two bodies: the moment m = N^T
 * f_th in frame 2's axes and the force f_y in frame 1's at the origin of frame 2, on body 2, and
 * the opposite, at the same place, on body 1. So W, Y and the derivatives of W^T m, Y^T f_y, of W v
 * and Y v all come from the model's loads. */
#include "model/system_private.h"

#include <math.h>
#include <string.h>

#define SIX 6
#define LOADS 4 /* force on 2 and 1, moment on 2 and 1 */

static const double ground[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};

static void rotate(const double *r, const double *x, double *out) {
    for (int i = 0; i < 3; i++) {
        out[i] = r[3 * i] * x[0] + r[3 * i + 1] * x[1] + r[3 * i + 2] * x[2];
    }
}

static void rotate_back(const double *r, const double *x, double *out) {
    for (int i = 0; i < 3; i++) {
        out[i] = r[i] * x[0] + r[3 + i] * x[1] + r[6 + i] * x[2];
    }
}

/* Frame k in ground: origin x, rotation r. */
static void place(const mhi_system_context *c, const mhe_frame_pair *pair, int k, double *x,
                  double *r) {
    const double *body = pair->body[k] < 0 ? ground : c->body + 12 * pair->body[k];
    rotate(body + 3, pair->p[k], x);
    for (int i = 0; i < 3; i++) {
        x[i] += body[i];
        for (int j = 0; j < 3; j++) {
            r[3 * i + j] = body[3 + 3 * i] * pair->r[k][j] + body[4 + 3 * i] * pair->r[k][3 + j] +
                           body[5 + 3 * i] * pair->r[k][6 + j];
        }
    }
}

/* N, and its derivatives by the second and third angle (it is blind to the first). */
static void angle_rates(const double *angle, double n[3][9]) {
    const double cb = cos(angle[1]), sb = sin(angle[1]), cc = cos(angle[2]), sc = sin(angle[2]);
    const double tb = sb / cb, by = 1 / (cb * cb);
    const double of[3][9] = {{cc / cb, -sc / cb, 0, sc, cc, 0, -cc * tb, sc * tb, 1},
                             {cc * tb / cb, -sc * tb / cb, 0, 0, 0, 0, -cc * by, sc * by, 0},
                             {-sc / cb, -cc / cb, 0, cc, -sc, 0, sc * tb, cc * tb, 0}};
    memcpy(n, of, sizeof of);
}

/* Loads of a push [f_th, f_y] in which the moment is given instead: value [LOADS x 9]; those on
 * ground are left out: their number. `which`: 1 force, 2 moment, 3 both. */
static int32_t make_loads(const mhe_frame_pair *pair, int which, const double *moment,
                          const double *force, mhe_load *loads, double *value, int32_t *side) {
    int32_t n = 0;
    for (int kind = 0; kind < 2; kind++) {
        for (int k = 1; k >= 0 && (which >> kind & 1) != 0; k--) {
            const int axes = kind; /* forces in those of frame 1, moments of frame 2 */
            if (pair->body[k] < 0) {
                continue;
            }
            double *v = value + 9 * n, given[3];
            rotate(pair->r[axes], kind == 0 ? force : moment, given);
            memset(v, 0, 9 * sizeof *v);
            for (int i = 0; i < 3; i++) {
                v[(kind == 0 ? 0 : 6) + i] = k == 1 ? given[i] : -given[i];
                v[3 + i] = pair->p[1][i];
            }
            loads[n] = (mhe_load){
                .body = pair->body[k], .axes = pair->body[axes], .origin = pair->body[1]};
            side[n++] = 2 * kind + k;
        }
    }
    return n;
}

/* rows [6 x n_q]: W, then Y. */
static mhe_status motion_rows(mhi_system_context *c, const mhe_frame_pair *pair, double *rows,
                              mhe_error *err) {
    static const double none[3];
    const int32_t n_q = c->system->face.n_q;
    mhe_load loads[LOADS];
    double value[LOADS * 9];
    int32_t side[LOADS];
    const int32_t n = make_loads(pair, 3, none, none, loads, value, side);
    memset(rows, 0, sizeof *rows * (size_t)(SIX * n_q));
    mhe_status status =
        n == 0 ? MHE_OK
               : c->system->model->loads(c->model, loads, n, value, NULL, NULL, c->pair_loads, err);
    for (int32_t l = 0; l < n && status == MHE_OK; l++) {
        const int kind = side[l] / 2;
        const double sign = side[l] % 2 == 1 ? 1 : -1, *r = pair->r[kind];
        for (int32_t j = 0; j < n_q; j++) {
            double turned[3];
            rotate_back(r, c->pair_loads + j * 9 * n + 9 * l + (kind == 0 ? 0 : 6), turned);
            for (int k = 0; k < 3; k++) {
                rows[((kind == 0 ? 3 : 0) + k) * n_q + j] += sign * turned[k];
            }
        }
    }
    return status;
}

static void times(const double *rows, int32_t n, const double *v, double *out, int32_t n_rows) {
    for (int32_t k = 0; k < n_rows; k++) {
        out[k] = 0;
        for (int32_t j = 0; j < n; j++) {
            out[k] += rows[k * n + j] * v[j];
        }
    }
}

mhe_status mhi_pairs_place(mhi_system_context *c, const mhe_frame_pair *pair, const double *v,
                           int32_t i, mhe_error *err) {
    double x[2][3], r[2][9], apart[3], n[3][9], motion[SIX], m[9];
    double *deflection = c->deflection + SIX * i, *rate = c->deflection_rate + SIX * i;
    double *rows = c->pair_rows + SIX * i * c->system->face.n_q;
    mhe_status status = motion_rows(c, pair, rows, err);
    for (int k = 0; k < 2; k++) {
        place(c, pair, k, x[k], r[k]);
    }
    for (int k = 0; k < 3; k++) {
        apart[k] = x[1][k] - x[0][k];
        const double column[3] = {r[1][k], r[1][3 + k], r[1][6 + k]};
        double in_one[3];
        rotate_back(r[0], column, in_one);
        m[k] = in_one[0];
        m[3 + k] = in_one[1];
        m[6 + k] = in_one[2];
    }
    deflection[0] = atan2(-m[5], m[8]);
    deflection[1] = atan2(m[2], hypot(m[0], m[1]));
    deflection[2] = atan2(-m[1], m[0]);
    rotate_back(r[0], apart, deflection + 3);
    times(rows, c->system->face.n_q, v, motion, SIX);
    angle_rates(deflection, n);
    rotate(n[0], motion, rate);
    memcpy(rate + 3, motion + 3, 3 * sizeof *rate);
    return status;
}

/* out [6 x n_q] = d(W v)/dq, d(Y v)/dq. */
static mhe_status rate_rows(mhi_system_context *c, const mhe_frame_pair *pair, const double *v,
                            double *out, mhe_error *err) {
    const int32_t n_q = c->system->face.n_q;
    mhe_status status = MHE_OK;
    memset(out, 0, sizeof *out * (size_t)(SIX * n_q));
    for (int k = 0; k < SIX && status == MHE_OK; k++) {
        const double unit[3] = {k % 3 == 0, k % 3 == 1, k % 3 == 2};
        mhe_load loads[LOADS];
        double value[LOADS * 9];
        int32_t side[LOADS];
        const int32_t n = make_loads(pair, k < 3 ? 2 : 1, unit, unit, loads, value, side);
        memset(c->pair_q, 0, sizeof *c->pair_q * (size_t)(n_q * n_q));
        status =
            n == 0 ? MHE_OK
                   : c->system->model->loads(c->model, loads, n, value, NULL, c->pair_q, NULL, err);
        for (int32_t i = 0; i < n_q; i++) {
            for (int32_t j = 0; j < n_q; j++) {
                out[k * n_q + j] += v[i] * c->pair_q[i * n_q + j];
            }
        }
    }
    return status;
}

/* to [3 x n_q] = N x rows + (dN x) with x = W v moving the angles by angle_q [3 x n_q] */
static void turn_rows(double n[3][9], const double *rows, const double *x, const double *angle_q,
                      int32_t n_q, double *to) {
    double by[2][3];
    rotate(n[1], x, by[0]);
    rotate(n[2], x, by[1]);
    for (int32_t j = 0; j < n_q; j++) {
        const double column[3] = {rows[j], rows[n_q + j], rows[2 * n_q + j]};
        double turned[3];
        rotate(n[0], column, turned);
        for (int k = 0; k < 3; k++) {
            to[k * n_q + j] = turned[k] + (angle_q == NULL ? 0
                                                           : by[0][k] * angle_q[n_q + j] +
                                                                 by[1][k] * angle_q[2 * n_q + j]);
        }
    }
}

/* to [6 x n_q] += m [6 x 6] rows [6 x n_q] */
static void add_product(const double *m, const double *rows, int32_t n_q, double *to) {
    for (int k = 0; k < SIX; k++) {
        for (int l = 0; l < SIX; l++) {
            for (int32_t j = 0; j < n_q && m[SIX * k + l] != 0; j++) {
                to[k * n_q + j] += m[SIX * k + l] * rows[l * n_q + j];
            }
        }
    }
}

/* f [6 x n_q]: its upper half, by angles, to one by moments: N^T f (+ dN^T f_th). */
static void to_moments(double n[3][9], const double *push, const double *angle_q, int32_t n_q,
                       double *f) {
    double by[2][3];
    rotate_back(n[1], push, by[0]);
    rotate_back(n[2], push, by[1]);
    for (int32_t j = 0; j < n_q; j++) {
        const double column[3] = {f[j], f[n_q + j], f[2 * n_q + j]};
        double turned[3];
        rotate_back(n[0], column, turned);
        for (int k = 0; k < 3; k++) {
            f[k * n_q + j] = turned[k] + (angle_q == NULL ? 0
                                                          : by[0][k] * angle_q[n_q + j] +
                                                                by[1][k] * angle_q[2 * n_q + j]);
        }
    }
}

/* to [n_q x n_q] += rows^T f */
static void add_transposed(const double *rows, const double *f, int32_t n_q, double *to) {
    for (int k = 0; k < SIX; k++) {
        for (int32_t i = 0; i < n_q; i++) {
            for (int32_t j = 0; j < n_q; j++) {
                to[i * n_q + j] += rows[k * n_q + i] * f[k * n_q + j];
            }
        }
    }
}

static int any(const double *values, int32_t n) {
    int some = 0;
    for (int32_t i = 0; i < n; i++) {
        some |= values[i] != 0;
    }
    return some;
}

mhe_status mhi_pairs_push(mhi_system_context *c, const mhe_frame_pair *pair, const double *v,
                          int32_t i, int32_t derivatives, mhe_error *err) {
    const int32_t n_q = c->system->face.n_q;
    const double *push = c->push + SIX * i, *rows = c->pair_rows + SIX * i * n_q;
    const double *push_d = c->push_d + SIX * SIX * i, *push_w = c->push_w + SIX * SIX * i;
    double n[3][9], moment[3], motion[SIX], value[LOADS * 9];
    double *y_q = c->pair_work, *rate_q = y_q + SIX * n_q, *f = rate_q + SIX * n_q;
    mhe_load loads[LOADS];
    int32_t side[LOADS];
    angle_rates(c->deflection + SIX * i, n);
    rotate_back(n[0], push, moment);
    const int32_t n_loads = make_loads(pair, 3, moment, push + 3, loads, value, side);
    mhe_status status = n_loads == 0
                            ? MHE_OK
                            : c->system->model->loads(c->model, loads, n_loads, value, c->other,
                                                      derivatives ? c->other_q : NULL, NULL, err);
    if (status != MHE_OK || !derivatives) {
        return status;
    }
    times(rows, n_q, v, motion, SIX);
    turn_rows(n, rows, motion, NULL, n_q, y_q);
    memcpy(y_q + 3 * n_q, rows + 3 * n_q, sizeof *y_q * (size_t)(3 * n_q));
    memset(f, 0, sizeof *f * (size_t)(SIX * n_q));
    if (any(push_w, SIX * SIX)) {
        add_product(push_w, y_q, n_q, f); /* by v */
        to_moments(n, push, NULL, n_q, f);
        add_transposed(rows, f, n_q, c->other_v);
        memset(f, 0, sizeof *f * (size_t)(SIX * n_q));
        status = rate_rows(c, pair, v, rate_q, err);
        memcpy(c->pair_turn, rate_q, sizeof *rate_q * (size_t)(3 * n_q));
        turn_rows(n, c->pair_turn, motion, y_q, n_q, rate_q);
        add_product(push_w, rate_q, n_q, f);
    }
    add_product(push_d, y_q, n_q, f); /* by q */
    to_moments(n, push, y_q, n_q, f);
    add_transposed(rows, f, n_q, c->other_q);
    return status;
}

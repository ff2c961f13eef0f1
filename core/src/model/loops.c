/* SPDX-License-Identifier: Apache-2.0 */
/* loops.c: what keeps the loops of a model closed.
 *
 * With gap g(q), rate G(q) v and acceleration G vdot + gamma(q, v), the force lambda that closes
 * them is found with the accelerations (Baumgarte 1972, doi:10.1016/0045-7825(72)90018-7):
 *     M vdot = f + G^T lambda,     G vdot + gamma + 2 k G v + k^2 g = 0,
 * so that a gap, where one has come from, closes as a critically damped motion at rate k, and a
 * closed loop stays closed whatever the controls do. lambda is a function of the state and no
 * control of its own: a force that is constant over an interval cannot hold a light body such as a
 * clavicle (at a change of 100 N/s it would open it by millimetres within 30 ms).
 *
 * Derivatives: with D = d(f - ID(q, v, vdot) + G^T lambda) and C = d(G vdot + gamma + 2 k G v +
 * k^2 g), lambda and vdot held, d vdot = M^-1 (D + G^T d lambda) and G d vdot = -C. Rows that
 * repeat each other (a weld between bodies of a planar mechanism) are passed over. */
#include "base/cholesky.h"
#include "model/system_private.h"

#include <math.h>
#include <mhe/host.h>
#include <stdio.h>
#include <string.h>

#define CLOSING_RATE 20.0 /* 1/s, k */
#define CLOSED 1e-10      /* m, 1: a gap of the closing of a posture */
#define MAX_ROUNDS 60

mhe_status mhi_loops_prepare(mhi_system *s, mhe_error *err) {
    const mhe_description *d = s->description;
    s->n_c = mhe_loop_rows(d);
    if (s->n_c == 0) {
        return MHE_OK;
    }
    if (s->model->loops == NULL || s->model->loads == NULL) {
        return mhe_fail(err, MHE_E_UNSUPPORTED, "%s:%d: loop '%s': this model plugin closes none",
                        d->source, (int)d->loops[0].line, d->loops[0].name);
    }
    s->loop_loads = MHI_TAKE(&s->arena, mhe_load, 2 * d->n_loops);
    s->loop_of = MHI_TAKE(&s->arena, int32_t, 2 * d->n_loops);
    if (s->loop_loads == NULL || s->loop_of == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < 2 * d->n_loops; i++) {
        const int32_t body = d->loops[i / 2].body[i % 2];
        if (body >= 0) {
            s->loop_of[s->n_loop_loads] = i;
            s->loop_loads[s->n_loop_loads++] = (mhe_load){.body = body, .axes = -1, .origin = body};
        }
    }
    return MHE_OK;
}

int32_t mhi_system_loop_rows(const mhi_system *s) {
    return s->n_c;
}

const double *mhi_system_loop_force(const mhi_system_context *c) {
    return c->system->n_c > 0 ? c->loop_force : NULL;
}

mhe_status mhi_system_gaps(mhi_system_context *c, const double *q, const double *v,
                           int32_t derivatives, mhi_loop_state *out, mhe_error *err) {
    const mhe_kinematics none = {.size = sizeof none};
    const mhe_loop_values wanted = {.size = sizeof wanted,
                                    .gap = c->gap,
                                    .gap_q = derivatives ? c->gap_q : NULL,
                                    .rate = c->gap_rate,
                                    .rate_q = derivatives ? c->gap_rate_q : NULL,
                                    .rate_v = derivatives ? c->gap_rate_v : NULL};
    mhe_status status = c->system->model->kinematics(c->model, q, v, &none, err);
    if (status == MHE_OK) {
        status = c->system->model->loops(c->model, NULL, &wanted, err);
    }
    *out = (mhi_loop_state){c->gap, c->gap_rate, c->gap_q, c->gap_rate_q, c->gap_rate_v};
    return status;
}

/* G M^-1 G^T, or with `push` = G^T, G G^T: from rows G [n_c x n_q] and push [n_q x n_c]. */
static int factor(mhi_system_context *c, const double *rows, const double *push) {
    const int32_t n_c = c->system->n_c, n_q = c->system->face.n_q;
    for (int32_t i = 0; i < n_c; i++) {
        for (int32_t k = 0; k < n_c; k++) {
            double sum = 0;
            for (int32_t j = 0; j < n_q; j++) {
                sum += rows[i * n_q + j] * push[j * n_c + k];
            }
            c->loop_factor[i * n_c + k] = sum;
        }
    }
    c->loop_rank = mhi_semidefinite_factor(c->loop_factor, n_c, c->loop_order);
    return c->loop_rank;
}

static void transpose(const double *rows, int32_t n_c, int32_t n_q, double *out) {
    for (int32_t i = 0; i < n_c; i++) {
        for (int32_t j = 0; j < n_q; j++) {
            out[j * n_c + i] = rows[i * n_q + j];
        }
    }
}

/* columns [n_q x n] += push x, x [n_c x n] the solution for what stands in c->loop_columns */
static void push_columns(const mhi_system_context *c, double *columns, int32_t n) {
    const int32_t n_c = c->system->n_c, n_q = c->system->face.n_q;
    mhi_semidefinite_solve(c->loop_factor, n_c, c->loop_order, c->loop_rank, c->loop_columns, n);
    for (int32_t j = 0; j < n_q; j++) {
        for (int32_t i = 0; i < n_c; i++) {
            const double push = c->loop_push[j * n_c + i];
            for (int32_t k = 0; k < n; k++) {
                columns[j * n + k] += push * c->loop_columns[i * n + k];
            }
        }
    }
}

mhe_status mhi_loops_close(mhi_system_context *c, int32_t derivatives, double *vdot,
                           mhe_error *err) {
    const mhi_system *s = c->system;
    const int32_t n_c = s->n_c, n_q = s->face.n_q;
    const mhe_loop_values wanted = {.size = sizeof wanted,
                                    .gap = c->gap,
                                    .gap_q = derivatives ? c->gap_q : NULL,
                                    .rate = c->gap_rate,
                                    .rate_q = derivatives ? c->gap_rate_q : NULL,
                                    .rate_v = c->gap_rate_v,
                                    .acceleration = c->gap_acceleration};
    mhe_status status = s->model->loops(c->model, vdot, &wanted, err);
    if (status != MHE_OK) {
        return status;
    }
    transpose(c->gap_rate_v, n_c, n_q, c->loop_push);
    mhi_cholesky_solve(c->mass, n_q, c->loop_push, n_c);
    if (factor(c, c->gap_rate_v, c->loop_push) < 0) {
        return mhe_fail(err, MHE_RETRY, "what closes a loop is not finite");
    }
    for (int32_t i = 0; i < n_c; i++) {
        c->loop_columns[i] = -(c->gap_acceleration[i] + 2 * CLOSING_RATE * c->gap_rate[i] +
                               CLOSING_RATE * CLOSING_RATE * c->gap[i]);
    }
    push_columns(c, vdot, 1);
    memcpy(c->loop_force, c->loop_columns, sizeof(double) * (size_t)n_c);
    return MHE_OK;
}

void mhi_loops_loads(mhi_system_context *c, double share) {
    const mhi_system *s = c->system;
    const mhe_description *d = s->description;
    for (int32_t i = 0, loop = 0, row = 0; i < s->n_loop_loads; i++) {
        const int32_t frame = s->loop_of[i] % 2;
        for (; loop < s->loop_of[i] / 2; loop++) {
            row += d->loops[loop].kind == MHE_LOOP_WELD ? 6 : 3;
        }
        const int32_t weld = d->loops[loop].kind == MHE_LOOP_WELD;
        double *value = c->loop_value + 9 * i;
        for (int32_t k = 0; k < 3; k++) {
            const double sign = frame == 0 ? -share : share;
            value[k] = sign * c->loop_force[row + k];
            value[3 + k] = d->loops[loop].p[frame][k];
            value[6 + k] = weld ? sign * c->loop_force[row + 3 + k] : 0;
        }
    }
}

mhe_status mhi_loops_linearise(mhi_system_context *c, const double *vdot, double *tau_q,
                               mhe_error *err) {
    const mhi_system *s = c->system;
    const mhe_loop_values wanted = {.size = sizeof wanted,
                                    .acceleration_q = c->gap_acceleration_q,
                                    .acceleration_v = c->gap_acceleration_v};
    mhe_status status = s->model->loops(c->model, vdot, &wanted, err);
    if (status != MHE_OK) {
        return status;
    }
    mhi_loops_loads(c, -1); /* what it takes off the inverse dynamics */
    return s->model->loads(c->model, s->loop_loads, s->n_loop_loads, c->loop_value, NULL, tau_q,
                           NULL, err);
}

void mhi_loops_closed(const mhi_system_context *c, int32_t by, double *columns, int32_t n) {
    const int32_t n_c = c->system->n_c, n_q = c->system->face.n_q;
    for (int32_t i = 0; i < n_c; i++) {
        double *row = c->loop_columns + i * n;
        for (int32_t k = 0; k < n; k++) {
            double sum = 0;
            for (int32_t j = 0; j < n_q; j++) {
                sum -= c->gap_rate_v[i * n_q + j] * columns[j * n + k];
            }
            const int32_t at = i * n_q + k;
            if (by == MHI_LOOPS_BY_Q) {
                sum -= c->gap_acceleration_q[at] + 2 * CLOSING_RATE * c->gap_rate_q[at] +
                       CLOSING_RATE * CLOSING_RATE * c->gap_q[at];
            } else if (by == MHI_LOOPS_BY_V) {
                sum -= c->gap_acceleration_v[at] + 2 * CLOSING_RATE * c->gap_rate_v[at];
            }
            row[k] = sum;
        }
    }
    if (n_c > 0) {
        push_columns(c, columns, n);
    }
}

static double largest(const double *values, int32_t n) {
    double most = 0;
    for (int32_t i = 0; i < n; i++) {
        most = fmax(most, fabs(values[i]));
    }
    return most;
}

/* x [n_q] -= rows^T (rows rows^T)^-1 value */
static int step_back(mhi_system_context *c, const double *rows, const double *value, double *x) {
    const int32_t n_c = c->system->n_c;
    transpose(rows, n_c, c->system->face.n_q, c->loop_push);
    if (factor(c, rows, c->loop_push) < 0) {
        return -1;
    }
    for (int32_t i = 0; i < n_c; i++) {
        c->loop_columns[i] = -value[i];
    }
    push_columns(c, x, 1);
    return 0;
}

mhe_status mhi_system_close_loops(mhi_system_context *c, double *q, double *v, mhe_error *err) {
    const mhi_system *s = c->system;
    if (s->n_c == 0) {
        return MHE_OK;
    }
    const double *at = v != NULL ? v : c->zero;
    mhi_loop_state state;
    mhe_status status = MHE_OK;
    double gap = INFINITY;
    for (int32_t round = 0; round < MAX_ROUNDS && status == MHE_OK; round++) {
        status = mhi_system_gaps(c, q, at, 1, &state, err);
        gap = largest(c->gap, s->n_c);
        if (status != MHE_OK || gap < CLOSED) {
            break;
        }
        if (step_back(c, c->gap_q, c->gap, q) != 0) {
            break;
        }
    }
    if (status == MHE_OK && !(gap < CLOSED)) {
        return mhe_fail(err, MHE_RETRY, "loop '%s' cannot be closed from here (a gap of %.3g m)",
                        s->description->loops[0].name, gap);
    }
    if (status == MHE_OK && v != NULL && step_back(c, c->gap_rate_v, c->gap_rate, v) != 0) {
        return mhe_fail(err, MHE_RETRY, "the speeds of a loop are not finite");
    }
    return status;
}

mhe_status mhi_loops_tell(mhi_system *s, const mhe_host *host, mhe_error *err) {
    const mhe_description *d = s->description;
    mhi_system_context *c = NULL;
    mhe_error why = {0};
    mhi_arena arena = {0};
    double *q = MHI_TAKE(&arena, double, d->n_coordinates);
    mhe_status status = q == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                  : mhi_system_context_create(s, &c, err);
    for (int32_t i = 0; i < d->n_coordinates && status == MHE_OK; i++) {
        q[i] = d->coordinates[i].value;
    }
    if (status == MHE_OK && mhi_system_close_loops(c, q, NULL, &why) != MHE_OK) {
        char text[512];
        (void)snprintf(text, sizeof text, "%s:%d: at the default posture: %.300s", d->source,
                       (int)d->loops[0].line, why.text);
        host->log(host, MHE_LOG_WARNING, text);
    }
    mhi_system_context_free(c);
    mhi_arena_free(&arena);
    return status;
}

/* SPDX-License-Identifier: Apache-2.0 */
/* carry.c: what costs read of the node before, as state of the problem.
 *
 * m_{k+1} = y(x_k, u_k) / scale: the solver's state is [x; m], so that it sees one node at a time,
 * and the shift of a window keeps what the dropped node had. Costs and their derivatives are summed
 * by z = [x; u; m] (signals.h), where nothing moves if nothing is carried. */
#include "ocp/ocp_private.h"

#include <math.h>
#include <string.h>

/* Place in z = [x; u; m] of entry i of the solver's state [x; m]. */
static int32_t state_in_z(const mhi_ocp *ocp, int32_t i) {
    return i < ocp->n_x ? i : ocp->face.n_u + i;
}

void mhi_ocp_spread_carried(const mhi_ocp *ocp, const mhi_ocp_worker *w,
                            const mhe_stage_values *out) {
    const int32_t n_x = ocp->face.n_x, n_u = ocp->face.n_u, n_z = n_x + n_u;
    for (int32_t i = 0; i < n_x; i++) {
        const int32_t row = state_in_z(ocp, i);
        if (out->grad_x != NULL) {
            out->grad_x[i] = w->gradient[row];
        }
        for (int32_t j = 0; j <= i && out->hess_xx != NULL; j++) {
            const double h = w->hessian[row * n_z + state_in_z(ocp, j)];
            out->hess_xx[i * n_x + j] = out->hess_xx[j * n_x + i] = h;
        }
        for (int32_t j = 0; j < n_u && out->hess_ux != NULL; j++) {
            const int32_t at = ocp->n_x + j;
            out->hess_ux[j * n_x + i] =
                at > row ? w->hessian[at * n_z + row] : w->hessian[row * n_z + at];
        }
    }
}

/* Nothing was before node k: the problem begins there, or a motion of several. */
static int32_t is_first(const mhi_ocp *ocp, int32_t k) {
    const int32_t *place = ocp->junction.place;
    return k == 0 ? ocp->begins : place != NULL && place[k - 1] >= 0;
}

void mhi_ocp_read_carried(const mhi_ocp *ocp, int32_t k, const double *x, double *y) {
    const int32_t first = is_first(ocp, k);
    for (int32_t i = MHI_N_SIGNALS; i < 2 * MHI_N_SIGNALS; i++) {
        const mhi_signal *m = &ocp->signals.signal[i];
        const double *from = x + m->column - ocp->face.n_u;
        for (int32_t j = 0; j < m->n_y; j++) {
            y[m->offset + j] = first ? NAN : m->scale * from[j];
        }
    }
}

/* A row of P: an entry by the parameters, over its usual size. */
static void carry_by_p(const mhi_by_parameter *by, double scale, int32_t n_p, double *row) {
    memset(row, 0, sizeof *row * (size_t)n_p);
    for (int32_t i = 0; i < n_p && by->row != NULL; i++) {
        row[i] = by->row[i] / scale;
    }
    for (int32_t i = 0; i < by->n && by->row == NULL; i++) {
        row[by->at[i]] += by->by[i] / scale;
    }
}

/* m_{k+1} = y(x_k, u_k), where parameters are estimated as it is measured, and its rows of A, B and
 * P [n_x_next of face.n_x]; A NULL: not wanted. */
static mhe_status carry(const mhi_ocp *ocp, mhi_ocp_worker *w, int32_t k, const double *x,
                        const double *u, double *next, double *A, double *B, double *P,
                        mhe_error *err) {
    const int32_t n_x = ocp->face.n_x, n_u = ocp->face.n_u, estimated = ocp->estimated != NULL;
    mhe_status status = MHE_OK;
    if (!w->linearised) {
        status = mhi_ocp_measure(ocp, w, k, ocp->carried, x, u, A != NULL, err);
        status = status == MHE_OK && estimated
                     ? mhi_ocp_measure_estimated(ocp, w, k, ocp->carried, x, u, A != NULL, err)
                     : status;
    }
    for (int32_t i = 0; i < MHI_N_SIGNALS && status == MHE_OK; i++) {
        const mhi_signal *s = &ocp->signals.signal[i];
        const mhi_signal *m = &ocp->signals.signal[MHI_N_SIGNALS + i];
        for (int32_t j = 0; j < m->n_y; j++) {
            const int32_t row = m->column - ocp->face.n_u + j;
            next[row] = w->y[s->offset + j] / m->scale;
            if (A == NULL) {
                continue;
            }
            memset(A + row * n_x, 0, sizeof(double) * (size_t)n_x);
            memset(B + row * n_u, 0, sizeof(double) * (size_t)n_u);
            const int32_t first = s->n_columns == 0 ? s->column + j : s->column;
            const double *block = w->jacobian + s->jacobian + j * s->n_columns;
            const double slope = estimated ? w->by[s->offset + j].slope : 1;
            if (P != NULL) {
                carry_by_p(&w->by[s->offset + j], m->scale, ocp->face.n_p, P + row * ocp->face.n_p);
            }
            for (int32_t c = 0; c < (s->n_columns == 0 ? 1 : s->n_columns); c++) {
                const double d = (s->n_columns == 0 ? slope : block[c]) / m->scale;
                *(first + c < ocp->n_x ? A + row * n_x + first + c
                                       : B + row * n_u + first + c - ocp->n_x) = d;
            }
        }
    }
    return status;
}

/* The system's own A and B into those of the solver's state, which has more columns. */
static void widen(const mhi_ocp *ocp, const mhi_ocp_worker *w, double *A, double *B) {
    const int32_t n_x = ocp->face.n_x, n_u = ocp->face.n_u;
    for (int32_t i = 0; i < ocp->n_x; i++) {
        memcpy(A + i * n_x, w->A + i * ocp->n_x, sizeof(double) * (size_t)ocp->n_x);
        memset(A + i * n_x + ocp->n_x, 0, sizeof(double) * (size_t)(n_x - ocp->n_x));
    }
    memcpy(B, w->B, sizeof(double) * (size_t)(ocp->n_x * n_u));
}

mhe_status mhi_ocp_step(const mhi_ocp *ocp, mhi_ocp_worker *w, int32_t k, double *memory,
                        const double *x, const double *u, const mhe_stage_values *out,
                        mhe_error *err) {
    const int carries = ocp->signals.n_carried > 0;
    const int32_t n_p = mhi_system_face(ocp->system)->n_p;
    const mhe_step_derivatives d = {sizeof d, carries && out->A != NULL ? w->A : out->A,
                                    carries && out->B != NULL ? w->B : out->B,
                                    out->P != NULL && n_p > 0 ? w->P : NULL};
    mhe_status status = ocp->integrator->step(w->integrator, x, u, mhi_ocp_inputs_at(ocp, k),
                                              ocp->interval, memory, out->x_next, &d, err);
    if (status == MHE_OK && out->P != NULL) {
        mhi_parameters_fold(&ocp->parameters, ocp->n_x, n_p, w->P, out->P);
    }
    if (status == MHE_OK && carries) {
        if (out->A != NULL) {
            widen(ocp, w, out->A, out->B);
        }
        status = carry(ocp, w, k, x, u, out->x_next, out->A, out->B, out->P, err);
    }
    return status;
}

mhe_status mhi_ocp_carry_on(const mhi_ocp *ocp, mhi_ocp_worker *w, int32_t k, const double *x,
                            const double *u, double *x_next, mhe_error *err) {
    return ocp->signals.n_carried > 0 ? carry(ocp, w, k, x, u, x_next, NULL, NULL, NULL, err)
                                      : MHE_OK;
}

void mhi_ocp_set_begins(mhi_ocp *ocp, int32_t begins) {
    ocp->begins = begins;
    for (int32_t i = ocp->n_x; i < ocp->face.n_x; i++) {
        ocp->x_lower[i] = begins ? 0 : -INFINITY;
        ocp->x_upper[i] = begins ? 0 : INFINITY;
    }
}

mhe_status mhi_ocp_carry(mhi_ocp *ocp, double *x, const double *u, mhe_error *err) {
    const int32_t n_x = ocp->face.n_x;
    mhe_status status = MHE_OK;
    for (int32_t i = ocp->n_x; i < n_x && ocp->begins; i++) {
        x[i] = 0;
    }
    ocp->workers[0].linearised = 0;
    for (int32_t k = 0; k < ocp->face.n_intervals && ocp->n_x < n_x && status == MHE_OK; k++) {
        double *next = x + (ptrdiff_t)(k + 1) * n_x;
        if (ocp->junction.place != NULL && ocp->junction.place[k] >= 0) {
            memset(next + ocp->n_x, 0, sizeof *next * (size_t)(n_x - ocp->n_x));
            continue;
        }
        status = carry(ocp, &ocp->workers[0], k, x + (ptrdiff_t)k * n_x,
                       u + (ptrdiff_t)k * ocp->face.n_u, next, NULL, NULL, NULL, err);
    }
    return status;
}

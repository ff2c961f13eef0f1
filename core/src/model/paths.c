/* SPDX-License-Identifier: Apache-2.0 */
/* paths.c: velocities and moments of the paths, each over the few coordinates that it sees.
 *
 * Compiled without loop vectorisation (CMakeLists.txt): loops over two to eight coordinates cost
 * more with it. */
#include "model/system_private.h"

void mhi_path_velocities(mhi_system_context *c, int32_t from, int32_t to, const double *v,
                         int32_t derivatives) {
    const mhi_system *s = c->system;
    const int32_t n_q = s->face.n_q;
    for (int32_t m = from; m < to; m++) {
        const int32_t first = s->first[m], end = s->end[m];
        const double *l_q = c->length_q + m * n_q;
        double sum = 0;
        for (int32_t j = first; j < end; j++) {
            sum += l_q[j] * v[j];
        }
        c->velocity[m] = sum;
        for (int32_t i = first; i < end && derivatives; i++) {
            const double *l_qq = c->length_qq + (m * n_q + i) * n_q;
            double w_q = 0;
            for (int32_t j = first; j < end; j++) {
                w_q += l_qq[j] * v[j];
            }
            c->velocity_q[m * n_q + i] = w_q;
        }
    }
}

void mhi_path_moments(const mhi_system_context *c, int32_t from, int32_t to, const double *force,
                      double *moment) {
    const mhi_system *s = c->system;
    for (int32_t m = from; m < to; m++) {
        const double *l_q = c->length_q + m * s->face.n_q;
        for (int32_t j = s->first[m]; j < s->end[m]; j++) {
            moment[j] -= l_q[j] * force[m - from];
        }
    }
}

/* dF/dq = F_l L_q + F_w dLdot/dq,  dF/dv = F_w L_q,
 * d moment/dq = -(L_qq F + L_q^T dF/dq),  d moment/dv = -L_q^T dF/dv. */
void mhi_path_moment_derivatives(const mhi_system_context *c, int32_t m, double force,
                                 double force_l, double force_w, double *f_q, double *f_v,
                                 double *moment_q, double *moment_v) {
    const mhi_system *s = c->system;
    const int32_t n_q = s->face.n_q, first = s->first[m], end = s->end[m];
    const double *l_q = c->length_q + m * n_q, *l_qq = c->length_qq + m * n_q * n_q;
    const double *w_q = c->velocity_q + m * n_q;
    for (int32_t i = first; i < end; i++) {
        f_q[i] = force_l * l_q[i] + force_w * w_q[i];
        f_v[i] = force_w * l_q[i];
    }
    for (int32_t i = first; i < end; i++) {
        for (int32_t j = first; j < end; j++) {
            moment_q[i * n_q + j] -= force * l_qq[i * n_q + j] + l_q[i] * f_q[j];
            moment_v[i * n_q + j] -= l_q[i] * f_v[j];
        }
    }
}

/* SPDX-License-Identifier: Apache-2.0 */
/* check_loads.c: forces at points and torques on bodies of the made-up skeleton. */
#include "kit.h"

#include <math.h>
#include <string.h>

#define N_Q MHI_MADE_UP_Q
#define N_L 3

/* A force given and applied in ground; one that follows its body; one with three different frames.
 */
static const mhe_load loads[N_L] = {{2, -1, -1}, {2, 2, 2}, {1, 0, 2}};

enum { TAU, TAU_Q, TAU_L };

/* in: q, v, values; out: tau, tau_q, tau_l */
static mhe_status call_loads(void *data, void *context, void *scratch, const double *const *in,
                             double *const *out, mhe_error *err) {
    const mhe_model_ops *ops = data;
    const mhe_kinematics nothing = {.size = sizeof nothing};
    (void)scratch;
    const mhe_status status = ops->kinematics(context, in[0], in[1], &nothing, err);
    return status != MHE_OK
               ? status
               : ops->loads(context, loads, N_L, in[2], out[TAU], out[TAU_Q], out[TAU_L], err);
}

static void cross(const double *a, const double *b, double *out) {
    for (int k = 0; k < 3; k++) {
        out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    }
}

/* x in the frame of a body: turned to ground axes, and with `at` the body's origin added. */
static void to_ground(const double *body, int32_t i, const double *x, int at, double *out) {
    for (int k = 0; k < 3; k++) {
        out[k] = x[k];
        if (i >= 0) {
            const double *r = body + 12 * i + 3 + 3 * k;
            out[k] = r[0] * x[0] + r[1] * x[1] + r[2] * x[2] + (at ? body[12 * i + k] : 0);
        }
    }
}

/* Virtual work: what the loads do along the motions of their bodies. */
static void work(const double *body, const double *body_q, const double *values, double *tau) {
    memset(tau, 0, sizeof *tau * N_Q);
    for (int l = 0; l < N_L; l++) {
        const double *value = values + 9 * l, *origin = body + 12 * loads[l].body;
        double f[3], x[3], t[3], arm[3];
        to_ground(body, loads[l].axes, value, 0, f);
        to_ground(body, loads[l].origin, value + 3, 1, x);
        to_ground(body, loads[l].axes, value + 6, 0, t);
        for (int k = 0; k < 3; k++) {
            arm[k] = x[k] - origin[k];
        }
        for (int j = 0; j < N_Q; j++) {
            double turn[3], move[3];
            for (int k = 0; k < 3; k++) {
                turn[k] = body_q[(6 * loads[l].body + k) * N_Q + j];
            }
            cross(turn, arm, move);
            for (int k = 0; k < 3; k++) {
                move[k] += body_q[(6 * loads[l].body + 3 + k) * N_Q + j];
                tau[j] += f[k] * move[k] + t[k] * turn[k];
            }
        }
    }
}

void mhi_check_loads(mhi_kit *kit, const mhe_model_ops *ops, void *const *contexts,
                     const double *body, const double *body_q, const double *const *in, int turn) {
    double values[9 * N_L], tau[N_Q] = {0}, tau_q[N_Q * N_Q] = {0}, tau_l[N_Q * 9 * N_L] = {0};
    double expected[N_Q], worst = 0;
    if (ops->loads == NULL) {
        mhi_kit_skip(kit, "loads", "this model takes none");
        return;
    }
    uint64_t seed = 23 + (uint64_t)turn;
    for (int i = 0; i < 9 * N_L; i++) {
        const double reach = i / 3 % 3 == 0 ? 100.0 : i / 3 % 3 == 1 ? 0.3 : 10.0;
        values[i] = mhi_kit_random(&seed, -reach, reach);
    }
    const double *const at[] = {in[0], in[1], values};
    double *const out[] = {tau, tau_q, tau_l};
    mhi_probe probe = {
        .name = "loads",
        .n_in = 3,
        .n_out = 3,
        .in = {{.n = N_Q}, {.n = N_Q}, {.n = 9 * N_L}},
        .out = {{.n = N_Q, .zeroed = 1}, {.n = N_Q * N_Q, .zeroed = 1}, {.n = N_Q * 9 * N_L}},
        .data = (void *)ops,
        .call = call_loads};
    memcpy(probe.worker, contexts, sizeof probe.worker);
    mhe_error err = {0};
    if (call_loads((void *)ops, contexts[0], NULL, at, out, &err) != MHE_OK) {
        mhi_kit_fail(kit, "loads", "%s", err.text);
        return;
    }
    if (turn == 0) {
        mhi_probe_check(kit, &probe, at);
    }
    work(body, body_q, values, expected);
    for (int j = 0; j < N_Q; j++) {
        worst = fmax(worst, fabs(tau[j] - expected[j]) / fmax(1, fabs(expected[j])));
    }
    (void)mhi_kit_limit(kit, "loads do the work that they should", worst, 1e-10);
    mhi_probe_jacobian(kit, &probe, at, 0, TAU, tau_q, "loads by q against differences");
    mhi_probe_jacobian(kit, &probe, at, 2, TAU, tau_l, "loads by their values against differences");
    double more[N_Q];
    memcpy(more, tau, sizeof more);
    double *const again[] = {more, NULL, NULL};
    if (call_loads((void *)ops, contexts[0], NULL, at, again, &err) == MHE_OK &&
        fabs(more[0] - 2 * tau[0]) <= 1e-12 * fabs(tau[0])) {
        mhi_kit_pass(kit, "loads are added to what is there");
    } else {
        mhi_kit_fail(kit, "loads are added to what is there", "they are not");
    }
}

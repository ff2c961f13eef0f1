/* SPDX-License-Identifier: Apache-2.0 */
/* check_model.c: kinematics and dynamics of the made-up skeleton (made_up.c). */
#include "kit.h"

#include "base/cholesky.h"

#include <math.h>
#include <mhe/model.h>
#include <string.h>

#define N_Q MHI_MADE_UP_Q
#define N_M MHI_MADE_UP_PATHS
#define N_K MHI_MADE_UP_MARKERS
#define N_B MHI_MADE_UP_BODIES

/* ---- probes ---- */

enum { MASS, BIAS, LENGTH, LENGTH_Q, LENGTH_QQ, MARKER, MARKER_Q, BODY, BODY_Q, N_KINEMATICS };

static mhe_status call_kinematics(void *data, void *context, void *scratch, const double *const *in,
                                  double *const *out, mhe_error *err) {
    (void)scratch;
    const mhe_kinematics k = {.size = sizeof k,
                              .mass = out[MASS],
                              .bias = out[BIAS],
                              .length = out[LENGTH],
                              .length_q = out[LENGTH_Q],
                              .length_qq = out[LENGTH_QQ],
                              .marker = out[MARKER],
                              .marker_q = out[MARKER_Q],
                              .body = out[BODY],
                              .body_q = out[BODY_Q]};
    return ((const mhe_model_ops *)data)->kinematics(context, in[0], in[1], &k, err);
}

static const mhe_kinematics nothing = {.size = sizeof nothing};

/* in: q, v, vdot; out: tau, tau_q, tau_v */
static mhe_status call_inverse(void *data, void *context, void *scratch, const double *const *in,
                               double *const *out, mhe_error *err) {
    const mhe_model_ops *ops = data;
    (void)scratch;
    const mhe_status status = ops->kinematics(context, in[0], in[1], &nothing, err);
    return status != MHE_OK ? status
                            : ops->inverse_dynamics(context, in[2], out[0], out[1], out[2], err);
}

/* in: q, v, tau; out: vdot */
static mhe_status call_forward(void *data, void *context, void *scratch, const double *const *in,
                               double *const *out, mhe_error *err) {
    const mhe_model_ops *ops = data;
    (void)scratch;
    const mhe_status status = ops->kinematics(context, in[0], in[1], &nothing, err);
    return status != MHE_OK ? status : ops->forward_dynamics(context, in[2], out[0], err);
}

typedef struct model_case {
    const mhe_model_ops *ops;
    mhi_probe kinematics, inverse, forward;
    double *out[N_KINEMATICS];
    double tau[N_Q], tau_q[N_Q * N_Q], tau_v[N_Q * N_Q], vdot[N_Q];
} model_case;

static void make_probes(mhi_kit *kit, model_case *c, void *const *contexts) {
    static const int32_t n[N_KINEMATICS] = {N_Q * N_Q,       N_Q,     N_M,           N_M * N_Q,
                                            N_M * N_Q * N_Q, 3 * N_K, 3 * N_K * N_Q, 12 * N_B,
                                            6 * N_B * N_Q};
    mhi_probe common = {.in = {{.n = N_Q}, {.n = N_Q}, {.n = N_Q}}, .data = (void *)c->ops};
    memcpy(common.worker, contexts, sizeof common.worker);
    c->kinematics = c->inverse = c->forward = common;
    c->kinematics.name = "kinematics";
    c->kinematics.call = call_kinematics;
    c->kinematics.n_in = 2;
    c->kinematics.n_out = N_KINEMATICS;
    for (int i = 0; i < N_KINEMATICS; i++) {
        c->kinematics.out[i].n = n[i];
        c->out[i] = MHI_KIT_TAKE(kit, double, n[i]);
    }
    c->inverse.name = "inverse dynamics";
    c->inverse.call = call_inverse;
    c->inverse.n_in = c->inverse.n_out = 3;
    c->inverse.out[0].n = N_Q;
    c->inverse.out[1].n = c->inverse.out[2].n = N_Q * N_Q;
    c->forward.name = "forward dynamics";
    c->forward.call = call_forward;
    c->forward.n_in = 3;
    c->forward.n_out = 1;
    c->forward.out[0].n = N_Q;
}

/* ---- what must hold ---- */

static void check_mass(mhi_kit *kit, const double *mass) {
    double factor[N_Q * N_Q], asymmetry = 0;
    for (int i = 0; i < N_Q; i++) {
        for (int j = 0; j < N_Q; j++) {
            asymmetry = fmax(asymmetry, fabs(mass[i * N_Q + j] - mass[j * N_Q + i]));
        }
    }
    (void)mhi_kit_limit(kit, "mass matrix symmetric", asymmetry, 1e-12);
    memcpy(factor, mass, sizeof factor);
    if (mhi_cholesky_factor(factor, N_Q) == 0) {
        mhi_kit_pass(kit, "mass matrix positive definite");
    } else {
        mhi_kit_fail(kit, "mass matrix positive definite", "it is not");
    }
}

static double largest_difference(const double *a, const double *b, int n) {
    double worst = 0, scale = 1e-300;
    for (int i = 0; i < n; i++) {
        const double off = fabs(a[i] - b[i]);
        worst = off > worst || isnan(off) ? off : worst;
        scale = fmax(scale, fabs(b[i]));
    }
    return worst / scale;
}

/* ID(vdot) = M vdot + bias, and FD undoes ID. */
static void check_dynamics(mhi_kit *kit, model_case *c, const double *const *in) {
    double sum[N_Q], back[N_Q];
    for (int i = 0; i < N_Q; i++) {
        sum[i] = c->out[BIAS][i];
        for (int j = 0; j < N_Q; j++) {
            sum[i] += c->out[MASS][i * N_Q + j] * in[2][j];
        }
    }
    (void)mhi_kit_limit(kit, "tau = M vdot + bias", largest_difference(c->tau, sum, N_Q), 1e-10);
    const double *const forward_in[] = {in[0], in[1], c->tau};
    double *const forward_out[] = {back};
    if (call_forward((void *)c->ops, c->forward.worker[0], NULL, forward_in, forward_out, NULL) !=
        MHE_OK) {
        mhi_kit_fail(kit, "forward dynamics undoes inverse dynamics", "it fails");
        return;
    }
    (void)mhi_kit_limit(kit, "forward dynamics undoes inverse dynamics",
                        largest_difference(back, in[2], N_Q), 1e-9);
    mhi_probe_check(kit, &c->forward, forward_in);
}

/* y = poses of the bodies, moved away from 0 so that what stays 0 is seen no finer than the rest.
 */
typedef struct pose_case {
    const model_case *c;
    const double *v;
} pose_case;

static int poses(void *data, const double *q, double *y) {
    const pose_case *p = data;
    const mhe_kinematics out = {.size = sizeof out, .body = y};
    const mhe_status status =
        p->c->ops->kinematics(p->c->kinematics.worker[0], q, p->v, &out, NULL);
    for (int i = 0; i < 12 * N_B; i++) {
        y[i] += 2;
    }
    return status != MHE_OK;
}

/* Velocities of the bodies as derivatives of their poses: of the origin, and of the rotation R by
 * w x R. */
static void check_bodies(mhi_kit *kit, const model_case *c, const double *const *in) {
    double jacobian[12 * N_B * N_Q];
    for (int b = 0; b < N_B; b++) {
        const double *r = c->out[BODY] + 12 * b + 3, *motion = c->out[BODY_Q] + 6 * b * N_Q;
        for (int j = 0; j < N_Q; j++) {
            double *column = jacobian + 12 * b * N_Q + j;
            for (int k = 0; k < 3; k++) {
                const int next = (k + 1) % 3, last = (k + 2) % 3;
                column[k * N_Q] = motion[(3 + k) * N_Q + j];
                for (int i = 0; i < 3; i++) {
                    column[(3 + 3 * k + i) * N_Q] = motion[next * N_Q + j] * r[3 * last + i] -
                                                    motion[last * N_Q + j] * r[3 * next + i];
                }
            }
        }
    }
    pose_case data = {c, in[1]};
    (void)mhi_kit_limit(kit, "motions of bodies against differences",
                        mhi_jacobian_error(kit, poses, &data, in[0], N_Q, 12 * N_B, jacobian),
                        MHI_JACOBIAN_LIMIT);
}

static void check_pattern(mhi_kit *kit, const model_case *c, const void *self) {
    uint8_t pattern[N_M * N_Q];
    int missed = 0;
    if (c->ops->path_pattern == NULL) {
        return;
    }
    const mhe_status status = c->ops->path_pattern(self, pattern, NULL);
    for (int i = 0; i < N_M * N_Q && status == MHE_OK; i++) {
        missed += c->out[LENGTH_Q][i] != 0 && !pattern[i];
    }
    if (status == MHE_OK && missed == 0) {
        mhi_kit_pass(kit, "paths depend on the coordinates of their pattern alone");
    } else {
        mhi_kit_fail(kit, "paths depend on the coordinates of their pattern alone",
                     "status %d, %d missing", (int)status, missed);
    }
}

static void check_point(mhi_kit *kit, model_case *c, const double *const *in, int first) {
    mhe_error err = {0};
    double *const inverse_out[] = {c->tau, c->tau_q, c->tau_v};
    mhe_status status =
        call_kinematics((void *)c->ops, c->kinematics.worker[0], NULL, in, c->out, &err);
    if (status == MHE_OK) {
        status = call_inverse((void *)c->ops, c->inverse.worker[0], NULL, in, inverse_out, &err);
    }
    if (status != MHE_OK) {
        mhi_kit_fail(kit, "kinematics and inverse dynamics", "status %d: %s", (int)status,
                     err.text);
        return;
    }
    if (first) {
        mhi_probe_check(kit, &c->kinematics, in);
        mhi_probe_check(kit, &c->inverse, in);
    }
    check_mass(kit, c->out[MASS]);
    check_dynamics(kit, c, in);
    const mhi_probe *k = &c->kinematics;
    mhi_probe_jacobian(kit, k, in, 0, LENGTH, c->out[LENGTH_Q], "dL/dq against differences");
    mhi_probe_jacobian(kit, k, in, 0, LENGTH_Q, c->out[LENGTH_QQ], "d2L/dq2 against differences");
    mhi_probe_jacobian(kit, k, in, 0, MARKER, c->out[MARKER_Q], "d marker/dq against differences");
    check_bodies(kit, c, in);
    mhi_probe_jacobian(kit, &c->inverse, in, 0, 0, c->tau_q, "d tau/dq against differences");
    mhi_probe_jacobian(kit, &c->inverse, in, 1, 0, c->tau_v, "d tau/dv against differences");
}

/* MHE_RETRY for a value that is no number, and the context is as good as before. */
static void check_bad_input(mhi_kit *kit, model_case *c, const double *const *in) {
    const double bad[N_Q] = {0.1, NAN, 0.2};
    const double *const bad_in[] = {bad, in[1]};
    void *context = c->kinematics.worker[0];
    mhe_status status = call_kinematics((void *)c->ops, context, NULL, bad_in, c->out, NULL);
    if (status > 0) {
        mhi_kit_pass(kit, "NaN in q is MHE_RETRY");
    } else {
        mhi_kit_fail(kit, "NaN in q is MHE_RETRY", "status %d", (int)status);
    }
    double length[N_M];
    const mhe_kinematics lengths_only = {.size = sizeof lengths_only, .length = length};
    status = call_kinematics((void *)c->ops, context, NULL, in, c->out, NULL);
    status |= c->ops->kinematics(context, in[0], in[1], &lengths_only, NULL);
    if (status == MHE_OK && largest_difference(length, c->out[LENGTH], N_M) <= 1e-14) {
        mhi_kit_pass(kit, "one output alone, after a bad input");
    } else {
        mhi_kit_fail(kit, "one output alone, after a bad input", "status %d or another length",
                     (int)status);
    }
}

static void check_evaluations(mhi_kit *kit, const void *self, void *const *contexts) {
    model_case c = {.ops = kit->plugin->ops};
    make_probes(kit, &c, contexts);
    double q[N_Q], v[N_Q], vdot[N_Q];
    const double *const in[] = {q, v, vdot};
    uint64_t seed = 11;
    for (int turn = 0; turn < 3; turn++) {
        for (int i = 0; i < N_Q; i++) {
            const double reach = i == 1 ? 0.1 : 1.0; /* the slider moves in metres */
            q[i] = mhi_kit_random(&seed, -reach, reach);
            v[i] = mhi_kit_random(&seed, -2.0, 2.0);
            vdot[i] = mhi_kit_random(&seed, -5.0, 5.0);
        }
        check_point(kit, &c, in, turn == 0);
        mhi_check_loads(kit, c.ops, contexts, c.out[BODY], c.out[BODY_Q], in, turn);
    }
    check_pattern(kit, &c, self);
    check_bad_input(kit, &c, in);
}

void mhi_check_model(mhi_kit *kit) {
    const mhe_model_ops *ops = kit->plugin->ops;
    void *self = NULL, *contexts[MHI_WORKERS] = {NULL};
    int n = 0;
    mhe_error err = {0};
    mhe_status status = ops->create(&kit->host, mhi_kit_description(), kit->config, &self, &err);
    if (status == MHE_E_UNSUPPORTED) {
        mhi_kit_skip(kit, "evaluation", "refuses the made-up skeleton: %s", err.text);
        return;
    }
    if (status != MHE_OK) {
        mhi_kit_fail(kit, "create", "status %d: %s", (int)status, err.text);
        return;
    }
    while (n < MHI_WORKERS && status == MHE_OK) {
        status = ops->context_create(self, &contexts[n], &err);
        n += status == MHE_OK;
    }
    if (status == MHE_OK) {
        check_evaluations(kit, self, contexts);
    } else {
        mhi_kit_fail(kit, "contexts", "status %d: %s", (int)status, err.text);
    }
    while (n > 0) {
        ops->context_destroy(contexts[--n]);
    }
    ops->destroy(self);
}

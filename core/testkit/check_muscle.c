/* SPDX-License-Identifier: Apache-2.0 */
/* check_muscle.c: four made-up muscles at points away from the kinks of common curves. */
#include "kit.h"

#include <math.h>
#include <mhe/muscle.h>

#define N_M 4

static mhe_muscle made_up(const char *name, int32_t type, double force, double fiber, double slack,
                          double pennation) {
    mhe_muscle m = mhe_muscle_unstated(name);
    m.type = type;
    m.max_isometric_force = force;
    m.optimal_fiber_length = fiber;
    m.tendon_slack_length = slack;
    m.pennation_angle = pennation;
    return m;
}

typedef struct muscle_case {
    const mhe_muscle_ops *ops;
    void *self;
} muscle_case;

static mhe_status call_force(void *data, void *worker, void *scratch, const double *const *in,
                             double *const *out, mhe_error *err) {
    const muscle_case *c = data;
    (void)worker, (void)scratch;
    const mhe_muscle_force f = {sizeof f, out[0], out[1], out[2], out[3]};
    return c->ops->force(c->self, in[0], in[1], in[2], &f, err);
}

static mhe_status call_rate(void *data, void *worker, void *scratch, const double *const *in,
                            double *const *out, mhe_error *err) {
    const muscle_case *c = data;
    (void)worker, (void)scratch;
    return c->ops->activation_rate(c->self, in[0], in[1], out[0], out[1], out[2], err);
}

/* Muscles do not see each other: derivative number o of the probe, spread on a diagonal, must be
 * the whole Jacobian of output 0 with respect to input i. */
static void check_derivative(mhi_kit *kit, const mhi_probe *probe, const double *const *in,
                             double *const *out, int32_t i, int32_t o, const char *check) {
    double *jacobian = MHI_KIT_TAKE(kit, double, N_M *N_M);
    for (int32_t k = 0; k < N_M; k++) {
        jacobian[k * N_M + k] = out[o][k];
    }
    mhi_probe_jacobian(kit, probe, in, i, 0, jacobian, check);
}

static void check_force(mhi_kit *kit, muscle_case *c, const mhe_muscle *muscles) {
    static const double strain[N_M] = {0.72, 0.91, 1.12, 1.27};  /* fibre length in optimal ones */
    static const double speed[N_M] = {-0.31, -0.07, 0.06, 0.23}; /* m/s */
    static const double level[N_M] = {0.03, 0.35, 0.6, 0.97};
    const mhi_probe probe = {.name = "force",
                             .n_in = 3,
                             .n_out = 4,
                             .in = {{.n = N_M}, {.n = N_M}, {.n = N_M}},
                             .out = {{.n = N_M}, {.n = N_M}, {.n = N_M}, {.n = N_M}},
                             .data = c,
                             .call = call_force};
    double a[N_M], l[N_M], w[N_M], f[N_M], f_a[N_M], f_l[N_M], f_w[N_M];
    const double *const in[] = {a, l, w};
    double *const out[] = {f, f_a, f_l, f_w};
    for (int turn = 0; turn < N_M; turn++) { /* every muscle meets every length, speed and level */
        for (int k = 0; k < N_M; k++) {
            a[k] = level[(k + 2 * turn) % N_M];
            w[k] = speed[(k + 3 * turn + turn / 2) % N_M];
            l[k] = muscles[k].tendon_slack_length + strain[(k + turn) % N_M] *
                                                        muscles[k].optimal_fiber_length *
                                                        cos(muscles[k].pennation_angle);
        }
        mhe_error err = {0};
        const mhe_status status = call_force(c, NULL, NULL, in, out, &err);
        if (status != MHE_OK) {
            mhi_kit_fail(kit, "force", "status %d: %s", (int)status, err.text);
            return;
        }
        if (turn == 0) {
            mhi_probe_check(kit, &probe, in);
        }
        check_derivative(kit, &probe, in, out, 0, 1, "dF/da against differences");
        check_derivative(kit, &probe, in, out, 1, 2, "dF/dl against differences");
        check_derivative(kit, &probe, in, out, 2, 3, "dF/dw against differences");
    }
    /* the derivatives may be left out */
    double alone[N_M];
    double *const forces_only[] = {alone, NULL, NULL, NULL};
    int same = call_force(c, NULL, NULL, in, forces_only, NULL) == MHE_OK;
    for (int k = 0; k < N_M; k++) {
        same &= fabs(alone[k] - f[k]) <= 1e-12 * fabs(f[k]);
    }
    if (same) {
        mhi_kit_pass(kit, "force without derivatives");
    } else {
        mhi_kit_fail(kit, "force without derivatives", "differs from the one with them");
    }
}

static void check_rate(mhi_kit *kit, muscle_case *c) {
    static const double level[N_M] = {0.04, 0.3, 0.66, 0.95};
    const mhi_probe probe = {.name = "activation rate",
                             .n_in = 2,
                             .n_out = 3,
                             .in = {{.n = N_M}, {.n = N_M}},
                             .out = {{.n = N_M}, {.n = N_M}, {.n = N_M}},
                             .data = c,
                             .call = call_rate};
    double e[N_M], a[N_M], rate[N_M], rate_e[N_M], rate_a[N_M];
    const double *const in[] = {e, a};
    double *const out[] = {rate, rate_e, rate_a};
    int toward = 1;
    for (int turn = 1; turn < N_M; turn++) { /* e never equals a */
        for (int k = 0; k < N_M; k++) {
            e[k] = level[k];
            a[k] = level[(k + turn) % N_M];
        }
        mhe_error err = {0};
        const mhe_status status = call_rate(c, NULL, NULL, in, out, &err);
        if (status != MHE_OK) {
            mhi_kit_fail(kit, "activation rate", "status %d: %s", (int)status, err.text);
            return;
        }
        for (int k = 0; k < N_M; k++) {
            toward &= (rate[k] > 0) == (e[k] > a[k]);
        }
        if (turn == 1) {
            mhi_probe_check(kit, &probe, in);
        }
        check_derivative(kit, &probe, in, out, 0, 1, "d rate/de against differences");
        check_derivative(kit, &probe, in, out, 1, 2, "d rate/da against differences");
    }
    if (toward) {
        mhi_kit_pass(kit, "activation moves toward excitation");
    } else {
        mhi_kit_fail(kit, "activation moves toward excitation", "it moves away");
    }
}

void mhi_check_muscle(mhi_kit *kit) {
    const mhe_muscle muscles[N_M] = {
        made_up("unstated", MHE_MUSCLE_UNSTATED, 450.0, 0.11, 0.19, 0.0),
        made_up("hill", MHE_MUSCLE_HILL, 800.0, 0.13, 0.15, 0.2),
        made_up("thelen", MHE_MUSCLE_HILL_THELEN, 990.0, 0.085, 0.06, 0.0),
        made_up("degroote", MHE_MUSCLE_DEGROOTE2016, 620.0, 0.14, 0.14, 0.15)};
    muscle_case c = {.ops = kit->plugin->ops};
    mhe_error err = {0};
    const mhe_status status = c.ops->create(&kit->host, muscles, N_M, kit->config, &c.self, &err);
    if (status == MHE_E_UNSUPPORTED) {
        mhi_kit_skip(kit, "evaluation", "refuses the made-up muscles: %s", err.text);
        return;
    }
    if (status != MHE_OK) {
        mhi_kit_fail(kit, "create", "status %d: %s", (int)status, err.text);
        return;
    }
    mhi_kit_pass(kit, "create");
    check_force(kit, &c, muscles);
    check_rate(kit, &c);
    c.ops->destroy(c.self);
}

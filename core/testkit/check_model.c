/* SPDX-License-Identifier: Apache-2.0 */
/* check_model.c: a made-up skeleton: three bodies on a pin, a slider and a pin whose coordinate
 * also moves the joint along a spline; two muscles, two markers. */
#include "kit.h"

#include "base/cholesky.h"

#include <math.h>
#include <mhe/model.h>
#include <string.h>

#define N_Q 3
#define N_M 2
#define N_K 2

#define IDENTITY \
    { 1, 0, 0, 0, 1, 0, 0, 0, 1 }

static const double zero = 0.0, minus_one = -1.0;
static const double linear[] = {0, 1};
static const double spline[] = {0.01, 0.02, 0.015, -0.008}; /* m over rad */
#define LINEAR \
    { &zero, linear, 1, 2 }

static const mhe_motion upper_motion[] = {{MHE_MOTION_ROTATION, 0, {0, 0, 1}, LINEAR}};
static const mhe_motion slide_motion[] = {{MHE_MOTION_TRANSLATION, 1, {0.6, 0, 0.8}, LINEAR}};
static const mhe_motion lower_motion[] = {
    {MHE_MOTION_ROTATION, 2, {0.36, 0.48, 0.8}, LINEAR},
    {MHE_MOTION_TRANSLATION, 2, {0, 1, 0}, {&minus_one, spline, 1, 4}}};

static const mhe_body bodies[] = {{"upper",
                                   -1,
                                   1,
                                   upper_motion,
                                   IDENTITY,
                                   {0, 0.1, 0},
                                   IDENTITY,
                                   {0, 0, 0},
                                   1.9,
                                   {0.01, -0.15, 0.02},
                                   {0.014, 0.001, 0, 0.001, 0.003, 0, 0, 0, 0.015}},
                                  {"sleeve",
                                   0,
                                   1,
                                   slide_motion,
                                   {0, -1, 0, 1, 0, 0, 0, 0, 1},
                                   {0.02, -0.2, 0},
                                   IDENTITY,
                                   {0.01, 0, 0},
                                   0.4,
                                   {0, 0.02, 0},
                                   {0.001, 0, 0, 0, 0.002, 0, 0, 0, 0.0015}},
                                  {"lower",
                                   1,
                                   2,
                                   lower_motion,
                                   IDENTITY,
                                   {0, -0.1, 0.01},
                                   {0, 0, 1, 1, 0, 0, 0, 1, 0},
                                   {0, 0.01, 0.02},
                                   1.3,
                                   {0.02, -0.12, 0.01},
                                   {0.009, 0, 0.0004, 0, 0.0012, 0, 0.0004, 0, 0.0095}}};

static const mhe_coordinate coordinates[] = {
    {"swing", 1, -3.0, 3.0, 0, 0}, {"slide", 0, -0.2, 0.2, 0, 0}, {"bend", 1, -2.0, 2.0, 0, 0}};
static const mhe_marker markers[N_K] = {{"near", 0, {0.03, -0.1, 0.02}},
                                        {"far", 2, {0.01, -0.25, 0.04}}};
static const mhe_path_point long_path[] = {{.body = -1, .location = {0.05, 0.15, 0.02}},
                                           {.body = 0, .location = {0.04, -0.1, 0.03}},
                                           {.body = 2, .location = {0.03, -0.05, 0.02}}};
static const mhe_path_point short_path[] = {{.body = 0, .location = {-0.03, -0.1, 0.0}},
                                            {.body = 1, .location = {-0.02, -0.05, 0.01}}};

static mhe_muscle made_up(const char *name) {
    mhe_muscle m = mhe_muscle_unstated(name);
    m.max_isometric_force = 500;
    m.optimal_fiber_length = 0.1;
    m.tendon_slack_length = 0.1;
    m.pennation_angle = 0;
    return m;
}

/* ---- probes ---- */

enum { MASS, BIAS, LENGTH, LENGTH_Q, LENGTH_QQ, MARKER, MARKER_Q, N_KINEMATICS };

static mhe_status call_kinematics(void *data, void *context, void *scratch, const double *const *in,
                                  double *const *out, mhe_error *err) {
    (void)scratch;
    const mhe_kinematics k = {sizeof k,      out[MASS],      out[BIAS],   out[LENGTH],
                              out[LENGTH_Q], out[LENGTH_QQ], out[MARKER], out[MARKER_Q]};
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
    static const int32_t n[N_KINEMATICS] = {N_Q * N_Q,       N_Q,     N_M,          N_M * N_Q,
                                            N_M * N_Q * N_Q, 3 * N_K, 3 * N_K * N_Q};
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

static void check_evaluations(mhi_kit *kit, void *const *contexts) {
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
    }
    check_bad_input(kit, &c, in);
}

void mhi_check_model(mhi_kit *kit) {
    const mhe_muscle muscles[N_M] = {made_up("long"), made_up("short")};
    const mhe_path paths[N_M] = {{.name = "long", .n_points = 3, .points = long_path},
                                 {.name = "short", .n_points = 2, .points = short_path}};
    const mhe_description description = {.size = sizeof description,
                                         .name = "made up",
                                         .source = "testkit",
                                         .gravity = {0, -9.81, 0},
                                         .n_bodies = 3,
                                         .n_coordinates = N_Q,
                                         .n_markers = N_K,
                                         .n_muscles = N_M,
                                         .bodies = bodies,
                                         .coordinates = coordinates,
                                         .markers = markers,
                                         .muscles = muscles,
                                         .n_paths = N_M,
                                         .paths = paths};
    const mhe_model_ops *ops = kit->plugin->ops;
    void *self = NULL, *contexts[MHI_WORKERS] = {NULL};
    int n = 0;
    mhe_error err = {0};
    mhe_status status = ops->create(&kit->host, &description, kit->config, &self, &err);
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
        check_evaluations(kit, contexts);
    } else {
        mhi_kit_fail(kit, "contexts", "status %d: %s", (int)status, err.text);
    }
    while (n > 0) {
        ops->context_destroy(contexts[--n]);
    }
    ops->destroy(self);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* check_force.c: forces on the made-up skeleton. */
#include "kit.h"

#include <math.h>
#include <mhe/force.h>
#include <string.h>

#define N_Q MHI_MADE_UP_Q
#define MAX 64 /* inputs, paths, loads */

enum { Q, V, LENGTH, VELOCITY, INPUT, N_IN };
enum { TAU, TAU_Q, TAU_V, TAU_W, TENSION, TENSION_L, TENSION_W, LOAD, LOAD_W, N_OUT };

typedef struct force_case {
    const mhe_force_ops *ops;
    void *self;
    mhe_force_layout layout;
    mhi_probe probe;
} force_case;

static mhe_status call_evaluate(void *data, void *worker, void *scratch, const double *const *in,
                                double *const *out, mhe_error *err) {
    const force_case *c = data;
    const mhe_force_layout *l = &c->layout;
    (void)worker, (void)scratch;
    const mhe_force_point at = {.size = sizeof at,
                                .q = in[Q],
                                .v = in[V],
                                .length = in[LENGTH],
                                .velocity = in[VELOCITY],
                                .input = l->n_inputs > 0 ? in[INPUT] : NULL};
    mhe_force_values values = {.size = sizeof values};
    if (l->generalised) {
        values.tau = out[TAU];
        values.tau_q = out[TAU_Q];
        values.tau_v = out[TAU_V];
        values.tau_w = out[TAU_W];
    }
    if (l->n_paths > 0) {
        values.tension = out[TENSION];
        values.tension_l = out[TENSION_L];
        values.tension_w = out[TENSION_W];
    }
    if (l->n_loads > 0) {
        values.load = out[LOAD];
        values.load_w = out[LOAD_W];
    }
    return c->ops->evaluate(c->self, &at, &values, err);
}

static const char *layout_fault(const mhe_force_layout *l) {
    const mhe_description *d = mhi_kit_description();
    if (l->n_inputs < 0 || l->n_paths < 0 || l->n_loads < 0 || l->n_inputs > MAX ||
        l->n_paths > MAX || l->n_loads > MAX) {
        return "a count is below 0 or above what the made-up skeleton has";
    }
    if ((l->n_inputs > 0 && (l->input_names == NULL || l->input_units == NULL)) ||
        (l->n_paths > 0 && l->paths == NULL) || (l->n_loads > 0 && l->loads == NULL)) {
        return "a count without its list";
    }
    for (int32_t i = 0; i < l->n_paths; i++) {
        if (l->paths[i] < 0 || l->paths[i] >= d->n_paths) {
            return "a path that the description does not have";
        }
    }
    for (int32_t i = 0; i < l->n_loads; i++) {
        if (l->loads[i].body < 0 || l->loads[i].body >= d->n_bodies) {
            return "a load on a body that the description does not have";
        }
    }
    return NULL;
}

static void make_probe(force_case *c) {
    const mhe_force_layout *l = &c->layout;
    const int32_t q = l->generalised ? N_Q : 0, w = l->n_inputs, t = l->n_paths, n = 9 * l->n_loads;
    c->probe = (mhi_probe){.name = "evaluate",
                           .n_in = N_IN,
                           .n_out = N_OUT,
                           .in = {{.n = N_Q}, {.n = N_Q}, {.n = t}, {.n = t}, {.n = w}},
                           .out = {[TAU] = {.n = q},
                                   [TAU_Q] = {.n = q * N_Q},
                                   [TAU_V] = {.n = q * N_Q},
                                   [TAU_W] = {.n = q * w},
                                   [TENSION] = {.n = t},
                                   [TENSION_L] = {.n = t},
                                   [TENSION_W] = {.n = t},
                                   [LOAD] = {.n = n},
                                   [LOAD_W] = {.n = n * w}},
                           .data = c,
                           .call = call_evaluate};
    for (int i = 0; i < N_OUT; i++) {
        c->probe.out[i].zeroed = 1;
    }
}

/* Tensions do not see each other. */
static void check_tension(mhi_kit *kit, const force_case *c, const double *const *in,
                          const double *by, int32_t i, const char *check) {
    const int32_t n = c->layout.n_paths;
    double *jacobian = MHI_KIT_TAKE(kit, double, n *n);
    for (int32_t k = 0; k < n; k++) {
        jacobian[k * n + k] = by[k];
    }
    mhi_probe_jacobian(kit, &c->probe, in, i, TENSION, jacobian, check);
}

static void check_derivatives(mhi_kit *kit, const force_case *c, const double *const *in,
                              double *const *out) {
    const mhe_force_layout *l = &c->layout;
    if (l->generalised) {
        mhi_probe_jacobian(kit, &c->probe, in, Q, TAU, out[TAU_Q], "tau by q against differences");
        mhi_probe_jacobian(kit, &c->probe, in, V, TAU, out[TAU_V], "tau by v against differences");
    }
    if (l->generalised && l->n_inputs > 0) {
        mhi_probe_jacobian(kit, &c->probe, in, INPUT, TAU, out[TAU_W],
                           "tau by inputs against differences");
    }
    if (l->n_paths > 0) {
        check_tension(kit, c, in, out[TENSION_L], LENGTH, "tensions by length");
        check_tension(kit, c, in, out[TENSION_W], VELOCITY, "tensions by velocity");
    }
    if (l->n_loads > 0 && l->n_inputs > 0) {
        mhi_probe_jacobian(kit, &c->probe, in, INPUT, LOAD, out[LOAD_W],
                           "loads by inputs against differences");
    }
}

/* An unknown input must not become a finite force unnoticed. */
static void check_missing(mhi_kit *kit, const force_case *c, const double *const *in,
                          double *const *out) {
    double input[MAX];
    const double *const at[] = {in[Q], in[V], in[LENGTH], in[VELOCITY], input};
    int32_t silent = -1;
    for (int32_t k = 0; k < c->layout.n_inputs; k++) {
        memcpy(input, in[INPUT], sizeof *input * (size_t)c->layout.n_inputs);
        input[k] = NAN;
        double sum = 0;
        const mhe_status status = call_evaluate((void *)c, NULL, NULL, at, out, NULL);
        for (int32_t i = 0; i < c->probe.out[TAU].n; i++) {
            sum += out[TAU][i];
        }
        for (int32_t i = 0; i < c->probe.out[TENSION].n; i++) {
            sum += out[TENSION][i];
        }
        for (int32_t i = 0; i < c->probe.out[LOAD].n; i++) {
            sum += out[LOAD][i];
        }
        silent = status == MHE_OK && isfinite(sum) ? k : silent;
    }
    if (silent < 0) {
        mhi_kit_pass(kit, "NaN in an input is told");
    } else {
        mhi_kit_fail(kit, "NaN in an input is told", "input '%s' NaN, and all forces are finite",
                     c->layout.input_names[silent]);
    }
}

static void check_points(mhi_kit *kit, force_case *c) {
    double q[N_Q], v[N_Q], length[MAX], velocity[MAX], input[MAX], *out[N_OUT];
    const double *const in[] = {q, v, length, velocity, input};
    uint64_t seed = 5;
    for (int i = 0; i < N_OUT; i++) {
        out[i] = MHI_KIT_TAKE(kit, double, c->probe.out[i].n);
    }
    for (int turn = 0; turn < 4; turn++) {
        for (int i = 0; i < N_Q; i++) { /* within and beyond the limits */
            q[i] = mhi_kit_random(&seed, -1.2, 1.2);
            v[i] = mhi_kit_random(&seed, -2, 2);
        }
        for (int i = 0; i < MAX; i++) {
            length[i] = mhi_kit_random(&seed, 0.1, 0.4);
            velocity[i] = mhi_kit_random(&seed, -0.5, 0.5);
            input[i] = mhi_kit_random(&seed, -5, 5);
        }
        mhe_error err = {0};
        for (int i = 0; i < N_OUT; i++) {
            memset(out[i], 0, sizeof *out[i] * (size_t)c->probe.out[i].n);
        }
        const mhe_status status = call_evaluate(c, NULL, NULL, in, out, &err);
        if (status != MHE_OK) {
            mhi_kit_fail(kit, "evaluate", "status %d: %s", (int)status, err.text);
            return;
        }
        if (turn == 0) {
            mhi_probe_check(kit, &c->probe, in);
        }
        check_derivatives(kit, c, in, out);
    }
    check_missing(kit, c, in, out);
}

void mhi_check_force(mhi_kit *kit) {
    force_case c = {.ops = kit->plugin->ops, .layout = {.size = sizeof c.layout}};
    mhe_error err = {0};
    mhe_status status =
        c.ops->create(&kit->host, mhi_kit_description(), kit->config, &c.self, &err);
    if (status == MHE_E_UNSUPPORTED) {
        mhi_kit_skip(kit, "evaluation", "refuses the made-up skeleton: %s", err.text);
        return;
    }
    if (status != MHE_OK) {
        mhi_kit_fail(kit, "create", "status %d: %s", (int)status, err.text);
        return;
    }
    mhi_kit_pass(kit, "create");
    status = c.ops->layout(c.self, &c.layout, &err);
    const char *fault = status == MHE_OK ? layout_fault(&c.layout) : err.text;
    if (fault != NULL) {
        mhi_kit_fail(kit, "layout", "%s", fault);
    } else {
        mhi_kit_pass(kit, "layout");
        make_probe(&c);
        check_points(kit, &c);
    }
    c.ops->destroy(c.self);
}

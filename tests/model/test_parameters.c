/* SPDX-License-Identifier: Apache-2.0 */
/* Derivatives of the arm's dynamics, forces and steps by numbers of its muscles, against the system
 * with other numbers. */
#include "use.h"

#include "io/model_file.h"
#include "model/system.h"
#include "plugin/instance.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const arm = MHE_TEST_SOURCE_DIR "/models/arm19/arm19.osim";
static const char *const names[] = {"max_isometric_force", "optimal_fiber_length",
                                    "tendon_slack_length"};

typedef struct rig {
    mhe_description *d;
    mhi_system *system;
    mhi_system_context *context;
    const mhe_system *face;
    int32_t n_x, n_u, n_p, n_q, n_z;
    double *x, *u, *p; /* a point and the file's parameters */
} rig;

static double *numbers(int32_t n) {
    double *out = calloc((size_t)n + 1, sizeof *out);
    assert_non_null(out);
    return out;
}

static mhe_status open_system(rig *r, const char *muscle_yaml, int32_t formulation,
                              const char *const *parameters, int32_t n, mhe_error *err) {
    const mhe_plugin *model = test_plugin("mhe.model.simbody", MHE_MODEL_IFACE);
    const mhe_plugin *muscle = test_plugin("mhe.muscle.hill", MHE_MUSCLE_IFACE);
    if (model == NULL || muscle == NULL) {
        skip();
    }
    memset(r, 0, sizeof *r);
    if (mhi_model_read(arm, &r->d, err) != MHE_OK) {
        fail_msg("%s", err->text);
    }
    const mhi_system_setup setup = {.host = test_host(),
                                    .description = r->d,
                                    .model = model,
                                    .model_config = test_config(model, ""),
                                    .muscle = muscle,
                                    .muscle_config = test_config(muscle, muscle_yaml),
                                    .formulation = formulation,
                                    .residual_torques = 1,
                                    .parameters = parameters,
                                    .n_parameters = n};
    return mhi_system_create(&setup, &r->system, err);
}

static void open_rig(rig *r, const char *muscle_yaml, int32_t formulation) {
    mhe_error err = {0};
    if (open_system(r, muscle_yaml, formulation, names, 3, &err) != MHE_OK ||
        mhi_system_context_create(r->system, &r->context, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    r->face = mhi_system_face(r->system);
    r->n_x = r->face->n_x;
    r->n_u = r->face->n_u;
    r->n_p = r->face->n_p;
    r->n_q = r->face->n_q;
    r->n_z = r->face->n_z;
    assert_int_equal(r->n_p, 3 * r->face->n_m);
    r->x = numbers(r->n_x);
    r->u = numbers(r->n_u);
    r->p = numbers(r->n_p);
    mhi_system_parameters(r->system, r->p);
    uint64_t seed = 8;
    double activation[64];
    for (int32_t i = 0; i < r->n_q; i++) {
        r->x[i] = test_random(&seed, -0.4, 0.4);
        r->x[r->n_q + i] = test_random(&seed, -1, 1);
    }
    for (int32_t i = 0; i < r->face->n_m; i++) {
        activation[i] = test_random(&seed, 0.1, 0.6);
        r->u[i] = test_random(&seed, 0.1, 0.6);
    }
    if (mhi_system_equilibrium(r->context, r->x, r->x + r->n_q, activation, r->x, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
}

static void close_rig(rig *r) {
    mhi_system_context_free(r->context);
    mhi_system_free(r->system);
    mhi_description_free(r->d);
    free(r->x);
    free(r->u);
    free(r->p);
}

/* Parameters are differenced in this part of their own size, so that one step fits all and no
 * tendon becomes one that is taken as rigid. */
#define PART 0.02

static int set(rig *r, const double *scaled) {
    double *p = numbers(r->n_p);
    for (int32_t i = 0; i < r->n_p; i++) {
        p[i] = (1 + PART * (scaled[i] - 1)) * r->p[i];
    }
    const int failed = mhi_system_set_parameters(r->system, p, NULL) != MHE_OK;
    free(p);
    return failed;
}

static void scale_columns(const rig *r, double *jacobian, int32_t rows) {
    for (int32_t i = 0; i < rows * r->n_p; i++) {
        jacobian[i] *= PART * r->p[i % r->n_p];
    }
}

static double *ones(int32_t n) {
    double *out = numbers(n);
    for (int32_t i = 0; i < n; i++) {
        out[i] = 1;
    }
    return out;
}

/* y = [vdot; zdot; forces; moments] */
static int outputs(void *data, const double *scaled, double *y) {
    rig *r = data;
    mhe_system_point at;
    mhi_muscle_state muscles;
    const mhe_acceleration out = {.size = sizeof out, .vdot = y, .zdot = y + r->n_q};
    mhi_system_point(r->system, r->x, r->u, NULL, &at);
    if (set(r, scaled) != 0 ||
        r->face->acceleration(r->face, r->context, &at, &out, NULL) != MHE_OK ||
        mhi_system_muscles(r->context, &at, 0, &muscles, NULL) != MHE_OK) {
        return -1;
    }
    y += r->n_q + r->n_z;
    memcpy(y, muscles.force, sizeof *y * (size_t)r->face->n_m);
    memcpy(y + r->face->n_m, muscles.moment, sizeof *y * (size_t)r->n_q);
    return 0;
}

static void check_outputs(const char *muscle_yaml, int32_t formulation) {
    rig r;
    open_rig(&r, muscle_yaml, formulation);
    const int32_t n_q = r.n_q, n_z = r.n_z, n_m = r.face->n_m, n_p = r.n_p;
    const int32_t rows = n_q + n_z + n_m + n_q;
    double *jacobian = numbers(rows * n_p), *vdot = numbers(n_q), *zdot = numbers(n_z);
    double *all = ones(n_p);
    mhe_system_point at;
    mhi_muscle_state muscles;
    const mhe_acceleration out = {.size = sizeof out,
                                  .vdot = vdot,
                                  .zdot = zdot,
                                  .vdot_p = jacobian,
                                  .zdot_p = jacobian + n_q * n_p};
    mhi_system_point(r.system, r.x, r.u, NULL, &at);
    assert_int_equal(r.face->acceleration(r.face, r.context, &at, &out, NULL), MHE_OK);
    assert_int_equal(mhi_system_muscles(r.context, &at, 1, &muscles, NULL), MHE_OK);
    double *force = jacobian + (n_q + n_z) * n_p, *moment = force + n_m * n_p;
    for (int32_t i = 0; i < n_p; i++) {
        force[(i % n_m) * n_p + i] = muscles.force_p[i];
    }
    memcpy(moment, muscles.moment_p, sizeof *moment * (size_t)(n_q * n_p));
    scale_columns(&r, jacobian, rows);
    const double error = test_jacobian_error(outputs, &r, all, n_p, rows, jacobian);
    print_message("%s: %.1e\n", muscle_yaml, error);
    assert_true(error >= 0 && error < 1e-6);
    free(all);
    free(vdot);
    free(zdot);
    free(jacobian);
    close_rig(&r);
}

static void outputs_match_differences(void **state) {
    (void)state;
    check_outputs("curves: degroote2016", MHE_FORMULATION_EXCITATION);
    check_outputs("curves: paper2021", MHE_FORMULATION_EXCITATION);
    check_outputs("{curves: paper2021, passive_ramp: 0.3}", MHE_FORMULATION_ACTIVATION);
    check_outputs("curves: biorbd", MHE_FORMULATION_EXCITATION);
    check_outputs("curves: thelen2003", MHE_FORMULATION_ACTIVATION);
    check_outputs("{curves: millard2012, tendon: elastic, damping: 0.1}",
                  MHE_FORMULATION_EXCITATION);
    check_outputs("{curves: degroote2016, tendon: elastic, damping: 0.1}",
                  MHE_FORMULATION_ACTIVATION);
}

typedef struct stepper {
    rig *r;
    const mhe_integrator_ops *ops;
    void *context;
} stepper;

static int step(void *data, const double *scaled, double *next) {
    stepper *s = data;
    if (set(s->r, scaled) != 0) {
        return -1;
    }
    return s->ops->step(s->context, s->r->x, s->r->u, NULL, 0.01, NULL, next, NULL, NULL);
}

static void check_steps(const char *id, const char *yaml, const char *muscle_yaml, double limit) {
    rig r;
    void *self = NULL, *context = NULL;
    mhe_error err = {0};
    const mhe_plugin *plugin = test_plugin(id, MHE_INTEGRATOR_IFACE);
    if (plugin == NULL) {
        return;
    }
    open_rig(&r, muscle_yaml, MHE_FORMULATION_EXCITATION);
    const mhe_integrator_ops *ops = plugin->ops;
    if (mhi_integrator_create(plugin, test_host(), r.face, test_config(plugin, yaml), &self,
                              &err) != MHE_OK ||
        ops->context_create(self, r.context, &context, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    double *next = numbers(r.n_x), *A = numbers(r.n_x * r.n_x), *B = numbers(r.n_x * r.n_u);
    double *P = numbers(r.n_x * r.n_p), *all = ones(r.n_p);
    const mhe_step_derivatives out = {sizeof out, A, B, P};
    stepper s = {&r, ops, context};
    assert_int_equal(ops->step(context, r.x, r.u, NULL, 0.01, NULL, next, &out, &err), MHE_OK);
    scale_columns(&r, P, r.n_x);
    const double error = test_jacobian_error(step, &s, all, r.n_p, r.n_x, P);
    print_message("%s, %s: %.1e\n", id, muscle_yaml, error);
    assert_true(error >= 0 && error < limit);
    free(next);
    free(A);
    free(B);
    free(P);
    free(all);
    ops->context_destroy(context);
    ops->destroy(self);
    close_rig(&r);
}

static void steps_match_differences(void **state) {
    (void)state;
    const char *rigid = "curves: degroote2016";
    const char *elastic = "{curves: degroote2016, tendon: elastic, damping: 0.1}";
    check_steps("mhe.integrator.rk", "{newton_tolerance: 1e-13}", rigid, 1e-5);
    check_steps("mhe.integrator.rk", "{newton_tolerance: 1e-13}", elastic, 1e-5);
    /* CVODES chooses its own steps, so that differences see its tolerance */
    check_steps("mhe.integrator.sundials", "{rtol: 1e-12, atol: 1e-14}", rigid, 1e-3);
}

static void what_is_refused(void **state) {
    (void)state;
    static const char *const unknown[] = {"max_isometric_forse"}, *const of_rate[] = {
                                                                      "activation_time"};
    rig r;
    mhe_error err = {0};
    assert_int_equal(open_system(&r, "", MHE_FORMULATION_EXCITATION, unknown, 1, &err),
                     MHE_E_CONFIG);
    assert_non_null(strstr(err.text, "did you mean 'max_isometric_force'?"));
    mhi_description_free(r.d);
    assert_int_equal(open_system(&r, "", MHE_FORMULATION_EXCITATION, of_rate, 1, &err),
                     MHE_E_CONFIG);
    mhi_description_free(r.d);
    open_rig(&r, "", MHE_FORMULATION_EXCITATION);
    double *before = numbers(r.n_p), *after = numbers(r.n_p);
    memcpy(before, r.p, sizeof *before * (size_t)r.n_p);
    r.p[3] = -1;
    assert_int_equal(mhi_system_set_parameters(r.system, r.p, &err), MHE_E_INPUT);
    mhi_system_parameters(r.system, after); /* the old ones hold on */
    assert_memory_equal(before, after, sizeof *before * (size_t)r.n_p);
    free(before);
    free(after);
    close_rig(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(outputs_match_differences),
                                       cmocka_unit_test(steps_match_differences),
                                       cmocka_unit_test(what_is_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

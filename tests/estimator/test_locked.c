/* SPDX-License-Identifier: Apache-2.0 */
/* Locked coordinates: the rest moves as in the whole model, and mistakes are named. */
#include "fixture.h"
#include "model/system.h"
#include "support.h"

#include <math.h>
#include <string.h>

#define HEAD "model:\n  file: $ARM19\n"
#define COSTS "costs: [mhe.cost.emg-markers-high]\n"
#define N_K 8
#define N_M 19

static void open_config(test_fixture *f, const char *config) {
    if (test_fixture_open(f, config) != MHE_OK) {
        fail_msg("%s", f->err.text);
    }
}

/* Markers and muscle forces of a configuration. */
static void measure(test_fixture *f, const double *q, const double *v, double *markers,
                    double *force) {
    double a[N_M];
    mhi_muscle_state muscles;
    mhi_system_context *context = mhi_ocp_context(f->ocp);
    for (int32_t i = 0; i < N_M; i++) {
        a[i] = 0.3;
    }
    assert_int_equal(mhi_system_markers(context, q, markers, NULL, &f->err), MHE_OK);
    const mhe_system_point at = {.size = sizeof at, .q = q, .v = v, .a = a};
    assert_int_equal(mhi_system_muscles(context, &at, 0, &muscles, &f->err), MHE_OK);
    memcpy(force, muscles.force, sizeof(double) * N_M);
}

/* `config` locks the second coordinate: at `value`, it is the whole arm there. */
static void expect_arm_at(const char *config, double value) {
    const double q[4] = {-0.1, value, -0.1, 0.4}, v[4] = {1, 0, -2, 3};
    const double q_free[3] = {q[0], q[2], q[3]}, v_free[3] = {v[0], v[2], v[3]};
    double markers[2][3 * N_K], force[2][N_M];
    test_fixture whole, locked;
    open_config(&whole, HEAD COSTS);
    open_config(&locked, config);
    const mhe_description *d = mhi_system_description(locked.system);
    assert_int_equal(d->n_coordinates, 3);
    assert_string_equal(d->coordinates[0].name, "Arm_RotY");
    assert_string_equal(d->coordinates[1].name, "Arm_RotY2");
    measure(&whole, q, v, markers[0], force[0]);
    measure(&locked, q_free, v_free, markers[1], force[1]);
    for (int32_t i = 0; i < 3 * N_K; i++) {
        assert_true(fabs(markers[0][i] - markers[1][i]) < 1e-12);
    }
    for (int32_t i = 0; i < N_M; i++) {
        assert_true(fabs(force[0][i] - force[1][i]) < 1e-9 * (1 + fabs(force[0][i])));
    }
    test_fixture_close(&whole);
    test_fixture_close(&locked);
}

static void the_rest_moves_as_before(void **state) {
    (void)state;
    test_fixture f;
    open_config(&f, HEAD COSTS);
    const double value = mhi_system_description(f.system)->coordinates[1].value;
    test_fixture_close(&f);
    expect_arm_at(HEAD "  locked: [Arm_RotX]\n" COSTS, value);
    expect_arm_at(HEAD "  locked_at: {Arm_RotX: -0.3}\n" COSTS, -0.3);
    expect_arm_at(HEAD "  locked: [Arm_RotX]\n  locked_at: {Arm_RotX: -0.3}\n" COSTS, -0.3);
}

static void check_refused(const char *config, const char *text) {
    test_fixture f;
    assert_int_equal(test_fixture_open(&f, config), MHE_E_CONFIG);
    if (strstr(f.err.text, text) == NULL) {
        fail_msg("'%s' is not in: %s", text, f.err.text);
    }
    test_fixture_close(&f);
}

static void mistakes_are_named(void **state) {
    (void)state;
    check_refused(HEAD "  locked: [Arm_Rotx]\n" COSTS,
                  "model.locked: the model has no free coordinate 'Arm_Rotx' (did you mean "
                  "'Arm_RotX'?)");
    check_refused(HEAD "  locked_at: {LowerArm_RotZ: 0}\n" COSTS,
                  "model.locked_at: the model has no free coordinate 'LowerArm_RotZ' (did you mean "
                  "'LowerArm1_RotZ'?)");
    check_refused(HEAD "  locked_at: {Arm_RotX: bent}\n" COSTS,
                  "model.locked_at: 'bent' of 'Arm_RotX' is not a number");
    check_refused(HEAD "  locked_at: {Arm_RotX: 40}\n" COSTS,
                  "model.locked_at: 40 of 'Arm_RotX' is outside of its range");
    check_refused(HEAD "  locked: [Arm_RotY, Arm_RotX, Arm_RotY2, LowerArm1_RotZ]\n" COSTS,
                  "model.locked: no coordinate is left to move");
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(the_rest_moves_as_before),
                                       cmocka_unit_test(mistakes_are_named)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

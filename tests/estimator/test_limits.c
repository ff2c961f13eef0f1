/* SPDX-License-Identifier: Apache-2.0 */
/* Residual torques by coordinate: which may be how large, and what is refused. */
#include "estimator/estimator_private.h"
#include "fixture.h"
#include "support.h"

#include <string.h>

#define HEAD                                                                                   \
    "model: {file: $ARM19}\ncosts: [mhe.cost.emg-markers-high]\nbounds:\n  residual_torques: " \
    "true\n"

static void expect_limits(const char *config, const double expected[4]) {
    test_fixture f;
    assert_int_equal(test_fixture_open(&f, config), MHE_OK);
    const mhe_block *torque =
        mhe_layout_find(mhi_system_face(f.system)->layout, MHE_ROLE_CONTROL, "residual_torque");
    assert_non_null(torque);
    for (int i = 0; i < 4; i++) {
        assert_true(torque->upper[i] == expected[i] && torque->lower[i] == -expected[i]);
    }
    test_fixture_close(&f);
}

static void limits_follow_the_config(void **state) {
    (void)state;
    expect_limits(HEAD, (const double[]){100, 100, 100, 100});
    expect_limits(HEAD "  residual_torque_max: 30\n"
                       "  residual_torque_at: [Arm_RotX, LowerArm1_RotZ]\n",
                  (const double[]){0, 30, 0, 30});
    expect_limits(HEAD "  residual_torque_at: [Arm_RotX]\n"
                       "  residual_torque_limits: {Arm_RotX: 7.5, Arm_RotY2: 2}\n",
                  (const double[]){0, 7.5, 2, 0});
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
    check_refused(HEAD "  residual_torque_at: [Arm_RotXX]\n",
                  "bounds.residual_torque_at: the model has no coordinate 'Arm_RotXX' (did you "
                  "mean 'Arm_RotX'?)");
    check_refused(HEAD "  residual_torque_limits: {Arm: 3}\n",
                  "bounds.residual_torque_limits: the model has no coordinate 'Arm'");
    check_refused(HEAD "  residual_torque_limits: {Arm_RotX: much}\n",
                  "'much' of 'Arm_RotX' is not a number of at least 0");
    check_refused(HEAD "  residual_torque_limits: {Arm_RotX: -1}\n",
                  "'-1' of 'Arm_RotX' is not a number of at least 0");
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(limits_follow_the_config),
                                       cmocka_unit_test(mistakes_are_named)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* Terms and weights of the least-excitation cost. */
#include "cost_rig.h"

#include <math.h>

#define ID "mhe.cost.min-excitation"

/* The table of the paper; EMG plays no part. */
static void test_defaults(void **state) {
    (void)state;
    cost_rig rig;
    assert_int_equal(cost_rig_open(&rig, ID, "", MHE_FORMULATION_EXCITATION, COST_RIG_TORQUES),
                     MHE_OK);
    cost_rig_evaluate(&rig);
    cost_rig_expect(&rig, "markers", 0, 1e7, 1);
    cost_rig_expect(&rig, "excitation", 0, 1e4, 0);
    cost_rig_expect(&rig, "q", 0, 1, 0);
    cost_rig_expect(&rig, "qdot", 0, 10, 0);
    cost_rig_expect(&rig, "activation", 0, 1, 0);
    cost_rig_expect(&rig, "residual_torque", 0, 1e7, 0);
    assert_int_equal(rig.layout.n_res, 6 + 3 + 2 + 2 + 3 + 2);
    int excitation = cost_rig_at(&rig, "excitation", 0);
    rig.y_ref[excitation] = NAN;
    cost_rig_evaluate(&rig);
    cost_rig_expect(&rig, "excitation", 0, 1e4, 0);
    cost_rig_close(&rig);
}

static void test_activation_driven(void **state) {
    (void)state;
    cost_rig rig;
    assert_int_equal(cost_rig_open(&rig, ID, "markers: 1e6", MHE_FORMULATION_ACTIVATION, 0),
                     MHE_OK);
    cost_rig_evaluate(&rig);
    cost_rig_expect(&rig, "markers", 0, 1e6, 1);
    cost_rig_expect(&rig, "activation", 0, 1e4, 0);
    assert_int_equal(cost_rig_at(&rig, "activation", 1), -1);
    assert_int_equal(rig.layout.n_res, 6 + 3 + 2 + 2);
    cost_rig_close(&rig);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_defaults),
        cmocka_unit_test(test_activation_driven),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

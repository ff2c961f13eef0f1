/* SPDX-License-Identifier: Apache-2.0 */
/* Terms, weights, missing data and partial EMG of the two EMG-markers costs. */
#include "cost_rig.h"

#include <math.h>
#include <string.h>

#define HIGH "mhe.cost.emg-markers-high"
#define LOW "mhe.cost.emg-markers-low"

/* The table of the paper. */
static void test_defaults(void **state) {
    (void)state;
    const struct {
        const char *id;
        double markers;
    } costs[] = {{HIGH, 1e9}, {LOW, 1e7}};
    for (int i = 0; i < 2; i++) {
        cost_rig rig;
        assert_int_equal(
            cost_rig_open(&rig, costs[i].id, "", MHE_FORMULATION_EXCITATION, COST_RIG_TORQUES),
            MHE_OK);
        cost_rig_evaluate(&rig);
        cost_rig_expect(&rig, "markers", 0, costs[i].markers, 1);
        cost_rig_expect(&rig, "excitation", 0, 1e6, 1);
        cost_rig_expect(&rig, "q", 0, 1, 0);
        cost_rig_expect(&rig, "qdot", 0, 10, 0);
        cost_rig_expect(&rig, "activation", 0, 1, 0);
        cost_rig_expect(&rig, "residual_torque", 0, 1e8, 0);
        assert_int_equal(rig.layout.n_res, 6 + 3 + 2 + 2 + 3 + 2);
        cost_rig_close(&rig);
    }
}

/* Activations are the controls: they track EMG and have no term of their own. */
static void test_activation_driven(void **state) {
    (void)state;
    cost_rig rig;
    assert_int_equal(cost_rig_open(&rig, HIGH, "", MHE_FORMULATION_ACTIVATION, 0), MHE_OK);
    cost_rig_evaluate(&rig);
    cost_rig_expect(&rig, "activation", 0, 1e6, 1);
    assert_int_equal(cost_rig_at(&rig, "activation", 1), -1);
    assert_int_equal(cost_rig_at(&rig, "residual_torque", 0), -1);
    assert_int_equal(rig.layout.n_res, 6 + 3 + 2 + 2);
    cost_rig_close(&rig);
}

/* A gap drops out of tracking, and only there; a control without value at the last node too. */
static void test_missing(void **state) {
    (void)state;
    cost_rig rig;
    assert_int_equal(cost_rig_open(&rig, HIGH, "", MHE_FORMULATION_EXCITATION, 0), MHE_OK);
    int markers = cost_rig_at(&rig, "markers", 0), q = cost_rig_at(&rig, "q", 0);
    int excitation = cost_rig_at(&rig, "excitation", 0);
    rig.y_ref[markers + 4] = NAN;
    rig.y_ref[q] = NAN; /* nobody measures it */
    rig.y[excitation + 1] = NAN;
    assert_int_equal(rig.ops->residual(rig.self, &rig.stage, rig.r, &rig.err), MHE_OK);
    for (int i = 0; i < rig.layout.n_res; i++) {
        assert_int_equal(isnan(rig.r[i]), i == markers + 4 || i == excitation + 1);
    }
    cost_rig_close(&rig);
}

static void test_partial_emg(void **state) {
    (void)state;
    for (int formulation = 0; formulation < 2; formulation++) {
        const char *control =
            formulation == MHE_FORMULATION_EXCITATION ? "excitation" : "activation";
        cost_rig rig;
        assert_int_equal(cost_rig_open(&rig, LOW, "tracked: [Deltoid, Biceps]", formulation, 0),
                         MHE_OK);
        int at = cost_rig_at(&rig, control, 0);
        rig.y_ref[at + 1] = NAN; /* Triceps: no EMG, and no need of any */
        cost_rig_evaluate(&rig);
        assert_true(fabs(rig.r[at] - 1e3 * (rig.y[at] - rig.y_ref[at])) < 1e-9);
        assert_true(rig.r[at + 1] == 0 && rig.J[at + 1] == 0);
        assert_true(fabs(rig.r[at + 2] - 1e3 * (rig.y[at + 2] - rig.y_ref[at + 2])) < 1e-9);
        cost_rig_expect(&rig, control, 1, 1e4, 0);
        cost_rig_close(&rig);

        const char *all = "tracked: [Deltoid, Biceps, Triceps, Biceps]";
        assert_int_equal(cost_rig_open(&rig, LOW, all, formulation, 0), MHE_OK);
        cost_rig_evaluate(&rig);
        cost_rig_expect(&rig, control, 0, 1e6, 1);
        assert_int_equal(rig.layout.n_res, formulation == MHE_FORMULATION_EXCITATION
                                               ? 6 + 3 + 2 + 2 + 3
                                               : 6 + 3 + 2 + 2);
        cost_rig_close(&rig);
    }
}

static void test_weights(void **state) {
    (void)state;
    cost_rig rig;
    const char *yaml = "{markers: 4, emg: 0, q: 0, qdot: 9, activation: 16, residual_torque: 25}";
    assert_int_equal(cost_rig_open(&rig, HIGH, yaml, MHE_FORMULATION_EXCITATION, COST_RIG_TORQUES),
                     MHE_OK);
    cost_rig_evaluate(&rig);
    cost_rig_expect(&rig, "markers", 0, 4, 1);
    cost_rig_expect(&rig, "qdot", 0, 9, 0);
    cost_rig_expect(&rig, "activation", 0, 16, 0);
    cost_rig_expect(&rig, "residual_torque", 0, 25, 0);
    assert_int_equal(cost_rig_at(&rig, "excitation", 0), -1); /* weight 0 drops a term */
    assert_int_equal(cost_rig_at(&rig, "q", 0), -1);
    cost_rig_close(&rig);
}

static void test_refused(void **state) {
    (void)state;
    cost_rig rig;
    assert_int_equal(
        cost_rig_open(&rig, HIGH, "tracked: [Biceps, triceps]", MHE_FORMULATION_EXCITATION, 0),
        MHE_E_CONFIG);
    assert_string_equal(rig.err.text,
                        "tracked: 'excitation' has no entry 'triceps' (it has Biceps, Triceps, "
                        "Deltoid)");
    const char *nothing = "{markers: 0, emg: 0, q: 0, qdot: 0, activation: 0}";
    assert_int_equal(cost_rig_open(&rig, HIGH, nothing, MHE_FORMULATION_EXCITATION, 0),
                     MHE_E_CONFIG);
    assert_string_equal(rig.err.text, "every weight is 0");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_defaults), cmocka_unit_test(test_activation_driven),
        cmocka_unit_test(test_missing),  cmocka_unit_test(test_partial_emg),
        cmocka_unit_test(test_weights),  cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* The noise that mhe.cost.emg-markers takes measurements to have: every sigma, and what becomes of
 * what is missing. */
#include "cost_rig.h"

#include <math.h>
#include <string.h>

#define ID "mhe.cost.emg-markers"

static void open_rig(cost_rig *rig, const char *yaml, int32_t formulation, int32_t flags) {
    const mhe_status status = cost_rig_open(rig, ID, yaml, formulation, flags);
    if (status != MHE_OK) {
        fail_msg("%s", rig->err.text);
    }
}

/* The largest of floor, share of the value and share of the spread is EMG's sigma. */
static void the_largest_share_counts(void **state) {
    (void)state;
    cost_rig rig;
    double spread[COST_RIG_ROWS] = {0};
    open_rig(&rig, "{markers: 0.002, emg_spread: 0.5, emg_value: 0.25, emg_floor: 0.03}",
             MHE_FORMULATION_EXCITATION, COST_RIG_TORQUES);
    const int at = cost_rig_at(&rig, "excitation", 0);
    rig.y_ref[at] = 0.1;     /* floor */
    rig.y_ref[at + 1] = 0.6; /* value */
    rig.y_ref[at + 2] = 0.1; /* spread */
    spread[at] = 0.01;
    spread[at + 1] = 0.2;
    spread[at + 2] = 0.4;
    rig.stage.y_spread = spread;
    cost_rig_evaluate(&rig);
    const double sigma[] = {0.03, 0.15, 0.2};
    for (int i = 0; i < 3; i++) {
        assert_true(fabs(rig.r[at + i] * sigma[i] - (rig.y[at + i] - rig.y_ref[at + i])) < 1e-12);
    }
    spread[at + 2] = NAN; /* nothing known of it yet */
    cost_rig_evaluate(&rig);
    assert_true(fabs(rig.J[at + 2] - 1 / 0.03) < 1e-9);
    rig.stage.y_spread = NULL;
    cost_rig_evaluate(&rig);
    assert_true(fabs(rig.J[at + 2] - 1 / 0.03) < 1e-9);
    cost_rig_expect(&rig, "markers", 0, 1 / (0.002 * 0.002), 1);
    cost_rig_close(&rig);
}

/* Markers: the least, or a share of how far they were off so far. */
static void markers_follow_their_misfit(void **state) {
    (void)state;
    cost_rig rig;
    double misfit[COST_RIG_ROWS] = {0};
    open_rig(&rig, "{markers: 0.002, markers_misfit: 0.5}", MHE_FORMULATION_EXCITATION, 0);
    const int at = cost_rig_at(&rig, "markers", 0), speeds = cost_rig_at(&rig, "qdot", 0);
    misfit[speeds] = NAN;
    const double known[] = {0.001, 0.02, NAN}, sigma[] = {0.002, 0.01, 0.002};
    memcpy(misfit + at, known, sizeof known);
    rig.stage.y_spread = misfit;
    cost_rig_evaluate(&rig);
    for (int i = 0; i < 3; i++) {
        assert_true(fabs(rig.J[at + i] * sigma[i] - 1) < 1e-12);
    }
    cost_rig_close(&rig);
}

/* Velocities that were measured are followed, and markers then held by how far they are off their
 * postures; a gap in them is like none. */
static void measured_velocities_are_followed(void **state) {
    (void)state;
    cost_rig rig;
    double spread[COST_RIG_ROWS] = {0};
    open_rig(&rig,
             "{markers: 0.002, markers_misfit: 0.5, markers_offset: 3, rates: 0.1, qdot: "
             "4}",
             MHE_FORMULATION_EXCITATION, 0);
    const int markers = cost_rig_at(&rig, "markers", 0), speeds = cost_rig_at(&rig, "qdot", 0);
    spread[markers] = 0.01;
    spread[speeds] = 0.7;
    rig.stage.y_spread = spread;
    rig.y_ref[speeds] = 0.3;
    rig.y_ref[speeds + 1] = NAN;
    cost_rig_evaluate(&rig);
    assert_true(fabs(rig.J[markers] * 0.03 - 1) < 1e-12);
    assert_true(fabs(rig.r[speeds] * 0.1 - (rig.y[speeds] - 0.3)) < 1e-12);
    assert_true(fabs(rig.r[speeds + 1] * 4 - rig.y[speeds + 1]) < 1e-12);
    spread[speeds] = NAN; /* none were measured */
    cost_rig_evaluate(&rig);
    assert_true(fabs(rig.J[markers] * 0.005 - 1) < 1e-12);
    cost_rig_close(&rig);
}

static void what_is_not_measured_is_held_loosely(void **state) {
    (void)state;
    cost_rig rig;
    open_rig(&rig,
             "{tracked: [Deltoid, Biceps], untracked: 0.5, residual_torque: 0.25, qdot: 4, "
             "emg_spread: 0}",
             MHE_FORMULATION_EXCITATION, COST_RIG_TORQUES);
    const int at = cost_rig_at(&rig, "excitation", 0), markers = cost_rig_at(&rig, "markers", 0);
    rig.y_ref[at] = NAN; /* Biceps: a gap */
    for (int i = 0; i < 2; i++) {
        rig.y_ref[cost_rig_at(&rig, "qdot", 0) + i] = NAN;
    }
    cost_rig_evaluate(&rig);
    assert_true(fabs(rig.r[at] - rig.y[at] / 0.5) < 1e-12);
    assert_true(fabs(rig.r[at + 1] - rig.y[at + 1] / 0.5) < 1e-12); /* Triceps: no electrode */
    assert_true(rig.J[at + 2] > 10);
    cost_rig_expect(&rig, "residual_torque", 0, 16, 0);
    cost_rig_expect(&rig, "qdot", 0, 1.0 / 16, 0);
    rig.y_ref[markers + 1] = NAN; /* drops out */
    assert_int_equal(rig.ops->residual(rig.self, &rig.stage, rig.r, &rig.err), MHE_OK);
    assert_true(isnan(rig.r[markers + 1]) && !isnan(rig.r[markers]));
    assert_int_equal(rig.layout.n_res, 6 + 3 + 2 + 2);
    cost_rig_close(&rig);
}

static void activations_are_controls(void **state) {
    (void)state;
    cost_rig rig;
    open_rig(&rig, "", MHE_FORMULATION_ACTIVATION, 0);
    cost_rig_evaluate(&rig);
    assert_true(cost_rig_at(&rig, "activation", 0) >= 0);
    assert_int_equal(cost_rig_at(&rig, "residual_torque", 0), -1);
    assert_int_equal(rig.layout.n_res, 6 + 3 + 2);
    cost_rig_close(&rig);
}

static void a_muscle_that_is_none_is_refused(void **state) {
    (void)state;
    cost_rig rig;
    assert_int_equal(cost_rig_open(&rig, ID, "tracked: [triceps]", MHE_FORMULATION_EXCITATION, 0),
                     MHE_E_CONFIG);
    assert_string_equal(rig.err.text,
                        "tracked: 'excitation' has no entry 'triceps' (it has Biceps, Triceps, "
                        "Deltoid)");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_largest_share_counts),
        cmocka_unit_test(markers_follow_their_misfit),
        cmocka_unit_test(measured_velocities_are_followed),
        cmocka_unit_test(what_is_not_measured_is_held_loosely),
        cmocka_unit_test(activations_are_controls),
        cmocka_unit_test(a_muscle_that_is_none_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

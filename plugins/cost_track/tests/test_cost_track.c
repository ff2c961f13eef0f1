/* SPDX-License-Identifier: Apache-2.0 */
/* What is tracked, where to, of whom and at which nodes. */
#include "cost_rig.h"

#include <math.h>
#include <string.h>

#define TRACK "mhe.cost.track"

static void open_rig(cost_rig *rig, const char *yaml) {
    assert_int_equal(cost_rig_open(rig, TRACK, yaml, MHE_FORMULATION_EXCITATION, 0), MHE_OK);
}

static void test_follows_the_target(void **state) {
    (void)state;
    cost_rig rig;
    open_rig(&rig, "{signal: q}");
    cost_rig_evaluate(&rig);
    cost_rig_expect(&rig, "q", 0, 1, 1);
    rig.y_ref[1] = NAN; /* a gap, and only there */
    assert_int_equal(rig.ops->residual(rig.self, &rig.stage, rig.r, &rig.err), MHE_OK);
    assert_true(!isnan(rig.r[0]) && isnan(rig.r[1]));
    cost_rig_close(&rig);
}

static void test_constant(void **state) {
    (void)state;
    static const double values[] = {0.1, 0.2, 0.3};
    cost_rig rig;
    open_rig(&rig, "{signal: excitation, value: [0.1, 0.2, 0.3]}");
    rig.y_ref[0] = NAN; /* no target is needed */
    cost_rig_evaluate(&rig);
    for (int i = 0; i < 3; i++) {
        assert_true(fabs(rig.r[i] - (rig.y[i] - values[i])) < 1e-15);
    }
    cost_rig_close(&rig);
    open_rig(&rig, "{signal: qdot, value: [0]}");
    cost_rig_evaluate(&rig);
    cost_rig_expect(&rig, "qdot", 0, 1, 0);
    cost_rig_close(&rig);
}

static void test_of_some(void **state) {
    (void)state;
    cost_rig rig;
    open_rig(&rig, "{signal: muscle_force, of: [Deltoid, Biceps]}");
    rig.y_ref[1] = NAN; /* Triceps: no target, and no need of any */
    cost_rig_evaluate(&rig);
    for (int i = 0; i < 3; i++) {
        assert_true(rig.r[i] == (i == 1 ? 0 : rig.y[i] - rig.y_ref[i]));
        assert_true(rig.J[i] == (i != 1));
    }
    cost_rig_close(&rig);
    open_rig(&rig, "{signal: markers, of: [WRIST]}"); /* all three axes */
    cost_rig_evaluate(&rig);
    for (int i = 0; i < 6; i++) {
        assert_true(rig.J[i] == (i >= 3));
    }
    cost_rig_close(&rig);
}

static void test_nodes(void **state) {
    (void)state;
    static const struct {
        const char *yaml;
        int first, last;
    } cases[] = {{"{signal: q}", 1, 1},
                 {"{signal: q, nodes: running}", 1, 0},
                 {"{signal: q, nodes: last}", 0, 1}};
    for (int i = 0; i < 3; i++) {
        cost_rig rig;
        open_rig(&rig, cases[i].yaml);
        for (int last = 0; last < 2; last++) {
            rig.stage.node = last ? rig.stage.n_intervals : 0;
            cost_rig_evaluate(&rig);
            const int on = last ? cases[i].last : cases[i].first;
            assert_true(rig.r[0] == (on ? rig.y[0] - rig.y_ref[0] : 0));
            assert_true(rig.J[0] == on);
        }
        cost_rig_close(&rig);
    }
}

static void test_refused(void **state) {
    (void)state;
    static const struct {
        const char *yaml, *text;
        int formulation;
    } cases[] = {
        {"{signal: posture}", "the problem has no signal 'posture'", MHE_FORMULATION_EXCITATION},
        {"{signal: excitation}", "the problem has no signal 'excitation'",
         MHE_FORMULATION_ACTIVATION},
        {"{signal: activation, of: [biceps]}",
         "of: 'activation' has no entry 'biceps' (it has Biceps, Triceps, Deltoid)", 0},
        {"{signal: q, of: [Biceps]}", "of: 'q' has no entry 'Biceps' (it has shoulder, elbow)", 0},
        {"{signal: markers, of: [HEAD]}",
         "of: 'markers' has no entry 'HEAD' (it has EPI.x, EPI.y, EPI.z, WRIST.x, WRIST.y, "
         "WRIST.z)",
         0},
        {"{signal: activation, value: [0, 0]}", "value: 2 values; 'activation' has 3 entries", 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        cost_rig rig;
        assert_int_equal(cost_rig_open(&rig, TRACK, cases[i].yaml, cases[i].formulation, 0),
                         MHE_E_CONFIG);
        assert_string_equal(rig.err.text, cases[i].text);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_follows_the_target),
        cmocka_unit_test(test_constant),
        cmocka_unit_test(test_of_some),
        cmocka_unit_test(test_nodes),
        cmocka_unit_test(test_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

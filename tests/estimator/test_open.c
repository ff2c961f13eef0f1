/* SPDX-License-Identifier: Apache-2.0 */
/* A plugin that refuses its part of the problem: the message says which line of the config it
 * stands in. */
#include "fixture.h"
#include "support.h"

#include <string.h>

static void check_refused(const char *config, mhe_status status, const char *text) {
    test_fixture f;
    assert_int_equal(test_fixture_open(&f, config), status);
    if (strstr(f.err.text, text) == NULL) {
        fail_msg("'%s' is not in: %s", text, f.err.text);
    }
    test_fixture_close(&f);
}

static void refusals_name_the_line(void **state) {
    (void)state;
    check_refused("model: {file: $ARM19}\n"
                  "costs:\n"
                  "  - mhe.cost.min-excitation\n"
                  "  - plugin: mhe.cost.emg-markers-high\n"
                  "    tracked: [BRAA]\n",
                  MHE_E_CONFIG, "config.yaml:4: costs.1: mhe.cost.emg-markers-high: tracked: ");
    check_refused("model: {file: $ARM19}\n" /* one id twice */
                  "costs:\n"
                  "  - mhe.cost.emg-markers-high\n"
                  "  - {plugin: mhe.cost.emg-markers-high, tracked: [BRAA]}\n",
                  MHE_E_CONFIG, "config.yaml:4: costs.1: mhe.cost.emg-markers-high: tracked: ");
    check_refused("model: {file: $ARM19}\n"
                  "muscle: {curves: paper2021, vmax: 3}\n"
                  "costs: [mhe.cost.min-excitation]\n",
                  MHE_E_CONFIG, "config.yaml:2: mhe.muscle.hill: vmax");
    check_refused("model: {file: $ARM19}\n"
                  "costs: [mhe.cost.min-excitation]\n"
                  "\n"
                  "solver: {plugin: mhe.solver.ipopt, options: {no_such_option: 1}}\n",
                  MHE_E_CONFIG, "config.yaml:4: mhe.solver.ipopt: ");
    check_refused("model: {file: $ARM19}\n"
                  "costs: [mhe.cost.min-excitation]\n"
                  "initial: {q: [0, 0]}\n",
                  MHE_E_CONFIG, "config.yaml:3: initial.q has 2 values");
    check_refused("model: {file: $ARM19}\n"
                  "costs: [mhe.cost.min-excitation]\n"
                  "initial: {q: [0, 0, 0, 90]}\n", /* degrees */
                  MHE_E_CONFIG, "config.yaml:3: initial.q: 90 of 'LowerArm1_RotZ' is outside");
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(refusals_name_the_line)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

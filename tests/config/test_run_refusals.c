/* SPDX-License-Identifier: Apache-2.0 */
/* test_run_refusals.c: configurations that are refused, each with its line and what would be right.
 */
#include "run_rig.h"

#include <string.h>

static void bad_electrodes_and_formats(void **state) {
    (void)state;
    assert_refused(BASE COSTS "emg: {low_pass: 4}\n",
                   ":7: emg: 'channels' is missing, the list of electrodes: [{name: COLUMN, "
                   "muscles: [MUSCLE, ...], mvc: NUMBER}, ...]");
    assert_refused(BASE COSTS "emg: {lowpass: 4, channels: []}\n",
                   ":7: emg: unknown key 'lowpass' (did you mean 'low_pass'?)");
    assert_refused(BASE COSTS "emg: {channels: {a: b}}\n",
                   ":7: emg.channels: must be a list: [{name: COLUMN, muscles: [MUSCLE, ...]}, "
                   "...]");
    assert_refused(BASE COSTS "data: {emg: e.sto}\nemg:\n  channels:\n    - {name: a}\n",
                   ":10: emg.channels: the key 'muscles' is missing: Muscles it stands for, "
                   "or patterns: glmax*_r.");
    assert_refused(BASE COSTS "data: {emg: e.sto}\nemg:\n  channels:\n"
                              "    - {name: a, muscles: [x, y], gains: [1]}\n",
                   ":10: emg.channels: channel 'a' has 1 gains for 2 muscles");
    assert_refused(BASE COSTS "data: {emg: e.sto}\nemg:\n  channels:\n"
                              "    - {name: a, muscles: []}\n",
                   ":10: emg.channels: channel 'a' names no muscle");
    assert_refused(BASE COSTS "data: {emg: e.sto}\nemg:\n  channels:\n"
                              "    - {name: a, muscles: x}\n    - {name: a, muscles: y}\n",
                   ":11: emg.channels: channel 'a' is there twice; one entry lists all of its "
                   "muscles");
    assert_refused(BASE COSTS "data: {emg: e.sto}\nemg:\n  channels:\n"
                              "    - {name: a, muscles: x, delay: -0.02}\n",
                   ":10: emg.channels: channel 'a': 'delay' is -0.02 s; EMG comes before the "
                   "activation, so at least 0 (or -1: that of the section)");
    assert_refused(BASE COSTS "data: {emg: e.sto}\n"
                              "emg: {delay: -0.5, channels: [{name: a, muscles: x}]}\n",
                   ":8: emg: 'delay' is -0.5 s; EMG comes before the activation, so at least 0 (or "
                   "-1: what is usual)");
    assert_refused(BASE COSTS "emg:\n  channels:\n    - {name: a, muscles: x}\n",
                   ":7: emg: there are channels, but data.emg names no file");
    assert_refused(BASE COSTS "data: {emg: e.sto}\n"
                              "emg: {band_low: 500, channels: [{name: a, muscles: x}]}\n",
                   ":8: emg: 'band_low' is 500 Hz, which is not below 'band_high', 450 Hz");
    assert_refused(BASE COSTS "output: {formats: [mat, cvs]}\n",
                   ":7: output: 'formats' cannot hold 'cvs' (did you mean 'csv'?)");
    struct outcome o = read_good(BASE COSTS "emg:\noutput: {formats: mat}\n", NULL, 0);
    assert_int_equal(o.run->output.formats.n, 1);
    assert_int_equal(o.run->emg.n_channels, 0);
    release(&o);
}

static void wrong_sections(void **state) {
    (void)state;
    assert_refused(BASE COSTS "sollver: {}\n",
                   ":7: unknown key 'sollver' (did you mean 'solver'?)");
    assert_refused(BASE COSTS "formulation: excitations\n",
                   ":7: 'formulation' cannot be 'excitations' (did you mean 'excitation'?)");
    assert_refused(BASE COSTS "horizon: 7\n",
                   ":7: horizon: must be a mapping like {key: value}, not a single value");
    assert_refused(BASE COSTS "horizon:\n  window: 7\n  ratio: 0\n",
                   ":9: horizon: 'ratio' must be at least 1, not '0'");
    assert_refused(BASE COSTS "initial: {q: 0.1}\n",
                   ":7: initial: 'q' must be a list of numbers (rad or m), not '0.1'; put it in "
                   "brackets");
    assert_refused(BASE COSTS "initial: {q: [1, 2], qdot: [0]}\n",
                   ":7: initial: 'q' has 2 values and 'qdot' 1");
    assert_refused(BASE COSTS "bounds: {activation_min: 0.5, activation_max: 0.4}\n",
                   ":7: bounds: 'activation_min' is above 'activation_max'");
    assert_refused(BASE COSTS "bounds: {excitation_min: 0.5, excitation_max: 0.4}\n",
                   ":7: bounds: 'excitation_min' is above 'excitation_max'");
    assert_refused(BASE, ": costs: a list with at least one entry is needed, like [{plugin: "
                         "ID}]");
    assert_refused(BASE "costs: []\n", ":6: costs: a list with at least one entry is needed, like "
                                       "[{plugin: ID}]");
    assert_refused(BASE "costs: org.test.cost.b\n",
                   ":6: costs: a list with at least one entry is needed, like [{plugin: "
                   "ID}]");
    assert_refused("- a\n", ":1: a configuration is a mapping of sections (model, costs, ...)");
    assert_refused("{plugin_path: plugins, model: org.test.model.a}\n",
                   ":1: model: the key 'file' is missing: Model file, .osim or .bioMod.");
}

static void wrong_plugin_sections(void **state) {
    (void)state;
    assert_refused(BASE "costs:\n  - {weight: 1}\n",
                   ":7: costs: the id of a plugin is missing: {plugin: ID, ...}");
    assert_refused(BASE "costs:\n  - plugin: [a]\n",
                   ":7: costs: the id of a plugin is missing: {plugin: ID, ...}");
    assert_refused(BASE "costs:\n  - [a]\n",
                   ":7: costs: must be the id of a plugin or a mapping {plugin: ID, ...}");
    assert_refused(BASE "costs:\n  - {plugin: org.test.cost.a,\n     wieght: 1}\n",
                   ":8: org.test.cost.a: unknown key 'wieght' (did you mean 'weight'?)");
    assert_refused(BASE "costs:\n  - {plugin: org.test.cost.a,\n     marker: 1}\n",
                   ":8: org.test.cost.a: unknown key 'marker' (did you mean 'markers'?)");
    assert_refused(BASE "costs:\n  - {plugin: org.test.cost.b, weight: -1}\n",
                   ":7: costs: 'weight' must be at least 0, not '-1'");
    assert_refused(BASE "costs:\n  - {plugin: org.test.cost.b, weight: .inf}\n",
                   ":7: costs: 'weight' must be finite, not '.inf'");
    assert_refused(BASE "costs:\n  - {plugin: org.test.cost.b, sigma: 0}\n",
                   ":7: costs: 'sigma' must be at least 1e-12, not '0'");
    assert_refused_set(BASE "costs:\n  - org.test.cost.greedy\n", NULL, MHE_E_PLUGIN,
                       ":7: org.test.cost.greedy: the plugin's option 'weight' has the name of a "
                       "key of every 'costs' section");
    assert_refused_set(BASE COSTS, "model.unsupported=warm", MHE_E_CONFIG,
                       "--set: model: 'unsupported' cannot be 'warm' (did you mean 'warn'?)");
}

static void unknown_plugins(void **state) {
    (void)state;
    write_file(FILE_NAME, BASE "costs:\n  - org.test.cost.c\n");
    struct outcome o = read_path(FILE_NAME, NULL, 0);
    assert_int_equal(o.status, MHE_E_PLUGIN);
    assert_non_null(strstr(o.err.text, FILE_NAME ":7: costs: "));
    assert_non_null(strstr(o.err.text, "org.test.cost.c"));
    release(&o);
    write_file(FILE_NAME, BASE "costs:\n  - org.test.solver.a\n"); /* of another kind */
    o = read_path(FILE_NAME, NULL, 0);
    assert_int_equal(o.status, MHE_E_PLUGIN);
    assert_non_null(strstr(o.err.text, FILE_NAME ":7: costs: "));
    release(&o);
}

static void absent_plugin_folder(void **state) {
    (void)state;
    write_file(FILE_NAME, "# a comment\nplugin_path: [nowhere]\n" COSTS);
    struct outcome o = read_path(FILE_NAME, NULL, 0);
    assert_int_not_equal(o.status, MHE_OK);
    assert_non_null(strstr(o.err.text, FILE_NAME ":2: "));
    assert_non_null(strstr(o.err.text, TEST_FOLDER "/nowhere"));
    release(&o);
}

static void unreadable_file(void **state) {
    (void)state;
    struct outcome o = read_path(TEST_FOLDER "/absent.yaml", NULL, 0);
    assert_int_equal(o.status, MHE_E_INPUT);
    assert_string_equal(o.err.text,
                        TEST_FOLDER "/absent.yaml: cannot be opened: No such file or directory");
    release(&o);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bad_electrodes_and_formats), cmocka_unit_test(wrong_sections),
        cmocka_unit_test(wrong_plugin_sections),      cmocka_unit_test(unknown_plugins),
        cmocka_unit_test(absent_plugin_folder),       cmocka_unit_test(unreadable_file),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* test_run.c: whole configurations, read with plugins of the tests' own. */
#include "config/defaults.h"
#include "config/options.h"
#include "run_rig.h"

#include <string.h>
#include <unistd.h>

static void defaults_of_the_core(void **state) {
    (void)state;
    struct outcome o = read_good(BASE COSTS, NULL, 0);
    const mhi_run *run = o.run;
    assert_string_equal(run->path, FILE_NAME);
    assert_string_equal(run->dir, TEST_FOLDER);
    assert_string_equal(run->name, "run");
    assert_string_equal(run->model_file.file, TEST_FOLDER "/arm.osim");
    assert_int_equal(run->model_file.unsupported, MHI_UNSUPPORTED_STOP);
    assert_string_equal(run->model.plugin->id, "org.test.model.a");
    assert_string_equal(run->muscle.plugin->id, "org.test.muscle.a");
    assert_int_equal(*(const int32_t *)run->muscle.config, 0);
    assert_int_equal(run->formulation, MHE_FORMULATION_EXCITATION);
    assert_null(run->data.markers);
    assert_int_equal(run->data.emg_delay, 0);
    assert_int_equal(run->initial.q.n, 0);
    assert_true(run->initial.tolerance == 0.1);
    assert_int_equal(run->horizon.window, 7);
    assert_int_equal(run->horizon.ratio, 1);
    assert_int_equal(run->bounds.residual_torques, 0);
    assert_true(run->bounds.residual_torque_max == 100);
    assert_true(run->bounds.velocity_max == 31.415926535897931);
    assert_true(run->bounds.activation_min == 0 && run->bounds.activation_max == 1);
    assert_true(run->bounds.excitation_min == 0 && run->bounds.excitation_max == 1);
    assert_int_equal(run->output.picture, 1);
    assert_int_equal(run->n_costs, 1);
    assert_true(run->costs[0].weight == 1 && run->costs[0].sigma == 1);
    assert_int_equal(run->plugin_path.n, 1);
    assert_string_equal(run->plugin_path.values[0], TEST_FOLDER "/plugins");
    release(&o);
}

static void electrodes_of_the_file(void **state) {
    (void)state;
    static const char emg[] =
        BASE COSTS "formulation: activation\n"
                   "data: {emg: raw.sto}\n"
                   "emg:\n  low_pass: 4\n  envelope: rms\n  mvc_file: mvc.sto\n  channels:\n"
                   "    - {name: Pec, muscles: [a, b], gains: [1, 0.5], mvc: 0.01}\n"
                   "    - {name: \"7\", muscles: c, gain: 2}\n";
    struct outcome o = read_good(emg, NULL, 0);
    const mhi_emg_section *e = &o.run->emg;
    assert_int_equal(o.run->data.emg_delay, 0); /* the filters' delay stands in for it */
    assert_true(e->delay == 0.02 && e->low_pass == 4 && e->band_low == 20 && e->process == 1);
    assert_int_equal(e->envelope, MHI_EMG_RMS);
    assert_string_equal(e->mvc_file, TEST_FOLDER "/mvc.sto");
    assert_int_equal(e->n_channels, 2);
    assert_string_equal(e->channels[0].name, "Pec");
    assert_int_equal(e->channels[0].muscles.n, 2);
    assert_true(e->channels[0].gains.values[1] == 0.5 && e->channels[0].mvc == 0.01);
    assert_string_equal(e->channels[1].name, "7");
    assert_string_equal(e->channels[1].muscles.values[0], "c");
    assert_true(e->channels[1].gain == 2 && e->channels[1].mvc == 0);
    mhi_text first = {0}, second = {0};
    mhi_run_write(o.run, &first);
    release(&o);
    o = read_good(first.data, NULL, 0);
    mhi_run_write(o.run, &second);
    assert_string_equal(first.data, second.data);
    mhi_text_free(&first);
    mhi_text_free(&second);
    release(&o);
    const char *set = "emg.channels.1.mvc=3";
    o = read_good(emg, &set, 1);
    assert_true(o.run->emg.channels[1].mvc == 3);
    release(&o);
}

static void values_of_the_file(void **state) {
    (void)state;
    struct outcome o = read_good(
        BASE "formulation: activation\n"
             "data: {markers: m.trc, emg: /abs/e.sto}\n"
             "initial: {q: [0.1, 0.2], qdot: [0, 0]}\n"
             "horizon: {window: 22, ratio: 3}\n"
             "costs:\n  - {plugin: org.test.cost.a, markers: 5, weight: 2, rest: [0.5]}\n"
             "  - {plugin: org.test.cost.a, sigma: 0.01, table: t.csv}\n  - org.test.cost.b\n",
        NULL, 0);
    const mhi_run *run = o.run;
    assert_int_equal(run->formulation, MHE_FORMULATION_ACTIVATION);
    assert_int_equal(run->data.emg_delay, 2); /* electromechanical delay by default */
    assert_string_equal(run->data.markers, TEST_FOLDER "/m.trc");
    assert_string_equal(run->data.emg, "/abs/e.sto");
    assert_int_equal(run->initial.qdot.n, 2);
    assert_int_equal(run->horizon.window, 22);
    assert_int_equal(run->n_costs, 3);
    assert_true(*(const double *)run->costs[0].config == 5);
    assert_true(run->costs[0].weight == 2 && run->costs[1].weight == 1);
    assert_true(run->costs[1].sigma == 0.01);
    assert_int_equal(run->costs[1].node->line, 12);
    assert_string_equal(run->costs[2].plugin->id, "org.test.cost.b");
    release(&o);
    o = read_good(BASE COSTS "formulation: activation\ndata: {emg_delay: 0}\nbounds:\n", NULL, 0);
    assert_int_equal(o.run->data.emg_delay, 0);
    release(&o);
}

static void assignments(void **state) {
    (void)state;
    const char *set[] = {"horizon.window=3",        "solver.max_iterations=9", "costs.0.weight=4",
                         "costs.1=org.test.cost.a", "costs.1.markers=7",       "initial.q=[1, 2]",
                         "muscle.curves=biorbd"};
    struct outcome o = read_good(BASE COSTS, set, 7);
    assert_int_equal(o.run->horizon.window, 3);
    assert_int_equal(o.run->n_costs, 2);
    assert_true(o.run->costs[0].weight == 4);
    assert_true(*(const double *)o.run->costs[1].config == 7);
    assert_true(o.run->initial.q.values[1] == 2);
    assert_int_equal(*(const int32_t *)o.run->muscle.config, 1);
    release(&o);
    assert_refused_set(BASE COSTS, "horizon.windw=3", MHE_E_CONFIG,
                       "--set: horizon: unknown key 'windw' (did you mean 'window'?)");
    assert_refused_set(BASE COSTS, "horizon.window=0", MHE_E_CONFIG,
                       "--set: horizon: 'window' must lie in 2 .. 1000, not '0'");
    assert_refused_set(BASE COSTS, "formulation.x=0", MHE_E_CONFIG, /* a new section */
                       "--set: 'formulation' must be a text, not a mapping");
    assert_refused_set(BASE COSTS, "plugin_path.x=0", MHE_E_CONFIG,
                       "--set plugin_path.x=0: there is nothing below the value 'plugins': 'x' "
                       "has no place");
}

/* A folder of plugins is code: a file from elsewhere may not name one, its reader may. */
static void plugin_folders_need_trust(void **state) {
    (void)state;
    struct outcome o = {0};
    const char *own = "plugin_path=[" TEST_FOLDER "/plugins]";
    write_file(FILE_NAME, BASE COSTS);
    assert_int_equal(mhi_registry_create(&run_host, &o.registry, &o.err), MHE_OK);
    o.status = mhi_run_read(FILE_NAME, NULL, 0, o.registry, &o.run, &o.err);
    assert_int_equal(o.status, MHE_E_CONFIG);
    assert_non_null(strstr(o.err.text, FILE_NAME ":5: plugin_path: '" TEST_FOLDER
                                                 "/plugins' holds code that would run"));
    assert_int_equal(mhi_registry_count(o.registry) > 0 &&
                         strstr(mhi_registry_file(o.registry, 0), TEST_FOLDER) != NULL,
                     0);
    o.status = mhi_run_read(FILE_NAME, &own, 1, o.registry, &o.run, &o.err);
    assert_int_equal(o.status, MHE_OK);
    release(&o);
}

/* Paths in the file hold from wherever the program was started. */
static void relative_file_name(void **state) {
    (void)state;
    write_file(FILE_NAME, BASE COSTS);
    assert_int_equal(chdir(TEST_FOLDER), 0);
    struct outcome o = read_path(TEST_RUN ".yaml", NULL, 0);
    assert_string_equal(o.err.text, "");
    assert_string_equal(o.run->dir, TEST_FOLDER);
    assert_string_equal(o.run->path, TEST_RUN ".yaml");
    release(&o);
    o = read_path("plugins/../" TEST_RUN ".yaml", NULL, 0);
    assert_string_equal(o.err.text, "");
    assert_string_equal(o.run->dir, TEST_FOLDER "/plugins/..");
    assert_string_equal(o.run->name, "run");
    release(&o);
}

/* A file that is not there is told with the line that names it. */
static void the_line_that_names_a_file(void **state) {
    (void)state;
    static const struct {
        const char *said, *expected;
    } cases[] = {
        {TEST_FOLDER "/m.trc: cannot be opened: No", FILE_NAME ":7: " TEST_FOLDER "/m.trc"},
        {"/abs/e.sto: is a folder", FILE_NAME ":8: /abs/e.sto: is a folder"},
        {TEST_FOLDER "/t/../l.xml: cannot be opened: No", FILE_NAME ":9: "},
        {TEST_FOLDER "/arm.osim: cannot be opened: No", "--set: " TEST_FOLDER "/arm.osim"},
        {"/abs/e.st: cannot be opened: No", "/abs/e.st: "},
        {"/abs/e.sto:7: no number", "/abs/e.sto:7: "},
    };
    const char *set = "model.file=arm.osim";
    struct outcome o = read_good(BASE "data:\n  markers: ./m.trc\n  emg: /abs/e.sto\n"
                                      "  reference: t/../l.xml\n" COSTS,
                                 &set, 1);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        mhe_error err = {0};
        (void)mhe_fail(&err, MHE_E_INPUT, "%s", cases[i].said);
        assert_int_equal(mhi_run_locate_file(o.run, MHE_E_INPUT, &err), MHE_E_INPUT);
        if (strncmp(err.text, cases[i].expected, strlen(cases[i].expected)) != 0) {
            fail_msg("'%s' does not begin with '%s'", err.text, cases[i].expected);
        }
    }
    release(&o);
}

static void resolved_run_reads_back(void **state) {
    (void)state;
    struct outcome o = read_good(
        BASE "formulation: activation\ndata: {markers: \"m: 1.trc\"}\n"
             "initial: {q: [0.1, -1e-7]}\nbounds: {velocity_max: .inf}\n"
             "costs:\n  - {plugin: org.test.cost.a, markers: 1e7, muscles: [BRA, 'B D'],\n"
             "     extra: {a b: 1}, rest: [0.3], table: x.csv, weight: 0.1}\n"
             "  - org.test.cost.b\n",
        NULL, 0);
    mhi_text first = {0}, second = {0};
    mhi_run_write(o.run, &first);
    release(&o);
    assert_non_null(strstr(first.data, "\n  - plugin: org.test.cost.a\n    weight: 0.1\n"));
    assert_non_null(strstr(first.data, "\n  emg_delay: 2\n"));
    assert_non_null(strstr(first.data, "\n  velocity_max: .inf\n"));
    assert_non_null(strstr(first.data, "\n    muscles: [BRA, \"B D\"]\n"));
    /* from another folder: every path is absolute by now */
    const char *copy = MHE_TEST_BINARY_DIR "/tests/resolved.yaml";
    write_file(copy, first.data);
    o = read_path(copy, NULL, 0);
    assert_string_equal(o.err.text, "");
    mhi_run_write(o.run, &second);
    assert_string_equal(second.data, first.data);
    release(&o);
    mhi_text_free(&first);
    mhi_text_free(&second);
}

/* The core's own tables obey the rules that plugins' tables have to. */
static void tables_are_documented(void **state) {
    (void)state;
    int32_t n = 0, n_options = 0;
    const mhi_section *sections = mhi_run_sections(&n);
    assert_int_equal(n, 19);
    for (int32_t i = 0; i < n; i++) {
        mhe_error err = {0};
        mhi_options_check(sections[i].options, sections[i].n_options, 4096, &err);
        assert_string_equal(err.text, "");
        assert_ptr_equal(mhi_run_section(sections[i].name, &n_options), sections[i].options);
        assert_int_equal(n_options, sections[i].n_options);
        assert_true(strlen(sections[i].help) > 0);
        if (sections[i].iface != NULL) {
            assert_string_equal(sections[i].options[0].key, "plugin");
        }
    }
    /* what stands where no plugin is named is said by a file, not by the core */
    mhi_arena arena = {0};
    mhe_error err = {0};
    const char *id = NULL;
    assert_int_equal(mhi_default_plugin("solver", &arena, &id, &err), MHE_OK);
    assert_string_equal(id, "mhe.solver.rti");
    assert_int_equal(mhi_default_plugin("costs", &arena, &id, &err), MHE_OK);
    assert_null(id);
    mhi_arena_free(&arena);
    assert_null(mhi_run_section("nothing", &n_options));
    assert_int_equal(n_options, 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(electrodes_of_the_file),     cmocka_unit_test(defaults_of_the_core),
        cmocka_unit_test(values_of_the_file),         cmocka_unit_test(assignments),
        cmocka_unit_test(plugin_folders_need_trust),  cmocka_unit_test(relative_file_name),
        cmocka_unit_test(the_line_that_names_a_file), cmocka_unit_test(resolved_run_reads_back),
        cmocka_unit_test(tables_are_documented),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

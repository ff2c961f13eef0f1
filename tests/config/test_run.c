/* SPDX-License-Identifier: Apache-2.0 */
/* test_run.c: whole configurations, read with plugins of the tests' own. */
#include "config/defaults.h"
#include "config/options.h"
#include "config/run.h"
#include "support.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define FILE_NAME TEST_FOLDER "/run.yaml"
/* Enough for a run; the path is relative to the file's folder. */
#define BASE                                                   \
    "model: {plugin: org.test.model.a, file: arm.osim}\n"      \
    "muscle: org.test.muscle.a\n"                              \
    "integrator: org.test.integrator.a\n"                      \
    "solver: {plugin: org.test.solver.a, max_iterations: 5}\n" \
    "plugin_path: plugins\n"
#define COSTS "costs: [org.test.cost.b]\n"

static void ignore_log(const mhe_host *host, int32_t level, const char *text) {
    (void)host, (void)level, (void)text;
}

static const void *no_service(const mhe_host *host, const char *id) {
    (void)host, (void)id;
    return NULL;
}

static const mhe_host host = {.size = sizeof host, .log = ignore_log, .service = no_service};

static void write_file(const char *path, const char *text) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fputs(text, file) >= 0, 1);
    assert_int_equal(fclose(file), 0);
}

struct outcome {
    mhi_registry *registry;
    mhi_run *run;
    mhe_status status;
    mhe_error err;
};

static struct outcome read_path(const char *path, const char *const *set, int32_t n_set) {
    struct outcome o = {0};
    assert_int_equal(mhi_registry_create(&host, &o.registry, &o.err), MHE_OK);
    mhi_registry_trust_files(o.registry, 1);
    o.status = mhi_run_read(path, set, n_set, o.registry, &o.run, &o.err);
    assert_int_equal(o.run == NULL, o.status != MHE_OK);
    return o;
}

static void release(struct outcome *o) {
    mhi_run_free(o->run);
    mhi_registry_free(o->registry);
}

static struct outcome read_good(const char *yaml, const char *const *set, int32_t n_set) {
    write_file(FILE_NAME, yaml);
    struct outcome o = read_path(FILE_NAME, set, n_set);
    assert_string_equal(o.err.text, "");
    assert_int_equal(o.status, MHE_OK);
    return o;
}

/* `message` stands behind the file name. */
static void assert_refused_set(const char *yaml, const char *set, mhe_status code,
                               const char *message) {
    write_file(FILE_NAME, yaml);
    struct outcome o = read_path(FILE_NAME, &set, set != NULL);
    assert_int_equal(o.status, code);
    const char *text = o.err.text;
    if (strncmp(text, FILE_NAME, strlen(FILE_NAME)) == 0) {
        text += strlen(FILE_NAME);
    }
    assert_string_equal(text, message);
    release(&o);
}

static void assert_refused(const char *yaml, const char *message) {
    assert_refused_set(yaml, NULL, MHE_E_CONFIG, message);
}

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

/* A folder of plugins is code: a file from elsewhere may not name one, its reader may. */
static void plugin_folders_need_trust(void **state) {
    (void)state;
    struct outcome o = {0};
    const char *own = "plugin_path=[" TEST_FOLDER "/plugins]";
    write_file(FILE_NAME, BASE COSTS);
    assert_int_equal(mhi_registry_create(&host, &o.registry, &o.err), MHE_OK);
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

static void unreadable_file(void **state) {
    (void)state;
    struct outcome o = read_path(TEST_FOLDER "/absent.yaml", NULL, 0);
    assert_int_equal(o.status, MHE_E_INPUT);
    assert_string_equal(o.err.text,
                        TEST_FOLDER "/absent.yaml: cannot be opened: No such file or directory");
    release(&o);
}

/* Paths in the file hold from wherever the program was started. */
static void relative_file_name(void **state) {
    (void)state;
    write_file(FILE_NAME, BASE COSTS);
    assert_int_equal(chdir(TEST_FOLDER), 0);
    struct outcome o = read_path("run.yaml", NULL, 0);
    assert_string_equal(o.err.text, "");
    assert_string_equal(o.run->dir, TEST_FOLDER);
    assert_string_equal(o.run->path, "run.yaml");
    release(&o);
    o = read_path("plugins/../run.yaml", NULL, 0);
    assert_string_equal(o.err.text, "");
    assert_string_equal(o.run->dir, TEST_FOLDER "/plugins/..");
    assert_string_equal(o.run->name, "run");
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
        cmocka_unit_test(electrodes_of_the_file),
        cmocka_unit_test(bad_electrodes_and_formats),
        cmocka_unit_test(defaults_of_the_core),
        cmocka_unit_test(values_of_the_file),
        cmocka_unit_test(assignments),
        cmocka_unit_test(wrong_sections),
        cmocka_unit_test(wrong_plugin_sections),
        cmocka_unit_test(unknown_plugins),
        cmocka_unit_test(plugin_folders_need_trust),
        cmocka_unit_test(unreadable_file),
        cmocka_unit_test(absent_plugin_folder),
        cmocka_unit_test(relative_file_name),
        cmocka_unit_test(resolved_run_reads_back),
        cmocka_unit_test(tables_are_documented),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

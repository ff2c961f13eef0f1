/* SPDX-License-Identifier: Apache-2.0 */
/* A configuration of somebody else's program: from a file, from memory, asked for its values. */
#include "outside.h"

#include <mhe/estimator.h>

static const char yaml[] = "model: {file: arm19.osim}\n"
                           "data: {markers: demo_markers.trc, emg: demo_emg.sto}\n"
                           "horizon: {window: 5}\n"
                           "costs: [{plugin: mhe.cost.emg-markers-high, weight: 2.5}]\n";

static mhe_config *parse(const char *text, uint64_t length, const char *set, mhe_status expected,
                         mhe_error *err) {
    mhe_config *config = NULL;
    assert_int_equal(mhe_config_parse("made/run.yaml", text, length, ARM19, &set, set != NULL, 0,
                                      NULL, &config, err),
                     expected);
    return config;
}

static void memory_is_as_good_as_a_file(void **state) {
    (void)state;
    mhe_error err = {0};
    /* not NUL-terminated: what stands behind the length is not read */
    char *exact = malloc(sizeof yaml - 1);
    assert_non_null(exact);
    memcpy(exact, yaml, sizeof yaml - 1);
    mhe_config *config = parse(exact, sizeof yaml - 1, "horizon.ratio=2", MHE_OK, &err);
    assert_string_equal(err.text, "");
    free(exact);
    assert_string_equal(mhe_config_name(config), "run");
    assert_value(config, "horizon.window", "5");
    assert_value(config, "horizon.ratio", "2");
    assert_value(config, "costs.0.plugin", "mhe.cost.emg-markers-high");
    assert_value(config, "data.markers", ARM19 "/demo_markers.trc");
    assert_value(config, "data.reference", "");
    assert_value(config, "output.formats", "[]");
    double number = 0;
    expect_done(mhe_config_get_real(config, "costs.0.weight", &number, &err), &err);
    assert_true(number == 2.5);
    expect_done(mhe_config_get_real(config, "output.picture", &number, &err), &err);
    assert_true(number == 1);
    mhe_estimator *estimator = NULL;
    expect_done(mhe_estimator_create(config, &estimator, &err), &err);
    mhe_estimator_close(estimator);
    mhe_config_close(config);
}

static void what_is_written_reads_back_the_same(void **state) {
    (void)state;
    char *once = NULL, *twice = NULL;
    mhe_error err = {0};
    mhe_config *config = read_demo(NULL);
    expect_done(mhe_config_write(config, &once, &err), &err);
    mhe_config *again = parse(once, strlen(once), NULL, MHE_OK, &err);
    assert_string_equal(err.text, "");
    expect_done(mhe_config_write(again, &twice, &err), &err);
    assert_string_equal(once, twice);
    mhe_free(once);
    mhe_free(twice);
    mhe_config_close(again);
    mhe_config_close(config);
}

static void mistakes_are_told_with_name_and_line(void **state) {
    (void)state;
    mhe_error err = {0};
    char *text = NULL;
    double number = 0;
    static const char wrong[] = "model: {file: arm19.osim}\nhorizon: {windwo: 5}\n";
    assert_null(parse(wrong, sizeof wrong - 1, NULL, MHE_E_CONFIG, &err));
    assert_non_null(strstr(err.text, "made/run.yaml:2: "));
    assert_non_null(strstr(err.text, "window"));
    mhe_config *config = read_demo(NULL);
    assert_int_equal(mhe_config_get(config, "horizon.windwo", &text, &err), MHE_E_CONFIG);
    assert_string_equal(err.text, "the configuration has no key 'horizon.windwo'");
    assert_null(text);
    assert_int_equal(mhe_config_get(config, "costs.7.weight", &text, &err), MHE_E_CONFIG);
    assert_int_equal(mhe_config_get(config, "costs.-1.weight", &text, &err), MHE_E_CONFIG);
    assert_int_equal(mhe_config_get_real(config, "model.file", &number, &err), MHE_E_CONFIG);
    assert_int_equal(mhe_config_get_real(config, "data", &number, &err), MHE_E_CONFIG);
    mhe_config_close(config);
}

static void null_is_an_argument_error(void **state) {
    (void)state;
    mhe_config *config = read_demo(NULL), *none = NULL;
    mhe_estimator *estimator = NULL;
    mhe_error err = {0};
    char *text = NULL;
    double number = 0;
    const char *hole = NULL;
    assert_int_equal(mhe_config_read(NULL, NULL, 0, 0, NULL, &none, &err), MHE_E_ARGUMENT);
    assert_string_equal(err.text, "mhe_config_read: 'path' is NULL");
    assert_int_equal(mhe_config_read("x", NULL, 0, 0, NULL, NULL, NULL), MHE_E_ARGUMENT);
    assert_int_equal(mhe_config_read("x", NULL, 1, 0, NULL, &none, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_config_read("x", &hole, 1, 0, NULL, &none, &err), MHE_E_ARGUMENT);
    assert_string_equal(err.text, "mhe_config_read: assignment 0 of 'set' is NULL");
    assert_int_equal(mhe_config_parse("x", NULL, 0, NULL, NULL, 0, 0, NULL, &none, &err),
                     MHE_E_ARGUMENT);
    assert_int_equal(mhe_config_write(NULL, &text, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_config_write(config, NULL, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_config_get(config, NULL, &text, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_config_get_real(config, "horizon.window", NULL, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_config_get_real(NULL, "horizon.window", &number, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_estimator_create(NULL, &estimator, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_estimator_create(config, NULL, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_estimator_open(NULL, NULL, 0, NULL, &estimator, &err), MHE_E_ARGUMENT);
    assert_null(mhe_config_name(NULL));
    mhe_config_close(NULL);
    mhe_free(NULL);
    mhe_config_close(config);
}

static void the_library_tells_of_itself(void **state) {
    (void)state;
    char *text = NULL;
    mhe_error err = {0};
    assert_non_null(strchr(mhe_version(), '.'));
    assert_string_equal(mhe_status_text(MHE_OK), "done");
    assert_string_equal(mhe_status_text(1234), "an unknown status");
    expect_done(mhe_plugins_list(NULL, MHE_FORMAT_JSON, &text, &err), &err);
    assert_non_null(strstr(text, "\"mhe.model.simbody\""));
    mhe_free(text);
    expect_done(mhe_plugins_describe(NULL, "mhe.cost.track", MHE_FORMAT_TEXT, &text, &err), &err);
    assert_non_null(strstr(text, "Options:"));
    mhe_free(text);
    expect_done(mhe_plugins_describe(NULL, "config", MHE_FORMAT_MARKDOWN, &text, &err), &err);
    assert_non_null(strstr(text, "**`horizon`**"));
    mhe_free(text);
    assert_int_equal(mhe_plugins_describe(NULL, "mhe.cost.trakc", MHE_FORMAT_TEXT, &text, &err),
                     MHE_E_PLUGIN);
    assert_non_null(strstr(err.text, "did you mean 'mhe.cost.track'?"));
    assert_non_null(strstr(err.text, "; searched: "));
    assert_null(text);
    assert_int_equal(mhe_plugins_list(NULL, MHE_FORMAT_TEXT, NULL, &err), MHE_E_ARGUMENT);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(memory_is_as_good_as_a_file),
                                       cmocka_unit_test(what_is_written_reads_back_the_same),
                                       cmocka_unit_test(mistakes_are_told_with_name_and_line),
                                       cmocka_unit_test(null_is_an_argument_error),
                                       cmocka_unit_test(the_library_tells_of_itself)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

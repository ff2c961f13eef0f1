/* SPDX-License-Identifier: Apache-2.0 */
/* test_describe.c: --list-plugins and --describe in their three formats. */
#include "plugin/registry.h"

#include "support.h"

#include <cjson/cJSON.h>
#include <stdlib.h>
#include <string.h>

static int open_registry(void **state) {
    mhi_registry *registry = NULL;
    if (setenv("MHE_PLUGIN_PATH", "/no/such/folder:" PLUGIN_DIR, 1) != 0 ||
        mhi_registry_create(NULL, &registry, NULL) != MHE_OK) {
        return -1;
    }
    *state = registry;
    return 0;
}

static int close_registry(void **state) {
    mhi_registry_free(*state);
    return 0;
}

static mhi_text describe(mhi_registry *registry, const char *id, int32_t format) {
    mhi_text out = {0};
    assert_int_equal(mhi_registry_describe(registry, id, format, &out, NULL), MHE_OK);
    return out;
}

static void text_shows_the_whole_table(void **state) {
    mhi_text out = describe(*state, "test.cost.sample", MHI_FORMAT_TEXT);
    assert_string_equal(out.data, "test.cost.sample 1.0.0\n"
                                  "A sample of everything.\n"
                                  "\n"
                                  "Reference: doi:10.0000/none\n"
                                  "Interface: mhe.cost/2\n"
                                  "File:      " PLUGIN_DIR "/first.so\n"
                                  "Extension: mhe.cost.hessian/1\n"
                                  "\n"
                                  "Options:\n"
                                  "  gain: real [1], default 0.5; 0 .. 1\n"
                                  "      Factor of every residual.\n"
                                  "  floor: real [N], default 0; at least 0\n"
                                  "      Forces below it do not count.\n"
                                  "  count: int [1], default 3; 1 .. 9\n"
                                  "      How often.\n"
                                  "  flag: bool, default true\n"
                                  "      Whether at all; a|b.\n"
                                  "  method: enum, default gauss; one of rk4, gauss, exponential\n"
                                  "      How.\n"
                                  "  signal: text, required\n"
                                  "      What.\n"
                                  "  file: path; advanced\n"
                                  "      Where from.\n"
                                  "  weights: list of real [1]; 0 .. 1\n"
                                  "      One weight a row.\n"
                                  "  names: list of text\n"
                                  "      Which.\n"
                                  "  old_gain: real [1], default 0; 0 .. 1; deprecated, use gain\n"
                                  "      Factor by its old name.\n");
    mhi_text_free(&out);
}

static void markdown_names_no_file_and_keeps_cells_whole(void **state) {
    mhi_text out = describe(*state, "test.cost.sample", MHI_FORMAT_MARKDOWN);
    assert_null(strstr(out.data, PLUGIN_DIR));
    assert_non_null(strstr(out.data, "| `gain` | real | 1 | 0.5 | 0 .. 1 | Factor of every"));
    assert_non_null(strstr(out.data, "| Whether at all; a\\|b. |"));
    assert_non_null(strstr(out.data, "| rk4, gauss, exponential | How. |"));
    assert_non_null(strstr(out.data, "Factor by its old name. Deprecated: use gain. |"));
    mhi_text_free(&out);
    out = describe(*state, "test.cost.plain", MHI_FORMAT_MARKDOWN);
    assert_string_equal(out.data, "`test.cost.plain` (`mhe.cost/2`): No options.\n\nNo options.\n");
    mhi_text_free(&out);
}

static void json_reads_back(void **state) {
    mhi_text out = describe(*state, "test.cost.sample", MHI_FORMAT_JSON);
    cJSON *root = cJSON_Parse(out.data);
    assert_non_null(root);
    assert_string_equal(cJSON_GetObjectItem(root, "id")->valuestring, "test.cost.sample");
    cJSON *options = cJSON_GetObjectItem(root, "options");
    assert_int_equal(cJSON_GetArraySize(options), 10);
    cJSON *floor = cJSON_GetArrayItem(options, 1);
    assert_string_equal(cJSON_GetObjectItem(floor, "unit")->valuestring, "N");
    assert_true(cJSON_IsNull(cJSON_GetObjectItem(floor, "max"))); /* open end */
    assert_true(cJSON_GetObjectItem(floor, "min")->valuedouble == 0);
    cJSON *method = cJSON_GetArrayItem(options, 4);
    assert_string_equal(cJSON_GetArrayItem(cJSON_GetObjectItem(method, "choices"), 2)->valuestring,
                        "exponential");
    cJSON *signal = cJSON_GetArrayItem(options, 5);
    assert_true(cJSON_IsTrue(cJSON_GetObjectItem(signal, "required")));
    assert_true(cJSON_IsNull(cJSON_GetObjectItem(signal, "default")));
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(root, "extensions")), 1);
    cJSON_Delete(root);
    mhi_text_free(&out);
}

static void lists_end_with_what_was_refused(void **state) {
    mhi_text out = {0};
    mhi_registry_list(*state, MHI_FORMAT_TEXT, &out);
    assert_int_equal(strncmp(out.data, "ID ", 3), 0);
    const char *sample = strstr(out.data, "test.cost.sample");
    const char *refused = strstr(out.data, "\nRefused:\n  /no/such/folder: No such file");
    assert_non_null(sample);
    assert_non_null(refused);
    assert_true(sample < refused);
    mhi_text_free(&out);

    mhi_registry_list(*state, MHI_FORMAT_JSON, &out);
    cJSON *root = cJSON_Parse(out.data);
    assert_non_null(root);
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(root, "plugins")),
                     mhi_registry_count(*state));
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(root, "refused")),
                     mhi_registry_refused_count(*state));
    cJSON_Delete(root);
    mhi_text_free(&out);
}

static void an_unknown_id_is_refused(void **state) {
    mhi_text out = {0};
    mhe_error err = {0};
    assert_int_equal(mhi_registry_describe(*state, "test.cost.simple", MHI_FORMAT_TEXT, &out, &err),
                     MHE_E_PLUGIN);
    assert_non_null(strstr(err.text, "did you mean 'test.cost.sample'"));
    assert_null(out.data);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(text_shows_the_whole_table),
        cmocka_unit_test(markdown_names_no_file_and_keeps_cells_whole),
        cmocka_unit_test(json_reads_back),
        cmocka_unit_test(lists_end_with_what_was_refused),
        cmocka_unit_test(an_unknown_id_is_refused),
    };
    return cmocka_run_group_tests(tests, open_registry, close_registry);
}

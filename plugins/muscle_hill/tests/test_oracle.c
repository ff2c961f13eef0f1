/* SPDX-License-Identifier: Apache-2.0 */
/* Forces and activation rates against the oracle files, at their lengths and velocities. */
#include "json.h"
#include "test_muscle.h"

#include "io/model_file.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void numbers(const cJSON *state, const char *key, int32_t n, double *out) {
    const cJSON *array = cJSON_GetObjectItemCaseSensitive(state, key);
    assert_int_equal(cJSON_GetArraySize(array), n);
    for (int32_t i = 0; i < n; i++) {
        out[i] = cJSON_GetArrayItem(array, i)->valuedouble;
    }
}

static double largest_error(const double *value, const double *expected, int32_t n) {
    double worst = 0;
    for (int32_t i = 0; i < n; i++) {
        worst = fmax(worst, fabs(value[i] - expected[i]) / fmax(1, fabs(expected[i])));
    }
    return worst;
}

#define MAX_MUSCLES 64

static void compare(const char *model, const char *oracle, const char *yaml) {
    char model_path[1024], oracle_path[1024];
    if (test_data_path(model_path, sizeof model_path, model) == NULL ||
        test_data_path(oracle_path, sizeof oracle_path, oracle) == NULL) {
        skip();
    }
    mhe_description *description = NULL;
    mhe_error err = {0};
    if (mhi_model_read(model_path, &description, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    int32_t n = description->n_muscles;
    assert_true(n > 0 && n <= MAX_MUSCLES);
    struct test_hill hill = test_hill(description->muscles, n, yaml);
    if (hill.ops == NULL) {
        fail_msg("%s", hill.err.text);
    }
    cJSON *json = test_json(oracle_path);
    const cJSON *state = NULL, *states = cJSON_GetObjectItemCaseSensitive(json, "states");
    assert_true(cJSON_GetArraySize(states) > 10);
    double force_error = 0, rate_error = 0;
    cJSON_ArrayForEach(state, states) {
        double a[MAX_MUSCLES], e[MAX_MUSCLES], l[MAX_MUSCLES], w[MAX_MUSCLES];
        double expected[MAX_MUSCLES], value[MAX_MUSCLES];
        numbers(state, "a", n, a);
        numbers(state, "e", n, e);
        numbers(state, "mt_length", n, l);
        numbers(state, "mt_velocity", n, w);
        const mhe_muscle_values out = {.size = sizeof out, .force = value};
        assert_int_equal(test_hill_at(&hill, a, l, w, &out, &err), MHE_OK);
        numbers(state, "force", n, expected);
        force_error = fmax(force_error, largest_error(value, expected, n));
        assert_int_equal(hill.ops->diagonal_rate(hill.self, 0, e, a, value, NULL, NULL, &err),
                         MHE_OK);
        numbers(state, "adot", n, expected);
        rate_error = fmax(rate_error, largest_error(value, expected, n));
    }
    print_message("%s: forces %.1e, activation rates %.1e\n", oracle, force_error, rate_error);
    assert_true(force_error < 1e-8);
    assert_true(rate_error < 1e-8);
    cJSON_Delete(json);
    hill.ops->destroy(hill.self);
    mhi_description_free(description);
}

static void arm19_paper2021(void **state) {
    (void)state;
    compare("arm19/arm_wt_rot_scap.bioMod", "arm19/oracle_paper2021.json", "curves: paper2021");
}

static void arm19_biorbd(void **state) {
    (void)state;
    compare("arm19/arm_wt_rot_scap.bioMod", "arm19/oracle_biorbd.json", "curves: biorbd");
}

static void abduction_biorbd(void **state) {
    (void)state;
    compare("abduction/wu_scaled.bioMod", "abduction/oracle_biorbd.json", "curves: biorbd");
}

int main(void) {
    char path[1024];
    if (test_data_path(path, sizeof path, "arm19/oracle_paper2021.json") == NULL) {
        return TEST_SKIPPED;
    }
    const struct CMUnitTest tests[] = {cmocka_unit_test(arm19_paper2021),
                                       cmocka_unit_test(arm19_biorbd),
                                       cmocka_unit_test(abduction_biorbd)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

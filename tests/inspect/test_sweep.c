/* SPDX-License-Identifier: Apache-2.0 */
/* Sweeps of every coordinate of public models in 400 steps: lengths jump where a conditional point
 * goes on or off, and nowhere else. */
#include "json.h"
#include "public_models.h"
#include "support.h"

#include <mhe/inspect.h>

#include <math.h>
#include <stdio.h>
#include <string.h>

#define STEPS 400

static void sweep_model(const char *name, int *conditional) {
    char file[256], path[1024], *text = NULL;
    mhe_error err = {0};
    (void)snprintf(file, sizeof file, "opensim/%s.osim", name);
    if (test_data_path(path, sizeof path, file) == NULL) {
        skip();
    }
    if (mhe_model_sweep(NULL, path, STEPS, MHE_FORMAT_JSON, &text, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    cJSON *answer = cJSON_Parse(text);
    assert_non_null(answer);
    const cJSON *jump;
    cJSON_ArrayForEach(jump, cJSON_GetObjectItem(answer, "jumps")) {
        const char *whose = cJSON_GetObjectItem(jump, "path")->valuestring;
        assert_true(fabs(cJSON_GetObjectItem(jump, "size")->valuedouble) >= 1e-3);
        if (cJSON_IsTrue(cJSON_GetObjectItem(jump, "conditional"))) {
            *conditional += 1;
            continue;
        }
        fail_msg("%s: %s jumps by %.2f mm at %s = %.4f", name, whose,
                 1e3 * cJSON_GetObjectItem(jump, "size")->valuedouble,
                 cJSON_GetObjectItem(jump, "coordinate")->valuestring,
                 cJSON_GetObjectItem(jump, "at")->valuedouble);
    }
    cJSON_Delete(answer);
    mhe_free(text);
}

static void lengths_jump_at_conditional_points_alone(void **state) {
    (void)state;
    int conditional = 0;
    for (int i = 0; i < N_PUBLIC_MODELS; i++) {
        sweep_model(public_models[i], &conditional);
    }
    print_message("25 models: %d jumps at conditional points\n", conditional);
    assert_true(conditional > 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(lengths_jump_at_conditional_points_alone)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

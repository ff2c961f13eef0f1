/* SPDX-License-Identifier: Apache-2.0 */
#include "json.h"

#include "support.h"

#include <stdio.h>
#include <stdlib.h>

cJSON *test_json(const char *path) {
    FILE *stream = fopen(path, "rb");
    assert_non_null(stream);
    assert_int_equal(fseek(stream, 0, SEEK_END), 0);
    const long length = ftell(stream);
    assert_true(length > 0);
    rewind(stream);
    char *text = malloc((size_t)length);
    assert_non_null(text);
    assert_int_equal(fread(text, 1, (size_t)length, stream), length);
    (void)fclose(stream);
    cJSON *json = cJSON_ParseWithLength(text, (size_t)length);
    free(text);
    assert_non_null(json);
    return json;
}

cJSON *test_oracle(const char *name) {
    char file[256], path[1024];
    (void)snprintf(file, sizeof file, "opensim/%s.oracle.json", name);
    return test_data_path(path, sizeof path, file) == NULL ? NULL : test_json(path);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* The models we ship against the files they come from and against values computed by others. */
#include "forward.h"
#include "io/model_file.h"
#include "support.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAX_N 64
#define ARM19 MHE_TEST_SOURCE_DIR "/models/arm19/arm19.osim"
#define ARM35 MHE_TEST_SOURCE_DIR "/models/arm35/arm35.osim"
#define ARM19_SOURCE "arm19/arm_wt_rot_scap.bioMod"

static mhe_description *read_model(const char *path) {
    mhe_description *d = NULL;
    mhe_error err = {0};
    if (mhi_model_read(path, &d, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    assert_in_range(d->n_muscles, 1, MAX_N);
    return d;
}

/* To be called before anything that would have to be freed. */
static void need_data(const char *file) {
    char path[1024];
    if (test_data_path(path, sizeof path, file) == NULL) {
        skip();
    }
}

static mhe_description *read_data_model(const char *file) {
    char path[1024];
    assert_non_null(test_data_path(path, sizeof path, file));
    return read_model(path);
}

static void assert_near(const char *what, int i, double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance)) {
        fail_msg("%s %d: %.17g, expected %.17g (off by %.3g, allowed %.3g)", what, i, value,
                 expected, value - expected, tolerance);
    }
}

/* Both sides count the same things, named alike, in the same order; ranges are the paper's in one
 * and the laboratory's in the other, and each muscle class has its own name in each format. */
static void same_parts(const mhe_description *a, const mhe_description *b) {
    assert_int_equal(a->n_coordinates, b->n_coordinates);
    assert_int_equal(a->n_markers, b->n_markers);
    assert_int_equal(a->n_muscles, b->n_muscles);
    for (int i = 0; i < a->n_coordinates; i++) {
        assert_string_equal(a->coordinates[i].name, b->coordinates[i].name);
        assert_int_equal(a->coordinates[i].rotational, b->coordinates[i].rotational);
    }
    for (int i = 0; i < a->n_markers; i++) {
        assert_string_equal(a->markers[i].name, b->markers[i].name);
    }
    for (int i = 0; i < 3; i++) {
        assert_true(a->gravity[i] == b->gravity[i]);
    }
    for (int i = 0; i < a->n_muscles; i++) {
        const mhe_muscle *m = &a->muscles[i], *n = &b->muscles[i];
        assert_string_equal(m->name, n->name);
        assert_true(m->max_isometric_force == n->max_isometric_force);
        assert_true(m->optimal_fiber_length == n->optimal_fiber_length);
        assert_true(m->tendon_slack_length == n->tendon_slack_length);
        assert_true(m->pennation_angle == n->pennation_angle);
        assert_true(m->max_contraction_velocity == n->max_contraction_velocity);
        assert_int_equal(a->paths[i].n_points, b->paths[i].n_points);
        assert_int_equal(m->type == MHE_MUSCLE_THELEN2003, n->type == MHE_MUSCLE_HILL_THELEN);
    }
}

static void arm19_is_its_source(void **state) {
    (void)state;
    need_data(ARM19_SOURCE);
    mhe_description *source = read_data_model(ARM19_SOURCE);
    mhe_description *model = read_model(ARM19);
    same_parts(model, source);
    uint64_t seed = 19;
    double q[MAX_N], markers[2][3 * MAX_N], lengths[2][MAX_N], mass[2][16], gravity[2][4];
    assert_int_equal(model->n_coordinates, 4);
    for (int trial = 0; trial < 50; trial++) {
        for (int i = 0; i < 4; i++) {
            q[i] = test_random(&seed, -3, 3);
        }
        test_forward(model, q, markers[0], lengths[0], mass[0], gravity[0]);
        test_forward(source, q, markers[1], lengths[1], mass[1], gravity[1]);
        for (int i = 0; i < 3 * model->n_markers; i++) {
            assert_near("marker", i, markers[0][i], markers[1][i], 1e-12);
        }
        for (int i = 0; i < model->n_muscles; i++) {
            assert_near("length", i, lengths[0][i], lengths[1][i], 1e-12);
        }
        for (int i = 0; i < 16; i++) {
            assert_near("mass", i, mass[0][i], mass[1][i], 1e-12);
        }
        for (int i = 0; i < 4; i++) {
            assert_near("gravity", i, gravity[0][i], gravity[1][i], 1e-11);
        }
    }
    mhi_description_free(source);
    mhi_description_free(model);
}

/* Numbers of `key` in row order, rows flattened. */
static int numbers(const cJSON *state, const char *key, double *out, int room) {
    const cJSON *item, *inner;
    int n = 0;
    cJSON_ArrayForEach(item, cJSON_GetObjectItem(state, key)) {
        if (!cJSON_IsArray(item)) {
            assert_true(n < room);
            out[n++] = item->valuedouble;
        }
        cJSON_ArrayForEach(inner, item) {
            assert_true(n < room);
            out[n++] = inner->valuedouble;
        }
    }
    return n;
}

static cJSON *read_json(const char *file) {
    char path[1024];
    assert_non_null(test_data_path(path, sizeof path, file));
    FILE *stream = fopen(path, "rb");
    assert_non_null(stream);
    char *text = calloc(1, 1 << 20);
    size_t length = fread(text, 1, (1 << 20) - 1, stream);
    assert_in_range(length, 1, (1 << 20) - 2);
    (void)fclose(stream);
    cJSON *json = cJSON_Parse(text);
    free(text);
    assert_non_null(json);
    return json;
}

static void check_names(const cJSON *json, const char *key, int n, const char *const *names) {
    const cJSON *list = cJSON_GetObjectItem(json, key);
    assert_int_equal(cJSON_GetArraySize(list), n);
    for (int i = 0; i < n; i++) {
        assert_string_equal(cJSON_GetArrayItem(list, i)->valuestring, names[i]);
    }
}

static void check_oracle(const mhe_description *d, const char *file) {
    cJSON *json = read_json(file);
    const cJSON *state;
    const char *names[MAX_N];
    int n = d->n_coordinates, states = 0;
    for (int i = 0; i < d->n_muscles; i++) {
        names[i] = d->muscles[i].name;
    }
    check_names(json, "muscles", d->n_muscles, names);
    for (int i = 0; i < d->n_markers; i++) {
        names[i] = d->markers[i].name;
    }
    check_names(json, "markers", d->n_markers, names);
    cJSON_ArrayForEach(state, cJSON_GetObjectItem(json, "states")) {
        double q[MAX_N], markers[3 * MAX_N], lengths[MAX_N], mass[256], gravity[MAX_N];
        double expected[1024];
        assert_int_equal(numbers(state, "q", q, MAX_N), n);
        test_forward(d, q, markers, lengths, mass, gravity);
        assert_int_equal(numbers(state, "markers", expected, 1024), 3 * d->n_markers);
        for (int i = 0; i < 3 * d->n_markers; i++) {
            assert_near("marker", i, markers[i], expected[i], 1e-9);
        }
        assert_int_equal(numbers(state, "mt_length", expected, 1024), d->n_muscles);
        for (int i = 0; i < d->n_muscles; i++) {
            assert_near("length", i, lengths[i], expected[i], 1e-9);
        }
        assert_int_equal(numbers(state, "mass_matrix", expected, 1024), n * n);
        for (int i = 0; i < n * n; i++) {
            assert_near("mass", i, mass[i], expected[i], 1e-9);
        }
        states++;
    }
    assert_true(states >= 10);
    cJSON_Delete(json);
}

static void arm19_matches_reference_values(void **state) {
    (void)state;
    need_data(ARM19_SOURCE);
    need_data("arm19/oracle_paper2021.json");
    mhe_description *model = read_model(ARM19);
    check_oracle(model, "arm19/oracle_paper2021.json");
    mhi_description_free(model);
    model = read_data_model(ARM19_SOURCE);
    check_oracle(model, "arm19/oracle_paper2021.json");
    /* InfraSpin's stray letter is reported, its length read */
    assert_int_equal(model->n_warnings, 1);
    assert_non_null(strstr(model->warnings[0], ".bioMod:825: unknown word 'z'"));
    assert_true(model->muscles[15].optimal_fiber_length == 0.076);
    mhi_description_free(model);
}

static void abduction_model_matches_reference_values(void **state) {
    (void)state;
    need_data("abduction/oracle_biorbd.json");
    mhe_description *model = read_data_model("abduction/wu_scaled.bioMod");
    assert_int_equal(model->n_coordinates, 10);
    assert_int_equal(model->n_unsupported, 0);
    check_oracle(model, "abduction/oracle_biorbd.json");
    mhi_description_free(model);
}

static void arm19_has_the_ranges_of_the_paper(void **state) {
    (void)state;
    const double half = acos(0);
    const double ranges[4][2] = {{-half, half}, {-2, half}, {-half, half}, {-0.5, 2.1}};
    const char *const files[] = {ARM19, ARM35};
    for (int f = 0; f < 2; f++) {
        mhe_description *model = read_model(files[f]);
        assert_int_equal(model->n_coordinates, 4);
        assert_int_equal(model->n_markers, 8);
        assert_int_equal(model->n_muscles, f == 0 ? 19 : 35);
        assert_int_equal(model->n_unsupported, 0);
        assert_int_equal(model->n_warnings, 0);
        for (int i = 0; i < 4; i++) {
            assert_near("lower", i, model->coordinates[i].lower, ranges[i][0], 1e-15);
            assert_near("upper", i, model->coordinates[i].upper, ranges[i][1], 1e-15);
        }
        mhi_description_free(model);
    }
}

static int starts_with(const char *text, const char *start) {
    return strncmp(text, start, strlen(start)) == 0;
}

/* Halves carry half the force each, their insertions lie 4 mm apart about the original. */
static void arm35_halves_arm19(void **state) {
    (void)state;
    mhe_description *whole = read_model(ARM19), *model = read_model(ARM35);
    int at = 0, single = 0;
    for (int i = 0; i < whole->n_muscles; i++) {
        const mhe_muscle *m = &whole->muscles[i];
        const mhe_path *path = &whole->paths[i];
        double force = 0, apart = 0;
        int halves = 0, last = path->n_points - 1;
        for (; at < model->n_muscles && starts_with(model->muscles[at].name, m->name); at++) {
            const mhe_muscle *half = &model->muscles[at];
            const mhe_path *other = &model->paths[at];
            assert_int_equal(other->n_points, path->n_points);
            assert_int_equal(half->type, m->type);
            assert_true(half->optimal_fiber_length == m->optimal_fiber_length);
            for (int k = 0; k < 3; k++) {
                apart += fabs(other->points[last].location[k] - path->points[last].location[k]);
                for (int p = 0; p < last; p++) {
                    assert_true(other->points[p].location[k] == path->points[p].location[k]);
                }
            }
            force += half->max_isometric_force;
            halves++;
        }
        single += halves == 1;
        assert_near("force", i, force, m->max_isometric_force, 1e-9);
        assert_near("distance", i, apart, halves == 2 ? 0.004 : 0, 1e-12);
    }
    assert_int_equal(at, model->n_muscles);
    assert_int_equal(single, 3);
    mhi_description_free(whole);
    mhi_description_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(arm19_is_its_source), cmocka_unit_test(arm19_matches_reference_values),
        cmocka_unit_test(abduction_model_matches_reference_values),
        cmocka_unit_test(arm19_has_the_ranges_of_the_paper), cmocka_unit_test(arm35_halves_arm19)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

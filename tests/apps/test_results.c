/* SPDX-License-Identifier: Apache-2.0 */
/* The files of a run, read back: .sto, .csv and .mat hold the same; motion.sto has the names that
 * the OpenSim GUI looks for. */
#include "results.h"
#include "support.h"

#include "io/table.h"

#include <math.h>
#include <matio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define N 1500 /* more than are kept at first */

static char folder[256];
static const char *const coordinates[] = {"elbow", "shoulder, left"};
static const char *const muscles[] = {"BRA", "BRD", "TRI"};
static const char *const markers[] = {"DELT"};

static const char *path_of(const char *name) {
    static char path[512];
    (void)snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static double value_at(int32_t row, int32_t what) {
    return sin(0.37 * row + 1.1 * what);
}

/* Of one muscle's tendon, behind q, qdot and the activations. */
static const mhe_block blocks[] = {
    {.name = "q", .role = MHE_ROLE_STATE, .count = 2, .entry_names = coordinates},
    {.name = "qdot", .role = MHE_ROLE_STATE, .first = 2, .count = 2, .entry_names = coordinates},
    {.name = "activation", .role = MHE_ROLE_STATE, .first = 4, .count = 3, .entry_names = muscles},
    {.name = "fiber_length",
     .role = MHE_ROLE_STATE,
     .first = 7,
     .count = 1,
     .entry_names = &muscles[2]},
    {.name = "excitation", .role = MHE_ROLE_CONTROL, .count = 3, .entry_names = muscles}};
static const mhe_layout layout = {.size = sizeof layout,
                                  .block_size = sizeof blocks[0],
                                  .n_blocks = sizeof blocks / sizeof blocks[0],
                                  .blocks = blocks,
                                  .n_x = 8,
                                  .n_u = 3};

static void write_all(const char *formats) {
    const mhe_estimator_info info = {.n_q = 2,
                                     .n_muscles = 3,
                                     .n_markers = 1,
                                     .n_residual_torques = 1,
                                     .ratio = 1,
                                     .coordinate_names = coordinates,
                                     .muscle_names = muscles,
                                     .marker_names = markers,
                                     .layout = &layout};
    const mhe_recording_info recording = {
        .rate = 100, .marker_unit = 1e-3, .marker_unit_name = "mm"};
    mhe_outbox *outbox = NULL;
    results *r = NULL;
    mhe_error err = {0};
    assert_int_equal(mhe_outbox_open(folder, &outbox, &err), MHE_OK);
    assert_int_equal(results_open(outbox, &info, &recording, formats, &r, &err), MHE_OK);
    for (int32_t k = 0; k < N; k++) {
        double v[24];
        for (int32_t i = 0; i < 24; i++) {
            v[i] = value_at(k, i);
        }
        const mhe_estimate e = {.size = sizeof e,
                                .status = k % 3,
                                .time = 0.01 * k,
                                .iterations = k,
                                .marker_rms = NAN,
                                .emg_rms = 0.5,
                                .q = v,
                                .qdot = v + 2,
                                .activation = v + 4,
                                .excitation = v + 7,
                                .force = v + 10,
                                .moment = v + 13,
                                .residual = v + 15,
                                .markers = v + 16,
                                .layout = &layout,
                                .states = v + 3}; /* the fibre length is v[10] */
        assert_int_equal(results_write(r, &e, v + 16, v + 4, &err), MHE_OK);
    }
    assert_int_equal(mhe_outbox_commit(outbox, &err), MHE_OK);
    assert_string_equal(err.text, "");
    results_close(r);
    mhe_outbox_close(outbox);
}

static mhi_table *read_table(const char *name) {
    mhi_table *t = NULL;
    mhe_error err = {0};
    (void)mhi_sto_read(path_of(name), &t, &err);
    assert_string_equal(err.text, "");
    return t;
}

static void check_values(const mhi_table *t, int32_t first) {
    assert_int_equal(t->n_rows, N);
    for (int32_t k = 0; k < N; k++) {
        assert_true(fabs(t->time[k] - 0.01 * k) < 1e-9);
        for (int32_t i = 0; i < t->n_columns; i++) {
            const double is = t->values[(ptrdiff_t)k * t->n_columns + i];
            assert_true(fabs(is - value_at(k, first + i)) < 1e-11); /* 12 digits */
        }
    }
}

static void tables_say_the_same(void **state) {
    (void)state;
    static const struct {
        const char *sto, *csv;
        int32_t n, first;
        const char *label;
    } files[] = {{"estimates.sto", "estimates.csv", 11, 0, "q_elbow"},
                 {"forces.sto", "forces.csv", 3, 10, "BRA"},
                 {"torques.sto", "torques.csv", 3, 13, "moment_elbow"},
                 {NULL, "markers.csv", 3, 16, "DELT_x"}};
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        mhi_table *t = NULL;
        if (files[i].sto != NULL) {
            t = read_table(files[i].sto);
            assert_int_equal(t->n_columns, files[i].n);
            assert_string_equal(t->labels[0], files[i].label);
            check_values(t, files[i].first);
            mhi_table_free(t);
        }
        if (strcmp(files[i].label, "q_elbow") == 0 || strcmp(files[i].label, "moment_elbow") == 0) {
            continue; /* a label with a comma, in quotes: looked at below */
        }
        t = read_table(files[i].csv);
        assert_int_equal(t->n_columns, files[i].n);
        assert_string_equal(t->labels[0], files[i].label);
        check_values(t, files[i].first);
        mhi_table_free(t);
    }
    mhi_table *states = read_table("estimates.sto");
    assert_string_equal(states->labels[10], "fiber_length_TRI");
    mhi_table_free(states);
    char line[128] = "";
    FILE *csv = fopen(path_of("torques.csv"), "r");
    assert_non_null(csv);
    assert_non_null(fgets(line, sizeof line, csv));
    assert_string_equal(line, "time,moment_elbow,\"moment_shoulder, left\",residual_elbow\n");
    (void)fclose(csv);
    mhi_table *quality = read_table("quality.csv");
    assert_true(isnan(quality->values[4]) && quality->values[5] == 0.5);
    mhi_table_free(quality);
}

static void motion_has_opensim_names(void **state) {
    (void)state;
    static const char labels[] = "time\telbow\tshoulder, left\tBRA.activation\t"
                                 "BRD.activation\tTRI.activation\n";
    static const char *const lines[] = {"version=1\n",    "nRows=1500\n", "nColumns=6\n",
                                        "inDegrees=no\n", "endheader\n",  labels};
    char line[256];
    FILE *file = fopen(path_of("motion.sto"), "r");
    assert_non_null(file);
    assert_non_null(fgets(line, sizeof line, file));
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        assert_non_null(fgets(line, sizeof line, file));
        assert_string_equal(line, lines[i]);
    }
    (void)fclose(file);
    mhi_table *t = read_table("motion.sto");
    for (int32_t k = 0; k < N; k++) {
        for (int32_t i = 0; i < 5; i++) {
            const double is = t->values[5 * k + i];
            assert_true(fabs(is - value_at(k, i < 2 ? i : i + 2)) < 1e-11);
        }
    }
    mhi_table_free(t);
}

static void check_mat(mat_t *mat, const char *name, int32_t n, int32_t first, const char *label) {
    matvar_t *v = Mat_VarRead(mat, name);
    assert_non_null(v);
    const matvar_t *time = Mat_VarGetStructFieldByName(v, "time", 0);
    const matvar_t *data = Mat_VarGetStructFieldByName(v, "data", 0);
    matvar_t *labels = Mat_VarGetStructFieldByName(v, "labels", 0);
    assert_true(time->dims[0] == N && time->dims[1] == 1);
    assert_true(data->dims[0] == N && data->dims[1] == (size_t)n);
    assert_true(labels->dims[0] == 1 && labels->dims[1] == (size_t)n);
    const matvar_t *last = Mat_VarGetCell(labels, n - 1);
    assert_int_equal(last->dims[1], strlen(label));
    assert_memory_equal(last->data, label, strlen(label));
    for (int32_t k = 0; k < N; k++) {
        assert_true(((const double *)time->data)[k] == 0.01 * k);
        for (int32_t i = 0; i < n && first >= 0; i++) {
            assert_true(((const double *)data->data)[i * N + k] == value_at(k, first + i));
        }
    }
    Mat_VarFree(v);
}

static void matlab_file_holds_all(void **state) {
    (void)state;
    mat_t *mat = Mat_Open(path_of("results.mat"), MAT_ACC_RDONLY);
    assert_non_null(mat);
    check_mat(mat, "estimates", 11, 0, "fiber_length_TRI");
    check_mat(mat, "forces", 3, 10, "TRI");
    check_mat(mat, "torques", 3, 13, "residual_elbow");
    check_mat(mat, "markers", 3, 16, "DELT_z");
    check_mat(mat, "quality", 6, -1, "emg_rms");
    (void)Mat_Close(mat);
}

static void only_what_was_asked_for(void **state) {
    (void)state;
    (void)unlink(path_of("results.mat"));
    (void)unlink(path_of("forces.csv"));
    write_all("[]");
    assert_int_equal(access(path_of("forces.sto"), F_OK), 0);
    assert_int_not_equal(access(path_of("results.mat"), F_OK), 0);
    assert_int_not_equal(access(path_of("forces.csv"), F_OK), 0);
}

static int set_up(void **state) {
    (void)state;
    if (test_folder(folder, sizeof folder) == NULL) {
        return -1;
    }
    write_all("[csv, mat]");
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    static const char *const files[] = {
        "estimates.sto", "motion.sto",    "forces.sto",  "torques.sto", "markers.trc",
        "quality.sto",   "estimates.csv", "torques.csv", "markers.csv", "quality.csv"};
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        (void)unlink(path_of(files[i]));
    }
    return rmdir(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tables_say_the_same), cmocka_unit_test(motion_has_opensim_names),
        cmocka_unit_test(matlab_file_holds_all), cmocka_unit_test(only_what_was_asked_for)};
    return cmocka_run_group_tests(tests, set_up, tear_down);
}

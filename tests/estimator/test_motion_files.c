/* SPDX-License-Identifier: Apache-2.0 */
/* The demo's markers and EMG in one .c3d are read as they are from .trc and .sto; markers in
 * another unit than the file says are noticed. */
#include "c3d_writer.h"
#include "estimator/create.h"
#include "estimator/recording.h"
#include "io/model_file.h"
#include "io/motion_file.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define ARM MHE_TEST_SOURCE_DIR "/models/arm19/"

static char folder[256], told[2048];
static mhi_table *markers, *emg; /* of the demo */
static mhe_description *model;

static void listen(const mhe_host *host, int32_t level, const char *text) {
    const size_t used = strlen(told);
    (void)host, (void)level;
    (void)snprintf(told + used, sizeof told - used, "%s\n", text);
}

static const void *no_service(const mhe_host *host, const char *id) {
    (void)host, (void)id;
    return NULL;
}

static const mhe_host host = {.size = sizeof host, .log = listen, .service = no_service};

/* mm; a gap now and then */
static void place(int32_t frame, int32_t point, double xyz[3]) {
    for (int axis = 0; axis < 3; axis++) {
        const double metres = markers->values[(ptrdiff_t)frame * 24 + 3 * point + axis];
        xyz[axis] = (frame + point) % 50 == 7 ? NAN : 1000 * metres;
    }
}

/* the writer's scale of channel c is c + 1 */
static double signal_at(int32_t row, int32_t channel) {
    return emg->values[(ptrdiff_t)row * emg->n_columns + channel] / (channel + 1);
}

static test_c3d demo(void) {
    return (test_c3d){.processor = 85,
                      .is_float = 1,
                      .n_points = 8,
                      .n_channels = 19,
                      .per_frame = 1,
                      .n_frames = 301,
                      .first = 1,
                      .rate = 100,
                      .scale = 1,
                      .unit = "mm",
                      .labels = (const char *const *)markers->labels,
                      .channels = (const char *const *)emg->labels,
                      .gain = 1,
                      .general = 1,
                      .point = place,
                      .sample = signal_at};
}

static mhe_status read_data(const char *marker_file, const char *emg_file, mhi_recording **r,
                            mhe_error *err) {
    mhi_run run = {.path = "test.yaml", .data = {.markers = marker_file, .emg = emg_file}};
    run.horizon.window = 7;
    run.horizon.ratio = 1;
    told[0] = '\0';
    return mhi_recording_read(&run, model, &host, r, err);
}

static void c3d_is_like_trc_and_sto(void **state) {
    (void)state;
    char path[300];
    test_c3d c = demo();
    mhi_recording *text = NULL, *binary = NULL;
    mhe_error err = {0};
    (void)snprintf(path, sizeof path, "%s/demo.c3d", folder);
    assert_int_equal(test_c3d_write(&c, path), 0);
    assert_int_equal(read_data(ARM "demo_markers.trc", ARM "demo_emg.sto", &text, &err), MHE_OK);
    assert_int_equal(read_data(path, path, &binary, &err), MHE_OK);
    assert_string_equal(told, "");
    assert_int_equal(binary->n_frames, 301);
    assert_int_equal(binary->n_markers_found, 8);
    assert_int_equal(binary->n_emg_found, 19);
    int32_t column[8];
    for (int i = 0; i < 8; i++) {
        column[i] = mhi_table_find(markers, model->markers[i].name);
    }
    for (int32_t k = 0; k < 301; k++) {
        assert_true(fabs(binary->time[k] - text->time[k]) < 1e-9);
        for (int32_t i = 0; i < 24; i++) {
            const double is = binary->markers[24 * k + i], was = text->markers[24 * k + i];
            const int gap = (k + column[i / 3]) % 50 == 7;
            assert_true(gap ? isnan(is) : fabs(is - was) < 1e-7); /* single precision */
        }
        for (int32_t i = 0; i < 19; i++) {
            assert_true(fabs(binary->emg[19 * k + i] - text->emg[19 * k + i]) < 1e-7);
        }
    }
    (void)unlink(path);
    mhi_recording_free(text);
    mhi_recording_free(binary);
}

/* The numbers are mm; what the file says is not always true. */
static void a_wrong_unit_is_noticed(void **state) {
    (void)state;
    static const char *const units[] = {"mm", "cm", "m"};
    char path[300];
    mhi_recording *right = NULL;
    mhe_error err = {0};
    (void)snprintf(path, sizeof path, "%s/demo.c3d", folder);
    for (int u = 0; u < 3; u++) {
        test_c3d c = demo();
        mhi_recording *r = NULL;
        c.unit = units[u];
        assert_int_equal(test_c3d_write(&c, path), 0);
        assert_int_equal(read_data(path, NULL, &r, &err), MHE_OK);
        assert_string_equal(r->unit_name, "mm");
        assert_true(fabs(r->unit - 1e-3) < 1e-12);
        assert_int_equal(strstr(told, "they are taken as mm") != NULL, u > 0);
        if (u == 0) {
            assert_string_equal(told, "");
            right = r;
            continue;
        }
        for (int32_t i = 0; i < 301 * 24; i++) {
            assert_true(isnan(r->markers[i]) ? isnan(right->markers[i])
                                             : fabs(r->markers[i] - right->markers[i]) < 1e-12);
        }
        mhi_recording_free(r);
    }
    mhi_recording_free(right);
    (void)unlink(path);
}

static void labels_with_a_subject_and_extra_markers(void **state) {
    (void)state;
    char path[300], with[8][40];
    const char *names[8];
    test_c3d c = demo();
    mhi_recording *r = NULL;
    mhe_error err = {0};
    (void)snprintf(path, sizeof path, "%s/demo.c3d", folder);
    for (int i = 0; i < 8; i++) {
        (void)snprintf(with[i], sizeof with[i], "Anna:%s", markers->labels[i]);
        names[i] = with[i];
    }
    names[2] = "*42"; /* Vicon's name of what was not labelled */
    c.labels = names;
    assert_int_equal(test_c3d_write(&c, path), 0);
    assert_int_equal(read_data(path, NULL, &r, &err), MHE_OK);
    assert_int_equal(r->n_markers_found, 7);
    assert_non_null(strstr(told, "columns that are no marker of the model are left out: *42"));
    assert_non_null(strstr(told, "no column for marker EPICl"));
    mhi_recording_free(r);
    (void)unlink(path);
}

static void frames_that_are_too_few(void **state) {
    (void)state;
    char path[300];
    test_c3d c = demo();
    mhi_recording *r = NULL;
    mhe_error err = {0};
    (void)snprintf(path, sizeof path, "%s/demo.c3d", folder);
    c.n_frames = 3;
    assert_int_equal(test_c3d_write(&c, path), 0);
    assert_int_equal(read_data(path, path, &r, &err), MHE_E_INPUT);
    assert_non_null(strstr(err.text, "demo.c3d: 3 frames are too few for a window of 7"));
    (void)unlink(path);
}

static int set_up(void **state) {
    (void)state;
    mhe_error err = {0};
    return test_folder(folder, sizeof folder) == NULL ||
           mhi_markers_read(ARM "demo_markers.trc", &markers, &err) != MHE_OK ||
           mhi_signals_read(ARM "demo_emg.sto", &emg, &err) != MHE_OK ||
           mhi_model_read(ARM "arm19.osim", &model, &err) != MHE_OK;
}

static int tear_down(void **state) {
    (void)state;
    mhi_table_free(markers);
    mhi_table_free(emg);
    mhi_description_free(model);
    return rmdir(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(c3d_is_like_trc_and_sto),
                                       cmocka_unit_test(a_wrong_unit_is_noticed),
                                       cmocka_unit_test(labels_with_a_subject_and_extra_markers),
                                       cmocka_unit_test(frames_that_are_too_few)};
    return cmocka_run_group_tests(tests, set_up, tear_down);
}

/* SPDX-License-Identifier: Apache-2.0 */
#include "track.h"

#include "estimator/start.h"
#include "io/model_file.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void drop_line(const mhe_host *host, int32_t level, const char *text) {
    (void)host, (void)level, (void)text;
}

static const void *no_service(const mhe_host *host, const char *id) {
    (void)host, (void)id;
    return NULL;
}

const mhe_host track_host = {.size = sizeof track_host, .log = drop_line, .service = no_service};

static void expect_ok(mhe_status status, const mhe_error *err) {
    if (status != MHE_OK) {
        print_error("%s\n", err->text);
    }
    assert_int_equal(status, MHE_OK);
}

/* The shipped config in a folder of its own, beside a link to the data. */
static void read_config(track *t, const char *name, const char *data, const char *const *set,
                        int32_t n_set) {
    char folder[256], config[300], link[300], command[1500];
    mhe_error err = {0};
    assert_non_null(test_folder(folder, sizeof folder));
    (void)snprintf(link, sizeof link, "%s/abduction", folder);
    (void)snprintf(config, sizeof config, "%s/%s", folder, name);
    (void)snprintf(command, sizeof command, "cp %s/models/abduction/%s %s", MHE_TEST_SOURCE_DIR,
                   name, config);
    assert_int_equal(symlink(data, link), 0);
    assert_int_equal(system(command), 0);
    expect_ok(mhi_registry_create(&track_host, &t->registry, &err), &err);
    expect_ok(mhi_run_read(config, set, n_set, t->registry, &t->run, &err), &err);
    expect_ok(mhi_estimator_read_model(t->run, &track_host, &t->model, &err), &err);
    expect_ok(mhi_recording_read(t->run, t->model, &track_host, &t->recording, &err), &err);
    assert_int_equal(unlink(link), 0); /* the model is read again: by its real path */
    (void)unlink(config);
    (void)rmdir(folder);
}

int track_open(track *t, const char *config, const char *const *set, int32_t n_set) {
    char data[512], file[600];
    memset(t, 0, sizeof *t);
    if (test_data_path(data, sizeof data, "abduction") == NULL) {
        return 0;
    }
    read_config(t, config, data, set, n_set);
    (void)snprintf(file, sizeof file, "%s/wu_scaled.bioMod", data);
    t->run->model_file.file = mhi_arena_text(&t->run->arena, file);
    assert_true(t->model->n_coordinates <= 64 && t->model->n_muscles <= 64);
    return 1;
}

static void keep(track *t, const mhe_estimate *estimate) {
    const int32_t k = t->n_estimates++, n_q = t->model->n_coordinates, n_m = t->model->n_muscles;
    t->n_converged += estimate->status == MHE_FRAME_OK;
    t->n_predicted += estimate->status == MHE_FRAME_PREDICTED;
    t->marker_rms[k] = estimate->marker_rms;
    memcpy(t->q + k * n_q, estimate->q, sizeof(double) * (size_t)n_q);
    memcpy(t->force + k * n_m, estimate->force, sizeof(double) * (size_t)n_m);
    memcpy(t->activation + k * n_m, estimate->activation, sizeof(double) * (size_t)n_m);
}

static void solve_kinematics(track *t, const mhe_estimator *estimator) {
    const mhi_system *system = mhi_estimator_system(estimator);
    mhi_system_context *context = NULL;
    mhi_start *start = NULL;
    mhe_error err = {0};
    double q[64] = {0};
    expect_ok(mhi_system_context_create(system, &context, &err), &err);
    expect_ok(mhi_start_create(system, context, &start, &err), &err);
    for (int32_t k = 0; k < t->n_estimates; k++) {
        const double *markers =
            t->recording->markers + (ptrdiff_t)(TRACK_FIRST + k) * 3 * t->model->n_markers;
        expect_ok(
            (k == 0 ? mhi_start_search : mhi_start_posture)(start, markers, q, &t->ik_rms[k], &err),
            &err);
        memcpy(t->ik_q + k * t->model->n_coordinates, q,
               sizeof(double) * (size_t)t->model->n_coordinates);
    }
    mhi_start_free(start);
    mhi_system_context_free(context);
}

void track_run(track *t) {
    const mhi_recording *r = t->recording;
    mhe_estimator *estimator = NULL;
    mhe_error err = {0};
    expect_ok(mhi_estimator_create(t->run, &track_host, &estimator, &err), &err);
    for (int32_t k = TRACK_FIRST; k < TRACK_FIRST + TRACK_FRAMES; k++) {
        const mhe_frame frame = {.size = sizeof frame,
                                 .time = r->time[k],
                                 .markers = r->markers + (ptrdiff_t)k * 3 * t->model->n_markers,
                                 .emg = r->emg + (ptrdiff_t)k * t->model->n_muscles};
        mhe_estimate estimate = {.size = sizeof estimate};
        int32_t ready = 0;
        expect_ok(mhe_estimator_push(estimator, &frame, &estimate, &ready, &err), &err);
        if (ready) {
            keep(t, &estimate);
        }
    }
    assert_int_equal(t->n_estimates, TRACK_FRAMES - t->run->horizon.window);
    solve_kinematics(t, estimator);
    mhe_estimator_close(estimator);
}

void track_close(track *t) {
    mhi_recording_free(t->recording);
    mhi_description_free(t->model);
    mhi_run_free(t->run);
    mhi_registry_free(t->registry);
}

int32_t track_coordinate(const track *t, const char *name) {
    int32_t i = 0;
    while (i < t->model->n_coordinates && strcmp(t->model->coordinates[i].name, name) != 0) {
        i++;
    }
    assert_in_range(i, 0, t->model->n_coordinates - 1);
    return i;
}

int32_t track_muscle(const track *t, const char *name) {
    int32_t i = 0;
    while (i < t->model->n_muscles && strcmp(t->model->muscles[i].name, name) != 0) {
        i++;
    }
    assert_in_range(i, 0, t->model->n_muscles - 1);
    return i;
}

double *track_marker(track *t, int32_t frame, const char *name) {
    int32_t i = 0;
    while (i < t->model->n_markers && strcmp(t->model->markers[i].name, name) != 0) {
        i++;
    }
    assert_in_range(i, 0, t->model->n_markers - 1);
    return t->recording->markers + 3 * ((ptrdiff_t)frame * t->model->n_markers + i);
}

double *track_emg(track *t, int32_t frame, const char *muscle) {
    return t->recording->emg + (ptrdiff_t)frame * t->model->n_muscles + track_muscle(t, muscle);
}

double track_change(const track *t, const double *a, const double *b, int32_t n_columns) {
    double squares = 0;
    for (int32_t i = 0; i < t->n_estimates * n_columns; i++) {
        squares += (a[i] - b[i]) * (a[i] - b[i]);
    }
    return sqrt(squares / (t->n_estimates * n_columns));
}

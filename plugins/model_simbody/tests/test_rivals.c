/* SPDX-License-Identifier: Apache-2.0 */
/* Obstacles of public models that are in each other's way: where OpenSim's rules take one or the
 * other, lengths go over without a jump and have their own derivatives (docs/paths.md). */
#include "public_models.h"
#include "test_models.h"

#include "io/model_file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define STEPS 200
#define JUMP 1e-3 /* m */
#define DEG (3.14159265358979323846 / 180)

typedef struct sweep {
    const char *model, *path, *coordinate;
    double from, to; /* degrees */
} sweep;

static const sweep sweeps[] = {
    {"MOBL_ARMS_41", "TMIN", "elv_angle", -88, -80},
    {"MOBL_ARMS_41", "TMIN", "shoulder_rot", 96, 99},
    {"MOBL_ARMS_41", "TRIlong", "shoulder_elv", 160, 175},
    {"MOBL_ARMS_41", "CORB", "shoulder_rot", 75, 80},
    {"MOBL_ARMS_41", "LAT1", "shoulder_elv", 121, 133},
    {"ThoracoscapularShoulderModel", "TeresMajor", "scapula_elevation", -36, -31.7},
    {"ThoracoscapularShoulderModel", "TeresMajor", "scapula_elevation", -89, -80},
    {"ThoracoscapularShoulderModel", "TeresMajor", "scapula_elevation", -80, -74},
};
#define N_SWEEPS (sizeof sweeps / sizeof sweeps[0])

/* A model with the one path of a sweep: the others would take nearly all of the time. */
typedef struct subject {
    mhe_description *description, alone;
    test_instance instance;
    int32_t coordinate, n_q;
    double *length, *length_q, *length_qq, *still, *q;
} subject;

static void subject_open(const sweep *w, subject *s) {
    char file[256], path[1024];
    mhe_error err = {0};
    (void)snprintf(file, sizeof file, "opensim/%s.osim", w->model);
    if (test_data_path(path, sizeof path, file) == NULL) {
        skip();
    }
    if (mhi_model_read(path, &s->description, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    const mhe_description *d = s->description;
    size_t n_q = (size_t)d->n_coordinates;
    s->alone = *d;
    s->alone.n_paths = s->alone.n_muscles = 0;
    for (int32_t i = 0; i < d->n_muscles && s->alone.n_paths == 0; i++) {
        if (strcmp(d->paths[i].name, w->path) == 0) {
            s->alone.paths = &d->paths[i];
            s->alone.muscles = &d->muscles[i];
            s->alone.n_paths = s->alone.n_muscles = 1;
        }
    }
    assert_int_equal(s->alone.n_paths, 1);
    test_open(&s->instance, &s->alone, 0);
    s->n_q = d->n_coordinates;
    s->coordinate = -1;
    s->length = calloc(1, sizeof(double));
    s->length_q = calloc(n_q, sizeof(double));
    s->length_qq = calloc(n_q * n_q, sizeof(double));
    s->still = calloc(n_q, sizeof(double));
    s->q = calloc(n_q, sizeof(double));
    assert_true(s->length && s->length_q && s->length_qq && s->still && s->q);
    for (int32_t i = 0; i < s->n_q; i++) {
        s->q[i] = d->coordinates[i].value;
        if (strcmp(d->coordinates[i].name, w->coordinate) == 0) {
            s->coordinate = i;
        }
    }
    assert_true(s->coordinate >= 0);
}

static void subject_close(subject *s) {
    test_close(&s->instance);
    mhi_description_free(s->description);
    free(s->length);
    free(s->length_q);
    free(s->length_qq);
    free(s->still);
    free(s->q);
}

static double evaluate(subject *s, const double *q, int second) {
    mhe_kinematics out = {.size = sizeof out,
                          .length = s->length,
                          .length_q = s->length_q,
                          .length_qq = second ? s->length_qq : NULL};
    mhe_error err = {0};
    if (s->instance.ops->kinematics(s->instance.context, q, s->still, &out, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    return s->length[0];
}

static int length_of_q(void *data, const double *q, double *y) {
    subject *s = data;
    *y = evaluate(s, q, 0);
    return 0;
}

static int gradient_of_q(void *data, const double *q, double *y) {
    subject *s = data;
    (void)evaluate(s, q, 0);
    memcpy(y, s->length_q, sizeof *y * (size_t)s->n_q);
    return 0;
}

/* Errors of both derivatives at s->q, by step study. */
static void study(subject *s, double *worst) {
    size_t n = (size_t)s->n_q;
    double *g = calloc(n, sizeof *g), *h = calloc(n * n, sizeof *h);
    assert_true(g && h);
    (void)evaluate(s, s->q, 1);
    memcpy(g, s->length_q, sizeof *g * n);
    memcpy(h, s->length_qq, sizeof *h * n * n);
    worst[0] = fmax(worst[0], test_jacobian_error(length_of_q, s, s->q, s->n_q, 1, g));
    worst[1] = fmax(worst[1], test_jacobian_error(gradient_of_q, s, s->q, s->n_q, s->n_q, h));
    free(g);
    free(h);
}

static void lengths_go_over(void **state) {
    (void)state;
    for (size_t k = 0; k < N_SWEEPS; k++) {
        const sweep *w = &sweeps[k];
        subject s = {0};
        double last = NAN, worst[2] = {0, 0}, largest = 0;
        subject_open(w, &s);
        for (int i = 0; i <= STEPS; i++) {
            s.q[s.coordinate] = (w->from + (w->to - w->from) * i / STEPS) * DEG;
            double length = evaluate(&s, s.q, 0);
            largest = i > 0 ? fmax(largest, fabs(length - last)) : 0;
            last = length;
            if (i % 100 == 50) {
                study(&s, worst);
            }
        }
        print_message("%s %s: %.2f mm a step, first %.1e, second %.1e\n", w->path, w->coordinate,
                      1e3 * largest, worst[0], worst[1]);
        assert_true(largest < JUMP);
        assert_true(worst[0] < 1e-7);
        assert_true(worst[1] < 1e-5);
        subject_close(&s);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(lengths_go_over)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

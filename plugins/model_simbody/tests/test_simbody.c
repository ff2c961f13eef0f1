/* SPDX-License-Identifier: Apache-2.0 */
/* dynamics: simbody against the recursion on 25 public models, with every kind of joint, couplers,
 * massless bodies, inertias that break the triangle inequality, and the loops that two of them
 * have. */
#include "json.h"
#include "test_models.h"

#include "io/model_file.h"

#include <cjson/cJSON.h>

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LIMIT 1e-9 /* of an array's largest entry */
#define STATES 5

typedef struct values {
    double *mass, *bias, *tau, *body, *marker, *loops;
    size_t n[6];
} values;

static double *numbers(size_t n) {
    double *out = calloc(n + 1, sizeof *out);
    assert_non_null(out);
    return out;
}

static values take(const mhe_description *d) {
    const size_t n = (size_t)d->n_coordinates;
    return (values){numbers(n * n),
                    numbers(n),
                    numbers(n),
                    numbers(12 * (size_t)d->n_bodies),
                    numbers(3 * (size_t)d->n_markers),
                    numbers(3 * (size_t)mhe_loop_rows(d)),
                    {n * n, n, n, 12 * (size_t)d->n_bodies, 3 * (size_t)d->n_markers,
                     3 * (size_t)mhe_loop_rows(d)}};
}

static void give_back(values *v) {
    double *all[] = {v->mass, v->bias, v->tau, v->body, v->marker, v->loops};
    for (int i = 0; i < 6; i++) {
        free(all[i]);
    }
}

static void evaluate(const test_instance *t, const double *q, const double *v, const double *vdot,
                     values *out) {
    const mhe_kinematics wanted = {.size = sizeof wanted,
                                   .mass = out->mass,
                                   .bias = out->bias,
                                   .body = out->body,
                                   .marker = out->marker};
    const size_t n_c = out->n[5] / 3;
    const mhe_loop_values loops = {.size = sizeof loops,
                                   .gap = out->loops,
                                   .rate = out->loops + n_c,
                                   .acceleration = out->loops + 2 * n_c};
    mhe_error err = {0};
    if (t->ops->kinematics(t->context, q, v, &wanted, &err) != MHE_OK ||
        t->ops->inverse_dynamics(t->context, vdot, out->tau, NULL, NULL, &err) != MHE_OK ||
        (n_c > 0 && t->ops->loops(t->context, vdot, &loops, &err) != MHE_OK)) {
        fail_msg("%s: %s", t->description->source, err.text);
    }
}

static double worst;

static void compare(const char *model, const values *a, const values *b) {
    static const char *const what[] = {"mass", "bias", "tau", "bodies", "markers", "loops"};
    const double *x[] = {a->mass, a->bias, a->tau, a->body, a->marker, a->loops};
    const double *y[] = {b->mass, b->bias, b->tau, b->body, b->marker, b->loops};
    for (int k = 0; k < 6; k++) {
        double scale = 1e-3, off = 0;
        for (size_t i = 0; i < a->n[k]; i++) {
            scale = fmax(scale, fabs(x[k][i]));
            off = fmax(off, fabs(x[k][i] - y[k][i]));
        }
        if (!(off < LIMIT * scale)) {
            fail_msg("%s: %s is off by %g of %g", model, what[k], off, scale);
        }
        worst = fmax(worst, off / scale);
    }
}

static double member(const cJSON *object, const char *name) {
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, name);
    return item == NULL ? 0 : item->valuedouble;
}

/* At the oracle's poses, at which loops are closed and its speeds keep them so; accelerations are
 * any: the rates of loops are compared all the same, in the same axes. */
static void compare_model(const char *osim, const char *oracle) {
    mhe_description *d = NULL;
    mhe_error err = {0};
    if (mhi_model_read_unlocked(osim, &d, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    assert_int_equal(d->n_unsupported, 0);
    test_instance own, simbody;
    test_open(&own, d, SIMBODY_DYNAMICS_RECURSIVE);
    test_open(&simbody, d, SIMBODY_DYNAMICS_SIMBODY);
    values a = take(d), b = take(d);
    double *q = numbers(3 * (size_t)d->n_coordinates), *v = q + d->n_coordinates;
    double *vdot = v + d->n_coordinates;
    cJSON *root = test_json(oracle);
    for (int k = 0; k < STATES; k++) {
        const cJSON *pose =
            cJSON_GetArrayItem(cJSON_GetObjectItemCaseSensitive(root, "poses"), 2 * k);
        const cJSON *rate = cJSON_GetObjectItemCaseSensitive(pose, "qdot");
        rate = rate != NULL ? rate : cJSON_GetObjectItemCaseSensitive(pose, "u");
        for (int32_t i = 0; i < d->n_coordinates; i++) {
            const char *name = d->coordinates[i].name;
            q[i] = member(cJSON_GetObjectItemCaseSensitive(pose, "q"), name);
            v[i] = member(rate, name);
            vdot[i] = member(cJSON_GetObjectItemCaseSensitive(pose, "udot"), name);
        }
        evaluate(&own, q, v, vdot, &a);
        evaluate(&simbody, q, v, vdot, &b);
        compare(osim, &a, &b);
    }
    cJSON_Delete(root);
    free(q);
    give_back(&a);
    give_back(&b);
    test_close(&own);
    test_close(&simbody);
    mhi_description_free(d);
}

static void simbody_carries_every_model(void **state) {
    (void)state;
    char folder[1024];
    int n = 0;
    if (test_data_path(folder, sizeof folder, "opensim") == NULL) {
        skip();
    }
    DIR *dir = opendir(folder);
    assert_non_null(dir);
    for (struct dirent *entry = readdir(dir); entry != NULL; entry = readdir(dir)) {
        const char *dot = strstr(entry->d_name, ".oracle.json");
        char osim[1400], oracle[1400];
        if (dot != NULL) {
            (void)snprintf(osim, sizeof osim, "%s/%.*s.osim", folder, (int)(dot - entry->d_name),
                           entry->d_name);
            (void)snprintf(oracle, sizeof oracle, "%s/%s", folder, entry->d_name);
            compare_model(osim, oracle);
            n++;
        }
    }
    (void)closedir(dir);
    print_message("%d models: %.1e\n", n, worst);
    assert_true(n >= 25);
}

/* A caller that keeps its arrays gets the same as one whose arrays are cleared for each call: what
 * stood at a path's own coordinates goes, and nothing else is touched. */
static void kept_arrays_hold_the_same_lengths(void **state) {
    (void)state;
    mhe_description *d = NULL;
    assert_int_equal(mhi_model_read_unlocked(
                         MHE_TEST_SOURCE_DIR "/models/gait10dof/gait10dof18musc.osim", &d, NULL),
                     MHE_OK);
    test_instance t;
    test_open(&t, d, SIMBODY_DYNAMICS_RECURSIVE);
    const size_t n = (size_t)d->n_coordinates, n_p = (size_t)d->n_paths, rows = n_p * n;
    assert_true(n > 8); /* below, all is cleared */
    double *fresh = numbers(rows * (1 + n)), *kept = numbers(rows * (1 + n)), *q = numbers(2 * n);
    uint8_t *pattern = calloc(rows, 1);
    assert_non_null(pattern);
    assert_int_equal(t.ops->path_pattern(t.self, pattern, NULL), MHE_OK);
    for (int trial = 0; trial < 3; trial++) {
        for (size_t i = 0; i < n; i++) {
            q[i] = 0.3 * sin((double)(1 + 7 * i) + 3 * trial);
        }
        for (size_t i = 0; i < rows; i++) {
            const size_t p = i / n;
            kept[i] = pattern[i] ? 7 : 0;
            for (size_t j = 0; j < n; j++) {
                kept[rows + i * n + j] = pattern[i] && pattern[p * n + j] ? 7 : 0;
            }
        }
        const mhe_kinematics all = {
            .size = sizeof all, .length_q = fresh, .length_qq = fresh + rows};
        const mhe_kinematics own = {
            .size = sizeof own, .length_q = kept, .length_qq = kept + rows, .lengths_clear = 1};
        assert_int_equal(t.ops->kinematics(t.context, q, q + n, &all, NULL), MHE_OK);
        assert_int_equal(t.ops->kinematics(t.context, q, q + n, &own, NULL), MHE_OK);
        assert_memory_equal(kept, fresh, sizeof *kept * rows * (1 + n));
    }
    free(pattern);
    free(fresh);
    free(kept);
    free(q);
    test_close(&t);
    mhi_description_free(d);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kept_arrays_hold_the_same_lengths),
        cmocka_unit_test(simbody_carries_every_model),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

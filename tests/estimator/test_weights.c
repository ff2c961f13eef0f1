/* SPDX-License-Identifier: Apache-2.0 */
/* data.marker_weights: a map, OpenSim's inverse kinematics tasks, and what comes of them in costs
 * and postures. */
#include "estimator/start.h"
#include "estimator/tasks.h"
#include "fixture.h"
#include "io/ik_tasks.h"
#include "support.h"

#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define HEAD "model: {file: $ARM19}\nmuscle: {curves: paper2021}\n"
#define TASKS MHE_TEST_SOURCE_DIR "/tests/ocp/tasks.xml"
#define COSTS "costs: [{plugin: mhe.cost.track, signal: markers, sigma: 0.01}]\n"

static int32_t marker(const test_fixture *f, const char *name) {
    const mhe_description *d = mhi_system_description(f->system);
    for (int32_t i = 0; i < d->n_markers; i++) {
        if (strcmp(d->markers[i].name, name) == 0) {
            return i;
        }
    }
    fail_msg("no marker %s", name);
    return -1;
}

static void tasks_are_read(void **state) {
    mhi_arena arena = {0};
    mhi_ik_task *tasks = NULL;
    int32_t n = 0;
    mhe_error err = {0};
    (void)state;
    assert_int_equal(mhi_ik_tasks_read(TASKS, &arena, &tasks, &n, &err), MHE_OK);
    assert_int_equal(n, 10);
    assert_string_equal(tasks[0].name, "ARMl");
    assert_true(tasks[0].weight == 9 && tasks[2].weight == 0 && tasks[4].weight == 0);
    assert_true(tasks[6].kind == MHI_IK_VALUE && tasks[6].value == 0.3 && tasks[6].weight == 2);
    assert_true(tasks[7].kind == MHI_IK_DEFAULT && tasks[8].weight == 0);
    assert_int_equal(tasks[9].kind, MHI_IK_FILE);
    mhi_arena_free(&arena);
}

/* A file of `text` is refused with `why`. */
static void expect_refused(const char *text, const char *why) {
    char folder[256], path[300];
    assert_non_null(test_folder(folder, sizeof folder));
    (void)snprintf(path, sizeof path, "%s/tasks.xml", folder);
    const int file = open(path, O_WRONLY | O_CREAT, 0600);
    mhi_arena arena = {0};
    mhi_ik_task *tasks = NULL;
    int32_t n = 0;
    mhe_error err = {0};
    assert_true(file >= 0 && write(file, text, strlen(text)) == (ssize_t)strlen(text));
    (void)close(file);
    assert_int_equal(mhi_ik_tasks_read(path, &arena, &tasks, &n, &err), MHE_E_INPUT);
    (void)unlink(path);
    mhi_arena_free(&arena);
    if (strstr(err.text, why) == NULL) {
        fail_msg("'%s' does not say '%s'", err.text, why);
    }
}

static void wrong_files_are_refused(void **state) {
    (void)state;
    expect_refused("<a>\n<b></a>", ":2: not XML");
    expect_refused("<Model/>", ":1: no <IKTaskSet> with tasks");
    expect_refused("<IKTaskSet><objects>\n<IKMarkerTask name='A'><weight>-1</weight>"
                   "</IKMarkerTask></objects></IKTaskSet>",
                   ":2: the weight of 'A' is negative");
    expect_refused("<IKTaskSet><objects>\n<IKMarkerTask name='A'><weight>x</weight>"
                   "</IKMarkerTask></objects></IKTaskSet>",
                   ":2: <weight>: 'x' is no finite number");
}

static void names_are_matched(void **state) {
    static const char yaml[] =
        HEAD COSTS "data:\n  marker_weights: {file: " TASKS ", LARM*: 3, ARMl: 0}\n";
    test_fixture f;
    mhi_arena arena = {0};
    const mhi_tasks *t = NULL;
    (void)state;
    if (test_fixture_open(&f, yaml) != MHE_OK) {
        fail_msg("%s", f.err.text);
    }
    assert_int_equal(
        mhi_tasks_read(f.run, mhi_system_description(f.system), NULL, &arena, &t, &f.err), MHE_OK);
    assert_true(t->marker[marker(&f, "ARMl")] == 0);
    assert_true(t->marker[marker(&f, "EPICl")] == 20);
    assert_true(t->marker[marker(&f, "LARMl")] == 3 && t->marker[marker(&f, "LARM_elb")] == 3);
    assert_true(t->marker[marker(&f, "STYLu")] == 0); /* no task */
    assert_true(t->coordinate[0] == 2 && t->value[0] == 0.3);
    assert_true(t->coordinate[1] == 0.7 && t->value[1] == 0 && t->coordinate[3] == 0);
    mhi_arena_free(&arena);
    test_fixture_close(&f);
}

static void expect_config_error(const char *weights, const char *why) {
    char yaml[1024];
    test_fixture f;
    (void)snprintf(yaml, sizeof yaml, HEAD COSTS "data:\n  marker_weights: %s\n", weights);
    assert_int_not_equal(test_fixture_open(&f, yaml), MHE_OK);
    if (strstr(f.err.text, why) == NULL) {
        fail_msg("'%s' does not say '%s'", f.err.text, why);
    }
    test_fixture_close(&f);
}

static void wrong_weights_are_refused(void **state) {
    (void)state;
    expect_config_error("{EPICk: 2}", "config.yaml:5: data.marker_weights: the model has no marker "
                                      "'EPICk' (did you mean 'EPICl'?)");
    expect_config_error("{EPICl: -2}", "'-2' of 'EPICl' is not a number of at least 0");
    expect_config_error("{EPICl: heavy}", "'heavy' of 'EPICl' is not a number");
    expect_config_error("absent.xml", "absent.xml");
}

/* The cost at a posture with measured markers 3 cm beside the model's. */
static double cost_at(const char *weights, const double *q, double *gradient) {
    char yaml[1024];
    test_fixture f;
    (void)snprintf(yaml, sizeof yaml, HEAD COSTS "data:\n  marker_weights: %s\n", weights);
    if (test_fixture_open(&f, yaml) != MHE_OK) {
        fail_msg("%s", f.err.text);
    }
    const mhe_stage_problem *p = mhi_ocp_face(f.ocp);
    const mhe_system *s = mhi_system_face(f.system);
    double x[64] = {0}, g[64], cost = 0;
    const int32_t n = 3 * mhi_system_description(f.system)->n_markers;
    memcpy(x, q, sizeof *q * (size_t)s->n_q);
    double *target = mhi_ocp_target(f.ocp, MHI_SIGNAL_MARKERS, p->n_intervals);
    assert_int_equal(mhi_system_markers(mhi_ocp_context(f.ocp), q, target, NULL, &f.err), MHE_OK);
    for (int32_t i = 0; i < n; i++) {
        target[i] += 0.03 * (1 + i);
    }
    const mhe_stage_values out = {.size = sizeof out, .cost = &cost, .grad_x = g};
    assert_int_equal(p->evaluate(p, 0, p->n_intervals, x, NULL, &out, &f.err), MHE_OK);
    memcpy(gradient, g, sizeof *g * (size_t)s->n_q);
    test_fixture_close(&f);
    return cost;
}

/* A weight multiplies the squared error: 4 everywhere is four times the cost. */
static void weights_multiply_squares(void **state) {
    static const double q[4] = {0.2, -0.3, 0.1, 0.8};
    double one[4], four[4], first[4], rest[4];
    (void)state;
    const double cost = cost_at("{}", q, one);
    assert_true(fabs(cost_at("{'*': 4}", q, four) - 4 * cost) < 1e-9 * cost);
    const double part = cost_at("{'*': 0, ARMl: 1}", q, first);
    const double others = cost_at("{ARMl: 0}", q, rest);
    assert_true(fabs(part + others - cost) < 1e-9 * cost && part > 0);
    for (int i = 0; i < 4; i++) {
        assert_true(fabs(four[i] - 4 * one[i]) < 1e-9 * fabs(one[i]));
        assert_true(fabs(first[i] + rest[i] - one[i]) < 1e-9 * (1 + fabs(one[i])));
    }
}

/* A posture that fits one marker exactly where this alone counts; a coordinate's task pulls. */
static void postures_follow_weights(void **state) {
    test_fixture f;
    mhi_start *start = NULL;
    double q[4] = {0.1, 0.1, 0.1, 0.5}, at[4] = {0.2, -0.3, 0.1, 0.8}, seen[24], found[24], rms = 0;
    (void)state;
    assert_int_equal(test_fixture_open(&f, HEAD COSTS), MHE_OK);
    mhi_system_context *context = mhi_ocp_context(f.ocp);
    assert_int_equal(mhi_start_create(f.system, context, &start, &f.err), MHE_OK);
    assert_int_equal(mhi_system_markers(context, at, seen, NULL, &f.err), MHE_OK);
    const int32_t own = marker(&f, "STYLr");
    for (int32_t i = 0; i < 24; i++) {
        seen[i] += i / 3 == own ? 0 : 0.02 * (i % 5 - 2);
    }
    double weight[8] = {0}, coordinate[4] = {0}, value[4] = {0};
    weight[own] = 1;
    const mhi_tasks one = {.marker = weight, .coordinate = coordinate, .value = value};
    mhi_start_set_tasks(start, &one);
    assert_int_equal(mhi_start_posture(start, seen, q, &rms, &f.err), MHE_OK);
    assert_true(rms < 1e-6);
    assert_int_equal(mhi_system_markers(context, q, found, NULL, &f.err), MHE_OK);
    assert_true(fabs(found[3 * own] - seen[3 * own]) < 1e-6);
    coordinate[3] = 1e6;
    value[3] = 1;
    assert_int_equal(mhi_start_posture(start, seen, q, &rms, &f.err), MHE_OK);
    assert_true(fabs(q[3] - 1) < 1e-4 && rms > 1e-3);
    mhi_start_free(start);
    test_fixture_close(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tasks_are_read),           cmocka_unit_test(wrong_files_are_refused),
        cmocka_unit_test(names_are_matched),        cmocka_unit_test(wrong_weights_are_refused),
        cmocka_unit_test(weights_multiply_squares), cmocka_unit_test(postures_follow_weights),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

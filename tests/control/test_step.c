/* SPDX-License-Identifier: Apache-2.0 */
/* Optimal-control problems from a config: two short steps on the arm, and what is refused. */
#include "control/step.h"
#include "estimator/create.h"
#include "io/table.h"
#include "support.h"

#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define HEAD                                                                        \
    "model: {file: " MHE_TEST_SOURCE_DIR "/models/arm19/arm19.osim}\n"              \
    "muscle: {curves: paper2021}\n"                                                 \
    "solver: {plugin: mhe.solver.ipopt, tolerance: 1e-6, max_iterations: 200, "     \
    "adapt_curvature: true, acceptable_tolerance: 1e-3, acceptable_iterations: 8, " \
    "options: {acceptable_obj_change_tol: 1e-9, acceptable_constr_viol_tol: 1e-7}}\n"
#define TRACK "plugin: mhe.cost.track"
#define COSTS                                                                     \
    "    costs:\n"                                                                \
    "      - {" TRACK ", signal: excitation, value: [0], weight: 10}\n"           \
    "      - {" TRACK ", signal: q, value: [0], nodes: running, weight: 10}\n"    \
    "      - {" TRACK ", signal: qdot, value: [0], nodes: running, weight: 10}\n" \
    "      - {" TRACK ", signal: activation, value: [0], weight: 10}\n"           \
    "      - {" TRACK ", signal: qdot, value: [0], nodes: last, weight: 1e4}\n"
#define REACH                                                             \
    "steps:\n"                                                            \
    "  - name: reach\n"                                                   \
    "    duration: 1\n"                                                   \
    "    intervals: 100\n"                                                \
    "    toward: [-0.2, -1.3, -0.5, 0.5]\n"                               \
    "    bounds:\n"                                                       \
    "      - {signal: q, value: [-0.1, -0.3, -0.1, 0.1], to: 0}\n"        \
    "      - {signal: qdot, value: [0], to: 0}\n" COSTS "      - {" TRACK \
    ", signal: q, value: [-0.2, -1.3, -0.5, 0.5], nodes: last, weight: 1e4}\n"
#define TRICEPS "[TricepsLong, TricepsLat, TricepsMed]"
#define AGAIN                                                                         \
    "  - name: again\n"                                                               \
    "    duration: 1\n"                                                               \
    "    intervals: 100\n"                                                            \
    "    start: [reach]\n"                                                            \
    "    targets: {q: reach}\n"                                                       \
    "    bounds:\n"                                                                   \
    "      - {signal: excitation, of: " TRICEPS ", min: [0.2], from: 0.1, to: 0.3}\n" \
    "    costs:\n"                                                                    \
    "      - {" TRACK ", signal: q, weight: 1e5}\n"                                   \
    "      - {" TRACK ", signal: excitation, value: [0], weight: 1e3}\n"              \
    "      - {" TRACK ", signal: activation, value: [0], weight: 1e2}\n"

typedef struct problem {
    char path[300];
    mhe_host host;
    mhi_registry *registry;
    mhi_run *run;
    mhi_step *steps;
    int32_t n_steps;
    mhe_estimator *estimator;
    mhi_trajectory done[4];
    mhe_solve_info info;
    mhi_arena arena;
    mhe_error err;
} problem;

static void say_nothing(const mhe_host *host, int32_t level, const char *text) {
    (void)host, (void)level, (void)text;
}

static const void *no_service(const mhe_host *host, const char *id) {
    (void)host, (void)id;
    return NULL;
}

static mhe_status open_problem(problem *p, const char *yaml) {
    char folder[256];
    *p = (problem){.host = {.size = sizeof p->host, .log = say_nothing, .service = no_service}};
    assert_non_null(test_folder(folder, sizeof folder));
    (void)snprintf(p->path, sizeof p->path, "%s/steps.yaml", folder);
    const int file = open(p->path, O_WRONLY | O_CREAT, 0600);
    assert_true(file >= 0);
    assert_int_equal(write(file, yaml, strlen(yaml)), strlen(yaml));
    assert_int_equal(close(file), 0);
    mhe_status status = mhi_registry_create(&p->host, &p->registry, &p->err);
    if (status == MHE_OK) {
        status = mhi_run_read_base(p->path, NULL, 0, p->registry, &p->run, &p->err);
    }
    if (status == MHE_OK) {
        status = mhi_run_read_steps(p->run, p->registry, &p->steps, &p->n_steps, &p->err);
    }
    if (status == MHE_OK) {
        status = mhi_estimator_create(p->run, &p->host, &p->estimator, &p->err);
    }
    return status;
}

static mhe_status solve(problem *p, int32_t number) {
    const mhi_step_setup setup = {.run = p->run,
                                  .host = &p->host,
                                  .system = mhi_estimator_system(p->estimator),
                                  .steps = p->steps,
                                  .number = number,
                                  .done = p->done};
    return mhi_step_solve(&setup, &p->arena, &p->done[number], &p->info, &p->err);
}

static void close_problem(problem *p) {
    mhe_estimator_close(p->estimator);
    mhi_run_free(p->run);
    mhi_registry_free(p->registry);
    mhi_arena_free(&p->arena);
}

static void check_reach(const mhi_trajectory *t) {
    static const double from[] = {-0.1, -0.3, -0.1, 0.1}, to[] = {-0.2, -1.3, -0.5, 0.5};
    const double *last = t->x + t->n * t->n_x;
    for (int i = 0; i < 4; i++) {
        assert_true(t->x[i] == from[i] && t->x[4 + i] == 0);
        assert_true(fabs(last[i] - to[i]) < 0.01); /* what 1e4 leaves against the effort */
        assert_true(fabs(last[4 + i]) < 0.01);
    }
}

/* The second step follows the first, with more triceps for a part of its time. */
static void check_again(const mhi_trajectory *t, const mhi_trajectory *reach) {
    double moved = 0, least_inside = 1, least_outside = 1;
    for (int k = 0; k <= t->n; k++) {
        for (int i = 0; i < 4; i++) {
            moved = fmax(moved, fabs(t->x[k * t->n_x + i] - reach->x[k * t->n_x + i]));
        }
        for (int m = 6; m < 9 && k < t->n; m++) {
            double *least = k >= 10 && k <= 30 ? &least_inside : &least_outside;
            *least = fmin(*least, t->u[k * t->n_u + m]);
        }
    }
    assert_true(moved < 0.05);
    assert_true(least_inside >= 0.2);
    assert_true(least_outside < 0.1);
}

static void test_two_steps(void **state) {
    (void)state;
    problem p;
    assert_int_equal(open_problem(&p, HEAD REACH AGAIN), MHE_OK);
    assert_int_equal(p.n_steps, 2);
    for (int32_t i = 0; i < 2; i++) {
        if (solve(&p, i) != MHE_OK) {
            fail_msg("%s", p.err.text);
        }
        print_message("%s: outcome %d, %d iterations, residual %.3g\n", p.steps[i].name,
                      (int)p.info.outcome, (int)p.info.iterations, p.info.kkt_residual);
        assert_int_equal(p.info.outcome, MHE_SOLVE_CONVERGED);
        assert_true(p.info.primal_residual < 1e-6);
    }
    check_reach(&p.done[0]);
    check_again(&p.done[1], &p.done[0]);
    close_problem(&p);
}

/* The first half second of the demo's motion, from its file. */
#define FROM_FILE                                                                        \
    "steps:\n"                                                                           \
    "  - name: demo\n"                                                                   \
    "    duration: 0.5\n"                                                                \
    "    intervals: 50\n"                                                                \
    "    bounds: [{signal: q, value: [-0.09847, -0.29692, -0.10238, 0.10685], to: 0}]\n" \
    "    targets: {q: " MHE_TEST_SOURCE_DIR "/models/arm19/demo_reference.sto}\n"        \
    "    costs:\n"                                                                       \
    "      - {" TRACK ", signal: q, weight: 1e7}\n"                                      \
    "      - {" TRACK ", signal: excitation, value: [0], weight: 10}\n"                  \
    "      - {" TRACK ", signal: activation, value: [0], weight: 10}\n"

static void test_target_from_file(void **state) {
    (void)state;
    problem p;
    mhi_table *file = NULL;
    assert_int_equal(
        mhi_sto_read(MHE_TEST_SOURCE_DIR "/models/arm19/demo_reference.sto", &file, NULL), MHE_OK);
    assert_int_equal(open_problem(&p, HEAD FROM_FILE), MHE_OK);
    if (solve(&p, 0) != MHE_OK) {
        fail_msg("%s", p.err.text);
    }
    assert_int_equal(p.info.outcome, MHE_SOLVE_CONVERGED);
    double worst = 0;
    for (int k = 0; k <= 50; k++) {
        for (int i = 0; i < 4; i++) {
            const double q = file->values[k * file->n_columns + i];
            worst = fmax(worst, fabs(p.done[0].x[k * p.done[0].n_x + i] - q));
        }
    }
    print_message("demo: %d iterations, off by %.2g rad\n", (int)p.info.iterations, worst);
    assert_true(fabs(file->values[50 * file->n_columns + 1] - file->values[1]) > 0.05);
    assert_true(worst < 2e-3);
    mhi_table_free(file);
    close_problem(&p);
}

/* Motions one behind the other: a node is a node, a control holds, the ends stand still. */
static void test_joined(void **state) {
    (void)state;
    double xa[] = {0, 1, 2}, ua[] = {5, 6}, xb[] = {2, 4}, ub[] = {7};
    const mhi_trajectory a = {2, 1, 1, 0.1, xa, ua, NULL, NULL};
    const mhi_trajectory b = {1, 1, 1, 0.3, xb, ub, NULL, NULL};
    const mhi_trajectory *both[] = {&a, &b};
    static const struct {
        double time, x, u;
    } at[] = {{-1, 0, 5},  {0, 0, 5},    {0.05, 0.5, 5}, {0.1, 1, 6},
              {0.2, 2, 7}, {0.35, 3, 7}, {9, 4, 7}};
    for (size_t i = 0; i < sizeof at / sizeof at[0]; i++) {
        double x, u;
        mhi_trajectory_at(both, 2, at[i].time, &x, &u);
        assert_true(fabs(x - at[i].x) < 1e-12 && u == at[i].u);
    }
    assert_true(fabs(mhi_trajectory_duration(both, 2) - 0.5) < 1e-15);
}

static void test_refused(void **state) {
    (void)state;
    static const struct {
        const char *yaml, *text;
    } cases[] = {
        {HEAD, "steps: a list of optimal-control problems is needed"},
        {HEAD "costs: []\n" REACH, "unknown key 'costs'"},
        {HEAD "steps:\n  - {duration: 1}\n", "name"},
        {HEAD "steps:\n  - {name: a, durtion: 1}\n", "did you mean 'duration'"},
        {HEAD "steps:\n  - {name: a}\n", "costs: a list with at least one entry is needed"},
        {HEAD REACH "    start: [reech]\n", "'reech' is no step before this one"},
        {HEAD REACH "    start: [reach]\n", "'reach' is no step before this one"},
        {HEAD REACH "  - name: reach\n" COSTS, "there are two steps 'reach'"},
        {HEAD REACH "    targets: {q: reech}\n", "neither a step before this one nor a .sto file"},
        {HEAD REACH "    targets: {markers: reach}\n", "'markers' is not q, qdot"},
        {HEAD REACH "    targets: {q: nowhere.sto}\n", "nowhere.sto"},
        {HEAD REACH AGAIN "    toward: [0]\n", NULL},
        {HEAD "steps:\n  - name: a\n    toward: [0]\n" COSTS, "toward: 1 values"},
        {HEAD "steps:\n  - name: a\n    bounds: [{signal: qq}]\n" COSTS, "'qq' is not q, qdot"},
        {HEAD "steps:\n  - name: a\n    bounds: [{signal: q, of: [Knee]}]\n" COSTS,
         "'q' has no entry 'Knee'"},
        {HEAD "steps:\n  - name: a\n    bounds: [{signal: q, min: [1, 2]}]\n" COSTS,
         "2 values; 'q' has 4 entries"},
        {HEAD
         "steps:\n  - name: a\n    bounds: [{signal: excitation, min: [0.6], max: [0.4]}]\n" COSTS,
         "step 'a': bounds of 'excitation', Pectoral2, at 0 s: 0.6 .. 0.4 within 0 .. 1 leaves "
         "nothing"},
        {HEAD "steps:\n  - name: a\n    bounds: [{signal: q, value: [9], to: 0}]\n" COSTS,
         "leaves nothing"},
        {HEAD "steps:\n  - name: a\n    costs: [{" TRACK ", signal: torque}]\n",
         "step 'a': costs.0: mhe.cost.track: the problem has no signal 'torque'"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        problem p;
        mhe_status status = open_problem(&p, cases[i].yaml);
        for (int32_t k = 0; k < p.n_steps && status == MHE_OK; k++) {
            status = solve(&p, k);
        }
        if (cases[i].text == NULL) { /* the start of an earlier step wins */
            assert_int_equal(status, MHE_OK);
        } else if (status == MHE_OK || strstr(p.err.text, cases[i].text) == NULL) {
            fail_msg("'%s' is not in: %s", cases[i].text, p.err.text);
        }
        close_problem(&p);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_two_steps), cmocka_unit_test(test_target_from_file),
        cmocka_unit_test(test_joined), cmocka_unit_test(test_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

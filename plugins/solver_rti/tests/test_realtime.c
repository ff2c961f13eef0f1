/* SPDX-License-Identifier: Apache-2.0 */
/* Windows in a row as an estimator has them: prepared or not, by one thread or by several, the
 * result has the same bits. */
#include "solver_rig.h"
#include "support.h"

#include <math.h>
#include <string.h>

#define N 7
#define WINDOWS 8
#define VALUES (3 * ((N + 1) * TOY_ARM_X + N * TOY_ARM_U) + N * TOY_ARM_X)

static const char *const presets[] = {"{preset: speed}", "{preset: balanced}", "{}"};

/* All results of one run. */
typedef struct history {
    double values[WINDOWS][VALUES];
    mhe_solve_info info[WINDOWS];
    long steps[WINDOWS]; /* evaluations of the dynamics in solve() */
} history;

static history reference, other;

typedef struct plan {
    const char *yaml;
    int workers;
    int prepares; /* 1: at the start of the solve, 2: elsewhere, 3: both */
} plan;

static void prepare(rig *r, int how) {
    if (how & 2) {
        const double x = r->at.x[3 * TOY_ARM_X + 1];
        r->at.x[3 * TOY_ARM_X + 1] += 1e-12;
        assert_int_equal(r->ops->prepare(r->solver, &r->at, &r->error), MHE_OK);
        r->at.x[3 * TOY_ARM_X + 1] = x;
    }
    if (how & 1) {
        assert_int_equal(r->ops->prepare(r->solver, &r->at, &r->error), MHE_OK);
    }
}

static void run(const plan *p, history *h) {
    static double x[N + 2 + WINDOWS][TOY_ARM_X], target[N + 1 + WINDOWS][TOY_ARM_TARGET];
    toy t;
    rig r;
    memset(h, 0, sizeof *h);
    toy_arm(&t, N, 0.03);
    toy_arm_motion(&t, N + 1 + WINDOWS, x[0], target[0]);
    t.problem.n_workers = p->workers;
    assert_int_equal(rig_open(&r, &t, p->yaml), MHE_OK);
    for (int k = 0; k < WINDOWS; k++) {
        t.target = target[k];
        prepare(&r, p->prepares);
        t.steps = 0;
        assert_int_equal(rig_solve(&r, NULL), MHE_OK);
        h->steps[k] = t.steps;
        memcpy(h->values[k], r.memory, sizeof h->values[k]);
        h->info[k] = r.info;
        h->info[k].evaluation_time = 0;
        rig_shift(&r);
    }
    rig_close(&r);
    toy_free(&t);
}

static void assert_same(const history *a, const history *b) {
    assert_memory_equal(a->values, b->values, sizeof a->values);
    assert_memory_equal(a->info, b->info, sizeof a->info);
}

static void prepared_is_the_same(void **state) {
    (void)state;
    for (int i = 0; i < 3; i++) {
        run(&(plan){presets[i], 1, 0}, &reference);
        run(&(plan){presets[i], 1, 1}, &other);
        assert_same(&reference, &other);
        for (int k = 0; k < WINDOWS; k++) { /* and the first iteration finds its dynamics done */
            assert_int_equal(other.steps[k], reference.steps[k] - N);
        }
        if (i == 0) {
            assert_int_equal(other.steps[1], 1); /* of the result, the first interval */
        }
        run(&(plan){presets[i], 1, 3}, &other);
        assert_same(&reference, &other);
        assert_int_equal(other.steps[1], reference.steps[1] - N);
    }
}

static void prepared_elsewhere_is_ignored(void **state) {
    (void)state;
    for (int i = 0; i < 3; i++) {
        run(&(plan){presets[i], 1, 0}, &reference);
        run(&(plan){presets[i], 1, 2}, &other);
        assert_same(&reference, &other);
        assert_memory_equal(reference.steps, other.steps, sizeof other.steps);
    }
}

static void any_number_of_threads(void **state) {
    (void)state;
    static const int workers[] = {2, 3, 8};
    for (int i = 0; i < 3; i++) {
        run(&(plan){presets[i], 1, 0}, &reference);
        for (int j = 0; j < 3; j++) {
            run(&(plan){presets[i], workers[j], j == 1}, &other);
            assert_same(&reference, &other);
        }
    }
    run(&(plan){"{spin: 0}", 3, 1}, &other); /* asleep at every loop */
    assert_same(&reference, &other);
}

/* A preparation that comes to nothing is no error, and the solve says what it is. */
static void no_values_where_prepared(void **state) {
    (void)state;
    toy t;
    rig r;
    toy_pendulum(&t, N);
    assert_int_equal(rig_open(&r, &t, "{}"), MHE_OK);
    t.retry_above = -1;
    assert_int_equal(r.ops->prepare(r.solver, &r.at, &r.error), MHE_OK);
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_FAILED);
    t.retry_above = INFINITY;
    r.at.u[2] = NAN;
    assert_int_equal(r.ops->prepare(r.solver, &r.at, &r.error), MHE_OK);
    r.at.u[2] = 0;
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
    rig_close(&r);
    toy_free(&t);
}

/* The first interval that gives up is the one told, whoever evaluated it. */
static void gives_up(void **state) {
    (void)state;
    for (int workers = 1; workers <= 4; workers++) {
        toy t;
        rig r;
        toy_pendulum(&t, N);
        t.problem.n_workers = workers;
        assert_int_equal(rig_open(&r, &t, "{}"), MHE_OK);
        t.failure = MHE_E_NUMERIC;
        assert_int_equal(r.ops->prepare(r.solver, &r.at, &r.error), MHE_E_NUMERIC);
        assert_string_equal(r.error.text, "the toy was told to fail at node 0");
        assert_int_equal(rig_solve(&r, NULL), MHE_E_NUMERIC);
        t.failure = MHE_OK;
        assert_int_equal(rig_solve(&r, NULL), MHE_OK);
        assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
        rig_close(&r);
        toy_free(&t);
    }
}

/* Late at the start: the start, at once; what was prepared stays good. */
static void late_but_prepared(void **state) {
    (void)state;
    toy t;
    rig r;
    toy_pendulum(&t, N);
    assert_int_equal(rig_open(&r, &t, "{}"), MHE_OK);
    for (int k = 0; k <= N; k++) {
        r.at.x[2 * k] = 0.01 * k;
    }
    assert_int_equal(r.ops->prepare(r.solver, &r.at, &r.error), MHE_OK);
    t.evaluations = 0;
    const mhe_solve_control late = {.size = sizeof late, .deadline = 1e-3};
    assert_int_equal(rig_solve(&r, &late), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_DEADLINE);
    assert_int_equal(t.evaluations, 0);
    assert_true(r.at.x[2 * N] == 0.01 * N);
    assert_true(r.info.primal_residual == rig_check(&r).primal); /* the gaps are known */
    assert_true(r.info.primal_residual >= 0.01);
    t.steps = 0;
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
    const long steps = t.steps;
    rig_reset(&r);
    for (int k = 0; k <= N; k++) {
        r.at.x[2 * k] = 0.01 * k;
    }
    t.steps = 0;
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(steps, t.steps - N);
    rig_close(&r);
    toy_free(&t);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(prepared_is_the_same),
        cmocka_unit_test(prepared_elsewhere_is_ignored),
        cmocka_unit_test(any_number_of_threads),
        cmocka_unit_test(no_values_where_prepared),
        cmocka_unit_test(gives_up),
        cmocka_unit_test(late_but_prepared),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

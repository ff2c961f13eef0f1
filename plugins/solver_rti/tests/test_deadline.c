/* SPDX-License-Identifier: Apache-2.0 */
/* Deadlines that pass anywhere in a solve. The clock is this program's: every look at it is a
 * microsecond, so a deadline of n microseconds passes at the n-th look, on any machine. */
#include "solver_rig.h"
#include "support.h"

#include <math.h>
#include <mhe/abi.h>
#include <string.h>
#include <time.h>

#define N 7
#define WINDOWS 4 /* behind them comes the one that is cut */
#define BEGIN 1e-3
#define TICK 1e-6
#define CONSISTENT 1e-2 /* gaps that an estimator hands on */
#define X ((N + 1) * TOY_ARM_X)
#define U (N * TOY_ARM_U)
#define VALUES (3 * (X + U) + N * TOY_ARM_X)

static int64_t looks; /* at the clock */

/* Comes before the C library's, for plugins too. */
MHE_EXPORT int clock_gettime(clockid_t id, struct timespec *time) {
    (void)id;
    looks++;
    time->tv_sec = 0;
    time->tv_nsec = (long)(1e9 * (BEGIN + TICK * (double)looks));
    return 0;
}

static double targets[N + 1 + WINDOWS][TOY_ARM_TARGET];

/* One solve of the last window, from the same start each time. */
typedef struct solve {
    double values[VALUES];
    double w[X + U];
    mhe_solve_info info;
    double gap; /* largest |x_{k+1} - F_k| */
    int64_t looks;
} solve;

static void assert_sound(const rig *r, const toy *t) {
    const size_t n_values = VALUES;
    for (size_t i = 0; i < n_values; i++) {
        assert_true(isfinite(r->memory[i]));
    }
    for (int i = 0; i < X; i++) {
        assert_true(r->at.x[i] >= t->problem.x_lower[i] && r->at.x[i] <= t->problem.x_upper[i]);
    }
    for (int i = 0; i < U; i++) {
        assert_true(r->at.u[i] >= t->problem.u_lower[i] && r->at.u[i] <= t->problem.u_upper[i]);
    }
}

/* A solver before the window that is cut: the first one, `cold`, without multipliers, or one that
 * comes behind others. */
typedef struct scene {
    toy t;
    rig r;
    int cold;
    double start[VALUES];
} scene;

static void scene_open(scene *c, const char *yaml, int cold) {
    toy_arm(&c->t, N, 0.03);
    assert_int_equal(rig_open(&c->r, &c->t, yaml), MHE_OK);
    c->cold = cold;
    for (int k = 0; k < WINDOWS && !cold; k++) {
        c->t.target = targets[k];
        assert_int_equal(rig_solve(&c->r, NULL), MHE_OK);
        rig_shift(&c->r);
    }
    c->t.target = targets[cold ? 0 : WINDOWS];
    memcpy(c->start, c->r.memory, sizeof c->start);
}

static void scene_close(scene *c) {
    rig_close(&c->r);
    toy_free(&c->t);
}

/* `ticks` to go; 0: no deadline. */
static void run(scene *c, int64_t ticks, solve *s) {
    rig *r = &c->r;
    memcpy(r->memory, c->start, sizeof c->start);
    r->at.has_multipliers = !c->cold;
    assert_int_equal(r->ops->prepare(r->solver, &r->at, &r->error), MHE_OK);
    looks = 0;
    const mhe_solve_control control = {.size = sizeof control,
                                       .deadline = BEGIN + TICK * ((double)ticks - 0.5)};
    assert_int_equal(rig_solve(r, ticks > 0 ? &control : NULL), MHE_OK);
    s->looks = looks;
    s->info = r->info;
    memcpy(s->values, r->memory, sizeof s->values);
    memcpy(s->w, r->at.x, sizeof(double) * X);
    memcpy(s->w + X, r->at.u, sizeof(double) * U);
    s->gap = rig_check(r).primal;
    assert_sound(r, &c->t);
}

static double off(const solve *a, const solve *b) {
    double most = 0;
    for (int i = 0; i < X + U; i++) {
        most = fmax(most, fabs(a->w[i] - b->w[i]));
    }
    return most;
}

/* What a deadline at each look of a whole solve comes to. */
typedef struct tally {
    int64_t late;        /* ... looks at most after the deadline */
    int stopped, usable; /* solves cut, and those with a consistent motion */
    double worst, start; /* farthest of these, and the start, from the whole solve's result */
} tally;

#define MOST_TICKS 1000 /* a whole solve takes no more */

static void sweep(const char *yaml, int cold, tally *t) {
    static solve whole, cut, start;
    static scene c;
    scene_open(&c, yaml, cold);
    run(&c, 0, &whole);
    run(&c, 1, &start); /* late at once: as it came */
    assert_int_equal(start.info.outcome, MHE_SOLVE_DEADLINE);
    assert_int_equal(start.info.iterations, 0);
    *t = (tally){.start = off(&start, &whole)};
    for (int64_t ticks = 2;; ticks++) {
        run(&c, ticks, &cut);
        if (cut.info.outcome == whole.info.outcome &&
            memcmp(cut.values, whole.values, sizeof cut.values) == 0) {
            break;
        }
        /* By a leap in the place of a step a real-time iteration may be at its end sooner. */
        assert_true(cut.info.outcome == MHE_SOLVE_DEADLINE ||
                    cut.info.outcome == MHE_SOLVE_CONVERGED);
        assert_true(ticks < MOST_TICKS);
        assert_true(cut.info.iterations <= whole.info.iterations);
        assert_true(cold || cut.gap <= start.gap);
        t->late = cut.looks - ticks > t->late ? cut.looks - ticks : t->late;
        t->stopped++;
        if (cut.info.primal_residual <= CONSISTENT) {
            t->usable++;
            t->worst = fmax(t->worst, off(&cut, &whole));
            assert_true(cut.gap <= 3 * CONSISTENT); /* gaps were told by the linearisation */
        }
    }
    scene_close(&c);
}

static void cut_anywhere(void **state) {
    (void)state;
    static const char *const presets[] = {"{preset: speed}", "{preset: balanced}", "{}"};
    static double x[N + 2 + WINDOWS][TOY_ARM_X];
    toy arm;
    toy_arm(&arm, N, 0.03);
    toy_arm_motion(&arm, N + 1 + WINDOWS, x[0], targets[0]);
    toy_free(&arm);
    for (int i = 0; i < TOY_ARM_U; i++) { /* bounds that no window before has met */
        double *newest = targets[N - 1 + WINDOWS] + TOY_ARM_TARGET - TOY_ARM_U;
        newest[i] = newest[i] < 0.1 ? -0.1 : newest[i];
    }
    for (int i = 0; i < 3; i++) {
        for (int cold = 0; cold < (i == 2 ? 2 : 1); cold++) { /* cold, all are as robust */
            tally t;
            sweep(presets[i], cold, &t);
            print_message("%s%s: %d deadlines, %d with a motion, at most %.2g off (the start "
                          "%.2g); %d looks late\n",
                          presets[i], cold ? ", cold" : "", t.stopped, t.usable, t.worst, t.start,
                          (int)t.late);
            /* What runs then is seen through: an evaluation, which looks at its begin and end. */
            assert_true(t.late <= 3);
            if (!cold) { /* one interior-point step, and the program's iterate is worth taking */
                assert_true(t.usable > 0 && t.stopped - t.usable <= 6);
                assert_true(t.worst <= 0.05 * t.start);
            }
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(cut_anywhere)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* Windows of the shipped arm: the same optimum as mhe.solver.ipopt, from the same start, both at a
 * tight tolerance. */
#include "estimator/estimator_private.h"
#include "estimator/recording.h"
#include "fixture.h"
#include "noise/noise.h"
#include "support.h"
#include "use.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A solver on the problem of an estimator, and its solution. */
typedef struct contender {
    const mhe_solver_ops *ops;
    void *self;
    mhe_solution at;
    mhe_solve_info info;
    double *memory;
    size_t n_x, n_u; /* of all nodes */
} contender;

static void contender_open(contender *c, const mhe_stage_problem *p, const char *id,
                           const char *yaml) {
    const mhe_plugin *plugin = test_plugin(id, MHE_SOLVER_IFACE);
    assert_non_null(plugin);
    *c = (contender){.ops = plugin->ops};
    const size_t N = (size_t)p->n_intervals, n_x = (size_t)p->n_x, n_u = (size_t)p->n_u;
    c->n_x = (N + 1) * n_x;
    c->n_u = N * n_u;
    c->memory = calloc(4 * (c->n_x + c->n_u), sizeof(double));
    assert_non_null(c->memory);
    c->at = (mhe_solution){.size = sizeof c->at,
                           .x = c->memory,
                           .zx_lower = c->memory + c->n_x,
                           .zx_upper = c->memory + 2 * c->n_x,
                           .lambda = c->memory + 3 * c->n_x,
                           .u = c->memory + 4 * c->n_x,
                           .zu_lower = c->memory + 4 * c->n_x + c->n_u,
                           .zu_upper = c->memory + 4 * c->n_x + 2 * c->n_u};
    mhe_error err = {0};
    if (c->ops->create(test_host(), p, test_config(plugin, yaml), &c->self, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
}

static void contender_close(contender *c) {
    c->ops->destroy(c->self);
    free(c->memory);
}

static int contender_solve(contender *c, const double *x, const double *u) {
    mhe_error err = {0};
    memcpy(c->at.x, x, sizeof(double) * c->n_x);
    memcpy(c->at.u, u, sizeof(double) * c->n_u);
    c->at.has_multipliers = 0;
    c->info = (mhe_solve_info){.size = sizeof c->info};
    if (c->ops->solve(c->self, NULL, &c->at, &c->info, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    return c->info.outcome == MHE_SOLVE_CONVERGED;
}

static double difference(const double *a, const double *b, size_t n) {
    double most = 0;
    for (size_t i = 0; i < n; i++) {
        most = fmax(most, fabs(a[i] - b[i]));
    }
    return most;
}

/* One run over a motion. */
typedef struct tally {
    const char *motion, *formulation, *cost, *curves;
    int noisy, every; /* every so many windows are compared */
    int windows, by_rti, by_ipopt, both, agree;
    int apart;              /* found two optima, and this solver confirms both */
    double x, u, objective; /* largest differences of those that agree */
    double any_objective;   /* ... and of all windows, converged or not */
} tally;

static double objective_difference(const contender *a, const contender *b) {
    return fabs(a->info.objective - b->info.objective) / fabs(b->info.objective);
}

/* Started at the other's result, does this solver converge there? */
static int confirms(contender *c, const contender *other) {
    return contender_solve(c, other->at.x, other->at.u) &&
           difference(c->at.x, other->at.x, c->n_x) < 1e-7 &&
           difference(c->at.u, other->at.u, c->n_u) < 1e-7 && objective_difference(c, other) < 1e-9;
}

static void compare(contender *rti, contender *ipopt, const mhe_estimator *e, tally *t) {
    mhi_work_begin(mhi_ocp_work(e->ocp), 0, 0); /* no frame's bound holds here */
    const int by_rti = contender_solve(rti, e->window.guess_x, e->window.guess_u);
    const int by_ipopt = contender_solve(ipopt, e->window.guess_x, e->window.guess_u);
    const double x = difference(rti->at.x, ipopt->at.x, rti->n_x);
    const double u = difference(rti->at.u, ipopt->at.u, rti->n_u);
    const double objective = objective_difference(rti, ipopt);
    t->windows++;
    t->by_rti += by_rti;
    t->by_ipopt += by_ipopt;
    t->both += by_rti && by_ipopt;
    t->any_objective = fmax(t->any_objective, objective);
    if (by_rti && by_ipopt && x < 1e-4 && u < 1e-4 && objective < 1e-6) {
        t->agree++;
        t->x = fmax(t->x, x);
        t->u = fmax(t->u, u);
        t->objective = fmax(t->objective, objective);
    } else if (by_rti && by_ipopt) {
        t->apart += confirms(rti, ipopt);
    }
}

/* Markers [n_frames x 3 n_k] of the reference, and noise on its EMG: the paper's larger levels. */
static void record(const test_fixture *f, mhi_recording *r, int noisy, mhi_record *markers) {
    const mhe_description *d = mhi_system_description(f->system);
    const mhi_noise noise = {.seed = 1, .markers.sd = noisy ? 0.005 : 0};
    mhe_error err = {0};
    if (mhi_noise_markers(&noise, r, d, f->run->model.plugin, f->run->model.config, &f->host,
                          markers, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    for (int32_t i = 0; noisy && i < d->n_muscles; i++) {
        mhi_noise_harmonics(r->emg + i, r->n_frames, d->n_muscles, 1.5, noise.seed, i);
    }
}

/* The windows of the motion, each started as the estimator started it. 0: its file is not here. */
static int follow(tally *t) {
    char path[512], yaml[2048];
    if (strcmp(t->motion, "demo") == 0) {
        (void)snprintf(path, sizeof path, "%s/models/arm19/demo_reference.sto",
                       MHE_TEST_SOURCE_DIR);
    } else if (test_data_path(path, sizeof path, "arm19/seed_reference_states.sto") == NULL) {
        return 0;
    }
    (void)snprintf(yaml, sizeof yaml,
                   "model: {file: $ARM19}\nmuscle: {curves: %s}\nformulation: %s\n"
                   "data: {emg: %s, reference: %s}\n"
                   "horizon: {window: 7, ratio: 3}\ncosts: [%s]\n"
                   /* steps that change would move F by 1e-6 */
                   "integrator: {stages: 4, max_step: 0.015, activation_step: 1.7, tolerance: 0}\n"
                   "solver: {plugin: mhe.solver.rti, preset: robust}\n",
                   t->curves, t->formulation, path, path, t->cost);
    test_fixture f;
    if (test_fixture_open(&f, yaml) != MHE_OK) {
        fail_msg("%s", f.err.text);
    }
    mhi_recording *r = NULL;
    mhi_record markers = {0};
    assert_int_equal(
        mhi_recording_read(f.run, mhi_system_description(f.system), &f.host, &r, &f.err), MHE_OK);
    record(&f, r, t->noisy, &markers);
    mhi_estimator_set_start(f.estimator, r->reference.q, r->reference.qdot);
    contender rti, ipopt;
    const mhe_stage_problem *problem = mhi_ocp_face(f.ocp);
    contender_open(&rti, problem, "mhe.solver.rti",
                   "{preset: robust, tolerance: 1e-10, max_iterations: 200}");
    contender_open(&ipopt, problem, "mhe.solver.ipopt",
                   "{tolerance: 1e-12, max_iterations: 200, acceptable_tolerance: 1e-9, "
                   "acceptable_iterations: 8}");
    for (int32_t k = 0; k < r->n_frames; k++) {
        const mhe_frame frame = {.size = sizeof frame,
                                 .time = r->time[k],
                                 .markers = markers.values + k * markers.n_channels,
                                 .emg = r->emg + k * mhi_system_description(f.system)->n_muscles};
        mhe_estimate estimate = {.size = sizeof estimate};
        int32_t ready = 0;
        assert_int_equal(mhe_estimator_push(f.estimator, &frame, &estimate, &ready, &f.err),
                         MHE_OK);
        /* The problem still is that of the solve just done. The first one had a proximal term. */
        if (ready && f.estimator->window.solved > 1 && f.estimator->window.solved % t->every == 0) {
            compare(&rti, &ipopt, f.estimator, t);
        }
    }
    contender_close(&rti);
    contender_close(&ipopt);
    mhi_record_free(&markers);
    mhi_recording_free(r);
    test_fixture_close(&f);
    print_message(
        "%s%s, %s, %s, %s: %d windows, %d converged, %d of ipopt, %d of both, %d agree, %d apart; "
        "largest difference x %.1e, u %.1e, objective %.1e, of any window %.1e\n",
        t->motion, t->noisy ? " with noise" : "", t->formulation, t->cost, t->curves, t->windows,
        t->by_rti, t->by_ipopt, t->both, t->agree, t->apart, t->x, t->u, t->objective,
        t->any_objective);
    return 1;
}

static void need_ipopt(void) {
    if (test_plugin("mhe.solver.ipopt", MHE_SOLVER_IFACE) == NULL) {
        skip();
    }
}

#define TRACK "mhe.cost.emg-markers-high"
#define EFFORT "mhe.cost.min-excitation"

/* Ipopt's complementarity at 1e-8 alone moves these objectives by 1e-5: 1e-12 for the reference.
 * Effort alone, and noise, put optima on a kink of the paper's curves, see below: those windows are
 * compared with smooth curves. */
static void same_optimum_as_ipopt(void **state) {
    (void)state;
    tally runs[] = {
        {"demo", "excitation", TRACK, "paper2021", .every = 1},
        {"demo", "activation", TRACK, "paper2021", .every = 1},
        {"demo", "excitation", EFFORT, "degroote2016", .every = 1},
        {"demo", "activation", EFFORT, "degroote2016", .every = 1},
        {"demo", "excitation", TRACK, "degroote2016", .noisy = 1, .every = 1},
        {"demo", "activation", TRACK, "degroote2016", .noisy = 1, .every = 1},
        {"seed", "excitation", TRACK, "degroote2016", .noisy = 1, .every = 3},
    };
    need_ipopt();
    int agree = 0;
    for (size_t i = 0; i < sizeof runs / sizeof runs[0]; i++) {
        tally *t = &runs[i];
        if (!follow(t)) {
            continue; /* the other runs are 500 windows too */
        }
        assert_true(t->windows > 80);
        assert_true(t->by_rti >= 0.98 * t->windows);
        assert_true(t->both >= 0.8 * t->windows);
        assert_int_equal(t->agree, t->both);
        agree += t->agree;
    }
    print_message("%d windows agree\n", agree);
    assert_true(agree >= 500);
}

/* With noise the windows of the paper's curves meet their kinks: the slope of the force-velocity
 * curve changes where a muscle is at rest, and passive force jumps. An optimum may sit on a kink,
 * where one-sided derivatives vanish nowhere: then Ipopt meets no tolerance (4 or 5 of the 47
 * windows, by the last digits of the estimates that led there; with `passive_ramp` too; in 3 of
 * them a muscle rests at a stage of the integrator, to 1e-5 m/s), and this one goes along the kink.
 * Or there is an optimum on either side, some 1e-3 rad/s apart, and each solver finds its own from
 * the same start (3 windows: one at a muscle at rest, two at the jump, gone with the ramp). So:
 * this solver converges wherever Ipopt does; where they differ, it confirms Ipopt's optimum as one
 * when it starts there; all objectives agree. */
static void kinks_stop_both(void **state) {
    (void)state;
    tally t = {"demo", "excitation", TRACK, "paper2021", .noisy = 1, .every = 2};
    need_ipopt();
    assert_true(follow(&t));
    assert_true(t.windows > 40);
    assert_true(t.by_rti >= t.by_ipopt);
    assert_int_equal(t.both, t.by_ipopt);
    assert_true(t.windows - t.by_rti <= 5);
    assert_int_equal(t.agree + t.apart, t.both);
    assert_true(t.apart <= 0.1 * t.both);
    assert_true(t.any_objective < 1e-6);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(same_optimum_as_ipopt),
                                       cmocka_unit_test(kinks_stop_both)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

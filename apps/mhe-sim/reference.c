/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE /* secure_getenv */
#include "reference.h"

#include "base/clock.h"
#include "reference_picture.h"
#include "reference_track.h"

#include "control/step.h"
#include "estimator/create.h"
#include "plugin/describe_options.h"

#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

typedef struct reference {
    const reference_setup *setup;
    mhi_run *run;
    mhe_estimator *estimator; /* holds model and system */
    mhi_step *steps;
    int32_t n_steps;
    mhi_trajectory *done;    /* [n_steps] */
    simulation *simulations; /* [n_steps], of steps with an output */
    const char *out;         /* folder */
    const char *cache;       /* folder; NULL: none */
    mhi_arena arena;
} reference;

static volatile sig_atomic_t interrupted;

static void on_interrupt(int signal_number) {
    (void)signal_number;
    interrupted = 1;
}

void reference_describe(mhi_text *out) {
    int32_t n = 0;
    const mhe_option *options = mhi_step_options(&n);
    mhi_text_add(out, "steps:\n");
    mhi_options_text(options, n, out);
    options = mhi_step_bound_options(&n);
    mhi_text_add(out, "\nbounds:\n");
    mhi_options_text(options, n, out);
}

/* $XDG_CACHE_HOME/mhe, which has to be absolute to count, else ~/.cache/mhe. */
static const char *cache_folder(mhi_arena *arena) {
    const char *base = secure_getenv("XDG_CACHE_HOME"), *home = secure_getenv("HOME");
    if (base != NULL && base[0] == '/') {
        return mhi_arena_format(arena, "%s/mhe", base);
    }
    return home != NULL && home[0] == '/' ? mhi_arena_format(arena, "%s/.cache/mhe", home) : NULL;
}

static mhe_status open_all(reference *r, mhe_error *err) {
    const reference_setup *s = r->setup;
    mhe_status status = mhi_run_read_base(s->config, s->set, s->n_set, s->registry, &r->run, err);
    if (status == MHE_OK) {
        status = mhi_run_read_steps(r->run, s->registry, &r->steps, &r->n_steps, err);
    }
    if (status == MHE_OK) {
        r->out = s->out != NULL ? s->out : mhi_arena_format(&r->arena, "out/%s", r->run->name);
        r->cache = s->cache ? cache_folder(&r->arena) : NULL;
        r->done = MHI_TAKE(&r->arena, mhi_trajectory, r->n_steps);
        r->simulations = MHI_TAKE(&r->arena, simulation, r->n_steps);
        status = r->done == NULL || r->simulations == NULL || r->out == NULL
                     ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                     : mhi_estimator_create(r->run, s->host, &r->estimator, err);
    }
    return status;
}

static mhe_status interruption(const mhi_step *step, mhe_error *err) {
    return mhe_fail(err, MHE_E_INTERRUPTED, "interrupted in step '%s'; nothing is written",
                    step->name);
}

static mhe_status judge(const reference *r, const mhi_step *step, const mhe_solve_info *info,
                        mhe_error *err) {
    static const char *const advice[] = {
        [MHE_SOLVE_ITERATION_LIMIT] = "the iteration limit was reached: raise "
                                      "solver.max_iterations, or start from an easier step",
        [MHE_SOLVE_INFEASIBLE] = "no motion keeps all bounds: widen them or give more time",
        [MHE_SOLVE_FAILED] = "the solver found no way on: start from an easier step",
        [MHE_SOLVE_DEADLINE] = "the deadline passed",
    };
    if (info->outcome == MHE_SOLVE_CONVERGED) {
        return MHE_OK;
    }
    if (info->outcome == MHE_SOLVE_INTERRUPTED) {
        return interruption(step, err);
    }
    return mhi_fail_at(err, MHE_E_NUMERIC, r->run->tree, step->node,
                       "step '%s' did not converge in %d iterations (residual %.3g, jumps %.3g): "
                       "%s",
                       step->name, (int)info->iterations, info->kkt_residual, info->primal_residual,
                       advice[info->outcome]);
}

/* One line on a terminal that is drawn over. */
static int32_t show_iteration(void *data, int32_t iteration, double objective,
                              double kkt_residual) {
    const mhi_step *step = data;
    if (isatty(STDERR_FILENO)) {
        (void)fprintf(stderr, "\r\033[K%s: iteration %d, objective %.6g, residual %.2g", step->name,
                      (int)iteration, objective, kkt_residual);
        (void)fflush(stderr);
    }
    return interrupted;
}

static void end_iterations(void) {
    if (isatty(STDERR_FILENO)) {
        (void)fputs("\r\033[K", stderr);
    }
}

static int has_output(const mhi_step *step) {
    return step->output != NULL && step->output[0] != '\0';
}

static mhe_status solve_step(reference *r, int32_t number, mhe_error *err) {
    mhi_step *step = &r->steps[number];
    const mhe_solve_control control = {
        .size = sizeof control, .data = step, .progress = show_iteration};
    int32_t read_back = 0;
    const mhi_step_setup setup = {.run = r->run,
                                  .host = r->setup->host,
                                  .system = mhi_estimator_system(r->estimator),
                                  .steps = r->steps,
                                  .number = number,
                                  .done = r->done,
                                  .control = &control,
                                  .cache = r->cache,
                                  .read_back = &read_back,
                                  .linearise = has_output(step)};
    mhe_solve_info info = {.size = sizeof info};
    const double begin = mhi_seconds();
    mhe_status status = mhi_step_solve(&setup, &r->arena, &r->done[number], &info, err);
    end_iterations();
    if (status != MHE_OK) {
        return status;
    }
    const double spent = mhi_seconds() - begin;
    (void)printf("%s: %d intervals, %d iterations, ", step->name, (int)step->intervals,
                 (int)info.iterations);
    if (read_back) {
        (void)printf("solved before");
    } else {
        (void)printf("%.1f s (%.0f ms an iteration, %.0f %% of it the model)", spent,
                     1e3 * spent / (info.iterations > 0 ? info.iterations : 1),
                     100 * info.evaluation_time / spent);
    }
    (void)printf(", objective %.6g, residual %.2g\n", info.objective, info.kkt_residual);
    (void)fflush(stdout);
    return judge(r, step, &info, err);
}

static mhe_status integrate(reference *r, int32_t number, mhe_error *err) {
    const mhi_step *step = &r->steps[number];
    const mhi_bounds_section *b = &r->run->bounds;
    const int driven = r->run->formulation == MHE_FORMULATION_EXCITATION;
    simulation *s = &r->simulations[number];
    track_report report;
    char folder[4096];
    if (!has_output(step)) {
        return MHE_OK;
    }
    if (interrupted) {
        return interruption(step, err);
    }
    (void)snprintf(folder, sizeof folder, "%s/%s", r->out, step->output);
    mhe_status status =
        simulation_open(s, r->run, mhi_estimator_system(r->estimator), r->setup->host,
                        r->setup->registry, step->intervals / step->duration, err);
    if (status == MHE_OK) {
        status = simulation_files(s, folder, NULL, err);
    }
    if (status == MHE_OK) {
        status = reference_track(s, &r->done[number], step->drop,
                                 driven ? b->excitation_min : b->activation_min,
                                 driven ? b->excitation_max : b->activation_max, &report, err);
    }
    if (status == MHE_OK) {
        (void)printf("%s: integrated; feedback up to %.2g, then within %.2g rad and %.2g rad/s of "
                     "the solution; peak excitation %.3f, force %.0f N\n",
                     step->output, report.correction, report.q, report.qdot, report.peak_excitation,
                     report.peak_force);
        (void)fflush(stdout);
    }
    return status;
}

/* No file appears before all are complete. */
static mhe_status commit(reference *r, mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < r->n_steps && status == MHE_OK; i++) {
        if (r->simulations[i].outbox != NULL) {
            status = simulation_commit(&r->simulations[i], err);
        }
    }
    return status;
}

/* Results without their picture are complete. */
static void draw(reference *r) {
    const mhe_system *system = mhi_system_face(mhi_estimator_system(r->estimator));
    const char **outputs = MHI_TAKE(&r->arena, const char *, r->n_steps);
    mhe_error why = {0};
    int32_t n = 0;
    for (int32_t i = 0; i < r->n_steps && outputs != NULL; i++) {
        if (has_output(&r->steps[i])) {
            outputs[n++] = r->steps[i].output;
        }
    }
    if (r->run->output.picture && n > 0 &&
        reference_picture(r->out, outputs, n, system->n_q, system->n_m, &why) != MHE_OK) {
        r->setup->host->log(r->setup->host, MHE_LOG_WARNING, why.text);
    }
}

mhe_status reference_run(const reference_setup *setup, mhe_error *err) {
    reference r = {.setup = setup};
    const struct sigaction stop = {.sa_handler = on_interrupt, .sa_flags = (int)SA_RESETHAND};
    (void)sigaction(SIGINT, &stop, NULL);
    mhe_status status = open_all(&r, err);
    for (int32_t i = 0; i < r.n_steps && status == MHE_OK; i++) {
        status = solve_step(&r, i, err);
    }
    for (int32_t i = 0; i < r.n_steps && status == MHE_OK; i++) {
        status = integrate(&r, i, err);
    }
    if (status == MHE_OK) {
        status = commit(&r, err);
    }
    if (status == MHE_OK) {
        draw(&r);
    }
    for (int32_t i = 0; i < r.n_steps && r.simulations != NULL; i++) {
        simulation_close(&r.simulations[i]);
    }
    mhe_estimator_close(r.estimator);
    mhi_arena_free(&r.arena);
    mhi_run_free(r.run);
    return status;
}

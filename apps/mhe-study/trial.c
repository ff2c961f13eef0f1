/* SPDX-License-Identifier: Apache-2.0 */
#include "trial.h"

#include "base/pi.h"
#include "estimator/create.h"
#include "measure.h"
#include "program.h"
#include <mhe/outbox.h>

#include <math.h>
#include <string.h>

typedef struct tracking {
    const condition *condition;
    const volatile int32_t *stop;
    mhe_estimator *estimator;
    mhe_estimator_info info;
    mhi_recording *recording;
    mhi_errors *errors;
    mhe_outbox *outbox; /* of kept forces; NULL */
    mhe_sink *forces;
    trial_result *result;
} tracking;

static mhe_status open_all(tracking *t, const mhi_noise *noise, const mhe_host *host,
                           mhe_error *err) {
    const condition *c = t->condition;
    const mhi_run *run = c->run;
    mhe_status status = mhi_noise_recording(noise, c->motion, c->model, run->model.plugin,
                                            run->model.config, host, &t->recording, err);
    if (status == MHE_OK) {
        status = mhi_estimator_create_on(run, c->model, host, &t->estimator, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    t->info.size = sizeof t->info;
    mhe_estimator_describe(t->estimator, &t->info);
    mhi_estimator_set_start(t->estimator, t->recording->reference.q, t->recording->reference.qdot);
    return mhi_errors_create(mhi_estimator_system(t->estimator), t->recording, &t->errors, err);
}

static mhe_status take(tracking *t, const mhe_estimate *estimate, mhe_error *err) {
    mhe_status status = mhi_errors_add(t->errors, estimate, err);
    return status == MHE_OK && t->forces != NULL
               ? mhe_sink_row(t->forces, estimate->time, estimate->force, err)
               : status;
}

/* The other nodes of the only window. */
static mhe_status take_window(tracking *t, mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t k = 1; k <= t->info.window && status == MHE_OK; k++) {
        mhe_estimate node = {.size = sizeof node};
        status = mhi_estimator_node(t->estimator, k, &node, err);
        if (status == MHE_OK) {
            status = take(t, &node, err);
        }
    }
    return status;
}

static mhe_status estimate_all(tracking *t, mhe_error *err) {
    const mhi_recording *r = t->recording;
    tally *counts = &t->result->tally;
    mhe_status status = MHE_OK;
    for (int32_t k = 0; k < r->n_frames && status == MHE_OK; k++) {
        if (*t->stop) {
            return mhe_fail(err, MHE_E_INTERRUPTED, "interrupted");
        }
        const mhe_frame frame = mhi_recording_frame(r, t->info.n_markers, t->info.n_muscles, k);
        mhe_estimate estimate = {.size = sizeof estimate};
        int32_t ready = 0;
        status = mhe_estimator_push(t->estimator, &frame, &estimate, &ready, err);
        if (status == MHE_OK && ready) {
            status = tally_add(counts, &estimate, err);
            status = status == MHE_OK ? take(t, &estimate, err) : status;
        }
    }
    if (status == MHE_OK && counts->n_solves == 0) {
        status = mhe_fail(err, MHE_E_INPUT, "%d frames are too few for a window of %d intervals",
                          (int)r->n_frames, (int)t->info.window);
    }
    return status == MHE_OK && counts->n_solves == 1 && t->info.node == 0 ? take_window(t, err)
                                                                          : status;
}

/* dir/forces/<condition>-<trial>.sto */
static mhe_status open_forces(tracking *t, const study *s, task what, const char *dir,
                              mhe_error *err) {
    mhi_text path = {0}, name = {0};
    mhi_text_add(&path, "%s/forces", dir);
    mhi_text_add(&name, "%04d-%04d.sto", (int)what.condition, (int)what.trial);
    mhi_text title = {0};
    study_condition_text(s, t->condition, &title);
    mhe_status status = path.failed || name.failed || title.failed
                            ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                            : mhe_outbox_open(path.data, &t->outbox, err);
    if (status == MHE_OK) {
        status = mhe_sink_sto(t->outbox, name.data, title.data, t->info.muscle_names,
                              t->info.n_muscles, &t->forces, err);
    }
    mhi_text_free(&path);
    mhi_text_free(&name);
    mhi_text_free(&title);
    return status;
}

static int is_ours(mhe_status status) {
    return status == MHE_E_MEMORY || status == MHE_E_IO || status == MHE_E_INTERRUPTED;
}

mhe_status trial_run(const study *s, task what, const char *dir, const mhe_host *host,
                     const volatile int32_t *stop, trial_result *result, mhe_error *err) {
    if (s->keys.program != NULL) {
        *result = (trial_result){0};
        return program_run(s, what, dir, stop, result, err);
    }
    const condition *c = &s->conditions[what.condition];
    tracking t = {.condition = c, .stop = stop, .result = result};
    mhi_noise noise = c->noise;
    noise.seed = study_seed(s, c, what.trial);
    *result = (trial_result){0};
    const double begin = measure_seconds();
    mhe_status status = open_all(&t, &noise, host, err);
    if (status == MHE_OK && c->keep_forces && dir != NULL) {
        status = open_forces(&t, s, what, dir, err);
    }
    if (status == MHE_OK) {
        status = estimate_all(&t, err);
    }
    if (status == MHE_OK) {
        const mhi_output_section *output = &c->run->output;
        mhi_errors_rmse(t.errors, output->skip_first, output->skip_last, &result->rmse);
        status = t.outbox == NULL ? MHE_OK : mhe_outbox_commit(t.outbox, err);
    }
    result->seconds = measure_seconds() - begin;
    mhe_outbox_close(t.outbox);
    mhi_errors_free(t.errors);
    mhi_recording_free(t.recording);
    mhe_estimator_close(t.estimator);
    if (status != MHE_OK && !is_ours(status)) {
        result->failed = 1;
        result->reason = *err;
        return MHE_OK;
    }
    return status;
}

void trial_free(trial_result *result) {
    tally_free(&result->tally);
}

/* What is not known is an empty cell. */
static void add_number(mhi_text *cells, double value) {
    mhi_text_add(cells, isfinite(value) ? ",%.10g" : ",", value);
}

void trial_cells(trial_result *r, mhi_text *cells) {
    const double degrees = 180 / MHI_PI;
    mhi_text_add(cells, "%s,%d", r->failed ? "failed" : "ok", (int)r->tally.n_solves);
    enum { N_COUNTS = 3 };
    const double values[] = {tally_converged(&r->tally),
                             tally_iterations(&r->tally),
                             r->tally.iterations_max,
                             degrees * r->rmse.q,
                             r->rmse.qdot,
                             r->rmse.activation,
                             r->rmse.excitation,
                             r->rmse.force,
                             1e3 * r->rmse.marker};
    for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
        add_number(cells, i >= N_COUNTS && r->failed ? NAN : values[i]);
    }
}

void trial_timing(trial_result *r, mhi_text *cells) {
    static const double at[] = {0.5, 0.95, 0.99, 1};
    const tally *t = &r->tally;
    const int32_t timed = t->solve_ms == NULL ? 0 : t->n_solves; /* a program tells no times */
    const double first = timed > 0 ? t->solve_ms[0] : NAN;
    const int32_t skip = timed > 1, n = timed - skip; /* the first starts cold */
    double *times = n > 0 ? t->solve_ms + skip : NULL, sum = 0;
    for (int32_t i = 0; i < n; i++) {
        sum += times[i];
    }
    if (n > 0) {
        mhi_text_add(cells, "%.6g", 1e3 * n / sum);
        measure_sort(times, n);
    }
    add_number(cells, n > 0 ? sum / n : NAN);
    for (size_t i = 0; i < sizeof at / sizeof at[0]; i++) {
        add_number(cells, measure_percentile(times, n, at[i]));
    }
    add_number(cells, first);
    add_number(cells, r->seconds);
    add_number(cells, tally_peak_rss_mb());
}

mhe_status trial_check(const study *s, const condition *c, const mhe_host *host, mhe_error *err) {
    mhe_estimator *estimator = NULL;
    mhe_error why = {0};
    if (s->keys.program != NULL) { /* which knows what it needs */
        return MHE_OK;
    }
    mhe_status status = mhi_estimator_create_on(c->run, c->model, host, &estimator, &why);
    mhe_estimator_close(estimator);
    if (status == MHE_OK) {
        return MHE_OK;
    }
    mhi_text text = {0};
    study_condition_text(s, c, &text);
    status = mhi_fail_at(err, status, s->tree, c->node, "%s: %s", text.data, why.text);
    mhi_text_free(&text);
    return status;
}

/* SPDX-License-Identifier: Apache-2.0 */
#include "track.h"

#include "believe/believe.h"
#include "believe/diagnosis.h"
#include "estimator/create.h"
#include "interrupt.h"
#include "picture.h"
#include "progress.h"
#include "report.h"
#include "results.h"
#include "summary.h"

#include <mhe/library.h>
#include <string.h>

typedef struct tracking {
    const track_setup *setup;
    mhe_estimator *estimator;
    mhi_recording *recording;
    mhi_errors *errors;
    mhi_diagnosis *diagnosis;
    mhe_outbox *outbox;
    results *results;
    summary summary;
    live live;
} tracking;

/* What live use expects where the config leaves it open. */
static mhe_status open_live(tracking *t, mhe_error *err) {
    const mhi_run *run = t->setup->run;
    const double between = run->horizon.ratio / t->recording->rate;
    t->live.deadline = run->realtime.deadline_ms > 0 ? 1e-3 * run->realtime.deadline_ms : between;
    mhi_estimator_set_deadline(t->estimator, t->live.deadline);
    if (strcmp(run->output.node_name, "auto") == 0) {
        mhi_estimator_set_node(t->estimator, run->horizon.window);
    }
    t->summary.live = &t->live;
    return live_open(&t->live, t->recording->n_frames, err);
}

/* Before anything else: a folder that cannot be written to is told at once, not after the run. */
static mhe_status claim_folder(tracking *t, mhe_error *err) {
    const mhi_run *run = t->setup->run;
    const mhi_data_section *d = &run->data;
    const char *const inputs[] = {run->path, run->model_file.file, d->markers,       d->emg,
                                  d->angles, d->reference,         run->emg.mvc_file};
    mhe_status status = mhe_outbox_open(t->setup->out, &t->outbox, err);
    if (status == MHE_OK) {
        status = mhe_outbox_claim(t->outbox, results_names, results_n_names, err);
    }
    for (size_t i = 0; i < sizeof inputs / sizeof inputs[0] && status == MHE_OK; i++) {
        status = mhe_outbox_spare(t->outbox, inputs[i], err);
    }
    return status;
}

/* What of an earlier run lies among, or in the place of, this one's results. */
static void tell_stale(const tracking *t) {
    char *names = NULL;
    int32_t n = 0;
    mhi_text line = {0};
    if (mhe_outbox_stale(t->outbox, &names, &n, NULL) == MHE_OK && n > 0) {
        mhi_text_add(&line, "%s: of an earlier run, not of this one: %s", t->setup->out, names);
    }
    if (line.data != NULL && !line.failed) {
        t->setup->host->log(t->setup->host, MHE_LOG_WARNING, line.data);
    }
    mhi_text_free(&line);
    mhe_free(names);
}

/* What the recording and the model say of each other; warnings of it, too. */
static mhe_status believe(tracking *t, const mhi_system *system, mhe_error *err) {
    const track_setup *s = t->setup;
    mhi_findings *findings = &t->recording->findings;
    const int32_t told = findings->n;
    mhe_status status = mhi_believe_model(s->run, system, t->recording, findings, err);
    if (status == MHE_OK) {
        status = mhi_believe_fit(s->run, system, t->recording, findings, err);
    }
    mhi_findings_tell(findings, told, s->host);
    return status;
}

static mhe_status open_all(tracking *t, mhe_error *err) {
    const track_setup *s = t->setup;
    if (s->realtime && !s->check_only) {
        live_raise(&t->live);
    }
    mhe_status status = s->check_only ? MHE_OK : claim_folder(t, err);
    if (status == MHE_OK) {
        status = mhi_estimator_create(s->run, s->host, &t->estimator, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    const mhi_system *system = mhi_estimator_system(t->estimator);
    t->summary.info.size = sizeof t->summary.info;
    mhe_estimator_describe(t->estimator, &t->summary.info);
    status =
        mhi_recording_read(s->run, mhi_system_description(system), s->host, &t->recording, err);
    if (status == MHE_OK) {
        status = believe(t, system, err);
    }
    if (status == MHE_OK && t->recording->reference.present) {
        mhi_estimator_set_start(t->estimator, t->recording->reference.q,
                                t->recording->reference.qdot);
        status = mhi_errors_create(system, t->recording, &t->errors, err);
    }
    if (status == MHE_OK && s->realtime) {
        status = open_live(t, err);
    }
    if (status == MHE_OK && !s->check_only) {
        t->summary.n_frames = t->recording->n_frames;
        t->summary.emg = t->recording->emg_report;
        t->summary.alignment = t->recording->alignment;
        status = mhi_diagnosis_create(&t->summary.info, s->run, t->recording, system, &t->diagnosis,
                                      err);
    }
    if (status == MHE_OK && !s->check_only) {
        status = results_open(t->outbox, &t->summary.info, t->recording, &s->run->output.formats,
                              &t->results, err);
    }
    return status;
}

static mhe_status take_estimate(tracking *t, const mhe_estimate *estimate, mhe_error *err) {
    mhi_diagnosis_add(t->diagnosis, estimate);
    mhe_status status = results_write(t->results, estimate, mhi_diagnosis_distances(t->diagnosis),
                                      mhi_diagnosis_emg(t->diagnosis), err);
    if (status == MHE_OK) {
        status = tally_add(&t->summary.tally, estimate, err);
    }
    if (status == MHE_OK && t->errors != NULL) {
        status = mhi_errors_add(t->errors, estimate, err);
    }
    return status;
}

static mhe_status estimate_frame(tracking *t, int32_t k, mhe_error *err) {
    const mhi_recording *r = t->recording;
    const mhe_estimator_info *info = &t->summary.info;
    const mhe_frame frame = mhi_recording_frame(r, info->n_markers, info->n_muscles, k);
    mhe_estimate estimate = {.size = sizeof estimate};
    int32_t ready = 0;
    mhe_status status = mhe_estimator_push(t->estimator, &frame, &estimate, &ready, err);
    if (status == MHE_OK && ready) {
        if (t->setup->realtime) {
            live_estimated(&t->live);
        }
        status = take_estimate(t, &estimate, err);
    }
    t->summary.n_pushed += status == MHE_OK;
    return status;
}

static void show(progress *bar, int32_t done, const tally *t) {
    const double elapsed = progress_elapsed(bar);
    progress_update(bar, done, "%.1f solves/s  %.1f %% converged",
                    elapsed > 0 ? t->n_solves / elapsed : 0.0,
                    t->n_solves == 0 ? 100.0 : 100 * tally_converged(t));
}

static mhe_status estimate_all(tracking *t, mhe_error *err) {
    const int32_t n = t->recording->n_frames;
    const atomic_int *stop = interrupt_asked();
    progress bar;
    progress_start(&bar, n, 0, t->setup->quiet);
    mhi_estimator_set_stop(t->estimator, stop);
    mhe_status status = MHE_OK;
    for (int32_t k = 0; k < n && status == MHE_OK && !*stop; k++) {
        if (t->setup->realtime) {
            k = live_wait(&t->live, t->estimator, t->recording->time, n);
        }
        status = *stop ? MHE_OK : estimate_frame(t, k, err);
        show(&bar, k + 1, &t->summary.tally);
    }
    status = status == MHE_E_INTERRUPTED ? MHE_OK : status; /* finish() tells */
    t->summary.elapsed = progress_elapsed(&bar);
    progress_end(&bar);
    live_end(&t->live);
    mhe_estimator_describe(t->estimator, &t->summary.info);
    return status;
}

static mhe_status write_texts(tracking *t, mhe_error *err) {
    const mhi_run *run = t->setup->run;
    mhi_text text = {0};
    if (t->errors != NULL) {
        t->summary.has_rmse = 1;
        mhi_errors_rmse(t->errors, run->output.skip_first, run->output.skip_last, &t->summary.rmse);
    }
    mhe_estimator_describe(t->estimator, &t->summary.info); /* the interval is known now */
    mhi_diagnosis_judge(t->diagnosis, &t->recording->findings);
    t->summary.findings = &t->recording->findings;
    t->summary.diagnosis = t->diagnosis;
    t->summary.model = mhi_system_description(mhi_estimator_system(t->estimator));
    mhi_run_write(run, &text);
    mhe_status status = text.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                    : mhe_outbox_text(t->outbox, "config.yaml", text.data, err);
    mhi_text_free(&text);
    if (status == MHE_OK) {
        status = summary_json(&t->summary, run, &text, err);
    }
    if (status == MHE_OK) {
        status = text.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                             : mhe_outbox_text(t->outbox, "summary.json", text.data, err);
    }
    mhi_text_free(&text);
    return status;
}

static void draw(tracking *t) {
    const mhi_run *run = t->setup->run;
    mhe_error why = {0};
    if (!run->output.picture || t->summary.info.n_muscles == 0) { /* no forces to show */
        return;
    }
    mhe_status status = picture_estimates(t->setup->out, run->data.reference, &why);
    if (status != MHE_OK) {
        t->setup->host->log(t->setup->host, MHE_LOG_WARNING, why.text);
    }
}

static void tell(const tracking *t) {
    mhi_text text = {0};
    mhe_error why = {0};
    summary_verdict(&t->summary, &text);
    summary_lines(&t->summary, &text);
    mhi_diagnosis_lines(t->diagnosis, &text);
    if (!text.failed) {
        (void)fputs(text.data, stdout);
        (void)printf("results in %s\n", t->setup->out);
        if (report_write(t->setup->out, t->setup->run->name, text.data, &why) != MHE_OK) {
            t->setup->host->log(t->setup->host, MHE_LOG_WARNING, why.text);
        }
    }
    mhi_text_free(&text);
}

static mhe_status finish(tracking *t, mhe_error *err) {
    if (t->summary.tally.n_solves == 0 && !*interrupt_asked()) {
        return mhe_fail(err, MHE_E_INPUT,
                        "no frame has a marker or an angle to begin from; nothing is written");
    }
    if (t->summary.tally.n_solves == 0) {
        return mhe_fail(err, MHE_E_INTERRUPTED,
                        "interrupted before the first estimate; nothing is written");
    }
    mhe_status status = write_texts(t, err);
    if (status == MHE_OK) {
        status = mhe_outbox_commit(t->outbox, err);
    }
    interrupt_end();
    if (status != MHE_OK) {
        return status;
    }
    draw(t);
    if (t->summary.tally.n_converged == 0 &&
        t->summary.tally.n_predicted < t->summary.tally.n_solves && !t->setup->realtime) {
        t->setup->host->log(t->setup->host, MHE_LOG_WARNING,
                            "no solve converged; quality.sto says how each ended");
    }
    tell(t);
    if (*interrupt_asked()) {
        return mhe_fail(
            err, MHE_E_INTERRUPTED,
            "interrupted after %d of %d frames; the files hold what was estimated until then",
            t->summary.n_pushed, t->summary.n_frames);
    }
    if (t->summary.tally.n_predicted == t->summary.tally.n_solves) {
        return mhe_fail(err, MHE_E_NUMERIC,
                        "every solve failed; the files hold the model's predictions, quality.sto "
                        "says how each ended");
    }
    return MHE_OK;
}

mhe_status track(const track_setup *setup, mhe_error *err) {
    tracking t = {.setup = setup};
    mhe_status status = open_all(&t, err);
    if (status == MHE_OK && !setup->check_only) {
        interrupt_begin(t.outbox);
        status = estimate_all(&t, err);
        interrupt_settle();
        if (status == MHE_OK) {
            status = finish(&t, err);
        }
        interrupt_end();
    }
    if (t.outbox != NULL) {
        tell_stale(&t);
    }
    results_close(t.results);
    mhe_outbox_close(t.outbox);
    mhi_errors_free(t.errors);
    mhi_diagnosis_free(t.diagnosis);
    mhi_recording_free(t.recording);
    mhe_estimator_close(t.estimator);
    tally_free(&t.summary.tally);
    live_close(&t.live);
    return status;
}

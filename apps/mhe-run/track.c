/* SPDX-License-Identifier: Apache-2.0 */
#include "track.h"

#include "interrupt.h"
#include "picture.h"
#include "progress.h"
#include "report.h"
#include "results.h"
#include "summary.h"
#include "understood.h"

#include <math.h>
#include <mhe/library.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef struct tracking {
    const track_setup *setup;
    mhe_estimator *estimator;
    mhe_recording *recording;
    mhe_findings *findings;
    mhe_outbox *outbox;
    results *results;
    summary summary;
    live live;
} tracking;

/* A key that every configuration has, as a number; 0 where it is none. */
static double number(const tracking *t, const char *key) {
    double value = 0;
    (void)mhe_config_get_real(t->setup->config, key, &value, NULL);
    return value;
}

/* Of the time between frames, without a deadline: the rest is for the preparation of the next and
 * for being late. */
#define LIVE_SHARE 0.75

/* What live use expects where the config leaves it open. */
static mhe_status open_live(tracking *t, mhe_error *err) {
    const mhe_estimator_info *info = &t->summary.info;
    const double deadline = 1e-3 * number(t, "realtime.deadline_ms");
    const double share = LIVE_SHARE * info->ratio / t->summary.recording.rate;
    t->live.deadline = deadline > 0 ? deadline : share;
    t->live.least = fmin(t->live.deadline, share);
    const double waiting = ceil(t->live.deadline * t->summary.recording.rate);
    t->live.kept = waiting > info->ratio ? (int32_t)fmin(waiting, INT32_MAX) : info->ratio;
    char *node = NULL;
    mhe_status status = mhe_estimator_set_deadline(t->estimator, t->live.deadline, err);
    if (status == MHE_OK) {
        status = mhe_config_get(t->setup->config, "output.node", &node, err);
    }
    if (status == MHE_OK && strcmp(node, "auto") == 0) {
        status = mhe_estimator_set_node(t->estimator, info->window, err);
    }
    mhe_free(node);
    t->summary.live = &t->live;
    return status == MHE_OK ? live_open(&t->live, t->summary.recording.n_frames, err) : status;
}

/* Before anything else: a folder that cannot be written to is told at once, not after the run. */
static mhe_status claim_folder(tracking *t, mhe_error *err) {
    static const char *const inputs[] = {"model.file",         "data.markers",   "data.emg",
                                         "data.angles",        "data.reference", "emg.mvc_file",
                                         "data.external_loads"};
    mhe_status status = mhe_outbox_open(t->setup->out, &t->outbox, err);
    if (status == MHE_OK) {
        status = mhe_outbox_claim(t->outbox, results_names, results_n_names, err);
    }
    if (status == MHE_OK) {
        status = mhe_outbox_spare(t->outbox, t->setup->path, err);
    }
    for (size_t i = 0; i < sizeof inputs / sizeof inputs[0] && status == MHE_OK; i++) {
        char *path = NULL;
        status = mhe_config_get(t->setup->config, inputs[i], &path, err);
        if (status == MHE_OK && path[0] != '\0') {
            status = mhe_outbox_spare(t->outbox, path, err);
        }
        mhe_free(path);
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

/* The reference knows how the run begins. */
static mhe_status start_as_known(tracking *t, mhe_error *err) {
    mhe_truth truth = {.size = sizeof truth};
    if (!t->summary.recording.has_reference) {
        return MHE_OK;
    }
    mhe_status status = mhe_recording_truth(t->recording, 0, &truth, err);
    return status == MHE_OK ? mhe_estimator_set_start(t->estimator, truth.q, truth.qdot, err)
                            : status;
}

static mhe_status open_results(tracking *t, mhe_error *err) {
    char *formats = NULL;
    mhe_status status = mhe_config_get(t->setup->config, "output.formats", &formats, err);
    if (status == MHE_OK) {
        status = results_open(t->outbox, &t->summary.info, &t->summary.recording, formats,
                              &t->results, err);
    }
    if (status == MHE_OK) {
        status = peaks_open(&t->summary.peaks, &t->summary.info, err);
    }
    mhe_free(formats);
    return status;
}

static mhe_status open_all(tracking *t, mhe_error *err) {
    const track_setup *s = t->setup;
    if (s->realtime && !s->check_only) {
        live_raise(&t->live);
    }
    mhe_status status = s->check_only ? MHE_OK : claim_folder(t, err);
    if (status == MHE_OK) {
        status = mhe_estimator_create(s->config, &t->estimator, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    t->summary.info.size = sizeof t->summary.info;
    t->summary.recording.size = sizeof t->summary.recording;
    mhe_estimator_describe(t->estimator, &t->summary.info);
    status = mhe_recording_open(s->config, &t->recording, err);
    if (status == MHE_OK) {
        status = mhe_recording_describe(t->recording, &t->summary.recording, err);
    }
    if (status == MHE_OK && t->summary.recording.n_frames > 0) {
        const double *time = t->summary.recording.time;
        status = mhe_estimator_covers(t->estimator, time[0],
                                      time[t->summary.recording.n_frames - 1], 0, err);
    }
    if (status == MHE_OK) {
        status = start_as_known(t, err);
    }
    if (status == MHE_OK) {
        status = mhe_findings_open(s->config, t->estimator, t->recording, &t->findings, err);
    }
    if (status == MHE_OK && s->realtime) {
        status = open_live(t, err);
    }
    return status == MHE_OK && !s->check_only ? open_results(t, err) : status;
}

static mhe_status take_estimate(tracking *t, const mhe_estimate *estimate, mhe_error *err) {
    mhe_status status = mhe_findings_add(t->findings, estimate, err);
    if (status == MHE_OK) {
        status = results_write(t->results, estimate, mhe_findings_distances(t->findings),
                               mhe_findings_emg(t->findings), err);
    }
    peaks_add(&t->summary.peaks, estimate);
    return status == MHE_OK ? tally_add(&t->summary.tally, estimate, err) : status;
}

static mhe_status estimate_frame(tracking *t, int32_t k, mhe_error *err) {
    mhe_frame frame = {.size = sizeof frame};
    mhe_estimate estimate = {.size = sizeof estimate};
    int32_t ready = 0;
    mhe_status status = mhe_recording_frame(t->recording, k, &frame, err);
    if (status == MHE_OK) {
        status = mhe_estimator_push(t->estimator, &frame, &estimate, &ready, err);
    }
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
    const int32_t n = t->summary.recording.n_frames;
    progress bar;
    progress_start(&bar, n, 0, t->setup->quiet);
    mhe_status status = MHE_OK;
    for (int32_t k = 0; k < n && status == MHE_OK && !interrupt_asked(); k++) {
        if (t->setup->realtime) {
            k = live_wait(&t->live, t->estimator, t->summary.recording.time, n);
        }
        status = interrupt_asked() ? MHE_OK : estimate_frame(t, k, err);
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
    mhe_config *config = t->setup->config;
    mhi_text json = {0};
    char *resolved = NULL;
    mhe_status status = MHE_OK;
    t->summary.has_rmse = t->summary.recording.has_reference;
    t->summary.rmse.size = sizeof t->summary.rmse;
    if (t->summary.has_rmse) {
        status = mhe_findings_rmse(t->findings, (int32_t)number(t, "output.skip_first"),
                                   (int32_t)number(t, "output.skip_last"), &t->summary.rmse, err);
    }
    mhe_estimator_describe(t->estimator, &t->summary.info); /* the interval is known now */
    t->summary.findings = t->findings;
    t->summary.config = config;
    if (status == MHE_OK) {
        status = summary_take_offsets(&t->summary, t->estimator, err);
    }
    if (status == MHE_OK) {
        status = mhe_findings_judge(t->findings, &t->summary.weight, err);
    }
    if (status == MHE_OK) {
        status = mhe_config_write(config, &resolved, err);
    }
    if (status == MHE_OK) {
        status = mhe_outbox_text(t->outbox, "config.yaml", resolved, err);
    }
    mhe_free(resolved);
    if (status == MHE_OK) {
        status = summary_json(&t->summary, t->setup->path, &json, err);
    }
    if (status == MHE_OK) {
        status = json.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                             : mhe_outbox_text(t->outbox, "summary.json", json.data, err);
    }
    mhi_text_free(&json);
    return status;
}

static void draw(tracking *t) {
    char *reference = NULL;
    mhe_error why = {0};
    if (number(t, "output.picture") == 0 ||
        t->summary.info.n_muscles == 0) { /* no forces to show */
        return;
    }
    mhe_status status = mhe_config_get(t->setup->config, "data.reference", &reference, &why);
    if (status == MHE_OK) {
        status = picture_estimates(t->setup->out, reference[0] != '\0' ? reference : NULL, &why);
    }
    if (status != MHE_OK) {
        t->setup->host->log(t->setup->host, MHE_LOG_WARNING, why.text);
    }
    mhe_free(reference);
}

/* What, when and with what: above the report's findings. */
static void add_facts(const tracking *t, mhi_text *out) {
    static const char *const keys[] = {"model.file", "data.markers", "data.emg", "data.angles",
                                       "data.reference"};
    const time_t now = time(NULL);
    struct tm utc;
    char date[64];
    if (gmtime_r(&now, &utc) != NULL &&
        strftime(date, sizeof date, "%Y-%m-%d %H:%M UTC", &utc) > 0) {
        mhi_text_add(out, "date: %s\n", date);
    }
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++) {
        char *value = NULL;
        if (mhe_config_get(t->setup->config, keys[i], &value, NULL) == MHE_OK && *value != '\0') {
            mhi_text_add(out, "%s: %s\n", keys[i], value);
        }
        mhe_free(value);
    }
    mhi_text_add(out, "solver: %s, windows of %d intervals of %.4g ms\n", t->summary.info.solver,
                 t->summary.info.window, 1e3 * t->summary.info.interval);
}

static void tell(const tracking *t) {
    mhi_text text = {0};
    mhe_error why = {0};
    char *findings = NULL;
    summary_verdict(&t->summary, &text);
    const size_t verdict = text.failed ? 0 : strlen(text.data);
    summary_lines(&t->summary, &text);
    if (mhe_findings_write(t->findings, &findings, &why) == MHE_OK) {
        mhi_text_add(&text, "%s", findings);
    }
    mhe_free(findings);
    if (!text.failed) {
        (void)fputs(text.data, stdout);
        (void)printf("results in %s; open %s/report.html\n", t->setup->out, t->setup->out);
        mhi_text page = {0};
        mhi_text_add(&page, "%.*s", (int)verdict, text.data);
        add_facts(t, &page);
        mhi_text_add(&page, "%s", text.data + verdict);
        char *reference = NULL;
        (void)mhe_config_get(t->setup->config, "data.reference", &reference, NULL);
        const char *truth = reference != NULL && *reference != '\0' ? reference : NULL;
        if (!page.failed &&
            report_write(t->setup->out, t->setup->config, page.data, truth, &why) != MHE_OK) {
            t->setup->host->log(t->setup->host, MHE_LOG_WARNING, why.text);
        }
        mhe_free(reference);
        mhi_text_free(&page);
    }
    mhi_text_free(&text);
}

static mhe_status finish(tracking *t, mhe_error *err) {
    if (t->summary.tally.n_solves == 0 && !interrupt_asked()) {
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
    if (interrupt_asked()) {
        return mhe_fail(
            err, MHE_E_INTERRUPTED,
            "interrupted after %d of %d frames; the files hold what was estimated until then",
            t->summary.n_pushed, t->summary.recording.n_frames);
    }
    if (t->summary.tally.n_predicted == t->summary.tally.n_solves) {
        return mhe_fail(err, MHE_E_NUMERIC,
                        "every solve failed; the files hold the model's predictions, quality.sto "
                        "says how each ended");
    }
    return MHE_OK;
}

/* --check: what was understood, and whether it can be believed. */
static mhe_status tell_understood(tracking *t, mhe_error *err) {
    mhi_text text = {0};
    t->summary.findings = t->findings;
    t->summary.config = t->setup->config;
    mhe_status status = mhe_findings_judge(t->findings, &t->summary.weight, err);
    if (status == MHE_OK) {
        understood_lines(&t->summary.info, &t->summary.recording, t->recording, &text);
        summary_verdict(&t->summary, &text);
        (void)fputs(text.failed ? "" : text.data, stdout);
    }
    mhi_text_free(&text);
    return status;
}

mhe_status track(const track_setup *setup, mhe_error *err) {
    tracking t = {.setup = setup};
    mhe_status status = open_all(&t, err);
    if (status == MHE_OK && !setup->check_only) {
        interrupt_begin(t.outbox, t.estimator);
        status = estimate_all(&t, err);
        interrupt_settle();
        if (status == MHE_OK) {
            status = finish(&t, err);
        }
        interrupt_end();
    }
    if (status == MHE_OK && setup->check_only) {
        status = tell_understood(&t, err);
    }
    if (t.outbox != NULL) {
        tell_stale(&t);
    }
    results_close(t.results);
    mhe_outbox_close(t.outbox);
    mhe_findings_close(t.findings);
    mhe_recording_close(t.recording);
    mhe_estimator_close(t.estimator);
    tally_free(&t.summary.tally);
    peaks_free(&t.summary.peaks);
    free(t.summary.marker_offsets);
    live_close(&t.live);
    return status;
}

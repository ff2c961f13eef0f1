/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE /* secure_getenv */
#include "report.h"

#include "config/options.h"
#include "gather.h"
#include "identity.h"
#include "process.h"
#include "session.h"
#include <mhe/outbox.h>

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define LEVELS_MAX 8
#define MUSCLES_MAX 16

/* report.noise_example */
typedef struct example {
    const char *name, *reference;
    mhe_real_list levels;
    mhe_text_list muscles;
} example;

static const mhe_option example_options[] = {
    MHE_OPT_TEXT(example, name, 0, "noise", "Name of the figure."),
    MHE_OPT_TEXT(example, reference, 0, NULL, "Motion; none: the first condition's."),
    MHE_OPT_REALS(example, levels, MHE_OPT_REQUIRED, 0, 100, "1", "Levels of EMG noise."),
    MHE_OPT_TEXTS(example, muscles, MHE_OPT_REQUIRED, "Muscles whose excitation is shown."),
};

static const mhi_node *example_node(const study *s) {
    const mhi_node *report = mhi_node_find(mhi_tree_root(s->tree), "report");
    return report == NULL ? NULL : mhi_node_find(report, "noise_example");
}

static mhe_status find_muscle(const study *s, const mhe_description *d, const char *name,
                              int32_t *found, mhe_error *err) {
    const char *names[256];
    char hint[256];
    int32_t n = 0;
    for (int32_t i = 0; i < d->n_muscles && n < 256; i++) {
        names[n++] = d->muscles[i].name;
        if (strcmp(d->muscles[i].name, name) == 0) {
            *found = i;
            return MHE_OK;
        }
    }
    return mhi_fail_at(err, MHE_E_CONFIG, s->tree, example_node(s),
                       "noise_example: the model has no muscle '%s'%s", name,
                       mhi_suggest(hint, sizeof hint, name, names, n));
}

/* The condition whose motion is shown. */
static const condition *example_condition(const study *s, const example *e) {
    const condition *c = &s->conditions[0];
    for (int32_t i = s->n_conditions; i-- > 0 && e->reference != NULL && c->reference != NULL;) {
        c = strcmp(s->conditions[i].reference, e->reference) == 0 ? &s->conditions[i] : c;
    }
    return c;
}

/* Records of the true EMG and of all levels. */
static mhe_status make_records(const study *s, const condition *c, const example *e,
                               mhi_record records[LEVELS_MAX + 1], mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i <= e->levels.n && status == MHE_OK; i++) {
        const mhi_noise noise = {.seed = s->keys.seed,
                                 .emg = {.level = i == 0 ? 0 : e->levels.values[i - 1]}};
        status = mhi_noise_emg(&noise, c->motion, c->model, &records[i], err);
    }
    return status;
}

static mhe_status write_example(const study *s, const condition *c, const example *e,
                                const mhi_record *records, mhi_text *csv, mhe_error *err) {
    const int32_t n_levels = e->levels.n, n = c->model->n_muscles;
    mhe_status status = MHE_OK;
    int32_t muscle[MUSCLES_MAX] = {0};
    mhi_text_add(csv, "time");
    for (int32_t m = 0; m < e->muscles.n && status == MHE_OK; m++) {
        status = find_muscle(s, c->model, e->muscles.values[m], &muscle[m], err);
        for (int32_t i = 0; i <= n_levels; i++) {
            mhi_text_add(csv, ",%s/%g", e->muscles.values[m], i == 0 ? 0 : e->levels.values[i - 1]);
        }
    }
    for (int32_t k = 0; k < records[0].n_samples && status == MHE_OK; k++) {
        mhi_text_add(csv, "\n%.9g", records[0].time[k]);
        for (int32_t m = 0; m < e->muscles.n; m++) {
            for (int32_t i = 0; i <= n_levels; i++) {
                mhi_text_add(csv, ",%.6g", records[i].values[(ptrdiff_t)k * n + muscle[m]]);
            }
        }
    }
    mhi_text_add(csv, "\n");
    return status == MHE_OK && csv->failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : status;
}

/* dir/report/noise_example.csv, where the study asks for it. */
static mhe_status make_example(session *s, mhe_error *err) {
    const mhi_node *node = example_node(&s->study);
    const char *dir = mhi_arena_format(&s->arena, "%s/report", s->dir);
    example e = {0};
    mhi_record records[LEVELS_MAX + 1] = {{0}};
    mhi_text csv = {0};
    mhe_outbox *outbox = NULL;
    if (node == NULL) {
        return MHE_OK;
    }
    mhe_status status = mhi_options_fill(
        example_options, sizeof example_options / sizeof example_options[0], s->study.tree, node,
        NULL, 0, "noise_example", s->study.dir, &s->arena, &e, err);
    if (status == MHE_OK && (e.levels.n > LEVELS_MAX || e.muscles.n > MUSCLES_MAX)) {
        status =
            mhi_fail_at(err, MHE_E_CONFIG, s->study.tree, node,
                        "noise_example: at most %d levels and %d muscles", LEVELS_MAX, MUSCLES_MAX);
    }
    if (status == MHE_OK && dir == NULL) {
        status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    if (status == MHE_OK) {
        const condition *c = example_condition(&s->study, &e);
        status = make_records(&s->study, c, &e, records, err);
        status = status == MHE_OK ? write_example(&s->study, c, &e, records, &csv, err) : status;
    }
    status = status == MHE_OK ? mhe_outbox_open(dir, &outbox, err) : status;
    if (status == MHE_OK) {
        status = mhe_outbox_text(outbox, "noise_example.csv", csv.data, err);
    }
    status = status == MHE_OK ? mhe_outbox_commit(outbox, err) : status;
    mhe_outbox_close(outbox);
    for (int32_t i = 0; i <= LEVELS_MAX; i++) {
        mhi_record_free(&records[i]);
    }
    mhi_text_free(&csv);
    return status;
}

/* Debian's own Python has the packages; another one in PATH may not. */
static const char *python(void) {
    static const char debian[] = "/usr/bin/python3";
    const char *chosen = secure_getenv("MHE_PYTHON");
    return chosen != NULL && *chosen != '\0' ? chosen
           : access(debian, X_OK) == 0       ? debian
                                             : "python3";
}

static mhe_status run_scripts(session *s, int quiet, mhe_error *err) {
    const char *script = NULL;
    mhe_status status = process_share("study/report.py", &s->arena, &script, err);
    const char *const argv[] = {python(), "-B", script, s->dir, NULL};
    if (status != MHE_OK) {
        return status;
    }
    return process_run(argv, quiet, err);
}

static mhe_status gather_all(session *s, mhe_error *err) {
    mhi_text text = {0};
    int lock = -1;
    mhe_status status = s->rows.n > 0
                            ? session_lock(s, &lock, err)
                            : mhe_fail(err, MHE_E_INPUT, "%s: no trial was run yet", s->dir);
    status = status == MHE_OK ? gather(&s->study, &s->rows, s->dir, err) : status;
    status = status == MHE_OK ? session_identity(s, &text, err) : status;
    if (status == MHE_OK) { /* what is shown may have changed since the study was run */
        status = identity_write(&s->study, s->dir, &text, err);
    }
    mhi_text_free(&text);
    if (lock >= 0) {
        (void)close(lock);
    }
    if (status == MHE_OK && s->rows.n < s->study.n_trials) {
        char line[96];
        (void)snprintf(line, sizeof line, "%d of %d trials are missing",
                       (int)(s->study.n_trials - s->rows.n), (int)s->study.n_trials);
        s->host->log(s->host, MHE_LOG_WARNING, line);
    }
    return status;
}

mhe_status report_make(const arguments *a, const mhe_host *host, mhe_error *err) {
    session s = {.lock = -1};
    mhe_status status = MHE_OK;
    if (a->others.n > 0) {
        return mhe_fail(err, MHE_E_ARGUMENT, "one results folder at a time: '%s' and '%s'", a->file,
                        a->others.values[0]);
    }
    status = session_reopen(&s, a->file, host, err);
    status = status == MHE_OK ? gather_all(&s, err) : status;
    status = status == MHE_OK ? make_example(&s, err) : status;
    status = status == MHE_OK ? run_scripts(&s, a->quiet, err) : status;
    if (status == MHE_OK) {
        (void)printf("report in %s/report: report.html\n", s.dir);
    }
    session_close(&s);
    return status;
}

/* SPDX-License-Identifier: Apache-2.0 */
#include "run.h"

#include "gather.h"
#include "identity.h"
#include "session.h"
#include "workers.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* Tasks of the shard that have no row yet. */
static mhe_status missing_tasks(session *s, const arguments *a, task **tasks, int32_t *n,
                                int32_t *n_shard, mhe_error *err) {
    study *st = &s->study;
    task *all = NULL;
    mhe_status status = study_order(st, &all, err);
    int32_t *first = MHI_TAKE(&s->arena, int32_t, st->n_conditions + 1);
    uint8_t *done = MHI_TAKE(&s->arena, uint8_t, st->n_trials);
    if (status != MHE_OK || first == NULL || done == NULL) {
        return status != MHE_OK ? status : mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < st->n_conditions; i++) {
        first[i + 1] = first[i] + st->conditions[i].trials;
    }
    for (int32_t i = 0; i < s->rows.n; i++) {
        done[first[s->rows.list[i].task.condition] + s->rows.list[i].task.trial] = 1;
    }
    *n = *n_shard = 0;
    *tasks = all;
    for (int32_t i = 0; i < st->n_trials; i++) {
        const task t = all[i];
        const int ours = i % a->shard.n == a->shard.i;
        *n_shard += ours;
        if (ours && !done[first[t.condition] + t.trial]) {
            all[(*n)++] = t; /* never before the place that is read next */
        }
    }
    return MHE_OK;
}

static mhe_status tell(const session *s, mhe_error *err) {
    mhi_text text = {0};
    gather_tell(&s->study, &s->rows, &text);
    mhe_status status = text.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    if (status == MHE_OK) {
        (void)fputs(text.data, stdout);
    }
    mhi_text_free(&text);
    return status;
}

/* Tables, once no trial is missing; shards that end together do it one after the other. */
static mhe_status finish(session *s, const char *own, mhe_error *err) {
    int lock = -1;
    mhe_status status = session_lock(s, &lock, err);
    if (status == MHE_OK) {
        rows_free(&s->rows);
        status = rows_read(&s->study, s->dir, own, &s->rows, err);
    }
    if (status == MHE_OK && s->rows.n == s->study.n_trials) {
        status = gather(&s->study, &s->rows, s->dir, err);
        status = status == MHE_OK ? tell(s, err) : status;
        if (status == MHE_OK) {
            (void)printf("results in %s\n", s->dir);
        }
    } else if (status == MHE_OK) {
        (void)printf("%s: %d of %d trials; other shards have the rest\n", s->dir, (int)s->rows.n,
                     (int)s->study.n_trials);
    }
    if (lock >= 0) {
        (void)close(lock);
    }
    return status;
}

static mhe_status work(session *s, const arguments *a, const char *own, mhe_error *err) {
    task *tasks = NULL;
    int32_t n = 0, n_shard = 0;
    workers_report report;
    mhe_status status = missing_tasks(s, a, &tasks, &n, &n_shard, err);
    if (status != MHE_OK) {
        return status;
    }
    const int32_t wanted = a->n_workers > 0 ? a->n_workers
                           : s->study.keys.measure == MEASURE_TIMING
                               ? 1
                               : cluster_processors(WORKERS_MAX);
    const workers_setup setup = {.study = &s->study,
                                 .tasks = tasks,
                                 .n_tasks = n,
                                 .n_before = n_shard - n,
                                 .dir = s->dir,
                                 .own = own,
                                 .host = s->host,
                                 .n_workers = wanted < n ? wanted : n,
                                 .quiet = a->quiet};
    if (n < n_shard) {
        (void)printf("%d of %d trials are there already\n", (int)(n_shard - n), (int)n_shard);
        (void)fflush(stdout);
    }
    status = workers_run(&setup, &report, err);
    if (status == MHE_E_INTERRUPTED) {
        return mhe_fail(err, status,
                        "interrupted; %d of %d trials are done, the same command does the rest",
                        (int)(n_shard - n + report.n_done), (int)n_shard);
    }
    if (status == MHE_OK && n > 0) {
        (void)printf("%d trials in %.1f s on %d workers\n", (int)report.n_done, report.seconds,
                     (int)setup.n_workers);
    }
    return status;
}

static void tell_checked(const session *s, const arguments *a) {
    (void)printf("%s: ok: %d conditions, %d trials\n", a->file, (int)s->study.n_conditions,
                 (int)s->study.n_trials);
}

mhe_status run_study(const arguments *a, const mhe_host *host, mhe_error *err) {
    session s = {.lock = -1};
    char own[40];
    (void)snprintf(own, sizeof own, "%dof%d", (int)a->shard.i, (int)a->shard.n);
    mhe_status status = session_read_asked(&s, a, host, err);
    if (status == MHE_OK && a->check) {
        status = session_check(&s, err);
        if (status == MHE_OK) {
            tell_checked(&s, a);
        }
    } else if (status == MHE_OK) {
        status = session_prepare(&s, a->out, a->quiet, err);
        status = status == MHE_OK ? session_take_shard(&s, own, err) : status;
        status = status == MHE_OK ? work(&s, a, own, err) : status;
        status = status == MHE_OK ? finish(&s, own, err) : status;
    }
    session_close(&s);
    return status;
}

/* ---- merge ---- */

static mhe_status take_rows(session *s, const char *from, row_writer *w, int32_t *n_taken,
                            mhe_error *err) {
    rows theirs = {0};
    mhi_text text = {0};
    int32_t known = 0;
    mhe_status status = session_identity(s, &text, err);
    status = status == MHE_OK ? identity_check(from, &text, &known, err) : status;
    if (status == MHE_OK && !known) {
        status = mhe_fail(err, MHE_E_INPUT, "%s: this is not the results folder of a study", from);
    }
    status = status == MHE_OK ? rows_read(&s->study, from, NULL, &theirs, err) : status;
    for (int32_t i = 0; i < theirs.n && status == MHE_OK; i++) {
        status = rows_append(w, &theirs.list[i], err);
        ++*n_taken;
    }
    mhi_text_free(&text);
    rows_free(&theirs);
    return status;
}

static mhe_status take_all(session *s, const arguments *a, mhe_error *err) {
    static const char own[] = "merged";
    row_writer w = {.fd = -1};
    int32_t n_taken = 0;
    mhe_status status = session_take_shard(s, own, err);
    status = status == MHE_OK ? rows_open(s->dir, own, 0, &w, err) : status;
    for (int32_t i = 0; i < a->others.n && status == MHE_OK; i++) {
        status = take_rows(s, a->others.values[i], &w, &n_taken, err);
    }
    mhe_error late = {0};
    mhe_status closed = rows_close(&w, status == MHE_OK ? err : &late);
    status = status == MHE_OK ? closed : status;
    if (status == MHE_OK) {
        rows_free(&s->rows);
        status = rows_read(&s->study, s->dir, own, &s->rows, err);
    }
    return status;
}

mhe_status run_merge(const arguments *a, const mhe_host *host, mhe_error *err) {
    session s = {.lock = -1};
    mhe_status status = session_reopen(&s, a->file, host, err);
    if (status == MHE_OK && a->others.n > 0) {
        status = take_all(&s, a, err);
    }
    int lock = -1;
    status = status == MHE_OK ? session_lock(&s, &lock, err) : status;
    status = status == MHE_OK ? gather(&s.study, &s.rows, s.dir, err) : status;
    if (lock >= 0) {
        (void)close(lock);
    }
    status = status == MHE_OK ? tell(&s, err) : status;
    if (status == MHE_OK && s.rows.n < s.study.n_trials) {
        status = mhe_fail(err, MHE_E_IO,
                          "%s: %d of %d trials are missing; the tables are of the "
                          "others",
                          s.dir, (int)(s.study.n_trials - s.rows.n), (int)s.study.n_trials);
    }
    session_close(&s);
    return status;
}

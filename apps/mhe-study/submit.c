/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700 /* realpath */
#include "submit.h"

#include "process.h"
#include "session.h"
#include <mhe/outbox.h>

#include <errno.h>
#include <stdlib.h>
#include <string.h>

static const char *const engines[] = {"slurm"};

static mhe_status no_memory(mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

/* In single quotes for sh. */
static void add_quoted(mhi_text *out, const char *word) {
    mhi_text_add(out, "'");
    for (const char *c = word; *c != '\0'; c++) {
        mhi_text_add(out, *c == '\'' ? "'\\''" : "%c", *c);
    }
    mhi_text_add(out, "'");
}

static void add_option(mhi_text *out, const char *name, const char *value) {
    mhi_text_add(out, " %s ", name);
    add_quoted(out, value);
}

/* What stands in #SBATCH lines ends at a blank, and knows %. */
static mhe_status check_folder(const char *dir, mhe_error *err) {
    return dir[strcspn(dir, " \t\n%'\"\\")] == '\0'
               ? MHE_OK
               : mhe_fail(err, MHE_E_ARGUMENT,
                          "--out: '%s' holds blanks, quotes or %%, which Slurm's file names cannot",
                          dir);
}

static mhe_status write_script(session *s, const arguments *a, const char *program, const char *dir,
                               const char *study_file, mhe_error *err) {
    const int32_t workers = a->n_workers > 0 ? a->n_workers : 1;
    const char *folder = mhi_arena_format(&s->arena, "%s/slurm", dir);
    mhe_outbox *outbox = NULL;
    mhi_text job = {0};
    mhi_text_add(&job,
                 "#!/bin/sh\n#SBATCH --job-name=%s\n#SBATCH --array=0-%d\n#SBATCH --ntasks=1\n"
                 "#SBATCH --cpus-per-task=%d\n#SBATCH --requeue\n#SBATCH --open-mode=append\n"
                 "#SBATCH --output=%s/%%a.log\n",
                 s->study.name, (int)a->n_tasks - 1, (int)workers, folder == NULL ? "" : folder);
    mhi_text_add(&job, "# A requeued task goes on where its rows end.\nexec ");
    add_quoted(&job, program);
    mhi_text_add(&job, " run ");
    add_quoted(&job, study_file);
    add_option(&job, "--out", dir);
    for (int32_t i = 0; i < a->set.n; i++) {
        add_option(&job, "--set", a->set.values[i]);
    }
    mhi_text_add(&job, " --workers %d --quiet --shard \"$SLURM_ARRAY_TASK_ID/%d\"\n", (int)workers,
                 (int)a->n_tasks);
    mhe_status status =
        job.failed || folder == NULL ? no_memory(err) : mhe_outbox_open(folder, &outbox, err);
    status = status == MHE_OK ? mhe_outbox_text(outbox, "job.sh", job.data, err) : status;
    status = status == MHE_OK ? mhe_outbox_commit(outbox, err) : status;
    mhe_outbox_close(outbox);
    mhi_text_free(&job);
    return status;
}

static mhe_status call_sbatch(session *s, const arguments *a, const char *dir, const char **job,
                              mhe_error *err) {
    const char *script = mhi_arena_format(&s->arena, "%s/slurm/job.sh", dir);
    const char **argv = MHI_TAKE(&s->arena, const char *, a->option.n + 5);
    int n = 0;
    if (script == NULL || argv == NULL) {
        return no_memory(err);
    }
    argv[n++] = "sbatch";
    argv[n++] = "--parsable";
    for (int32_t i = 0; i < a->option.n; i++) {
        argv[n++] = a->option.values[i];
    }
    argv[n++] = script;
    const char *text = NULL;
    mhe_status status = process_read(argv, &s->arena, &text, err);
    *job = status == MHE_OK
               ? mhi_arena_text_n(&s->arena, text, strcspn(text, ";\n")) /* "12" or "12;cluster" */
               : NULL;
    return status == MHE_OK && *job == NULL ? no_memory(err) : status;
}

static mhe_status choose_engine(const arguments *a, mhe_error *err) {
    char hint[128];
    const char *given = a->engine == NULL ? "" : a->engine;
    if (strcmp(given, engines[0]) == 0) {
        return MHE_OK;
    }
    (void)mhi_suggest(hint, sizeof hint, given, engines, 1);
    return a->engine == NULL ? mhe_fail(err, MHE_E_ARGUMENT, "--engine is needed%s", hint)
                             : mhe_fail(err, MHE_E_ARGUMENT, "unknown engine '%s'%s", given, hint);
}

/* Paths that hold on any machine. */
static mhe_status find_paths(session *s, const arguments *a, const char **program,
                             const char **study_file, const char **dir, mhe_error *err) {
    char *whole = realpath(a->file, NULL), *out = realpath(s->dir, NULL);
    mhe_status status = whole == NULL || out == NULL
                            ? mhe_fail(err, MHE_E_INPUT, "%s: %s", whole == NULL ? a->file : s->dir,
                                       strerror(errno))
                            : process_beside("mhe-study", &s->arena, program, err);
    if (status == MHE_OK) {
        *study_file = mhi_arena_text(&s->arena, whole);
        *dir = mhi_arena_text(&s->arena, out);
        status = *study_file == NULL || *dir == NULL ? no_memory(err) : check_folder(*dir, err);
    }
    free(whole);
    free(out);
    return status;
}

mhe_status submit_study(const arguments *a, const mhe_host *host, mhe_error *err) {
    session s = {.lock = -1};
    const char *program = NULL, *study_file = NULL, *dir = NULL, *job = NULL;
    mhe_status status = choose_engine(a, err);
    status =
        status == MHE_OK ? session_read(&s, a->file, a->set.values, a->set.n, host, err) : status;
    status = status == MHE_OK ? session_prepare(&s, a->out, a->quiet, err) : status;
    status = status == MHE_OK ? find_paths(&s, a, &program, &study_file, &dir, err) : status;
    status = status == MHE_OK ? write_script(&s, a, program, dir, study_file, err) : status;
    status = status == MHE_OK ? call_sbatch(&s, a, dir, &job, err) : status;
    if (status == MHE_OK) {
        (void)printf("job %s: %d tasks, %d trials; 'squeue --job %s' shows how far it is\n"
                     "results in %s when it has ended; 'mhe-study merge' gathers what is there\n",
                     job, (int)a->n_tasks, (int)s.study.n_trials, job, dir);
    }
    session_close(&s);
    return status;
}

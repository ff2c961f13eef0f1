/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE /* sched_getaffinity */
#include "cluster.h"

#include "base/text.h"
#include "process.h"

#include <mhe/outbox.h>
#include <sched.h>
#include <stdlib.h>
#include <string.h>

static const char *const engines[] = {"slurm"};

static mhe_status no_memory(mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

mhe_status cluster_take_part(const char *word, const char *value, void *target, mhe_error *err) {
    char *end = NULL;
    const long part = strtol(value, &end, 10);
    const long n = end != value && *end == '/' ? strtol(end + 1, &end, 10) : 0;
    if (*end != '\0' || part < 0 || n < 1 || n > CLUSTER_TASKS_MAX || part >= n) {
        return mhe_fail(err, MHE_E_ARGUMENT,
                        "%s: '%s' is not like 0/8 ... 7/8, the first to the last of eight", word,
                        value);
    }
    *(cluster_part *)target = (cluster_part){(int32_t)part, (int32_t)n};
    return MHE_OK;
}

int32_t cluster_processors(int32_t most) {
    cpu_set_t set;
    CPU_ZERO(&set);
    const int n = sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
    return n < 1 ? 1 : n > most ? most : n;
}

mhe_status cluster_check_engine(const char *engine, mhe_error *err) {
    char hint[128];
    const char *given = engine == NULL ? "" : engine;
    if (strcmp(given, engines[0]) == 0) {
        return MHE_OK;
    }
    (void)mhi_suggest(hint, sizeof hint, given, engines, 1);
    return engine == NULL ? mhe_fail(err, MHE_E_ARGUMENT, "--engine is needed%s", hint)
                          : mhe_fail(err, MHE_E_ARGUMENT, "unknown engine '%s'%s", given, hint);
}

/* In single quotes for sh. */
static void add_quoted(mhi_text *out, const char *word) {
    mhi_text_add(out, "'");
    for (const char *c = word; *c != '\0'; c++) {
        mhi_text_add(out, *c == '\'' ? "'\\''" : "%c", *c);
    }
    mhi_text_add(out, "'");
}

/* What stands in #SBATCH lines ends at a blank, and knows %. */
static mhe_status check_folder(const char *dir, mhe_error *err) {
    return dir[strcspn(dir, " \t\n%'\"\\")] == '\0'
               ? MHE_OK
               : mhe_fail(err, MHE_E_ARGUMENT,
                          "--out: '%s' holds blanks, quotes or %%, which Slurm's file names cannot",
                          dir);
}

static mhe_status write_script(const cluster_job *what, const char *folder, mhe_error *err) {
    mhe_outbox *outbox = NULL;
    mhi_text job = {0};
    mhi_text_add(&job,
                 "#!/bin/sh\n#SBATCH --job-name=%s\n#SBATCH --array=0-%d\n#SBATCH --ntasks=1\n"
                 "#SBATCH --cpus-per-task=%d\n#SBATCH --requeue\n#SBATCH --open-mode=append\n"
                 "#SBATCH --output=%s/%%a.log\n",
                 what->name, (int)what->n_tasks - 1, (int)what->n_workers, folder);
    mhi_text_add(&job, "# A requeued task goes on where its results end.\nexec");
    for (int32_t i = 0; i < what->n_command; i++) {
        mhi_text_add(&job, " ");
        add_quoted(&job, what->command[i]);
    }
    mhi_text_add(&job, " --workers %d --quiet --shard \"$SLURM_ARRAY_TASK_ID/%d\"\n",
                 (int)what->n_workers, (int)what->n_tasks);
    mhe_status status = job.failed ? no_memory(err) : mhe_outbox_open(folder, &outbox, err);
    status = status == MHE_OK ? mhe_outbox_text(outbox, "job.sh", job.data, err) : status;
    status = status == MHE_OK ? mhe_outbox_commit(outbox, err) : status;
    mhe_outbox_close(outbox);
    mhi_text_free(&job);
    return status;
}

static mhe_status call_sbatch(const cluster_job *what, const char *folder, mhi_arena *arena,
                              const char **job, mhe_error *err) {
    const char *script = mhi_arena_format(arena, "%s/job.sh", folder);
    const char **argv = MHI_TAKE(arena, const char *, what->n_options + 5);
    int n = 0;
    if (script == NULL || argv == NULL) {
        return no_memory(err);
    }
    argv[n++] = "sbatch";
    argv[n++] = "--parsable";
    for (int32_t i = 0; i < what->n_options; i++) {
        argv[n++] = what->options[i];
    }
    argv[n++] = script;
    const char *text = NULL;
    mhe_status status = process_read(argv, arena, &text, err);
    *job = status == MHE_OK ? mhi_arena_text_n(arena, text, strcspn(text, ";\n"))
                            : NULL; /* "12" or "12;cluster" */
    return status == MHE_OK && *job == NULL ? no_memory(err) : status;
}

mhe_status cluster_submit(const cluster_job *what, mhi_arena *arena, const char **job,
                          mhe_error *err) {
    const char *folder = mhi_arena_format(arena, "%s/slurm", what->dir);
    *job = NULL;
    mhe_status status = folder == NULL ? no_memory(err) : check_folder(what->dir, err);
    status = status == MHE_OK ? write_script(what, folder, err) : status;
    return status == MHE_OK ? call_sbatch(what, folder, arena, job, err) : status;
}

/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700 /* realpath */
#include "submit.h"

#include "process.h"
#include "session.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

static mhe_status no_memory(mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "out of memory");
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
        status = *study_file == NULL || *dir == NULL ? no_memory(err) : MHE_OK;
    }
    free(whole);
    free(out);
    return status;
}

static mhe_status submit(session *s, const arguments *a, const char **dir, const char **job,
                         mhe_error *err) {
    const char *program = NULL, *study_file = NULL;
    const char **command = MHI_TAKE(&s->arena, const char *, 6 + 2 * a->set.n);
    int32_t n = 0;
    mhe_status status =
        command == NULL ? no_memory(err) : find_paths(s, a, &program, &study_file, dir, err);
    if (status != MHE_OK) {
        return status;
    }
    const char *const first[] = {program, "run", study_file, "--out", *dir};
    for (; n < 5; n++) {
        command[n] = first[n];
    }
    for (int32_t i = 0; i < a->set.n; i++) {
        command[n++] = "--set";
        command[n++] = a->set.values[i];
    }
    if (a->trust) {
        command[n++] = "--trust";
    }
    const cluster_job what = {.name = s->study.name,
                              .dir = *dir,
                              .command = command,
                              .n_command = n,
                              .n_tasks = a->n_tasks,
                              .n_workers = a->n_workers > 0 ? a->n_workers : 1,
                              .options = a->option.values,
                              .n_options = a->option.n};
    return cluster_submit(&what, &s->arena, job, err);
}

mhe_status submit_study(const arguments *a, const mhe_host *host, mhe_error *err) {
    session s = {.lock = -1};
    const char *dir = NULL, *job = NULL;
    mhe_status status = cluster_check_engine(a->engine, err);
    status = status == MHE_OK ? session_read_asked(&s, a, host, err) : status;
    status = status == MHE_OK ? session_prepare(&s, a->out, a->quiet, err) : status;
    status = status == MHE_OK ? submit(&s, a, &dir, &job, err) : status;
    if (status == MHE_OK) {
        (void)printf("job %s: %d tasks, %d trials; 'squeue --job %s' shows how far it is\n"
                     "results in %s when it has ended; 'mhe-study merge' gathers what is there\n",
                     job, (int)a->n_tasks, (int)s.study.n_trials, job, dir);
    }
    session_close(&s);
    return status;
}

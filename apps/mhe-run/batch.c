/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700 /* realpath */
#include "batch.h"

#include "base/text.h"
#include "cluster.h"
#include "process.h"

#include <errno.h>
#include <mhe/library.h>
#include <mhe/outbox.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static mhe_status no_memory(mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

/* ./out/<name of the list> unless said otherwise. */
static mhe_status choose_folder(const arguments *a, batch *b, mhe_error *err) {
    size_t length = strlen(a->batch);
    while (length > 1 && a->batch[length - 1] == '/') {
        length--;
    }
    char *name = mhi_arena_text_n(&b->arena, a->batch, length);
    if (name == NULL) {
        return no_memory(err);
    }
    char *slash = strrchr(name, '/'), *base = slash == NULL ? name : slash + 1;
    char *dot = strrchr(base, '.');
    if (dot != NULL && dot != base) {
        *dot = '\0';
    }
    if (a->out == NULL && (base[0] == '\0' || base[0] == '.')) {
        return mhe_fail(err, MHE_E_ARGUMENT, "--out is needed: '%s' gives the results no name",
                        a->batch);
    }
    b->dir = a->out != NULL ? a->out : mhi_arena_format(&b->arena, "out/%s", base);
    return b->dir == NULL ? no_memory(err) : MHE_OK;
}

/* Whether the config reads EMG: recordings of both kinds are then its source, too. */
static mhe_status look_at_config(arguments *a, const mhe_host *host, mhe_error *err) {
    mhe_config *config = NULL;
    char *emg = NULL;
    if (a->config == NULL) {
        return MHE_OK;
    }
    mhe_status status = mhe_config_read(a->config, a->set.values, a->set.n,
                                        a->trust ? MHE_CONFIG_TRUST : 0, host, &config, err);
    status = status == MHE_OK ? mhe_config_get(config, "data.emg", &emg, err) : status;
    a->emg_too = status == MHE_OK && emg[0] != '\0';
    mhe_free(emg);
    mhe_config_close(config);
    return status;
}

static mhe_status prepare(arguments *a, batch *b, const mhe_host *host, mhe_error *err) {
    mhe_status status = look_at_config(a, host, err);
    status = status == MHE_OK ? batch_read(a, b, err) : status;
    status = status == MHE_OK ? choose_folder(a, b, err) : status;
    return status == MHE_OK ? batch_check(a, b, host, err) : status;
}

static mhe_status work(const arguments *a, batch *b, mhe_error *err) {
    const batch_trial **mine = MHI_TAKE(&b->arena, const batch_trial *, b->n);
    int32_t n = 0, n_known = 0;
    if (mine == NULL) {
        return no_memory(err);
    }
    for (int32_t i = 0; i < b->n; i++) {
        if (i % a->shard.n != a->shard.i) {
            continue;
        }
        if (b->trials[i].known) {
            n_known++;
        } else {
            mine[n++] = &b->trials[i];
        }
    }
    if (n_known > 0) {
        (void)printf("%d of %d trials are there already\n", (int)n_known, (int)(n + n_known));
        (void)fflush(stdout);
    }
    return batch_work(a, b, mine, n, err);
}

/* Parts that end together write the table one after the other; each writes all that is there. */
static mhe_status write_in_turn(const batch *b, int32_t *n_failed, mhe_error *err) {
    static const char *const names[] = {"batch.csv", "batch.html"};
    mhe_outbox *turn = NULL;
    mhe_status status = mhe_outbox_open(b->dir, &turn, err);
    for (int i = 0; status == MHE_OK; i++) {
        const struct timespec tenth = {.tv_nsec = 100000000};
        status = mhe_outbox_claim(turn, names, 2, err);
        if (status == MHE_OK) {
            status = batch_write(b, n_failed, err);
            break;
        }
        if (status != MHE_E_IO || i >= 300) {
            break;
        }
        status = MHE_OK;
        (void)nanosleep(&tenth, NULL);
    }
    mhe_outbox_close(turn);
    return status;
}

mhe_status batch_run(const arguments *given, const mhe_host *host, mhe_error *err) {
    arguments a = *given;
    batch b = {.n = 0};
    int32_t n_failed = 0;
    mhe_status status = prepare(&a, &b, host, err);
    if (status == MHE_OK) {
        mhe_error late = {0};
        status = work(&a, &b, err);
        const int32_t tell = status == MHE_OK || status == MHE_E_INTERRUPTED;
        const mhe_status written =
            tell ? write_in_turn(&b, &n_failed, status == MHE_OK ? err : &late) : MHE_OK;
        status = status == MHE_OK ? written : status;
    }
    if (status == MHE_OK && n_failed > 0) {
        status = mhe_fail(err, MHE_E_NUMERIC, "%s: %d of %d trials failed; %s/batch.html says why",
                          b.list, (int)n_failed, (int)b.n, b.dir);
    }
    mhi_arena_free(&b.arena);
    return status;
}

/* ---- as a job array ---- */

static mhe_status whole(batch *b, const char *path, const char **out, mhe_error *err) {
    char *found = realpath(path, NULL);
    if (found == NULL) {
        return mhe_fail(err, MHE_E_INPUT, "%s: %s", path, strerror(errno));
    }
    *out = mhi_arena_text(&b->arena, found);
    free(found);
    return *out == NULL ? no_memory(err) : MHE_OK;
}

static mhe_status command_of(const arguments *a, batch *b, const char *const **command, int32_t *n,
                             const char **dir, mhe_error *err) {
    const char *program = NULL, *list = NULL, *config = NULL;
    const char **words = MHI_TAKE(&b->arena, const char *, 7 + 2 * a->set.n);
    mhe_status status =
        words == NULL ? no_memory(err) : process_beside("mhe-run", &b->arena, &program, err);
    status = status == MHE_OK ? whole(b, b->list, &list, err) : status;
    status = status == MHE_OK ? whole(b, b->dir, dir, err) : status;
    status = status == MHE_OK && a->config != NULL ? whole(b, a->config, &config, err) : status;
    if (status != MHE_OK) {
        return status;
    }
    *n = 0;
    words[(*n)++] = program;
    if (config != NULL) {
        words[(*n)++] = config;
    }
    words[(*n)++] = "--batch";
    words[(*n)++] = list;
    words[(*n)++] = "--out";
    words[(*n)++] = *dir;
    if (a->trust) {
        words[(*n)++] = "--trust";
    }
    for (int32_t i = 0; i < a->set.n; i++) {
        words[(*n)++] = "--set";
        words[(*n)++] = a->set.values[i];
    }
    *command = words;
    return MHE_OK;
}

mhe_status batch_submit(const arguments *given, const mhe_host *host, mhe_error *err) {
    arguments a = *given;
    batch b = {.n = 0};
    mhe_outbox *folder = NULL;
    const char *const *command = NULL;
    const char *dir = NULL, *job = NULL;
    int32_t n = 0;
    mhe_status status = cluster_check_engine(a.engine, err);
    status = status == MHE_OK ? prepare(&a, &b, host, err) : status;
    status = status == MHE_OK ? mhe_outbox_open(b.dir, &folder, err) : status;
    status = status == MHE_OK ? command_of(&a, &b, &command, &n, &dir, err) : status;
    if (status == MHE_OK) {
        const cluster_job what = {.name = "mhe-run",
                                  .dir = dir,
                                  .command = command,
                                  .n_command = n,
                                  .n_tasks = a.n_tasks < b.n ? a.n_tasks : b.n,
                                  .n_workers = a.n_workers > 0 ? a.n_workers : 1,
                                  .options = a.option.values,
                                  .n_options = a.option.n};
        status = cluster_submit(&what, &b.arena, &job, err);
        if (status == MHE_OK) {
            (void)printf("job %s: %d tasks, %d trials; 'squeue --job %s' shows how far it is\n"
                         "results in %s; batch.html there grows with every task that ends\n",
                         job, (int)what.n_tasks, (int)b.n, job, dir);
        }
    }
    mhe_outbox_close(folder);
    mhi_arena_free(&b.arena);
    return status;
}

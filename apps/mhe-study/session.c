/* SPDX-License-Identifier: Apache-2.0 */
#include "session.h"

#include "identity.h"
#include "io/outbox_private.h"
#include "study_json.h"
#include "trial.h"
#include <mhe/outbox.h>

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/file.h>
#include <time.h>
#include <unistd.h>

#define PATIENCE 100 /* tenths of a second that workers of a killed run are waited for */

mhe_status session_read(session *s, const char *file, const char *const *set, int32_t n_set,
                        const mhe_host *host, mhe_error *err) {
    s->host = host;
    s->lock = -1;
    mhe_status status = study_read(file, set, n_set, &s->study, err);
    if (status == MHE_OK) {
        status = mhi_registry_create(host, &s->registry, err);
    }
    if (status == MHE_OK) {
        status = study_resolve(&s->study, s->registry, err);
    }
    return status == MHE_OK ? material_check(&s->study, s->registry, err) : status;
}

mhe_status session_read_asked(session *s, const arguments *a, const mhe_host *host,
                              mhe_error *err) {
    mhe_status status = session_read(s, a->file, a->set.values, a->set.n, host, err);
    return status == MHE_OK && !a->trust && !a->check ? study_is_harmless(&s->study, err) : status;
}

static mhe_status make_folder(const char *dir, mhe_error *err) {
    mhe_outbox *outbox = NULL;
    mhe_status status = mhe_outbox_open(dir, &outbox, err);
    mhe_outbox_close(outbox);
    return status;
}

/* Waits a while: the workers of a run that was killed hold the lock until they are gone. */
static mhe_status take_lock(session *s, const char *path, int patience, int *lock, mhe_error *err) {
    *lock = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (*lock < 0) {
        return mhe_fail(err, MHE_E_IO, "%s: %s", path, strerror(errno));
    }
    for (int i = 0; flock(*lock, LOCK_EX | LOCK_NB) != 0; i++) {
        const struct timespec tenth = {.tv_nsec = 100000000};
        if (errno != EWOULDBLOCK && errno != EINTR) {
            return mhe_fail(err, MHE_E_IO, "%s: cannot be locked: %s", path, strerror(errno));
        }
        if (i >= patience) {
            return mhe_fail(err, MHE_E_IO, "%s: another mhe-study works in this folder", s->dir);
        }
        (void)nanosleep(&tenth, NULL);
    }
    return MHE_OK;
}

static mhe_status check_conditions(const session *s, mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < s->study.n_conditions && status == MHE_OK; i++) {
        status = trial_check(&s->study, &s->study.conditions[i], s->host, err);
    }
    return status;
}

mhe_status session_check(session *s, mhe_error *err) {
    mhe_status status = material_load(&s->study, NULL, s->host, &s->material, err);
    return status == MHE_OK ? check_conditions(s, err) : status;
}

mhe_status session_identity(const session *s, mhi_text *text, mhe_error *err) {
    return identity_text(&s->study, 1, text, err);
}

/* Whose folder it is is looked at before anything is made in it, and again with the motions. */
static mhe_status prepare_folder(session *s, int quiet, mhe_error *err) {
    mhi_text text = {0};
    int32_t known = 0;
    mhe_status status = identity_text(&s->study, 0, &text, err);
    if (status == MHE_OK) {
        status = identity_check(s->dir, &text, &known, err);
    }
    mhi_text_free(&text);
    status = status == MHE_OK ? material_make(&s->study, s->dir, quiet, err) : status;
    status =
        status == MHE_OK ? material_load(&s->study, s->dir, s->host, &s->material, err) : status;
    status = status == MHE_OK ? session_identity(s, &text, err) : status;
    status = status == MHE_OK ? identity_check(s->dir, &text, &known, err) : status;
    if (status == MHE_OK && !known) {
        status = check_conditions(s, err);
    }
    if (status == MHE_OK) { /* what the report is to show may have changed */
        status = identity_write(&s->study, s->dir, &text, err);
    }
    mhi_text_free(&text);
    return status;
}

/* Another shard may be making the motions: that takes its time. */
mhe_status session_lock(session *s, int *lock, mhe_error *err) {
    const char *path = mhi_arena_format(&s->arena, "%s/.lock", s->dir);
    *lock = -1;
    return path == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                        : take_lock(s, path, 100 * PATIENCE, lock, err);
}

/* What a run that was killed left half-written: all that is written into this folder is written
 * under the lock. */
static mhe_status sweep_folder(const char *dir, mhe_error *err) {
    mhe_outbox *outbox = NULL;
    mhe_status status = mhe_outbox_open(dir, &outbox, err);
    if (status == MHE_OK) {
        mhi_outbox_sweep(outbox);
    }
    mhe_outbox_close(outbox);
    return status;
}

mhe_status session_prepare(session *s, const char *out, int quiet, mhe_error *err) {
    s->dir = out == NULL ? mhi_arena_format(&s->arena, "out/%s", s->study.name)
                         : mhi_arena_text(&s->arena, out);
    const char *below = mhi_arena_format(&s->arena, "%s/rows", s->dir);
    int lock = -1;
    mhe_status status = s->dir == NULL || below == NULL
                            ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                            : make_folder(s->dir, err);
    status = status == MHE_OK ? session_lock(s, &lock, err) : status;
    status = status == MHE_OK ? sweep_folder(s->dir, err) : status;
    status = status == MHE_OK ? prepare_folder(s, quiet, err) : status;
    status = status == MHE_OK ? make_folder(below, err) : status;
    if (lock >= 0) {
        (void)close(lock);
    }
    return status;
}

mhe_status session_take_shard(session *s, const char *own, mhe_error *err) {
    const char *path = mhi_arena_format(&s->arena, "%s/rows/%s.lock", s->dir, own);
    mhe_status status = path == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                     : take_lock(s, path, PATIENCE, &s->lock, err);
    rows_free(&s->rows); /* of the folder before */
    return status == MHE_OK ? rows_read(&s->study, s->dir, own, &s->rows, err) : status;
}

mhe_status session_reopen(session *s, const char *dir, const mhe_host *host, mhe_error *err) {
    const char *file = NULL;
    const char **set = NULL;
    int32_t n_set = 0, known = 0;
    mhi_text text = {0};
    s->lock = -1;
    s->dir = dir;
    mhe_status status = study_json_origin(dir, &s->arena, &file, &set, &n_set, err);
    status = status == MHE_OK ? session_read(s, file, set, n_set, host, err) : status;
    status = status == MHE_OK ? material_load(&s->study, dir, host, &s->material, err) : status;
    status = status == MHE_OK ? session_identity(s, &text, err) : status;
    status = status == MHE_OK ? identity_check(dir, &text, &known, err) : status;
    mhi_text_free(&text);
    return status == MHE_OK ? rows_read(&s->study, dir, NULL, &s->rows, err) : status;
}

void session_close(session *s) {
    rows_free(&s->rows);
    material_free(&s->material);
    study_free(&s->study);
    mhi_registry_free(s->registry);
    if (s->lock >= 0) {
        (void)close(s->lock);
    }
    mhi_arena_free(&s->arena);
}

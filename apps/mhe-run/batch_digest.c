/* SPDX-License-Identifier: Apache-2.0 */
/* batch_digest.c: what a trial's results depend on, as a number; and how a trial ended. */
#define _XOPEN_SOURCE 700
#include "batch.h"

#include "base/digest.h"
#include "base/text.h"

#include <errno.h>
#include <inttypes.h>
#include <mhe/library.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define END_FILE "batch.txt"

/* Files of which size and time of change stand for their content. */
static const char *const inputs[] = {"model.file",         "data.markers",   "data.emg",
                                     "data.angles",        "data.reference", "emg.mvc_file",
                                     "data.external_loads"};

static void add_file(mhe_config *config, const char *key, mhi_text *text) {
    char *path = NULL;
    struct stat is;
    if (mhe_config_get(config, key, &path, NULL) == MHE_OK && path[0] != '\0' &&
        stat(path, &is) == 0) {
        mhi_text_add(text, "%s %lld %lld.%09ld\n", key, (long long)is.st_size,
                     (long long)is.st_mtim.tv_sec, is.st_mtim.tv_nsec);
    }
    mhe_free(path);
}

static mhe_status digest_of(mhe_config *config, const char *path, uint64_t *digest,
                            mhe_error *err) {
    mhi_text text = {0};
    char *resolved = NULL;
    mhe_status status = mhe_config_write(config, &resolved, err);
    if (status == MHE_OK) {
        mhi_text_add(&text, "%s\n%s\n%s\n", mhe_version(), path, resolved);
        for (size_t i = 0; i < sizeof inputs / sizeof inputs[0]; i++) {
            add_file(config, inputs[i], &text);
        }
        status = text.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    }
    if (status == MHE_OK) {
        *digest = mhi_digest(text.data, text.length);
    }
    mhe_free(resolved);
    mhi_text_free(&text);
    return status;
}

static mhe_status check_trial(const arguments *a, const batch *b, batch_trial *t,
                              const mhe_host *host, mhe_error *err) {
    mhe_config *config = NULL;
    mhe_error why = {0};
    mhe_status status = mhe_config_read(t->config, t->set, t->n_set,
                                        a->trust ? MHE_CONFIG_TRUST : 0, host, &config, &why);
    status = status == MHE_OK ? digest_of(config, t->config, &t->digest, &why) : status;
    mhe_config_close(config);
    if (status != MHE_OK) {
        return t->line > 0
                   ? mhe_fail(err, status, "%s:%d: %s: %.600s", b->list, t->line, t->name, why.text)
                   : mhe_fail(err, status, "%s: %.600s", t->name, why.text);
    }
    batch_end end;
    t->known = batch_end_read(b, t, &end) && end.digest == t->digest && end.status == 0;
    return MHE_OK;
}

mhe_status batch_check(const arguments *a, batch *b, const mhe_host *host, mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < b->n && status == MHE_OK; i++) {
        status = check_trial(a, b, &b->trials[i], host, err);
    }
    return status;
}

/* ---- ends ---- */

static int path_of(const batch *b, const batch_trial *t, const char *suffix, char path[4200]) {
    const int n = snprintf(path, 4200, "%s/%s/" END_FILE "%s", b->dir, t->name, suffix);
    return n > 0 && n < 4200;
}

/* What follows "KEY " in the next line, without its end; NULL: another line stands there. */
static char *field(FILE *file, const char *key, char *line, int size) {
    const size_t n = strlen(key);
    if (fgets(line, size, file) == NULL || strncmp(line, key, n) != 0 || line[n] != ' ') {
        return NULL;
    }
    line[strcspn(line, "\n")] = '\0';
    return line + n + 1;
}

int32_t batch_end_read(const batch *b, const batch_trial *t, batch_end *end) {
    char path[4200], digest[64], status[64], seconds[64],
        message[sizeof end->message + sizeof "message"];
    FILE *file = path_of(b, t, "", path) ? fopen(path, "r") : NULL;
    *end = (batch_end){.digest = 0};
    if (file == NULL) {
        return 0;
    }
    const char *const of[] = {field(file, "digest", digest, sizeof digest),
                              field(file, "status", status, sizeof status),
                              field(file, "seconds", seconds, sizeof seconds),
                              field(file, "message", message, sizeof message)};
    (void)fclose(file);
    if (of[0] == NULL || of[1] == NULL || of[2] == NULL) {
        return 0;
    }
    end->digest = strtoull(of[0], NULL, 16);
    end->status = (int32_t)strtol(of[1], NULL, 10);
    end->seconds = strtod(of[2], NULL);
    (void)snprintf(end->message, sizeof end->message, "%s", of[3] == NULL ? "" : of[3]);
    return 1;
}

mhe_status batch_end_write(const batch *b, const batch_trial *t, const batch_end *end,
                           mhe_error *err) {
    char path[4200], begun[4200];
    FILE *file = path_of(b, t, "", path) && path_of(b, t, ".new", begun) ? fopen(begun, "w") : NULL;
    int failed = file == NULL ||
                 fprintf(file, "digest %016" PRIx64 "\nstatus %d\nseconds %.3f\nmessage %s\n",
                         end->digest, (int)end->status, end->seconds, end->message) < 0 ||
                 fflush(file) != 0 || fsync(fileno(file)) != 0;
    if (file != NULL) {
        failed |= fclose(file) != 0;
    }
    failed = failed || rename(begun, path) != 0;
    return failed
               ? mhe_fail(err, MHE_E_IO, "%s/%s/" END_FILE ": %s", b->dir, t->name, strerror(errno))
               : MHE_OK;
}

/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700 /* realpath */
#include "scaled.h"

#include <mhe/inspect.h>
#include <mhe/library.h>
#include <mhe/outbox.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct job {
    const mhe_host *host;
    const char *setup;
    char *report;
} job;

static mhe_status scale(void *data, const char *path, mhe_error *err) {
    job *j = data;
    return mhe_model_scale(j->host, j->setup, path, &j->report, err);
}

mhe_status scaled_make(const mhe_host *host, const char *setup, const char *out, int32_t quiet,
                       mhi_text *path, mhe_error *err) {
    job j = {.host = host, .setup = setup};
    mhe_outbox *box = NULL;
    mhe_status status = mhe_outbox_open(out, &box, err);
    status = status == MHE_OK ? mhe_outbox_later(box, "scaled.osim", scale, NULL, &j, err) : status;
    status = status == MHE_OK ? mhe_outbox_commit(box, err) : status;
    mhe_outbox_close(box);
    char *folder = status == MHE_OK ? realpath(out, NULL) : NULL;
    if (status == MHE_OK && folder == NULL) {
        status = mhe_fail(err, MHE_E_IO, "%s: cannot be found again", out);
    }
    if (status == MHE_OK) {
        mhi_text_add(path, "model.file=%s/scaled.osim", folder);
        status = path->failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    }
    if (status == MHE_OK && !quiet && j.report != NULL) {
        (void)fputs(j.report, stderr);
    }
    mhe_free(j.report);
    free(folder);
    return status;
}

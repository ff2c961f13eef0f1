/* SPDX-License-Identifier: Apache-2.0 */
/* outbox_later.c: files of the outbox that its user writes himself. */
#include "base/need.h"
#include "io/outbox.h"

#include <stdlib.h>

typedef struct later {
    mhe_status (*write)(void *data, const char *path, mhe_error *err);
    void (*release)(void *data);
    void *data;
} later;

mhe_status mhe_outbox_stream(mhe_outbox *outbox, const char *name, FILE **stream, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"outbox", outbox}, {"name", name}, {"stream", stream});
    mhi_outbox_file *file = NULL;
    if (status == MHE_OK) {
        *stream = NULL;
        status = mhi_outbox_add(outbox, name, &file, err);
    }
    if (status == MHE_OK) {
        *stream = file->stream;
    }
    return status;
}

/* By the name of the open file: the outbox syncs and renames what is there. */
static mhe_status complete(mhi_outbox_file *file, mhe_error *err) {
    const later *l = file->owner;
    mhe_error why = {0};
    const mhe_status status = l->write(l->data, file->open_path, &why);
    return status == MHE_OK ? MHE_OK : mhe_fail(err, status, "%s: %.600s", file->path, why.text);
}

static void release(mhi_outbox_file *file) {
    later *l = file->owner;
    if (l->release != NULL) {
        l->release(l->data);
    }
    free(l);
}

mhe_status mhe_outbox_later(mhe_outbox *outbox, const char *name,
                            mhe_status (*write)(void *data, const char *path, mhe_error *err),
                            void (*release_data)(void *data), void *data, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"outbox", outbox}, {"name", name});
    if (status == MHE_OK && write == NULL) {
        status = mhe_fail(err, MHE_E_ARGUMENT, "mhe_outbox_later: 'write' is NULL");
    }
    if (status != MHE_OK) {
        return status;
    }
    mhi_outbox_file *file = NULL;
    later *l = calloc(1, sizeof *l);
    if (l == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", name);
    }
    status = mhi_outbox_add(outbox, name, &file, err);
    if (status != MHE_OK) {
        free(l);
        return status;
    }
    *l = (later){write, release_data, data};
    file->owner = l;
    file->complete = complete;
    file->release = release;
    return MHE_OK;
}

/* SPDX-License-Identifier: Apache-2.0 */
/* outbox.h: how a sink keeps its file in the outbox; sink.h is what others use. */
#ifndef MHI_OUTBOX_H
#define MHI_OUTBOX_H

#include <mhe/outbox.h>

/* One file of an outbox, still under its temporary name. */
typedef struct mhi_outbox_file {
    FILE *stream;
    char *temporary, *name; /* within the folder */
    char *path;             /* what it will be; for messages */
    char open_path[32];     /* opens the very same file once more, as long as `stream` is open, for
                             * libraries that write by name: no one can put a link in its place */
    /* Completes the file before it is closed, and frees what belongs to it; either may be NULL. */
    mhe_status (*complete)(struct mhi_outbox_file *file, mhe_error *err);
    void (*release)(struct mhi_outbox_file *file);
    void *owner;    /* the sink */
    int32_t fault;  /* errno of the first failed write: from then on the file is lost */
    int32_t placed; /* how far commit has come with it */
    struct mhi_outbox_file *next;
} mhi_outbox_file;

/* Opens a file; `name` is a plain name without a folder. MHE_E_IO, MHE_E_ARGUMENT. */
mhe_status mhi_outbox_add(mhe_outbox *outbox, const char *name, mhi_outbox_file **file,
                          mhe_error *err);
/* To be called at once after a failed write: MHE_E_IO with its reason. The file cannot be committed
 * any more. */
mhe_status mhi_outbox_write_failed(mhi_outbox_file *file, mhe_error *err);

#endif

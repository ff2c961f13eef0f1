/* SPDX-License-Identifier: Apache-2.0 */
/* outbox_private.h: what outbox.c and outbox_claim.c share. */
#ifndef MHI_OUTBOX_PRIVATE_H
#define MHI_OUTBOX_PRIVATE_H

#include "io/outbox.h"

#include <time.h>

struct mhe_outbox {
    char *dir;
    int folder; /* open: all names are looked up in it, whatever becomes of its path */
    int lock;   /* open file that is locked; -1: not claimed */
    int made;   /* the folder was not there before */
    struct timespec claimed_at; /* by the clock of the file system */
    const char *const *names;   /* [n_names] that a claimed folder may get; lent */
    int32_t n_names;
    mhi_outbox_file *files;
};

/* Gives the lock back; its file is removed. */
void mhi_outbox_unlock(mhe_outbox *outbox);
/* MHE_OK where `name` may get a file: there is none, or a file (or link) that can be replaced. */
mhe_status mhi_outbox_check_target(const mhe_outbox *outbox, const char *name, mhe_error *err);
/* Removes what a run that was killed left half-written in the folder. The caller knows that no
 * other one is at work here. */
void mhi_outbox_sweep(const mhe_outbox *outbox);

/* A temporary name is '.' NAME MHI_OUTBOX_MARK, eight hexadecimal digits, MHI_OUTBOX_END. */
#define MHI_OUTBOX_MARK ".mhe-"
#define MHI_OUTBOX_END ".tmp"
#define MHI_OUTBOX_LOCK ".mhe-lock"

#endif

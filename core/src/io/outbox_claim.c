/* SPDX-License-Identifier: Apache-2.0 */
/* outbox_claim.c: a result folder for one run alone. */
#include "base/need.h"
#include "base/text.h"
#include "io/outbox_private.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#define TRIES 100

static mhe_status cannot_lock(const mhe_outbox *outbox, int reason, mhe_error *err) {
    return mhe_fail(err, MHE_E_IO, "%s/" MHI_OUTBOX_LOCK ": cannot be locked: %s", outbox->dir,
                    strerror(reason));
}

/* The lock file is removed before the lock is given back: who got the lock of a removed file tries
 * again. `file`: open, or -1: try again. */
static mhe_status try_lock(const mhe_outbox *outbox, int *file, mhe_error *err) {
    *file = openat(outbox->folder, MHI_OUTBOX_LOCK,
                   O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK, 0666);
    if (*file < 0) {
        return errno == ENOENT ? MHE_OK : cannot_lock(outbox, errno, err);
    }
    struct stat opened, named;
    mhe_status status = MHE_OK;
    if (fstat(*file, &opened) != 0 || !S_ISREG(opened.st_mode)) {
        status = cannot_lock(outbox, EEXIST, err);
    } else if (flock(*file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
        status = mhe_fail(err, MHE_E_IO,
                          "%s: another run is writing its results here; give each run a folder of "
                          "its own",
                          outbox->dir);
    } else if (fstatat(outbox->folder, MHI_OUTBOX_LOCK, &named, AT_SYMLINK_NOFOLLOW) == 0 &&
               named.st_ino == opened.st_ino && named.st_dev == opened.st_dev) {
        return MHE_OK; /* also where the file system knows no locks */
    }
    (void)close(*file);
    *file = -1;
    return status;
}

/* Its time is that of the claim, by the clock of the file system. */
static void note_time(mhe_outbox *outbox) {
    struct stat info;
    if (futimens(outbox->lock, NULL) == 0 && fstat(outbox->lock, &info) == 0) {
        outbox->claimed_at = info.st_mtim;
    }
}

static int is_temporary(const char *name) {
    const size_t n = strlen(name), n_mark = strlen(MHI_OUTBOX_MARK), n_end = strlen(MHI_OUTBOX_END);
    if (name[0] != '.' || n < 1 + n_mark + 8 + n_end ||
        strcmp(name + n - n_end, MHI_OUTBOX_END) != 0) {
        return 0;
    }
    const char *digits = name + n - n_end - 8;
    return strspn(digits, "0123456789abcdef") == 8 &&
           strncmp(digits - n_mark, MHI_OUTBOX_MARK, n_mark) == 0;
}

void mhi_outbox_sweep(const mhe_outbox *outbox) {
    const int again = openat(outbox->folder, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    DIR *dir = again < 0 ? NULL : fdopendir(again);
    if (dir == NULL) {
        if (again >= 0) {
            (void)close(again);
        }
        return;
    }
    for (const struct dirent *entry; (entry = readdir(dir)) != NULL;) {
        if (is_temporary(entry->d_name)) {
            (void)unlinkat(outbox->folder, entry->d_name, 0);
        }
    }
    (void)closedir(dir);
}

mhe_status mhe_outbox_claim(mhe_outbox *outbox, const char *const *names, int32_t n_names,
                            mhe_error *err) {
    mhe_status needed = MHI_NEED(err, {"outbox", outbox}, {"names", names});
    if (needed != MHE_OK) {
        return needed;
    }
    mhe_status status = MHE_OK;
    for (int i = 0; i < TRIES && outbox->lock < 0 && status == MHE_OK; i++) {
        status = try_lock(outbox, &outbox->lock, err);
        if (outbox->lock < 0 && status == MHE_OK) { /* it was just given back, with its folder? */
            outbox->made = mkdir(outbox->dir, 0777) == 0 || outbox->made;
            const int folder = open(outbox->dir, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
            if (folder >= 0) {
                (void)close(outbox->folder);
                outbox->folder = folder;
            }
        }
    }
    if (status == MHE_OK && outbox->lock < 0) {
        status = cannot_lock(outbox, ENOENT, err);
    }
    for (int32_t i = 0; i < n_names && status == MHE_OK; i++) {
        status = mhi_outbox_check_target(outbox, names[i], err);
    }
    if (status == MHE_OK) {
        outbox->names = names;
        outbox->n_names = n_names;
        note_time(outbox);
        mhi_outbox_sweep(outbox);
    }
    return status;
}

void mhi_outbox_unlock(mhe_outbox *outbox) {
    if (outbox->lock >= 0) {
        (void)unlinkat(outbox->folder, MHI_OUTBOX_LOCK, 0);
        (void)close(outbox->lock);
        outbox->lock = -1;
    }
}

mhe_status mhe_outbox_spare(const mhe_outbox *outbox, const char *input, mhe_error *err) {
    mhe_status needed = MHI_NEED(err, {"outbox", outbox});
    if (needed != MHE_OK) {
        return needed;
    }
    struct stat in, out;
    if (input == NULL || stat(input, &in) != 0) {
        return MHE_OK;
    }
    for (int32_t i = 0; i < outbox->n_names; i++) {
        if (fstatat(outbox->folder, outbox->names[i], &out, 0) == 0 && in.st_dev == out.st_dev &&
            in.st_ino == out.st_ino) {
            return mhe_fail(err, MHE_E_ARGUMENT,
                            "%s would be overwritten by a result; give another folder", input);
        }
    }
    return MHE_OK;
}

static int earlier(struct timespec a, struct timespec b) {
    return a.tv_sec < b.tv_sec || (a.tv_sec == b.tv_sec && a.tv_nsec < b.tv_nsec);
}

mhe_status mhe_outbox_stale(const mhe_outbox *outbox, char **names, int32_t *n, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"outbox", outbox}, {"names", names}, {"n", n});
    mhi_text out = {0};
    if (status != MHE_OK) {
        return status;
    }
    *n = 0;
    *names = NULL;
    for (int32_t i = 0; i < outbox->n_names; i++) {
        struct stat info;
        if (fstatat(outbox->folder, outbox->names[i], &info, AT_SYMLINK_NOFOLLOW) == 0 &&
            earlier(info.st_mtim, outbox->claimed_at)) {
            mhi_text_add(&out, "%s%s", *n == 0 ? "" : ", ", outbox->names[i]);
            ++*n;
        }
    }
    return mhi_text_give(&out, names, err);
}

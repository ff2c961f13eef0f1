/* SPDX-License-Identifier: Apache-2.0 */
/* A folder of files that appear all together, complete, or not at all.
 *
 * A temporary name is new and our own (O_EXCL): what others planted under any name is neither
 * followed nor written to. At commit old and new files exchange their names, so that a failure
 * half-way can be undone. */
#define _GNU_SOURCE /* renameat2 */
#include "base/need.h"
#include "io/outbox_private.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#define TRIES 100

/* Steps of mhi_outbox_file.placed. */
enum { NOT_PLACED, PLACED, EXCHANGED, REPLACED };

/* Makes every folder of a path. `made`: the last one was not there. */
static mhe_status make_folders(const char *dir, int *made, mhe_error *err) {
    char *path = strdup(dir);
    if (path == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", dir);
    }
    int failed = 0;
    for (char *p = path; *p != '\0' && !failed; p++) {
        if (*p == '/' && p > path) {
            *p = '\0';
            failed = mkdir(path, 0777) != 0 && errno != EEXIST;
            *p = '/';
        }
    }
    *made = !failed && mkdir(path, 0777) == 0;
    failed = failed || (!*made && errno != EEXIST);
    int reason = errno;
    free(path);
    struct stat info;
    if (!failed && (stat(dir, &info) != 0 || !S_ISDIR(info.st_mode))) {
        failed = 1;
        reason = ENOTDIR;
    }
    return failed
               ? mhe_fail(err, MHE_E_IO, "%s: the folder cannot be made: %s", dir, strerror(reason))
               : MHE_OK;
}

mhe_status mhe_outbox_open(const char *dir, mhe_outbox **outbox, mhe_error *err) {
    mhe_status needed = MHI_NEED(err, {"dir", dir}, {"outbox", outbox});
    if (needed != MHE_OK) {
        return needed;
    }
    *outbox = NULL;
    int made = 0;
    mhe_status status = make_folders(dir, &made, err);
    if (status != MHE_OK) {
        return status;
    }
    mhe_outbox *opened = calloc(1, sizeof *opened);
    if (opened == NULL || (opened->dir = strdup(dir)) == NULL) {
        free(opened);
        return mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", dir);
    }
    opened->lock = -1;
    opened->made = made;
    opened->folder = open(dir, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (opened->folder < 0) {
        int reason = errno;
        free(opened->dir);
        free(opened);
        return mhe_fail(err, MHE_E_IO, "%s: cannot be opened: %s", dir, strerror(reason));
    }
    *outbox = opened;
    return MHE_OK;
}

static void free_file(mhi_outbox_file *file) {
    if (file->stream != NULL) {
        (void)fclose(file->stream);
    }
    if (file->release != NULL) {
        file->release(file);
    }
    free(file->temporary);
    free(file->name);
    free(file->path);
    free(file);
}

static uint32_t any_number(void) {
    uint32_t number = 0;
    if (getrandom(&number, sizeof number, GRND_NONBLOCK) != (ssize_t)sizeof number) {
        struct timespec
            now; /* O_EXCL keeps names apart; this one is merely less likely to be new */
        (void)clock_gettime(CLOCK_MONOTONIC, &now);
        number = (uint32_t)now.tv_nsec ^ (uint32_t)getpid() << 8;
    }
    return number;
}

/* Opens a new file under a temporary name. */
static mhe_status open_temporary(const mhe_outbox *outbox, mhi_outbox_file *file, mhe_error *err) {
    const size_t size = strlen(file->name) + sizeof "." MHI_OUTBOX_MARK "00000000" MHI_OUTBOX_END;
    file->temporary = malloc(size);
    if (file->temporary == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", file->name);
    }
    int opened = -1;
    uint32_t number = any_number();
    for (int i = 0; i < TRIES && opened < 0; i++) {
        (void)snprintf(file->temporary, size, ".%s" MHI_OUTBOX_MARK "%08x" MHI_OUTBOX_END,
                       file->name, (unsigned)(number + (uint32_t)i));
        opened = openat(outbox->folder, file->temporary,
                        O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
        if (opened < 0 && errno != EEXIST) {
            break;
        }
    }
    const int reason = errno;
    if (opened < 0) {
        free(file->temporary);
        file->temporary = NULL;
        return mhe_fail(err, MHE_E_IO, "%s: cannot be written: %s", file->path, strerror(reason));
    }
    file->stream = fdopen(opened, "wb");
    if (file->stream == NULL) {
        (void)close(opened);
        (void)unlinkat(outbox->folder, file->temporary, 0);
        return mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", file->path);
    }
    (void)snprintf(file->open_path, sizeof file->open_path, "/proc/self/fd/%d", opened);
    return MHE_OK;
}

static mhe_status check_name(const mhe_outbox *outbox, const char *name, mhe_error *err) {
    if (*name == '\0' || strchr(name, '/') != NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT, "'%s' is no plain file name", name);
    }
    for (const mhi_outbox_file *other = outbox->files; other != NULL; other = other->next) {
        if (strcmp(other->name, name) == 0) {
            return mhe_fail(err, MHE_E_ARGUMENT, "%s is written twice", other->path);
        }
    }
    int32_t known = outbox->names == NULL;
    for (int32_t i = 0; i < outbox->n_names && !known; i++) {
        known = strcmp(outbox->names[i], name) == 0;
    }
    return known
               ? MHE_OK
               : mhe_fail(err, MHE_E_ARGUMENT,
                          "'%s' is not in the list of files that the folder was claimed for", name);
}

mhe_status mhi_outbox_add(mhe_outbox *outbox, const char *name, mhi_outbox_file **file,
                          mhe_error *err) {
    *file = NULL;
    mhe_status status = check_name(outbox, name, err);
    if (status != MHE_OK) {
        return status;
    }
    mhi_outbox_file *added = calloc(1, sizeof *added);
    const size_t size = strlen(outbox->dir) + strlen(name) + 2;
    if (added == NULL || (added->name = strdup(name)) == NULL ||
        (added->path = malloc(size)) == NULL) {
        status = mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", name);
    } else {
        (void)snprintf(added->path, size, "%s/%s", outbox->dir, name);
        status = open_temporary(outbox, added, err);
    }
    if (status != MHE_OK) {
        if (added != NULL) {
            free_file(added);
        }
        return status;
    }
    added->next = outbox->files;
    outbox->files = added;
    *file = added;
    return MHE_OK;
}

mhe_status mhi_outbox_write_failed(mhi_outbox_file *file, mhe_error *err) {
    if (file->fault == 0) {
        file->fault = errno != 0 ? errno : EIO;
    }
    return mhe_fail(err, MHE_E_IO, "%s: cannot be written: %s", file->path, strerror(file->fault));
}

mhe_status mhe_outbox_text(mhe_outbox *outbox, const char *name, const char *text, mhe_error *err) {
    mhe_status needed = MHI_NEED(err, {"outbox", outbox}, {"name", name}, {"text", text});
    if (needed != MHE_OK) {
        return needed;
    }
    mhi_outbox_file *file = NULL;
    mhe_status status = mhi_outbox_add(outbox, name, &file, err);
    if (status == MHE_OK && (fputs(text, file->stream) < 0 || fflush(file->stream) != 0)) {
        status = mhi_outbox_write_failed(file, err);
    }
    return status;
}

/* ---- commit ---- */

/* Everything on the disk, the stream closed; only then may the name change. */
static mhe_status settle(mhi_outbox_file *file, mhe_error *err) {
    mhe_status status = file->fault != 0 ? mhi_outbox_write_failed(file, err) : MHE_OK;
    if (status == MHE_OK && file->complete != NULL) {
        status = file->complete(file, err);
    }
    if (status == MHE_OK && (fflush(file->stream) != 0 || fsync(fileno(file->stream)) != 0)) {
        status = mhi_outbox_write_failed(file, err);
    }
    int closed = fclose(file->stream);
    file->stream = NULL;
    return status == MHE_OK && closed != 0 ? mhi_outbox_write_failed(file, err) : status;
}

mhe_status mhi_outbox_check_target(const mhe_outbox *outbox, const char *name, mhe_error *err) {
    struct stat target, folder;
    if (fstatat(outbox->folder, name, &target, AT_SYMLINK_NOFOLLOW) != 0) {
        return errno == ENOENT ? MHE_OK
                               : mhe_fail(err, MHE_E_IO, "%s/%s: cannot be replaced: %s",
                                          outbox->dir, name, strerror(errno));
    }
    if (S_ISDIR(target.st_mode)) {
        return mhe_fail(err, MHE_E_IO, "%s/%s: a folder stands where a result goes", outbox->dir,
                        name);
    }
    const uid_t self = geteuid(); /* where the folder is sticky, as /tmp is */
    if (fstat(outbox->folder, &folder) == 0 && (folder.st_mode & S_ISVTX) != 0 && self != 0 &&
        folder.st_uid != self && target.st_uid != self) {
        return mhe_fail(err, MHE_E_IO, "%s/%s: the file of another user cannot be replaced here",
                        outbox->dir, name);
    }
    return MHE_OK;
}

/* 0: done. An old file gets the temporary name; where the file system cannot exchange, it is gone.
 */
static int place(const mhe_outbox *outbox, mhi_outbox_file *file) {
    const int at = outbox->folder;
    if (renameat2(at, file->temporary, at, file->name, RENAME_EXCHANGE) == 0) {
        file->placed = EXCHANGED;
        return 0;
    }
    const int absent = errno == ENOENT;
    if (!absent && errno != EINVAL && errno != ENOSYS) {
        return -1;
    }
    if (renameat(at, file->temporary, at, file->name) != 0) {
        return -1;
    }
    file->placed = absent ? PLACED : REPLACED;
    return 0;
}

/* As before the commit, as far as can be. */
static void displace(const mhe_outbox *outbox, mhi_outbox_file *file) {
    const int at = outbox->folder;
    if (file->placed == EXCHANGED) {
        (void)renameat2(at, file->temporary, at, file->name, RENAME_EXCHANGE);
    } else if (file->placed == PLACED) { /* nothing was there; removing fails less than renaming */
        (void)unlinkat(at, file->name, 0);
    }
    file->placed = NOT_PLACED;
}

static mhe_status place_all(mhe_outbox *outbox, mhe_error *err) {
    for (mhi_outbox_file *file = outbox->files; file != NULL; file = file->next) {
        if (place(outbox, file) != 0) {
            mhe_status status =
                mhe_fail(err, MHE_E_IO, "%s: cannot be replaced: %s", file->path, strerror(errno));
            for (mhi_outbox_file *back = outbox->files; back != file; back = back->next) {
                displace(outbox, back);
            }
            return status;
        }
    }
    return MHE_OK;
}

static void drop_files(mhe_outbox *outbox) {
    while (outbox->files != NULL) {
        mhi_outbox_file *file = outbox->files;
        outbox->files = file->next;
        if (file->placed == NOT_PLACED || file->placed == EXCHANGED) {
            (void)unlinkat(outbox->folder, file->temporary, 0);
        }
        free_file(file);
    }
}

mhe_status mhe_outbox_commit(mhe_outbox *outbox, mhe_error *err) {
    mhe_status needed = MHI_NEED(err, {"outbox", outbox});
    if (needed != MHE_OK) {
        return needed;
    }
    mhe_status status = MHE_OK;
    for (mhi_outbox_file *file = outbox->files; file != NULL && status == MHE_OK;
         file = file->next) {
        status = settle(file, err);
    }
    for (mhi_outbox_file *file = outbox->files; file != NULL && status == MHE_OK;
         file = file->next) {
        status = mhi_outbox_check_target(outbox, file->name, err);
    }
    if (status == MHE_OK) {
        status = place_all(outbox, err);
    }
    if (status == MHE_OK) {
        drop_files(outbox);
        (void)fsync(outbox->folder); /* the names too should last */
    }
    return status;
}

void mhe_outbox_abandon(const mhe_outbox *outbox) {
    const mhi_outbox_file *file = outbox == NULL ? NULL : outbox->files;
    for (; file != NULL; file = file->next) {
        (void)unlinkat(outbox->folder, file->temporary, 0);
    }
    if (outbox != NULL && outbox->lock >= 0) {
        (void)unlinkat(outbox->folder, MHI_OUTBOX_LOCK, 0);
    }
}

void mhe_outbox_close(mhe_outbox *outbox) {
    if (outbox == NULL) {
        return;
    }
    const int claimed = outbox->lock >= 0;
    drop_files(outbox);
    mhi_outbox_unlock(outbox);
    (void)close(outbox->folder);
    if (claimed && outbox->made) {
        (void)rmdir(outbox->dir); /* of a run that wrote nothing; one with files stays */
    }
    free(outbox->dir);
    free(outbox);
}

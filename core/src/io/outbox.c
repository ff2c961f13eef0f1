/* SPDX-License-Identifier: Apache-2.0 */
/* A folder of files that appear all together, complete, or not at all. */
#include "io/outbox.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

struct mhi_outbox {
    char *dir;
    mhi_outbox_file *files;
};

/* Makes every folder of a path. */
static mhe_status make_folders(const char *dir, mhe_error *err) {
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
    failed = failed || (mkdir(path, 0777) != 0 && errno != EEXIST);
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

mhe_status mhi_outbox_open(const char *dir, mhi_outbox **outbox, mhe_error *err) {
    *outbox = NULL;
    mhe_status status = make_folders(dir, err);
    if (status != MHE_OK) {
        return status;
    }
    mhi_outbox *opened = calloc(1, sizeof *opened);
    if (opened == NULL || (opened->dir = strdup(dir)) == NULL) {
        free(opened);
        return mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", dir);
    }
    *outbox = opened;
    return MHE_OK;
}

/* dir/prefix name suffix */
static char *join(const char *dir, const char *prefix, const char *name, const char *suffix) {
    size_t size = strlen(dir) + strlen(prefix) + strlen(name) + strlen(suffix) + 2;
    char *path = malloc(size);
    if (path != NULL) {
        (void)snprintf(path, size, "%s/%s%s%s", dir, prefix, name, suffix);
    }
    return path;
}

static void free_file(mhi_outbox_file *file) {
    if (file->stream != NULL) {
        (void)fclose(file->stream);
    }
    if (file->release != NULL) {
        file->release(file);
    }
    free(file->temporary);
    free(file->final);
    free(file);
}

mhe_status mhi_outbox_add(mhi_outbox *outbox, const char *name, mhi_outbox_file **file,
                          mhe_error *err) {
    *file = NULL;
    if (*name == '\0' || strchr(name, '/') != NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT, "'%s' is no plain file name", name);
    }
    mhi_outbox_file *added = calloc(1, sizeof *added);
    if (added == NULL || (added->temporary = join(outbox->dir, ".", name, ".tmp")) == NULL ||
        (added->final = join(outbox->dir, "", name, "")) == NULL) {
        if (added != NULL) {
            free_file(added);
        }
        return mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", name);
    }
    for (const mhi_outbox_file *other = outbox->files; other != NULL; other = other->next) {
        if (strcmp(other->final, added->final) == 0) {
            free_file(added);
            return mhe_fail(err, MHE_E_ARGUMENT, "%s is written twice", other->final);
        }
    }
    added->stream = fopen(added->temporary, "wb");
    if (added->stream == NULL) {
        int reason = errno;
        mhe_status status = mhe_fail(err, MHE_E_IO, "%s: cannot be written: %s", added->temporary,
                                     strerror(reason));
        free_file(added);
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
    return mhe_fail(err, MHE_E_IO, "%s: cannot be written: %s", file->final, strerror(file->fault));
}

mhe_status mhi_outbox_text(mhi_outbox *outbox, const char *name, const char *text, mhe_error *err) {
    mhi_outbox_file *file = NULL;
    mhe_status status = mhi_outbox_add(outbox, name, &file, err);
    if (status == MHE_OK && (fputs(text, file->stream) < 0 || fflush(file->stream) != 0)) {
        status = mhi_outbox_write_failed(file, err);
    }
    return status;
}

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

mhe_status mhi_outbox_commit(mhi_outbox *outbox, mhe_error *err) {
    for (mhi_outbox_file *file = outbox->files; file != NULL; file = file->next) {
        mhe_status status = settle(file, err);
        if (status != MHE_OK) {
            return status;
        }
    }
    while (outbox->files != NULL) {
        mhi_outbox_file *file = outbox->files;
        if (rename(file->temporary, file->final) != 0) {
            return mhe_fail(err, MHE_E_IO, "%s: cannot be renamed to %s: %s", file->temporary,
                            file->final, strerror(errno));
        }
        outbox->files = file->next;
        free_file(file);
    }
    int folder = open(outbox->dir, O_RDONLY | O_DIRECTORY); /* the names too should last */
    if (folder >= 0) {
        (void)fsync(folder);
        (void)close(folder);
    }
    return MHE_OK;
}

void mhi_outbox_abandon(const mhi_outbox *outbox) {
    const mhi_outbox_file *file = outbox == NULL ? NULL : outbox->files;
    for (; file != NULL; file = file->next) {
        (void)unlink(file->temporary);
    }
}

void mhi_outbox_close(mhi_outbox *outbox) {
    if (outbox == NULL) {
        return;
    }
    while (outbox->files != NULL) {
        mhi_outbox_file *file = outbox->files;
        outbox->files = file->next;
        (void)unlink(file->temporary);
        free_file(file);
    }
    free(outbox->dir);
    free(outbox);
}

/* SPDX-License-Identifier: Apache-2.0 */
#include "io/slurp.h"

#include "base/digest.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

/* Appends what `file` still holds; *text is the caller's to free in any case. */
static mhe_status read_all(FILE *file, const char *path, char **text, size_t *length,
                           mhe_error *err) {
    size_t capacity = 1 << 16;
    for (;;) {
        char *grown = realloc(*text, capacity + 1);
        if (grown == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "%s: no memory to read the file", path);
        }
        *text = grown;
        *length += fread(*text + *length, 1, capacity - *length, file);
        if (*length < capacity) {
            break;
        }
        if (capacity >= MHI_SLURP_MAX) {
            return mhe_fail(err, MHE_E_INPUT, "%s: larger than %zu MiB; split the file", path,
                            MHI_SLURP_MAX >> 20);
        }
        capacity *= 2;
    }
    (*text)[*length] = '\0';
    return ferror(file)
               ? mhe_fail(err, MHE_E_INPUT, "%s: cannot be read: %s", path, strerror(errno))
               : MHE_OK;
}

mhe_status mhi_slurp(const char *path, char **text, size_t *length, mhe_error *err) {
    *text = NULL;
    *length = 0;
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return errno == ENOMEM
                   ? mhe_fail(err, MHE_E_MEMORY, "%s: no memory to open the file", path)
                   : mhe_fail(err, MHE_E_INPUT, "%s: cannot be opened: %s", path, strerror(errno));
    }
    struct stat info;
    mhe_status status = fstat(fileno(file), &info) == 0 && S_ISDIR(info.st_mode)
                            ? mhe_fail(err, MHE_E_INPUT, "%s: is a folder; a file is needed", path)
                            : read_all(file, path, text, length, err);
    (void)fclose(file);
    if (status != MHE_OK) {
        free(*text);
        *text = NULL;
        *length = 0;
    }
    return status;
}

mhe_status mhi_file_digest(const char *path, size_t *length, uint64_t *digest, mhe_error *err) {
    char *bytes = NULL;
    *digest = 0;
    mhe_status status = mhi_slurp(path, &bytes, length, err);
    if (status == MHE_OK) {
        *digest = mhi_digest(bytes, *length);
    }
    free(bytes);
    return status;
}

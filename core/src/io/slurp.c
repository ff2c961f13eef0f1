/* SPDX-License-Identifier: Apache-2.0 */
#include "io/slurp.h"

#include "base/digest.h"
#include "base/text.h"

#include <dirent.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#define NAMES 64 /* of a folder that are near enough */

/* The file that may have been meant by a name that is not there, as " (did you mean 'x'?)"; "". */
static void near_file(const char *path, char *out, size_t size) {
    const char *slash = strrchr(path, '/'), *name = slash != NULL ? slash + 1 : path;
    char *folder = strndup(path, slash != NULL ? (size_t)(slash - path) + 1 : 0);
    char *names[NAMES];
    int32_t n = 0;
    DIR *open = folder != NULL ? opendir(*folder != '\0' ? folder : ".") : NULL;
    for (struct dirent *d = open != NULL ? readdir(open) : NULL; d != NULL && n < NAMES;
         d = readdir(open)) {
        const char *one = d->d_name;
        if (*one != '.' && mhi_slip_of(name, &one, 1) != NULL && (names[n] = strdup(one)) != NULL) {
            n++;
        }
    }
    const char *near = mhi_slip_of(name, (const char *const *)names, n);
    out[0] = '\0';
    if (near != NULL) {
        (void)snprintf(out, size, " (did you mean '%s'?)", near);
    }
    while (n > 0) {
        free(names[--n]);
    }
    if (open != NULL) {
        (void)closedir(open);
    }
    free(folder);
}

static mhe_status not_opened(const char *path, int why, mhe_error *err) {
    char near[300] = "";
    if (why == ENOMEM) {
        return mhe_fail(err, MHE_E_MEMORY, "%s: no memory to open the file", path);
    }
    if (why == ENOENT) {
        near_file(path, near, sizeof near);
    }
    return mhe_fail(err, MHE_E_INPUT, "%s: cannot be opened: %s%s", path, strerror(why), near);
}

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

static int32_t is_web_page(const char *text) {
    text += strncmp(text, "\xef\xbb\xbf", 3) == 0 ? 3 : 0;
    text += strspn(text, " \t\r\n");
    return strncasecmp(text, "<!doctype html", 14) == 0 || strncasecmp(text, "<html", 5) == 0;
}

/* What stands in a file's place after a download that did not fetch it. */
static mhe_status refuse_stand_in(const char *path, const char *text, mhe_error *err) {
    static const char pointer[] = "version https://git-lfs.github.com/spec/";
    return strncmp(text, pointer, sizeof pointer - 1) == 0
               ? mhe_fail(err, MHE_E_INPUT,
                          "%s:1: a pointer of Git LFS, not the file itself: 'git lfs pull' "
                          "fetches it",
                          path)
           : is_web_page(text)
               ? mhe_fail(err, MHE_E_INPUT,
                          "%s:1: a web page, not the file itself: download the raw file", path)
               : MHE_OK;
}

mhe_status mhi_slurp(const char *path, char **text, size_t *length, mhe_error *err) {
    *text = NULL;
    *length = 0;
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return not_opened(path, errno, err);
    }
    struct stat info;
    mhe_status status = fstat(fileno(file), &info) == 0 && S_ISDIR(info.st_mode)
                            ? mhe_fail(err, MHE_E_INPUT, "%s: is a folder; a file is needed", path)
                            : read_all(file, path, text, length, err);
    (void)fclose(file);
    if (status == MHE_OK) {
        status = refuse_stand_in(path, *text, err);
    }
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

/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700 /* S_ISVTX */
#include "plugin/trust.h"

#include <errno.h>
#include <limits.h>
#include <string.h>
#include <sys/stat.h>

static mhe_status read_mode(const char *path, mode_t *mode, mhe_error *err) {
    struct stat info;
    if (stat(path, &info) != 0) {
        return mhe_fail(err, MHE_E_PLUGIN, "%s", strerror(errno));
    }
    *mode = info.st_mode;
    return MHE_OK;
}

mhe_status mhi_trust_file(const char *file, mhe_error *err) {
    mode_t mode = 0;
    mhe_status status = read_mode(file, &mode, err);
    return status == MHE_OK && (mode & S_IWOTH) != 0
               ? mhe_fail(err, MHE_E_PLUGIN, "everybody may write to it (chmod o-w)")
               : status;
}

mhe_status mhi_trust_folder(const char *folder, mhe_error *err) {
    char path[PATH_MAX];
    const size_t length = strlen(folder);
    if (folder[0] != '/' || length >= sizeof path) {
        return mhe_fail(err, MHE_E_PLUGIN, "not an absolute path");
    }
    memcpy(path, folder, length + 1);
    mhe_status status = mhi_trust_file(path, err);
    for (char *slash = strrchr(path, '/'); slash != path && status == MHE_OK;
         slash = strrchr(path, '/')) {
        mode_t mode = 0;
        *slash = '\0';
        status = read_mode(path, &mode, err);
        if (status == MHE_OK && (mode & S_IWOTH) != 0 && (mode & S_ISVTX) == 0) {
            status =
                mhe_fail(err, MHE_E_PLUGIN,
                         "everybody may put another folder in its place: %s (chmod o-w)", path);
        }
    }
    return status;
}

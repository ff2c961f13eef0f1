/* SPDX-License-Identifier: Apache-2.0 */
#include "io/model_file.h"

#include "io/slurp.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static int32_t has_ending(const char *path, const char *ending) {
    size_t n = strlen(path), k = strlen(ending);
    return n >= k && strcasecmp(path + n - k, ending) == 0;
}

/* XML begins with '<' (after blanks and a byte order mark); nothing in a .bioMod does. */
static int32_t looks_like_xml(const char *path, const char *text) {
    if (strncmp(text, "\xef\xbb\xbf", 3) == 0) {
        text += 3;
    }
    while (isspace((unsigned char)*text)) {
        text++;
    }
    return *text == '<' || (*text == '\0' && has_ending(path, ".osim"));
}

mhe_status mhi_model_read(const char *path, mhe_description **description, mhe_error *err) {
    char *text;
    size_t length;
    *description = NULL;
    mhe_status status = mhi_slurp(path, &text, &length, err);
    if (status != MHE_OK) {
        return status;
    }
    status = looks_like_xml(path, text) ? mhi_osim_parse(path, text, length, description, err)
                                        : mhi_biomod_parse(path, text, length, description, err);
    free(text);
    return status;
}

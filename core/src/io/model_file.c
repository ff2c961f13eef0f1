/* SPDX-License-Identifier: Apache-2.0 */
#include "io/model_file.h"

#include "io/decode.h"
#include "io/description_builder.h"
#include "io/slurp.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static int32_t has_ending(const char *path, const char *ending) {
    size_t n = strlen(path), k = strlen(ending);
    return n >= k && strcasecmp(path + n - k, ending) == 0;
}

/* XML begins with '<' (after blanks); nothing in a .bioMod does. */
static int32_t looks_like_xml(const char *path, const char *text) {
    while (isspace((unsigned char)*text)) {
        text++;
    }
    return *text == '<' || (*text == '\0' && has_ending(path, ".osim"));
}

/* XML that names an encoding of its own, or is UTF-16, is the XML library's to decode. */
static int32_t decodes_itself(const char *text, size_t length) {
    char head[200];
    const size_t n = length < sizeof head - 1 ? length : sizeof head - 1;
    memcpy(head, text, n);
    head[n] = '\0';
    if (n > 1 && ((unsigned char)head[0] == 0xff || (unsigned char)head[0] == 0xfe)) {
        return 1;
    }
    const char *end = strstr(head, "?>"), *said = strstr(head, "encoding");
    if (said == NULL || (end != NULL && said > end)) {
        return 0;
    }
    said += strcspn(said, "\"'");
    return *said != '\0' && strncasecmp(said + 1, "utf-8", 5) != 0;
}

/* One more warning, before the others. */
static mhe_status put_first(mhe_description *description, const char *name, const mhi_decoded *d,
                            mhe_error *err) {
    mhi_owned_description *owned = (mhi_owned_description *)(void *)description;
    const int32_t n = description->n_warnings;
    const char **all = MHI_TAKE(&owned->arena, const char *, n + 1);
    char *line = mhi_arena_format(&owned->arena,
                                  "%s:%d: bytes that are no UTF-8 (%d) are read as Windows-1252",
                                  name, (int)d->foreign_line, (int)d->foreign_n);
    if (all == NULL || line == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    all[0] = line;
    for (int32_t i = 0; i < n; i++) {
        all[i + 1] = description->warnings[i];
    }
    description->warnings = all;
    description->n_warnings = n + 1;
    return MHE_OK;
}

typedef mhe_status parser(const char *name, const char *text, size_t length,
                          mhe_description **description, mhe_error *err);

static mhe_status parse_with(parser *osim, const char *name, const char *text, size_t length,
                             mhe_description **description, mhe_error *err) {
    mhi_decoded d;
    *description = NULL;
    mhe_status status = mhi_decode(name, text, length, &d, err);
    if (status != MHE_OK) {
        return status;
    }
    const int32_t xml = looks_like_xml(name, d.text);
    if (xml && decodes_itself(text, length)) {
        free(d.owned);
        d = (mhi_decoded){.text = text, .length = length};
    }
    status = (xml ? osim : mhi_biomod_parse)(name, d.text, d.length, description, err);
    if (status == MHE_OK && d.foreign_line > 0) {
        status = put_first(*description, name, &d, err);
        if (status != MHE_OK) {
            mhi_description_free(*description);
            *description = NULL;
        }
    }
    free(d.owned);
    return status;
}

mhe_status mhi_model_parse(const char *name, const char *text, size_t length,
                           mhe_description **description, mhe_error *err) {
    return parse_with(mhi_osim_parse, name, text, length, description, err);
}

static mhe_status read_with(parser *osim, const char *path, mhe_description **description,
                            mhe_error *err) {
    char *text;
    size_t length;
    *description = NULL;
    mhe_status status = mhi_slurp(path, &text, &length, err);
    if (status != MHE_OK) {
        return status;
    }
    status = parse_with(osim, path, text, length, description, err);
    free(text);
    return status;
}

mhe_status mhi_model_read(const char *path, mhe_description **description, mhe_error *err) {
    return read_with(mhi_osim_parse, path, description, err);
}

mhe_status mhi_model_read_unlocked(const char *path, mhe_description **description,
                                   mhe_error *err) {
    return read_with(mhi_osim_parse_unlocked, path, description, err);
}

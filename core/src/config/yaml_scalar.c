/* SPDX-License-Identifier: Apache-2.0 */
#include "config/yaml_scalar.h"

#include "base/number.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* ---- numbers ---- */

static int infinite(const char *text) {
    text += *text == '+' || *text == '-';
    return strcmp(text, ".inf") == 0 || strcmp(text, ".Inf") == 0 || strcmp(text, ".INF") == 0;
}

int32_t mhi_yaml_number(const char *text, double *value) {
    if (infinite(text)) {
        *value = *text == '-' ? -INFINITY : INFINITY;
        return 1;
    }
    mhi_c_locale saved = mhi_c_locale_begin();
    int32_t read = mhi_number((mhi_cell){text, strlen(text)}, value);
    mhi_c_locale_end(saved);
    return read;
}

const char *mhi_yaml_real(double value, char out[MHI_YAML_REAL_SIZE]) {
    if (isinf(value)) {
        return strcpy(out, value > 0 ? ".inf" : "-.inf");
    }
    mhi_c_locale saved = mhi_c_locale_begin();
    for (int digits = 15; digits <= 17; digits++) {
        (void)snprintf(out, MHI_YAML_REAL_SIZE, "%.*g", digits, value);
        if (strtod(out, NULL) == value) {
            break;
        }
    }
    mhi_c_locale_end(saved);
    return out;
}

/* ---- texts ---- */

/* Words that some reader of YAML takes for something else than text. */
static int is_reserved(const char *text, size_t length) {
    static const char *const words[] = {"null", "true", "false", "yes", "no", "on", "off"};
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        if (strlen(words[i]) == length && strncasecmp(words[i], text, length) == 0) {
            return 1;
        }
    }
    return 0;
}

static int is_plain(const char *text, size_t length) {
    static const char letters[] = "/_abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                  ".-0123456789";
    size_t n_first = strlen(letters) - strlen(".-0123456789");
    if (length == 0 || memchr(letters, text[0], n_first) == NULL) {
        return 0;
    }
    for (size_t i = 1; i < length; i++) {
        if (memchr(letters, text[i], sizeof letters - 1) == NULL) {
            return 0;
        }
    }
    return !is_reserved(text, length);
}

#define MALFORMED UINT32_MAX

/* Code point at `text` and its length in bytes; MALFORMED is one byte long. */
static uint32_t decode(const char *text, size_t length, size_t *used) {
    static const uint32_t least[] = {0, 0, 0x80, 0x800, 0x10000};
    const unsigned char *byte = (const unsigned char *)text;
    size_t n = byte[0] < 0x80   ? 1
               : byte[0] < 0xc2 ? 0
               : byte[0] < 0xe0 ? 2
               : byte[0] < 0xf0 ? 3
               : byte[0] < 0xf5 ? 4
                                : 0;
    *used = 1;
    if (n < 2 || n > length) {
        return n == 1 ? byte[0] : MALFORMED;
    }
    uint32_t code = byte[0] & (0x7fu >> n);
    for (size_t i = 1; i < n; i++) {
        if ((byte[i] & 0xc0) != 0x80) {
            return MALFORMED;
        }
        code = code << 6 | (byte[i] & 0x3fu);
    }
    if (code < least[n] || code > 0x10ffff || (code >= 0xd800 && code < 0xe000)) {
        return MALFORMED;
    }
    *used = n;
    return code;
}

int32_t mhi_yaml_is_utf8(const char *text) {
    size_t length = strlen(text);
    for (size_t at = 0, used = 1; at < length; at += used) {
        if (decode(text + at, length - at, &used) == MALFORMED) {
            return 0;
        }
    }
    return 1;
}

/* What YAML forbids between quotes, folds there, or counts as a line break. */
static int needs_escape(uint32_t code) {
    return code < 0x20 || (code >= 0x7f && code < 0xa0) || code == 0x2028 || code == 0x2029 ||
           code == 0xfeff || code == 0xfffe || code == 0xffff;
}

void mhi_yaml_text_n(const char *text, size_t length, mhi_text *out) {
    if (is_plain(text, length)) {
        mhi_text_add(out, "%.*s", (int)length, text);
        return;
    }
    mhi_text_add(out, "\"");
    for (size_t at = 0, used = 1; at < length; at += used) {
        uint32_t code = decode(text + at, length - at, &used);
        if (code == '"' || code == '\\') {
            mhi_text_add(out, "\\%c", (int)code);
        } else if (code == MALFORMED) { /* YAML has no way to say it */
            mhi_text_add(out, "\\ufffd");
        } else if (needs_escape(code)) {
            mhi_text_add(out, "\\u%04x", (unsigned)code);
        } else {
            mhi_text_add(out, "%.*s", (int)used, text + at);
        }
    }
    mhi_text_add(out, "\"");
}

void mhi_yaml_text(const char *text, mhi_text *out) {
    if (text == NULL) {
        mhi_text_add(out, "null");
    } else {
        mhi_yaml_text_n(text, strlen(text), out);
    }
}

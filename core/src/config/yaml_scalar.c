/* SPDX-License-Identifier: Apache-2.0 */
#include "config/yaml_scalar.h"

#include "io/number.h"

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

/* Code point at `text` and its length in bytes; a malformed byte stands for itself. */
static uint32_t decode(const unsigned char *text, size_t length, size_t *used) {
    size_t n = text[0] < 0xc0 ? 1 : text[0] < 0xe0 ? 2 : text[0] < 0xf0 ? 3 : 4;
    *used = 1;
    if (n == 1 || n > length) {
        return text[0];
    }
    uint32_t code = text[0] & (0x7fu >> n);
    for (size_t i = 1; i < n; i++) {
        if ((text[i] & 0xc0) != 0x80) {
            return text[0];
        }
        code = code << 6 | (text[i] & 0x3fu);
    }
    *used = n;
    return code;
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
        uint32_t code = decode((const unsigned char *)text + at, length - at, &used);
        if (code == '"' || code == '\\') {
            mhi_text_add(out, "\\%c", (int)code);
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

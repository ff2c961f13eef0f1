/* SPDX-License-Identifier: Apache-2.0 */
#include "escape.h"

#include <ctype.h>
#include <string.h>

void add_escaped_part(mhi_text *out, const char *text, size_t n) {
    for (const char *end = text + n; text != end && *text != '\0'; text++) {
        switch (*text) {
        case '<':
            mhi_text_add(out, "&lt;");
            break;
        case '>':
            mhi_text_add(out, "&gt;");
            break;
        case '&':
            mhi_text_add(out, "&amp;");
            break;
        case '"':
            mhi_text_add(out, "&quot;");
            break;
        default:
            mhi_text_add(out, "%c", *text);
        }
    }
}

void add_escaped(mhi_text *out, const char *text) {
    add_escaped_part(out, text, strlen(text));
}

void add_escaped_json(mhi_text *out, const char *text) {
    mhi_text_add(out, "\"");
    for (; *text != '\0'; text++) {
        const unsigned char c = (unsigned char)*text;
        if (c < 32 || c == '<' || c == '>' || c == '&' || c == '"' || c == '\\') {
            mhi_text_add(out, "\\u%04x", c);
        } else {
            mhi_text_add(out, "%c", c);
        }
    }
    mhi_text_add(out, "\"");
}

void add_escaped_path(mhi_text *out, const char *text) {
    for (; *text != '\0'; text++) {
        const unsigned char c = (unsigned char)*text;
        const int plain = c < 128 && (isalnum(c) || strchr("-_.~", c) != NULL);
        mhi_text_add(out, plain ? "%c" : "%%%02X", c);
    }
}

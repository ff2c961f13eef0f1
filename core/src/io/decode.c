/* SPDX-License-Identifier: Apache-2.0 */
/* Windows-1252: Microsoft's table "cp1252", bytes 0x80 to 0x9f; above it is Latin-1. */
#include "io/decode.h"

#include <stdlib.h>
#include <string.h>

#define REPLACEMENT 0xfffdU /* for what is no character */

static const uint16_t windows_1252[32] = {
    0x20ac, 0xfffd, 0x201a, 0x0192, 0x201e, 0x2026, 0x2020, 0x2021, 0x02c6, 0x2030, 0x0160,
    0x2039, 0x0152, 0xfffd, 0x017d, 0xfffd, 0xfffd, 0x2018, 0x2019, 0x201c, 0x201d, 0x2022,
    0x2013, 0x2014, 0x02dc, 0x2122, 0x0161, 0x203a, 0x0153, 0xfffd, 0x017e, 0x0178};

/* Bytes of the UTF-8 character at `at`, which has `left` of them; 0: it is none. */
static size_t character(const unsigned char *at, size_t left) {
    const unsigned char first = at[0];
    const size_t n = first < 0x80   ? 1
                     : first < 0xc2 ? 0
                     : first < 0xe0 ? 2
                     : first < 0xf0 ? 3
                     : first < 0xf5 ? 4
                                    : 0;
    if (n == 0 || n > left) {
        return 0;
    }
    for (size_t i = 1; i < n; i++) {
        if ((at[i] & 0xc0) != 0x80) {
            return 0;
        }
    }
    const int overlong = (first == 0xe0 && at[1] < 0xa0) || (first == 0xf0 && at[1] < 0x90);
    const int surrogate = first == 0xed && at[1] > 0x9f, beyond = first == 0xf4 && at[1] > 0x8f;
    return overlong || surrogate || beyond ? 0 : n;
}

static char *put(char *out, uint32_t code) {
    if (code < 0x80) {
        *out++ = (char)code;
    } else if (code < 0x800) {
        *out++ = (char)(0xc0 | code >> 6);
        *out++ = (char)(0x80 | (code & 0x3f));
    } else if (code < 0x10000) {
        *out++ = (char)(0xe0 | code >> 12);
        *out++ = (char)(0x80 | (code >> 6 & 0x3f));
        *out++ = (char)(0x80 | (code & 0x3f));
    } else {
        *out++ = (char)(0xf0 | code >> 18);
        *out++ = (char)(0x80 | (code >> 12 & 0x3f));
        *out++ = (char)(0x80 | (code >> 6 & 0x3f));
        *out++ = (char)(0x80 | (code & 0x3f));
    }
    return out;
}

static mhe_status no_memory(const char *name, mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", name);
}

/* The first byte from `from` on that is no UTF-8; `length` where there is none. */
static size_t first_foreign(const char *text, size_t from, size_t length) {
    size_t i = from;
    while (i < length) {
        const unsigned char *at = (const unsigned char *)text + i;
        const size_t n = *at < 0x80 ? 1 : character(at, length - i);
        if (n == 0) {
            return i;
        }
        i += n;
    }
    return length;
}

static mhe_status from_windows(const char *name, mhi_decoded *d, size_t first, mhe_error *err) {
    size_t n = 0;
    for (size_t i = first; i < d->length; i = first_foreign(d->text, i + 1, d->length)) {
        n++;
    }
    char *made = malloc(d->length + 2 * n + 1), *out = made;
    if (made == NULL) {
        return no_memory(name, err);
    }
    d->foreign_line = 1;
    for (const char *c = d->text; c < d->text + first; c++) {
        d->foreign_line += *c == '\n';
    }
    d->foreign_n = n < INT32_MAX ? (int32_t)n : INT32_MAX;
    for (size_t i = 0; i < d->length;) {
        const unsigned char byte = (unsigned char)d->text[i];
        const size_t whole = character((const unsigned char *)d->text + i, d->length - i);
        if (whole == 0) {
            out = put(out, byte < 0xa0 ? windows_1252[byte - 0x80] : byte);
            i++;
            continue;
        }
        memcpy(out, d->text + i, whole);
        out += whole;
        i += whole;
    }
    *out = '\0';
    d->text = d->owned = made;
    d->length = (size_t)(out - made);
    return MHE_OK;
}

static mhe_status from_utf16(const char *name, mhi_decoded *d, size_t big, mhe_error *err) {
    const unsigned char *in = (const unsigned char *)d->text + 2;
    const size_t n = (d->length - 2) / 2;
    char *made = malloc(3 * n + 1), *out = made;
    if (made == NULL) {
        return no_memory(name, err);
    }
    for (size_t i = 0; i < n; i++) {
        uint32_t code = (uint32_t)in[2 * i + big] | (uint32_t)in[2 * i + 1 - big] << 8;
        if (code >= 0xd800 && code < 0xdc00 && i + 1 < n) {
            const uint32_t low = (uint32_t)in[2 * i + 3 - big] | (uint32_t)in[2 * i + 2 + big] << 8;
            const int pair = low >= 0xdc00 && low < 0xe000;
            code = pair ? 0x10000 + ((code - 0xd800) << 10) + (low - 0xdc00) : REPLACEMENT;
            i += (size_t)pair;
        } else if (code >= 0xd800 && code < 0xe000) {
            code = REPLACEMENT;
        }
        out = put(out, code);
    }
    *out = '\0';
    d->text = d->owned = made;
    d->length = (size_t)(out - made);
    return MHE_OK;
}

mhe_status mhi_decode(const char *name, const char *text, size_t length, mhi_decoded *decoded,
                      mhe_error *err) {
    *decoded = (mhi_decoded){.text = length == 0 ? "" : text, .length = length};
    if (length >= 2 && (memcmp(text, "\xff\xfe", 2) == 0 || memcmp(text, "\xfe\xff", 2) == 0)) {
        return from_utf16(name, decoded, (unsigned char)text[0] == 0xfe, err);
    }
    if (length >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0) {
        decoded->text += 3;
        decoded->length -= 3;
    }
    const size_t first = first_foreign(decoded->text, 0, decoded->length);
    return first == decoded->length ? MHE_OK : from_windows(name, decoded, first, err);
}

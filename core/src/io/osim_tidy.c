/* SPDX-License-Identifier: Apache-2.0 */
/* osim_tidy.c: files that OpenSim's own parser takes and XML does not: comments with "--" or "<!--"
 * in them (it ends a comment at the first "-->"), and "&" that begins no entity. */
#include "io/osim.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

/* Bytes of the entity that begins at `text`, which has `left`; 0: it is a plain "&". */
static size_t entity(const char *text, size_t left) {
    static const char *const names[] = {"&amp;", "&lt;", "&gt;", "&quot;", "&apos;"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        const size_t n = strlen(names[i]);
        if (n <= left && memcmp(text, names[i], n) == 0) {
            return n;
        }
    }
    size_t n = 2;
    while (left > 2 && text[1] == '#' && n < left && n < 10 && isalnum((unsigned char)text[n])) {
        n++;
    }
    return n > 2 && n < left && text[n] == ';' ? n + 1 : 0;
}

/* Where the comment or CDATA section at `text` ends: behind `ending`. */
static const char *behind(const char *text, const char *end, const char *ending) {
    const size_t n = strlen(ending);
    while (text + n <= end && memcmp(text, ending, n) != 0) {
        text++;
    }
    return text + n <= end ? text + n : end;
}

static int32_t begins(const char *text, const char *end, const char *word) {
    const size_t n = strlen(word);
    return (size_t)(end - text) >= n && memcmp(text, word, n) == 0;
}

/* One pass: into `out`, or only counted where that is NULL. Lines stay where they are. */
static mhi_osim_tidied pass(const char *text, size_t length, char *out) {
    mhi_osim_tidied t = {0};
    const char *end = text + length, *next;
    int32_t line = 1;
    for (; text < end; text = next) {
        const int32_t comment = begins(text, end, "<!--");
        const int32_t whole = comment || begins(text, end, "<![CDATA[");
        const int32_t plain = *text == '&' && entity(text, (size_t)(end - text)) == 0;
        next = comment ? behind(text + 4, end, "-->") : whole ? behind(text, end, "]]>") : text + 1;
        for (const char *c = text; c < next; c++) {
            line += *c == '\n';
            if (out != NULL && (!comment || *c == '\n')) {
                out[t.length] = *c;
            }
            t.length += !comment || *c == '\n';
        }
        if (comment) {
            const char *last = next - 3;
            for (const char *c = text + 4; c + 1 < last && t.comment_line == 0; c++) {
                t.comment_line = c[0] == '-' && c[1] == '-' ? line : 0;
            }
        }
        if (plain) {
            t.plain_line = t.plain_line > 0 ? t.plain_line : line;
            if (out != NULL) {
                memcpy(out + t.length, "amp;", 4);
            }
            t.length += 4;
        }
    }
    return t;
}

int32_t mhi_osim_tidy(const char *text, size_t length, mhi_osim_tidied *tidied) {
    *tidied = pass(text, length, NULL);
    if (tidied->plain_line == 0 && tidied->comment_line == 0) {
        return 0;
    }
    tidied->text = malloc(tidied->length + 1);
    if (tidied->text != NULL) {
        (void)pass(text, length, tidied->text);
        tidied->text[tidied->length] = '\0';
    }
    return 1;
}

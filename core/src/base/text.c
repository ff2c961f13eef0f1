/* SPDX-License-Identifier: Apache-2.0 */
#include "base/text.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

void mhi_text_add(mhi_text *text, const char *format, ...) {
    va_list args, again;
    va_start(args, format);
    va_copy(again, args);
    int n = vsnprintf(NULL, 0, format, args);
    va_end(args);
    if (n >= 0 && !text->failed) {
        size_t need = text->length + (size_t)n + 1;
        if (need > text->capacity) {
            size_t capacity = need * 2;
            char *grown = realloc(text->data, capacity);
            if (grown == NULL) {
                text->failed = 1;
            } else {
                text->data = grown;
                text->capacity = capacity;
            }
        }
        if (!text->failed) {
            (void)vsnprintf(text->data + text->length, (size_t)n + 1, format, again);
            text->length += (size_t)n;
        }
    }
    va_end(again);
}

void mhi_text_free(mhi_text *text) {
    free(text->data);
    *text = (mhi_text){0};
}

mhe_status mhi_text_give(mhi_text *text, char **out, mhe_error *err) {
    if (text->data == NULL || text->failed) {
        mhi_text_add(text, "%s", ""); /* an empty text is one too */
    }
    if (text->data == NULL || text->failed) {
        mhi_text_free(text);
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    *out = text->data;
    *text = (mhi_text){0};
    return MHE_OK;
}

#define NEAREST_MAX 64
#define BEGINNING 3 /* letters that say what is meant */

/* Levenshtein distance without regard to letter case; names longer than NEAREST_MAX are compared by
 * their head. */
static size_t edit_distance(const char *a, const char *b) {
    size_t na = strnlen(a, NEAREST_MAX), nb = strnlen(b, NEAREST_MAX);
    size_t row[NEAREST_MAX + 1];
    for (size_t j = 0; j <= nb; j++) {
        row[j] = j;
    }
    for (size_t i = 1; i <= na; i++) {
        size_t diagonal = row[0];
        row[0] = i;
        for (size_t j = 1; j <= nb; j++) {
            size_t above = row[j];
            size_t best =
                diagonal + (tolower((unsigned char)a[i - 1]) != tolower((unsigned char)b[j - 1]));
            best = above + 1 < best ? above + 1 : best;
            best = row[j - 1] + 1 < best ? row[j - 1] + 1 : best;
            row[j] = best;
            diagonal = above;
        }
    }
    return row[nb];
}

/* The nearest entry at less than `limit`. */
static const char *nearest_within(const char *name, const char *const *names, int32_t n,
                                  size_t limit) {
    const char *best = NULL;
    size_t best_distance = limit;
    for (int32_t i = 0; i < n; i++) {
        if (names[i] == NULL) {
            continue;
        }
        size_t distance = edit_distance(name, names[i]);
        if (distance < best_distance) {
            best_distance = distance;
            best = names[i];
        }
    }
    return best;
}

/* An entry of which `name` is the beginning. */
static const char *begun_by(const char *name, const char *const *names, int32_t n) {
    const size_t length = strlen(name);
    for (int32_t i = 0; i < n && length >= BEGINNING; i++) {
        if (names[i] != NULL && strncasecmp(names[i], name, length) == 0) {
            return names[i];
        }
    }
    return NULL;
}

const char *mhi_nearest(const char *name, const char *const *names, int32_t n) {
    const char *near = nearest_within(name, names, n, strlen(name) / 3 + 2);
    return near != NULL ? near : begun_by(name, names, n);
}

const char *mhi_slip_of(const char *name, const char *const *names, int32_t n) {
    return nearest_within(name, names, n, strlen(name) / 6 + 2);
}

const char *mhi_suggest(char *out, size_t size, const char *name, const char *const *names,
                        int32_t n) {
    const char *near = mhi_nearest(name, names, n);
    out[0] = '\0';
    if (near != NULL) {
        (void)snprintf(out, size, " (did you mean '%s'?)", near);
        return out;
    }
    size_t used = 0;
    for (int32_t i = 0; i < n; i++) {
        if (names[i] == NULL) {
            continue;
        }
        int more =
            snprintf(out + used, size - used, "%s%s", used == 0 ? " (valid: " : ", ", names[i]);
        if (more < 0 || used + (size_t)more + 6 >= size) {
            (void)snprintf(out + used, size - used, "...");
            break;
        }
        used += (size_t)more;
    }
    if (used > 0 && strlen(out) + 2 <= size) {
        strcat(out, ")");
    }
    return out;
}

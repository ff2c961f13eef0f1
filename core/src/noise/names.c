/* SPDX-License-Identifier: Apache-2.0 */
/* names.c: maps from the names of markers, segments and muscles to spans of time or fractions. */
#include "base/number.h"
#include "noise/parts.h"

#include <string.h>

MHE_PRINTF(4, 5)
static mhe_status refuse(const mhi_map_place *place, const char *entry, mhe_error *err,
                         const char *format, ...) {
    char text[MHE_ERROR_TEXT];
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text, sizeof text, format, args);
    va_end(args);
    const mhi_node *map = place->section == NULL ? NULL : mhi_node_find(place->section, place->key);
    const mhi_node *node = map == NULL ? NULL : mhi_node_find(map, entry);
    return mhi_fail_at(err, MHE_E_CONFIG, place->tree, node, "%s: %s", place->key, text);
}

static int32_t find(const mhi_subjects *subjects, const char *name, size_t length) {
    for (int32_t i = 0; i < subjects->n; i++) {
        if (strlen(subjects->names[i]) == length && memcmp(subjects->names[i], name, length) == 0) {
            return i;
        }
    }
    return -1;
}

static mhe_status subject_of(const mhi_map_place *place, const char *entry,
                             const mhi_subjects *subjects, mhi_cell name, int32_t *subject,
                             mhe_error *err) {
    *subject = find(subjects, name.text, name.length);
    if (*subject >= 0) {
        return MHE_OK;
    }
    char shown[128], hint[256];
    (void)snprintf(shown, sizeof shown, "%.*s", (int)(name.length < 100 ? name.length : 100),
                   name.text);
    return refuse(place, entry, err, "'%s' is no %s of the model%s", shown, subjects->what,
                  mhi_suggest(hint, sizeof hint, shown, subjects->names, subjects->n));
}

static mhi_cell trim(mhi_cell cell) {
    while (cell.length > 0 && strchr(" \t", cell.text[0]) != NULL) {
        cell.text++;
        cell.length--;
    }
    while (cell.length > 0 && strchr(" \t", cell.text[cell.length - 1]) != NULL) {
        cell.length--;
    }
    return cell;
}

/* Takes the part before the next ',' off the list; 0 behind the last one. */
static int32_t next_part(const char **list, mhi_cell *part) {
    if (*list == NULL) {
        return 0;
    }
    const size_t length = strcspn(*list, ",");
    *part = trim((mhi_cell){*list, length});
    *list = (*list)[length] == ',' ? *list + length + 1 : NULL;
    return 1;
}

static int32_t count_parts(const mhe_text_map *map) {
    int32_t n = 0;
    for (int32_t i = 0; i < map->n; i++) {
        mhi_cell part;
        for (const char *list = map->values[i]; next_part(&list, &part);) {
            n++;
        }
    }
    return n;
}

/* "1..1.5" */
static int32_t read_span(mhi_cell part, mhi_span *span) {
    for (size_t dots = 1; dots + 2 < part.length; dots++) {
        if (memcmp(part.text + dots, "..", 2) == 0) {
            const mhi_cell begin = trim((mhi_cell){part.text, dots});
            const mhi_cell end = trim((mhi_cell){part.text + dots + 2, part.length - dots - 2});
            return mhi_number(begin, &span->begin) && mhi_number(end, &span->end) &&
                   span->begin <= span->end;
        }
    }
    return 0;
}

mhe_status mhi_spans_read(const mhe_text_map *map, const mhi_map_place *place,
                          const mhi_subjects *subjects, mhi_arena *arena, mhi_span **spans,
                          int32_t *n, mhe_error *err) {
    *n = 0;
    *spans = MHI_TAKE(arena, mhi_span, count_parts(map));
    if (*spans == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    const mhi_c_locale locale = mhi_c_locale_begin();
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < map->n && status == MHE_OK; i++) {
        int32_t subject = -1;
        const char *list = map->values[i], *key = map->keys[i];
        status = subject_of(place, key, subjects, (mhi_cell){key, strlen(key)}, &subject, err);
        mhi_cell part;
        while (status == MHE_OK && next_part(&list, &part)) {
            mhi_span *span = &(*spans)[(*n)++];
            span->subject = subject;
            if (!read_span(part, span)) {
                status = refuse(place, key, err,
                                "'%.60s' of '%s' is no list of spans in s, like '1..1.5, 2..2.2'",
                                map->values[i], key);
            }
        }
    }
    mhi_c_locale_end(locale);
    return status;
}

void mhi_spans_apply(const mhi_span *spans, int32_t n, int32_t width, double value,
                     mhi_record *record) {
    for (const mhi_span *span = spans; span < spans + n; span++) {
        for (int32_t k = 0; k < record->n_samples; k++) {
            if (record->time[k] < span->begin || record->time[k] > span->end) {
                continue;
            }
            for (int32_t i = 0; i < width; i++) {
                record->values[(ptrdiff_t)k * record->n_channels + span->subject * width + i] =
                    value;
            }
        }
    }
}

/* "BRD 0.2": the number behind the last blank. */
static int32_t read_fraction(mhi_cell part, mhi_cell *name, double *fraction) {
    size_t blank = part.length;
    while (blank > 0 && part.text[blank - 1] != ' ' && part.text[blank - 1] != '\t') {
        blank--;
    }
    *name = trim((mhi_cell){part.text, blank});
    return name->length > 0 &&
           mhi_number((mhi_cell){part.text + blank, part.length - blank}, fraction) &&
           *fraction >= 0 && *fraction <= 1;
}

mhe_status mhi_fractions_read(const mhe_text_map *map, const mhi_map_place *place,
                              const mhi_subjects *readers, const mhi_subjects *sources,
                              double *matrix, mhe_error *err) {
    const mhi_c_locale locale = mhi_c_locale_begin();
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < map->n && status == MHE_OK; i++) {
        int32_t reader = -1, source = -1;
        const char *list = map->values[i], *key = map->keys[i];
        status = subject_of(place, key, readers, (mhi_cell){key, strlen(key)}, &reader, err);
        mhi_cell part, name;
        while (status == MHE_OK && next_part(&list, &part)) {
            double fraction = 0;
            if (!read_fraction(part, &name, &fraction)) {
                status = refuse(place, key, err,
                                "'%.60s' of '%s' is no list of %ss and fractions in [0, 1], like "
                                "'%s 0.2'",
                                map->values[i], key, sources->what, sources->names[0]);
                break;
            }
            status = subject_of(place, key, sources, name, &source, err);
            if (status == MHE_OK) {
                matrix[(ptrdiff_t)reader * sources->n + source] += fraction;
            }
        }
    }
    mhi_c_locale_end(locale);
    return status;
}

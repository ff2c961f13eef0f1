/* SPDX-License-Identifier: Apache-2.0 */
/* Life of a table, and the search for a column. */
#include "io/table.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>

static void free_texts(char **texts, int32_t n) {
    for (int32_t i = 0; texts != NULL && i < n; i++) {
        free(texts[i]);
    }
    free(texts);
}

void mhi_table_free(mhi_table *table) {
    if (table == NULL) {
        return;
    }
    free_texts(table->labels, table->n_labels);
    free_texts(table->warnings, table->n_warnings);
    free(table->path);
    free(table->time);
    free(table->values);
    free(table);
}

/* The quantities a label may state: our prefix and OpenSim's last path component. */
static const struct {
    const char *prefix, *component;
} quantities[] = {{"q", "value"},
                  {"qdot", "speed"},
                  {"a", "activation"},
                  {"e", "excitation"},
                  {"F", "tendon_force"}};
#define N_QUANTITIES ((int32_t)(sizeof quantities / sizeof *quantities))
#define QUANTITY_NONE (-1)
#define QUANTITY_Q 0

typedef struct label_part {
    const char *name; /* without subject, path and quantity */
    size_t length;
    int32_t quantity; /* position in the list above, or QUANTITY_NONE */
} label_part;

static int32_t same(const char *a, size_t length, const char *b) {
    return strlen(b) == length && memcmp(a, b, length) == 0;
}

/* Last component of text [length]: what stands behind the last ':' or '/'. */
static label_part last_component(const char *text, size_t length) {
    size_t start = length;
    while (start > 0 && text[start - 1] != ':' && text[start - 1] != '/') {
        start--;
    }
    return (label_part){text + start, length - start, QUANTITY_NONE};
}

static label_part take_apart(const char *text) {
    label_part whole = last_component(text, strlen(text));
    size_t before = (size_t)(whole.name - text);
    for (int32_t i = 0; i < N_QUANTITIES && before > 1; i++) {
        if (text[before - 1] == '/' && same(whole.name, whole.length, quantities[i].component)) {
            label_part parent = last_component(text, before - 1);
            parent.quantity = i;
            return parent;
        }
    }
    for (int32_t i = 0; i < N_QUANTITIES; i++) {
        size_t n = strlen(quantities[i].prefix);
        if (whole.length > n + 1 && memcmp(whole.name, quantities[i].prefix, n) == 0 &&
            (whole.name[n] == '.' || whole.name[n] == '_')) {
            return (label_part){whole.name + n + 1, whole.length - n - 1, i};
        }
    }
    return whole;
}

/* How well a column serves the wanted name; 0: not at all. */
static int32_t score(const char *column, const char *name, const label_part *wanted) {
    label_part behind = last_component(column, strlen(column));
    if (strcmp(column, name) == 0) {
        return 5;
    }
    if (same(behind.name, behind.length, name)) {
        return 4;
    }
    label_part found = take_apart(column);
    if (found.length != wanted->length || memcmp(found.name, wanted->name, found.length) != 0) {
        return 0;
    }
    if (found.quantity == wanted->quantity) {
        return 3;
    }
    return wanted->quantity == QUANTITY_NONE && found.quantity == QUANTITY_Q ? 2 : 0;
}

int32_t mhi_table_find(const mhi_table *table, const char *name) {
    label_part wanted = take_apart(name);
    int32_t best = -1, best_score = 0, ties = 0;
    for (int32_t i = 0; i < table->n_labels; i++) {
        int32_t fit = score(table->labels[i], name, &wanted);
        if (fit > best_score) {
            best = i;
            best_score = fit;
            ties = 0;
        } else if (fit > 0 && fit == best_score) {
            ties++;
        }
    }
    return ties == 0 ? best : -1;
}

static const char *pass_over(const char *text) {
    return text + strspn(text, "._- \"'*");
}

int32_t mhi_names_alike(const char *a, const char *b) {
    for (;;) {
        a = pass_over(a);
        b = pass_over(b);
        if (*a == '\0' || *b == '\0') {
            return *a == *b;
        }
        if (tolower((unsigned char)*a++) != tolower((unsigned char)*b++)) {
            return 0;
        }
    }
}

int32_t mhi_table_find_alike(const mhi_table *table, const char *name, const uint8_t *used) {
    int32_t found = -1;
    for (int32_t i = 0; i < table->n_labels; i++) {
        const char *label = table->labels[i];
        const label_part part = last_component(label, strlen(label));
        if ((used != NULL && used[i]) ||
            !(mhi_names_alike(label, name) || mhi_names_alike(part.name, name))) {
            continue;
        }
        if (found >= 0) {
            return -1;
        }
        found = i;
    }
    return found;
}

size_t mhi_label_subject(const char *label) {
    const char *colon = strrchr(label, ':');
    return colon == NULL || colon[1] == '\0' ? 0 : (size_t)(colon - label);
}

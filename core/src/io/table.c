/* SPDX-License-Identifier: Apache-2.0 */
/* Life of a table, and the search for a column. */
#include "io/table.h"

#include <stdlib.h>
#include <string.h>

static void free_texts(char **texts, int32_t n) {
    for (int32_t i = 0; i < n; i++) {
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

typedef struct label {
    const char *name; /* without subject, path and quantity */
    size_t length;
    int32_t quantity; /* position in the list above, or QUANTITY_NONE */
} label;

static int32_t same(const char *a, size_t length, const char *b) {
    return strlen(b) == length && memcmp(a, b, length) == 0;
}

/* Last component of text [length]: what stands behind the last ':' or '/'. */
static label last_component(const char *text, size_t length) {
    size_t start = length;
    while (start > 0 && text[start - 1] != ':' && text[start - 1] != '/') {
        start--;
    }
    return (label){text + start, length - start, QUANTITY_NONE};
}

static label take_apart(const char *text) {
    label whole = last_component(text, strlen(text));
    size_t before = (size_t)(whole.name - text);
    for (int32_t i = 0; i < N_QUANTITIES && before > 1; i++) {
        if (text[before - 1] == '/' && same(whole.name, whole.length, quantities[i].component)) {
            label parent = last_component(text, before - 1);
            parent.quantity = i;
            return parent;
        }
    }
    for (int32_t i = 0; i < N_QUANTITIES; i++) {
        size_t n = strlen(quantities[i].prefix);
        if (whole.length > n + 1 && memcmp(whole.name, quantities[i].prefix, n) == 0 &&
            (whole.name[n] == '.' || whole.name[n] == '_')) {
            return (label){whole.name + n + 1, whole.length - n - 1, i};
        }
    }
    return whole;
}

/* How well a column serves the wanted name; 0: not at all. */
static int32_t score(const char *column, const char *name, const label *wanted) {
    label behind = last_component(column, strlen(column));
    if (strcmp(column, name) == 0) {
        return 5;
    }
    if (same(behind.name, behind.length, name)) {
        return 4;
    }
    label found = take_apart(column);
    if (found.length != wanted->length || memcmp(found.name, wanted->name, found.length) != 0) {
        return 0;
    }
    if (found.quantity == wanted->quantity) {
        return 3;
    }
    return wanted->quantity == QUANTITY_NONE && found.quantity == QUANTITY_Q ? 2 : 0;
}

int32_t mhi_table_find(const mhi_table *table, const char *name) {
    label wanted = take_apart(name);
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

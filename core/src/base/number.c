/* SPDX-License-Identifier: Apache-2.0 */
#include "base/number.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

mhi_c_locale mhi_c_locale_begin(void) {
    mhi_c_locale saved = {newlocale(LC_ALL_MASK, "C", (locale_t)0), (locale_t)0};
    saved.before = uselocale(saved.plain);
    return saved;
}

void mhi_c_locale_end(mhi_c_locale saved) {
    (void)uselocale(saved.before);
    if (saved.plain != (locale_t)0) {
        freelocale(saved.plain);
    }
}

#define LONGEST 127 /* more digits than any double needs */

int32_t mhi_number(mhi_cell cell, double *value) {
    char copy[LONGEST + 1], *end = NULL;
    if (cell.length == 0 || cell.length > LONGEST) {
        return 0;
    }
    memcpy(copy, cell.text, cell.length);
    copy[cell.length] = '\0';
    if (strspn(copy, "0123456789+-.eE") != cell.length) {
        return 0;
    }
    double read = strtod(copy, &end);
    if (*end != '\0' || !isfinite(read)) {
        return 0;
    }
    *value = read;
    return 1;
}

int32_t mhi_number_missing(mhi_cell cell) {
    static const char *const spellings[] = {"nan", "1.#qnan", "1.#ind", "1.#snan"};
    static const char *const words[] = {"na", "n/a", "#n/a", "null", "none", "missing",
                                        "-",  "--",  ".",    "?",    "*"};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++) {
        if (cell.length == strlen(words[i]) && strncasecmp(cell.text, words[i], cell.length) == 0) {
            return 1;
        }
    }
    if (cell.length == 0) {
        return 1;
    }
    if (*cell.text == '-' || *cell.text == '+') {
        cell.text++;
        cell.length--;
    }
    for (size_t i = 0; i < sizeof spellings / sizeof *spellings; i++) {
        size_t n = strlen(spellings[i]);
        if (cell.length >= n && strncasecmp(cell.text, spellings[i], n) == 0 &&
            (cell.length == n || cell.text[n] == '(' || i > 0)) {
            return 1;
        }
    }
    return 0;
}

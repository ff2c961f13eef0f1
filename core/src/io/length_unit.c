/* SPDX-License-Identifier: Apache-2.0 */
#include "io/length_unit.h"

#include <ctype.h>
#include <string.h>

static const struct {
    const char *name;
    double metres;
    const char *spellings; /* blanks between them */
} units[] = {
    {"mm", 1e-3, " mm millimeter millimeters millimetre millimetres milimeter milimeters "},
    {"cm", 1e-2, " cm centimeter centimeters centimetre centimetres "},
    {"dm", 1e-1, " dm decimeter decimeters decimetre decimetres "},
    {"m", 1, " m meter meters metre metres mtr "},
    {"um", 1e-6, " um micrometer micrometers micrometre micrometres micron microns "},
    {"in", 0.0254, " in inch inches "},
    {"ft", 0.3048, " ft foot feet "},
};

mhi_length_unit mhi_length_unit_of(mhi_cell text) {
    char word[32] = " ";
    size_t n = 1;
    for (size_t i = 0; i < text.length; i++) {
        const unsigned char c = (unsigned char)text.text[i];
        if (strchr("[]().,;:\"' \t\r", c) != NULL) {
            continue;
        }
        if (n + 2 >= sizeof word) {
            return (mhi_length_unit){.metres = 0};
        }
        word[n++] = (char)tolower(c);
    }
    word[n++] = ' ';
    word[n] = '\0';
    mhi_length_unit unit = {.metres = 0};
    for (size_t i = 0; i < sizeof units / sizeof units[0] && n > 2; i++) {
        if (strstr(units[i].spellings, word) != NULL) {
            (void)snprintf(unit.name, sizeof unit.name, "%s", units[i].name);
            unit.metres = units[i].metres;
        }
    }
    return unit;
}

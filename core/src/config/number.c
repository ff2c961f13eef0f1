/* SPDX-License-Identifier: Apache-2.0 */
#include "config/number.h"

#include <locale.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* An application may run under a locale with a decimal comma; strtod and printf would follow it. */
static locale_t enter_c_locale(locale_t *c) {
    *c = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    return *c == (locale_t)0 ? (locale_t)0 : uselocale(*c);
}

static void leave_c_locale(locale_t before, locale_t c) {
    if (c != (locale_t)0) {
        (void)uselocale(before);
        freelocale(c);
    }
}

static const char *skip_digits(const char *text) {
    return text + strspn(text, "0123456789");
}

/* [+-] digits [. digits] [e [+-] digits], with a digit before or after the point */
static int decimal(const char *text) {
    text += *text == '+' || *text == '-';
    const char *at = skip_digits(text);
    size_t digits = (size_t)(at - text);
    if (*at == '.') {
        const char *fraction = at + 1;
        at = skip_digits(fraction);
        digits += (size_t)(at - fraction);
    }
    if (digits == 0) {
        return 0;
    }
    if (*at == 'e' || *at == 'E') {
        const char *exponent = at + 1;
        exponent += *exponent == '+' || *exponent == '-';
        at = skip_digits(exponent);
        if (at == exponent) {
            return 0;
        }
    }
    return *at == '\0';
}

static int infinite(const char *text) {
    text += *text == '+' || *text == '-';
    return strcmp(text, ".inf") == 0 || strcmp(text, ".Inf") == 0 || strcmp(text, ".INF") == 0;
}

int32_t mhi_number_read(const char *text, double *value) {
    if (infinite(text)) {
        *value = *text == '-' ? -INFINITY : INFINITY;
        return 1;
    }
    if (!decimal(text)) {
        return 0;
    }
    locale_t c, before = enter_c_locale(&c);
    *value = strtod(text, NULL);
    leave_c_locale(before, c);
    return isfinite(*value);
}

const char *mhi_number_write(double value, char out[MHI_NUMBER_SIZE]) {
    if (isinf(value)) {
        return strcpy(out, value > 0 ? ".inf" : "-.inf");
    }
    locale_t c, before = enter_c_locale(&c);
    for (int digits = 15; digits <= 17; digits++) {
        (void)snprintf(out, MHI_NUMBER_SIZE, "%.*g", digits, value);
        if (strtod(out, NULL) == value) {
            break;
        }
    }
    leave_c_locale(before, c);
    return out;
}

/* SPDX-License-Identifier: Apache-2.0 */
/* mutate FILE OUT SEED: FILE with one to eight changes of kinds that spoil real files: bytes,
 * numbers, words and lines exchanged, doubled, cut. The same seed makes the same file. */
#include <ctype.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LARGEST (1 << 24)

static uint64_t state;

static uint32_t any(uint32_t below) { /* splitmix64 */
    uint64_t z = (state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return below == 0 ? 0 : (uint32_t)((z ^ (z >> 31)) % below);
}

static char *text;
static size_t length;

/* Puts `with` in the place of n bytes from `at`. */
static void replace(size_t at, size_t n, const char *with, size_t m) {
    if (length - n + m < LARGEST) {
        memmove(text + at + m, text + at + n, length - at - n);
        memcpy(text + at, with, m);
        length += m - n;
    }
}

static size_t place(void) {
    return any((uint32_t)length);
}

static size_t line_at(size_t at) {
    while (at > 0 && text[at - 1] != '\n') {
        at--;
    }
    return at;
}

static size_t line_length(size_t at) {
    size_t n = 0;
    while (at + n < length && text[at + n++] != '\n') {
    }
    return n;
}

/* A number near a random place; 0: there is none. */
static size_t number_at(size_t *n) {
    size_t at = place();
    for (size_t tried = 0; tried < length && !isdigit((unsigned char)text[at]); tried++) {
        at = at + 1 < length ? at + 1 : 0;
    }
    *n = 0;
    while (at + *n < length && strchr("0123456789.eE-+", text[at + *n]) != NULL &&
           text[at + *n] != '\0') {
        ++*n;
    }
    return at;
}

static void change_number(void) {
    static const char *const odd[] = {
        "0",    "-1",  "1e308", "-1e308", "1e-308", "nan", "inf",         "-inf",      "1e9",
        "1e-9", "",    "x",     "0x10",   "1,5",    "1e",  "99999999999", "-0",        "2147483648",
        "255",  "256", "65535", "65536",  "1000",   "0.1", "1e400",       "0000000001"};
    size_t n;
    const size_t at = number_at(&n);
    const char *with = odd[any(sizeof odd / sizeof odd[0])];
    replace(at, n, with, strlen(with));
}

/* Another number, so that the file can still be read. */
static void change_digits(void) {
    size_t n;
    const size_t at = number_at(&n);
    for (size_t i = at; i < at + n; i++) {
        text[i] = isdigit((unsigned char)text[i]) ? (char)('0' + any(10)) : text[i];
    }
    if (n > 0 && any(4) == 0) { /* ten times as large */
        replace(at, 0, "7", 1);
    }
}

static void change_bytes(void) {
    const uint32_t n = 1 + any(4);
    for (uint32_t i = 0; i < n; i++) {
        text[place()] = (char)any(256);
    }
}

static void double_line(void) {
    const size_t at = line_at(place()), n = line_length(at);
    char *copy = malloc(n + 1);
    if (copy != NULL) {
        memcpy(copy, text + at, n);
        replace(at, 0, copy, n);
        free(copy);
    }
}

static void cut_line(void) {
    const size_t at = line_at(place());
    replace(at, line_length(at), "", 0);
}

static void cut_end(void) {
    length = place();
}

static void cut_piece(void) {
    const size_t at = place(), most = length - at;
    replace(at, any((uint32_t)(most < 40 ? most : 40)), "", 0);
}

static void insert_word(void) {
    static const char *const words[] = {
        "\t", "\n", "\"",  "<",   ">",    "&#10;",        "{",   "}",  "[",        "]",   ":", " ",
        "#",  "*x", "&x ", "../", "%s%n", "\xef\xbb\xbf", "-->", "- ", "\xff\xfe", "yes", "~"};
    const char *with = words[any(sizeof words / sizeof words[0])];
    replace(place(), 0, with, strlen(with));
}

/* A word in the place of another from elsewhere in the file. */
static void exchange_words(void) {
    const size_t from = place(), at = place();
    const size_t most = length - (from > at ? from : at);
    const size_t n = any((uint32_t)(most < 24 ? most : 24));
    char copy[24];
    memcpy(copy, text + from, n);
    replace(at, n, copy, n);
}

int main(int argc, char **argv) {
    static void (*const kinds[])(void) = {
        change_number, change_number, change_digits, change_digits,  change_digits,  change_digits,
        change_digits, change_digits, change_digits, change_digits,  change_digits,  change_digits,
        change_bytes,  double_line,   cut_line,      cut_end,        cut_piece,      insert_word,
        insert_word,   double_line,   cut_line,      exchange_words, exchange_words, change_bytes};
    FILE *in = argc == 4 ? fopen(argv[1], "rb") : NULL;
    text = malloc(LARGEST);
    if (in == NULL || text == NULL) {
        (void)fprintf(stderr, "usage: mutate FILE OUT SEED\n");
        return 2;
    }
    length = fread(text, 1, LARGEST / 2, in);
    (void)fclose(in);
    state = strtoull(argv[3], NULL, 10);
    const uint32_t n = 1 + any(1 + any(8)); /* mostly few: the run is to go on */
    for (uint32_t i = 0; i < n && length > 0; i++) {
        const uint32_t kind = any(sizeof kinds / sizeof kinds[0]);
        if (kinds[kind] != cut_end || any(4) == 0) {
            kinds[kind]();
        }
    }
    FILE *out = fopen(argv[2], "wb");
    const int good = out != NULL && fwrite(text, 1, length, out) == length;
    free(text);
    return (out == NULL || fclose(out) != 0 || !good) ? 1 : 0;
}

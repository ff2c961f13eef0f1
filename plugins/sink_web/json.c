/* SPDX-License-Identifier: Apache-2.0 */
/* json.c: JSON out, and what little comes in. */
#include "web.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void add_bytes(web_text *t, const char *bytes, size_t n) {
    if (t->n + n + 1 > t->room) {
        const size_t room = 2 * (t->n + n) + 256;
        char *grown = realloc(t->text, room);
        if (grown == NULL) {
            t->failed = 1;
            return;
        }
        t->text = grown;
        t->room = room;
    }
    memcpy(t->text + t->n, bytes, n);
    t->n += n;
    t->text[t->n] = '\0';
}

void web_add(web_text *t, const char *plain) {
    add_bytes(t, plain, strlen(plain));
}

void web_add_text(web_text *t, const char *text) {
    add_bytes(t, "\"", 1);
    for (const char *c = text; *c != '\0'; c++) {
        char escaped[8];
        if (*c == '"' || *c == '\\') {
            escaped[0] = '\\';
            escaped[1] = *c;
            add_bytes(t, escaped, 2);
        } else if ((unsigned char)*c < ' ' || *c == '<') { /* '<': no end of a script */
            (void)snprintf(escaped, sizeof escaped, "\\u%04x", (unsigned)(unsigned char)*c);
            add_bytes(t, escaped, 6);
        } else {
            add_bytes(t, c, 1);
        }
    }
    add_bytes(t, "\"", 1);
}

void web_add_number(web_text *t, double value) {
    char number[40];
    if (!isfinite(value)) {
        web_add(t, "null");
        return;
    }
    (void)snprintf(number, sizeof number, "%.9g", value);
    for (char *c = number; *c != '\0'; c++) { /* whatever the locale */
        *c = *c == ',' ? '.' : *c;
    }
    web_add(t, number);
}

static const char *skip_blanks(const char *c) {
    return c + strspn(c, " \t\r\n");
}

/* Copies a string's content from behind its quote; returns what follows it, NULL: it has no end. */
static const char *take_string(const char *c, char *out, size_t room) {
    size_t n = 0;
    for (; *c != '"'; c++) {
        if (*c == '\0') {
            return NULL;
        }
        if (*c == '\\' && *++c == '\0') {
            return NULL;
        }
        if (n + 1 < room) {
            out[n++] = (unsigned char)*c < ' ' ? ' ' : *c;
        }
    }
    out[room > 0 ? n : 0] = '\0';
    return c + 1;
}

int web_json_find(const char *json, const char *key, char *out, size_t room) {
    char name[64];
    const char *c = json;
    while ((c = strchr(c, '"')) != NULL) {
        c = take_string(c + 1, name, sizeof name);
        if (c == NULL) {
            return 0;
        }
        c = skip_blanks(c);
        if (*c != ':') {
            continue; /* it was a value */
        }
        c = skip_blanks(c + 1);
        if (strcmp(name, key) != 0) {
            if (*c == '"') {
                c = take_string(c + 1, name, sizeof name);
                if (c == NULL) {
                    return 0;
                }
            }
            continue;
        }
        if (*c == '"') {
            return take_string(c + 1, out, room) != NULL;
        }
        const size_t n = strcspn(c, ",}] \t\r\n");
        const size_t kept = n < room ? n : room - 1;
        memcpy(out, c, kept);
        out[kept] = '\0';
        return 1;
    }
    return 0;
}

/* SPDX-License-Identifier: Apache-2.0 */
#include "io/biomod_lex.h"

#include "base/pi.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Blanks comments out, newlines kept; an open comment at the end of the file is worth a warning. */
static void blank_comments(mhi_biomod_lex *lex, char *text) {
    int32_t line = 1, opened = 0;
    enum { CODE, LINE_COMMENT, BLOCK_COMMENT } state = CODE;
    for (char *c = text; *c != '\0'; c++) {
        char here = *c, next = c[1];
        if (here == '\n') {
            line++;
            state = state == LINE_COMMENT ? CODE : state;
        } else if (state == CODE && here == '/' && (next == '/' || next == '*')) {
            state = next == '/' ? LINE_COMMENT : BLOCK_COMMENT;
            opened = line;
            c[0] = c[1] = ' ';
            c++;
        } else if (state == BLOCK_COMMENT && here == '*' && next == '/') {
            state = CODE;
            c[0] = c[1] = ' ';
            c++;
        } else if (state != CODE) {
            *c = ' ';
        }
    }
    lex->last_line = line;
    if (state == BLOCK_COMMENT) {
        mhi_build_warn(lex->b, opened, "this comment is never closed");
    }
}

/* From the back: where each word's next "end..." stands. */
static void find_ends(mhi_biomod_lex *lex) {
    int32_t next = lex->words.n;
    for (int32_t i = lex->words.n - 1; i >= 0; i--) {
        mhi_word *word = lex->words.items[i];
        next = strncasecmp(word->text, "end", 3) == 0 ? i : next;
        word->next_end = next;
    }
}

void mhi_lex_start(mhi_biomod_lex *lex, mhi_builder *b, const char *text, size_t length) {
    *lex = (mhi_biomod_lex){.b = b};
    char *copy = mhi_arena_text_n(&b->arena, text, length);
    if (copy == NULL) {
        b->status = mhe_fail(b->err, MHE_E_MEMORY, "out of memory");
        return;
    }
    if (memchr(text, '\0', length) != NULL) {
        mhi_build_fail(b, 0, "not a text file");
        return;
    }
    blank_comments(lex, copy);
    int32_t line = 1;
    for (char *c = copy; *c != '\0';) {
        if (isspace((unsigned char)*c)) {
            line += *c == '\n';
            c++;
            continue;
        }
        mhi_word *word = mhi_build_push(b, &lex->words, sizeof *word);
        if (word == NULL) {
            return;
        }
        *word = (mhi_word){.text = c, .line = line};
        while (*c != '\0' && !isspace((unsigned char)*c)) {
            c++;
        }
        if (*c != '\0') {
            line += *c == '\n';
            *c++ = '\0';
        }
    }
    find_ends(lex);
}

int32_t mhi_lex_ends(const char *word, const char *kind) {
    return strncasecmp(word, "end", 3) == 0 && mhi_same_word(word + 3, kind);
}

#define ENDS_MAX 1000 /* no block holds more others */

int32_t mhi_lex_has_end(const mhi_biomod_lex *lex, const char *kind, const char *around) {
    const mhi_list *words = &lex->words;
    int32_t at = lex->at;
    for (int32_t n = 0; n < ENDS_MAX && at < words->n; n++) {
        at = ((const mhi_word *)words->items[at])->next_end;
        if (at >= words->n) {
            return 0;
        }
        const char *text = ((const mhi_word *)words->items[at])->text;
        if (mhi_lex_ends(text, kind)) {
            return 1;
        }
        if (*around != '\0' && mhi_lex_ends(text, around)) {
            return 0;
        }
        at++;
    }
    return 0;
}

mhi_word mhi_lex_peek(const mhi_biomod_lex *lex) {
    if (lex->at >= lex->words.n) {
        return (mhi_word){.text = "", .line = lex->last_line};
    }
    return *(const mhi_word *)lex->words.items[lex->at];
}

mhi_word mhi_lex_next(mhi_biomod_lex *lex) {
    mhi_word word = mhi_lex_peek(lex);
    lex->at += lex->at < lex->words.n;
    return word;
}

/* Recursive descent over one word; `at` is NULL once it is no arithmetic. */
typedef struct expression {
    const mhi_biomod_lex *lex;
    const char *at;
    int32_t depth;
} expression;

#define EXPRESSION_DEPTH 64

static double sum(expression *e);

static double variable(expression *e) {
    size_t length = 1;
    while (isalnum((unsigned char)e->at[length]) || e->at[length] == '_') {
        length++;
    }
    for (int32_t i = 0; i < e->lex->variables.n; i++) {
        const mhi_variable *v = e->lex->variables.items[i];
        if (strlen(v->name) == length && strncmp(v->name, e->at, length) == 0) {
            e->at += length;
            return v->value;
        }
    }
    e->at = NULL;
    return 0;
}

static double factor(expression *e) {
    double value = 0;
    if (e->at == NULL || ++e->depth > EXPRESSION_DEPTH) {
        e->at = NULL;
        return 0;
    }
    if (*e->at == '-' || *e->at == '+') {
        double sign = *e->at++ == '-' ? -1 : 1;
        value = sign * factor(e);
    } else if (*e->at == '(') {
        e->at++;
        value = sum(e);
        e->at = e->at != NULL && *e->at == ')' ? e->at + 1 : NULL;
    } else if (*e->at == '$') {
        value = variable(e);
    } else if (tolower((unsigned char)e->at[0]) == 'p' && tolower((unsigned char)e->at[1]) == 'i') {
        e->at += 2;
        value = MHI_PI;
    } else if (isdigit((unsigned char)*e->at) || *e->at == '.') {
        char *end;
        value = strtod(e->at, &end);
        e->at = end != e->at ? end : NULL;
    } else {
        e->at = NULL;
    }
    e->depth--;
    return value;
}

static double product(expression *e) {
    double value = factor(e);
    while (e->at != NULL && (*e->at == '*' || *e->at == '/')) {
        char operation = *e->at++;
        double right = factor(e);
        value = operation == '*' ? value * right : value / right;
    }
    return value;
}

static double sum(expression *e) {
    double value = product(e);
    while (e->at != NULL && (*e->at == '+' || *e->at == '-')) {
        char operation = *e->at++;
        double right = product(e);
        value = operation == '+' ? value + right : value - right;
    }
    return value;
}

int32_t mhi_lex_value(const mhi_biomod_lex *lex, const char *word, double *value) {
    expression e = {.lex = lex, .at = word};
    *value = sum(&e);
    return e.at != NULL && *e.at == '\0';
}

int32_t mhi_lex_numbers(mhi_biomod_lex *lex, const char *what, double *out, int32_t n) {
    for (int32_t i = 0; i < n; i++) {
        mhi_word word = mhi_lex_peek(lex);
        if (!mhi_lex_value(lex, word.text, &out[i])) {
            mhi_build_fail(lex->b, word.line, "'%s' needs %d number%s; '%s' is none", what, (int)n,
                           n == 1 ? "" : "s", word.text);
            return 0;
        }
        if (!isfinite(out[i])) {
            mhi_build_fail(lex->b, word.line, "'%s' of '%s' is not finite", word.text, what);
            return 0;
        }
        lex->at++;
    }
    return 1;
}

int32_t mhi_lex_all_numbers(mhi_biomod_lex *lex, double *out, int32_t n) {
    int32_t count = 0;
    double value;
    while (mhi_lex_value(lex, mhi_lex_peek(lex).text, &value)) {
        if (count < n) {
            out[count] = value;
        }
        count++;
        lex->at++;
    }
    return count;
}

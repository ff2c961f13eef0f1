/* SPDX-License-Identifier: Apache-2.0 */
/* biomod_lex.h: words and numbers of a .bioMod file. */
#ifndef MHI_BIOMOD_LEX_H
#define MHI_BIOMOD_LEX_H

#include "io/description_builder.h"

typedef struct mhi_word {
    const char *text; /* "" at the end of the file */
    int32_t line;
    int32_t next_end; /* place of the next word, this one included, that begins with "end" */
} mhi_word;

typedef struct mhi_variable {
    const char *name; /* with its $ */
    double value;
} mhi_variable;

typedef struct mhi_biomod_lex {
    mhi_builder *b;
    mhi_list words;     /* mhi_word; comments are gone */
    int32_t at;         /* next word */
    int32_t last_line;  /* of the file */
    mhi_list variables; /* mhi_variable */
} mhi_biomod_lex;

/* Splits text into words. Comments are those of C and C++ and may begin inside a line. */
void mhi_lex_start(mhi_biomod_lex *lex, mhi_builder *b, const char *text, size_t length);
/* The next word without and with taking it. */
mhi_word mhi_lex_peek(const mhi_biomod_lex *lex);
mhi_word mhi_lex_next(mhi_biomod_lex *lex);

/* 1 where the word is "end" and then `kind`, letter case free. */
int32_t mhi_lex_ends(const char *word, const char *kind);
/* 1 where "end<kind>" follows, and nothing that ends `around` ("" for the top level) before it. */
int32_t mhi_lex_has_end(const mhi_biomod_lex *lex, const char *kind, const char *around);

/* 1 and the value where the word is a number or arithmetic: + - * / parentheses, pi, $variables. */
int32_t mhi_lex_value(const mhi_biomod_lex *lex, const char *word, double *value);
/* Takes n numbers for `what`; an error and 0 where one is missing or not finite. */
int32_t mhi_lex_numbers(mhi_biomod_lex *lex, const char *what, double *out, int32_t n);
/* Takes all numbers that follow and counts them; the first `n` go to out. */
int32_t mhi_lex_all_numbers(mhi_biomod_lex *lex, double *out, int32_t n);

#endif

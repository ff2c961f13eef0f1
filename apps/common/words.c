/* SPDX-License-Identifier: Apache-2.0 */
#include "words.h"

#include "base/text.h"

#include <mhe/version.h>
#include <stdlib.h>
#include <string.h>

#define NAMES_MAX 40

/* One command line being read. */
typedef struct line {
    const words_program *program;
    int argc;
    char **argv;
    int at;
    int32_t command;
    unsigned char *result;
    int32_t n_operands;
    mhe_error *err;
} line;

static void *field(const line *l, size_t at) {
    return l->result + at;
}

int32_t words_takes(const words_option *option, int32_t command) {
    return option->commands == 0 || (option->commands >> command & 1u) != 0;
}

static mhe_status grow(const line *l, size_t at, const char *value) {
    words_list *list = field(l, at);
    if (list->values == NULL) { /* never more than there are words */
        list->values = calloc((size_t)l->argc, sizeof *list->values);
    }
    if (list->values == NULL) {
        return mhe_fail(l->err, MHE_E_MEMORY, "out of memory");
    }
    list->values[list->n++] = value;
    return MHE_OK;
}

static mhe_status take_int(const line *l, const words_option *o, const char *value) {
    char *end = NULL;
    const long n = strtol(value, &end, 10);
    if (end == value || *end != '\0' || n < o->low || n > o->high) {
        return mhe_fail(l->err, MHE_E_ARGUMENT, "%s: '%s' is no whole number from %d to %d",
                        o->name, value, (int)o->low, (int)o->high);
    }
    *(int32_t *)field(l, o->at) = (int32_t)n;
    return MHE_OK;
}

static mhe_status take_option(line *l, const words_option *o) {
    const char *value = NULL;
    if (o->value != NULL) {
        if (l->at + 1 >= l->argc || l->argv[l->at + 1][0] == '\0') {
            return mhe_fail(l->err, MHE_E_ARGUMENT, "%s needs a value", o->name);
        }
        value = l->argv[++l->at];
    }
    if (o->mode != 0) {
        *(int32_t *)field(l, l->program->mode) = o->mode;
    }
    switch (o->kind) {
    case WORDS_TEXT:
        *(const char **)field(l, o->at) = value;
        return MHE_OK;
    case WORDS_LIST:
        return grow(l, o->at, value);
    case WORDS_INT:
        return take_int(l, o, value);
    case WORDS_OTHER:
        return o->take(o->name, value, field(l, o->at), l->err);
    default:
        if (o->at != l->program->mode) {
            *(int32_t *)field(l, o->at) = o->low;
        }
        return MHE_OK;
    }
}

static mhe_status unknown(const line *l, const char *word) {
    const char *names[NAMES_MAX] = {"--help", "--version"};
    char hint[256];
    int32_t n = 2;
    for (int32_t i = 0; i < l->program->n_options && n < NAMES_MAX; i++) {
        if (words_takes(&l->program->options[i], l->command)) {
            names[n++] = l->program->options[i].name;
        }
    }
    return mhe_fail(l->err, MHE_E_ARGUMENT, "unknown option '%s'%s", word,
                    mhi_suggest(hint, sizeof hint, word, names, n));
}

static mhe_status take_operand(line *l, const char *word) {
    const words_command *c = &l->program->commands[l->command];
    const char **first = field(l, l->program->operand);
    if (*first == NULL) {
        *first = word;
        l->n_operands++;
        return MHE_OK;
    }
    if (l->n_operands >= c->most) {
        return mhe_fail(l->err, MHE_E_ARGUMENT, "one %s at a time: '%s' and '%s'", c->what, *first,
                        word);
    }
    l->n_operands++;
    return grow(l, l->program->others, word);
}

static mhe_status take_word(line *l) {
    const char *word = l->argv[l->at];
    for (int32_t i = 0; i < l->program->n_options; i++) {
        const words_option *o = &l->program->options[i];
        if (words_takes(o, l->command) && strcmp(o->name, word) == 0) {
            return take_option(l, o);
        }
    }
    return word[0] == '-' && word[1] != '\0' ? unknown(l, word) : take_operand(l, word);
}

/* What needs no command: 1 where it was one of these. */
static int32_t answer(const words_program *p, const char *word) {
    if (strcmp(word, "--version") == 0) {
        (void)printf("%s %s\n", p->name, MHE_VERSION);
    } else if (strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0) {
        words_help(p);
    } else if (strcmp(word, "--print-man") == 0) {
        words_man(p);
    } else if (strcmp(word, "--print-completion") == 0) {
        words_completion(p);
    } else {
        return 0;
    }
    return 1;
}

static mhe_status choose_command(line *l, int32_t *outcome) {
    const words_program *p = l->program;
    const char *names[NAMES_MAX], *word = l->argc >= 2 ? l->argv[1] : NULL;
    char hint[256];
    for (int32_t i = 0; i < p->n_commands; i++) {
        names[i] = p->commands[i].name;
        if (word != NULL && strcmp(word, names[i]) == 0) {
            l->command = i;
            l->at = 2;
            return MHE_OK;
        }
    }
    if (word != NULL && answer(p, word)) {
        *outcome = WORDS_ANSWERED;
        return MHE_OK;
    }
    (void)mhi_suggest(hint, sizeof hint, word == NULL ? "" : word, names, p->n_commands);
    return word == NULL ? mhe_fail(l->err, MHE_E_ARGUMENT, "no command is given%s", hint)
                        : mhe_fail(l->err, MHE_E_ARGUMENT, "unknown command '%s'%s", word, hint);
}

mhe_status words_parse(const words_program *program, int argc, char **argv, void *result,
                       int32_t *command, int32_t *outcome, mhe_error *err) {
    line l = {
        .program = program, .argc = argc, .argv = argv, .at = 1, .result = result, .err = err};
    const int32_t has_commands = program->commands[0].name[0] != '\0';
    mhe_status status = MHE_OK;
    *outcome = WORDS_RUN;
    if (has_commands) {
        status = choose_command(&l, outcome);
    }
    *command = l.command;
    for (int i = l.at; i < argc && status == MHE_OK && *outcome == WORDS_RUN; i++) {
        if (has_commands && (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0)) {
            *outcome = WORDS_HELP;
        } else if (!has_commands && answer(program, argv[i])) {
            *outcome = WORDS_ANSWERED;
        }
    }
    for (; l.at < argc && status == MHE_OK && *outcome == WORDS_RUN; l.at++) {
        status = take_word(&l);
    }
    const int32_t mode = *(int32_t *)field(&l, program->mode);
    if (status == MHE_OK && *outcome == WORDS_RUN && program->commands[*command].operand != NULL &&
        *(const char **)field(&l, program->operand) == NULL &&
        (program->modes_without >> mode & 1u) == 0) {
        const words_command *c = &program->commands[*command];
        status = c->missing != NULL
                     ? mhe_fail(err, MHE_E_ARGUMENT, "%s", c->missing)
                     : mhe_fail(err, MHE_E_ARGUMENT, "no %s is given; '%s --help' shows the usage",
                                c->what, program->name);
    }
    return status;
}

void words_free(const words_program *program, void *result) {
    line l = {.program = program, .result = result};
    for (int32_t i = 0; i < program->n_options; i++) {
        if (program->options[i].kind == WORDS_LIST) {
            words_list *list = field(&l, program->options[i].at);
            free(list->values);
            *list = (words_list){0};
        }
    }
    words_list *others = field(&l, program->others);
    free(others->values);
    *others = (words_list){0};
}

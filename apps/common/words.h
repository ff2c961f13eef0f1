/* SPDX-License-Identifier: Apache-2.0 */
/* words.h: the words of a program's command line as one table, which is parsed, and printed as
 * --help, as a man page and as the completions of bash.
 *
 * Beside the table's every program takes --help, -h, --version, and for packagers --print-man and
 * --print-completion. A word that is no option is an operand: a file. */
#ifndef WORDS_H
#define WORDS_H

#include <mhe/abi.h>

#define WORDS_FLAG 0  /* int32_t becomes `low` */
#define WORDS_TEXT 1  /* const char *, lent */
#define WORDS_LIST 2  /* words_list: one more each time */
#define WORDS_INT 3   /* int32_t, low .. high */
#define WORDS_OTHER 4 /* `take` reads it */

typedef struct words_list {
    const char **values; /* [n], point into argv */
    int32_t n;
} words_list;

/* Ways to read an option's value into the field at `target`. */
typedef mhe_status words_take(const char *word, const char *value, void *target, mhe_error *err);

typedef struct words_option {
    const char *name;  /* "--out" */
    const char *value; /* what stands behind it, "DIR" or "FILE" of names, "path.to.key=value";
                        * NULL: nothing */
    const char *help;  /* part of a sentence */
    uint32_t commands; /* bit i: command i takes it; 0: all do */
    int32_t kind;      /* WORDS_* */
    size_t at;         /* place in the program's struct */
    int32_t low, high;
    words_take *take;
    int32_t mode; /* not 0: the program's `mode` becomes this */
} words_option;

/* Options that several programs have, in the same words: the field `at` of the program's struct,
 * the commands `which` (0: all). `of`: what the keys are of, "config"; `is`: what the folder is
 * for; `what`: what is not printed. */
#define WORDS_SET(of, which, place)                                                      \
    {                                                                                    \
        .name = "--set", .value = "path.to.key=value",                                   \
        .help = "replaces a key of the " of "; may be given often", .commands = (which), \
        .kind = WORDS_LIST, .at = (place)                                                \
    }
#define WORDS_OUT(is, which, place)                                                             \
    {                                                                                           \
        .name = "--out", .value = "DIR", .help = (is), .commands = (which), .kind = WORDS_TEXT, \
        .at = (place)                                                                           \
    }
#define WORDS_QUIET(what, place) \
    { .name = "--quiet", .help = "no " what, .kind = WORDS_FLAG, .at = (place), .low = 1 }
#define WORDS_TRUST(place)                                                                    \
    {                                                                                         \
        .name = "--trust",                                                                    \
        .help = "the config may name folders of plugins (plugin_path), whose code then runs", \
        .kind = WORDS_FLAG, .at = (place), .low = 1                                           \
    }

typedef struct words_command {
    const char *name;    /* "run"; "" of a program without commands */
    const char *operand; /* "CONFIG.yaml", what the command is about; NULL: none */
    const char *what;    /* "config file", in messages */
    const char *help;    /* one sentence */
    int32_t most;        /* operands; the first goes to `operand`, others to `others` */
    const char *missing; /* message where there is none; NULL: "no <what> is given; ..." */
} words_command;

typedef struct words_program {
    const char *name, *summary;
    const char *usage; /* lines, two blanks before each */
    const char *notes; /* lines behind the options */
    const words_command *commands;
    int32_t n_commands;
    const words_option *options;
    int32_t n_options;
    size_t mode;    /* place of an int32_t in the program's struct, 0 unless an option sets it */
    size_t operand; /* of a const char * */
    size_t others;  /* of a words_list */
    /* Bit i: mode i needs no operand. */
    uint32_t modes_without;
} words_program;

/* What parsing came to. */
#define WORDS_RUN 0      /* the command may begin */
#define WORDS_ANSWERED 1 /* --help, --version, --print-...: it was printed */
#define WORDS_HELP 2     /* --help of a command, which the program may answer in more detail */

/* Reads the command line into `result`, the program's struct, which is zero or holds defaults.
 * `*command`: which one, 0 where there is one only. Lists are given back with words_free, also
 * after a failure. MHE_E_ARGUMENT: `err` says which word is wrong and which is nearest. */
mhe_status words_parse(const words_program *program, int argc, char **argv, void *result,
                       int32_t *command, int32_t *outcome, mhe_error *err);
void words_free(const words_program *program, void *result);

/* words_print.c */
void words_help(const words_program *program);
void words_man(const words_program *program);
void words_completion(const words_program *program);
/* 1: the option belongs to the command. */
int32_t words_takes(const words_option *option, int32_t command);

#endif

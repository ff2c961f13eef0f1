/* SPDX-License-Identifier: Apache-2.0 */
/* words_print.c: the table of words as help, man page and completion. */
#include "words.h"

#include <mhe/version.h>
#include <string.h>

#define COLUMN 28 /* where the meaning of an option begins */
#define WIDTH 96

static int32_t has_commands(const words_program *p) {
    return p->commands[0].name[0] != '\0';
}

/* Words of a text from `column` on, broken at WIDTH and indented. */
static void fill(const char *text, int32_t column) {
    int32_t at = column;
    while (*text != '\0') {
        const size_t n = strcspn(text, " ");
        if (at + 1 + (int32_t)n > WIDTH && at > column) {
            (void)printf("\n%*s", (int)column, "");
            at = column;
        }
        at += (int32_t)n + (at > column);
        (void)printf("%s%.*s", at - (int32_t)n > column ? " " : "", (int)n, text);
        text += n + (text[n] == ' ');
    }
    (void)putchar('\n');
}

static void print_left(const char *name, const char *value) {
    int n = printf("  %s%s%s", name, value != NULL ? " " : "", value != NULL ? value : "");
    if (n >= COLUMN) {
        (void)putchar('\n');
        n = 0;
    }
    (void)printf("%*s", COLUMN - n, "");
}

void words_help(const words_program *p) {
    (void)printf("%s\n\n%s\n", p->summary, p->usage);
    if (has_commands(p)) {
        for (int32_t i = 0; i < p->n_commands; i++) {
            print_left(p->commands[i].name, p->commands[i].operand);
            fill(p->commands[i].help, COLUMN);
        }
        (void)putchar('\n');
    }
    for (int32_t i = 0; i < p->n_options; i++) {
        print_left(p->options[i].name, p->options[i].value);
        fill(p->options[i].help, COLUMN);
    }
    (void)printf("\n%s", p->notes);
}

/* ---- man ---- */

/* Text as it may stand in roff. */
static void print_roff(const char *text) {
    int32_t at_begin = 1;
    for (; *text != '\0'; text++) {
        if (at_begin && (*text == '.' || *text == '\'')) {
            (void)fputs("\\&", stdout);
        }
        if (*text == '-') {
            (void)fputs("\\-", stdout);
        } else if (*text == '\\') {
            (void)fputs("\\e", stdout);
        } else {
            (void)putchar(*text);
        }
        at_begin = *text == '\n';
    }
}

static void print_entry(const char *name, const char *value, const char *help) {
    (void)fputs(".TP\n\\fB", stdout);
    print_roff(name);
    (void)fputs("\\fR", stdout);
    if (value != NULL) {
        (void)fputs(" \\fI", stdout);
        print_roff(value);
        (void)fputs("\\fR", stdout);
    }
    (void)putchar('\n');
    print_roff(help);
    (void)putchar('\n');
}

void words_man(const words_program *p) {
    (void)printf(".TH %s 1 \"\" \"Myohorizon %s\"\n.SH NAME\n", p->name, MHE_VERSION);
    print_roff(p->name);
    (void)fputs(" \\- ", stdout);
    print_roff(p->summary);
    (void)fputs("\n.SH SYNOPSIS\n.nf\n", stdout);
    print_roff(p->usage);
    (void)fputs(".fi\n", stdout);
    if (has_commands(p)) {
        (void)fputs(".SH COMMANDS\n", stdout);
        for (int32_t i = 0; i < p->n_commands; i++) {
            print_entry(p->commands[i].name, p->commands[i].operand, p->commands[i].help);
        }
    }
    (void)fputs(".SH OPTIONS\n", stdout);
    for (int32_t i = 0; i < p->n_options; i++) {
        print_entry(p->options[i].name, p->options[i].value, p->options[i].help);
    }
    (void)fputs(".SH NOTES\n", stdout);
    print_roff(p->notes);
}

/* ---- bash ---- */

/* What completes the word behind an option: folders, files, or nothing. */
static const char *completer(const words_option *o) {
    return strcmp(o->value, "DIR") == 0                                               ? "compgen -d"
           : strncmp(o->value, "FILE", 4) == 0 || strncmp(o->value, "CONFIG", 6) == 0 ? "compgen -f"
                                                                                      : "true";
}

static void print_words(const words_program *p, int32_t command) {
    for (int32_t i = 0; i < p->n_options; i++) {
        if (words_takes(&p->options[i], command)) {
            (void)printf("%s ", p->options[i].name);
        }
    }
    (void)fputs("--help --version", stdout);
}

void words_completion(const words_program *p) {
    char function[64]; /* one a program: they live in one shell */
    (void)snprintf(function, sizeof function, "%s", p->name);
    for (char *c = function; *c != '\0'; c++) {
        *c = *c == '-' ? '_' : *c;
    }
    (void)printf(
        "# bash completion of %s\n_%s() {\n"
        "    local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} words=\n"
        "    COMPREPLY=()\n    case $before in\n",
        p->name, function);
    for (int32_t i = 0; i < p->n_options; i++) {
        const words_option *o = &p->options[i];
        if (o->value != NULL) {
            (void)printf("    %s) mapfile -t COMPREPLY < <(%s -- \"$word\"); return ;;\n", o->name,
                         completer(o));
        }
    }
    (void)fputs("    esac\n", stdout);
    if (has_commands(p)) {
        (void)fputs("    if [ \"$COMP_CWORD\" -eq 1 ]; then\n        words='", stdout);
        for (int32_t i = 0; i < p->n_commands; i++) {
            (void)printf("%s ", p->commands[i].name);
        }
        (void)fputs("--help --version'\n    else\n        case ${COMP_WORDS[1]} in\n", stdout);
        for (int32_t i = 0; i < p->n_commands; i++) {
            (void)printf("        %s) words='", p->commands[i].name);
            print_words(p, i);
            (void)fputs("' ;;\n", stdout);
        }
        (void)fputs("        esac\n    fi\n", stdout);
    } else {
        (void)fputs("    words='", stdout);
        print_words(p, 0);
        (void)fputs("'\n", stdout);
    }
    (void)printf("    if [[ $word == -* || $COMP_CWORD -eq 1 && $words != --* ]]; then\n"
                 "        mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$word\")\n"
                 "    else\n        mapfile -t COMPREPLY < <(compgen -f -- \"$word\")\n    fi\n}\n"
                 "complete -o filenames -F _%s %s\n",
                 function, p->name);
}

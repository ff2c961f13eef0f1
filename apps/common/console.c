/* SPDX-License-Identifier: Apache-2.0 */
#include "console.h"

#include <mhe/version.h>
#include <signal.h>
#include <string.h>

static void log_line(const mhe_host *host, int32_t level, const char *text) {
    static const char *const names[] = {"error", "warning", "note", "debug"};
    if (level > MHE_LOG_WARNING) {
        return;
    }
    (void)fprintf(stderr, "%s: %s: ", (const char *)host->data, names[level]);
    for (; *text != '\0'; text++) { /* one line, and no orders to the terminal from a file */
        (void)fputc((unsigned char)*text < ' ' || *text == 127 ? '?' : *text, stderr);
    }
    (void)fputc('\n', stderr);
}

static const void *no_service(const mhe_host *host, const char *id) {
    (void)host, (void)id;
    return NULL;
}

mhe_host console_host(const char *program) {
    (void)signal(SIGXFSZ, SIG_IGN); /* a file at its limit is a failed write, which is told */
    union {
        const char *text;
        void *data;
    } name = {.text = program}; /* the host hands it back as const */
    return (mhe_host){
        .size = sizeof(mhe_host), .data = name.data, .log = log_line, .service = no_service};
}

static int exit_status(mhe_status status) {
    switch (status) {
    case MHE_OK:
        return 0;
    case MHE_E_ARGUMENT:
    case MHE_E_CONFIG:
    case MHE_E_INPUT:
    case MHE_E_PLUGIN:
    case MHE_E_UNSUPPORTED:
        return 2;
    default:
        return 1;
    }
}

int console_end(const char *program, mhe_status status, mhe_error *err) {
    if (status == MHE_OK && fflush(stdout) != 0) {
        status = mhe_fail(err, MHE_E_IO, "the output could not be written");
    }
    if (status != MHE_OK) {
        (void)fprintf(stderr, "%s: %s\n", program, err->text);
    }
    return exit_status(status);
}

mhe_status console_print(mhi_text *text, mhe_error *err) {
    mhe_status status = MHE_OK;
    if (text->failed || (text->data != NULL && fputs(text->data, stdout) == EOF)) {
        status = mhe_fail(err, MHE_E_IO, "the output could not be written");
    }
    mhi_text_free(text);
    return status;
}

mhe_status console_value(int argc, char **argv, int *i, const char **value, mhe_error *err) {
    if (*i + 1 >= argc || argv[*i + 1][0] == '\0') {
        return mhe_fail(err, MHE_E_ARGUMENT, "%s needs a value", argv[*i]);
    }
    *value = argv[++*i];
    return MHE_OK;
}

mhe_status console_config(const char *word, const char *const *options, int32_t n,
                          const char **config, mhe_error *err) {
    char hint[256];
    if (word[0] == '-' && word[1] != '\0') {
        return mhe_fail(err, MHE_E_ARGUMENT, "unknown option '%s'%s", word,
                        mhi_suggest(hint, sizeof hint, word, options, n));
    }
    if (*config != NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT, "one config file at a time: '%s' and '%s'", *config,
                        word);
    }
    *config = word;
    return MHE_OK;
}

mhe_status console_command(const char *program, const char *help, const char *const *names,
                           int32_t n, const char *word, int32_t *chosen, mhe_error *err) {
    char hint[256];
    *chosen = -1;
    for (int32_t i = 0; i < n && word != NULL; i++) {
        *chosen = strcmp(word, names[i]) == 0 ? i : *chosen;
    }
    if (*chosen >= 0) {
        return MHE_OK;
    }
    if (word != NULL && strcmp(word, "--version") == 0) {
        (void)printf("%s %s\n", program, MHE_VERSION);
        return MHE_OK;
    }
    if (word != NULL && (strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0)) {
        (void)fputs(help, stdout);
        return MHE_OK;
    }
    (void)mhi_suggest(hint, sizeof hint, word == NULL ? "" : word, names, n);
    return word == NULL ? mhe_fail(err, MHE_E_ARGUMENT, "no command is given%s", hint)
                        : mhe_fail(err, MHE_E_ARGUMENT, "unknown command '%s'%s", word, hint);
}

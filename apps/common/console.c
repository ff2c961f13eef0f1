/* SPDX-License-Identifier: Apache-2.0 */
#include "console.h"

#include <signal.h>

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

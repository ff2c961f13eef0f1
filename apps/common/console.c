/* SPDX-License-Identifier: Apache-2.0 */
#include "console.h"

static void log_line(const mhe_host *host, int32_t level, const char *text) {
    static const char *const names[] = {"error", "warning", "note", "debug"};
    if (level <= MHE_LOG_WARNING) {
        (void)fprintf(stderr, "%s: %s: %s\n", (const char *)host->data, names[level], text);
    }
}

static const void *no_service(const mhe_host *host, const char *id) {
    (void)host, (void)id;
    return NULL;
}

mhe_host console_host(const char *program) {
    union {
        const char *text;
        void *data;
    } name = {.text = program}; /* the host hands it back as const */
    return (mhe_host){
        .size = sizeof(mhe_host), .data = name.data, .log = log_line, .service = no_service};
}

int console_exit_status(mhe_status status) {
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

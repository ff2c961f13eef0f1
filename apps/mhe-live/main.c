/* SPDX-License-Identifier: Apache-2.0 */
/* mhe-live: estimates from streams as they come, and hands them on. */
#include "console.h"

#include <mhe/library.h>
#include <mhe/live.h>
#include <mhe/version.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static const char help[] =
    "usage: mhe-live CONFIG.yaml [options]\n"
    "Estimates joint angles, activations and muscle forces from live streams. The config is that "
    "of\n"
    "mhe-run with two more sections: `sources`, where data come from, and `sinks`, where "
    "estimates\n"
    "go. Ctrl-C ends the run; its summary is printed as JSON.\n"
    "  --set PATH.KEY=VALUE  change a value of the config; may be repeated\n"
    "  --record FILE.xdf     record everything that comes, so that the run can be repeated\n"
    "  --for SECONDS         end after so many seconds of estimates\n"
    "  --wait SECONDS        give up when the streams are not there by then\n"
    "  --out DIR             folder for recordings and maximal contractions (default: .)\n"
    "  --quiet               no summary\n"
    "  --help, --version\n";

static mhe_live *running; /* for the signal handler; set before it is installed */

static void on_signal(int number) {
    (void)number;
    mhe_live_stop(running);
}

typedef struct words {
    const char *config, *record, *out;
    const char **set;
    int32_t n_set, quiet;
    double seconds, wait;
} words;

static mhe_status number(const char *option, const char *text, double *value, mhe_error *err) {
    char *rest = NULL;
    *value = strtod(text, &rest);
    return rest != text && *rest == '\0' && *value > 0
               ? MHE_OK
               : mhe_fail(err, MHE_E_ARGUMENT, "%s %s: a number of seconds above 0 is needed",
                          option, text);
}

static mhe_status parse(int argc, char **argv, words *w, mhe_error *err) {
    static const char *const options[] = {"--set", "--record", "--for",  "--wait",
                                          "--out", "--quiet",  "--help", "--version"};
    const int32_t n = (int32_t)(sizeof options / sizeof *options);
    mhe_status status = MHE_OK;
    for (int i = 1; i < argc && status == MHE_OK; i++) {
        const char *word = argv[i], *value = NULL;
        if (strcmp(word, "--quiet") == 0) {
            w->quiet = 1;
        } else if (strcmp(word, "--set") == 0) {
            status = console_value(argc, argv, &i, &w->set[w->n_set], err);
            w->n_set += status == MHE_OK;
        } else if (strcmp(word, "--record") == 0) {
            status = console_value(argc, argv, &i, &w->record, err);
        } else if (strcmp(word, "--out") == 0) {
            status = console_value(argc, argv, &i, &w->out, err);
        } else if (strcmp(word, "--for") == 0 || strcmp(word, "--wait") == 0) {
            status = console_value(argc, argv, &i, &value, err);
            if (status == MHE_OK) {
                status = number(word, value, word[2] == 'f' ? &w->seconds : &w->wait, err);
            }
        } else {
            status = console_config(word, options, n, &w->config, err);
        }
    }
    if (status == MHE_OK && w->config == NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT, "a config file is needed: mhe-live CONFIG.yaml");
    }
    return status;
}

static void on_log(const mhe_host *host, int32_t level, const char *text) {
    (void)host;
    const char *kind = level == MHE_LOG_ERROR     ? "error: "
                       : level == MHE_LOG_WARNING ? "warning: "
                                                  : "";
    if (level <= MHE_LOG_INFO) {
        (void)fprintf(stderr, "mhe-live: %s%s\n", kind, text);
    }
}

static const void *no_service(const mhe_host *host, const char *id) {
    (void)host, (void)id;
    return NULL;
}

static mhe_status print_summary(mhe_live *live, mhe_error *err) {
    char *json = NULL;
    const mhe_status status = mhe_live_summary(live, &json, err);
    if (status == MHE_OK) {
        (void)printf("%s\n", json);
    }
    mhe_free(json);
    return status;
}

static mhe_status run(const words *w, mhe_error *err) {
    const mhe_host host = {.size = sizeof host, .log = on_log, .service = no_service};
    mhe_config *config = NULL;
    mhe_status status = mhe_config_read(w->config, w->set, w->n_set, &host, &config, err);
    if (status == MHE_OK && w->out != NULL && mkdir(w->out, 0777) != 0) {
        struct stat about;
        if (stat(w->out, &about) != 0 || !S_ISDIR(about.st_mode)) {
            status = mhe_fail(err, MHE_E_IO, "%s: is no folder and cannot be made", w->out);
        }
    }
    const mhe_live_setup setup = {
        .size = sizeof setup, .folder = w->out, .record = w->record, .wait = w->wait};
    if (status == MHE_OK) {
        status = mhe_live_open(config, &setup, &running, err);
    }
    if (status == MHE_OK) {
        const struct sigaction action = {.sa_handler = on_signal, .sa_flags = (int)SA_RESETHAND};
        (void)sigaction(SIGINT, &action, NULL);
        (void)sigaction(SIGTERM, &action, NULL);
        status = mhe_live_run(running, w->seconds, err);
        if (status == MHE_OK && !w->quiet) {
            status = print_summary(running, err);
        }
        (void)signal(SIGINT, SIG_DFL);
        (void)signal(SIGTERM, SIG_DFL);
    }
    mhe_live_close(running);
    mhe_config_close(config);
    return status;
}

int main(int argc, char **argv) {
    words w = {0};
    mhe_error err = {0};
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--help") == 0) {
            (void)fputs(help, stdout);
            return 0;
        }
        if (strcmp(argv[i], "--version") == 0) {
            (void)printf("mhe-live %s\n", MHE_VERSION);
            return 0;
        }
    }
    w.set = calloc((size_t)argc, sizeof *w.set);
    mhe_status status =
        w.set == NULL ? mhe_fail(&err, MHE_E_MEMORY, "out of memory") : parse(argc, argv, &w, &err);
    if (status == MHE_OK) {
        status = run(&w, &err);
    }
    free((void *)w.set);
    return console_end("mhe-live", status, &err);
}

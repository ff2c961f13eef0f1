/* SPDX-License-Identifier: Apache-2.0 */
/* mhe-live: estimates from streams as they come, and hands them on. */
#include "console.h"
#include "view.h"
#include "view_serve.h"
#include "words.h"

#include <mhe/library.h>
#include <mhe/live.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

static mhe_live *running; /* for the signal handler; set before it is installed */

static void on_signal(int number) {
    (void)number;
    mhe_live_stop(running);
}

typedef struct arguments {
    const char *config, *record, *out, *view;
    words_list set, others;
    int32_t mode, quiet, trust;
    double seconds, wait;
} arguments;

static mhe_status read_seconds(const char *word, const char *value, void *target, mhe_error *err) {
    double *seconds = target;
    char *rest = NULL;
    *seconds = strtod(value, &rest);
    return rest != value && *rest == '\0' && *seconds > 0 && *seconds < 1e9
               ? MHE_OK
               : mhe_fail(err, MHE_E_ARGUMENT, "%s %s: a number of seconds above 0 is needed", word,
                          value);
}

static const words_command commands[] = {
    {.name = "", .operand = "CONFIG.yaml", .what = "config file", .most = 1}};
#define AT(field) offsetof(arguments, field)
#define VIEW 1 /* mode */

static const words_option options[] = {
    WORDS_SET("config", 0, AT(set)),
    {.name = "--record",
     .value = "FILE.xdf",
     .help = "records everything that comes, so that the run can be repeated",
     .kind = WORDS_TEXT,
     .at = AT(record)},
    {.name = "--for",
     .value = "SECONDS",
     .help = "ends after so many seconds of estimates",
     .kind = WORDS_OTHER,
     .at = AT(seconds),
     .take = read_seconds},
    {.name = "--wait",
     .value = "SECONDS",
     .help = "gives up when the streams are not there by then",
     .kind = WORDS_OTHER,
     .at = AT(wait),
     .take = read_seconds},
    {.name = "--view",
     .value = "DIR",
     .help = "shows a folder of results of mhe-run (or tables of mhe.sink.files) on the page",
     .kind = WORDS_TEXT,
     .at = AT(view),
     .mode = VIEW},
    WORDS_OUT("folder of recordings, tables and maximal contractions; this one unless given", 0,
              AT(out)),
    WORDS_QUIET("summary", AT(quiet)),
    WORDS_TRUST(AT(trust))};

static const words_program program = {
    .name = "mhe-live",
    .summary = "Estimates joint angles, activations and muscle forces from live streams.",
    .usage = "  mhe-live CONFIG.yaml [--record FILE.xdf] [--for SECONDS] [--wait SECONDS] [--out "
             "DIR]\n"
             "           [--set path.to.key=value]... [--quiet] [--trust]\n"
             "  mhe-live [CONFIG.yaml] --view DIR\n"
             "  mhe-live --version | --help\n",
    .notes =
        "The config is that of mhe-run with two more sections: 'sources', where data come from, "
        "and\n'sinks', where estimates go. Ctrl-C ends the run; its summary is printed as "
        "JSON.\n--view prints the address of a page with the results, for browsers of this "
        "machine; "
        "its stick figure is of\nDIR/config.yaml, or of CONFIG.yaml. Lines on the standard input: "
        "record-start, record-stop, mvc-start ELECTRODE, "
        "mvc-stop, "
        "label CAME=MODEL,\nstate, stop.\nExit status: 0 done; 1 the run failed; 2 the command "
        "line, the configuration or "
        "a file is wrong.\n",
    .commands = commands,
    .n_commands = 1,
    .options = options,
    .n_options = sizeof options / sizeof options[0],
    .mode = AT(mode),
    .operand = AT(config),
    .others = AT(others),
    .modes_without = 1u << VIEW};

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

/* ---- lines of the standard input ---- */

static atomic_int listening;

/* In the background a terminal's input belongs to somebody else; to read it would stop the program.
 */
static int is_ours(void) {
    return !isatty(STDIN_FILENO) || tcgetpgrp(STDIN_FILENO) == getpgrp();
}

static void obey(const char *line) {
    mhe_error err = {0};
    char *json = NULL;
    if (strcmp(line, "state") == 0) {
        if (mhe_live_state(running, &json, &err) == MHE_OK) {
            (void)printf("%s\n", json);
            (void)fflush(stdout);
        }
        mhe_free(json);
    } else if (line[0] != '\0' && mhe_live_command(running, line, &err) != MHE_OK) {
        (void)fprintf(stderr, "mhe-live: %s\n", err.text);
    }
}

static void *listen_to_lines(void *data) {
    char text[1024];
    size_t n = 0;
    (void)data;
    while (atomic_load(&listening)) {
        struct pollfd input = {.fd = STDIN_FILENO, .events = POLLIN};
        if (!is_ours() || poll(&input, 1, 100) <= 0) {
            const struct timespec pause = {0, 50000000};
            (void)nanosleep(&pause, NULL);
            continue;
        }
        const ssize_t got = read(STDIN_FILENO, text + n, sizeof text - 1 - n);
        if (got <= 0) {
            return NULL; /* nobody will say anything any more */
        }
        n += (size_t)got;
        text[n] = '\0';
        for (char *end = strchr(text, '\n'); end != NULL; end = strchr(text, '\n')) {
            *end = '\0';
            obey(text);
            n -= (size_t)(end + 1 - text);
            memmove(text, end + 1, n + 1);
        }
        n = n == sizeof text - 1 ? 0 : n; /* no line is that long */
    }
    return NULL;
}

static mhe_status run_listening(const arguments *w, mhe_error *err) {
    pthread_t thread;
    atomic_store(&listening, 1);
    const int started = pthread_create(&thread, NULL, listen_to_lines, NULL) == 0;
    const mhe_status status = mhe_live_run(running, w->seconds, err);
    atomic_store(&listening, 0);
    if (started) {
        (void)pthread_join(thread, NULL);
    }
    return status;
}

static mhe_status run(const arguments *w, mhe_error *err) {
    const mhe_host host = {.size = sizeof host, .log = on_log, .service = no_service};
    mhe_config *config = NULL;
    mhe_status status = mhe_config_read(w->config, w->set.values, w->set.n,
                                        w->trust ? MHE_CONFIG_TRUST : 0, &host, &config, err);
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
        status = run_listening(w, err);
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

/* ---- results ---- */

static volatile sig_atomic_t seen; /* enough of them */

static void on_enough(int number) {
    (void)number;
    seen = 1;
}

static void tell_address(const char *address) {
    (void)printf("%s\n", address);
    (void)fflush(stdout);
}

/* The config of the figure: the one that is named, which must be right, else the one in the folder,
 * without which the page has no figure. */
static mhe_status read_figure(const arguments *w, const mhe_host *host, mhe_config **config,
                              mhe_error *err) {
    char path[4096];
    const uint32_t flags = w->trust ? MHE_CONFIG_TRUST : 0;
    if (w->config != NULL) {
        return mhe_config_read(w->config, w->set.values, w->set.n, flags, host, config, err);
    }
    mhe_error why = {0};
    const int n = snprintf(path, sizeof path, "%s/config.yaml", w->view);
    if (n > 0 && (size_t)n < sizeof path && access(path, R_OK) == 0 &&
        mhe_config_read(path, NULL, 0, flags, host, config, &why) != MHE_OK) {
        (void)fprintf(stderr, "mhe-live: the page has no stick figure: %s\n", why.text);
    }
    return MHE_OK;
}

static mhe_status view(const arguments *w, mhe_error *err) {
    const mhe_host host = {.size = sizeof host, .log = on_log, .service = no_service};
    const struct sigaction action = {.sa_handler = on_enough};
    mhe_config *config = NULL;
    mhi_text page = {0};
    mhe_status status = read_figure(w, &host, &config, err);
    const view_setup setup = {.dir = w->view, .config = config};
    status = status == MHE_OK ? view_compose(&setup, &page, err) : status;
    mhe_config_close(config);
    if (status == MHE_OK) {
        (void)sigaction(SIGINT, &action, NULL);
        (void)sigaction(SIGTERM, &action, NULL);
        status = view_serve(page.data, page.length, tell_address, &seen, err);
    }
    mhi_text_free(&page);
    return status;
}

int main(int argc, char **argv) {
    arguments a = {0};
    mhe_error err = {0};
    int32_t command = 0, outcome = WORDS_RUN;
    mhe_status status = words_parse(&program, argc, argv, &a, &command, &outcome, &err);
    if (status == MHE_OK && outcome == WORDS_RUN) {
        status = a.mode == VIEW ? view(&a, &err) : run(&a, &err);
    }
    words_free(&program, &a);
    return console_end("mhe-live", status, &err);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* mhe-sim: simulated motions. */
#include "console.h"
#include "motion.h"

#include <mhe/version.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char help[] =
    "Simulates motions of a musculoskeletal model; CVODES carries the state.\n"
    "\n"
    "  mhe-sim forward CONFIG.yaml --input EXCITATIONS.sto [options]\n"
    "  mhe-sim follow CONFIG.yaml --input POSTURES.sto [options]\n"
    "  mhe-sim --version | --help\n"
    "\n"
    "forward: from the config's initial state under the excitations of the file (one column a "
    "muscle, linear\n"
    "between rows). follow: through the postures of the file (one column a coordinate, a "
    "minimum-jerk path\n"
    "from row to row) with muscle controls that the config's costs and solver find on the way.\n"
    "\n"
    "Both write reference.sto (the truth), markers.trc and emg.sto.\n"
    "  --out DIR                 default ./out/<config name>-sim\n"
    "  --rate HZ                 rows a second, default 100\n"
    "  --set path.to.key=value   overrides the config\n"
    "Exit status: 0 done; 1 failed; 2 the command line or an input is wrong.\n";

typedef struct arguments {
    const char *config, *input, *out;
    const char **set;
    int32_t n_set;
    double rate;
} arguments;

static const char *const words[] = {"forward", "follow", "--input",   "--rate",
                                    "--out",   "--set",  "--version", "--help"};

static mhe_status parse(int argc, char **argv, arguments *a, mhe_error *err) {
    for (int i = 2; i < argc; i++) {
        const char *word = argv[i];
        char hint[256];
        if (word[0] != '-') {
            a->config = word;
            continue;
        }
        if (i + 1 >= argc) {
            return mhe_fail(err, MHE_E_ARGUMENT, "%s needs a value", word);
        }
        const char *value = argv[++i];
        if (strcmp(word, "--input") == 0) {
            a->input = value;
        } else if (strcmp(word, "--out") == 0) {
            a->out = value;
        } else if (strcmp(word, "--set") == 0) {
            a->set[a->n_set++] = value;
        } else if (strcmp(word, "--rate") == 0) {
            char *end = NULL;
            a->rate = strtod(value, &end);
            if (*end != '\0' || !(a->rate > 0 && a->rate <= 1e5)) {
                return mhe_fail(err, MHE_E_ARGUMENT,
                                "--rate '%s': a number of Hz above 0 is needed", value);
            }
        } else {
            return mhe_fail(
                err, MHE_E_ARGUMENT, "unknown option '%s'%s", word,
                mhi_suggest(hint, sizeof hint, word, words, sizeof words / sizeof words[0]));
        }
    }
    if (a->config == NULL || a->input == NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT,
                        "a config file and --input are needed; 'mhe-sim --help'");
    }
    return MHE_OK;
}

typedef mhe_status (*motion)(const motion_setup *setup, mhe_error *err);

static mhe_status run(motion move, int argc, char **argv, mhe_error *err) {
    const mhe_host host = console_host("mhe-sim");
    arguments a = {.rate = 100, .set = calloc((size_t)argc, sizeof(char *))};
    mhi_registry *registry = NULL;
    mhi_run *config = NULL;
    mhe_status status =
        a.set == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : parse(argc, argv, &a, err);
    if (status == MHE_OK) {
        status = mhi_registry_create(&host, &registry, err);
    }
    if (status == MHE_OK) {
        status = mhi_run_read(a.config, a.set, a.n_set, registry, &config, err);
    }
    if (status == MHE_OK) {
        mhi_text out = {0};
        mhi_text_add(&out, "%s%s%s", a.out != NULL ? a.out : "out/",
                     a.out != NULL ? "" : config->name, a.out != NULL ? "" : "-sim");
        const motion_setup setup = {config, &host, registry, a.input, a.rate, out.data};
        status = out.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : move(&setup, err);
        if (status == MHE_OK) {
            (void)printf("results in %s\n", out.data);
        }
        mhi_text_free(&out);
    }
    mhi_run_free(config);
    mhi_registry_free(registry);
    free(a.set);
    return status;
}

int main(int argc, char **argv) {
    mhe_error err = {0};
    mhe_status status = MHE_OK;
    if (argc >= 2 && strcmp(argv[1], "forward") == 0) {
        status = run(motion_forward, argc, argv, &err);
    } else if (argc >= 2 && strcmp(argv[1], "follow") == 0) {
        status = run(motion_follow, argc, argv, &err);
    } else if (argc >= 2 && strcmp(argv[1], "--version") == 0) {
        (void)printf("mhe-sim %s\n", MHE_VERSION);
    } else if (argc >= 2 && strcmp(argv[1], "--help") == 0) {
        (void)fputs(help, stdout);
    } else {
        char hint[256];
        status = mhe_fail(&err, MHE_E_ARGUMENT, "%s'%s'%s",
                          argc >= 2 ? "unknown command " : "no command ", argc >= 2 ? argv[1] : "",
                          mhi_suggest(hint, sizeof hint, argc >= 2 ? argv[1] : "", words, 2));
    }
    if (status != MHE_OK) {
        (void)fprintf(stderr, "mhe-sim: %s\n", err.text);
    }
    return console_exit_status(status);
}

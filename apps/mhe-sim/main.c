/* SPDX-License-Identifier: Apache-2.0 */
/* mhe-sim: simulated motions, and what instruments would record of them. */
#include "arguments.h"
#include "console.h"
#include "motion.h"
#include "noise.h"
#include "reference.h"

#include <stdio.h>

/* What a command is run with. */
typedef struct call {
    const arguments *arguments;
    const mhe_host *host;
    mhi_registry *registry;
} call;

static mhe_status run_motion(const call *c, mhe_status (*move)(const motion_setup *, mhe_error *),
                             mhe_error *err) {
    const arguments *a = c->arguments;
    mhi_run *config = NULL;
    char out[4096];
    if (a->input == NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT,
                        "a config file and --input are needed; 'mhe-sim --help'");
    }
    mhe_status status = mhi_run_read(a->config, a->set.values, a->set.n, c->registry, &config, err);
    if (status == MHE_OK) {
        status = arguments_folder(a, config->name, "-sim", out, sizeof out, err);
    }
    if (status == MHE_OK) {
        const motion_setup setup = {config, c->host, c->registry, a->input, a->rate, out};
        status = move(&setup, err);
    }
    if (status == MHE_OK) {
        (void)printf("results in %s\n", out);
    }
    mhi_run_free(config);
    return status;
}

static mhe_status run_forward(const call *c, mhe_error *err) {
    return run_motion(c, motion_forward, err);
}

static mhe_status run_follow(const call *c, mhe_error *err) {
    return run_motion(c, motion_follow, err);
}

static mhe_status run_noise(const call *c, mhe_error *err) {
    const arguments *a = c->arguments;
    mhi_noise_config config;
    char out[4096];
    mhe_status status =
        mhi_noise_config_read(a->config, a->set.values, a->set.n, c->registry, &config, err);
    if (status == MHE_OK) {
        status = arguments_folder(a, config.run->name, "", out, sizeof out, err);
    }
    if (status == MHE_OK) {
        status = noise_record(&config, c->host, out, err);
    }
    if (status == MHE_OK) {
        (void)printf("results in %s\n", out);
    }
    mhi_noise_config_free(&config);
    return status;
}

static mhe_status run_reference(const call *c, mhe_error *err) {
    const arguments *a = c->arguments;
    const reference_setup setup = {a->config,   a->set.values, a->set.n,    c->host,
                                   c->registry, a->out,        !a->no_cache};
    return reference_run(&setup, err);
}

static mhe_status help_reference(mhe_error *err) {
    mhi_text text = {0};
    reference_describe(&text);
    (void)fputs("mhe-sim reference CONFIG.yaml [--out DIR] [--set path.to.key=value]... "
                "[--no-cache]\n\n"
                "The config has a list 'steps' in place of 'costs'; each step has a list 'costs' "
                "and may have a\nlist 'bounds'.\n\n",
                stdout);
    return console_print(&text, err);
}

static mhe_status help_motion(mhe_error *err) {
    (void)err;
    words_help(&arguments_program);
    return MHE_OK;
}

static mhe_status help_noise(mhe_error *err) {
    mhi_text text = {0};
    mhi_noise_config_describe(&text);
    (void)fputs("mhe-sim noise CONFIG.yaml [--out DIR] [--set path.to.key=value]...\n\n"
                "Keys of the config; 'model' is the section that mhe-run has too.\n\n",
                stdout);
    return console_print(&text, err);
}

static const struct command {
    mhe_status (*run)(const call *c, mhe_error *err);
    mhe_status (*help)(mhe_error *err);
} commands[] = {[COMMAND_FORWARD] = {run_forward, help_motion},
                [COMMAND_FOLLOW] = {run_follow, help_motion},
                [COMMAND_REFERENCE] = {run_reference, help_reference},
                [COMMAND_NOISE] = {run_noise, help_noise}};

int main(int argc, char **argv) {
    const mhe_host host = console_host("mhe-sim");
    arguments a = {.rate = 100};
    mhe_error err = {0};
    call c = {&a, &host, NULL};
    int32_t command = 0, outcome = WORDS_RUN;
    mhe_status status = words_parse(&arguments_program, argc, argv, &a, &command, &outcome, &err);
    if (status == MHE_OK && outcome == WORDS_HELP) {
        status = commands[command].help(&err);
    } else if (status == MHE_OK && outcome == WORDS_RUN) {
        status = mhi_registry_create(&host, &c.registry, &err);
        if (status == MHE_OK) {
            status = commands[command].run(&c, &err);
        }
    }
    mhi_registry_free(c.registry);
    words_free(&arguments_program, &a);
    return console_end("mhe-sim", status, &err);
}

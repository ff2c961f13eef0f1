/* SPDX-License-Identifier: Apache-2.0 */
/* mhe-sim: simulated motions, and what instruments would record of them. */
#include "arguments.h"
#include "console.h"
#include "motion.h"
#include "noise.h"
#include "reference.h"

#include <stdio.h>

static const char help[] =
    "Simulates motions of a musculoskeletal model (CVODES carries the state), and recordings.\n"
    "\n"
    "  mhe-sim forward CONFIG.yaml --input EXCITATIONS.sto [--rate HZ] [options]\n"
    "  mhe-sim follow CONFIG.yaml --input POSTURES.sto [--rate HZ] [options]\n"
    "  mhe-sim reference CONFIG.yaml [options]\n"
    "  mhe-sim noise CONFIG.yaml [options]\n"
    "  mhe-sim --version | --help\n"
    "\n"
    "forward: from the config's initial state under the excitations of the file (one column a\n"
    "muscle, linear between rows). follow: through the postures of the file (one column a\n"
    "coordinate, a minimum-jerk path from row to row) with muscle controls that the config's\n"
    "costs and solver find on the way. Both write reference.sto (the truth), markers.trc and\n"
    "emg.sto, HZ rows a second (default 100).\n"
    "\n"
    "reference: optimal motions, the config's steps one after the other; for every step with an\n"
    "output reference.sto, forces.sto, markers.trc and emg.sto in a folder of its own, and\n"
    "motion.svg that shows them all.\n"
    "'mhe-sim reference --help' shows every key of a step.\n"
    "A step that was solved before, from the same config, model, files and program, is read back\n"
    "from $XDG_CACHE_HOME/mhe (~/.cache/mhe), which may be deleted at any time; --no-cache\n"
    "solves all steps and keeps none.\n"
    "\n"
    "noise: markers.trc and emg.sto as instruments with errors would have recorded them of such\n"
    "a reference.sto; where the config has electrodes also recording.c3d, markers and raw EMG;\n"
    "noise.yaml says what was applied, noise.svg shows it.\n"
    "'mhe-sim noise --help' shows every key of its config.\n"
    "\n"
    "  --out DIR                 default ./out/<config name>; of a motion ./out/<config name>-sim\n"
    "  --set path.to.key=value   overrides the config\n"
    "Exit status: 0 done; 1 failed; 2 the command line or an input is wrong.\n";

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
    mhe_status status = mhi_run_read(a->config, a->set, a->n_set, c->registry, &config, err);
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
        mhi_noise_config_read(a->config, a->set, a->n_set, c->registry, &config, err);
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
    const reference_setup setup = {a->config,   a->set, a->n_set,    c->host,
                                   c->registry, a->out, !a->no_cache};
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
    (void)fputs(help, stdout);
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
    const char *name;
    int32_t takes; /* ARGUMENTS_* */
    mhe_status (*run)(const call *c, mhe_error *err);
    mhe_status (*help)(mhe_error *err);
} commands[] = {{"forward", ARGUMENTS_INPUT, run_forward, help_motion},
                {"follow", ARGUMENTS_INPUT, run_follow, help_motion},
                {"reference", ARGUMENTS_CACHE, run_reference, help_reference},
                {"noise", 0, run_noise, help_noise}};
#define N_COMMANDS ((int32_t)(sizeof commands / sizeof commands[0]))

static mhe_status run_command(const struct command *command, int argc, char **argv,
                              mhe_error *err) {
    const mhe_host host = console_host("mhe-sim");
    arguments a;
    call c = {&a, &host, NULL};
    mhe_status status = arguments_parse(argc, argv, command->takes, &a, err);
    if (status == MHE_OK && a.help) {
        status = command->help(err);
    } else if (status == MHE_OK) {
        status = mhi_registry_create(&host, &c.registry, err);
        if (status == MHE_OK) {
            status = command->run(&c, err);
        }
    }
    mhi_registry_free(c.registry);
    arguments_free(&a);
    return status;
}

int main(int argc, char **argv) {
    mhe_error err = {0};
    const char *names[N_COMMANDS];
    int32_t chosen;
    for (int32_t i = 0; i < N_COMMANDS; i++) {
        names[i] = commands[i].name;
    }
    mhe_status status = console_command("mhe-sim", help, names, N_COMMANDS,
                                        argc >= 2 ? argv[1] : NULL, &chosen, &err);
    if (chosen >= 0) {
        status = run_command(&commands[chosen], argc, argv, &err);
    }
    return console_end("mhe-sim", status, &err);
}

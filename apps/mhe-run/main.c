/* SPDX-License-Identifier: Apache-2.0 */
/* mhe-run: estimates joint angles, activations and muscle forces; asks plugins what they are. */
#include "arguments.h"
#include "batch.h"
#include "console.h"
#include "track.h"

#include <mhe/library.h>
#include <stdio.h>

static mhe_status show_plugins(const arguments *a, const mhe_host *host, mhe_error *err) {
    char *text = NULL;
    mhe_status status = a->mode == MODE_LIST
                            ? mhe_plugins_list(host, a->format, &text, err)
                            : mhe_plugins_describe(host, a->id, a->format, &text, err);
    if (status == MHE_OK && fputs(text, stdout) == EOF) {
        status = mhe_fail(err, MHE_E_IO, "the output could not be written");
    }
    mhe_free(text);
    return status;
}

static mhe_status run_config(const arguments *a, const mhe_host *host, mhe_error *err) {
    mhe_config *config = NULL;
    mhe_status status = mhe_config_read(a->config, a->set.values, a->set.n,
                                        a->trust ? MHE_CONFIG_TRUST : 0, host, &config, err);
    if (status != MHE_OK) {
        return status;
    }
    char folder[4096];
    int length = a->out != NULL
                     ? snprintf(folder, sizeof folder, "%s", a->out)
                     : snprintf(folder, sizeof folder, "out/%s", mhe_config_name(config));
    if (length < 0 || (size_t)length >= sizeof folder) {
        status = mhe_fail(err, MHE_E_ARGUMENT, "the path of the output folder is too long");
    } else {
        const track_setup setup = {.path = a->config,
                                   .config = config,
                                   .host = host,
                                   .out = folder,
                                   .quiet = a->quiet,
                                   .check_only = a->mode == MODE_CHECK,
                                   .realtime = a->realtime};
        status = track(&setup, err);
    }
    if (status == MHE_OK && a->mode == MODE_CHECK) {
        (void)printf("%s: ok\n", a->config);
    }
    mhe_config_close(config);
    return status;
}

int main(int argc, char **argv) {
    const mhe_host host = console_host("mhe-run");
    arguments a = {.shard = {0, 1}, .n_tasks = 16};
    mhe_error err = {0};
    int32_t command = 0, outcome = WORDS_RUN;
    mhe_status status = words_parse(&arguments_program, argc, argv, &a, &command, &outcome, &err);
    if (status == MHE_OK && outcome == WORDS_RUN) {
        status = a.mode == MODE_LIST || a.mode == MODE_DESCRIBE ? show_plugins(&a, &host, &err)
                 : a.mode == MODE_BATCH && a.engine != NULL     ? batch_submit(&a, &host, &err)
                 : a.mode == MODE_BATCH                         ? batch_run(&a, &host, &err)
                                                                : run_config(&a, &host, &err);
    }
    words_free(&arguments_program, &a);
    return console_end("mhe-run", status, &err);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* mhe-run: estimates joint angles, activations and muscle forces; asks plugins what they are. */
#include "arguments.h"
#include "console.h"
#include "track.h"

#include <mhe/version.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static mhe_status show_plugins(const arguments *a, mhi_registry *registry, mhe_error *err) {
    mhi_text text = {0};
    if (a->mode == MODE_LIST) {
        mhi_registry_list(registry, a->format, &text);
        return console_print(&text, err);
    }
    if (strcmp(a->id, "config") == 0) {
        mhi_run_describe(a->format, &text);
        return console_print(&text, err);
    }
    mhe_status status = mhi_registry_describe(registry, a->id, a->format, &text, err);
    if (status != MHE_OK) {
        mhi_text_free(&text);
        return status;
    }
    return console_print(&text, err);
}

static mhe_status run_config(const arguments *a, const mhe_host *host, mhi_registry *registry,
                             mhe_error *err) {
    mhi_run *run = NULL;
    mhe_status status = mhi_run_read(a->config, a->set, a->n_set, registry, &run, err);
    if (status != MHE_OK) {
        return status;
    }
    char folder[4096];
    int length = a->out != NULL ? snprintf(folder, sizeof folder, "%s", a->out)
                                : snprintf(folder, sizeof folder, "out/%s", run->name);
    if (length < 0 || (size_t)length >= sizeof folder) {
        status = mhe_fail(err, MHE_E_ARGUMENT, "the path of the output folder is too long");
    } else {
        const track_setup setup = {run, host, folder, a->quiet, a->mode == MODE_CHECK, a->realtime};
        status = track(&setup, err);
    }
    if (status == MHE_OK && a->mode == MODE_CHECK) {
        (void)printf("%s: ok\n", a->config);
    }
    mhi_run_free(run);
    return status;
}

int main(int argc, char **argv) {
    const mhe_host host = console_host("mhe-run");
    arguments a;
    mhe_error err = {0};
    mhi_registry *registry = NULL;
    mhe_status status = arguments_parse(argc, argv, &a, &err);
    if (status == MHE_OK && a.mode == MODE_HELP) {
        (void)fputs(arguments_help, stdout);
    } else if (status == MHE_OK && a.mode == MODE_VERSION) {
        (void)printf("mhe-run %s\n", MHE_VERSION);
    } else if (status == MHE_OK) {
        status = mhi_registry_create(&host, &registry, &err);
        if (status == MHE_OK) {
            mhi_registry_trust_files(registry, a.trust);
            status = a.mode == MODE_LIST || a.mode == MODE_DESCRIBE
                         ? show_plugins(&a, registry, &err)
                         : run_config(&a, &host, registry, &err);
        }
    }
    mhi_registry_free(registry);
    free(a.set);
    return console_end("mhe-run", status, &err);
}

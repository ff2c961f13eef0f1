/* SPDX-License-Identifier: Apache-2.0 */
/* mhe-bench: times every layer of the estimator and whole runs, variant against variant. */
#include "arguments.h"
#include "console.h"
#include "picture.h"
#include "report.h"
#include "scale.h"
#include <mhe/outbox.h>

#include <stdlib.h>

#define REPEATS 5
#define QUICK_REPEATS 2
#define QUICK_ESTIMATES 25

static mhe_status write_files(const arguments *a, const bench *b, const mhe_host *host,
                              mhe_error *err) {
    const mhi_run *run = b->setup->variants->list[0].run;
    char folder[4096];
    int length = a->out != NULL ? snprintf(folder, sizeof folder, "%s", a->out)
                                : snprintf(folder, sizeof folder, "out/%s", run->name);
    if (length < 0 || (size_t)length >= sizeof folder) {
        return mhe_fail(err, MHE_E_ARGUMENT, "the path of the output folder is too long");
    }
    mhi_text text = {0};
    mhe_outbox *outbox = NULL;
    mhe_status status = report_json(b, a->config, &text, err);
    if (status == MHE_OK && text.failed) {
        status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    if (status == MHE_OK) {
        status = mhe_outbox_open(folder, &outbox, err);
    }
    if (status == MHE_OK) {
        status = mhe_outbox_text(outbox, "bench.json", text.data, err);
    }
    if (status == MHE_OK && a->frames) {
        text.length = 0;
        report_frames(b, &text);
        status = text.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                             : mhe_outbox_text(outbox, "frames.csv", text.data, err);
    }
    if (status == MHE_OK) {
        status = mhe_outbox_commit(outbox, err);
    }
    mhe_outbox_close(outbox);
    mhi_text_free(&text);
    mhe_error why = {0};
    if (status == MHE_OK && run->output.picture && picture_rate(b, folder, &why) != MHE_OK) {
        host->log(host, MHE_LOG_WARNING, why.text);
    }
    if (status == MHE_OK) {
        (void)printf("results in %s\n", folder);
    }
    return status;
}

static mhe_status measure(const arguments *a, const variants *v, const mhe_host *host,
                          mhe_error *err) {
    const bench_setup setup = {.variants = v,
                               .host = host,
                               .repeats = a->repeats > 0 ? a->repeats
                                          : a->quick     ? QUICK_REPEATS
                                                         : REPEATS,
                               .estimates = a->quick ? QUICK_ESTIMATES : 0,
                               .no_layers = a->no_layers};
    bench *b = malloc(sizeof *b);
    if (b == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhi_text text = {0};
    mhe_status status = bench_measure(&setup, b, err);
    if (status == MHE_OK) {
        report_table(b, &text);
        status = console_print(&text, err);
    }
    if (status == MHE_OK) {
        status = write_files(a, b, host, err);
    }
    bench_free(b);
    free(b);
    return status;
}

static mhe_status run(const arguments *a, const mhe_host *host, mhe_error *err) {
    const char *const windows[] = {a->quick ? "horizon.window=3,7,15"
                                            : "horizon.window=2,3,5,7,10,15,22"};
    mhi_registry *registry = NULL;
    mhe_status status = mhi_registry_create(host, &registry, err);
    if (status != MHE_OK) {
        return status;
    }
    if (a->mode == 1 && (a->frames || a->vary.n > 0)) {
        status = mhe_fail(err, MHE_E_ARGUMENT, "--vary and --frames go with a config file");
    } else if (a->mode == 1) {
        status = scale_measure(a, registry, host, err);
    }
    if (a->mode == 1) {
        mhi_registry_free(registry);
        return status;
    }
    variants v;
    status =
        variants_read(a->config, a->set.values, a->set.n, a->vary.n > 0 ? a->vary.values : windows,
                      a->vary.n > 0 ? a->vary.n : 1, registry, &v, err);
    if (status == MHE_OK) {
        status = measure(a, &v, host, err);
    }
    variants_free(&v);
    mhi_registry_free(registry);
    return status;
}

int main(int argc, char **argv) {
    const mhe_host host = console_host("mhe-bench");
    arguments a = {0};
    mhe_error err = {0};
    int32_t command = 0, outcome = WORDS_RUN;
    mhe_status status = words_parse(&arguments_program, argc, argv, &a, &command, &outcome, &err);
    if (status == MHE_OK && outcome == WORDS_RUN) {
        status = run(&a, &host, &err);
    }
    words_free(&arguments_program, &a);
    return console_end("mhe-bench", status, &err);
}

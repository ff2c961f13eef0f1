/* SPDX-License-Identifier: Apache-2.0 */
/* sink_lsl.c: estimates as a stream of the Lab Streaming Layer. */
#include "../lsl_library.h"

#include <mhe/sink.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

struct sink_lsl_config { /* filled by the core from the option table */
    const char *name, *source_id, *library;
    mhe_text_list signals;
    double buffer;
};

typedef struct sink_lsl {
    struct sink_lsl_config config;
    lsl_library lsl;
    lsl_outlet outlet;
    double clock;     /* lsl_local_clock() - CLOCK_MONOTONIC */
    int32_t n_chosen; /* signals */
    int32_t *chosen;  /* their numbers in the run */
    int32_t *width;   /* [n_chosen] */
    double *sample;   /* [all widths + 3] */
    int32_t n_channels;
} sink_lsl;

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void sink_lsl_destroy(void *self) {
    sink_lsl *s = self;
    if (s->outlet != NULL) {
        s->lsl.destroy_outlet(s->outlet);
    }
    free(s->chosen);
    free(s->width);
    free(s->sample);
    free(s);
}

static mhe_status sink_lsl_create(const mhe_host *host, const void *config, void **self,
                                  mhe_error *err) {
    (void)host;
    sink_lsl *s = calloc(1, sizeof *s);
    if (s == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    s->config = *(const struct sink_lsl_config *)config;
    const mhe_status status = lsl_load(s->config.library, &s->lsl, err);
    if (status != MHE_OK) {
        free(s);
        return status;
    }
    s->clock = s->lsl.local_clock() - now();
    *self = s;
    return MHE_OK;
}

static const mhe_sink_signal *signal_at(const mhe_sink_run *run, int32_t i) {
    return (const mhe_sink_signal *)(const void *)((const char *)run->signals +
                                                   (size_t)i * run->signal_size);
}

static mhe_status choose(sink_lsl *s, const mhe_sink_run *run, mhe_error *err) {
    static const char *const usual[] = {"force", "activation", "q"};
    if (s->config.signals.n == 0) {
        s->config.signals = (mhe_text_list){usual, 3};
    }
    s->chosen = calloc((size_t)s->config.signals.n + 1, sizeof *s->chosen);
    s->width = calloc((size_t)s->config.signals.n + 1, sizeof *s->width);
    if (s->chosen == NULL || s->width == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t k = 0; k < s->config.signals.n; k++) {
        const char *name = s->config.signals.values[k];
        int32_t i = 0;
        while (i < run->n_signals && strcmp(signal_at(run, i)->name, name) != 0) {
            i++;
        }
        if (i == run->n_signals) {
            return mhe_fail(err, MHE_E_CONFIG, "signals: a run has no '%s'", name);
        }
        if (signal_at(run, i)->n > 0) {
            s->chosen[s->n_chosen] = i;
            s->width[s->n_chosen++] = signal_at(run, i)->n;
            s->n_channels += signal_at(run, i)->n;
        }
    }
    s->n_channels += 3; /* status, latency, lost */
    s->sample = calloc((size_t)s->n_channels, sizeof *s->sample);
    return s->sample == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
}

static void add_channel(const lsl_library *l, lsl_xml_ptr channels, const char *signal,
                        const char *label, const char *unit) {
    char text[256];
    (void)snprintf(text, sizeof text, "%s.%s", signal, label);
    lsl_xml_ptr channel = l->append_child(channels, "channel");
    (void)l->append_child_value(channel, "label", label[0] == '\0' ? signal : text);
    (void)l->append_child_value(channel, "unit", unit);
    (void)l->append_child_value(channel, "type", signal);
}

static mhe_status sink_lsl_open(void *self, const mhe_sink_run *run,
                                const mhe_sink_control *control, mhe_error *err) {
    (void)control;
    sink_lsl *s = self;
    const lsl_library *l = &s->lsl;
    mhe_status status = choose(s, run, err);
    if (status != MHE_OK) {
        return status;
    }
    lsl_streaminfo info = l->create_streaminfo(s->config.name, "Myohorizon", s->n_channels, 0,
                                               lsl_double64, s->config.source_id);
    if (info == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "liblsl makes no stream");
    }
    lsl_xml_ptr channels = l->append_child(l->get_desc(info), "channels");
    for (int32_t k = 0; k < s->n_chosen; k++) {
        const mhe_sink_signal *signal = signal_at(run, s->chosen[k]);
        for (int32_t i = 0; i < signal->n; i++) {
            add_channel(l, channels, signal->name, signal->labels[i], signal->unit);
        }
    }
    add_channel(l, channels, "status", "", "1");
    add_channel(l, channels, "latency", "", "s");
    add_channel(l, channels, "lost", "", "1");
    s->outlet = l->create_outlet(info, 0, (int32_t)ceil(s->config.buffer));
    l->destroy_streaminfo(info);
    return s->outlet == NULL ? mhe_fail(err, MHE_E_IO, "liblsl opens no outlet") : MHE_OK;
}

static mhe_status sink_lsl_take(void *self, const mhe_sink_sample *sample, mhe_error *err) {
    sink_lsl *s = self;
    double *at = s->sample;
    for (int32_t k = 0; k < s->n_chosen; k++) {
        memcpy(at, sample->values[s->chosen[k]], sizeof(double) * (size_t)s->width[k]);
        at += s->width[k];
    }
    at[0] = sample->status;
    at[1] = now() - sample->stamp;
    at[2] = (double)sample->lost;
    const int32_t code = s->lsl.push_sample_dtp(s->outlet, s->sample, sample->stamp + s->clock, 1);
    return code == lsl_no_error ? MHE_OK : mhe_fail(err, MHE_RETRY, "liblsl takes no sample");
}

static mhe_status sink_lsl_close(void *self, mhe_error *err) {
    (void)err;
    sink_lsl *s = self;
    if (s->outlet != NULL) {
        s->lsl.destroy_outlet(s->outlet);
        s->outlet = NULL;
    }
    return MHE_OK;
}

static const mhe_sink_ops sink_lsl_ops = {.size = sizeof sink_lsl_ops,
                                          .create = sink_lsl_create,
                                          .destroy = sink_lsl_destroy,
                                          .open = sink_lsl_open,
                                          .take = sink_lsl_take,
                                          .close = sink_lsl_close};

static const mhe_option sink_lsl_options[] = {
    MHE_OPT_TEXT(struct sink_lsl_config, name, 0, "Myohorizon", "Name of the stream."),
    MHE_OPT_TEXT(struct sink_lsl_config, source_id, MHE_OPT_ADVANCED, "myohorizon",
                 "By which receivers find it again after a restart."),
    MHE_OPT_TEXTS(struct sink_lsl_config, signals, 0,
                  "What it holds, in this order (force, activation, excitation, q, qdot, moment, "
                  "residual_torque, markers, emg); without: force, activation, q."),
    MHE_OPT_PATH(struct sink_lsl_config, library, MHE_OPT_ADVANCED,
                 "liblsl's file; without: the system's, else the one beside the plugin."),
    MHE_OPT_REAL(struct sink_lsl_config, buffer, 10, 1, 3600, "s",
                 "What is kept for a receiver that is slow."),
};

static const mhe_plugin sink_lsl_plugin = {
    .size = sizeof sink_lsl_plugin,
    .id = "mhe.sink.lsl",
    .version = "0.2.0",
    .summary = "Estimates as a stream of the Lab Streaming Layer.",
    .reference = "Kothe et al. 2024, doi:10.1101/2024.02.13.580071",
    .iface = MHE_SINK_IFACE,
    .ops = &sink_lsl_ops,
    MHE_PLUGIN_OPTIONS(struct sink_lsl_config, sink_lsl_options)};

MHE_PLUGIN_LIBRARY(&sink_lsl_plugin)

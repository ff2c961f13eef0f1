/* SPDX-License-Identifier: Apache-2.0 */
/* source_qualisys.c: markers and analog channels of Qualisys Track Manager, on its one clock. */
#include "qualisys.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* "Version set to 1.22"; or that it is not supported. */
static mhe_status set_version(qualisys *s, mhe_error *err) {
    rt_packet packet;
    size_t used = 0;
    mhe_status status = qualisys_ask(s, "Version 1.22", RT_COMMAND, &packet, &used, err);
    if (status == MHE_OK) {
        static const char good[] = "Version set to";
        status = packet.length >= sizeof good - 1 && memcmp(packet.body, good, sizeof good - 1) == 0
                     ? MHE_OK
                     : qualisys_says(&packet, MHE_RETRY, err);
        qualisys_drop(s, used);
    }
    return status;
}

/* The whole greeting up to a running stream. */
static mhe_status begin(qualisys *s, double deadline, mhe_error *err) {
    rt_packet packet;
    size_t used = 0;
    int same = 0;
    mhe_status status = qualisys_connect(s, deadline, err);
    if (status == MHE_OK) {
        status = qualisys_await(s, RT_COMMAND, qualisys_now() + ANSWER, &packet, &used,
                                err); /* its welcome */
    }
    if (status == MHE_OK) {
        qualisys_drop(s, used);
        status = set_version(s, err);
    }
    if (status == MHE_OK) {
        status = qualisys_ask_settings(s, &same, err);
    }
    if (status == MHE_OK) {
        status = qualisys_send(
            s, s->config.emg ? "StreamFrames AllFrames 3D Analog" : "StreamFrames AllFrames 3D",
            err);
    }
    s->heard = qualisys_now();
    s->unlike = s->differs = 0;
    if (status != MHE_OK) {
        qualisys_disconnect(s);
    }
    return status;
}

/* ---- the plugin's functions ---- */

static void qualisys_destroy(void *self) {
    qualisys *s = self;
    if (s->socket >= 0) {
        (void)qualisys_send(s, "StreamFrames Stop", NULL);
    }
    qualisys_disconnect(s);
    qualisys_free_axes(s, s->parameters.n_markers);
    rt_free_parameters(&s->parameters);
    free(s->bytes);
    free(s->numbers);
    free(s->stamps);
    free(s);
}

static mhe_status qualisys_create(const mhe_host *host, const void *config, void **self,
                                  mhe_error *err) {
    qualisys *s = calloc(1, sizeof *s);
    if (s == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    s->host = host;
    s->config = *(const struct qualisys_config *)config;
    s->socket = -1;
    s->device = -1;
    s->room = ROOM;
    s->bytes = malloc(s->room);
    s->numbers = malloc(sizeof(double) * NUMBERS);
    s->stamps = malloc(sizeof(double) * NUMBERS);
    s->parameters.up = -1;
    if (s->bytes == NULL || s->numbers == NULL || s->stamps == NULL) {
        qualisys_destroy(s);
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    *self = s;
    return MHE_OK;
}

static mhe_status qualisys_open(void *self, double deadline, mhe_error *err) {
    qualisys *s = self;
    return s->socket >= 0 ? MHE_OK : begin(s, deadline, err);
}

static int32_t qualisys_count(const void *self) {
    return ((const qualisys *)self)->device < 0 ? 1 : 2;
}

static mhe_status qualisys_stream(const void *self, int32_t i, mhe_stream_info *out,
                                  mhe_error *err) {
    const qualisys *s = self;
    if (i < 0 || i >= qualisys_count(self)) {
        return mhe_fail(err, MHE_E_ARGUMENT, "stream %d is not there", (int)i);
    }
    const rt_parameters *p = &s->parameters;
    const rt_analog_device *d = i == 1 ? &p->devices[s->device] : NULL;
    *out = (mhe_stream_info){.size = out->size,
                             .kind = d == NULL ? MHE_STREAM_MARKERS : MHE_STREAM_EMG,
                             .name = d == NULL ? "markers" : d->name,
                             .n_channels = d == NULL ? 3 * p->n_markers : d->n_channels,
                             .labels = (const char *const *)(d == NULL ? s->labels : d->labels),
                             .units = (const char *const *)(d == NULL ? s->units : d->units),
                             .rate = d == NULL ? p->frequency : d->rate,
                             .up = d == NULL ? p->up : -1};
    return MHE_OK;
}

static void tell(const qualisys *s, int32_t event, int32_t stream, const char *text) {
    s->taker->event(s->taker->data, event, stream, text);
}

static void take_markers(void *data, double time, int32_t n, const double *position) {
    qualisys *s = data;
    s->heard = qualisys_now();
    if (s->lost) {
        s->lost = 0;
        tell(s, MHE_SOURCE_BACK, -1, "QTM streams again");
    }
    if (n != s->parameters.n_markers) {
        s->differs = 1; /* often an event says so first */
        return;
    }
    const mhe_chunk chunk = {.size = sizeof chunk,
                             .stream = 0,
                             .n = 1,
                             .received = s->received,
                             .stamp = &time,
                             .values = position};
    s->taker->chunk(s->taker->data, &chunk);
}

/* The packet's time is that of its last sample: the frame that they came with. Samples that were
 * lost on the way leave a gap in the stamps by their number. */
static void take_analog(void *data, double time, int32_t device, int32_t n_channels, int32_t n,
                        uint32_t first, const double *values) {
    qualisys *s = data;
    const rt_analog_device *d = s->device < 0 ? NULL : &s->parameters.devices[s->device];
    if (d == NULL || d->id != device || (uint32_t)n > NUMBERS) {
        return;
    }
    if (d->n_channels != n_channels) {
        s->differs = 1;
        return;
    }
    if (s->next_sample != 0 && first > s->next_sample) {
        char text[128];
        (void)snprintf(text, sizeof text, "%u analog samples were lost on the way",
                       (unsigned)(first - s->next_sample));
        tell(s, MHE_SOURCE_WARNING, 1, text);
    }
    s->next_sample = first + (uint32_t)n;
    for (int32_t i = 0; i < n; i++) {
        s->stamps[i] = d->rate > 0 ? time - (n - 1 - i) / d->rate : time;
    }
    const mhe_chunk chunk = {.size = sizeof chunk,
                             .stream = 1,
                             .n = n,
                             .received = s->received,
                             .stamp = s->stamps,
                             .values = values};
    s->taker->chunk(s->taker->data, &chunk);
}

/* Settings have changed while it streams, as an event says or the data show: what is described is
 * asked for anew. */
static mhe_status settings_changed(qualisys *s, int by_data, mhe_error *err) {
    int same = 0;
    const mhe_status status = qualisys_ask_settings(s, &same, err);
    if (status == MHE_OK && !same) {
        s->unlike = 0;
        tell(s, MHE_SOURCE_CHANGED, -1, "QTM streams other markers or channels now");
    } else if (status == MHE_OK && by_data && !s->unlike) {
        s->unlike = 1;
        tell(s, MHE_SOURCE_WARNING, -1,
             "QTM's data have other numbers of markers or channels than its settings say: they are "
             "passed over");
    }
    return status;
}

static mhe_status take_packet(qualisys *s, const rt_packet *packet, size_t used, mhe_error *err) {
    const rt_taker taker = {s, take_markers, take_analog};
    mhe_status status = MHE_OK;
    const uint32_t type = packet->type;
    const int event = type == RT_EVENT && packet->length > 0 ? packet->body[0] : -1;
    mhe_error why = {0};
    if (type == RT_ERROR) {
        (void)qualisys_says(packet, MHE_E_INPUT, &why);
        tell(s, MHE_SOURCE_WARNING, -1, why.text);
    }
    if (type == RT_DATA) {
        if (rt_parse_data(packet, s->numbers, NUMBERS, &taker, &why) != MHE_OK) {
            tell(s, MHE_SOURCE_WARNING, -1, why.text);
        }
    }
    qualisys_drop(s, used);
    if (type == RT_NO_MORE_DATA) {
        s->lost = 1;
        tell(s, MHE_SOURCE_LOST, -1, "QTM has no more data: the measurement has ended");
    } else if (event == RT_EVENT_CHANGED ||
               (s->differs && qualisys_now() - s->asked > s->config.retry)) {
        const int by_data = event != RT_EVENT_CHANGED;
        s->asked = qualisys_now();
        s->differs = 0;
        status = settings_changed(s, by_data, err);
    } else if (event == RT_EVENT_CLOSED) {
        status = mhe_fail(err, MHE_RETRY, "QTM is shutting down");
    }
    return status;
}

static mhe_status take_all(qualisys *s, mhe_error *err) {
    rt_packet packet;
    size_t used = 0;
    mhe_status status = MHE_OK;
    while (status == MHE_OK &&
           (status = rt_take_packet(s->bytes, s->n_bytes, &packet, &used, err)) == MHE_OK) {
        status = take_packet(s, &packet, used, err);
        if (status == MHE_RETRY) {
            return status;
        }
    }
    return status == MHE_RETRY ? MHE_OK : status; /* no whole packet is left */
}

/* The connection is gone: told once, tried again now and then. */
static void reconnect(qualisys *s, double deadline) {
    if (qualisys_now() - s->tried < s->config.retry) {
        const double until = fmin(deadline, s->tried + s->config.retry);
        const double seconds = fmax(0, until - qualisys_now());
        const struct timespec pause = {(time_t)seconds, (long)(1e9 * fmod(seconds, 1))};
        (void)nanosleep(&pause, NULL);
        return;
    }
    s->tried = qualisys_now();
    s->next_sample = 0;
    if (begin(s, qualisys_now() + CONNECT, NULL) == MHE_OK) {
        s->lost = 0;
        tell(s, MHE_SOURCE_CHANGED, -1, "QTM is back");
    }
}

static mhe_status qualisys_read(void *self, double deadline, const mhe_source_taker *taker,
                                mhe_error *err) {
    qualisys *s = self;
    s->taker = taker;
    if (s->socket < 0) {
        reconnect(s, deadline);
        return MHE_OK;
    }
    mhe_error why = {0};
    mhe_status status = qualisys_receive(s, deadline, &why);
    if (status == MHE_OK) {
        status = take_all(s, &why);
    }
    if (status == MHE_OK && !s->lost && qualisys_now() - s->heard > s->config.silence) {
        char text[80] = "QTM has stopped in the middle of a packet";
        s->lost = 1;
        if (s->n_bytes == 0) {
            (void)snprintf(text, sizeof text, "QTM sends no 3D data for %g s", s->config.silence);
        }
        tell(s, MHE_SOURCE_LOST, -1, text);
    }
    if (status == MHE_E_MEMORY) {
        return mhe_fail(err, status, "%s", why.text);
    }
    if (status != MHE_OK) { /* closed, or bytes that are none of the protocol */
        qualisys_disconnect(s);
        s->lost = 1;
        tell(s, MHE_SOURCE_LOST, -1, why.text);
    }
    return MHE_OK;
}

static const mhe_source_ops qualisys_ops = {.size = sizeof qualisys_ops,
                                            .create = qualisys_create,
                                            .destroy = qualisys_destroy,
                                            .open = qualisys_open,
                                            .count = qualisys_count,
                                            .stream = qualisys_stream,
                                            .read = qualisys_read};

static const mhe_option qualisys_options[] = {
    MHE_OPT_TEXT(struct qualisys_config, host, 0, "127.0.0.1", "Where QTM runs."),
    MHE_OPT_INT(struct qualisys_config, port, 22223, 1, 65535, "1",
                "Port of its real-time server (little-endian: base port + 1)."),
    MHE_OPT_BOOL(struct qualisys_config, emg, 1, "Take an analog device as EMG, too."),
    MHE_OPT_TEXT(struct qualisys_config, device, 0, "",
                 "Name of the analog device; empty: the first."),
    MHE_OPT_REAL(struct qualisys_config, silence, 2.0, 0.01, 3600.0, "s",
                 "Time without 3D data after which the stream counts as lost."),
    MHE_OPT_REAL(struct qualisys_config, retry, 0.5, 0.01, 60.0, "s",
                 "Time between two tries to connect anew, and between two questions what data are "
                 "that differ from QTM's settings."),
};

static const mhe_plugin qualisys_plugin = {
    .size = sizeof qualisys_plugin,
    .id = "mhe.source.qualisys",
    .version = "0.2.0",
    .summary = "Markers and analog channels of Qualisys Track Manager (real-time protocol 1.22).",
    .iface = MHE_SOURCE_IFACE,
    .ops = &qualisys_ops,
    MHE_PLUGIN_OPTIONS(struct qualisys_config, qualisys_options)};

MHE_PLUGIN_LIBRARY(&qualisys_plugin)

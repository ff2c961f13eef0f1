/* SPDX-License-Identifier: Apache-2.0 */
/* source_qualisys.c: markers and analog channels of Qualisys Track Manager, on its one clock. */
#include "rt.h"

#include <mhe/source.h>

#include <errno.h>
#include <math.h>
#include <netdb.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#define ROOM (1u << 20)    /* bytes that are read at once, and grow to a whole packet */
#define NUMBERS (1u << 18) /* of one component */
#define AGAIN 0.5          /* s between two tries to connect anew */
#define ANSWER 2.0         /* s that an answer may take */

struct qualisys_config { /* filled by the core from the option table */
    const char *host;
    int32_t port;
    const char *device; /* analog device; "": the first */
    int32_t emg;
};

/* Stream 0: markers; stream 1: the analog device, where there is one. */
typedef struct qualisys {
    const mhe_host *host;
    struct qualisys_config config;
    int socket; /* -1: none */
    uint8_t *bytes;
    size_t n_bytes, room;
    double *numbers, *stamps;
    rt_parameters parameters;
    int32_t device;         /* number among the parameters' devices; -1: none */
    char **labels, **units; /* of the markers' axes [3 n_markers] */
    const mhe_source_taker *taker;
    double received;
    double tried; /* s, when a connection was tried last */
    int32_t lost, ended;
    uint32_t next_sample; /* number that the next analog sample should have */
} qualisys;

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* ---- the connection ---- */

static void disconnect(qualisys *s) {
    if (s->socket >= 0) {
        (void)close(s->socket);
    }
    s->socket = -1;
    s->n_bytes = 0;
}

static int wait_for(int fd, short what, double deadline) {
    const double seconds = deadline - now();
    struct pollfd p = {.fd = fd, .events = what};
    return poll(&p, 1, seconds <= 0 ? 0 : (int)ceil(1000 * fmin(seconds, 60))) > 0;
}

static mhe_status connect_socket(qualisys *s, double deadline, mhe_error *err) {
    char port[16];
    struct addrinfo *list = NULL;
    const struct addrinfo hints = {.ai_family = AF_UNSPEC, .ai_socktype = SOCK_STREAM};
    (void)snprintf(port, sizeof port, "%d", (int)s->config.port);
    if (getaddrinfo(s->config.host, port, &hints, &list) != 0) {
        return mhe_fail(err, MHE_RETRY, "the host '%s' is not known", s->config.host);
    }
    for (const struct addrinfo *a = list; a != NULL && s->socket < 0; a = a->ai_next) {
        s->socket = socket(a->ai_family, a->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
        if (s->socket < 0) {
            continue;
        }
        int code = 0;
        socklen_t size = sizeof code;
        if (connect(s->socket, a->ai_addr, a->ai_addrlen) != 0 &&
            (errno != EINPROGRESS || !wait_for(s->socket, POLLOUT, deadline) ||
             getsockopt(s->socket, SOL_SOCKET, SO_ERROR, &code, &size) != 0 || code != 0)) {
            disconnect(s);
        }
    }
    freeaddrinfo(list);
    return s->socket >= 0 ? MHE_OK
                          : mhe_fail(err, MHE_RETRY, "no QTM at %s, port %d", s->config.host,
                                     (int)s->config.port);
}

static mhe_status send_command(qualisys *s, const char *text, mhe_error *err) {
    uint8_t packet[256];
    const size_t size = rt_write_command(text, packet, sizeof packet);
    size_t done = 0;
    while (done < size) {
        const ssize_t n = send(s->socket, packet + done, size - done, MSG_NOSIGNAL);
        if (n < 0 && (errno != EAGAIN || !wait_for(s->socket, POLLOUT, now() + ANSWER))) {
            return mhe_fail(err, MHE_RETRY, "QTM takes no commands");
        }
        done += n > 0 ? (size_t)n : 0;
    }
    return MHE_OK;
}

/* Reads what is there into the buffer, waiting until the deadline. MHE_RETRY: the connection is
 * closed. */
static mhe_status receive(qualisys *s, double deadline, mhe_error *err) {
    if (s->n_bytes == s->room) {
        uint8_t *grown = s->room >= RT_LARGEST ? NULL : realloc(s->bytes, 2 * s->room);
        if (grown == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
        s->bytes = grown;
        s->room *= 2;
    }
    if (!wait_for(s->socket, POLLIN, deadline)) {
        return MHE_OK;
    }
    const ssize_t n = recv(s->socket, s->bytes + s->n_bytes, s->room - s->n_bytes, 0);
    if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) {
        return mhe_fail(err, MHE_RETRY, "QTM has closed the connection");
    }
    s->n_bytes += n > 0 ? (size_t)n : 0;
    s->received = now();
    return MHE_OK;
}

static void drop(qualisys *s, size_t used) {
    memmove(s->bytes, s->bytes + used, s->n_bytes - used);
    s->n_bytes -= used;
}

/* Waits for a packet of a type; others are passed over. Its body is valid until drop(*used). */
static mhe_status await(qualisys *s, uint32_t type, double deadline, rt_packet *packet,
                        size_t *used, mhe_error *err) {
    for (;;) {
        mhe_status status = rt_take_packet(s->bytes, s->n_bytes, packet, used, err);
        if (status == MHE_OK && packet->type == type) {
            return MHE_OK;
        }
        if (status == MHE_OK && packet->type == RT_ERROR) {
            return mhe_fail(err, MHE_RETRY, "QTM says: %.*s", (int)packet->length,
                            (const char *)packet->body);
        }
        if (status == MHE_OK) {
            drop(s, *used);
            continue;
        }
        if (status < 0) {
            return status;
        }
        if (now() >= deadline) {
            return mhe_fail(err, MHE_RETRY, "QTM does not answer");
        }
        status = receive(s, deadline, err);
        if (status != MHE_OK) {
            return status;
        }
    }
}

static mhe_status ask(qualisys *s, const char *command, uint32_t type, rt_packet *packet,
                      size_t *used, mhe_error *err) {
    const mhe_status status = send_command(s, command, err);
    return status == MHE_OK ? await(s, type, now() + ANSWER, packet, used, err) : status;
}

/* ---- what is streamed ---- */

static void free_axes(qualisys *s, int32_t n_markers) {
    for (int32_t i = 0; i < 3 * n_markers && s->labels != NULL; i++) {
        free(s->labels[i]);
    }
    free(s->labels);
    free(s->units);
    s->labels = s->units = NULL;
}

static mhe_status name_axes(qualisys *s, mhe_error *err) {
    static char metre[] = "m";
    const int32_t n = s->parameters.n_markers;
    s->labels = calloc((size_t)(3 * n) + 1, sizeof *s->labels);
    s->units = calloc((size_t)(3 * n) + 1, sizeof *s->units);
    for (int32_t i = 0; i < 3 * n && s->labels != NULL && s->units != NULL; i++) {
        const char *name = s->parameters.markers[i / 3];
        s->units[i] = metre; /* the protocol's mm are converted */
        s->labels[i] = malloc(strlen(name) + 3);
        if (s->labels[i] == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
        (void)sprintf(s->labels[i], "%s.%c", name, "xyz"[i % 3]);
    }
    return s->labels == NULL || s->units == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                                 : MHE_OK;
}

static mhe_status choose_device(qualisys *s, mhe_error *err) {
    const rt_parameters *p = &s->parameters;
    s->device = -1;
    for (int32_t i = 0; i < p->n_devices && s->config.emg && s->device < 0; i++) {
        const int named = s->config.device[0] != '\0';
        s->device = !named || strcmp(p->devices[i].name, s->config.device) == 0 ? i : -1;
    }
    if (s->config.emg && s->device < 0) {
        return mhe_fail(err, MHE_RETRY, "QTM streams no analog device%s%s%s",
                        s->config.device[0] == '\0' ? "" : " '", s->config.device,
                        s->config.device[0] == '\0' ? "" : "'");
    }
    return MHE_OK;
}

static mhe_status read_parameters(qualisys *s, mhe_error *err) {
    rt_packet packet;
    size_t used = 0;
    rt_parameters fresh;
    mhe_status status = ask(s, s->config.emg ? "GetParameters 3D Analog" : "GetParameters 3D",
                            RT_XML, &packet, &used, err);
    if (status != MHE_OK) {
        return status;
    }
    status = rt_parse_parameters((const char *)packet.body, packet.length, &fresh, err);
    drop(s, used);
    if (status != MHE_OK) {
        return status;
    }
    free_axes(s, s->parameters.n_markers);
    rt_free_parameters(&s->parameters);
    s->parameters = fresh;
    status = name_axes(s, err);
    return status == MHE_OK ? choose_device(s, err) : status;
}

/* The whole greeting up to a running stream. */
static mhe_status begin(qualisys *s, double deadline, mhe_error *err) {
    rt_packet packet;
    size_t used = 0;
    mhe_status status = connect_socket(s, deadline, err);
    if (status == MHE_OK) {
        status = await(s, RT_COMMAND, now() + ANSWER, &packet, &used, err); /* its welcome */
    }
    if (status == MHE_OK) {
        drop(s, used);
        status = ask(s, "Version 1.22", RT_COMMAND, &packet, &used, err);
    }
    if (status == MHE_OK) {
        drop(s, used);
        status = read_parameters(s, err);
    }
    if (status == MHE_OK) {
        status = send_command(
            s, s->config.emg ? "StreamFrames AllFrames 3D Analog" : "StreamFrames AllFrames 3D",
            err);
    }
    if (status != MHE_OK) {
        disconnect(s);
    }
    return status;
}

/* ---- the plugin's functions ---- */

static void qualisys_destroy(void *self) {
    qualisys *s = self;
    if (s->socket >= 0) {
        (void)send_command(s, "StreamFrames Stop", NULL);
    }
    disconnect(s);
    free_axes(s, s->parameters.n_markers);
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
    if (n != s->parameters.n_markers) {
        return; /* an event says so first; what was on the way belongs to nothing */
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
    if (d == NULL || d->id != device || d->n_channels != n_channels || (uint32_t)n > NUMBERS) {
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

/* Settings have changed while it streams: what is described is asked for anew. */
static mhe_status settings_changed(qualisys *s, mhe_error *err) {
    const mhe_status status = read_parameters(s, err);
    if (status == MHE_OK) {
        tell(s, MHE_SOURCE_CHANGED, -1, "QTM streams other markers or channels now");
    }
    return status;
}

static mhe_status take_packet(qualisys *s, const rt_packet *packet, size_t used, mhe_error *err) {
    const rt_taker taker = {s, take_markers, take_analog};
    mhe_status status = MHE_OK;
    const uint32_t type = packet->type;
    const int event = type == RT_EVENT && packet->length > 0 ? packet->body[0] : -1;
    if (type == RT_DATA) {
        mhe_error why = {0};
        if (rt_parse_data(packet, s->numbers, NUMBERS, &taker, &why) != MHE_OK) {
            tell(s, MHE_SOURCE_WARNING, -1, why.text);
        }
    }
    drop(s, used);
    if (type == RT_NO_MORE_DATA) {
        tell(s, MHE_SOURCE_LOST, -1, "QTM has no more data: the measurement has ended");
        s->lost = 1;
    } else if (event == RT_EVENT_CHANGED) {
        status = settings_changed(s, err);
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
        if (s->lost && packet.type == RT_DATA) {
            s->lost = 0;
            tell(s, MHE_SOURCE_BACK, -1, "QTM streams again");
        }
        status = take_packet(s, &packet, used, err);
        if (status == MHE_RETRY) {
            return status;
        }
    }
    return status == MHE_RETRY ? MHE_OK : status; /* no whole packet is left */
}

/* The connection is gone: told once, tried again now and then. */
static void reconnect(qualisys *s, double deadline) {
    if (now() - s->tried < AGAIN) {
        const double until = fmin(deadline, s->tried + AGAIN);
        const double seconds = fmax(0, until - now());
        const struct timespec pause = {(time_t)seconds, (long)(1e9 * fmod(seconds, 1))};
        (void)nanosleep(&pause, NULL);
        return;
    }
    s->tried = now();
    s->next_sample = 0;
    if (begin(s, now() + AGAIN, NULL) == MHE_OK) {
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
    mhe_status status = receive(s, deadline, &why);
    if (status == MHE_OK) {
        status = take_all(s, &why);
    }
    if (status == MHE_E_MEMORY) {
        return mhe_fail(err, status, "%s", why.text);
    }
    if (status != MHE_OK) { /* closed, or bytes that are none of the protocol */
        disconnect(s);
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

/* SPDX-License-Identifier: Apache-2.0 */
/* server.c: the sockets, by libwebsockets. */
#include "page.h"
#include "web.h"

#include <math.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <time.h>

#define STATE_ROOM 65536 /* bytes of the run's state */

double web_now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* ---- clients ---- */

int web_write(web *w, web_client *c, size_t n, int text) {
    const int sent =
        lws_write(c->wsi, w->out + LWS_PRE, n, text ? LWS_WRITE_TEXT : LWS_WRITE_BINARY);
    return sent < (int)n ? -1 : 0;
}

void web_hold(const web_client *c, int on) {
    (void)setsockopt(lws_get_socket_fd(c->wsi), IPPROTO_TCP, TCP_CORK, &on, sizeof on);
}

int web_is_full(const web_client *c) {
    return lws_send_pipe_choked(c->wsi);
}

static web *web_of(struct lws *wsi) {
    return lws_context_user(lws_get_context(wsi));
}

/* A page may only speak to the server that it came from, or to one that names its origin. */
static int is_allowed(web *w, struct lws *wsi) {
    char origin[256] = "", host[256] = "";
    if (lws_hdr_copy(wsi, origin, sizeof origin, WSI_TOKEN_ORIGIN) <= 0) {
        return 1; /* no browser */
    }
    (void)lws_hdr_copy(wsi, host, sizeof host, WSI_TOKEN_HOST);
    const char *behind = strstr(origin, "://");
    if (behind != NULL && host[0] != '\0' && strcmp(behind + 3, host) == 0) {
        return 1;
    }
    for (int32_t i = 0; i < w->config.origins.n; i++) {
        if (strcmp(w->config.origins.values[i], origin) == 0) {
            return 1;
        }
    }
    return 0;
}

static int add_client(web *w, struct lws *wsi, web_client **slot, int foxglove) {
    web_client *c = w->n_clients < WEB_CLIENTS ? calloc(1, sizeof *c) : NULL;
    *slot = c;
    if (c == NULL) {
        return -1;
    }
    c->wsi = wsi;
    c->foxglove = foxglove;
    c->next = w->n_frames;
    w->clients[w->n_clients++] = c;
    if (foxglove) {
        web_foxglove_welcome(w, c);
    }
    lws_callback_on_writable(wsi);
    return 0;
}

static void remove_client(web *w, web_client *c) {
    for (int32_t i = 0; i < w->n_clients && c != NULL; i++) {
        if (w->clients[i] == c) {
            w->clients[i] = w->clients[--w->n_clients];
            free(c->answer);
            free(c);
            return;
        }
    }
}

static int receive(web *w, web_client *c, const char *bytes, size_t n, int last) {
    if (c->n_command + n >= sizeof c->command) {
        return -1; /* nobody has that much to say */
    }
    memcpy(c->command + c->n_command, bytes, n);
    c->n_command += n;
    if (last) {
        c->command[c->n_command] = '\0';
        c->n_command = 0;
        (c->foxglove ? web_foxglove_command : web_command)(w, c, c->command);
        lws_callback_on_writable(c->wsi);
    }
    return 0;
}

static void catch_up(const web *w, web_client *c) {
    if (w->n_frames - c->next > WEB_FRAMES / 2) {
        c->lost += w->n_frames - 1 - c->next;
        c->next = w->n_frames - 1;
        c->place = 0;
    }
}

static int write_next(web *w, web_client *c) {
    catch_up(w, c);
    const int result = (c->foxglove ? web_send_foxglove : web_send_page)(w, c);
    if (web_is_due(w, c) || c->answer != NULL || !c->told_run) {
        lws_callback_on_writable(c->wsi);
    }
    return result;
}

static int speak(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in, size_t n,
                 int foxglove) {
    web_client **slot = user;
    web *w = web_of(wsi);
    switch (reason) {
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
        return is_allowed(w, wsi) ? 0 : 1;
    case LWS_CALLBACK_ESTABLISHED:
        return add_client(w, wsi, slot, foxglove);
    case LWS_CALLBACK_CLOSED:
        remove_client(w, *slot);
        *slot = NULL;
        return 0;
    case LWS_CALLBACK_RECEIVE:
        return *slot == NULL
                   ? -1
                   : receive(w, *slot, in, n,
                             lws_is_final_fragment(wsi) && lws_remaining_packet_payload(wsi) == 0);
    case LWS_CALLBACK_SERVER_WRITEABLE:
        return *slot == NULL ? -1 : write_next(w, *slot);
    default:
        return 0;
    }
}

static int speak_page(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in,
                      size_t n) {
    return speak(wsi, reason, user, in, n, 0);
}

static int speak_foxglove(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in,
                          size_t n) {
    return speak(wsi, reason, user, in, n, 1);
}

/* ---- the page ---- */

struct download {
    size_t sent;
};

static int begin_page(struct lws *wsi, const char *path) {
    uint8_t buffer[LWS_PRE + 1024], *start = buffer + LWS_PRE, *at = start,
                                    *end = buffer + sizeof buffer - 1;
    static const char policy[] = "default-src 'none'; script-src 'unsafe-inline'; style-src "
                                 "'unsafe-inline'; connect-src 'self' ws: wss:; img-src data:";
    if (strcmp(path, "/") != 0 && strcmp(path, "/index.html") != 0) {
        (void)lws_return_http_status(wsi, HTTP_STATUS_NOT_FOUND, NULL);
        return -1;
    }
    if (lws_add_http_common_headers(wsi, HTTP_STATUS_OK, "text/html; charset=utf-8", mhe_page_size,
                                    &at, end) != 0 ||
        lws_add_http_header_by_name(wsi, (const uint8_t *)"content-security-policy:",
                                    (const uint8_t *)policy, (int)strlen(policy), &at, end) != 0 ||
        lws_finalize_write_http_header(wsi, start, &at, end) != 0) {
        return -1;
    }
    lws_callback_on_writable(wsi);
    return 0;
}

static int continue_page(struct lws *wsi, struct download *d) {
    uint8_t buffer[LWS_PRE + 4096];
    const size_t rest = mhe_page_size - d->sent, n = rest < 4096 ? rest : 4096;
    memcpy(buffer + LWS_PRE, mhe_page + d->sent, n);
    const int last = n == rest;
    if (lws_write(wsi, buffer + LWS_PRE, n, last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) !=
        (int)n) {
        return -1;
    }
    d->sent += n;
    if (last) {
        return lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
    }
    lws_callback_on_writable(wsi);
    return 0;
}

static int serve(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in,
                 size_t n) {
    struct download *d = user;
    switch (reason) {
    case LWS_CALLBACK_HTTP:
        d->sent = 0;
        return begin_page(wsi, in);
    case LWS_CALLBACK_HTTP_WRITEABLE:
        return d == NULL ? -1 : continue_page(wsi, d);
    default:
        return lws_callback_http_dummy(wsi, reason, user, in, n);
    }
}

static const struct lws_protocols protocols[] = {
    {"http", serve, sizeof(struct download), 0, 0, NULL, 0},
    {"mhe.live.v1", speak_page, sizeof(web_client *), WEB_COMMAND, 0, NULL, 0},
    {"foxglove.websocket.v1", speak_foxglove, sizeof(web_client *), WEB_COMMAND, 0, NULL, 0},
    {NULL, NULL, 0, 0, 0, NULL, 0}};

/* ---- the plugin's functions ---- */

static mhe_status web_create(const mhe_host *host, const void *config, void **self,
                             mhe_error *err) {
    web *w = calloc(1, sizeof *w);
    if (w == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    w->host = host;
    w->config = *(const struct web_config *)config;
    *self = w;
    return MHE_OK;
}

static mhe_status web_close(void *self, mhe_error *err) {
    (void)err;
    web *w = self;
    if (w->context != NULL) {
        lws_context_destroy(w->context);
        w->context = NULL;
    }
    return MHE_OK;
}

static void web_destroy(void *self) {
    web *w = self;
    (void)web_close(w, NULL);
    free(w->description);
    free(w->frames);
    free(w->out);
    free(w);
}

static void make_token(web *w) {
    uint8_t bytes[16];
    if (getrandom(bytes, sizeof bytes, 0) != (ssize_t)sizeof bytes) {
        const double now = web_now(); /* never: the pool is there since the start of the system */
        memcpy(bytes, &now, sizeof now);
    }
    for (size_t i = 0; i < sizeof bytes; i++) {
        (void)snprintf(w->token + 2 * i, 3, "%02x", bytes[i]);
    }
}

static mhe_status listen_on(web *w, mhe_error *err) {
    struct lws_context_creation_info info = {0};
    char address[128];
    const mhe_status found =
        web_find_address(w->config.address, (int)w->config.port, address, sizeof address, err);
    if (found != MHE_OK) {
        return found;
    }
    lws_set_log_level(0, NULL);
    info.port = w->config.port;
    info.iface = address;
    info.protocols = protocols;
    info.user = w;
    info.options = LWS_SERVER_OPTION_FAIL_UPON_UNABLE_TO_BIND;
    if (strchr(address, ':') == NULL) { /* else it listens on :: for any address of four numbers */
        info.options |= LWS_SERVER_OPTION_DISABLE_IPV6;
    }
    w->context = lws_create_context(&info);
    if (w->context == NULL) {
        return mhe_fail(
            err, MHE_E_IO,
            "%s, port %d: cannot be listened on; is it in use? Is the address one of this "
            "machine?",
            w->config.address, (int)w->config.port);
    }
    char line[256];
    const int everywhere = strcmp(address, "0.0.0.0") == 0 || strcmp(address, "::") == 0;
    const int port = lws_get_vhost_listen_port(lws_get_vhost_by_name(w->context, "default"));
    if (!everywhere && web_is_everywhere(port)) {
        (void)web_close(w, NULL);
        return mhe_fail(err, MHE_E_IO, "%s: libwebsockets cannot listen there alone", address);
    }
    (void)snprintf(line, sizeof line, "the page: http://%s:%d/%s%s", w->config.address, port,
                   w->config.open ? "" : "?token=", w->config.open ? "" : w->token);
    w->host->log(w->host, MHE_LOG_INFO, line);
    return MHE_OK;
}

static mhe_status web_open(void *self, const mhe_sink_run *run, const mhe_sink_control *control,
                           mhe_error *err) {
    web *w = self;
    w->run = run;
    w->control = control;
    for (int32_t i = 0; i < run->n_signals; i++) {
        w->n_values += web_signal(w, i)->n;
    }
    w->last = -INFINITY;
    w->frames = calloc((size_t)WEB_FRAMES * (size_t)(WEB_HEAD + w->n_values), sizeof *w->frames);
    make_token(w);
    if (w->frames == NULL || !web_describe(w)) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    const size_t described = strlen(w->description), frame = 8 * WEB_HEAD + 4 * (size_t)w->n_values;
    w->out_room = described > frame ? described : frame;
    w->out_room = w->out_room > STATE_ROOM ? w->out_room : STATE_ROOM;
    w->out = malloc(LWS_PRE + w->out_room);
    return w->out == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : listen_on(w, err);
}

static mhe_status web_take(void *self, const mhe_sink_sample *s, mhe_error *err) {
    (void)err;
    web *w = self;
    if (w->config.rate > 0 && s->time < w->last + 0.999 / w->config.rate && s->time > w->last) {
        return MHE_OK;
    }
    w->last = s->time;
    double *frame = web_frame_at(w, w->n_frames);
    const double head[WEB_HEAD] = {(double)s->number, s->time,       s->status,
                                   s->iterations,     s->solve_time, web_now() - s->stamp,
                                   (double)s->lost,   s->stamp};
    memcpy(frame, head, sizeof head);
    double *at = frame + WEB_HEAD;
    for (int32_t i = 0; i < w->run->n_signals; i++) {
        const size_t n = (size_t)web_signal(w, i)->n;
        memcpy(at, s->values[i], sizeof(double) * n);
        at += n;
    }
    w->n_frames++;
    for (int32_t i = 0; i < w->n_clients; i++) {
        if (web_is_due(w, w->clients[i])) {
            lws_callback_on_writable(w->clients[i]->wsi);
        }
    }
    return MHE_OK;
}

static void ring_alarm(lws_sorted_usec_list_t *alarm) {
    (void)alarm; /* it only ends the wait */
}

static mhe_status web_poll(void *self, double seconds, mhe_error *err) {
    (void)err;
    web *w = self;
    const double now = web_now();
    for (int32_t i = 0; i < w->n_clients; i++) { /* their state is due without any frame, too */
        if (now - w->clients[i]->told_state > 1 || web_is_due(w, w->clients[i])) {
            lws_callback_on_writable(w->clients[i]->wsi);
        }
    }
    lws_sul_schedule(w->context, 0, &w->alarm, ring_alarm, (lws_usec_t)(1e6 * fmax(seconds, 1e-4)));
    (void)lws_service(w->context, 0);
    return MHE_OK;
}

static void web_wake(void *self) {
    lws_cancel_service(((web *)self)->context);
}

static const mhe_sink_ops web_ops = {.size = sizeof web_ops,
                                     .create = web_create,
                                     .destroy = web_destroy,
                                     .open = web_open,
                                     .take = web_take,
                                     .poll = web_poll,
                                     .close = web_close,
                                     .wake = web_wake};

static const mhe_option web_options[] = {
    MHE_OPT_TEXT(struct web_config, address, 0, "127.0.0.1",
                 "Interface to listen on; 0.0.0.0 lets other machines in."),
    MHE_OPT_INT(struct web_config, port, 8080, 0, 65535, "1",
                "Port; 0: the system chooses a free one, which is printed."),
    MHE_OPT_TEXTS(struct web_config, origins, 0,
                  "Origins of other pages that may connect, as https://app.foxglove.dev."),
    MHE_OPT_BOOL(struct web_config, open, 0, "Whoever sees the page may stop and record."),
    MHE_OPT_REAL(struct web_config, rate, 0, 0, 1000, "Hz",
                 "Most frames a second that clients get; 0: all."),
};

static const mhe_plugin web_plugin = {
    .size = sizeof web_plugin,
    .id = "mhe.sink.web",
    .version = "0.2.0",
    .summary = "A page in the browser, live, and the protocol of Foxglove and Lichtblick.",
    .iface = MHE_SINK_IFACE,
    .ops = &web_ops,
    MHE_PLUGIN_OPTIONS(struct web_config, web_options)};

MHE_PLUGIN_LIBRARY(&web_plugin)

/* SPDX-License-Identifier: Apache-2.0 */
/* web.h: the parts of the web sink.
 *
 * One thread does everything: take() puts a frame into a ring, poll() lets the server send. Each
 * client has its own place in the ring; one that does not keep up jumps to the newest frame and is
 * told how many it has lost. */
#ifndef SINK_WEB_H
#define SINK_WEB_H

#include <libwebsockets.h>
#include <mhe/sink.h>

#define WEB_FRAMES 512   /* in the ring; a power of two */
#define WEB_CLIENTS 32   /* at most */
#define WEB_COMMAND 4096 /* bytes of a client's message */
#define WEB_SUBSCRIPTIONS 64
#define WEB_HEAD 8 /* float64 before the values of a frame, see web_frame() */

struct web_config { /* filled by the core from the option table */
    const char *address;
    int32_t port;
    mhe_text_list origins;
    int32_t open; /* control without a token */
    double rate;
};

/* Text that grows. */
typedef struct web_text {
    char *text;
    size_t n, room;
    int failed;
} web_text;

typedef struct web_subscription {
    uint32_t id, channel;
} web_subscription;

typedef struct web_client {
    struct lws *wsi;
    int foxglove;
    int told_run; /* the description was sent */
    int64_t next; /* frame to send next */
    int64_t lost;
    int32_t place;     /* foxglove: subscription to serve next of the frame `next` */
    char *answer;      /* text to be sent first; NULL: none */
    double told_state; /* s, when the state was sent last */
    double pace;       /* s between two times at which it gets frames: all that came by then */
    double served;     /* s, when it got frames last */
    int64_t until;     /* frame before which it is being sent all that is there */
    char command[WEB_COMMAND];
    size_t n_command;
    int32_t n_subscriptions;
    web_subscription subscriptions[WEB_SUBSCRIPTIONS];
} web_client;

typedef struct web {
    const mhe_host *host;
    struct web_config config;
    const mhe_sink_run *run;
    const mhe_sink_control *control;
    struct lws_context *context;
    lws_sorted_usec_list_t alarm;
    char token[33];
    char *description; /* JSON of the run, for our page */
    int32_t n_values;  /* of all signals */
    double *frames;    /* [WEB_FRAMES x (WEB_HEAD + n_values)] */
    int64_t n_frames;  /* so far */
    double last;       /* s, time of the last frame that was kept (rate) */
    uint8_t *out;      /* LWS_PRE + the longest message */
    size_t out_room;
    web_client *clients[WEB_CLIENTS];
    int32_t n_clients;
} web;

double web_now(void); /* s of CLOCK_MONOTONIC */
static inline double *web_frame_at(const web *w, int64_t k) {
    return w->frames + (size_t)(k & (WEB_FRAMES - 1)) * (size_t)(WEB_HEAD + w->n_values);
}
static inline const mhe_sink_signal *web_signal(const web *w, int32_t i) {
    return (const mhe_sink_signal *)(const void *)((const char *)w->run->signals +
                                                   (size_t)i * w->run->signal_size);
}

/* json.c. Appends; a text is quoted and escaped, a number NaN becomes null. */
void web_add(web_text *t, const char *plain);
void web_add_text(web_text *t, const char *text);
void web_add_number(web_text *t, double value);
/* Value of a key of a flat JSON object as text in `out`; 0: there is none. Strings lose their
 * quotes and simple escapes; numbers are as written. */
int web_json_find(const char *json, const char *key, char *out, size_t room);

/* messages.c: our own protocol. */
int web_describe(web *w);                                  /* w->description; 0: no memory */
void web_command(web *w, web_client *c, const char *json); /* from a page */
int web_send_page(web *w, web_client *c); /* what is next for a page; -1: close it */

int web_is_due(const web *w, const web_client *c); /* there are frames, and it is their time */

/* foxglove.c: foxglove.websocket.v1 */
void web_foxglove_welcome(web *w, web_client *c);
void web_foxglove_command(web *w, web_client *c, const char *json);
int web_send_foxglove(web *w, web_client *c);

/* server.c: sends `n` bytes at w->out + LWS_PRE. */
int web_write(web *w, web_client *c, size_t n, int text);
void web_hold(const web_client *c, int on); /* what is written waits for what follows, until 0 */
int web_is_full(const web_client *c);       /* no more can be written now */

/* address.c: the address as numbers, or the interface's name. MHE_E_CONFIG, MHE_E_IO: nothing can
 * be listened on there. */
mhe_status web_find_address(const char *address, int port, char *numeric, size_t room,
                            mhe_error *err);
int web_is_everywhere(int port); /* all addresses of the machine are listened on at this port */

/* answer.c */
int web_send_answer(web *w, web_client *c); /* c->answer, if any; 1: sent */
void web_answer(web_client *c, char *text); /* takes the text over */

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* foxglove.c: the protocol foxglove.websocket.v1 (github.com/foxglove/ws-protocol, MIT), so that
 * Foxglove and Lichtblick plot a run: a channel a signal, JSON messages {label: value}. */
#include "web.h"

#include <stdlib.h>
#include <string.h>

#define MESSAGE_DATA 1 /* binary: this byte, uint32 subscription, uint64 ns, the message */

static void add_channel(const web *w, web_text *t, int32_t i) {
    const mhe_sink_signal *s = web_signal(w, i);
    web_add(t, "{\"id\":");
    web_add_number(t, i + 1);
    web_add(t, ",\"topic\":");
    web_text topic = {0};
    web_add(&topic, "/");
    web_add(&topic, s->name);
    web_add_text(t, topic.text == NULL ? "/" : topic.text);
    free(topic.text);
    web_add(t, ",\"encoding\":\"json\",\"schemaName\":");
    web_text name = {0};
    web_add(&name, "mhe.");
    web_add(&name, s->name);
    web_add_text(t, name.text == NULL ? "mhe" : name.text);
    free(name.text);
    web_text schema = {0};
    web_add(&schema, "{\"type\":\"object\",\"properties\":{");
    for (int32_t k = 0; k < s->n; k++) {
        web_add(&schema, k == 0 ? "" : ",");
        web_add_text(&schema, s->labels[k]);
        web_add(&schema, ":{\"type\":\"number\"}");
    }
    web_add(&schema, "}}");
    web_add(t, ",\"schemaEncoding\":\"jsonschema\",\"schema\":");
    web_add_text(t, schema.text == NULL ? "" : schema.text);
    t->failed |= schema.failed;
    free(schema.text);
    web_add(t, "}");
}

void web_foxglove_welcome(web *w, web_client *c) {
    web_text t = {0};
    web_add(&t, "{\"op\":\"serverInfo\",\"name\":\"Myohorizon\",\"capabilities\":[],"
                "\"supportedEncodings\":[\"json\"]}");
    web_answer(c, t.text);
    (void)w;
}

static void advertise(web *w, web_client *c) {
    web_text t = {0};
    web_add(&t, "{\"op\":\"advertise\",\"channels\":[");
    int32_t n = 0;
    for (int32_t i = 0; i < w->run->n_signals; i++) {
        if (web_signal(w, i)->n > 0) {
            web_add(&t, n++ == 0 ? "" : ",");
            add_channel(w, &t, i);
        }
    }
    web_add(&t, "]}");
    web_answer(c, t.text);
}

/* Numbers of {"id": 1, "channelId": 3} in a list; tolerant of everything else. */
static void subscribe(const web *w, web_client *c, const char *json) {
    for (const char *at = strchr(json, '['); at != NULL; at = strchr(at, '{')) {
        char id[16] = "", channel[16] = "";
        const char *end = strchr(at + 1, '}');
        char object[256];
        const char *begin = strchr(at, '{');
        if (begin == NULL || end == NULL) {
            return;
        }
        const size_t n = (size_t)(end - begin) + 1;
        if (n < sizeof object) {
            memcpy(object, begin, n);
            object[n] = '\0';
            const int whole = web_json_find(object, "id", id, sizeof id) &&
                              web_json_find(object, "channelId", channel, sizeof channel);
            const unsigned long number = whole ? strtoul(channel, NULL, 10) : 0;
            if (number >= 1 && number <= (unsigned long)w->run->n_signals &&
                c->n_subscriptions < WEB_SUBSCRIPTIONS) {
                c->subscriptions[c->n_subscriptions++] =
                    (web_subscription){(uint32_t)strtoul(id, NULL, 10), (uint32_t)number};
            }
        }
        at = end;
    }
}

static void unsubscribe(web_client *c, const char *json) {
    const char *list = strchr(json, '[');
    while (list != NULL && *list != '\0' && *list != ']') {
        char *end = NULL;
        const unsigned long id = strtoul(list + 1, &end, 10);
        for (int32_t i = 0; i < c->n_subscriptions; i++) {
            if (c->subscriptions[i].id == id) {
                c->subscriptions[i--] = c->subscriptions[--c->n_subscriptions];
            }
        }
        list = strpbrk(end, ",]");
    }
}

void web_foxglove_command(web *w, web_client *c, const char *json) {
    char op[32] = "";
    (void)web_json_find(json, "op", op, sizeof op);
    if (strcmp(op, "subscribe") == 0) {
        subscribe(w, c, json);
    } else if (strcmp(op, "unsubscribe") == 0) {
        unsubscribe(c, json);
    }
}

/* First entry of a signal in a frame's values. */
static int32_t first_value(const web *w, int32_t signal) {
    int32_t first = 0;
    for (int32_t i = 0; i < signal; i++) {
        first += web_signal(w, i)->n;
    }
    return first;
}

static int send_message(web *w, web_client *c, const web_subscription *s) {
    const int32_t signal = (int32_t)s->channel - 1;
    const double *frame = web_frame_at(w, c->next);
    const double *values = frame + WEB_HEAD + first_value(w, signal);
    const mhe_sink_signal *about = web_signal(w, signal);
    web_text t = {0};
    web_add(&t, "{");
    for (int32_t k = 0; k < about->n; k++) {
        web_add(&t, k == 0 ? "" : ",");
        web_add_text(&t, about->labels[k]);
        web_add(&t, ":");
        web_add_number(&t, values[k]);
    }
    web_add(&t, "}");
    int result = 0;
    if (!t.failed && t.n + 13 <= w->out_room) {
        uint8_t *out = w->out + LWS_PRE;
        const uint64_t ns = (uint64_t)(frame[1] > 0 ? 1e9 * frame[1] : 0);
        out[0] = MESSAGE_DATA;
        for (size_t i = 0; i < 4; i++) {
            out[1 + i] = (uint8_t)(s->id >> (8 * i));
        }
        for (size_t i = 0; i < 8; i++) {
            out[5 + i] = (uint8_t)(ns >> (8 * i));
        }
        memcpy(out + 13, t.text, t.n);
        result = web_write(w, c, 13 + t.n, 0);
    }
    free(t.text);
    return result;
}

int web_send_foxglove(web *w, web_client *c) {
    if (web_send_answer(w, c)) {
        return 0;
    }
    if (!c->told_run) {
        c->told_run = 1;
        advertise(w, c);
        return web_send_answer(w, c) < 0 ? -1 : 0;
    }
    if (c->next < w->n_frames && c->place >= c->n_subscriptions) {
        c->place = 0;
        c->next++;
    }
    if (c->next < w->n_frames && c->n_subscriptions > 0) {
        return send_message(w, c, &c->subscriptions[c->place++]);
    }
    c->next = w->n_frames; /* nobody asks for it */
    return 0;
}

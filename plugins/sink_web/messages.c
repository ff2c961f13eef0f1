/* SPDX-License-Identifier: Apache-2.0 */
/* messages.c: what our page and this sink say to each other.
 *
 * To the page: a text {"run": ...} once, texts {"state": ...} twice a second, answers {"done": ...}
 * or {"error": ...}; and frames, binary, little-endian: WEB_HEAD float64 (number, time, status,
 * iterations, solve time, latency, lost, latency when it was sent), then float32 for all signals in
 * the order of the description, NaN where there is none. From the page: texts {"do":
 * "record-start", "text": ..., "token": ...}. */
#include "web.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define STATE_EVERY 0.5  /* s */
#define PACE_MOST 1.0    /* s */
#define PACE_EARLY 0.002 /* s by which a frame may come before its time */

int web_describe(web *w) {
    web_text t = {0};
    web_add(&t, "{\"run\":{\"title\":");
    web_add_text(&t, w->run->title == NULL ? "" : w->run->title);
    web_add(&t, ",\"signals\":[");
    for (int32_t i = 0; i < w->run->n_signals; i++) {
        const mhe_sink_signal *s = web_signal(w, i);
        web_add(&t, i == 0 ? "{\"name\":" : ",{\"name\":");
        web_add_text(&t, s->name);
        web_add(&t, ",\"unit\":");
        web_add_text(&t, s->unit);
        web_add(&t, ",\"labels\":[");
        for (int32_t k = 0; k < s->n; k++) {
            web_add(&t, k == 0 ? "" : ",");
            web_add_text(&t, s->labels[k]);
        }
        web_add(&t, "]}");
    }
    web_add(&t, "]}}");
    w->description = t.text;
    return !t.failed;
}

static void answer(web_client *c, const char *key, const char *text) {
    web_text t = {0};
    web_add(&t, "{");
    web_add_text(&t, key);
    web_add(&t, ":");
    web_add_text(&t, text);
    web_add(&t, "}");
    web_answer(c, t.text);
}

/* Same time whether or not it is right. */
static int same_token(const char *a, const char *b) {
    unsigned char difference = strlen(a) != strlen(b);
    for (size_t i = 0; a[i] != '\0' && b[i] != '\0'; i++) {
        difference = (unsigned char)(difference | (a[i] ^ b[i]));
    }
    return difference == 0;
}

void web_command(web *w, web_client *c, const char *json) {
    static const char *const names[] = MHE_CONTROL_NAMES;
    char name[32] = "", token[64] = "", text[256] = "";
    mhe_error err = {0};
    (void)web_json_find(json, "token", token, sizeof token);
    (void)web_json_find(json, "text", text, sizeof text);
    if (!web_json_find(json, "do", name, sizeof name)) {
        answer(c, "error", "a message needs the key 'do'");
        return;
    }
    if (strcmp(name, "pace") == 0) { /* of its own frames: anybody may */
        c->pace = fmin(fmax(strtod(text, NULL), 0), PACE_MOST);
        answer(c, "done", name);
        return;
    }
    if (!w->config.open && !same_token(token, w->token)) {
        answer(c, "error", "not allowed: open the page by the address that mhe-live printed");
        return;
    }
    for (int32_t i = 0; i < (int32_t)(sizeof names / sizeof *names); i++) {
        if (strcmp(name, names[i]) == 0) {
            const mhe_status status =
                w->control == NULL
                    ? MHE_E_UNSUPPORTED
                    : w->control->request(w->control->data, MHE_CONTROL_STOP + i, text, &err);
            answer(c, status == MHE_OK ? "done" : "error", status == MHE_OK ? name : err.text);
            return;
        }
    }
    answer(c, "error",
           "'do' is none of stop, record-start, record-stop, mvc-start, mvc-stop, label, pace");
}

static int send_text(web *w, web_client *c, const char *text, size_t n) {
    if (n > w->out_room) {
        return 0; /* never: the room is that of the longest */
    }
    memcpy(w->out + LWS_PRE, text, n);
    return web_write(w, c, n, 1);
}

static int send_state(web *w, web_client *c) {
    char *out = (char *)w->out + LWS_PRE;
    static const char begin[] = "{\"state\":";
    memcpy(out, begin, sizeof begin - 1);
    const int32_t n = w->control->state(w->control->data, out + sizeof begin - 1,
                                        (int32_t)(w->out_room - sizeof begin - 1));
    const size_t length = sizeof begin - 1 + (size_t)n;
    out[length] = '}';
    return web_write(w, c, length + 1, 1);
}

static int send_frame(web *w, web_client *c) {
    const double *frame = web_frame_at(w, c->next++);
    uint8_t *out = w->out + LWS_PRE;
    double head[WEB_HEAD];
    memcpy(head, frame, sizeof head);
    head[6] += (double)c->lost;
    head[7] = web_now() - head[7];
    memcpy(out, head, sizeof head);
    for (int32_t i = 0; i < w->n_values; i++) {
        const float value = (float)frame[WEB_HEAD + i];
        memcpy(out + sizeof head + sizeof value * (size_t)i, &value, sizeof value);
    }
    return web_write(w, c, sizeof head + sizeof(float) * (size_t)w->n_values, 0);
}

int web_is_due(const web *w, const web_client *c) {
    return c->next < w->n_frames && (c->next < c->until || w->n_frames - c->next > WEB_FRAMES / 4 ||
                                     web_now() - c->served > c->pace - PACE_EARLY);
}

/* All frames that are there, in one go: a browser wakes once for them. */
static int send_frames(web *w, web_client *c, double now) {
    int result = 0;
    c->served = c->next < c->until ? c->served : now;
    c->until = w->n_frames;
    web_hold(c, 1);
    do {
        result = send_frame(w, c);
    } while (result == 0 && c->next < w->n_frames && !web_is_full(c));
    web_hold(c, 0);
    return result;
}

int web_send_page(web *w, web_client *c) {
    const double now = web_now();
    if (!c->told_run) {
        c->told_run = 1;
        return send_text(w, c, w->description, strlen(w->description));
    }
    if (web_send_answer(w, c)) {
        return 0;
    }
    if (w->control != NULL && now - c->told_state > STATE_EVERY) {
        c->told_state = now;
        return send_state(w, c);
    }
    return web_is_due(w, c) ? send_frames(w, c, now) : 0;
}

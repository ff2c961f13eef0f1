/* SPDX-License-Identifier: Apache-2.0 */
/* fuzz_web.c: any bytes as messages of two clients, a page and one of Foxglove: the first byte of a
 * line says whose it is. After each message both get what they are to be sent. Sockets are left
 * out: what would be written is looked at. */
#include "fuzz.h"
#include "web.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static char token[33] = "0123456789abcdef0123456789abcdef";

double web_now(void) {
    static double now = 0;
    return now += 0.1;
}

int web_write(web *w, web_client *c, size_t n, int text) {
    static volatile uint64_t sum; /* each byte is read, for the sanitizers */
    (void)c, (void)text;
    if (n > w->out_room) {
        abort();
    }
    for (size_t i = 0; i < n; i++) {
        sum = sum + w->out[LWS_PRE + i];
    }
    return 0;
}

void web_hold(const web_client *c, int on) {
    (void)c, (void)on;
}

int web_is_full(const web_client *c) {
    return c->next % 3 == 0;
}

/* ---- a run of two signals ---- */

static const char *const muscles[] = {"BRA", "BIC\"long\""}, *const joints[] = {"elbow"};
static const mhe_sink_signal signals[] = {
    {"force", "N", 2, muscles}, {"q", "rad", 1, joints}, {"none", "1", 0, NULL}};
static const mhe_sink_run run = {.size = sizeof run,
                                 .title = "fuzz",
                                 .n_signals = 3,
                                 .signal_size = sizeof *signals,
                                 .signals = signals};
static int32_t asked;

static mhe_status request(void *data, int32_t what, const char *text, mhe_error *err) {
    (void)data;
    if (what < MHE_CONTROL_STOP || what > MHE_CONTROL_LABEL || strlen(text) >= 256) {
        abort();
    }
    return ++asked % 3 == 0 ? mhe_fail(err, MHE_RETRY, "too many <requests> at once \"\\") : MHE_OK;
}

static int32_t state(void *data, char *json, int32_t size) {
    (void)data;
    memcpy(json, "{}", 2);
    return size > 2 ? 2 : 0;
}

static const mhe_sink_control control = {sizeof control, NULL, request, state};

static void hear(web *w, web_client *c, const char *line) {
    (c->foxglove ? web_foxglove_command : web_command)(w, c, line);
    for (int32_t i = 0; i < 8; i++) {
        if ((c->foxglove ? web_send_foxglove : web_send_page)(w, c) < 0 || c->next > w->n_frames ||
            c->n_subscriptions > WEB_SUBSCRIPTIONS || c->n_subscriptions < 0) {
            abort();
        }
    }
    if (c->answer != NULL && !c->foxglove) {
        abort(); /* it was to be sent first */
    }
}

static void next_frame(web *w) {
    double *frame = web_frame_at(w, w->n_frames++);
    for (int32_t i = 0; i < WEB_HEAD + w->n_values; i++) {
        frame[i] = i % 5 == 4 ? NAN : (double)(w->n_frames + i);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    web w = {.run = &run, .control = &control, .n_values = 3, .out_room = 16384};
    web_client page = {.wsi = NULL}, foxglove = {.foxglove = 1};
    char line[WEB_COMMAND];
    memcpy(w.token, token, sizeof token);
    w.out = malloc(LWS_PRE + w.out_room);
    w.frames = calloc((size_t)WEB_FRAMES * (size_t)(WEB_HEAD + w.n_values), sizeof *w.frames);
    if (w.out == NULL || w.frames == NULL || !web_describe(&w)) {
        abort();
    }
    web_foxglove_welcome(&w, &foxglove);
    while (size > 0) {
        const uint8_t *end = memchr(data, '\n', size);
        const size_t length = end == NULL ? size : (size_t)(end - data);
        const size_t kept = length < sizeof line ? length : sizeof line - 1;
        memcpy(line, data, kept);
        line[kept] = '\0';
        next_frame(&w);
        hear(&w, line[0] == 'f' ? &foxglove : &page, kept > 0 ? line + 1 : line);
        data += length + (end != NULL);
        size -= length + (end != NULL);
    }
    free(page.answer);
    free(foxglove.answer);
    free(w.description);
    free(w.frames);
    free(w.out);
    return 0;
}

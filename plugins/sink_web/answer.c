/* SPDX-License-Identifier: Apache-2.0 */
/* answer.c: what a client is told before its next frame. */
#include "web.h"

#include <stdlib.h>
#include <string.h>

void web_answer(web_client *c, char *text) {
    free(c->answer);
    c->answer = text;
}

int web_send_answer(web *w, web_client *c) {
    if (c->answer == NULL) {
        return 0;
    }
    const size_t n = strlen(c->answer);
    if (n > w->out_room) { /* an advertisement of many channels */
        uint8_t *grown = realloc(w->out, LWS_PRE + n);
        if (grown == NULL) {
            return -1;
        }
        w->out = grown;
        w->out_room = n;
    }
    memcpy(w->out + LWS_PRE, c->answer, n);
    free(c->answer);
    c->answer = NULL;
    return web_write(w, c, n, 1) < 0 ? -1 : 1;
}

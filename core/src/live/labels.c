/* SPDX-License-Identifier: Apache-2.0 */
/* labels.c: labels of streams get other names while it runs. */
#include "live/live_private.h"

#include <stdlib.h>
#include <string.h>

/* Length of a label without the axis of a marker ("STER.x"). */
static size_t base_length(const char *label, int32_t kind) {
    const size_t n = strlen(label);
    return kind == MHE_STREAM_MARKERS && n > 2 && label[n - 2] == '.' ? n - 2 : n;
}

static int is_same(const char *label, size_t length, const char *name) {
    return strlen(name) == length && strncmp(label, name, length) == 0;
}

static mhi_live_edit *find(const mhe_live *l, const char *label, size_t length) {
    for (int32_t i = 0; i < l->n_edits; i++) {
        if (is_same(label, length, l->edits[i].came)) {
            return &l->edits[i];
        }
    }
    return NULL;
}

mhe_status mhi_live_name(const mhe_live *l, mhi_packet *p, mhe_error *err) {
    mhi_stream *s = p->about;
    for (int32_t i = 0; i < s->n_channels && l->n_edits > 0; i++) {
        const size_t length = base_length(s->came[i], s->kind);
        const mhi_live_edit *edit = find(l, s->came[i], length);
        if (edit == NULL) {
            continue;
        }
        const char *axis = s->came[i] + length;
        const size_t room = strlen(edit->name) + strlen(axis) + 1;
        char *name = malloc(room);
        if (name == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
        (void)snprintf(name, room, "%s%s", edit->name, axis);
        free(s->labels[i]);
        s->labels[i] = name;
        s->named[i] = 1;
    }
    return MHE_OK;
}

/* The label that a stream's channel has now; NULL: no stream has such a channel. */
static const mhi_packet *find_stream(const mhe_live *l, const char *came) {
    for (const mhi_packet *p = l->streams; p != NULL; p = p->next) {
        for (int32_t i = 0; i < p->about->n_channels; i++) {
            const char *label = p->about->came[i];
            if (is_same(label, base_length(label, p->about->kind), came)) {
                return p;
            }
        }
    }
    return NULL;
}

static mhe_status set(mhe_live *l, const char *came, const char *name, mhe_error *err) {
    mhi_live_edit *edit = find(l, came, strlen(came));
    if (edit == NULL && l->n_edits == MHI_LIVE_EDITS) {
        return mhe_fail(err, MHE_E_ARGUMENT, "more than %d labels", MHI_LIVE_EDITS);
    }
    edit = edit == NULL ? &l->edits[l->n_edits++] : edit;
    (void)snprintf(edit->came, sizeof edit->came, "%s", came);
    (void)snprintf(edit->name, sizeof edit->name, "%s", name);
    return MHE_OK;
}

/* Two labels of a stream cannot be the same: the one that was called so gets the other's name. */
static mhe_status exchange(mhe_live *l, const mhi_stream *s, const char *came, const char *name,
                           mhe_error *err) {
    char before[128], other[128] = "";
    (void)snprintf(before, sizeof before, "%s", came);
    for (int32_t i = 0; i < s->n_channels; i++) {
        char now[512];
        const size_t then = base_length(s->came[i], s->kind);
        (void)mhi_inlet_name(l->run, s, i, now, sizeof now);
        if (is_same(s->came[i], then, came)) {
            (void)snprintf(before, sizeof before, "%.127s", now);
        } else if (strcmp(now, name) == 0 && then < sizeof other) {
            (void)snprintf(other, sizeof other, "%.*s", (int)then, s->came[i]);
        }
    }
    mhe_status status = set(l, came, name, err);
    if (status == MHE_OK && other[0] != '\0') {
        status = set(l, other, before, err);
    }
    return status;
}

mhe_status mhi_live_relabel(mhe_live *l, const char *text, mhe_error *err) {
    const char *name = strchr(text, '=');
    char came[128];
    if (name == NULL || name == text || name[1] == '\0' || strlen(name + 1) >= sizeof came ||
        (size_t)(name - text) >= sizeof came) {
        return mhe_fail(err, MHE_E_ARGUMENT, "'%.100s' is not CAME=MODEL", text);
    }
    (void)snprintf(came, sizeof came, "%.*s", (int)(name - text), text);
    const mhi_packet *of = find_stream(l, came);
    if (of == NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT, "no stream has a label '%s'", came);
    }
    l->edits = l->edits == NULL ? calloc(MHI_LIVE_EDITS, sizeof *l->edits) : l->edits;
    if (l->edits == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = exchange(l, of->about, came, name + 1, err);
    if (status == MHE_OK) {
        const mhi_stream *s = of->about;
        const mhe_stream_info info = {.size = sizeof info,
                                      .kind = s->kind,
                                      .name = s->name,
                                      .n_channels = s->n_channels,
                                      .labels = (const char *const *)s->came,
                                      .units = (const char *const *)s->units,
                                      .rate = s->rate,
                                      .up = s->up,
                                      .delay = s->delay,
                                      .named = s->named};
        mhi_packet *p = mhi_packet_stream(of->source, of->stream, &info);
        status =
            p == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : mhi_live_take(l, p, err);
    }
    return status;
}

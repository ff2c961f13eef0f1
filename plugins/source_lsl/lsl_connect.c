/* SPDX-License-Identifier: Apache-2.0 */
/* lsl_connect.c: opens a stream and reads what it says of itself. */
#include "source_lsl.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOST_CHANNELS 4096
#define PULL 512 /* samples at once */

static char *copy(const char *text) {
    char *out = strdup(text == NULL ? "" : text);
    for (char *c = out; c != NULL && *c != '\0'; c++) {
        if ((unsigned char)*c < ' ') {
            *c = ' ';
        }
    }
    return out;
}

void lsl_disconnect(lsl_source *source, lsl_stream *s) {
    lsl_close_lines(source, s);
    if (s->inlet != NULL) {
        source->lsl.destroy_inlet(s->inlet);
        s->inlet = NULL;
    }
    for (int32_t i = 0; i < s->n_channels; i++) {
        free(s->labels == NULL ? NULL : s->labels[i]);
        free(s->units == NULL ? NULL : s->units[i]);
    }
    free(s->labels);
    free(s->units);
    free(s->name);
    free(s->uid);
    free(s->values);
    free(s->stamps);
    lsl_stream fresh = {
        .predicate = s->predicate, .kind = s->kind, .search = s->search, .found = s->found};
    (void)snprintf(fresh.refused, sizeof fresh.refused, "%s", s->refused);
    *s = fresh;
}

/* Markers: the label without its axis, and the axis as ".x": "STER.x". Senders write types
 * PositionX .., and labels "STER_X", "STER.X", "STER X" or only "STER". */
static char *marker_label(const char *label, const char *type, const char *marker, int32_t i) {
    const char axes[] = "XYZ";
    size_t length = strlen(label);
    int32_t axis = i % 3;
    if (length > 2 && strchr("._- :", label[length - 2]) != NULL &&
        strchr("XYZxyz", label[length - 1]) != NULL) {
        axis = (int32_t)(strchr("XYZxyz", label[length - 1]) - "XYZxyz") % 3;
        length -= 2;
    }
    if (strncmp(type, "Position", 8) == 0 && type[8] != '\0' && strchr(axes, type[8]) != NULL) {
        axis = (int32_t)(strchr(axes, type[8]) - axes);
    }
    char *out = malloc(strlen(label) + strlen(marker) + 16);
    if (out != NULL && marker[0] != '\0') {
        (void)sprintf(out, "%s.%c", marker, "xyz"[axis]);
    } else if (out != NULL && length > 0) {
        (void)sprintf(out, "%.*s.%c", (int)length, label, "xyz"[axis]);
    } else if (out != NULL) {
        (void)sprintf(out, "point_%d.%c", (int)(i / 3 + 1), "xyz"[axis]);
    }
    return out;
}

static mhe_status read_channels(lsl_source *source, lsl_stream *s, lsl_streaminfo info,
                                mhe_error *err) {
    const lsl_library *l = &source->lsl;
    lsl_xml_ptr channel = l->child(l->child(l->get_desc(info), "channels"), "channel");
    for (int32_t i = 0; i < s->n_channels; i++) {
        const int there = !l->empty(channel);
        char *label = copy(there ? l->child_value_n(channel, "label") : "");
        s->units[i] = copy(there ? l->child_value_n(channel, "unit") : "");
        if (s->kind == MHE_STREAM_MARKERS && label != NULL) {
            char *of_marker = marker_label(label, there ? l->child_value_n(channel, "type") : "",
                                           there ? l->child_value_n(channel, "marker") : "", i);
            free(label);
            label = of_marker;
        } else if (label != NULL && label[0] == '\0') {
            free(label);
            label = malloc(24);
            if (label != NULL) {
                (void)snprintf(label, 24, "channel_%d", (int)i + 1);
            }
        }
        s->labels[i] = label;
        if (label == NULL || s->units[i] == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
        channel = there ? l->next_sibling_n(channel, "channel") : channel;
    }
    return MHE_OK;
}

static mhe_status read_info(lsl_source *source, lsl_stream *s, lsl_streaminfo info,
                            mhe_error *err) {
    const lsl_library *l = &source->lsl;
    s->format = l->get_channel_format(info);
    s->name = copy(l->get_name(info));
    s->uid = copy(l->get_uid(info));
    const int32_t n = l->get_channel_count(info);
    if (s->format == lsl_string || n < 1 || n > MOST_CHANNELS) {
        return mhe_fail(
            err, MHE_E_INPUT, "stream '%s' holds %s: %s", s->name == NULL ? "" : s->name,
            s->format == lsl_string ? "text" : "no channel, or too many", "numbers are needed");
    }
    s->n_channels = n;
    s->rate = l->get_nominal_srate(info);
    s->rate = isfinite(s->rate) && s->rate > 0 ? s->rate : 0;
    s->room = PULL;
    s->labels = calloc((size_t)n, sizeof *s->labels);
    s->units = calloc((size_t)n, sizeof *s->units);
    s->values = calloc((size_t)n * s->room, sizeof *s->values);
    s->stamps = calloc(s->room, sizeof *s->stamps);
    if (s->labels == NULL || s->units == NULL || s->values == NULL || s->stamps == NULL ||
        s->name == NULL || s->uid == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    return read_channels(source, s, info, err);
}

mhe_status lsl_connect(lsl_source *source, lsl_stream *s, lsl_streaminfo info, double clock,
                       mhe_error *err) {
    const lsl_library *l = &source->lsl;
    int32_t code = 0;
    lsl_streaminfo whole = NULL;
    mhe_status status = MHE_OK;
    /* The library's own way to find a sender again passes over other labels: it is not used. */
    s->inlet = l->create_inlet(info, (int32_t)ceil(source->config.buffer), 0, 0);
    if (s->inlet != NULL) {
        whole = l->get_fullinfo(s->inlet, LSL_ANSWER, &code);
    }
    if (whole == NULL) {
        status = mhe_fail(err, MHE_RETRY, "a stream with %s does not answer", s->predicate);
    } else {
        status = read_info(source, s, whole, err);
        l->destroy_streaminfo(whole);
    }
    if (status == MHE_OK) {
        l->open_stream(s->inlet, LSL_ANSWER, &code);
        status = code == lsl_no_error
                     ? MHE_OK
                     : mhe_fail(err, MHE_RETRY, "stream '%s' does not open", s->name);
    }
    if (status != MHE_OK) {
        lsl_disconnect(source, s);
        return status;
    }
    /* The first measurement of its clock takes packets to and fro; later ones are made behind the
     * scenes, and asking for them does not wait. */
    const double offset = l->time_correction(s->inlet, clock, &code);
    s->has_offset = code == lsl_no_error && isfinite(offset);
    s->offset = s->has_offset ? offset : 0;
    lsl_open_lines(source, s, info);
    s->newest = s->asked = lsl_now();
    return MHE_OK;
}

/* SPDX-License-Identifier: Apache-2.0 */
/* lsl_lines.c: several connections to one stream; the first that has a sample gives it.
 *
 * Outlets of liblsl before 1.14 do not wake for a sample: for each connection a thread looks once a
 * millisecond whether there is one (consumer_queue::pop_sample). A sample therefore waits for half
 * a millisecond in the mean, on each connection for another time. Of two connections the faster
 * one waits a third of a millisecond, of four a fifth.
 *
 * All connections carry the same samples in the same order. Each remembers the stamps of samples
 * that others gave before it. The main one gives what nobody gave yet, whatever happens to the
 * others; another gives a sample only as long as it is seen to go along with the rest. */
#include "source_lsl.h"

#include <string.h>

void lsl_open_lines(lsl_source *source, lsl_stream *s, lsl_streaminfo info) {
    const lsl_library *l = &source->lsl;
    s->n_lines = 1;
    s->lines[0] = (lsl_line){.inlet = s->inlet};
    const int frames = s->kind != MHE_STREAM_EMG && s->rate > 0;
    for (int32_t i = 1; i < source->config.connections && frames; i++) {
        int32_t code = 0;
        lsl_inlet inlet = l->create_inlet(info, (int32_t)source->config.buffer + 1, 0, 0);
        if (inlet != NULL) {
            l->open_stream(inlet, LSL_ANSWER, &code);
        }
        if (inlet != NULL && code != lsl_no_error) {
            l->destroy_inlet(inlet);
        } else if (inlet != NULL) {
            s->lines[s->n_lines++] = (lsl_line){.inlet = inlet};
        }
    }
}

void lsl_close_lines(lsl_source *source, lsl_stream *s) {
    for (int32_t i = 1; i < s->n_lines; i++) {
        if (s->lines[i].inlet != NULL) {
            source->lsl.destroy_inlet(s->lines[i].inlet);
        }
    }
    s->n_lines = 0;
}

/* Whether another gave this sample before; it and those before it are forgotten. */
static int was_given(lsl_line *line, double stamp) {
    for (int32_t i = 0; i < line->n; i++) {
        if (memcmp(&line->given[(line->first + i) % LSL_GIVEN], &stamp, sizeof stamp) == 0) {
            line->first = (line->first + i + 1) % LSL_GIVEN;
            line->n -= i + 1;
            return 1;
        }
    }
    return 0;
}

static void remember(lsl_line *line, double stamp) {
    if (line->n == LSL_GIVEN) { /* it is far behind: the oldest is forgotten */
        line->first = (line->first + 1) % LSL_GIVEN;
        line->n--;
    }
    line->given[(line->first + line->n++) % LSL_GIVEN] = stamp;
}

static int gives(lsl_stream *s, lsl_line *line, double stamp) {
    const int main_one = line == s->lines;
    if (was_given(line, stamp)) {
        line->goes_along = 1;
        return 0;
    }
    if (!main_one &&
        (!line->goes_along || line->n > 0 || s->lines[0].n == LSL_GIVEN /* it has stopped */)) {
        line->goes_along = 0;
        return 0;
    }
    line->n = 0;
    for (int32_t i = 0; i < s->n_lines; i++) {
        if (&s->lines[i] != line) {
            remember(&s->lines[i], stamp);
        }
    }
    return 1;
}

int32_t lsl_take_new(lsl_stream *s, int32_t line, int32_t n) {
    const size_t width = (size_t)s->n_channels;
    int32_t kept = 0;
    for (int32_t i = 0; i < n; i++) {
        if (gives(s, &s->lines[line], s->stamps[i])) {
            s->stamps[kept] = s->stamps[i];
            memmove(s->values + (size_t)kept * width, s->values + (size_t)i * width,
                    sizeof(double) * width);
            kept++;
        }
    }
    return kept;
}

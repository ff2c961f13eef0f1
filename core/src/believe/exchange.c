/* SPDX-License-Identifier: Apache-2.0 */
#include "believe/exchange.h"

#include "base/arena.h"
#include "estimator/start.h"

#include <math.h>
#include <string.h>

#define FRAMES 10        /* of the recording that are looked at */
#define TRIES 4          /* postures that the first frame is looked for from */
#define FOUND 1e-5       /* rad or m: a posture that moves less is found */
#define FITS_BETTER 0.75 /* of the RMS distance that must not remain */

typedef struct search {
    const mhi_recording *recording;
    mhi_system_context *context;
    mhi_start *start;
    mhi_work work; /* all pairs of many markers could take minutes */
    int32_t n_k;
    int32_t *column; /* [n_k] whose measurements stand for a marker */
    double *q, *markers;
    mhi_arena arena;
} search;

static int search_open(search *s, const mhi_system *system, const mhi_recording *recording) {
    const mhe_description *d = mhi_system_description(system);
    s->recording = recording;
    s->n_k = d->n_markers;
    s->column = MHI_TAKE(&s->arena, int32_t, s->n_k);
    s->q = MHI_TAKE(&s->arena, double, d->n_coordinates);
    s->markers = MHI_TAKE(&s->arena, double, 3 * s->n_k);
    for (int32_t i = 0; i < s->n_k && s->column != NULL; i++) {
        s->column[i] = i;
    }
    if (s->column == NULL || s->q == NULL || s->markers == NULL ||
        mhi_system_context_create(system, &s->context, NULL) != MHE_OK ||
        mhi_start_create(system, s->context, &s->start, NULL) != MHE_OK) {
        return 0;
    }
    mhi_start_set_enough(s->start, FOUND);
    mhi_start_set_tries(s->start, TRIES);
    mhi_work_begin(&s->work, mhi_start_affordable(s->start), 0);
    mhi_system_context_set_work(s->context, &s->work);
    return 1;
}

static void search_close(search *s) {
    mhi_start_free(s->start);
    mhi_system_context_free(s->context);
    mhi_arena_free(&s->arena);
}

static void swap(search *s, int32_t a, int32_t b) {
    const int32_t column = s->column[a];
    s->column[a] = s->column[b];
    s->column[b] = column;
}

/* RMS over the frames of the distance from the nearest posture with the labels as they are; NaN:
 * not known. */
static double fit(search *s) {
    const mhi_recording *r = s->recording;
    const size_t bytes = 3 * sizeof(double);
    double squares = 0;
    int32_t n = 0;
    for (int32_t f = 0; f < FRAMES; f++) {
        const ptrdiff_t k = (2 * f + 1) * (ptrdiff_t)r->n_frames / (2 * FRAMES);
        for (int32_t i = 0; i < s->n_k; i++) {
            memcpy(s->markers + 3 * i, r->markers + 3 * (k * s->n_k + s->column[i]), bytes);
        }
        double rms = NAN;
        const mhe_status status =
            (n == 0 ? mhi_start_search : mhi_start_posture)(s->start, s->markers, s->q, &rms, NULL);
        if (status == MHE_OK && !isnan(rms)) {
            squares += rms * rms;
            n++;
        }
    }
    return n == 0 ? NAN : sqrt(squares / n);
}

int32_t mhi_exchange_find(const mhi_system *system, const mhi_recording *recording,
                          const uint8_t *suspect, mhi_exchange *out, int32_t most) {
    search s = {0};
    int32_t n = 0;
    if (recording->markers == NULL || !search_open(&s, system, recording)) {
        search_close(&s);
        return 0;
    }
    for (double now = fit(&s); n < most; now = out[n++].fixed) {
        mhi_exchange best = {.as_is = now, .fixed = INFINITY};
        mhi_work_begin(&s.work, mhi_start_affordable(s.start), 0); /* for all pairs once */
        for (int32_t a = 0; a < s.n_k; a++) {
            for (int32_t b = a + 1; b < s.n_k && !mhi_work_spent(&s.work); b++) {
                if (!suspect[a] && !suspect[b]) {
                    continue;
                }
                swap(&s, a, b);
                const double fixed = fit(&s);
                swap(&s, a, b);
                best = fixed < best.fixed ? (mhi_exchange){a, b, now, fixed} : best;
            }
        }
        if (!(best.fixed < FITS_BETTER * now)) {
            break;
        }
        swap(&s, best.a, best.b);
        out[n] = best;
    }
    search_close(&s);
    return n;
}

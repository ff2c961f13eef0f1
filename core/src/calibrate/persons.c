/* SPDX-License-Identifier: Apache-2.0 */
/* persons.c: are all recordings of one person, and none there twice? Markers of one body keep their
 * distance. */
#include "calibrate/calibrate.h"

#include <math.h>
#include <string.h>

#define FARTHEST 0.008   /* m that skin, and a day between two recordings, may change a distance */
#define SHARE 0.08       /* ... and which part of it */
#define ANOTHER_UNIT 2.2 /* times: no two persons differ so */

/* Mean distance of two markers over a recording; NaN: never seen together. */
static double distance(const mhi_recording *r, int32_t n_k, int32_t a, int32_t b) {
    double sum = 0, n = 0;
    for (int32_t f = 0; f < r->n_frames; f++) {
        const double *at = r->markers + (ptrdiff_t)f * 3 * n_k;
        double squares = 0;
        for (int32_t i = 0; i < 3; i++) {
            const double d = at[3 * a + i] - at[3 * b + i];
            squares += d * d;
        }
        sum += isnan(squares) ? 0 : sqrt(squares);
        n += !isnan(squares);
    }
    return n > 0 ? sum / n : NAN;
}

/* What differs most between two recordings. */
typedef struct odd {
    int32_t a, b;
    double one, other, off;
} odd;

static odd farthest(const mhe_description *model, const mhi_recording *one,
                    const mhi_recording *other) {
    odd most = {.off = 0};
    for (int32_t a = 0; a < model->n_markers; a++) {
        for (int32_t b = 0; b < a; b++) {
            if (model->markers[a].body != model->markers[b].body) {
                continue;
            }
            const double x = distance(one, model->n_markers, a, b);
            const double y = distance(other, model->n_markers, a, b), off = fabs(x - y);
            if (off > fmax(FARTHEST, SHARE * fmax(x, y)) && off > most.off) {
                most = (odd){a, b, x, y, off};
            }
        }
    }
    return most;
}

static int same_values(const double *a, const double *b, ptrdiff_t n) {
    return a == NULL || b == NULL ? a == b : memcmp(a, b, sizeof *a * (size_t)n) == 0;
}

/* Of one recording, whatever its files are called. */
static int is_copy(const mhe_description *model, const mhi_recording *a, const mhi_recording *b) {
    const ptrdiff_t n = a->n_frames;
    return a->n_frames == b->n_frames &&
           same_values(a->markers, b->markers, n * 3 * model->n_markers) &&
           same_values(a->emg, b->emg, n * model->n_muscles) &&
           same_values(a->angles, b->angles, n * model->n_coordinates);
}

static const char *name_of(const mhi_motion *m) {
    return m->run.data.markers != NULL ? m->run.data.markers : m->run.data.angles;
}

void mhi_calibration_tell_copies(const mhi_calibration *c) {
    for (int32_t i = 1; i < c->plan.n_recordings; i++) {
        const int32_t held = c->plan.recordings[i].hold_out;
        for (int32_t k = 0; k < i; k++) {
            if (!is_copy(c->model, c->motions[k].recording, c->motions[i].recording)) {
                continue;
            }
            mhi_text line = {0};
            mhi_text_add(&line, "recordings %d (%s) and %d (%s) are the same: %s", (int)k + 1,
                         name_of(&c->motions[k]), (int)i + 1, name_of(&c->motions[i]),
                         held != c->plan.recordings[k].hold_out
                             ? "what is held out was learned from"
                             : "it counts twice");
            if (!line.failed) {
                c->host->log(c->host, MHE_LOG_WARNING, line.data);
            }
            mhi_text_free(&line);
            break;
        }
    }
}

mhe_status mhi_calibration_check_person(const mhi_calibration *c, mhe_error *err) {
    const mhi_motion *first = NULL;
    for (int32_t i = 0; i < c->plan.n_recordings; i++) {
        const mhi_motion *m = &c->motions[i];
        if (m->recording->markers == NULL) {
            continue;
        }
        if (first == NULL) {
            first = m;
            continue;
        }
        const odd most = farthest(c->model, first->recording, m->recording);
        const double times = most.other / most.one;
        if (most.off > 0 && (times > ANOTHER_UNIT || times < 1 / ANOTHER_UNIT)) {
            return mhe_fail(err, MHE_E_INPUT,
                            "%s: markers %s and %s are %.4g times as far apart as in %s: another "
                            "unit (mm, m, inches)?",
                            m->run.data.markers, c->model->markers[most.b].name,
                            c->model->markers[most.a].name, times, first->run.data.markers);
        }
        if (most.off > 0) {
            return mhe_fail(err, MHE_E_INPUT,
                            "%s: markers %s and %s are %.0f mm apart, and %.0f mm in %s: one "
                            "person, with the markers where they were, is needed",
                            m->run.data.markers, c->model->markers[most.b].name,
                            c->model->markers[most.a].name, 1e3 * most.other, 1e3 * most.one,
                            first->run.data.markers);
        }
    }
    return MHE_OK;
}

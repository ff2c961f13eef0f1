/* SPDX-License-Identifier: Apache-2.0 */
/* persons.c: are all recordings of one person? Markers of one body keep their distance. */
#include "calibrate/calibrate.h"

#include <math.h>

#define FARTHEST 0.008 /* m that skin, and a day between two recordings, may change a distance */
#define SHARE 0.08     /* ... and which part of it */

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

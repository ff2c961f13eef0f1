/* SPDX-License-Identifier: Apache-2.0 */
/* doubts.c: what is odd about the plan and its recordings, told before anything is learned. */
#include "base/text.h"
#include "calibrate/calibrate.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

#define FAINT 0.005 /* of what a muscle reaches in another recording: rest is a hundredth */
#define SILENT 0.01 /* of the MVC: below it no muscle of a recording does anything */

MHE_PRINTF(2, 3)
static void tell(const mhi_calibration *c, const char *format, ...) {
    char line[MHE_ERROR_TEXT];
    va_list args;
    va_start(args, format);
    (void)vsnprintf(line, sizeof line, format, args);
    va_end(args);
    c->host->log(c->host, MHE_LOG_WARNING, line);
}

/* Is any of these numbers there in any frame? */
static int32_t is_there(const double *values, int32_t n_frames, int32_t width, int32_t first) {
    for (int32_t k = 0; k < n_frames; k++) {
        if (!isnan(values[(ptrdiff_t)k * width + first])) {
            return 1;
        }
    }
    return 0;
}

static void tell_absent(const mhi_calibration *c, const mhi_motion *m) {
    const mhi_recording *r = m->recording;
    const int32_t n_k = c->model->n_markers, n_m = c->model->n_muscles;
    mhi_text markers = {0}, muscles = {0};
    for (int32_t i = 0; i < n_k && r->markers != NULL; i++) {
        if (!is_there(r->markers, r->n_frames, 3 * n_k, 3 * i)) {
            mhi_text_add(&markers, " %s", c->model->markers[i].name);
        }
    }
    for (int32_t i = 0; i < n_m && r->emg != NULL; i++) {
        if (!is_there(r->emg, r->n_frames, n_m, i)) {
            mhi_text_add(&muscles, " %s", c->model->muscles[i].name);
        }
    }
    if (markers.length > 0) {
        tell(c, "%s: markers that are missing in every frame:%s; nothing is learned of them here",
             m->run.data.markers, markers.data);
    }
    if (muscles.length > 0 && r->emg != NULL) {
        tell(c, "%s: muscles without EMG in any frame:%s; their strength follows from the others'",
             m->run.data.emg, muscles.data);
    }
    mhi_text_free(&markers);
    mhi_text_free(&muscles);
}

static double most_of(const mhi_recording *r, int32_t n_m, int32_t muscle) {
    double most = 0;
    for (int32_t k = 0; r->emg != NULL && k < r->n_frames; k++) {
        most = fmax(most, r->emg[(ptrdiff_t)k * n_m + muscle]);
    }
    return most;
}

/* A channel that is hardly there in one recording, and well in another. */
static void tell_faint(const mhi_calibration *c, const mhi_motion *m) {
    const int32_t n_m = c->model->n_muscles;
    mhi_text names = {0};
    for (int32_t i = 0; i < n_m && m->recording->emg != NULL; i++) {
        const double here = most_of(m->recording, n_m, i);
        double most = 0;
        for (int32_t k = 0; k < c->plan.n_recordings; k++) {
            most = fmax(most, most_of(c->motions[k].recording, n_m, i));
        }
        if (here > 0 && here < FAINT * most) {
            mhi_text_add(&names, " %s", c->model->muscles[i].name);
        }
    }
    if (names.length > 0) {
        tell(c,
             "%s: EMG of a two-hundredth of what another recording has:%s; another unit there, or "
             "an electrode that was off?",
             m->run.data.emg, names.data);
    }
    mhi_text_free(&names);
}

static mhe_status check_level(const mhi_calibration *c, const mhi_motion *m, mhe_error *err) {
    const mhi_recording *r = m->recording;
    double most = r->emg == NULL ? INFINITY : 0;
    for (ptrdiff_t i = 0; r->emg != NULL && i < (ptrdiff_t)r->n_frames * c->model->n_muscles; i++) {
        most = fmax(most, r->emg[i]);
    }
    return most >= SILENT
               ? MHE_OK
               : mhe_fail(err, MHE_E_INPUT,
                          "%s: no muscle reaches 1 %% of its MVC (the most is %.2g): are "
                          "EMG and MVC in the same unit (V, mV, uV), and of the same "
                          "processing?",
                          m->run.data.emg, most);
}

static void doubt_plan(const mhi_calibration *c) {
    for (int32_t i = 0; i < c->plan.n_entries; i++) {
        const mhi_plan_entry *e = &c->plan.entries[i];
        if (e->sd > e->upper - e->lower) {
            tell(
                c,
                "calibrate.parameters: %s: 'sd' is %g, wider than its bounds, %g .. %g: nothing is "
                "expected beforehand (it is in the same unit as they: a factor, m or s)",
                mhi_plan_names[e->kind], e->sd, e->lower, e->upper);
        }
    }
    double longest = 0;
    for (int32_t i = 0; i < c->plan.n_recordings; i++) {
        const mhi_recording *r = c->motions[i].recording;
        longest = fmax(longest, r->time[r->n_frames - 1] - r->time[0]);
    }
    if (c->plan.noise_time > longest) {
        tell(c,
             "calibrate.noise_time: %g s is longer than each recording (%.3g s at most): a whole "
             "recording counts as less than one measurement",
             c->plan.noise_time, longest);
    }
}

mhe_status mhi_calibration_doubt(const mhi_calibration *c, mhe_error *err) {
    mhe_status status = MHE_OK;
    doubt_plan(c);
    for (int32_t i = 0; i < c->plan.n_recordings && status == MHE_OK; i++) {
        tell_absent(c, &c->motions[i]);
        tell_faint(c, &c->motions[i]);
        status = check_level(c, &c->motions[i], err);
    }
    return status;
}

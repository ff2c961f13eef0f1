/* SPDX-License-Identifier: Apache-2.0 */
#include "understood.h"

#include <math.h>
#include <string.h>

/* Measured values of one source at a frame; NULL: it has none. */
static const double *values_of(const mhe_recording *recording, int32_t k, int32_t source) {
    mhe_frame frame = {.size = sizeof frame};
    if (mhe_recording_frame(recording, k, &frame, NULL) != MHE_OK) {
        return NULL;
    }
    return source == 0 ? frame.markers : source == 1 ? frame.emg : frame.angles;
}

/* Frames from first to last with any of n values; 0: there is none. */
static int32_t span_of(const mhe_recording_info *m, const mhe_recording *recording, int32_t source,
                       int32_t n, double span[2]) {
    int32_t found = 0;
    for (int32_t k = 0; k < m->n_frames; k++) {
        const double *values = values_of(recording, k, source);
        int32_t there = 0;
        for (int32_t i = 0; i < n && values != NULL && !there; i++) {
            there = !isnan(values[i]);
        }
        if (there) {
            span[0] = found == 0 ? m->time[k] : span[0];
            span[1] = m->time[k];
            found++;
        }
    }
    return found;
}

/* Names of which a value is there; the others behind "without:". */
static void add_names(mhi_text *out, const char *what, const char *const *names, int32_t n,
                      const mhe_recording_info *m, const mhe_recording *recording, int32_t source) {
    const int32_t width = source == 0 ? 3 : 1;
    mhi_text with = {0}, without = {0};
    int32_t n_with = 0;
    for (int32_t i = 0; i < n; i++) {
        int32_t there = 0;
        for (int32_t k = 0; k < m->n_frames && !there; k++) {
            const double *values = values_of(recording, k, source);
            there = values != NULL && !isnan(values[i * width]);
        }
        mhi_text *list = there ? &with : &without;
        mhi_text_add(list, "%s%s", list->length == 0 ? "" : ", ", names[i]);
        n_with += there;
    }
    mhi_text_add(out, "%s: %d of %d: %s", what, n_with, n, with.data == NULL ? "" : with.data);
    if (without.length > 0 && n_with > 0) {
        mhi_text_add(out, "; without: %s", without.data);
    }
    mhi_text_add(out, "\n");
    mhi_text_free(&with);
    mhi_text_free(&without);
}

static void add_list(mhi_text *out, const char *what, const char *const *names, int32_t n) {
    mhi_text_add(out, "%s: %d", what, n);
    for (int32_t i = 0; i < n; i++) {
        mhi_text_add(out, "%s%s", i == 0 ? ": " : ", ", names[i]);
    }
    mhi_text_add(out, "\n");
}

void understood_lines(const mhe_estimator_info *info, const mhe_recording_info *m,
                      const mhe_recording *recording, mhi_text *out) {
    const struct {
        const char *what, *list;
        int32_t there, width, n;
        const char *const *names;
    } sources[] = {{"markers", "markers of the model in the file", m->has_markers,
                    3 * info->n_markers, info->n_markers, info->marker_names},
                   {"EMG", "muscles with EMG", m->has_emg, info->n_muscles, info->n_muscles,
                    info->muscle_names},
                   {"angles", "measured coordinates", m->has_angles, info->n_q, info->n_q,
                    info->coordinate_names}};
    double from = -INFINITY, to = INFINITY;
    int32_t n_sources = 0;
    add_list(out, "coordinates", info->coordinate_names, info->n_q);
    add_list(out, "muscles", info->muscle_names, info->n_muscles);
    mhi_text_add(out, "frames: %d at %.6g Hz, %.6g to %.6g s\n", m->n_frames, m->rate, m->time[0],
                 m->time[m->n_frames - 1]);
    for (int32_t i = 0; i < 3; i++) {
        double span[2] = {NAN, NAN};
        if (!sources[i].there) {
            continue;
        }
        const int32_t n = span_of(m, recording, i, sources[i].width, span);
        n_sources++;
        mhi_text_add(out, "%s: %.6g to %.6g s, in %.4g %% of the frames\n", sources[i].what,
                     span[0], span[1], 100.0 * n / m->n_frames);
        from = fmax(from, span[0]);
        to = fmin(to, span[1]);
        add_names(out, sources[i].list, sources[i].names, sources[i].n, m, recording, i);
    }
    if (n_sources > 1 && from < to) {
        mhi_text_add(out, "overlap of all: %.6g to %.6g s\n", from, to);
    } else if (n_sources > 1) {
        mhi_text_add(out, "overlap of all: none\n");
    }
    if (m->has_markers) {
        mhi_text_add(out, "unit of the markers: %s\n", m->marker_unit_name);
    }
    mhi_text_add(out, "window: %d intervals of %.4g s; solver %s\n", info->window,
                 info->ratio / m->rate, info->solver);
}

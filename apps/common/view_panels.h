/* SPDX-License-Identifier: Apache-2.0 */
/* view_panels.h: the parts of a page of results, as JSON. */
#ifndef VIEW_PANELS_H
#define VIEW_PANELS_H

#include "base/text.h"
#include "rows.h"

#include <mhe/figure.h>

/* Tables of a folder; those that it lacks are empty. */
enum {
    VIEW_Q,
    VIEW_ACTIVATION,
    VIEW_FORCE,
    VIEW_DISTANCE,
    VIEW_EMG,
    VIEW_QUALITY,
    VIEW_MARKERS,
    VIEW_TRUTH,
    VIEW_SD,
    VIEW_TABLES
};

typedef struct view_tables {
    rows table[VIEW_TABLES];
    const char *q_prefix, *a_prefix; /* of the columns in theirs */
} view_tables;

/* Numbers as base64 of float32, little-endian, quoted. */
void view_numbers(mhi_text *out, const float *values, size_t n);

/* "times":[...],"groups":[...]: small pictures of each quantity, estimated, measured, true. */
void view_add_panels(mhi_text *out, const view_tables *t);

/* "up":..,"time":[...],"status":[...],"signals":[...],"values":"...": what the figure and the
 * numbers show at moments of the run, as live frames. `figure` may be NULL. */
mhe_status view_add_moments(mhi_text *out, const view_tables *t, mhe_figure *figure,
                            mhe_error *err);

#endif

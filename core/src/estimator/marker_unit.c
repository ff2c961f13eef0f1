/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/marker_unit.h"

#include "base/values.h"

#include <math.h>
#include <stdlib.h>

#define RATIOS_MAX 20000 /* more do not make the median better */
#define SAME_SIZE 2.0    /* people differ by less from their model */
#define FARTHEST 1e5     /* m: no marker is there, in whatever unit it is given */
#define CLOSEST 0.01     /* m: closer pairs say more about the skin than about the unit */

static double distance(const double *a, const double *b) {
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                (a[2] - b[2]) * (a[2] - b[2]));
}

/* Median, over pairs of markers on one body and over frames, of the measured distance divided by
 * the model's; NaN where no pair was seen. */
static double marker_scale(const mhe_description *model, const double *markers, int32_t n_frames) {
    const int32_t n_k = model->n_markers, every = n_frames / 100 + 1;
    double *ratios = malloc(sizeof *ratios * RATIOS_MAX);
    int32_t n = 0;
    for (int32_t k = 0; k < n_frames && ratios != NULL; k += every) {
        const double *row = markers + (ptrdiff_t)k * 3 * n_k;
        for (int32_t i = 0; i < n_k; i++) {
            for (int32_t j = i + 1; j < n_k && n < RATIOS_MAX; j++) {
                const mhe_marker *a = &model->markers[i], *b = &model->markers[j];
                const double known = distance(a->location, b->location);
                const double seen = distance(row + (ptrdiff_t)3 * i, row + (ptrdiff_t)3 * j);
                if (a->body == b->body && known > CLOSEST && isfinite(seen)) {
                    ratios[n++] = seen / known;
                }
            }
        }
    }
    double median = NAN;
    if (n > 0) {
        mhi_sort(ratios, n);
        median = ratios[n / 2];
    }
    free(ratios);
    return median;
}

/* The power of ten that the measured distances are too large by, as a wrong unit makes them; 1
 * where it is none. */
static double unit_error(double scale) {
    static const double errors[] = {1e-3, 1e-2, 10, 100, 1000};
    for (size_t i = 0; i < sizeof errors / sizeof errors[0]; i++) {
        if (scale > errors[i] / SAME_SIZE && scale < errors[i] * SAME_SIZE) {
            return errors[i];
        }
    }
    return 1;
}

void mhi_marker_settle_unit(mhi_recording *r, const mhe_description *d, double factor,
                            const char *path, const mhe_host *host) {
    static const struct {
        const char *name;
        double metres;
    } units[] = {{"mm", 1e-3}, {"cm", 1e-2}, {"m", 1}};
    const double scale = factor * marker_scale(d, r->markers, r->n_frames);
    const double wrong = unit_error(scale), metres = r->unit / wrong;
    const char *name = NULL;
    for (size_t i = 0; i < sizeof units / sizeof units[0]; i++) {
        name = fabs(metres / units[i].metres - 1) < 1e-6 ? units[i].name : name;
    }
    char line[512];
    if (wrong != 1 && name != NULL) {
        (void)snprintf(line, sizeof line,
                       "%.300s: says %s, but the markers of a segment are %.3g times as far apart "
                       "as in the model: they are taken as %s",
                       path, r->unit_name, scale, name);
        for (ptrdiff_t i = 0; i < (ptrdiff_t)r->n_frames * 3 * d->n_markers; i++) {
            r->markers[i] /= wrong;
        }
        r->unit = metres;
        (void)snprintf(r->unit_name, sizeof r->unit_name, "%s", name);
        host->log(host, MHE_LOG_WARNING, line);
    } else if (scale < 0.5 || scale > 2) { /* not of NaN */
        (void)snprintf(line, sizeof line,
                       "%.300s: the markers of a segment are %.3g times as far apart as in the "
                       "model: is it of this person, are the labels right?",
                       path, scale);
        host->log(host, MHE_LOG_WARNING, line);
    }
}

void mhi_marker_leave_out_distant(mhi_recording *r, int32_t n_markers, const char *path,
                                  const mhe_host *host) {
    ptrdiff_t n = 0;
    for (ptrdiff_t i = 0; i < (ptrdiff_t)r->n_frames * n_markers; i++) {
        double *p = r->markers + 3 * i;
        if (fabs(p[0]) > FARTHEST || fabs(p[1]) > FARTHEST || fabs(p[2]) > FARTHEST) {
            p[0] = p[1] = p[2] = NAN;
            n++;
        }
    }
    if (n > 0) {
        char line[512];
        (void)snprintf(
            line, sizeof line,
            "%.300s: %td samples of a marker are more than %g km away: taken as gaps; is "
            "the file whole?",
            path, n, 1e-3 * FARTHEST);
        host->log(host, MHE_LOG_WARNING, line);
    }
}

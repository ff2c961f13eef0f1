/* SPDX-License-Identifier: Apache-2.0 */
#include "believe/believe.h"

#include "base/pi.h"

#include <math.h>
#include <string.h>

#define DEGREE (MHI_PI / 180)
#define SLACK 0.1     /* rad or m: so far people move beyond a model's range */
#define OFTEN 0.05    /* share of the frames */
#define FULL_TURN 6.3 /* no joint moves further, in rad */

typedef struct span {
    double low, high;
    int32_t n, n_outside;
} span;

static span span_of(const mhe_description *d, const mhi_recording *r, int32_t i) {
    const mhe_coordinate *c = &d->coordinates[i];
    span s = {INFINITY, -INFINITY, 0, 0};
    for (int32_t k = 0; k < r->n_frames; k++) {
        const double q = r->angles[(ptrdiff_t)k * d->n_coordinates + i];
        if (!isnan(q)) {
            s.low = fmin(s.low, q);
            s.high = fmax(s.high, q);
            s.n++;
            s.n_outside += q < c->lower - SLACK || q > c->upper + SLACK;
        }
    }
    return s;
}

/* Values that as degrees lie in the range, and as radians do not: the coordinate's number. */
static int32_t find_degrees(const mhe_description *d, const mhi_recording *r, span *found) {
    int32_t first = -1;
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        const mhe_coordinate *c = &d->coordinates[i];
        const span s = span_of(d, r, i);
        if (!c->rotational || s.n == 0) {
            continue;
        }
        const double most = fmax(fabs(s.low), fabs(s.high));
        const int outside = s.n_outside > OFTEN * s.n || most > FULL_TURN;
        const int fits =
            s.low * DEGREE > c->lower - 2 * SLACK && s.high * DEGREE < c->upper + 2 * SLACK;
        if (outside && fits && most > 2) {
            *found = first < 0 ? s : *found;
            first = first < 0 ? i : first;
        }
    }
    return first;
}

/* Converted from degrees, and so small that they were radians already. */
static int32_t hardly_moves(const mhe_description *d, const mhi_recording *r, double *most) {
    *most = 0;
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        const span s = span_of(d, r, i);
        if (d->coordinates[i].rotational && s.n > 0) {
            *most = fmax(*most, fmax(fabs(s.low), fabs(s.high)));
        }
    }
    return *most > 0 && *most < MHI_HARDLY_MOVES;
}

mhe_status mhi_believe_angles(const mhe_description *d, const mhi_recording *r,
                              const mhi_angles_source *source, mhi_findings *findings,
                              mhe_error *err) {
    char line[16] = "";
    span s = {0, 0, 0, 0};
    double most = 0;
    if (r->angles == NULL) {
        return MHE_OK;
    }
    if (source->line > 0) {
        (void)snprintf(line, sizeof line, ":%d", (int)source->line);
    }
    const int32_t degrees = source->in_degrees ? -1 : find_degrees(d, r, &s);
    if (degrees >= 0) {
        const mhe_coordinate *c = &d->coordinates[degrees];
        return mhe_fail(err, MHE_E_INPUT,
                        "%s%s: '%s' goes from %.4g to %.4g, its range is %.4g to %.4g rad: are "
                        "these degrees? 'inDegrees=yes' in the header says so",
                        source->path, line, c->name, s.low, s.high, c->lower, c->upper);
    }
    if (source->in_degrees && hardly_moves(d, r, &most)) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "if they are radians, write 'inDegrees=no' into the header",
                         "%s%s: no angle is larger than %.3g degrees", source->path, line,
                         most / DEGREE);
    }
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        const mhe_coordinate *c = &d->coordinates[i];
        s = span_of(d, r, i);
        if (s.n > 0 && s.n_outside > OFTEN * s.n) {
            mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                             "check its unit, sign and zero, or widen the range in the model",
                             "%s%s: '%s' goes from %.4g to %.4g %s, its range is %.4g to %.4g",
                             source->path, line, c->name, s.low, s.high,
                             c->rotational ? "rad" : "m", c->lower, c->upper);
        }
    }
    return MHE_OK;
}

/* SPDX-License-Identifier: Apache-2.0 */
/* believe_loads.c: forces on bodies from a file against gravity, the body's weight and the markers:
 * another frame or axis, a wrong sign or unit, a plate that drifts, points far off the body. Points
 * where the force is small mean nothing; they matter where they are so far that it is a moment. */
#include "base/values.h"
#include "believe/believe.h"
#include "io/external_loads.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SOME 20.0      /* N: below, a plate's point means nothing, and nobody stands on it */
#define MUCH 100.0     /* N: of what is compared with markers */
#define ALONG 0.7      /* least cosine of the mean force to the way up */
#define LEAST 0.3      /* of the weight, in the mean while the feet are on plates */
#define MOST 4.0       /* of the weight, the largest */
#define FAR 0.5        /* m, of a point beside all markers of its time */
#define FAR_SHARE 0.05 /* of the samples with a force */
#define NEARER 0.15    /* m by which another body's markers are nearer ... */
#define MOSTLY 0.5     /* ... in that share of the samples */
#define SLOWEST 0.5    /* s between rows: nobody walks so slowly */
#define MANY_ROWS 20   /* a weight that is held may have few */
#define LEVER 20.0     /* N m, of a small force with such a point */
#define UNLOADED 0.15  /* share of the largest force below which a plate may be unloaded */
#define REST_SHARE 0.1 /* of the samples: so long a plate must be unloaded to judge its zero */

typedef struct view {
    const mhi_run *run;
    const mhe_description *d;
    const mhi_recording *r;
    const mhe_external_loads *loads;
    mhi_findings *findings;
    double up[3], weight; /* unit vector against gravity; N of the whole model */
} view;

/* Force and point of load l at a row, in the model's ground; 0: not given there. */
static int32_t take(const view *v, int32_t row, int32_t l, double force[3], double point[3]) {
    const double *value = v->loads->values + ((ptrdiff_t)row * v->loads->n_loads + l) * 9;
    if (v->loads->loads[l].axes >= 0 || v->loads->loads[l].origin >= 0) {
        return 0;
    }
    memcpy(force, value, 3 * sizeof *force);
    memcpy(point, value + 3, 3 * sizeof *point);
    mhi_run_transform(v->run, 0, force);
    mhi_run_transform(v->run, 1, point);
    return 1;
}

static double dot(const double *a, const double *b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double length(const double *a) {
    return sqrt(dot(a, a));
}

/* The mean of all loads while there is one, and the largest part along the way up. */
static void check_direction(const view *v) {
    double sum[3] = {0}, largest = 0, force[3], point[3];
    int32_t n = 0;
    for (int32_t k = 0; k < v->loads->n_rows; k++) {
        double all[3] = {0};
        for (int32_t l = 0; l < v->loads->n_loads; l++) {
            for (int32_t i = 0; take(v, k, l, force, point) && i < 3; i++) {
                all[i] += force[i];
            }
        }
        for (int32_t i = 0; i < 3 && length(all) > SOME; i++) {
            sum[i] += all[i];
        }
        n += length(all) > SOME;
        largest = fmax(largest, length(all));
    }
    const double size = length(sum), along = size > 0 ? dot(sum, v->up) / size : 1;
    const char *path = v->run->data.external_loads;
    if (n == 0) {
        mhi_findings_add(v->findings, MHI_FINDING_DOUBTFUL,
                         "is the unit right (N), are the columns those of this trial?",
                         "%s: no force above %g N", path, SOME);
    } else if (along < -ALONG) {
        mhi_findings_add(v->findings, MHI_FINDING_USELESS,
                         "a load is what acts on the body: turn its sign in the file",
                         "%s: the loads pull the body down: what the feet do to the plates?", path);
    } else if (along < ALONG) {
        mhi_findings_add(
            v->findings, MHI_FINDING_USELESS,
            "the plates have other axes: data.transform turns markers and loads alike; "
            "rotate: x-90 brings z up to y up",
            "%s: the loads push along (%.2f %.2f %.2f), the model's up is (%g %g %g)", path,
            sum[0] / size, sum[1] / size, sum[2] / size, v->up[0], v->up[1], v->up[2]);
    } else if (size / n < LEAST * v->weight || largest > MOST * v->weight) {
        mhi_findings_add(
            v->findings, MHI_FINDING_DOUBTFUL,
            "is the unit right (N), and the model scaled to this person's mass?",
            "%s: the loads are %.3g N in the mean and %.3g N at most; the model weighs "
            "%.3g N",
            path, size / n, largest, v->weight);
    }
}

/* The row of the recording nearest to a time; -1: none within a step. */
static int32_t frame_at(const mhi_recording *r, double time) {
    const double k = r->n_frames < 2 ? -1 : round((time - r->time[0]) * r->rate);
    return k >= 0 && k < r->n_frames && fabs(r->time[(int32_t)k] - time) < 1 / r->rate ? (int32_t)k
                                                                                       : -1;
}

/* Distance of a point, level, from the box around all markers of a frame; NaN without any. */
static double beside(const view *v, int32_t frame, const double *point) {
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    double out[3] = {0};
    for (int32_t i = 0; i < v->d->n_markers; i++) {
        const double *p = v->r->markers + 3 * ((ptrdiff_t)frame * v->d->n_markers + i);
        for (int32_t j = 0; j < 3 && !isnan(p[0]); j++) {
            low[j] = fmin(low[j], p[j]);
            high[j] = fmax(high[j], p[j]);
        }
    }
    if (!(low[0] <= high[0])) {
        return NAN;
    }
    for (int32_t j = 0; j < 3; j++) {
        out[j] = fmax(0, fmax(low[j] - point[j], point[j] - high[j]));
    }
    return length(out);
}

/* A force whose point is nowhere near the body acts with a wrong lever. */
static void check_points(const view *v, int32_t l) {
    double force[3], point[3], farthest = 0, when = 0;
    int32_t n = 0, n_far = 0;
    for (int32_t k = 0; k < v->loads->n_rows && v->r->markers != NULL; k++) {
        const int32_t frame = frame_at(v->r, v->loads->time[k]);
        if (frame < 0 || !take(v, k, l, force, point) || length(force) < MUCH) {
            continue;
        }
        const double far = beside(v, frame, point);
        n += !isnan(far);
        n_far += far > FAR;
        when = far > farthest ? v->loads->time[k] : when;
        farthest = fmax(farthest, far);
    }
    if (n_far > FAR_SHARE * n) {
        mhi_findings_add(v->findings, MHI_FINDING_DOUBTFUL,
                         "points of another frame, in mm, or of the other foot?",
                         "%s: '%s' acts up to %.3g m beside all markers (at %.4g s) in %.0f %% of "
                         "the samples",
                         v->run->data.external_loads, v->loads->names[l], farthest, when,
                         100.0 * n_far / n);
    }
}

/* Distance of a point from the nearest marker of a frame that is the body's (or, not `own`, of
 * another one, which is given); infinite without any. */
static double nearest(const view *v, int32_t frame, const double *point, int32_t body, int own,
                      int32_t *of) {
    double least = INFINITY;
    for (int32_t i = 0; i < v->d->n_markers; i++) {
        const double *p = v->r->markers + 3 * ((ptrdiff_t)frame * v->d->n_markers + i);
        const double to[3] = {p[0] - point[0], p[1] - point[1], p[2] - point[2]};
        if ((v->d->markers[i].body == body) == own && length(to) < least) { /* not of NaN */
            least = length(to);
            *of = v->d->markers[i].body;
        }
    }
    return least;
}

/* A force at one body's markers that the file gives to another body: the other foot, the pelvis. */
static void check_body(const view *v, int32_t l) {
    const int32_t body = v->loads->loads[l].body;
    double force[3], point[3], away = 0, near = 0;
    int32_t n = 0, n_other = 0, other = -1;
    for (int32_t k = 0; k < v->loads->n_rows && v->r->markers != NULL; k++) {
        const int32_t frame = frame_at(v->r, v->loads->time[k]);
        if (frame < 0 || !take(v, k, l, force, point) || length(force) < MUCH) {
            continue;
        }
        int32_t of = -1;
        const double own = nearest(v, frame, point, body, 1, &of);
        const double beside_it = nearest(v, frame, point, body, 0, &of);
        n += isfinite(own);
        if (isfinite(own) && own - beside_it > NEARER) {
            n_other++;
            other = own > away ? of : other;
            near = own > away ? beside_it : near;
            away = fmax(away, own);
        }
    }
    if (n_other > MOSTLY * n && other >= 0 && body >= 0) {
        mhi_findings_add(v->findings, MHI_FINDING_DOUBTFUL,
                         "is applied_to_body the one that stands there?",
                         "%s: '%s' is applied to %s, but acts %.2g m from its markers and %.2g m "
                         "from those of %s (%.0f %% of the samples)",
                         v->run->data.external_loads, v->loads->names[l], v->d->bodies[body].name,
                         away, near, v->d->bodies[other].name, 100.0 * n_other / n);
    }
}

/* A small force whose point runs away is a moment that nobody exerted. */
static void check_levers(const view *v, int32_t l) {
    double force[3], point[3], largest = 0, size = 0, away = 0, when = 0;
    for (int32_t k = 0; k < v->loads->n_rows && v->r->markers != NULL; k++) {
        const int32_t frame = frame_at(v->r, v->loads->time[k]);
        if (frame < 0 || !take(v, k, l, force, point) || length(force) >= MUCH) {
            continue;
        }
        const double far = beside(v, frame, point), moment = far * length(force);
        if (moment > largest) {
            largest = moment;
            size = length(force);
            away = far;
            when = v->loads->time[k];
        }
    }
    if (largest > LEVER) {
        mhi_findings_add(v->findings, MHI_FINDING_DOUBTFUL,
                         "a point means nothing where the force is small: set force and torque to "
                         "0 there",
                         "%s: '%s' acts %.3g m beside all markers with %.3g N (at %.4g s), a "
                         "moment of %.3g N m",
                         v->run->data.external_loads, v->loads->names[l], away, size, when,
                         largest);
    }
}

/* Median of the smallest forces in rows [from, to), NaN where the plate is never unloaded. */
static double rest(const view *v, int32_t l, int32_t from, int32_t to, double largest) {
    double *sizes = malloc(sizeof(double) * ((size_t)(to - from) + 1)), force[3], point[3];
    int32_t n = 0;
    for (int32_t k = from; k < to && sizes != NULL; k++) {
        const double f = take(v, k, l, force, point) ? length(force) : INFINITY;
        if (f < UNLOADED * largest) {
            sizes[n++] = f;
        }
    }
    double median = NAN;
    if (n > REST_SHARE * (to - from)) {
        mhi_sort(sizes, n);
        median = sizes[n / 2];
    }
    free(sizes);
    return median;
}

/* What an unloaded plate shows, in the first and in the last half. */
static void check_zero(const view *v, int32_t l) {
    const int32_t n = v->loads->n_rows;
    double largest = 0, force[3], point[3];
    for (int32_t k = 0; k < n; k++) {
        largest = take(v, k, l, force, point) ? fmax(largest, length(force)) : largest;
    }
    const double first = rest(v, l, 0, n / 2, largest), last = rest(v, l, n / 2, n, largest);
    if (largest > MUCH && (first > SOME || last > SOME)) {
        mhi_findings_add(v->findings, MHI_FINDING_DOUBTFUL,
                         "a plate that was not zeroed, or drifts: take that off before",
                         "%s: '%s' shows %.3g N while it is unloaded in the first half and %.3g N "
                         "in the last",
                         v->run->data.external_loads, v->loads->names[l], first, last);
    }
}

/* Feet that step over half an hour. */
static void check_times(const view *v) {
    const int32_t n = v->loads->n_rows;
    const double step = n > MANY_ROWS ? (v->loads->time[n - 1] - v->loads->time[0]) / (n - 1) : 0;
    if (step > SLOWEST) {
        mhi_findings_add(v->findings, MHI_FINDING_USELESS,
                         "are its times in ms instead of s? Divide them by 1000",
                         "%s: the loads' rows are %.4g s apart", v->run->data.external_loads, step);
    }
}

/* Whether the model's own weight is to be carried: it can move along two axes at least. */
static int32_t is_free(const mhe_description *d) {
    int32_t n = 0;
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        n += !d->coordinates[i].rotational;
    }
    return n >= 2;
}

mhe_status mhi_believe_loads(const mhi_run *run, const mhe_description *d, const mhi_recording *r,
                             mhi_findings *findings, mhe_error *err) {
    view v = {.run = run, .d = d, .r = r, .findings = findings};
    const int32_t before = findings->n;
    if (run->data.external_loads == NULL) {
        return MHE_OK;
    }
    const mhe_status status = mhi_external_loads.read(run->data.external_loads, d, &v.loads, err);
    const double g = length(d->gravity);
    for (int32_t i = 0; i < d->n_bodies; i++) {
        v.weight += g * d->bodies[i].mass;
    }
    for (int32_t i = 0; i < 3 && g > 0; i++) {
        v.up[i] = -d->gravity[i] / g;
    }
    if (status == MHE_OK && g > 0 && v.weight > MUCH && is_free(d)) { /* a person, not a limb */
        check_times(&v);
        check_direction(&v);
        for (int32_t l = 0; l < v.loads->n_loads; l++) {
            const int32_t told = findings->n;
            check_points(&v, l);
            if (findings->n == told) {
                check_body(&v, l);
            }
            check_zero(&v, l);
        }
        for (int32_t l = 0; l < v.loads->n_loads && findings->n == before; l++) {
            check_levers(&v, l); /* of loads that are right otherwise */
        }
    }
    mhi_external_loads.free(v.loads);
    return status;
}

/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/start.h"

#include "base/arena.h"
#include "base/cholesky.h"
#include "base/pi.h"

#include <math.h>
#include <string.h>

#define MAX_ITERATIONS 60
#define N_POSTURES 12       /* of the search, at first */
#define EVALUATIONS 2e5     /* of markers: most that a search may take ... */
#define MULTIPLICATIONS 1e9 /* ... in all, so that large models may take fewer */
#define BETTER 0.99         /* of the distance: as near is not worth a posture elsewhere */

struct mhi_start {
    const mhe_description *description;
    mhi_system_context *context;
    const mhi_tasks *tasks; /* NULL: none */
    int32_t n_q, n_k;
    int32_t tries;
    double enough;             /* rad or m: a step shorter than this ends the search */
    double *marker, *marker_q; /* [3 n_k], [3 n_k x n_q] */
    double *normal, *step;     /* [n_q x n_q], [n_q] */
    double *gradient, *trial, *best;
    int32_t *moving; /* [n_q] scratch */
    mhi_arena arena;
};

mhe_status mhi_start_create(const mhi_system *system, mhi_system_context *context,
                            mhi_start **start, mhe_error *err) {
    *start = NULL;
    const mhe_description *d = mhi_system_description(system);
    mhi_arena arena = {0};
    mhi_start *s = MHI_TAKE(&arena, mhi_start, 1);
    if (s == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    s->description = d;
    s->context = context;
    s->n_q = d->n_coordinates;
    s->n_k = d->n_markers;
    s->enough = 1e-9;
    s->tries = N_POSTURES;
    s->marker = MHI_TAKE(&arena, double, 3 * s->n_k);
    s->marker_q = MHI_TAKE(&arena, double, 3 * s->n_k * s->n_q);
    s->normal = MHI_TAKE(&arena, double, s->n_q * s->n_q);
    s->step = MHI_TAKE(&arena, double, s->n_q);
    s->gradient = MHI_TAKE(&arena, double, s->n_q);
    s->trial = MHI_TAKE(&arena, double, s->n_q);
    s->best = MHI_TAKE(&arena, double, s->n_q);
    s->moving = MHI_TAKE(&arena, int32_t, s->n_q);
    s->arena = arena;
    if (!s->marker || !s->marker_q || !s->normal || !s->step || !s->gradient || !s->trial ||
        !s->best || !s->moving) {
        mhi_start_free(s);
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    *start = s;
    return MHE_OK;
}

void mhi_start_set_tasks(mhi_start *start, const mhi_tasks *tasks) {
    start->tasks = tasks;
}

void mhi_start_set_enough(mhi_start *start, double step) {
    start->enough = step;
}

void mhi_start_set_tries(mhi_start *start, int32_t tries) {
    start->tries = tries;
}

int64_t mhi_start_affordable(const mhi_start *s) {
    const double n_q = s->n_q, rows = 3.0 * s->n_k;
    /* an evaluation, and its share of a step: normal equations and their factor */
    const double one = 100 + rows * (20 + n_q) + n_q * n_q * n_q / 6;
    return (int64_t)fmin(EVALUATIONS, MULTIPLICATIONS / one) + 1;
}

void mhi_start_free(mhi_start *start) {
    if (start != NULL) {
        mhi_arena arena = start->arena;
        mhi_arena_free(&arena);
    }
}

/* A sum of squares: as it is minimised, and of the markers' distances alone. */
typedef struct sums {
    double weighted, plain;
    int32_t n; /* single coordinates of markers that are there */
} sums;

static void add_coordinates(mhi_start *s, const double *q, int linearise, sums *sum) {
    for (int32_t i = 0; i < s->n_q && s->tasks != NULL; i++) {
        const double weight = s->tasks->coordinate[i], r = q[i] - s->tasks->value[i];
        sum->weighted += weight * r * r;
        if (linearise) {
            s->gradient[i] += weight * r;
            s->normal[i * s->n_q + i] += weight;
        }
    }
}

/* A residual r with its derivatives in the normal equations, of which the lower triangle is needed.
 * Most coordinates do not move a marker. */
static void add_row(mhi_start *s, const double *row, double weight, double r) {
    int32_t n = 0;
    for (int32_t i = 0; i < s->n_q; i++) {
        s->moving[n] = i;
        n += row[i] != 0;
    }
    for (int32_t i = 0; i < n; i++) {
        const int32_t a = s->moving[i];
        s->gradient[a] += weight * row[a] * r;
        for (int32_t k = 0; k <= i; k++) {
            const int32_t b = s->moving[k];
            s->normal[a * s->n_q + b] += weight * row[a] * row[b];
        }
    }
}

/* Over the markers that are there; with the normal equations when `linearise` is set. */
static mhe_status distances(mhi_start *s, const double *measured, const double *q, int linearise,
                            sums *sum, mhe_error *err) {
    mhe_status status =
        mhi_system_markers(s->context, q, s->marker, linearise ? s->marker_q : NULL, err);
    if (status != MHE_OK) {
        return status;
    }
    *sum = (sums){0};
    if (linearise) {
        memset(s->normal, 0, sizeof(double) * (size_t)(s->n_q * s->n_q));
        memset(s->gradient, 0, sizeof(double) * (size_t)s->n_q);
    }
    for (int32_t i = 0; i < 3 * s->n_k; i++) {
        const double r = s->marker[i] - measured[i];
        const double weight = s->tasks == NULL ? 1 : s->tasks->marker[i / 3];
        if (isnan(r) || weight == 0) {
            continue;
        }
        sum->weighted += weight * r * r;
        sum->plain += r * r;
        sum->n += 1;
        if (linearise) {
            add_row(s, s->marker_q + i * s->n_q, weight, r);
        }
    }
    add_coordinates(s, q, linearise, sum);
    return MHE_OK;
}

static double clip(const mhe_coordinate *c, double value) {
    return fmin(fmax(value, c->lower), c->upper);
}

/* Solves (H + damping (D + 1e-6 max D)) step = -gradient and sets the trial posture, kept in range;
 * its length. */
static double propose(mhi_start *s, const double *q, double damping) {
    const int32_t n = s->n_q;
    double largest = 1e-12;
    for (int32_t i = 0; i < n; i++) {
        largest = fmax(largest, s->normal[i * n + i]);
    }
    for (int32_t i = 0; i < n; i++) {
        s->normal[i * n + i] += damping * (s->normal[i * n + i] + 1e-3 * largest) + 1e-12 * largest;
        s->step[i] = -s->gradient[i];
    }
    if (mhi_cholesky_factor(s->normal, n) != 0) {
        return 0;
    }
    mhi_cholesky_solve(s->normal, n, s->step, 1);
    double length = 0;
    for (int32_t i = 0; i < n; i++) {
        s->trial[i] = clip(&s->description->coordinates[i], q[i] + s->step[i]);
        length = fmax(length, fabs(s->trial[i] - q[i]));
    }
    return length;
}

mhe_status mhi_start_posture(mhi_start *s, const double *measured, double *q, double *rms,
                             mhe_error *err) {
    double damping = 1e-3;
    int32_t known = 0; /* the normal equations are those of q */
    sums here = {0}, there = {0};
    for (int32_t i = 0; i < s->n_q; i++) {
        q[i] = clip(&s->description->coordinates[i], q[i]);
    }
    for (int iteration = 0; iteration < MAX_ITERATIONS; iteration++) {
        mhe_status status = known ? MHE_OK : distances(s, measured, q, 1, &here, err);
        if (status != MHE_OK || here.n == 0) {
            *rms = NAN;
            return status;
        }
        const double length = propose(s, q, damping);
        if (length < s->enough || mhi_system_context_spent(s->context)) {
            break;
        }
        status = distances(s, measured, s->trial, 1, &there, err); /* taken, as a rule */
        known = status == MHE_OK && there.weighted <= here.weighted;
        if (known) {
            memcpy(q, s->trial, sizeof(double) * (size_t)s->n_q);
            here = there;
            damping = fmax(damping / 5, 1e-9);
        } else if (damping > 1e6) {
            break;
        } else {
            damping *= 8;
        }
    }
    *rms = sqrt(3 * here.plain / here.n);
    return MHE_OK;
}

/* Fraction of a coordinate's range for posture p: a low-discrepancy sequence (additive recurrence
 * with the square roots of successive integers), so that the same postures are tried everywhere. */
static double spread(int32_t p, int32_t coordinate) {
    const double x = p * sqrt(2.0 + coordinate) + 0.5;
    return x - floor(x);
}

mhe_status mhi_start_search(mhi_start *s, const double *measured, double *q, double *rms,
                            mhe_error *err) {
    const size_t bytes = sizeof(double) * (size_t)s->n_q;
    memcpy(s->best, q, bytes);
    mhe_status status = mhi_start_posture(s, measured, s->best, rms, err);
    double best = *rms;
    for (int32_t p = 0;
         p < s->tries && status == MHE_OK && best > 0.01 && !mhi_system_context_spent(s->context);
         p++) {
        for (int32_t i = 0; i < s->n_q; i++) {
            const mhe_coordinate *c = &s->description->coordinates[i];
            /* arms may turn around more than once, which looks the same */
            const double lower =
                isfinite(c->lower) ? fmax(c->lower, c->value - MHI_PI) : c->value - 1.5;
            const double upper =
                isfinite(c->upper) ? fmin(c->upper, c->value + MHI_PI) : c->value + 1.5;
            q[i] = lower + (upper - lower) * spread(p, i);
        }
        double found = 0;
        status = mhi_start_posture(s, measured, q, &found, err);
        if (status == MHE_OK && found < BETTER * best) {
            best = found;
            memcpy(s->best, q, bytes);
        }
    }
    memcpy(q, s->best, bytes);
    *rms = best;
    return status;
}

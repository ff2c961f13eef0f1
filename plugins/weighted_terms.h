/* SPDX-License-Identifier: Apache-2.0 */
/* weighted_terms.h: a cost that is a list of weighted signals.
 *
 * Each term reads one signal y and gives r = sqrt(weight) (y - target), where the target is the
 * measured y_ref or 0; a missing y_ref leaves no residual, or one towards 0 with another weight. A
 * cost plugin says in create() which terms it has and hands the other functions below to the core
 * as they are. */
#ifndef WEIGHTED_TERMS_H
#define WEIGHTED_TERMS_H

#include <mhe/cost.h>

#include <math.h>
#include <stdlib.h>

typedef struct weighted_term {
    const char *signal;
    double weight;           /* [1 / unit of the signal squared]; 0 drops the term */
    int32_t tracks;          /* 1: towards the measured signal; 0: towards 0 */
    double missing;          /* weight towards 0 of a tracked sample that is missing */
    int32_t optional;        /* 1: dropped where the problem has no such signal */
    const uint8_t *selected; /* [n_y] 0: this entry does not count; NULL: all count */
} weighted_term;

typedef struct weighted_terms {
    int32_t n_signals;
    int32_t signals[MHE_COST_MAX_SIGNALS];
    int32_t n_res;
    double *scale;   /* [n_res] sqrt(weight) */
    double *tracked; /* [n_res] 1: y_ref is subtracted */
    double *missing; /* [n_res] sqrt(weight) where y_ref is NaN; 0: no residual there */
    int32_t fills_missing;
} weighted_terms;

static void weighted_terms_destroy(void *self) {
    weighted_terms *all = self;
    if (all != NULL) {
        free(all->scale);
        free(all);
    }
}

/* Appends the residuals of one term. */
static mhe_status weighted_terms_add(weighted_terms *all, const mhe_problem *problem,
                                     const weighted_term *term, mhe_error *err) {
    int32_t n = 0, signal = problem->find_signal(problem, term->signal, &n, NULL);
    if (term->weight == 0 || (signal < 0 && term->optional)) {
        return MHE_OK;
    }
    if (signal < 0) {
        return mhe_fail(err, MHE_E_CONFIG, "the problem has no signal '%s'", term->signal);
    }
    all->signals[all->n_signals++] = signal;
    for (int32_t i = 0; i < n; i++, all->n_res++) {
        int32_t counts = term->selected == NULL || term->selected[i];
        all->scale[all->n_res] = counts ? sqrt(term->weight) : 0;
        all->tracked[all->n_res] = counts && term->tracks;
        all->missing[all->n_res] = counts && term->tracks ? sqrt(term->missing) : 0;
        all->fills_missing |= all->missing[all->n_res] > 0;
    }
    return MHE_OK;
}

/* Makes `self` of at most MHE_COST_MAX_SIGNALS terms. [cold] */
static mhe_status weighted_terms_create(const mhe_problem *problem, const weighted_term *terms,
                                        int32_t n_terms, void **self, mhe_error *err) {
    size_t n_most = 1;
    for (int32_t i = 0; i < n_terms; i++) {
        int32_t n = 0;
        n_most += problem->find_signal(problem, terms[i].signal, &n, NULL) >= 0 ? (size_t)n : 0;
    }
    weighted_terms *all = calloc(1, sizeof *all);
    if (all == NULL || (all->scale = calloc(3 * n_most, sizeof(double))) == NULL) {
        free(all);
        return mhe_fail(err, MHE_E_MEMORY, "no memory for %zu residuals", n_most);
    }
    all->tracked = all->scale + n_most;
    all->missing = all->tracked + n_most;
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < n_terms && status == MHE_OK; i++) {
        status = weighted_terms_add(all, problem, &terms[i], err);
    }
    if (status == MHE_OK && all->n_res == 0) {
        status = mhe_fail(err, MHE_E_CONFIG, "every weight is 0");
    }
    if (status != MHE_OK) {
        weighted_terms_destroy(all);
        return status;
    }
    *self = all;
    return MHE_OK;
}

static mhe_status weighted_terms_layout(const void *self, const mhe_problem *problem,
                                        mhe_cost_layout *out, mhe_error *err) {
    const weighted_terms *all = self;
    (void)problem, (void)err;
    out->n_signals = all->n_signals;
    for (int32_t i = 0; i < all->n_signals; i++) {
        out->signals[i] = all->signals[i];
    }
    out->n_res = all->n_res;
    out->jacobian = MHE_JACOBIAN_DIAGONAL;
    out->res_unit = "1";
    out->fills_missing = all->fills_missing;
    return MHE_OK;
}

static int32_t weighted_terms_lacks(const weighted_terms *all, const mhe_stage *stage, int32_t i) {
    return all->missing[i] > 0 && isnan(stage->y_ref[i]);
}

static mhe_status weighted_terms_residual(const void *self, const mhe_stage *stage, double *r,
                                          mhe_error *err) {
    const weighted_terms *all = self;
    (void)err;
    for (int32_t i = 0; i < stage->ny; i++) { /* NaN of other missing samples goes through */
        const double y = stage->y[i];
        r[i] = weighted_terms_lacks(all, stage, i)
                   ? all->missing[i] * y
                   : all->scale[i] * (all->tracked[i] != 0 ? y - stage->y_ref[i] : y);
    }
    return MHE_OK;
}

static mhe_status weighted_terms_jacobian(const void *self, const mhe_stage *stage, double *J,
                                          mhe_error *err) {
    const weighted_terms *all = self;
    (void)err;
    for (int32_t i = 0; i < stage->ny; i++) { /* the diagonal */
        J[i] = weighted_terms_lacks(all, stage, i) ? all->missing[i] : all->scale[i];
    }
    return MHE_OK;
}

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* tally.h: what the estimates of a run come to: how they ended, iterations, times. */
#ifndef TALLY_H
#define TALLY_H

#include <mhe/estimator.h>

/* Zeroed it is empty; tally_free gives its memory back. */
typedef struct tally {
    int32_t n_solves, n_converged, n_deadline;
    int32_t n_predicted; /* the solve failed */
    double iterations_sum;
    int64_t programs, fallbacks; /* of the solver, mhe_estimate */
    int32_t iterations_max;
    double *solve_ms; /* [n_solves] */
    int32_t capacity;
} tally;

mhe_status tally_add(tally *t, const mhe_estimate *estimate, mhe_error *err);
void tally_free(tally *t);

double tally_converged(const tally *t);  /* fraction; NaN of none */
double tally_iterations(const tally *t); /* mean; NaN of none */
double tally_mean_ms(const tally *t);    /* NaN of none */
/* Sorts the times; percentiles can then be read off solve_ms (measure.h). */
void tally_sort(tally *t);

/* Most memory that this process has held, MB. */
double tally_peak_rss_mb(void);

#endif

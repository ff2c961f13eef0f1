/* SPDX-License-Identifier: Apache-2.0 */
#include "tally.h"

#include "measure.h"

#include <math.h>
#include <stdlib.h>
#include <sys/resource.h>

mhe_status tally_add(tally *t, const mhe_estimate *estimate, mhe_error *err) {
    if (t->n_solves == t->capacity) {
        const int32_t capacity = t->capacity == 0 ? 1024 : 2 * t->capacity;
        double *grown = realloc(t->solve_ms, sizeof(double) * (size_t)capacity);
        if (grown == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
        t->solve_ms = grown;
        t->capacity = capacity;
    }
    t->solve_ms[t->n_solves++] = 1e3 * estimate->solve_time;
    t->n_converged += estimate->status == MHE_FRAME_OK;
    t->n_deadline += estimate->status == MHE_FRAME_DEADLINE;
    t->n_predicted += estimate->status == MHE_FRAME_PREDICTED;
    t->iterations_sum += estimate->iterations;
    t->programs += estimate->programs;
    t->fallbacks += estimate->fallbacks;
    if (estimate->iterations > t->iterations_max) {
        t->iterations_max = estimate->iterations;
    }
    return MHE_OK;
}

void tally_free(tally *t) {
    free(t->solve_ms);
    *t = (tally){0};
}

double tally_converged(const tally *t) {
    return t->n_solves == 0 ? NAN : (double)t->n_converged / t->n_solves;
}

double tally_iterations(const tally *t) {
    return t->n_solves == 0 ? NAN : t->iterations_sum / t->n_solves;
}

double tally_mean_ms(const tally *t) {
    double sum = 0;
    for (int32_t i = 0; i < t->n_solves; i++) {
        sum += t->solve_ms[i];
    }
    return t->n_solves == 0 ? NAN : sum / t->n_solves;
}

void tally_sort(tally *t) {
    measure_sort(t->solve_ms, t->n_solves);
}

double tally_peak_rss_mb(void) {
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return (double)usage.ru_maxrss / 1024;
}

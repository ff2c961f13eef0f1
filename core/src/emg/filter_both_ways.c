/* SPDX-License-Identifier: Apache-2.0 */
/* filter_both_ways.c: a filter without delay, for recordings that are complete. */
#include "emg/filter.h"

#include <stdlib.h>

/* The state in which a constant input of 1 has always been there: the step response from it is
 * flat. */
static void steady_state(const mhi_filter *filter, double *state) {
    double level = 1; /* at the input of the section */
    for (int32_t i = 0; i < filter->n; i++, state += 2) {
        const mhi_biquad *s = &filter->sections[i];
        const double y = level * (s->b0 + s->b1 + s->b2) / (1 + s->a1 + s->a2);
        state[1] = s->b2 * level - s->a2 * y;
        state[0] = s->b1 * level - s->a1 * y + state[1];
        level = y;
    }
}

int32_t mhi_filter_both_ways_least(const mhi_filter *filter) {
    int32_t n_b = 0, n_a = 0; /* sections of first order count half, as in scipy */
    for (int32_t i = 0; i < filter->n; i++) {
        n_b += filter->sections[i].b2 == 0;
        n_a += filter->sections[i].a2 == 0;
    }
    return 3 * (2 * filter->n + 1 - (n_b < n_a ? n_b : n_a));
}

/* Over n samples, `step` apart, from the steady state at the first. */
static void run(const mhi_filter *filter, double *signal, int32_t n, ptrdiff_t step) {
    double state[2 * MHI_FILTER_SECTIONS_MAX] = {0};
    steady_state(filter, state);
    for (int32_t i = 0; i < 2 * filter->n; i++) {
        state[i] *= *signal;
    }
    for (int32_t i = 0; i < n; i++, signal += step) {
        *signal = mhi_filter_step(filter, state, *signal);
    }
}

mhe_status mhi_filter_both_ways(const mhi_filter *filter, double *signal, int32_t n,
                                mhe_error *err) {
    const int32_t edge = mhi_filter_both_ways_least(filter);
    if (filter->n == 0) {
        return MHE_OK;
    }
    if (n <= edge) {
        return mhe_fail(err, MHE_E_INPUT,
                        "%d samples are too few to be filtered without delay: more than %d are "
                        "needed",
                        (int)n, (int)edge);
    }
    const int32_t total = n + 2 * edge;
    double *work = malloc(sizeof(double) * (size_t)total);
    if (work == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < edge; i++) {
        work[i] = 2 * signal[0] - signal[edge - i];
        work[edge + n + i] = 2 * signal[n - 1] - signal[n - 2 - i];
    }
    for (int32_t i = 0; i < n; i++) {
        work[edge + i] = signal[i];
    }
    run(filter, work, total, 1);
    run(filter, work + total - 1, total, -1);
    for (int32_t i = 0; i < n; i++) {
        signal[i] = work[edge + i];
    }
    free(work);
    return MHE_OK;
}

/* SPDX-License-Identifier: Apache-2.0 */
#include "live.h"

#include "measure.h"

#include <sched.h>
#include <stdlib.h>
#include <time.h>

#define PRIORITY 10 /* above all ordinary programs, below what the system itself may need */

void live_raise(live *l) {
    const struct sched_param wanted = {.sched_priority = PRIORITY};
    const int given = sched_getscheduler(0);
    l->raised = given == SCHED_OTHER && sched_setscheduler(0, SCHED_FIFO, &wanted) == 0;
    l->has_priority = l->raised || given == SCHED_FIFO || given == SCHED_RR;
}

mhe_status live_open(live *l, int32_t n_frames, mhe_error *err) {
    l->memory = calloc(2 * (size_t)n_frames + 1, sizeof(double));
    if (l->memory == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    l->latency = l->memory;
    l->jitter = l->memory + n_frames;
    return MHE_OK;
}

void live_close(live *l) {
    free(l->memory);
}

/* An interrupted sleep ends early: Ctrl-C is looked at between frames. */
static void sleep_until(double seconds) {
    struct timespec t = {.tv_sec = (time_t)seconds};
    t.tv_nsec = (long)(1e9 * (seconds - (double)t.tv_sec));
    (void)clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL);
}

int32_t live_wait(live *l, mhe_estimator *estimator, const double *time, int32_t n) {
    int32_t k = l->next;
    if (k >= n) {
        return -1;
    }
    (void)mhe_estimator_prepare(estimator, NULL); /* what fails here is told by the solve */
    if (k == 0) {
        l->begin = measure_seconds();
    }
    double due = l->begin + time[k] - time[0];
    if (measure_seconds() < due) {
        sleep_until(due);
    }
    const double now = measure_seconds();
    const int32_t kept = l->kept > 1 ? l->kept : 1;
    while (k + kept < n && l->begin + time[k + kept] - time[0] <= now) {
        k++;
    }
    l->n_missed += k - l->next;
    l->next = k + 1;
    l->arrived = l->begin + time[k] - time[0];
    l->jitter[l->n_jitter++] = now - l->arrived;
    const double left = l->deadline - (now - l->arrived);
    (void)mhe_estimator_set_deadline(estimator, left > l->least ? left : l->least, NULL);
    return k;
}

void live_estimated(live *l) {
    l->latency[l->n_latency++] = measure_seconds() - l->arrived;
}

void live_end(live *l) {
    const struct sched_param ordinary = {.sched_priority = 0};
    if (l->raised) {
        (void)sched_setscheduler(0, SCHED_OTHER, &ordinary);
        l->raised = 0;
    }
    measure_sort(l->latency, l->n_latency);
    measure_sort(l->jitter, l->n_jitter);
}

static double ms(const double *sorted, int32_t n, double fraction) {
    return 1e3 * measure_percentile(sorted, n, fraction);
}

void live_lines(const live *l, double rate, mhi_text *out) {
    const double *t = l->latency, *j = l->jitter;
    mhi_text_add(out,
                 "by the clock%s: %.1f estimates/s, %d frames missed; latency %.2f ms median, %.2f "
                 "p95, %.2f p99, %.2f p99.9, %.2f max; jitter %.3f ms median, %.3f p99, %.3f max\n",
                 l->has_priority ? ", with real-time priority" : "", rate, l->n_missed,
                 ms(t, l->n_latency, 0.5), ms(t, l->n_latency, 0.95), ms(t, l->n_latency, 0.99),
                 ms(t, l->n_latency, 0.999), ms(t, l->n_latency, 1), ms(j, l->n_jitter, 0.5),
                 ms(j, l->n_jitter, 0.99), ms(j, l->n_jitter, 1));
    if (l->n_missed > 0 && !l->has_priority) {
        mhi_text_add(
            out, "try: real-time priority, which this user may not take: chrt -f 10 as root, or "
                 "rtprio in /etc/security/limits.conf\n");
    }
}

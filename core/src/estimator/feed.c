/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/feed.h"

#include "base/need.h"
#include "estimator/estimator_private.h"

#include <mhe/emg.h>

#define SAME 1e-9 /* s: a sample at a frame's own time, whatever rounding says */

const double *mhi_feed_of_frame(mhi_feed *raw, double time) {
    if (raw->n > 0) {
        raw->step = time - raw->waiting[(raw->first + raw->n - 1) % MHI_FEED_WAITING];
    }
    if (!raw->mean && raw->newest >= time - SAME) {
        mhi_electrodes_at(raw->electrodes, time, raw->values);
        return raw->values;
    }
    if (raw->n == MHI_FEED_WAITING) {
        raw->first = (raw->first + 1) % MHI_FEED_WAITING;
        raw->n--;
    }
    raw->waiting[(raw->first + raw->n++) % MHI_FEED_WAITING] = time;
    return NULL;
}

mhe_status mhe_estimator_open_emg(mhe_estimator *e, const char *const *columns, int32_t n_columns,
                                  double rate, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"estimator", e}, {"columns", columns});
    if (status == MHE_OK && e->feed.electrodes != NULL) {
        status = mhe_fail(err, MHE_E_ARGUMENT, "%s: the electrodes are open already", __func__);
    }
    if (status == MHE_OK) {
        e->feed.channel = mhe_estimator_find_channel(e, "emg");
        e->feed.mean = e->run->emg.sample == MHI_EMG_SAMPLE_MEAN;
        e->feed.values = MHI_TAKE(&e->arena, double, e->description->n_muscles);
        status = e->feed.values == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    }
    if (status == MHE_OK) {
        status = mhi_electrodes_open_live(e->run, e->description, columns, n_columns, rate,
                                          &e->feed.electrodes, err);
    }
    e->feed.newest = -INFINITY;
    return status;
}

static mhe_status measure_waiting(mhe_estimator *e, mhe_error *err) {
    mhi_feed *raw = &e->feed;
    mhe_status status = MHE_OK;
    while (raw->n > 0 && raw->waiting[raw->first] <= raw->newest + SAME && status == MHE_OK) {
        const double frame = raw->waiting[raw->first];
        mhi_electrodes_at(raw->electrodes, frame, raw->values);
        raw->first = (raw->first + 1) % MHI_FEED_WAITING;
        raw->n--;
        status = mhe_estimator_measure(e, raw->channel, frame, raw->values, err);
    }
    return status;
}

/* Frames whose interval is complete, and with `all` the others with what there is of theirs. */
static mhe_status measure_means(mhe_estimator *e, int32_t all, mhe_error *err) {
    mhi_feed *raw = &e->feed;
    mhe_status status = MHE_OK;
    for (int32_t i = 0, n = raw->n; i < n && status == MHE_OK && raw->step > 0; i++) {
        const double frame = raw->waiting[(raw->first + (all ? i : 0)) % MHI_FEED_WAITING];
        const int32_t complete = raw->newest >= frame + raw->step - SAME;
        if (!complete && (!all || raw->newest < frame - SAME)) {
            break;
        }
        mhi_electrodes_mean(raw->electrodes, frame, raw->step, raw->values);
        status = mhe_estimator_measure(e, raw->channel, frame, raw->values, err);
        if (!all) {
            raw->first = (raw->first + 1) % MHI_FEED_WAITING;
            raw->n--;
        }
    }
    return status;
}

mhe_status mhi_feed_before_solve(mhe_estimator *e, mhe_error *err) {
    return e->feed.electrodes != NULL && e->feed.mean ? measure_means(e, 1, err) : MHE_OK;
}

mhe_status mhe_estimator_push_emg(mhe_estimator *e, double time, const double *sample,
                                  mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"estimator", e}, {"sample", sample});
    if (status == MHE_OK && e->feed.electrodes == NULL) {
        status = mhe_fail(err, MHE_E_ARGUMENT, "%s: mhe_estimator_open_emg comes first", __func__);
    }
    if (status != MHE_OK) {
        return status;
    }
    mhi_feed *raw = &e->feed;
    mhi_electrodes_push(raw->electrodes, time, sample);
    /* by the frames' clock: the electrodes add it too */
    raw->newest = fmax(raw->newest, time + e->run->data.emg_offset);
    return raw->mean ? measure_means(e, 0, err) : measure_waiting(e, err);
}

double mhe_estimator_emg_lag(const mhe_estimator *e) {
    return e == NULL || e->feed.electrodes == NULL ? 0 : mhi_electrodes_lag(e->feed.electrodes);
}

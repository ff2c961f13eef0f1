/* SPDX-License-Identifier: Apache-2.0 */
#include "live/feed.h"

#include "estimator/create.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define WAITING 256 /* frames that may wait for their EMG; more are no longer in any window */
#define SETTLE 1.0  /* s that the first frame waits for envelopes at most */
#define ALIKE 1.0   /* s between shifts of streams of one clock */

mhe_status mhi_feed_open(mhi_feed *f, const mhe_host *host, const mhi_run *run,
                         const mhe_description *model, mhe_estimator *estimator, mhe_error *err) {
    *f = (mhi_feed){.info = {.size = sizeof f->info},
                    .estimator = estimator,
                    .driver = -1,
                    .begun = NAN,
                    .last = -INFINITY};
    mhe_status status = mhe_estimator_describe(estimator, &f->info);
    f->setup = (mhi_inlet_setup){host, run, model, &f->info};
    f->waiting = calloc(WAITING, sizeof *f->waiting);
    f->channels = calloc((size_t)f->info.n_channels + 1, sizeof *f->channels);
    if (status == MHE_OK && (f->waiting == NULL || f->channels == NULL)) {
        status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    return status;
}

void mhi_feed_close(mhi_feed *f) {
    for (int32_t i = 0; i < f->n_inlets; i++) {
        mhi_inlet_close(&f->inlets[i]);
    }
    free(f->waiting);
    free(f->channels);
    f->waiting = NULL;
    f->channels = NULL;
    f->n_inlets = 0;
}

mhi_inlet *mhi_feed_inlet(mhi_feed *f, int32_t source, int32_t stream) {
    for (int32_t i = 0; i < f->n_inlets; i++) {
        if (f->inlets[i].source == source && f->inlets[i].stream == stream) {
            return &f->inlets[i];
        }
    }
    return NULL;
}

static void warn(const mhi_feed *f, const char *text) {
    f->setup.host->log(f->setup.host, MHE_LOG_WARNING, text);
}

/* Maxima that were found stay, whatever becomes of the stream. */
static void keep_maxima(const mhi_feed *f, mhi_inlet *in) {
    for (int32_t i = 0; i < f->setup.run->emg.n_channels && i < MHI_FEED_MAXIMA; i++) {
        if (in->is_raw && in->electrodes != NULL && f->maxima[i] > 0) {
            (void)mhi_electrodes_set_mvc(in->electrodes, f->setup.run, i, f->maxima[i]);
        }
    }
}

int32_t mhi_feed_set_maximum(mhi_feed *f, int32_t channel, double value) {
    if (channel < 0 || channel >= f->setup.run->emg.n_channels || channel >= MHI_FEED_MAXIMA ||
        !(value > 0) || !isfinite(value)) {
        return 0;
    }
    f->maxima[channel] = value;
    for (int32_t i = 0; i < f->n_inlets; i++) {
        keep_maxima(f, &f->inlets[i]);
    }
    return 1;
}

/* A stream that is new, or that is another now. Two of one kind: the first is taken. */
static mhe_status take_stream(mhi_feed *f, const mhi_packet *p, mhe_error *err) {
    mhi_inlet *in = mhi_feed_inlet(f, p->source, p->stream);
    if (in == NULL && f->n_inlets == MHI_FEED_INLETS) {
        warn(f, "more than 64 streams: the others are passed over");
        return MHE_OK;
    }
    mhi_inlet fresh;
    mhe_status status =
        mhi_inlet_open(&f->setup, p->about, p->source, p->stream, p->about->delay, &fresh, err);
    if (status != MHE_OK && f->running) { /* a run goes on without it */
        warn(f, err->text);
        fresh.channel = -1;
        status = MHE_OK;
    }
    if (status != MHE_OK) {
        mhi_inlet_close(&fresh);
        return status;
    }
    for (int32_t i = 0; i < f->n_inlets; i++) {
        const mhi_inlet *other = &f->inlets[i];
        if (other != in && other->channel >= 0 && other->channel == fresh.channel) {
            char text[300];
            (void)snprintf(
                text, sizeof text,
                "streams '%.100s' and '%.100s' are of one kind: the second is passed over",
                other->name, fresh.name);
            warn(f, text);
            fresh.channel = -1;
        }
    }
    if (in == NULL) {
        in = &f->inlets[f->n_inlets++];
    } else {
        mhi_inlet_close(in);
    }
    *in = fresh;
    keep_maxima(f, in);
    mhi_clock_start(&f->clocks[in - f->inlets]);
    return MHE_OK;
}

mhe_status mhi_feed_begin(mhi_feed *f, mhe_error *err) {
    static const int32_t kinds[] = {MHE_STREAM_MARKERS, MHE_STREAM_ANGLES};
    f->driver = -1;
    for (size_t k = 0; k < 2 && f->driver < 0; k++) {
        for (int32_t i = 0; i < f->n_inlets && f->driver < 0; i++) {
            const mhi_inlet *in = &f->inlets[i];
            f->driver = in->channel >= 0 && in->kind == kinds[k] && in->n_found > 0 ? i : -1;
        }
    }
    f->running = f->driver >= 0;
    return f->running
               ? MHE_OK
               : mhe_fail(err, MHE_E_INPUT, "no stream has a marker or a joint angle of the model");
}

/* ---- electrodes: frames get their EMG when it is there ---- */

/* Whether the sample nearest to a time has come. Streams of one clock are smoothed each by itself:
 * what was sampled with the frame may lie a millionth of a second before it. */
static int32_t has_come(const mhi_inlet *in, double host_time) {
    return in->newest + (in->rate > 0 ? 0.5 / in->rate : 0) >= host_time;
}

static void keep_waiting(mhi_feed *f, double time) {
    if (f->n_waiting == WAITING) {
        f->first_waiting = (f->first_waiting + 1) % WAITING;
        f->n_waiting--;
    }
    f->waiting[(f->first_waiting + f->n_waiting++) % WAITING] = time;
}

static mhe_status serve_waiting(mhi_feed *f, mhi_inlet *in, mhe_error *err) {
    mhe_status status = MHE_OK;
    while (f->n_waiting > 0 && has_come(in, f->start + f->waiting[f->first_waiting]) &&
           status == MHE_OK) {
        const double time = f->waiting[f->first_waiting];
        mhi_electrodes_at(in->electrodes, f->start + time, in->row);
        status = mhe_estimator_measure(f->estimator, in->channel, time, in->row, err);
        f->first_waiting = (f->first_waiting + 1) % WAITING;
        f->n_waiting--;
    }
    return status;
}

/* The frame's own EMG where it is there already. */
static void add_electrodes(mhi_feed *f, double time) {
    for (int32_t i = 0; i < f->n_inlets; i++) {
        mhi_inlet *in = &f->inlets[i];
        if (in->is_raw && in->channel >= 0) {
            if (has_come(in, f->start + time)) {
                mhi_electrodes_at(in->electrodes, f->start + time, in->row);
                f->channels[in->channel] = in->row;
            } else {
                keep_waiting(f, time);
            }
        }
    }
}

/* ---- samples ---- */

void mhi_feed_prepare(mhi_feed *f) {
    if (!f->repeats) {
        f->prepared = 1;
        (void)mhe_estimator_prepare(f->estimator, NULL);
    }
}

/* A repetition's frame has what it had. */
static void obey(mhi_feed *f, const mhe_grant *grant) {
    f->repeats |= grant != NULL;
    mhi_estimator_grant(f->estimator, grant);
    if (grant != NULL && grant->prepared == 1) {
        (void)mhe_estimator_prepare(f->estimator, NULL);
    }
}

static void tell_granted(mhi_feed *f, double time, mhe_status status) {
    mhe_grant grant;
    mhi_estimator_granted(f->estimator, &grant);
    grant.prepared = status == MHE_E_INTERRUPTED ? MHE_GRANT_STOPPED : f->prepared;
    f->prepared = 0;
    if (f->pusher != NULL) {
        f->pusher(f->data, &grant, f->start + time);
    }
}

/* A frame that has waited too long, or that was passed over when it was recorded. */
static int32_t pass_over(mhi_feed *f, double time, const mhe_grant *grant) {
    const mhe_grant passed = {.prepared = MHE_GRANT_PASSED_OVER};
    if (grant != NULL ? grant->prepared != MHE_GRANT_PASSED_OVER : !f->behind || f->repeats) {
        return 0;
    }
    f->repeats |= grant != NULL;
    f->n_frames++;
    if (f->n_passed_over++ == 0) {
        warn(f, "the machine does not keep up: frames that have waited for longer than "
                "realtime.most_behind are passed over");
    }
    if (f->pusher != NULL) {
        f->pusher(f->data, &passed, f->start + time);
    }
    return 1;
}

static mhe_status push_frame(mhi_feed *f, mhi_inlet *in, double time, const mhe_grant *grant,
                             mhe_error *err) {
    if (pass_over(f, time, grant)) {
        return MHE_OK;
    }
    mhe_estimate estimate = {.size = sizeof estimate};
    mhe_error why = {0};
    int32_t ready = 0;
    memset(f->channels, 0, sizeof *f->channels * (size_t)f->info.n_channels);
    f->channels[in->channel] = in->row;
    add_electrodes(f, time);
    const mhe_frame frame = {.size = sizeof frame,
                             .time = time,
                             .n_channels = f->info.n_channels,
                             .channels = f->channels};
    f->n_frames++;
    obey(f, grant);
    const mhe_status status = mhe_estimator_push(f->estimator, &frame, &estimate, &ready, &why);
    tell_granted(f, time, status);
    if (status == MHE_E_ARGUMENT) { /* its time does not follow */
        f->n_out_of_order++;
        return MHE_OK;
    }
    if (status == MHE_E_INPUT) { /* this window cannot begin; the next may */
        if (f->n_restarts++ == 0) {
            warn(f, why.text);
        }
        return MHE_OK;
    }
    if (status != MHE_OK) {
        return mhe_fail(err, status, "%s", why.text);
    }
    f->last = time;
    if (ready) {
        f->n_estimates++;
        f->n_by_status[estimate.status >= 0 && estimate.status < 8 ? estimate.status : 7]++;
        mhi_watch_markers(&f->setup, in->name, &estimate, &f->watch);
        if (f->taker != NULL) {
            f->taker(f->data, &estimate, f->start + estimate.time);
        }
    }
    return MHE_OK;
}

/* Envelopes take a while to begin; the first frame waits for them, SETTLE at most. */
static int32_t is_settled(mhi_feed *f, double host_time) {
    if (!isfinite(f->begun) || host_time < f->begun) { /* first, or its clock was set back */
        f->begun = host_time;
    }
    for (int32_t i = 0; i < f->n_inlets && host_time - f->begun < SETTLE; i++) {
        mhi_inlet *in = &f->inlets[i];
        int32_t any = !in->is_raw || in->channel < 0;
        if (!any && isfinite(in->newest)) {
            mhi_electrodes_at(in->electrodes, in->newest, in->row);
            for (int32_t k = 0; k < in->width && !any; k++) {
                any = isfinite(in->row[k]);
            }
        }
        if (!any) {
            return 0;
        }
    }
    return 1;
}

/* `smooth`: s of CLOCK_MONOTONIC, of the sample. */
static mhe_status take_sample(mhi_feed *f, mhi_inlet *in, double smooth, const double *values,
                              const mhe_grant *grant, mhe_error *err) {
    const int32_t is_driver = in == &f->inlets[f->driver];
    in->newest = smooth;
    in->n_samples++;
    mhi_watch_stream(in, &f->setup);
    if (in->is_raw) { /* on the host's time: there may be no frame yet */
        mhi_electrodes_push(in->electrodes, smooth, values);
        return MHE_OK;
    }
    if (f->n_frames == 0 && (!is_driver || !is_settled(f, smooth))) {
        return MHE_OK; /* before the first frame there is no time to give it */
    }
    if (f->n_frames == 0) {
        f->start = smooth;
    }
    const double time = smooth - f->start;
    mhi_inlet_take(in, f->setup.run, values);
    return is_driver ? push_frame(f, in, time, grant, err)
                     : mhe_estimator_measure(f->estimator, in->channel, time, in->row, err);
}

/* The shift that another stream of the source has by now, where it is nearly this one: streams of
 * one clock stay aligned to the sample. */
static double shift_of_source(const mhi_feed *f, const mhi_inlet *in, double shift) {
    for (int32_t i = 0; i < f->n_inlets; i++) {
        if (&f->inlets[i] != in && f->inlets[i].source == in->source &&
            fabs(f->clocks[i].shift - shift) < ALIKE && f->clocks[i].shift != 0) {
            return f->clocks[i].shift;
        }
    }
    return shift;
}

/* Its clock was set by some seconds, which is told. */
static void tell_set(mhi_feed *f, mhi_inlet *in, double seconds) {
    mhi_clock *c = &f->clocks[in - f->inlets];
    char text[300];
    (void)snprintf(text, sizeof text,
                   "stream '%.150s': its clock was set by %.3f s; it goes on as it arrives",
                   in->name, seconds);
    warn(f, text);
    f->n_clock_set++;
    c->shift = shift_of_source(f, in, c->shift);
}

static void tell_unused(const mhi_feed *f, const mhi_inlet *in) {
    char text[300];
    (void)snprintf(text, sizeof text,
                   "stream '%.150s': its stamps do not go with the time (are they in s?); they are "
                   "no longer used, its samples are taken as they come",
                   in->name);
    warn(f, text);
}

static mhe_status take_samples(mhi_feed *f, const mhi_packet *p, mhe_error *err) {
    mhi_inlet *in = mhi_feed_inlet(f, p->source, p->stream);
    if (in == NULL || in->channel < 0 || p->n_channels != in->n_channels || !f->running) {
        return MHE_OK;
    }
    in->lost = 0;
    mhi_clock *clock = &f->clocks[in - f->inlets];
    mhi_clock_packet work;
    mhi_clock_begin(clock, p, in->rate, &work);
    mhe_status status = MHE_OK;
    int64_t before = f->n_frames;
    int32_t next = 0; /* grant */
    for (int32_t k = 0; k < p->n && status == MHE_OK; k++) {
        const mhe_grant *grant = next < p->n_grants ? &p->grants[next] : NULL;
        double set, time = mhi_clock_time(clock, &work, k, &set);
        if (set != 0) {
            const double shift = clock->shift;
            tell_set(f, in, set);
            time += clock->shift - shift;
        }
        if (grant != NULL && grant->prepared == MHE_GRANT_STOPPED) {
            break; /* nothing came of it and of those after it */
        }
        time = mhi_stamp_next(&in->stamp, time, p->received, p->stamp == NULL || clock->unused);
        status = take_sample(f, in, time - in->delay, p->values + (ptrdiff_t)k * p->n_channels,
                             grant, err);
        next += f->n_frames > before;
        before = f->n_frames;
    }
    if (mhi_clock_end(clock, &work)) {
        tell_unused(f, in);
    }
    return status == MHE_OK && in->is_raw ? serve_waiting(f, in, err) : status;
}

static void take_event(mhi_feed *f, const mhi_packet *p) {
    const int lost = p->event == MHE_SOURCE_LOST, back = p->event == MHE_SOURCE_BACK;
    for (int32_t i = 0; i < f->n_inlets; i++) {
        mhi_inlet *in = &f->inlets[i];
        if (in->source == p->source && (p->stream < 0 || p->stream == in->stream)) {
            in->lost = lost ? 1 : back ? 0 : in->lost;
        }
    }
    f->setup.host->log(f->setup.host, back ? MHE_LOG_INFO : MHE_LOG_WARNING,
                       p->text == NULL ? "an event of a source" : p->text);
}

mhe_status mhi_feed_take(mhi_feed *f, const mhi_packet *p, mhe_error *err) {
    if (p->kind == MHI_PACKET_STREAM) {
        return take_stream(f, p, err);
    }
    if (p->kind == MHI_PACKET_EVENT) {
        if (p->event != MHE_SOURCE_ENDED) {
            take_event(f, p);
        }
        return MHE_OK;
    }
    return take_samples(f, p, err);
}

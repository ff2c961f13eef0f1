/* SPDX-License-Identifier: Apache-2.0 */
#include "base/text.h"
#include "believe/believe.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LATEST 0.3      /* s that a force may follow its EMG, and more than any does */
#define BEYOND 2.0      /* of the MVC: fast motions reach 1.5 */
#define BELOW (-0.05)   /* a filter may swing below 0 */
#define RAW_SHARE 0.1   /* of the samples are below 0: an alternating signal */
#define OFTEN 0.002     /* share of samples above BEYOND that is no slip */
#define MOSTLY 0.05     /* share that is another unit; noise as large as the EMG makes 0.02 */
#define NEVER 10.0      /* of the MVC: another unit */
#define QUIET 0.02      /* no muscle reaches 2 % of its MVC */
#define OWN_PEAK 1e-6   /* a maximum of exactly 1 ... */
#define OWN_PEAKS 3     /* ... in so many channels and in most of them */
#define WHOLE 0.9       /* share of frames with EMG that is all but a filter's run-in */
#define FLAT 0.3        /* s of one and the same value */
#define FLAT_SHARE 0.02 /* of the recording */
#define REST 0.02       /* of the MVC: a muscle at rest, as far as forces are concerned */
#define REST_SHARE 0.05 /* of the samples; people rest each muscle for longer in a recording */
#define REST_TIME 1.0   /* s: in a shorter recording they may not */
#define REST_CHANNELS 3 /* of so many and more one rests at times */
#define LINE 0.97       /* share of the squares that one straight line explains */
#define RISE 0.05       /* of the MVC along it: less moves no force */
#define FEW 4           /* times as many columns, and muscles, are without the other */
#define MANY 6          /* of so many and more one rests nearly always; else ... */
#define TENSE 0.25      /* ... in that share of the frames all have something in common */

typedef struct channel {
    double low, high;
    int32_t n, n_below, n_beyond, n_flat, n_rest;
} channel;

static channel look_at(const mhi_recording *r, int32_t n_m, int32_t muscle) {
    channel c = {INFINITY, -INFINITY, 0, 0, 0, 0, 0};
    int32_t run = 0;
    double last = NAN;
    for (int32_t k = 0; k < r->n_frames; k++) {
        const double value = r->emg[(ptrdiff_t)k * n_m + muscle];
        if (isnan(value)) {
            last = value;
            run = 0;
            continue;
        }
        run = value == last && fabs(value) > REST ? run + 1 : 0; /* rest may be rounded */
        c.n_flat += run > FLAT * r->rate;
        last = value;
        c.low = fmin(c.low, value);
        c.high = fmax(c.high, value);
        c.n++;
        c.n_below += value < BELOW;
        c.n_beyond += value > BEYOND;
        c.n_rest += value < REST;
    }
    return c;
}

static void add_name(mhi_text *list, const char *name) {
    mhi_text_add(list, "%s%s", list->length == 0 ? "" : ", ", name);
}

/* What cannot be normalised EMG at all. */
static mhe_status check_scale(const char *path, const channel *all, int32_t n, mhe_error *err) {
    double n_samples = 0, n_below = 0, n_beyond = 0, low = INFINITY, high = -INFINITY;
    for (int32_t i = 0; i < n; i++) {
        n_samples += all[i].n;
        n_below += all[i].n_below;
        n_beyond += all[i].n_beyond;
        low = fmin(low, all[i].low);
        high = fmax(high, all[i].high);
    }
    if (n_samples > 0 && n_below > RAW_SHARE * n_samples) {
        return mhe_fail(err, MHE_E_INPUT,
                        "%s: values from %.4g to %.4g, %.0f %% of them below 0: is this raw EMG? "
                        "Normalised EMG goes from 0 to 1; the section emg with channels makes it "
                        "of raw",
                        path, low, high, 100 * n_below / n_samples);
    }
    if (n_beyond > MOSTLY * n_samples || (high > NEVER && n_beyond > OFTEN * n_samples)) {
        return mhe_fail(err, MHE_E_INPUT,
                        "%s: values from %.4g to %.4g: %s Normalised EMG goes from 0 to 1", path,
                        low, high,
                        high <= 300 ? "percent? Divide them by 100."
                                    : "raw EMG? The section emg with channels makes shares of it.");
    }
    return MHE_OK;
}

/* Share of the frames with EMG in which no channel is at rest. */
static double tense_share(const mhi_recording *r, int32_t n_m) {
    int32_t n = 0, n_tense = 0;
    for (int32_t k = 0; k < r->n_frames; k++) {
        double least = INFINITY;
        for (int32_t i = 0; i < n_m; i++) {
            least = fmin(least, r->emg[(ptrdiff_t)k * n_m + i]); /* passes NaN over */
        }
        n += isfinite(least);
        n_tense += isfinite(least) && least > REST;
    }
    return n == 0 ? 0 : (double)n_tense / n;
}

/* What adds to all channels is at once in all of them, and leaves none at rest. */
static void check_rest(const char *path, const mhe_description *d, const mhi_recording *r,
                       const channel *all, mhi_findings *findings) {
    int32_t n_there = 0, n_restless = 0;
    double least = INFINITY;
    for (int32_t i = 0; i < d->n_muscles; i++) {
        n_there += all[i].n > 0;
        n_restless += all[i].n > 0 && all[i].n_rest < REST_SHARE * all[i].n;
        least = fmin(least, all[i].low);
    }
    const double tense = tense_share(r, d->n_muscles);
    if (r->n_frames < REST_TIME * r->rate) {
        return;
    }
    if (n_there >= REST_CHANNELS && n_restless == n_there) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "an offset, mains hum or noise that was not taken off? Take off what each "
                         "channel shows at rest: it moves all forces up",
                         "%s: none of %d muscles is ever at rest (below %.0f %% of its MVC; the "
                         "least is %.0f %%)",
                         path, n_there, 100 * REST, 100 * least);
    } else if (n_there >= MANY && tense > TENSE) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "an artefact that all channels have in common, hum, or a clock? High-pass "
                         "raw EMG (20 Hz) before its envelope is made",
                         "%s: all of %d muscles are active at once (above %.0f %% of the MVC) in "
                         "%.0f %% of the frames",
                         path, n_there, 100 * REST, 100 * tense);
    }
}

/* What a straight line through the channel rises by from the first frame to the last, where the
 * line is all that there is; else 0. Muscles that are tensed slowly tremble about their line. */
static double rises(const mhi_recording *r, int32_t n_m, int32_t muscle) {
    double n = 0, t = 0, y = 0, tt = 0, ty = 0, yy = 0;
    for (int32_t k = 0; k < r->n_frames; k++) {
        const double value = r->emg[(ptrdiff_t)k * n_m + muscle], x = k;
        if (!isnan(value)) {
            n++;
            t += x;
            y += value;
            tt += x * x;
            ty += x * value;
            yy += value * value;
        }
    }
    const double xx = tt - t * t / n, xy = ty - t * y / n, all = yy - y * y / n;
    return n >= REST_TIME * r->rate && xx > 0 && xy * xy > LINE * xx * all ? xy / xx * r->n_frames
                                                                           : 0;
}

/* An amplifier that drifts, an electrode that dries. */
static void check_drift(const char *path, const mhe_description *d, const mhi_recording *r,
                        mhi_findings *findings) {
    mhi_text drift = {0};
    for (int32_t i = 0; i < d->n_muscles; i++) {
        const double by = rises(r, d->n_muscles, i);
        if (fabs(by) > RISE) {
            mhi_text_add(&drift, "%s%s (by %.2f)", drift.length == 0 ? "" : ", ",
                         d->muscles[i].name, by);
        }
    }
    if (drift.length > 0) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "an amplifier's drift? High-pass raw EMG before its envelope is made",
                         "%s: nothing but a straight line: %s", path, drift.data);
    }
    mhi_text_free(&drift);
}

/* The envelope is cut to emg.max: what was above stands in no frame. */
static void check_peak(const char *path, const mhi_run *run, const mhi_recording *r,
                       mhi_findings *findings) {
    const mhi_emg_report *e = &r->emg_report;
    if (e->n_channels > 0 && e->peak > BEYOND) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "an artefact (a cable, a single sample), or a wrong MVC? It is cut to "
                         "emg.max and believed there",
                         "%s: channel '%s' reaches %.3g %% of its MVC", path,
                         run->emg.channels[e->peak_channel].name, 100 * e->peak);
    }
}

/* One list of muscles a kind. */
static void check_channels(const char *path, const mhe_description *d, const mhi_recording *r,
                           const channel *all, mhi_findings *findings) {
    mhi_text flat = {0}, zero = {0}, own = {0}, below = {0}, beyond = {0};
    int32_t n_own = 0, n_there = 0, n_quiet = 0;
    for (int32_t i = 0; i < d->n_muscles; i++) {
        const channel *c = &all[i];
        if (c->n == 0) {
            continue;
        }
        n_there++;
        n_quiet += c->high < QUIET;
        if (c->high == 0 && c->low == 0) {
            add_name(&zero, d->muscles[i].name);
        } else if (c->n_flat > FLAT_SHARE * r->n_frames) {
            add_name(&flat, d->muscles[i].name);
        }
        if (c->n_below > OFTEN * c->n) {
            add_name(&below, d->muscles[i].name);
        }
        if (c->n_beyond > OFTEN * c->n) {
            add_name(&beyond, d->muscles[i].name);
        }
        if (fabs(c->high - 1) < OWN_PEAK) {
            add_name(&own, d->muscles[i].name);
            n_own++;
        }
    }
    if (zero.length > 0) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "leave these columns out if nothing was measured: an absent one is "
                         "estimated, one of zeros is believed",
                         "%s: nothing but zeros: %s", path, zero.data);
    }
    if (flat.length > 0) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "was the electrode off? Write NaN where nothing was measured",
                         "%s: the same value for more than %.1f s: %s", path, FLAT, flat.data);
    }
    if (below.length > 0) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL, "normalised EMG goes from 0 to 1",
                         "%s: values below 0: %s", path, below.data);
    }
    if (beyond.length > 0) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "percent, a wrong MVC, or noise? Normalised EMG goes from 0 to 1",
                         "%s: values above %.0f times the MVC: %s", path, BEYOND, beyond.data);
    }
    if (n_own >= OWN_PEAKS && 2 * n_own > n_there) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "EMG scaled to each channel's own peak says nothing of how strong a "
                         "muscle was: divide by the MVC, or give it a larger sigma",
                         "%s: the maximum is exactly 1 in %d of %d channels (%s)", path, n_own,
                         n_there, own.data);
    }
    if (n_there > 1 && n_quiet == n_there) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "are these volts, or shares of another unit? Divide by the MVC",
                         "%s: no muscle reaches %.0f %% of its MVC", path, 100 * QUIET);
    }
    mhi_text_free(&flat);
    mhi_text_free(&zero);
    mhi_text_free(&own);
    mhi_text_free(&below);
    mhi_text_free(&beyond);
}

/* 1: the two channels are the same to the last digit, and more than rest. */
static int32_t are_twins(const mhi_recording *r, int32_t n_m, int32_t a, int32_t b) {
    int32_t n = 0;
    for (int32_t k = 0; k < r->n_frames; k++) {
        const double *of = r->emg + (ptrdiff_t)k * n_m;
        if (memcmp(&of[a], &of[b], sizeof *of) != 0) {
            return 0;
        }
        n += of[a] > REST;
    }
    return n > 0;
}

/* One electrode's EMG for several muscles may be meant; a column that was copied is not. */
static void check_twins(const char *path, const mhe_description *d, const mhi_recording *r,
                        mhi_findings *findings) {
    mhi_text twins = {0};
    for (int32_t i = 0; i < d->n_muscles; i++) {
        int32_t k = 0;
        while (k < i && !are_twins(r, d->n_muscles, k, i)) {
            k++;
        }
        if (k < i) {
            mhi_text_add(&twins, "%s%s as %s", twins.length == 0 ? "" : ", ", d->muscles[i].name,
                         d->muscles[k].name);
        }
    }
    if (twins.length > 0) {
        mhi_findings_add(findings, MHI_FINDING_NOTE,
                         "right where one electrode stands for several muscles (emg.channels says "
                         "so)",
                         "%s: columns that are the same to the last digit: %s", path, twins.data);
    }
    mhi_text_free(&twins);
}

/* EMG that is there for part of the frames: estimates with and without it differ. */
static void check_overlap(const char *path, const mhi_recording *r, int32_t n_m,
                          mhi_findings *findings) {
    int32_t n = 0, first = -1, last = -1;
    for (int32_t k = 0; k < r->n_frames; k++) {
        int32_t there = 0;
        for (int32_t i = 0; i < n_m && !there; i++) {
            there = !isnan(r->emg[(ptrdiff_t)k * n_m + i]);
        }
        n += there;
        first = there && first < 0 ? k : first;
        last = there ? k : last;
    }
    if (n > 0 && n < WHOLE * r->n_frames && r->n_frames - n > 2) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "forces are those of EMG only there; data.emg_offset moves the EMG",
                         "%s: EMG from %.4g to %.4g s, frames from %.4g to %.4g s: %.0f %% of the "
                         "frames have EMG",
                         path, r->time[first], r->time[last], r->time[0], r->time[r->n_frames - 1],
                         100.0 * n / r->n_frames);
    }
}

/* A name or two that two models share; files with other signals hold more of this one's. */
static void check_names(const char *path, const mhi_recording *r, int32_t n_m,
                        mhi_findings *findings) {
    const int32_t found = r->n_emg_found;
    if (found > 0 && FEW * found < r->n_emg_columns && FEW * found < n_m) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "EMG of another model? data.labels, or emg.channels, say which is which",
                         "%s: of %d columns %d are muscles of the model, which has %d", path,
                         (int)r->n_emg_columns, (int)found, (int)n_m);
    }
}

/* Which costs want EMG is known of those that say so in their id. */
static int32_t wants_emg(const mhi_run *run) {
    for (int32_t i = 0; i < run->n_costs; i++) {
        if (strstr(run->costs[i].plugin->id, "emg") != NULL && run->costs[i].weight > 0) {
            return 1;
        }
    }
    return 0;
}

mhe_status mhi_believe_emg(const mhi_run *run, const mhe_description *d, const mhi_recording *r,
                           mhi_findings *findings, mhe_error *err) {
    if (r->emg == NULL) {
        if (wants_emg(run)) {
            mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                             "name the EMG in data.emg, or take a cost that needs none",
                             "%s: a cost tracks EMG, but data.emg is not given: forces are the "
                             "smallest that the motion needs",
                             run->path);
        }
        return MHE_OK;
    }
    const char *path = run->data.emg;
    const double late = run->data.emg_delay / r->rate;
    if (late > LATEST) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "it counts frames, not ms; EMG comes 20 to 100 ms before the force",
                         "data.emg_delay: %d frames are %.3g s, in a recording of %.3g s",
                         (int)run->data.emg_delay, late, (r->n_frames - 1) / r->rate);
    }
    channel *all = calloc((size_t)d->n_muscles + 1, sizeof *all);
    if (all == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < d->n_muscles; i++) {
        all[i] = look_at(r, d->n_muscles, i);
    }
    mhe_status status = MHE_OK;
    if (run->emg.n_channels == 0) {
        status = check_scale(path, all, d->n_muscles, err);
    }
    if (status == MHE_OK && run->emg.n_channels == 0) {
        check_twins(path, d, r, findings);
    }
    if (status == MHE_OK) {
        check_channels(path, d, r, all, findings);
        check_drift(path, d, r, findings);
        check_peak(path, run, r, findings);
        check_rest(path, d, r, all, findings);
        check_names(path, r, d->n_muscles, findings);
        check_overlap(path, r, d->n_muscles, findings);
    }
    free(all);
    return status;
}

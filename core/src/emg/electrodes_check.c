/* SPDX-License-Identifier: Apache-2.0 */
/* electrodes_check.c: does this look like EMG, and like these MVC values? */
#include "base/text.h"
#include "emg/electrodes.h"

#include <math.h>

#define FLAT 0.5        /* s of one and the same number, as in envelope.c */
#define FLAT_SHARE 0.01 /* of the recording that is told */
#define RAIL_SHARE 0.01
#define PEAK_HIGH 2.0 /* fast motions reach 1.5 */
#define PEAK_IMPOSSIBLE 20.0
#define PEAK_LOW 0.01
#define LONGER 300.0 /* than the frames: no recording is, but one in ms */

static void tell(const mhe_host *host, const char *source, const char *what, mhi_text *list) {
    mhi_text line = {0};
    mhi_text_add(&line, "%s: %s: %s", source, what, list->data == NULL ? "" : list->data);
    if (!line.failed && list->length > 0) {
        host->log(host, MHE_LOG_WARNING, line.data);
    }
    mhi_text_free(&line);
    mhi_text_free(list);
}

static void add_share(mhi_text *list, const char *name, double share) {
    mhi_text_add(list, "%s%s (%.3g %%)", list->length == 0 ? "" : ", ", name, 100 * share);
}

struct shares { /* of the samples */
    double missing, flat, railed;
};

static struct shares look_at(const mhi_table *table, int32_t column) {
    const double *v = table->values + column;
    const int32_t step = table->n_columns, n = table->n_rows;
    double low = INFINITY, high = -INFINITY;
    for (int32_t k = 0; k < n; k++) {
        low = fmin(low, v[(ptrdiff_t)k * step]);
        high = fmax(high, v[(ptrdiff_t)k * step]);
    }
    int32_t missing = 0, flat = 0, railed = 0;
    for (int32_t k = 0, end; k < n; k = end) {
        const double value = v[(ptrdiff_t)k * step];
        for (end = k + 1; end < n && v[(ptrdiff_t)end * step] == value; end++) {
        }
        missing += isnan(value);
        flat += end - k > FLAT * table->rate ? end - k : 0;
        /* one sample is always the largest; two in a row are cut off */
        railed += (value == low || value == high) && end - k > 1 ? end - k : 0;
    }
    return (struct shares){(double)missing / n, (double)flat / n, (double)(railed) / n};
}

void mhi_electrodes_tell_absent(const mhi_run *run, const char *source, const int32_t *column,
                                const mhe_host *host) {
    mhi_text absent = {0};
    for (int32_t i = 0; i < run->emg.n_channels; i++) {
        if (column[i] < 0) {
            mhi_text_add(&absent, "%s%s", absent.length == 0 ? "" : ", ",
                         run->emg.channels[i].name);
        }
    }
    tell(host, source, "no column for the channel", &absent);
}

void mhi_electrodes_check_raw(const mhi_run *run, const mhi_table *table, const int32_t *column,
                              const mhe_host *host) {
    mhi_text missing = {0}, flat = {0}, railed = {0};
    for (int32_t i = 0; i < run->emg.n_channels && run->emg.process; i++) {
        if (column[i] < 0) {
            continue;
        }
        const struct shares s = look_at(table, column[i]);
        const char *name = run->emg.channels[i].name;
        if (s.missing > FLAT_SHARE) {
            add_share(&missing, name, s.missing);
        }
        if (s.flat > FLAT_SHARE) {
            add_share(&flat, name, s.flat);
        } else if (s.railed > RAIL_SHARE) {
            add_share(&railed, name, s.railed);
        }
    }
    tell(host, table->path, "channels without a sample for part of the time are not tracked there",
         &missing);
    tell(host, table->path,
         "channels that are flat for more than half a second (electrode off?) are not tracked "
         "there",
         &flat);
    tell(host, table->path, "channels cut off at their largest values (amplifier saturated?)",
         &railed);
}

static void add_peak(mhi_text *list, const char *name, double peak) {
    mhi_text_add(list, "%s%s (%.3g %%)", list->length == 0 ? "" : ", ", name, 100 * peak);
}

/* Channels whose raw EMG is measured against nothing. */
static int32_t list_without_mvc(const mhi_run *run, mhi_text *out) {
    int32_t n = 0;
    for (int32_t i = 0; i < run->emg.n_channels && run->emg.mvc_file == NULL; i++) {
        if (run->emg.process && run->emg.channels[i].mvc == 0) {
            mhi_text_add(out, "%s%s", n++ == 0 ? "" : ", ", run->emg.channels[i].name);
        }
    }
    return n;
}

mhe_status mhi_electrodes_check_peaks(const mhi_run *run, const char *source, const double *peaks,
                                      const mhe_host *host, mhe_error *err) {
    mhi_text high = {0}, low = {0}, without = {0};
    const int32_t n_without = list_without_mvc(run, &without);
    int32_t n_low = 0, n_there = 0, worst = -1;
    for (int32_t i = 0; i < run->emg.n_channels; i++) {
        if (isnan(peaks[i])) {
            continue;
        }
        n_there++;
        if (peaks[i] > PEAK_IMPOSSIBLE && (worst < 0 || peaks[i] > peaks[worst])) {
            worst = i;
        }
        if (peaks[i] > PEAK_HIGH) {
            add_peak(&high, run->emg.channels[i].name, peaks[i]);
        } else if (peaks[i] < PEAK_LOW) {
            add_peak(&low, run->emg.channels[i].name, peaks[i]);
            n_low++;
        }
    }
    const char *remedy =
        n_without == run->emg.n_channels
            ? "raw EMG needs an 'mvc' of each channel, or emg.mvc_file"
            : "are EMG and MVC in the same unit (V, mV, uV), and of the same processing?";
    mhe_status status = MHE_OK;
    if (worst >= 0) {
        status = mhe_fail(err, MHE_E_INPUT, "%s: channel '%s' reaches %.4g %% of its MVC: %s",
                          source, run->emg.channels[worst].name, 100 * peaks[worst], remedy);
    } else if (n_low > 1 && n_low == n_there) {
        status = mhe_fail(err, MHE_E_INPUT, "%s: no channel reaches 1 %% of its MVC: %s", source,
                          remedy);
    }
    if (status == MHE_OK) {
        tell(host, source, "channels without an MVC, whose envelopes are taken as shares of it",
             &without);
        tell(host, source, "channels far above their MVC, which may be too small", &high);
        tell(host, source, "channels below 1 % of their MVC, which may be too large", &low);
    }
    mhi_text_free(&high);
    mhi_text_free(&low);
    mhi_text_free(&without);
    return status;
}

mhe_status mhi_emg_check_times(const mhi_table *table, double offset, const double *time,
                               int32_t n_frames, mhe_error *err) {
    const double first = table->time[0] + offset, last = table->time[table->n_rows - 1] + offset;
    const double from = time[0], to = time[n_frames - 1];
    if (n_frames > 1 && last - first > LONGER * (to - from)) {
        return mhe_fail(err, MHE_E_INPUT,
                        "%s: goes from %g to %g s, the frames from %g to %g s: are its times in ms "
                        "instead of s?",
                        table->path, first, last, from, to);
    }
    if (first > to || last < from) {
        return mhe_fail(err, MHE_E_INPUT,
                        "%s: goes from %g to %g s, the frames from %g to %g s: there is no time in "
                        "common (data.emg_offset moves the EMG)",
                        table->path, first, last, from, to);
    }
    return MHE_OK;
}

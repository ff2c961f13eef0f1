/* SPDX-License-Identifier: Apache-2.0 */
/* electrodes.h: raw EMG of electrodes becomes normalised EMG of muscles at the times of frames.
 *
 * A recording and a live stream take the same way with the same result, to the bit:
 *
 *     mhi_electrodes_open(run, model, labels, n, rate, mvc, &e, &err);
 *     for each sample:  mhi_electrodes_push(e, time, raw);
 *     for each frame:   mhi_electrodes_at(e, frame_time, emg);
 *
 * A muscle's value is the newest envelope at or before the frame's time, less what the
 * electromechanical delay is longer than the filters' own, times gain / MVC, cut to 0..max. The
 * part of the filters' delay beyond the electromechanical delay is the lag: the EMG is that late.
 *
 * Threads: electrodes belong to one thread at a time. */
#ifndef MHI_EMG_ELECTRODES_H
#define MHI_EMG_ELECTRODES_H

#include "config/run.h"
#include "io/table.h"

#include <mhe/description.h>
#include <mhe/host.h>

typedef struct mhi_electrodes mhi_electrodes;

/* For the channels of run->emg among columns `labels` [n_labels], sampled at `rate` (Hz); times
 * pushed get data.emg_offset added. `mvc` [channels] is the envelope at maximal contraction.
 * `source` names the columns' file in messages. MHE_E_INPUT: no channel is a column (one that is
 * none stays without EMG), or two are one; MHE_E_CONFIG: a muscle is none of the model's or stands
 * at two channels. [cold] */
mhe_status mhi_electrodes_open(const mhi_run *run, const mhe_description *model, const char *source,
                               const char *const *labels, int32_t n_labels, double rate,
                               const double *mvc, mhi_electrodes **electrodes, mhe_error *err);
void mhi_electrodes_close(mhi_electrodes *electrodes);
/* Tells the host of channels that are no column. [cold] */
void mhi_electrodes_tell(const mhi_electrodes *electrodes, const mhi_run *run, const char *source,
                         const mhe_host *host);

/* The next sample, raw [n_labels], NaN where missing. Times that do not increase are passed over;
 * a second and more before the last one it begins anew. [hot] */
void mhi_electrodes_push(mhi_electrodes *electrodes, double time, const double *raw);
/* Normalised EMG [n_muscles] at a time; NaN: no electrode, or nothing measured. Samples of the last
 * second are kept. [hot] */
void mhi_electrodes_at(const mhi_electrodes *electrodes, double time, double *emg);
/* The same as a mean of the samples from a time on, `span` s long, those that are there so far;
 * where there is none, that at the time. With span 0: mhi_electrodes_at(). [hot] */
void mhi_electrodes_mean(const mhi_electrodes *electrodes, double time, double span, double *emg);
/* Largest envelope of a channel so far, in the column's unit, NaN before the first; with `reset`
 * the search begins anew. 0: it is no column. [any] */
int32_t mhi_electrodes_peak(mhi_electrodes *electrodes, int32_t channel, int32_t reset,
                            double *peak);
/* Tells the host of envelopes that are far too large so far. [cold] */
void mhi_electrodes_watch(const mhi_electrodes *electrodes, const mhi_run *run, const char *source,
                          const mhe_host *host);
/* The EMG of a channel is relative to another maximum from the next sample on. 0: it is no column,
 * or the value is no maximum. [any] */
int32_t mhi_electrodes_set_mvc(mhi_electrodes *electrodes, const mhi_run *run, int32_t channel,
                               double mvc);
/* Delay of the filters, and the part of it beyond the electromechanical delay, s. [any] */
double mhi_electrodes_filter_delay(const mhi_electrodes *electrodes);
double mhi_electrodes_lag(const mhi_electrodes *electrodes);

/* Envelope at maximal contraction of each channel [channels]: as given, from emg.mvc_file, or 1.
 * A file that no channel needs is told to `host` (NULL: to nobody). MHE_E_INPUT: the file. [cold]
 */
mhe_status mhi_electrodes_mvc(const mhi_run *run, const mhe_description *model, double *mvc,
                              const mhe_host *host, mhe_error *err);

/* For samples that come live: with the MVC that the config says. MHE_E_CONFIG: there are no
 * channels, or they ask for what looks ahead. [cold] */
mhe_status mhi_electrodes_open_live(const mhi_run *run, const mhe_description *model,
                                    const char *const *columns, int32_t n_columns, double rate,
                                    mhi_electrodes **electrodes, mhe_error *err);

/* What became of a recording. */
typedef struct mhi_emg_report {
    int32_t n_channels;               /* 0: the columns are muscles; the rest is 0 then */
    double rate;                      /* Hz */
    double offset, filter_delay, lag; /* s */
    double peak;                      /* of its MVC, of the channel that reaches most; NaN: none */
    int32_t peak_channel;
} mhi_emg_report;

/* The file data.emg on frames at time [n_frames], `step` s apart: emg [n_frames x n_muscles], at
 * the frames or the mean until the next, as run->emg.sample says. `table` is changed. What looks
 * wrong in the data is told to the host, or refused where it cannot be right. MHE_E_INPUT,
 * MHE_E_CONFIG. [cold] */
mhe_status mhi_electrodes_read(const mhi_run *run, const mhe_description *model, mhi_table *table,
                               const double *time, int32_t n_frames, double step, double *emg,
                               int32_t *n_muscles_found, mhi_emg_report *report,
                               const mhe_host *host, mhe_error *err);

/* electrodes_check.c: warnings about channels that are no column (`column` [channels] below 0:
 * their muscles have no EMG), about what a raw channel should not look like (flat, at its rail,
 * missing), and about the size of the normalised peaks [channels]; MHE_E_INPUT: no scale is like
 * that. */
void mhi_electrodes_tell_absent(const mhi_run *run, const char *source, const int32_t *column,
                                const mhe_host *host);
void mhi_electrodes_check_raw(const mhi_run *run, const mhi_table *table, const int32_t *column,
                              const mhe_host *host);
mhe_status mhi_electrodes_check_peaks(const mhi_run *run, const char *source, const double *peaks,
                                      const mhe_host *host, mhe_error *err);
/* MHE_E_INPUT: EMG that starts `offset` (s) later than its table says has no time in common with
 * frames at time [n_frames], or goes on for so much longer that it must be in ms. */
mhe_status mhi_emg_check_times(const mhi_table *table, double offset, const double *time,
                               int32_t n_frames, mhe_error *err);

#endif

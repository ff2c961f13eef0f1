/* SPDX-License-Identifier: Apache-2.0 */
/* electrodes_recording.c: whole files: MVC values, envelopes that look ahead, frames. */
#include "emg/electrodes_private.h"
#include "io/motion_file.h"

#include <stdlib.h>

/* Columns of the channels replaced by their envelopes, where these look ahead. */
static mhe_status smooth_whole(const mhi_run *run, mhi_table *table, const int32_t *column,
                               mhe_error *err) {
    double *signal = malloc(sizeof(double) * ((size_t)table->n_rows + 1));
    mhe_status status = signal == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    for (int32_t i = 0; i < run->emg.n_channels && status == MHE_OK; i++) {
        if (column[i] < 0) {
            continue;
        }
        double *values = table->values + column[i];
        mhe_error why = {0};
        for (int32_t k = 0; k < table->n_rows; k++) {
            signal[k] = values[(ptrdiff_t)k * table->n_columns];
        }
        status = mhi_envelope_zero_phase(&run->emg, table->rate, signal, table->n_rows, &why);
        if (status != MHE_OK) {
            (void)mhe_fail(err, status, "%s: %s", table->path, why.text);
        }
        for (int32_t k = 0; k < table->n_rows; k++) {
            values[(ptrdiff_t)k * table->n_columns] = signal[k];
        }
    }
    free(signal);
    return status;
}

/* Opens electrodes on a table; a run that looks ahead gets its envelopes here. */
static mhe_status open_on(const mhi_run *run, const mhe_description *model, mhi_table *table,
                          const double *mvc, mhi_electrodes **e, mhe_error *err) {
    const char *const *labels = (const char *const *)table->labels;
    mhe_status status = mhi_electrodes_open(run, model, table->path, labels, table->n_labels,
                                            table->rate, mvc, e, err);
    if (status != MHE_OK || !run->emg.process || !run->emg.zero_phase) {
        return status;
    }
    status = smooth_whole(run, table, (*e)->column, err);
    mhi_electrodes_close(*e);
    *e = NULL;
    mhi_run ready = *run;
    ready.emg.process = 0;
    return status == MHE_OK ? mhi_electrodes_open(&ready, model, table->path, labels,
                                                  table->n_labels, table->rate, mvc, e, err)
                            : status;
}

/* Largest envelope of each channel in the file of maximal contractions, or its only row. */
static mhe_status read_mvc_file(const mhi_run *run, const mhe_description *model, double *mvc,
                                mhe_error *err) {
    mhi_run plain = *run;
    mhi_emg_channel *channels = malloc(sizeof *channels * (size_t)run->emg.n_channels);
    double *ones = malloc(sizeof(double) * (size_t)run->emg.n_channels);
    mhi_table *table = NULL;
    mhi_electrodes *e = NULL;
    mhe_status status = channels == NULL || ones == NULL
                            ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                            : mhi_signals_read(run->emg.mvc_file, &table, err);
    if (status == MHE_OK) {
        for (int32_t i = 0; i < run->emg.n_channels; i++) {
            channels[i] = run->emg.channels[i];
            channels[i].gain = ones[i] = 1;
        }
        plain.emg.channels = channels;
        plain.emg.process = run->emg.process && table->n_rows > 1;
        table->rate = table->n_rows > 1 ? table->rate : 1;
        status = open_on(&plain, model, table, ones, &e, err);
    }
    for (int32_t k = 0; k < (status == MHE_OK ? table->n_rows : 0); k++) {
        mhi_electrodes_push(e, table->time[k], table->values + (ptrdiff_t)k * table->n_columns);
    }
    for (int32_t i = 0; i < run->emg.n_channels && status == MHE_OK; i++) {
        if (run->emg.channels[i].mvc > 0) {
            continue;
        }
        mvc[i] = e->peaks[i];
        if (!(mvc[i] > 0)) {
            status = mhe_fail(err, MHE_E_INPUT, "%s: channel '%s' shows no contraction",
                              run->emg.mvc_file, run->emg.channels[i].name);
        }
    }
    mhi_electrodes_close(e);
    mhi_table_free(table);
    free(channels);
    free(ones);
    return status;
}

mhe_status mhi_electrodes_mvc(const mhi_run *run, const mhe_description *model, double *mvc,
                              const mhe_host *host, mhe_error *err) {
    int32_t open = 0;
    for (int32_t i = 0; i < run->emg.n_channels; i++) {
        const double given = run->emg.channels[i].mvc;
        mvc[i] = given > 0 ? given : 1;
        open += given <= 0;
    }
    if (open == 0 && run->emg.mvc_file != NULL && host != NULL) {
        mhi_text line = {0};
        mhi_text_add(&line,
                     "emg.mvc_file: %s is not looked at: each channel has an 'mvc' of its own",
                     run->emg.mvc_file);
        if (!line.failed) {
            host->log(host, MHE_LOG_WARNING, line.data);
        }
        mhi_text_free(&line);
    }
    const mhe_status status =
        open > 0 && run->emg.mvc_file != NULL ? read_mvc_file(run, model, mvc, err) : MHE_OK;
    return mhi_run_locate_file(run, status, err);
}

mhe_status mhi_electrodes_read(const mhi_run *run, const mhe_description *model, mhi_table *table,
                               const double *time, int32_t n_frames, double step, double *emg,
                               int32_t *n_muscles_found, mhi_emg_report *report,
                               const mhe_host *host, mhe_error *err) {
    mhi_electrodes *e = NULL;
    double *mvc = calloc((size_t)run->emg.n_channels + 1, sizeof *mvc);
    mhe_status status = mvc == NULL
                            ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                            : mhi_emg_check_times(table, run->data.emg_offset, time, n_frames, err);
    if (status == MHE_OK) {
        status = mhi_electrodes_mvc(run, model, mvc, host, err);
    }
    if (status == MHE_OK) {
        int32_t *column = calloc((size_t)run->emg.n_channels + 1, sizeof *column);
        status = column == NULL
                     ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                     : mhi_electrodes_columns(run, table->path, (const char *const *)table->labels,
                                              table->n_labels, column, err);
        if (status == MHE_OK) {
            mhi_electrodes_tell_absent(run, table->path, column, host);
            mhi_electrodes_check_raw(run, table, column, host);
        }
        free(column);
    }
    if (status == MHE_OK) {
        status = open_on(run, model, table, mvc, &e, err);
    }
    if (status == MHE_OK) {
        int32_t next = 0;
        const double span = run->emg.sample == MHI_EMG_SAMPLE_MEAN ? step : 0;
        for (int32_t k = 0; k < n_frames; k++) {
            const double end = time[k] + span + (span > 0 ? -MHI_SAME_TIME : MHI_SAME_TIME);
            for (; next < table->n_rows && table->time[next] + e->offset <= end; next++) {
                mhi_electrodes_push(e, table->time[next],
                                    table->values + (ptrdiff_t)next * table->n_columns);
            }
            mhi_electrodes_mean(e, time[k], span, emg + (ptrdiff_t)k * e->n_muscles);
        }
        *n_muscles_found = 0;
        for (int32_t i = 0; i < e->n_wires; i++) {
            *n_muscles_found += e->column[e->wires[i].channel] >= 0;
        }
        *report = (mhi_emg_report){.n_channels = e->n_channels,
                                   .rate = table->rate,
                                   .offset = e->offset,
                                   .filter_delay = mhi_envelope_delay(e->envelope),
                                   .lag = e->lag,
                                   .peak = NAN};
        for (int32_t i = 0; i < e->n_channels; i++) {
            if (!(e->peaks[i] <= report->peak) && !isnan(e->peaks[i])) {
                report->peak = e->peaks[i];
                report->peak_channel = i;
            }
        }
        status = mhi_electrodes_check_peaks(run, table->path, e->peaks, host, err);
    }
    mhi_electrodes_close(e);
    free(mvc);
    return status;
}

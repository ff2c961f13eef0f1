/* SPDX-License-Identifier: Apache-2.0 */
/* recording_emg.c: EMG onto the frames' times: a column a muscle, or of electrodes. */
#include "estimator/recording_private.h"
#include "io/motion_file.h"

#include <math.h>
#include <stdlib.h>

/* Without markers, frames at a rate of their own over the time of the EMG. */
static mhe_status set_grid(mhi_recording *r, const mhi_run *run, const mhi_table *table,
                           mhe_error *err) {
    const double first = table->time[0] + run->data.emg_offset, rate = run->emg.rate;
    const double n = floor((table->time[table->n_rows - 1] - table->time[0]) * rate + 1e-6) + 1;
    if (!(n < 1e8)) {
        return mhe_fail(err, MHE_E_INPUT, "%s: %g frames at %g Hz are too many", table->path, n,
                        rate);
    }
    r->n_frames = (int32_t)n;
    r->rate = rate;
    r->time = malloc(sizeof(double) * (size_t)r->n_frames);
    if (r->time == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t k = 0; k < r->n_frames; k++) {
        r->time[k] = first + k / rate;
    }
    return MHE_OK;
}

static void tell_alignment(mhi_recording *r, const mhi_run *run, const mhe_host *host) {
    const mhi_emg_report *e = &r->emg_report;
    char lag[128] = "", markers[64] = "no markers";
    if (run->data.markers != NULL) {
        (void)snprintf(markers, sizeof markers, "markers %.6g Hz", r->rate);
    }
    if (e->lag > 0) {
        (void)snprintf(lag, sizeof lag, ", by which the EMG comes %.3g ms late", 1e3 * e->lag);
    }
    (void)snprintf(r->alignment, sizeof r->alignment,
                   "EMG %.6g Hz, %s, grid %.6g Hz, offset %.6g ms; %d channels for %d muscles; "
                   "the filters' delay is %.3g ms%s",
                   e->rate, markers, r->rate, 1e3 * e->offset, e->n_channels, r->n_emg_found,
                   1e3 * e->filter_delay, lag);
    host->log(host, MHE_LOG_INFO, r->alignment);
}

static mhe_status read_electrodes(mhi_recording *r, const mhi_run *run, const mhe_description *d,
                                  mhi_table *table, const mhe_host *host, mhe_error *err) {
    mhe_status status = r->time == NULL ? set_grid(r, run, table, err) : MHE_OK;
    if (status != MHE_OK) {
        return status;
    }
    r->emg = malloc(sizeof(double) * ((size_t)r->n_frames * (size_t)d->n_muscles + 1));
    status = r->emg == NULL
                 ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                 : mhi_electrodes_read(run, d, table, r->time, r->n_frames, 1 / r->rate, r->emg,
                                       &r->n_emg_found, &r->emg_report, host, err);
    if (status == MHE_OK) {
        tell_alignment(r, run, host);
    }
    return status;
}

/* Normalised: a column a muscle. */
static mhe_status read_muscles(mhi_recording *r, const mhi_run *run, const mhe_description *d,
                               mhi_table *table, const mhe_host *host, mhe_error *err) {
    static const mhi_naming naming = {"muscle", {"e_%s", "%s", "%s.excitation"}, 1};
    for (int32_t k = 0; k < table->n_rows; k++) {
        table->time[k] += run->data.emg_offset;
    }
    r->n_emg_columns = table->n_labels;
    const char **names = mhi_recording_names(d, 'm', d->n_muscles);
    mhe_status status = names == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                        : r->time == NULL
                            ? mhi_recording_set_times(r, table, err)
                            : mhi_emg_check_times(table, 0, r->time, r->n_frames, err);
    if (status == MHE_OK) {
        const int32_t rows =
            run->emg.sample == MHI_EMG_SAMPLE_MEAN ? MHI_ROWS_MEAN : MHI_ROWS_LINEAR;
        status = mhi_recording_columns(r, table, &naming, names, d->n_muscles, 1, rows, &r->emg,
                                       &r->n_emg_found, host, err);
    }
    free(names);
    return status;
}

mhe_status mhi_recording_read_emg(mhi_recording *r, const mhi_run *run, const mhe_description *d,
                                  const mhe_host *host, mhe_error *err) {
    mhi_table *table = NULL;
    mhe_status status = mhi_signals_read(run->data.emg, &table, err);
    if (status == MHE_OK) {
        status = mhi_recording_check_table(table, host, err);
    }
    if (status == MHE_OK) {
        status = mhi_recording_name(r, run, table, 1, err);
    }
    if (status == MHE_OK) {
        status =
            (run->emg.n_channels > 0 ? read_electrodes : read_muscles)(r, run, d, table, host, err);
    }
    mhi_table_free(table);
    return status;
}

/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/recording.h"

#include "estimator/columns.h"
#include "estimator/marker_unit.h"
#include "io/motion_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Names of the model in one list; freed by the caller. */
static const char **names_of(const mhe_description *d, int kind, int32_t n) {
    const char **names = calloc((size_t)n + 1, sizeof *names);
    for (int32_t i = 0; i < n && names != NULL; i++) {
        names[i] = kind == 'q'   ? d->coordinates[i].name
                   : kind == 'm' ? d->muscles[i].name
                                 : d->markers[i].name;
    }
    return names;
}

/* Reads one quantity of `n` names, `width` columns each, from a table onto the recording's times:
 * out [n_frames x n width], taken here. */
static mhe_status read_quantity(const mhi_recording *r, const mhi_table *table,
                                const mhi_naming *naming, const char *const *names, int32_t n,
                                int32_t width, int32_t hold, double **out, int32_t *n_found,
                                const mhe_host *host, mhe_error *err) {
    const int32_t n_labels = table->n_columns / width;
    int32_t *column = calloc((size_t)n + 1, sizeof *column);
    uint8_t *used = calloc((size_t)table->n_columns + 1, 1);
    *out = malloc(sizeof(double) * ((size_t)r->n_frames * (size_t)(n * width) + 1));
    mhe_status status = MHE_OK;
    if (column == NULL || used == NULL || *out == NULL) {
        status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
    } else {
        status =
            mhi_columns_match(table, naming, names, n, n_labels, column, used, n_found, host, err);
    }
    for (int32_t k = 0; k < r->n_frames && status == MHE_OK; k++) {
        for (int32_t i = 0; i < n * width; i++) {
            const int32_t label = column[i / width];
            (*out)[(ptrdiff_t)k * n * width + i] =
                label < 0 ? NAN : mhi_column_at(table, label * width + i % width, r->time[k], hold);
        }
    }
    free(column);
    free(used);
    return status;
}

static mhe_status set_times(mhi_recording *r, const mhi_table *table, mhe_error *err) {
    r->n_frames = table->n_rows;
    r->rate = table->rate;
    r->time = malloc(sizeof(double) * (size_t)table->n_rows);
    if (r->time == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    memcpy(r->time, table->time, sizeof(double) * (size_t)table->n_rows);
    return MHE_OK;
}

static void pass_on_warnings(const mhi_table *table, const mhe_host *host) {
    for (int32_t i = 0; i < table->n_warnings; i++) {
        host->log(host, MHE_LOG_WARNING, table->warnings[i]);
    }
}

/* The estimator takes the first window's mean step for all. */
static void warn_uneven(const mhi_recording *r, const char *path, const mhe_host *host) {
    double least = INFINITY, most = 0;
    for (int32_t k = 0; k + 1 < r->n_frames; k++) {
        least = fmin(least, r->time[k + 1] - r->time[k]);
        most = fmax(most, r->time[k + 1] - r->time[k]);
    }
    if (most > 1.5 * least) {
        char line[512];
        (void)snprintf(line, sizeof line,
                       "%.400s: the times are uneven (steps of %.4g to %.4g s) but taken as even",
                       path, least, most);
        host->log(host, MHE_LOG_WARNING, line);
    }
}

/* Raw or in percent; some way above 1 is common in fast motions. */
static void warn_not_normalised(const mhi_recording *r, int32_t n_muscles, const char *path,
                                const mhe_host *host) {
    double least = 0, most = 0;
    for (ptrdiff_t i = 0; i < (ptrdiff_t)r->n_frames * n_muscles; i++) {
        least = fmin(least, r->emg[i]); /* of a number and NaN: the number */
        most = fmax(most, r->emg[i]);
    }
    if (least < -0.05 || most > 2) {
        char line[512];
        (void)snprintf(line, sizeof line,
                       "%.400s: values from %.4g to %.4g; EMG normalised to 0..1 is needed", path,
                       least, most);
        host->log(host, MHE_LOG_WARNING, line);
    }
}

static mhe_status read_markers(mhi_recording *r, const mhi_run *run, const mhe_description *d,
                               const mhe_host *host, mhe_error *err) {
    static const mhi_naming naming = {"marker", {"%s"}, 1};
    mhi_table *table = NULL;
    mhe_status status = mhi_markers_read(run->data.markers, &table, err);
    if (status != MHE_OK) {
        return status;
    }
    pass_on_warnings(table, host);
    const char **names = names_of(d, 'k', d->n_markers);
    status =
        names == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : set_times(r, table, err);
    if (status == MHE_OK) {
        r->unit = table->unit;
        memcpy(r->unit_name, table->unit_name, sizeof r->unit_name);
        status = read_quantity(r, table, &naming, names, d->n_markers, 3, 0, &r->markers,
                               &r->n_markers_found, host, err);
    }
    if (status == MHE_OK) {
        mhi_marker_settle_unit(r, d, table->path, host);
    }
    free(names);
    mhi_table_free(table);
    return status;
}

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
    status = r->emg == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                            : mhi_electrodes_read(run, d, table, r->time, r->n_frames, r->emg,
                                                  &r->n_emg_found, &r->emg_report, host, err);
    if (status == MHE_OK) {
        tell_alignment(r, run, host);
    }
    return status;
}

static mhe_status read_emg(mhi_recording *r, const mhi_run *run, const mhe_description *d,
                           const mhe_host *host, mhe_error *err) {
    static const mhi_naming naming = {"muscle", {"e_%s", "%s", "%s.excitation"}, 1};
    mhi_table *table = NULL;
    mhe_status status = mhi_signals_read(run->data.emg, &table, err);
    if (status != MHE_OK) {
        return status;
    }
    pass_on_warnings(table, host);
    if (run->emg.n_channels > 0) {
        status = read_electrodes(r, run, d, table, host, err);
        mhi_table_free(table);
        return status;
    }
    const double offset = run->data.emg_offset;
    for (int32_t k = 0; k < table->n_rows; k++) {
        table->time[k] += offset;
    }
    const char **names = names_of(d, 'm', d->n_muscles);
    if (r->time != NULL) {
        status = mhi_emg_check_times(table, 0, r->time, r->n_frames, err);
    }
    if (status != MHE_OK) {
        free(names);
        mhi_table_free(table);
        return status;
    }
    if (names == NULL) {
        status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
    } else if (r->time == NULL) {
        status = set_times(r, table, err);
    }
    if (status == MHE_OK) {
        status = read_quantity(r, table, &naming, names, d->n_muscles, 1, 0, &r->emg,
                               &r->n_emg_found, host, err);
    }
    if (status == MHE_OK) {
        warn_not_normalised(r, d->n_muscles, table->path, host);
    }
    free(names);
    mhi_table_free(table);
    return status;
}

/* Angles of a file in degrees. */
static void to_radians(double *values, int32_t n_frames, const mhe_description *d) {
    const double factor = acos(-1) / 180;
    for (ptrdiff_t i = 0; i < (ptrdiff_t)n_frames * d->n_coordinates; i++) {
        values[i] *= d->coordinates[i % d->n_coordinates].rotational ? factor : 1;
    }
}

/* Measured joint angles; without markers their times are the frames'. */
static mhe_status read_angles(mhi_recording *r, const char *path, const mhe_description *d,
                              const mhe_host *host, mhe_error *err) {
    static const mhi_naming naming = {"coordinate", {"%s", "q_%s"}, 1};
    mhi_table *table = NULL;
    mhe_status status = mhi_sto_read(path, &table, err);
    if (status != MHE_OK) {
        return status;
    }
    pass_on_warnings(table, host);
    const char **names = names_of(d, 'q', d->n_coordinates);
    int32_t n_found = 0;
    if (names == NULL) {
        status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
    } else if (r->time == NULL) {
        status = set_times(r, table, err);
    }
    if (status == MHE_OK) {
        status = read_quantity(r, table, &naming, names, d->n_coordinates, 1, 0, &r->angles,
                               &n_found, host, err);
    }
    if (status == MHE_OK && table->in_degrees) {
        to_radians(r->angles, r->n_frames, d);
    }
    free(names);
    mhi_table_free(table);
    return status;
}

static mhe_status read_reference(mhi_recording *r, const char *path, const mhe_description *d,
                                 const mhe_host *host, mhe_error *err) {
    static const mhi_naming q = {"coordinate", {"q_%s", "%s", "q%d"}, 0};
    static const mhi_naming v = {"speed", {"qdot_%s", "%s_u", "%s/speed", "qdot%d"}, 0};
    static const mhi_naming a = {"activation", {"a_%s", "%s.activation", "%s/activation"}, 0};
    static const mhi_naming e = {"excitation", {"e_%s", "%s.excitation"}, 0};
    static const mhi_naming f = {"force", {"F_%s"}, 0};
    mhi_table *table = NULL;
    mhe_status status = mhi_sto_read(path, &table, err);
    if (status != MHE_OK) {
        return status;
    }
    pass_on_warnings(table, host);
    const int32_t n_q = d->n_coordinates, n_m = d->n_muscles;
    const char **coordinates = names_of(d, 'q', n_q), **muscles = names_of(d, 'm', n_m);
    if (coordinates == NULL || muscles == NULL) {
        status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
    } else if (r->time == NULL) {
        status = set_times(r, table, err);
    }
    struct {
        const mhi_naming *naming;
        const char *const *names;
        int32_t n, hold;
        double **out;
    } wanted[] = {{&q, coordinates, n_q, 0, &r->reference.q},
                  {&v, coordinates, n_q, 0, &r->reference.qdot},
                  {&a, muscles, n_m, 0, &r->reference.activation},
                  {&e, muscles, n_m, 1, &r->reference.excitation},
                  {&f, muscles, n_m, 0, &r->reference.force}};
    int32_t found[5] = {0};
    for (size_t i = 0; i < 5 && status == MHE_OK; i++) {
        status = read_quantity(r, table, wanted[i].naming, wanted[i].names, wanted[i].n, 1,
                               wanted[i].hold, wanted[i].out, &found[i], host, err);
    }
    if (status == MHE_OK && found[0] < n_q) {
        char hint[256];
        status = mhe_fail(err, MHE_E_INPUT,
                          "%s: the reference has %d of the model's %d coordinates%s", table->path,
                          found[0], n_q, mhi_suggest(hint, sizeof hint, "", coordinates, n_q));
    }
    if (status == MHE_OK && table->in_degrees) {
        to_radians(r->reference.q, r->n_frames, d);
        to_radians(r->reference.qdot, r->n_frames, d);
    }
    r->reference.present = status == MHE_OK;
    free(coordinates);
    free(muscles);
    mhi_table_free(table);
    return status;
}

static mhi_recording *new_recording(void) {
    mhi_recording *r = calloc(1, sizeof *r);
    if (r != NULL) {
        r->unit = 1;
        memcpy(r->unit_name, "m", 2);
    }
    return r;
}

mhe_status mhi_recording_read_reference(const char *path, const mhe_description *d,
                                        const mhe_host *host, mhi_recording **recording,
                                        mhe_error *err) {
    *recording = NULL;
    mhi_recording *r = new_recording();
    if (r == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = read_reference(r, path, d, host, err);
    if (status != MHE_OK) {
        mhi_recording_free(r);
        return status;
    }
    *recording = r;
    return MHE_OK;
}

mhe_status mhi_recording_read(const mhi_run *run, const mhe_description *d, const mhe_host *host,
                              mhi_recording **recording, mhe_error *err) {
    *recording = NULL;
    const mhi_data_section *data = &run->data;
    const char *source = data->markers != NULL  ? data->markers
                         : data->angles != NULL ? data->angles
                                                : data->emg;
    if (source == NULL) {
        return mhe_fail(err, MHE_E_CONFIG,
                        "%s: data: neither 'markers' nor 'angles' nor 'emg' is given: there is "
                        "nothing to estimate from",
                        run->path);
    }
    mhi_recording *r = new_recording();
    if (r == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = MHE_OK;
    if (run->data.markers != NULL) {
        status = read_markers(r, run, d, host, err);
    }
    r->n_q = d->n_coordinates;
    if (status == MHE_OK && data->angles != NULL) {
        status = read_angles(r, data->angles, d, host, err);
    }
    if (status == MHE_OK && run->data.emg != NULL) {
        status = read_emg(r, run, d, host, err);
    }
    if (status == MHE_OK && run->data.reference != NULL) {
        status = read_reference(r, run->data.reference, d, host, err);
    }
    if (status == MHE_OK) {
        warn_uneven(r, source, host);
    }
    const int64_t span = (int64_t)run->horizon.window * run->horizon.ratio;
    if (status == MHE_OK && r->n_frames <= span) {
        status = mhe_fail(
            err, MHE_E_INPUT,
            "%s: %d frames are too few for a window of %d intervals at ratio %d, which needs %lld",
            source, r->n_frames, run->horizon.window, run->horizon.ratio, (long long)span + 1);
    }
    if (status != MHE_OK) {
        mhi_recording_free(r);
        return status;
    }
    *recording = r;
    return MHE_OK;
}

mhe_frame mhi_recording_frame(const mhi_recording *r, int32_t n_markers, int32_t n_muscles,
                              int32_t k) {
    return (mhe_frame){.size = sizeof(mhe_frame),
                       .time = r->time[k],
                       .markers =
                           r->markers == NULL ? NULL : r->markers + (ptrdiff_t)k * 3 * n_markers,
                       .emg = r->emg == NULL ? NULL : r->emg + (ptrdiff_t)k * n_muscles,
                       .angles = r->angles == NULL ? NULL : r->angles + (ptrdiff_t)k * r->n_q};
}

void mhi_recording_free(mhi_recording *r) {
    if (r == NULL) {
        return;
    }
    free(r->time);
    free(r->markers);
    free(r->emg);
    free(r->angles);
    free(r->reference.q);
    free(r->reference.qdot);
    free(r->reference.activation);
    free(r->reference.excitation);
    free(r->reference.force);
    free(r);
}

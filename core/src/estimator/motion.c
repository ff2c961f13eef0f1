/* SPDX-License-Identifier: Apache-2.0 */
/* motion.c: the range of joint angles that a recording is known to keep to, before it is read. */
#include "base/pi.h"
#include "believe/believe.h"
#include "estimator/estimator_private.h"
#include "io/model_file.h"
#include "io/table.h"

#include <math.h>

/* Least and largest value of column c; NaN where it has none. */
static void column_range(const mhi_table *table, int32_t c, double scale, double *lower,
                         double *upper) {
    *lower = *upper = NAN;
    for (int32_t k = 0; k < table->n_rows; k++) {
        const double value = scale * table->values[k * table->n_columns + c];
        *lower = isnan(*lower) ? value : fmin(*lower, value); /* fmin passes over NaN */
        *upper = isnan(*upper) ? value : fmax(*upper, value);
    }
}

/* A file in degrees whose angles are so small that they may be radians: paths would be fitted to
 * next to nothing. */
static void tell_small(const mhe_description *d, const double *lower, const double *upper,
                       const mhi_table *table, const mhe_host *host) {
    double most = 0;
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        if (d->coordinates[i].rotational && !isnan(lower[i])) {
            most = fmax(most, fmax(fabs(lower[i]), fabs(upper[i])));
        }
    }
    if (table->in_degrees && most > 0 && most < MHI_HARDLY_MOVES) {
        mhe_error note = {0};
        (void)mhe_fail(&note, MHE_E_INPUT,
                       "%s:%d: model.motion: no angle is larger than %.3g degrees: if they are "
                       "radians, write 'inDegrees=no' into the header",
                       table->path, (int)table->line, most * 180 / MHI_PI);
        host->log(host, MHE_LOG_WARNING, note.text);
    }
}

mhe_status mhi_estimator_motion(const mhi_run *run, mhe_description *d, const mhe_host *host,
                                mhe_error *err) {
    const char *file = run->model_file.motion;
    mhi_table *table = NULL;
    int32_t n_found = 0;
    if (file == NULL) {
        file = run->data.angles;
    }
    if (file == NULL) {
        return MHE_OK;
    }
    mhe_status status = mhi_sto_read(file, &table, err);
    if (status != MHE_OK) {
        return status;
    }
    double *lower = mhi_description_take(d, d->n_coordinates);
    double *upper = mhi_description_take(d, d->n_coordinates);
    if (lower == NULL || upper == NULL) {
        mhi_table_free(table);
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        const mhe_coordinate *coordinate = &d->coordinates[i];
        const int32_t c = mhi_table_find(table, coordinate->name);
        const int32_t angle = table->in_degrees && coordinate->rotational;
        lower[i] = upper[i] = NAN;
        if (c >= 0) {
            column_range(table, c, angle ? MHI_PI / 180 : 1, &lower[i], &upper[i]);
            n_found++;
        }
    }
    d->motion_lower = lower;
    d->motion_upper = upper;
    if (n_found == 0 && run->model_file.motion != NULL) {
        status = mhe_fail(err, MHE_E_INPUT,
                          "%s:%d: model.motion: no column is a coordinate of the model ('%s', ...)",
                          file, (int)table->line, d->coordinates[0].name);
    } else if (n_found < d->n_coordinates && run->model_file.motion != NULL) {
        mhe_error note = {0};
        (void)mhe_fail(&note, MHE_E_INPUT,
                       "%s: model.motion: %d of %d coordinates have a column; paths are fitted to "
                       "the others' whole ranges",
                       file, (int)n_found, (int)d->n_coordinates);
        host->log(host, MHE_LOG_WARNING, note.text);
    }
    if (status == MHE_OK &&
        run->model_file.motion != NULL) { /* data.angles are looked at as they are read */
        tell_small(d, lower, upper, table, host);
    }
    mhi_table_free(table);
    return status;
}

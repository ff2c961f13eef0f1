/* SPDX-License-Identifier: Apache-2.0 */
/* factors.c: how much each body is to be scaled. */
#include "base/text.h"
#include "scale/scale_private.h"

#include <math.h>
#include <string.h>

int32_t mhi_scale_body(const mhi_scaled *m, const char *name) {
    for (int32_t i = 0; i < m->n_bodies; i++) {
        if (strcmp(m->bodies[i], name) == 0) {
            return i;
        }
    }
    return -1;
}

mhe_status mhi_scale_look(mhi_inspected *open, const double *q, double *markers, double *lengths,
                          double *bodies, mhe_error *err) {
    const mhe_description *d = open->all;
    mhi_arena arena = {0};
    double *at = MHI_TAKE(&arena, double, d->n_coordinates);
    double *zero = MHI_TAKE(&arena, double, d->n_coordinates);
    if (at == NULL || zero == NULL) {
        mhi_arena_free(&arena);
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        at[i] = q != NULL ? q[i] : d->coordinates[i].value;
    }
    const mhe_kinematics wanted = {
        .size = sizeof wanted, .marker = markers, .length = lengths, .body = bodies};
    const mhe_status status =
        open->skeleton.ops->kinematics(open->skeleton.context, at, zero, &wanted, err);
    mhi_arena_free(&arena);
    return status > 0 ? mhe_fail(err, MHE_E_NUMERIC, "the model has no place in this pose")
                      : status;
}

/* Rows of the trial within a range. */
static mhe_status rows_in(const mhi_scale_setup *s, const mhi_table *trial, const double range[2],
                          const char *whose, int32_t rows[2], mhe_error *err) {
    rows[0] = rows[1] = 0;
    while (rows[0] < trial->n_rows && trial->time[rows[0]] < range[0] - 1e-9) {
        rows[0]++;
    }
    rows[1] = rows[0];
    while (rows[1] < trial->n_rows && trial->time[rows[1]] <= range[1] + 1e-9) {
        rows[1]++;
    }
    return rows[0] < rows[1]
               ? MHE_OK
               : mhe_fail(err, MHE_E_INPUT,
                          "%s: %s: no frame of %s lies in its time_range, %g to %g s (the trial: "
                          "%g to %g s)",
                          s->file.path, whose, trial->path, range[0], range[1], trial->time[0],
                          trial->time[trial->n_rows - 1]);
}

mhe_status mhi_scale_mean(const mhi_scale_setup *s, const mhi_table *trial, const double range[2],
                          const char *whose, double *mean, mhe_error *err) {
    int32_t rows[2];
    const mhe_status status = rows_in(s, trial, range, whose, rows, err);
    for (int32_t i = 0; i < trial->n_columns && status == MHE_OK; i++) {
        double sum = 0;
        int32_t n = 0;
        for (int32_t k = rows[0]; k < rows[1]; k++) {
            const double value = trial->values[(ptrdiff_t)k * trial->n_columns + i];
            sum += isnan(value) ? 0 : value;
            n += !isnan(value);
        }
        mean[i] = n > 0 ? sum / n : NAN;
    }
    return status;
}

static int32_t marker_of(const mhe_description *d, const char *name) {
    int32_t i = 0;
    while (i < d->n_markers && strcmp(d->markers[i].name, name) != 0) {
        i++;
    }
    return i < d->n_markers ? i : -1;
}

static double distance(const double *a, const double *b) {
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                (a[2] - b[2]) * (a[2] - b[2]));
}

/* Mean distance in the trial over the distance in the model. */
static mhe_status ratio_of(mhi_scaled *m, const mhe_description *d, const double *markers,
                           const mhi_table *trial, const int32_t rows[2],
                           const mhi_measurement *measurement, const mhi_marker_pair *pair,
                           double *ratio, mhe_error *err) {
    int32_t of_model[2], of_trial[2], n = 0;
    double sum = 0;
    for (int32_t i = 0; i < 2; i++) {
        of_model[i] = marker_of(d, pair->names[i]);
        of_trial[i] = mhi_table_find(trial, pair->names[i]);
        if (of_model[i] < 0 || of_trial[i] < 0) {
            return mhi_document_fail(&m->setup->file, pair->line, err,
                                     "measurement '%s': %s has no marker '%s'", measurement->name,
                                     of_model[i] < 0 ? "the model" : trial->path, pair->names[i]);
        }
    }
    for (int32_t k = rows[0]; k < rows[1]; k++) {
        const double *row = trial->values + (ptrdiff_t)k * trial->n_columns;
        const double seen = distance(row + 3 * of_trial[0], row + 3 * of_trial[1]);
        sum += isnan(seen) ? 0 : seen;
        n += !isnan(seen);
    }
    const double in_model = distance(markers + 3 * of_model[0], markers + 3 * of_model[1]);
    if (n == 0 || !(in_model > 0) || !(sum > 0)) {
        return mhi_document_fail(&m->setup->file, pair->line, err,
                                 "measurement '%s': '%s' and '%s' %s", measurement->name,
                                 pair->names[0], pair->names[1],
                                 n == 0            ? "are never seen together"
                                 : !(in_model > 0) ? "are at the same place in the model"
                                                   : "are at the same place in the trial");
    }
    *ratio = sum / n / in_model;
    return MHE_OK;
}

/* Setups are kept for several models: what this one lacks is told and passed over, as OpenSim does.
 */
static void warn_body(const mhi_scaled *m, int32_t line, const char *name) {
    char hint[256], text[512];
    (void)snprintf(text, sizeof text, "%s:%d: the model has no body '%s'%s: passed over",
                   m->setup->file.path, (int)line, name,
                   mhi_suggest(hint, sizeof hint, name, m->bodies, m->n_bodies));
    m->host->log(m->host, MHE_LOG_WARNING, text);
}

/* Where a measurement's factor goes; what came before at these axes is replaced. */
static void apply(mhi_scaled *m, const mhi_measurement *measurement, double factor) {
    for (int32_t i = 0; i < measurement->n_bodies; i++) {
        const int32_t body = mhi_scale_body(m, measurement->bodies[i]);
        if (body < 0) {
            warn_body(m, measurement->line, measurement->bodies[i]);
        }
        for (int32_t axis = 0; axis < 3 && body >= 0; axis++) {
            if (measurement->axes[i] >> axis & 1) {
                m->factors[3 * body + axis] = factor;
            }
        }
    }
}

static mhe_status measure(mhi_scaled *m, mhi_inspected *open, mhe_error *err) {
    const mhi_scale_setup *s = m->setup;
    mhi_table *trial = NULL;
    int32_t rows[2];
    double *markers = MHI_TAKE(&m->arena, double, 3 * open->all->n_markers);
    mhe_status status = markers == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                        : mhi_trc_read(s->trial, &trial, err);
    if (status == MHE_OK) {
        status = rows_in(s, trial, s->range, "ModelScaler", rows, err);
    }
    if (status == MHE_OK) {
        status = mhi_scale_look(open, NULL, markers, NULL, NULL, err);
    }
    for (int32_t i = 0; i < s->n_measurements && status == MHE_OK; i++) {
        const mhi_measurement *one = &s->measurements[i];
        double sum = 0, ratio = 0;
        for (int32_t k = 0; k < one->n_pairs && status == MHE_OK; k++) {
            status = ratio_of(m, open->all, markers, trial, rows, one, &one->pairs[k], &ratio, err);
            sum += ratio;
        }
        if (status == MHE_OK) {
            apply(m, one, sum / one->n_pairs);
        }
    }
    mhi_table_free(trial);
    return status;
}

static void take_manual(mhi_scaled *m) {
    for (int32_t i = 0; i < m->setup->n_manual; i++) {
        const mhi_manual_scale *one = &m->setup->manual[i];
        const int32_t body = mhi_scale_body(m, one->body);
        if (body < 0) {
            warn_body(m, one->line, one->body);
        } else {
            memcpy(m->factors + 3 * body, one->factors, sizeof one->factors);
        }
    }
}

mhe_status mhi_scale_factors(mhi_scaled *m, mhi_inspected *open, mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < 2 && status == MHE_OK && m->setup->order[i] != NULL; i++) {
        if (strcmp(m->setup->order[i], "measurements") == 0) {
            status = measure(m, open, err);
        } else {
            take_manual(m);
        }
    }
    return status;
}

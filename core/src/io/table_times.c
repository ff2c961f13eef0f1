/* SPDX-License-Identifier: Apache-2.0 */
/* table_times.c: when the rows were measured, and how many come in a second. */
#include "io/table_reader.h"

#include "base/values.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static mhe_status out_of_memory(const mhi_table_reader *reader) {
    return mhe_fail(reader->err, MHE_E_MEMORY, "%s: out of memory", reader->table->path);
}

#define VISIBLE 0.01 /* of a step: less than that rounding does no harm */
#define MANY 0.05    /* of the rows have the time of the one before: rounding, not a slip */
#define ENOUGH 8     /* rows: fewer fit any grid */
#define FEWEST 2.0   /* Hz: slower frames may really be a second apart */

/* A grid of times first + step n_k, n_k being the frame's number or the row's. */
typedef struct grid {
    const mhi_table_reader *reader;
    double step;
    int32_t by_frame;
} grid;

static double grid_at(const grid *g, int32_t k) {
    const double *frame = g->reader->frame;
    const double n = g->by_frame ? frame[k] - frame[0] : k;
    return g->reader->table->time[0] + g->step * n;
}

/* How far the times are from the grid at most. */
static double distance(const grid *g) {
    double most = 0;
    for (int32_t k = 0; k < g->reader->table->n_rows; k++) {
        most = fmax(most, fabs(g->reader->table->time[k] - grid_at(g, k)));
    }
    return most;
}

static int32_t frames_count_on(const mhi_table_reader *reader) {
    for (int32_t k = 1; k < reader->table->n_rows; k++) {
        if (!(reader->frame[k] >= reader->frame[k - 1] + 1)) {
            return 0;
        }
    }
    return reader->table->n_rows > 1;
}

static void take_grid(mhi_table_reader *reader, const grid *g, const char *source) {
    mhi_table *table = reader->table;
    const double first = table->time[0];
    const int32_t still = table->time[table->n_rows - 1] == first;
    for (int32_t k = 0; k < table->n_rows; k++) {
        const double n = g->by_frame ? reader->frame[k] - reader->frame[0] : k;
        table->time[k] = first + g->step * n;
    }
    reader->line_number = reader->n_equal > 0 ? reader->equal_line : table->line;
    if (still) {
        mhi_table_warn(reader, "the time stands still: it is taken as even at %.6g Hz (%s)",
                       1 / g->step, source);
    } else {
        mhi_table_warn(
            reader,
            "the times are printed with %d decimals%s: they are taken as even at %.6g Hz (%s)",
            reader->decimals, reader->n_equal > 0 ? " and stand twice" : "", 1 / g->step, source);
    }
    reader->n_equal = 0;
}

/* Times rounded when they were printed, beside an even grid: put on it. */
static void undo_rounding(mhi_table_reader *reader) {
    const mhi_table *table = reader->table;
    const int32_t n = table->n_rows;
    const double quantum = pow(10, -reader->decimals), span = table->time[n - 1] - table->time[0];
    const int many = reader->n_equal > 1 && reader->n_equal >= MANY * n;
    if (n < ENOUGH) {
        return;
    }
    if (table->rate > 0 && frames_count_on(reader)) {
        const grid g = {reader, 1 / table->rate, 1};
        const double most = distance(&g);
        const int still = span == 0; /* a column that nobody filled in */
        if (still || (most < 1.01 * quantum && most > VISIBLE * g.step &&
                      (many || (reader->n_equal == 0 && quantum < g.step)))) {
            take_grid(reader, &g, "the header's rate and the frames' numbers");
            return;
        }
    }
    const grid g = {reader, span / (n - 1), 0};
    const double most = distance(&g);
    if (span > 0 && most < 1.01 * quantum && most > VISIBLE * g.step &&
        (many || (reader->n_equal == 0 && quantum < g.step / 3))) {
        take_grid(reader, &g, "their number over their span");
    }
}

/* Of rows with one time the first stays. */
static mhe_status drop_equal(mhi_table_reader *reader) {
    mhi_table *table = reader->table;
    const size_t width = (size_t)table->n_columns;
    int32_t kept = 1;
    for (int32_t k = 1; k < table->n_rows; k++) {
        if (table->time[k] > table->time[kept - 1]) {
            table->time[kept] = table->time[k];
            reader->frame[kept] = reader->frame[k];
            memmove(table->values + width * (size_t)kept, table->values + width * (size_t)k,
                    sizeof(double) * width);
            kept++;
        }
    }
    reader->line_number = reader->equal_line;
    if (2 * kept < table->n_rows || kept < 2) {
        return mhi_table_fail(reader,
                              "the time does not increase: %d of %d rows have that of the "
                              "row before",
                              table->n_rows - kept, table->n_rows);
    }
    mhi_table_warn(reader,
                   reader->n_equal == 1
                       ? "%d row has the time of the one before it and is left out"
                       : "%d rows have the time of the one before them (this is the first) and "
                         "are left out",
                   reader->n_equal);
    table->n_rows = kept;
    return MHE_OK;
}

#define UNEVEN 1.5      /* times the least step: the largest of uneven times */
#define SCATTER 0.35    /* of a step, RMS about the grid: more is no clock's jitter */
#define SHIFTED 0.15    /* of a step that a third of the rows is beside the rest: a lost frame */
#define JITTER_ROWS 20  /* fewer tell nothing of a grid */
#define OPPOSED (-0.25) /* correlation of neighbouring steps; jitter makes -0.5 */

/* Steps that are short where the one before was long: samples stamped late, not taken late. */
static int32_t steps_alternate(const mhi_table *table) {
    const int32_t n = table->n_rows - 1;
    const double mean = (table->time[n] - table->time[0]) / n;
    double least = INFINITY, most = 0, squares = 0, products = 0, before = 0;
    for (int32_t k = 0; k < n; k++) {
        const double step = table->time[k + 1] - table->time[k], beside = step - mean;
        least = fmin(least, step);
        most = fmax(most, step);
        squares += beside * beside;
        products += k > 0 ? beside * before : 0;
        before = beside;
    }
    return most > UNEVEN * least && products < OPPOSED * squares;
}

/* Whether the times scatter about the grid and nothing else; *shift: of its first time. */
static int32_t scatters(const grid *g, double *shift, double *most) {
    const int32_t n = g->reader->table->n_rows;
    double of[3] = {0}, squares = 0;
    int32_t count[3] = {0};
    for (int32_t k = 0; k < n; k++) {
        const double beside = g->reader->table->time[k] - grid_at(g, k);
        const int32_t third = (int32_t)(3LL * k / n);
        of[third] += beside;
        count[third]++;
        squares += beside * beside;
    }
    const double mean = (of[0] + of[1] + of[2]) / n;
    *shift = mean;
    *most = 0;
    for (int32_t k = 0; k < n; k++) {
        *most = fmax(*most, fabs(g->reader->table->time[k] - grid_at(g, k) - mean));
    }
    for (int32_t i = 0; i < 3; i++) {
        if (fabs(of[i] / count[i] - mean) > SHIFTED * g->step) {
            return 0;
        }
    }
    return *most < g->step && squares / n - mean * mean < SCATTER * SCATTER * g->step * g->step;
}

/* Frames of an even clock that the computer stamped as they arrived: put on that clock's grid. */
static void undo_jitter(mhi_table_reader *reader) {
    mhi_table *table = reader->table;
    const int32_t n = table->n_rows;
    if (n < JITTER_ROWS || !steps_alternate(table)) {
        return;
    }
    const double span = table->time[n - 1] - table->time[0];
    const grid grids[] = {{reader, table->rate > 0 ? 1 / table->rate : 0,
                           reader->frame != NULL && frames_count_on(reader)},
                          {reader, table->rate > 0 ? 1 / table->rate : 0, 0},
                          {reader, span / (n - 1), 0}};
    for (size_t i = 0; i < sizeof grids / sizeof *grids; i++) {
        double shift, most;
        if (grids[i].step > 0 && scatters(&grids[i], &shift, &most)) {
            for (int32_t k = n - 1; k >= 0; k--) { /* the grid begins at the first */
                table->time[k] = grid_at(&grids[i], k) + shift;
            }
            reader->line_number = table->line;
            mhi_table_warn(reader,
                           "the times scatter by up to %.3g ms about an even %.6g Hz, on which "
                           "they are put",
                           1e3 * most, 1 / grids[i].step);
            table->rate = table->rate > 0 ? table->rate : 1 / grids[i].step;
            return;
        }
    }
}

/* Rows per second by the median step, or by the mean where the steps differ by rounding alone; 0
 * where there is no step. */
static mhe_status measure_rate(const mhi_table_reader *reader, double *rate) {
    const mhi_table *table = reader->table;
    int32_t n = table->n_rows - 1;
    *rate = 0;
    if (n < 1) {
        return MHE_OK;
    }
    double *steps = malloc(sizeof *steps * (size_t)n);
    if (steps == NULL) {
        return out_of_memory(reader);
    }
    for (int32_t i = 0; i < n; i++) {
        steps[i] = table->time[i + 1] - table->time[i];
    }
    mhi_sort(steps, n);
    double span = table->time[n] - table->time[0];
    *rate = steps[n - 1] < 1.5 * steps[0] ? n / span : 1 / steps[n / 2];
    free(steps);
    return MHE_OK;
}

/* A column of times that repeats the frames' numbers. */
static int32_t is_frame_number(const mhi_table_reader *reader) {
    const mhi_table *table = reader->table;
    if (reader->frame == NULL || !(table->rate > FEWEST) || !frames_count_on(reader)) {
        return 0;
    }
    for (int32_t k = 0; k < table->n_rows; k++) {
        if (table->time[k] != reader->frame[k]) {
            return 0;
        }
    }
    return 1;
}

/* The time column is what the rows were sampled at; a header that contradicts it is a warning. */
static mhe_status settle_rate(mhi_table_reader *reader) {
    mhi_table *table = reader->table;
    double measured = 0;
    mhe_status status = measure_rate(reader, &measured);
    if (status != MHE_OK || measured == 0 || !isfinite(measured)) {
        return status;
    }
    if (table->rate > 0 && fabs(1000 * measured / table->rate - 1) < 0.01) {
        mhi_table_warn(reader, "the header says %g Hz, the times %g Hz: they are taken as ms",
                       table->rate, measured);
        for (int32_t i = 0; i < table->n_rows; i++) {
            table->time[i] /= 1000;
        }
    } else if (is_frame_number(reader)) {
        mhi_table_warn(reader,
                       "the times are the frames' numbers: they are taken as even at the header's "
                       "%g Hz",
                       table->rate);
        for (int32_t i = 0; i < table->n_rows; i++) {
            table->time[i] = (reader->frame[i] - reader->frame[0]) / table->rate;
        }
    } else if (table->rate > 0 && fabs(measured / table->rate - 1) > 0.01) {
        mhi_table_warn(reader, "the header says %g Hz, the time column %g Hz; the latter is used",
                       table->rate, measured);
        table->rate = 0;
    }
    table->rate = table->rate > 0 ? table->rate : measured;
    return MHE_OK;
}

mhe_status mhi_table_settle_times(mhi_table_reader *reader) {
    mhe_status status = MHE_OK;
    if (reader->table->n_rows > 1) {
        undo_rounding(reader);
    }
    if (reader->n_equal > 0) {
        status = drop_equal(reader);
    }
    if (status == MHE_OK) {
        undo_jitter(reader);
    }
    return status == MHE_OK ? settle_rate(reader) : status;
}

/* SPDX-License-Identifier: Apache-2.0 */
#include "ocp/term_sum.h"

#include "base/clones.h"

#include <math.h>
#include <string.h>

/* Adds scale * (g = row r, H = row row^T) for a row whose n entries stand in the columns from
 * `first` on. */
static void add_row(const double *row, int32_t first, int32_t n, double r, double scale,
                    int32_t n_z, mhi_term_sum *sum) {
    for (int32_t a = 0; a < n; a++) {
        const double scaled = scale * row[a];
        double *hessian = sum->hessian + (first + a) * n_z + first;
        if (scaled == 0) { /* a marker moves with few coordinates */
            continue;
        }
        sum->gradient[first + a] += scaled * r;
        for (int32_t b = 0; b <= a; b++) {
            hessian[b] += scaled * row[b];
        }
    }
}

/* Four doubles, wherever they lie. */
typedef double lanes __attribute__((vector_size(32), aligned(8), may_alias));

/* Rows j .. of mhi_term_sum_diagonal() as far as they are of one signal over four columns, summed
 * in registers; returns the row behind them. */
CLONES static int32_t add_of_four(const mhi_term *t, const mhi_term_workspace *w,
                                  const mhi_signal *s, const double *jacobian, int32_t j,
                                  double scale, int32_t n_z, const mhi_term_sum *sum) {
    const int32_t signal = t->y_signal[j];
    lanes gradient = {0}, hessian[4] = {{0}};
    for (; j < t->ny && t->y_signal[j] == signal; j++) {
        const double r = w->r[j], d = w->jacobian[j] * s->scale;
        if (isnan(r) || d == 0) {
            continue;
        }
        const double *block = jacobian + s->jacobian + (t->y_index[j] - s->offset) * 4;
        const lanes row = *(const lanes *)block, scaled = (scale * d * d) * row;
        gradient += (scale * d * r) * row;
        for (int32_t a = 0; a < 4; a++) {
            hessian[a] += block[a] * scaled;
        }
    }
    for (int32_t a = 0; a < 4; a++) {
        sum->gradient[s->column + a] += gradient[a];
        for (int32_t b = 0; b <= a; b++) {
            sum->hessian[(s->column + a) * n_z + s->column + b] += hessian[a][b];
        }
    }
    return j;
}

/* r_i depends on y_i alone: the row is the signal's own row times a number. */
void mhi_term_sum_diagonal(const mhi_term *t, mhi_term_workspace *w, const mhi_signals *signals,
                           const double *jacobian, double scale, int32_t n_z, mhi_term_sum *sum) {
    for (int32_t j = 0; j < t->ny; j++) {
        if (signals->signal[t->y_signal[j]].n_columns == 4) {
            j = add_of_four(t, w, &signals->signal[t->y_signal[j]], jacobian, j, scale, n_z, sum);
            if (j == t->ny) {
                return;
            }
        }
        const mhi_signal *s = &signals->signal[t->y_signal[j]];
        const double r = w->r[j], d = w->jacobian[j] * s->scale;
        if (isnan(r) || d == 0) {
            continue;
        }
        const int32_t i = t->y_index[j] - s->offset;
        if (s->n_columns == 0) {
            const int32_t c = s->column + i;
            sum->gradient[c] += scale * d * r;
            sum->hessian[c * n_z + c] += scale * d * d;
        } else {
            const double *block = jacobian + s->jacobian + i * s->n_columns;
            add_row(block, s->column, s->n_columns, r / d, scale * d * d, n_z, sum);
        }
    }
}

void mhi_term_sum_dense(const mhi_term *t, mhi_term_workspace *w, const mhi_signals *signals,
                        const double *jacobian, double scale, int32_t n_z, mhi_term_sum *sum) {
    for (int32_t i = 0; i < t->layout.n_res; i++) {
        if (isnan(w->r[i])) {
            continue;
        }
        int32_t first = n_z, end = 0;
        memset(w->row, 0, sizeof(double) * (size_t)n_z);
        for (int32_t j = 0; j < t->ny; j++) {
            const mhi_signal *s = &signals->signal[t->y_signal[j]];
            const double d = w->jacobian[i * t->ny + j] * s->scale;
            if (d == 0) {
                continue;
            }
            const int32_t row = t->y_index[j] - s->offset;
            const int32_t from = s->n_columns == 0 ? s->column + row : s->column;
            const int32_t to = s->n_columns == 0 ? from + 1 : from + s->n_columns;
            const double *block = jacobian + s->jacobian + row * s->n_columns;
            for (int32_t c = from; c < to; c++) {
                w->row[c] += s->n_columns == 0 ? d : d * block[c - from];
            }
            first = from < first ? from : first;
            end = to > end ? to : end;
        }
        if (first < end) {
            add_row(w->row + first, first, end - first, w->r[i], scale, n_z, sum);
        }
    }
}

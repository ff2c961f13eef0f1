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

/* A residual's share in what concerns parameters: `by` [n_p] of its dr/dp, `row` [n] from column
 * `first` on of its dr/dz. */
static void add_row_by_p(const double *by, double r, double scale, const double *row, int32_t first,
                         int32_t n, int32_t n_z, mhi_term_by_p *sum) {
    for (int32_t a = 0; a < sum->n_p; a++) {
        const double of_p = scale * by[a];
        if (of_p == 0) {
            continue;
        }
        sum->gradient[a] += of_p * r;
        for (int32_t b = 0; b <= a; b++) {
            sum->pp[a * sum->n_p + b] += of_p * by[b];
        }
        for (int32_t c = 0; c < n; c++) {
            sum->pz[a * n_z + first + c] += of_p * row[c];
        }
    }
}

/* The same with d of its entry's dy/dp and dy/dz. */
static void add_by_p(const mhi_by_parameter *by, double d, double r, double scale,
                     const double *row, int32_t first, int32_t n, int32_t n_z, mhi_term_by_p *sum) {
    if (by->row != NULL) {
        add_row_by_p(by->row, r / d, scale * d * d, row, first, n, n_z, sum);
        return;
    }
    for (int32_t a = 0; a < by->n; a++) {
        const double of_p = scale * d * by->by[a];
        sum->gradient[by->at[a]] += of_p * r;
        for (int32_t b = 0; b < by->n; b++) {
            if (by->at[b] <= by->at[a]) {
                sum->pp[by->at[a] * sum->n_p + by->at[b]] += of_p * d * by->by[b];
            }
        }
        for (int32_t c = 0; c < n; c++) {
            sum->pz[by->at[a] * n_z + first + c] += of_p * d * row[c];
        }
    }
}

/* d of an entry's dy/dp into the row of a residual of several. */
static void gather_by_p(const mhi_by_parameter *by, double d, mhi_term_by_p *sum) {
    for (int32_t a = 0; a < sum->n_p && by->row != NULL; a++) {
        sum->row[a] += d * by->row[a];
    }
    for (int32_t a = 0; a < by->n && by->row == NULL; a++) {
        sum->row[by->at[a]] += d * by->by[a];
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
        if (signals->signal[t->y_signal[j]].n_columns == 4 && sum->by_p == NULL) {
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
        const mhi_by_parameter *by = sum->by_p == NULL ? NULL : &sum->by_p->by[t->y_index[j]];
        if (s->n_columns == 0) {
            const int32_t c = s->column + i;
            const double slope = by == NULL ? 1 : by->slope, to_z = d * slope;
            sum->gradient[c] += scale * to_z * r;
            sum->hessian[c * n_z + c] += scale * to_z * to_z;
            if (by != NULL) {
                add_by_p(by, d, r, scale, &slope, c, 1, n_z, sum->by_p);
            }
        } else {
            const double *block = jacobian + s->jacobian + i * s->n_columns;
            add_row(block, s->column, s->n_columns, r / d, scale * d * d, n_z, sum);
            if (by != NULL) {
                add_by_p(by, d, r, scale, block, s->column, s->n_columns, n_z, sum->by_p);
            }
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
        if (sum->by_p != NULL) {
            memset(sum->by_p->row, 0, sizeof(double) * (size_t)sum->by_p->n_p);
        }
        for (int32_t j = 0; j < t->ny; j++) {
            const mhi_signal *s = &signals->signal[t->y_signal[j]];
            const double d = w->jacobian[i * t->ny + j] * s->scale;
            const mhi_by_parameter *by = sum->by_p == NULL ? NULL : &sum->by_p->by[t->y_index[j]];
            const double to_z = by == NULL || s->n_columns > 0 ? d : d * by->slope;
            if (d == 0) {
                continue;
            }
            if (by != NULL) {
                gather_by_p(by, d, sum->by_p);
            }
            const int32_t row = t->y_index[j] - s->offset;
            const int32_t from = s->n_columns == 0 ? s->column + row : s->column;
            const int32_t to = s->n_columns == 0 ? from + 1 : from + s->n_columns;
            const double *block = jacobian + s->jacobian + row * s->n_columns;
            for (int32_t c = from; c < to; c++) {
                w->row[c] += s->n_columns == 0 ? to_z : d * block[c - from];
            }
            first = from < first ? from : first;
            end = to > end ? to : end;
        }
        if (first < end) {
            add_row(w->row + first, first, end - first, w->r[i], scale, n_z, sum);
            if (sum->by_p != NULL) {
                add_row_by_p(sum->by_p->row, w->r[i], scale, w->row + first, first, end - first,
                             n_z, sum->by_p);
            }
        }
    }
}

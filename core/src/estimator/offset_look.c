/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/offset_look.h"

#include "base/cholesky.h"
#include "base/clones.h"

#include <math.h>
#include <string.h>

mhe_status mhi_offset_follow_create(mhi_offset_follow *f, int32_t n, int32_t n_q, mhi_arena *arena,
                                    mhe_error *err) {
    const mhi_room rooms[] = {{&f->factor, n_q * n_q}, {&f->z, (ptrdiff_t)n_q * n}};
    f->first = MHI_TAKE(arena, int32_t, n_q);
    f->end = MHI_TAKE(arena, int32_t, n_q);
    return f->first == NULL || f->end == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                              : MHI_TAKE_ROOMS(arena, rooms, err);
}

mhe_status mhi_offset_look_create(mhi_offset_look *look, int32_t n, int32_t n_q, mhi_arena *arena,
                                  mhe_error *err) {
    const mhi_room rooms[] = {
        {&look->q, n_q}, {&look->measured, n}, {&look->left, n}, {&look->weight, n}};
    const mhe_status status = MHI_TAKE_ROOMS(arena, rooms, err);
    return status == MHE_OK ? mhi_offset_follow_create(&look->follow, n, n_q, arena, err) : status;
}

void mhi_offset_follow_copy(mhi_offset_follow *to, const mhi_offset_follow *from, int32_t n,
                            int32_t n_q) {
    memcpy(to->factor, from->factor, sizeof(double) * (size_t)(n_q * n_q));
    memcpy(to->first, from->first, sizeof(int32_t) * (size_t)n_q);
    memcpy(to->end, from->end, sizeof(int32_t) * (size_t)n_q);
    for (int32_t a = 0; a < n_q; a++) {
        const ptrdiff_t at = (ptrdiff_t)a * n + from->first[a];
        memcpy(to->z + at, from->z + at, sizeof(double) * (size_t)(from->end[a] - from->first[a]));
    }
    to->known = from->known;
}

/* row -= factor * other */
CLONES static void subtract(double *restrict row, const double *restrict other, double factor,
                            int32_t n) {
    for (int32_t i = 0; i < n; i++) {
        row[i] -= factor * other[i];
    }
}

/* J^T W J, coordinates from the last to the first; the largest of its diagonal. */
static double square_of(const double *jacobian, const double *weight, int32_t n, int32_t n_q,
                        double *square) {
    double largest = 1e-12;
    memset(square, 0, sizeof *square * (size_t)(n_q * n_q));
    for (int32_t i = 0; i < n; i++) {
        const double *row = jacobian + (ptrdiff_t)(i + 1) * n_q - 1;
        for (int32_t a = 0; a < n_q && weight[i] > 0; a++) {
            for (int32_t b = 0; b <= a && row[-a] != 0; b++) {
                square[a * n_q + b] += weight[i] * row[-a] * row[-b];
            }
        }
    }
    for (int32_t a = 0; a < n_q; a++) {
        largest = fmax(largest, square[a * n_q + a]);
    }
    return largest;
}

/* Row a of Z out of those above it. */
static void find_row(mhi_offset_follow *f, int32_t a, const double *jacobian, const double *weight,
                     int32_t n, int32_t n_q) {
    const double *L = f->factor + a * n_q;
    double *z = f->z + (ptrdiff_t)a * n;
    int32_t first = 0, end = n;
    for (int32_t i = 0; i < n; i++) {
        z[i] = weight[i] * jacobian[(ptrdiff_t)(i + 1) * n_q - 1 - a];
    }
    for (int32_t b = 0; b < a; b++) {
        const int32_t from = f->first[b];
        if (L[b] != 0 && from < f->end[b]) {
            subtract(z + from, f->z + (ptrdiff_t)b * n + from, L[b], f->end[b] - from);
        }
    }
    while (first < n && z[first] == 0) {
        first++;
    }
    while (end > first && z[end - 1] == 0) {
        end--;
    }
    for (int32_t i = first; i < end; i++) {
        z[i] *= L[a];
    }
    f->first[a] = first;
    f->end[a] = end;
}

int32_t mhi_offset_follow_find(mhi_offset_follow *f, const double *jacobian, const double *weight,
                               int32_t n, int32_t n_q) {
    const double largest = square_of(jacobian, weight, n, n_q, f->factor);
    for (int32_t a = 0; a < n_q; a++) {
        f->factor[a * n_q + a] += 1e-6 * largest;
    }
    f->known = mhi_cholesky_factor(f->factor, n_q) == 0;
    for (int32_t a = 0; a < n_q && f->known; a++) {
        find_row(f, a, jacobian, weight, n, n_q);
    }
    return f->known;
}

/* Four sums at a time: one would wait for itself. */
CLONES static double dot(const double *a, const double *b, int32_t n) {
    double sum[4] = {0}, rest = 0;
    int32_t i = 0;
    for (; i + 4 <= n; i += 4) {
        for (int32_t l = 0; l < 4; l++) {
            sum[l] += a[i + l] * b[i + l];
        }
    }
    for (; i < n; i++) {
        rest += a[i] * b[i];
    }
    return sum[0] + sum[1] + (sum[2] + sum[3]) + rest;
}

/* Z times a vector [n] -> out [n_q] */
static void times(const mhi_offset_follow *f, const double *vector, int32_t n, int32_t n_q,
                  double *out) {
    for (int32_t a = 0; a < n_q; a++) {
        const int32_t first = f->first[a];
        out[a] = dot(f->z + (ptrdiff_t)a * n + first, vector + first, f->end[a] - first);
    }
}

static void reverse(double *values, int32_t n) {
    for (int32_t i = 0; i < n / 2; i++) {
        const double kept = values[i];
        values[i] = values[n - 1 - i];
        values[n - 1 - i] = kept;
    }
}

void mhi_offset_follow_move(const mhi_offset_follow *f, const double *change, int32_t n,
                            int32_t n_q, double *move) {
    memset(move, 0, sizeof *move * (size_t)n_q);
    if (!f->known) {
        return;
    }
    times(f, change, n, n_q, move);
    for (int32_t a = n_q - 1; a >= 0; a--) { /* -L^-T */
        const double *L = f->factor + a * n_q;
        move[a] *= L[a];
        for (int32_t b = 0; b < a; b++) {
            move[b] -= L[b] * move[a];
        }
    }
    for (int32_t a = 0; a < n_q; a++) {
        move[a] = -move[a];
    }
    reverse(move, n_q);
}

void mhi_offset_look_count(const mhi_offset_look *look, double sign, int32_t n, int32_t n_q,
                           double *room, mhi_offset_sum *sum) {
    const mhi_offset_follow *f = &look->follow;
    double *right = room, *posture = room + n;
    if (!f->known) {
        return;
    }
    times(f, look->left, n, n_q, posture);
    for (int32_t i = 0; i < n; i++) {
        double *row = sum->normal + (ptrdiff_t)i * n;
        row[i] += sign * look->weight[i];
        right[i] = look->weight[i] * look->left[i];
        sum->rows += look->weight[i] > 0 ? sign : 0;
        for (int32_t a = 0; a < n_q; a++) {
            const double *z = f->z + (ptrdiff_t)a * n;
            const int32_t first = f->first[a];
            if (i < first || i >= f->end[a] || z[i] == 0) {
                continue;
            }
            right[i] -= z[i] * posture[a];
            subtract(row + first, z + first, sign * z[i], i + 1 - first);
        }
    }
    for (int32_t i = 0; i < n; i++) {
        sum->right[i] += sign * right[i];
        sum->squares += sign * right[i] * look->left[i];
    }
}

double mhi_offset_sum_squares(const mhi_offset_sum *sum, const double *value, int32_t n) {
    double squares = sum->squares;
    for (int32_t i = 0; i < n; i++) {
        const double *row = sum->normal + (ptrdiff_t)i * n;
        squares += value[i] * (2 * dot(row, value, i) + row[i] * value[i] - 2 * sum->right[i]);
    }
    return squares;
}

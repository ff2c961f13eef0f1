/* SPDX-License-Identifier: Apache-2.0 */
/* fit_terms.c: sparse polynomials for paths, as sums of products of Chebyshev's: nearly independent
 * of each other over the range, they let few terms be chosen one by one. */
#include "../clones.h"
#include "fit_private.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MOST_OWN 8    /* coordinates of one path */
#define MOST_TERMS 80 /* of one polynomial */
#define MOST_CANDIDATES 495
#define AIM 0.8     /* of the tolerance, on validation poses: for the test to hold as well */
#define ENOUGH 0.97 /* likewise, of the most terms */
#define RIDGE 1e-12 /* relative: keeps the equations solvable */

/* The least-squares problem of one path. */
typedef struct problem {
    const samples *s;
    int32_t path, n, own[MOST_OWN], m; /* coordinates; candidates */
    double centre[MOST_OWN], scale[MOST_OWN];
    double weight[1 + MOST_OWN]; /* of the length's row, of the gradient's */
    uint8_t (*exponent)[MOST_OWN];
    double *gram, *right;         /* [m x m], [m] */
    double *rows;                 /* [(1 + n) x m]: one pose's equations */
    double *validation;           /* [VALIDATION x (1 + n) x m] */
    double *factor, *coef, *gain; /* Cholesky factor of the chosen */
    int32_t chosen[MOST_TERMS];
    double square; /* of the right side */
} problem;

/* ---- candidates ---- */

/* All exponents with a sum up to `degree`, lowest sums first. */
static void candidates_add(problem *p, int32_t at, int32_t left, uint8_t *exponent) {
    if (at == p->n - 1) {
        exponent[at] = (uint8_t)left;
        if (p->m < MOST_CANDIDATES) {
            memcpy(p->exponent[p->m++], exponent, MOST_OWN);
        }
        return;
    }
    for (int32_t e = 0; e <= left; e++) {
        exponent[at] = (uint8_t)e;
        candidates_add(p, at + 1, left - e, exponent);
    }
}

static void candidates_make(problem *p) {
    static const int32_t degree[MOST_OWN + 1] = {0, 30, 20, 12, 8, 6, 5, 4, 3};
    uint8_t exponent[MOST_OWN] = {0};
    p->m = 0;
    for (int32_t sum = 0; sum <= degree[p->n]; sum++) {
        candidates_add(p, 0, sum, exponent);
    }
}

/* Weighted equations [(1 + n) x m] of pose k; `right` [1 + n]. */
static void pose_rows(const problem *p, int32_t k, double *rows, double *right) {
    double value_of[MOST_OWN][POLYNOMIAL_POWERS], slope_of[MOST_OWN][POLYNOMIAL_POWERS];
    size_t n_q = (size_t)p->s->n_q, n_p = (size_t)p->s->n_p;
    const double *gradient = p->s->gradient + ((size_t)k * n_p + (size_t)p->path) * n_q;
    right[0] = p->weight[0] * p->s->length[(size_t)k * n_p + (size_t)p->path];
    for (int32_t i = 0; i < p->n; i++) {
        double x = (p->s->q[(size_t)k * n_q + (size_t)p->own[i]] - p->centre[i]) / p->scale[i];
        double *v = value_of[i], *w = slope_of[i]; /* Chebyshev's T_e and slopes by q */
        v[0] = 1;
        v[1] = x;
        w[0] = 0;
        w[1] = 1;
        for (int e = 2; e < POLYNOMIAL_POWERS; e++) {
            v[e] = 2 * x * v[e - 1] - v[e - 2];
            w[e] = 2 * (v[e - 1] + x * w[e - 1]) - w[e - 2];
        }
        right[1 + i] = p->weight[1 + i] * gradient[p->own[i]];
    }
    for (int32_t t = 0; t < p->m; t++) {
        const uint8_t *e = p->exponent[t];
        double value = 1;
        for (int32_t i = 0; i < p->n; i++) {
            value *= value_of[i][e[i]];
        }
        rows[t] = p->weight[0] * value;
        for (int32_t i = 0; i < p->n; i++) {
            double slope = slope_of[i][e[i]] / p->scale[i];
            for (int32_t j = 0; j < p->n && slope != 0; j++) {
                slope *= j == i ? 1 : value_of[j][e[j]];
            }
            rows[(1 + i) * p->m + t] = p->weight[1 + i] * slope;
        }
    }
}

/* gram += row row^T (lower triangle), right += row y */
CLONES static void add_row(double *restrict gram, double *restrict right,
                           const double *restrict row, double y, int32_t m) {
    for (int32_t i = 0; i < m; i++) {
        double factor = row[i];
        double *restrict out = gram + (size_t)i * (size_t)m;
        right[i] += factor * y;
        for (int32_t j = 0; j <= i; j++) {
            out[j] += factor * row[j];
        }
    }
}

static void problem_free(problem *p) {
    free(p->exponent);
    free(p->gram);
}

static int problem_make(problem *p) {
    size_t m = MOST_CANDIDATES, rows = 1 + (size_t)p->n;
    p->exponent = calloc(m, sizeof *p->exponent);
    p->gram = calloc(m * m + 3 * m + rows * m + VALIDATION * rows * (m + 1) +
                         MOST_TERMS * (MOST_TERMS + 1),
                     sizeof *p->gram);
    if (p->exponent == NULL || p->gram == NULL) {
        return -1;
    }
    candidates_make(p);
    m = (size_t)p->m;
    p->right = p->gram + m * m;
    p->gain = p->right + m;
    p->coef = p->gain + m;
    p->rows = p->coef + m;
    p->validation = p->rows + rows * m;
    p->factor = p->validation + VALIDATION * rows * (m + 1);
    for (int32_t k = 0; k < TRAINING; k++) {
        double y[1 + MOST_OWN];
        pose_rows(p, k, p->rows, y);
        for (size_t r = 0; r < rows; r++) {
            add_row(p->gram, p->right, p->rows + r * m, y[r], p->m);
            p->square += y[r] * y[r];
        }
    }
    for (int32_t k = 0; k < VALIDATION; k++) { /* each row's right side behind it */
        double y[1 + MOST_OWN];
        pose_rows(p, TRAINING + k, p->rows, y);
        for (size_t r = 0; r < rows; r++) {
            double *out = p->validation + ((size_t)k * rows + r) * (m + 1);
            memcpy(out, p->rows + r * m, m * sizeof *out);
            out[m] = y[r];
        }
    }
    return 0;
}

static double gram_entry(const problem *p, int32_t i, int32_t j) {
    return i >= j ? p->gram[(size_t)i * (size_t)p->m + (size_t)j]
                  : p->gram[(size_t)j * (size_t)p->m + (size_t)i];
}

/* ---- choice of terms ---- */

/* Adds term t as the k-th to the Cholesky factor; 0: it is independent of the others. */
static int choose(problem *p, int32_t k, int32_t t) {
    double *row = p->factor + k * MOST_TERMS, pivot = gram_entry(p, t, t) * (1 + RIDGE);
    double whole = pivot;
    for (int32_t i = 0; i < k; i++) {
        double sum = gram_entry(p, t, p->chosen[i]);
        const double *other = p->factor + i * MOST_TERMS;
        for (int32_t j = 0; j < i; j++) {
            sum -= row[j] * other[j];
        }
        row[i] = sum / other[i];
        pivot -= row[i] * row[i];
    }
    if (!(pivot > 1e-11 * whole)) {
        return -1;
    }
    row[k] = sqrt(pivot);
    p->chosen[k] = t;
    return 0;
}

/* Coefficients of the first n chosen terms. */
static void solve(problem *p, int32_t n) {
    for (int32_t i = 0; i < n; i++) {
        double sum = p->right[p->chosen[i]];
        for (int32_t j = 0; j < i; j++) {
            sum -= p->factor[i * MOST_TERMS + j] * p->coef[j];
        }
        p->coef[i] = sum / p->factor[i * MOST_TERMS + i];
    }
    for (int32_t i = n - 1; i >= 0; i--) {
        for (int32_t k = i + 1; k < n; k++) {
            p->coef[i] -= p->factor[k * MOST_TERMS + i] * p->coef[k];
        }
        p->coef[i] /= p->factor[i * MOST_TERMS + i];
    }
}

/* The term that explains most of what the first n leave; -1: none is left. */
static int32_t best_term(problem *p, int32_t n, const uint8_t *out_of_use) {
    int32_t best = -1;
    double most = 0;
    for (int32_t t = 0; t < p->m; t++) {
        double left = p->right[t], own = gram_entry(p, t, t);
        if (out_of_use[t] || !(own > 0)) {
            continue;
        }
        for (int32_t i = 0; i < n; i++) {
            left -= gram_entry(p, t, p->chosen[i]) * p->coef[i];
        }
        if (left * left / own > most) {
            most = left * left / own;
            best = t;
        }
    }
    return best;
}

/* Mean squares, in units of the tolerances, of length and moment arms on the validation poses. */
static double validate(const problem *p, int32_t n) {
    size_t m = (size_t)p->m, rows = 1 + (size_t)p->n;
    double length = 0, arm = 0;
    for (size_t k = 0; k < VALIDATION; k++) {
        for (size_t r = 0; r < rows; r++) {
            const double *row = p->validation + (k * rows + r) * (m + 1);
            double off = -row[m];
            for (int32_t i = 0; i < n; i++) {
                off += p->coef[i] * row[p->chosen[i]];
            }
            *(r == 0 ? &length : &arm) += off * off;
        }
    }
    return fmax(sqrt(length / VALIDATION), sqrt(arm / VALIDATION / (double)(rows - 1)));
}

/* Chooses terms until the validation poses are content, or all that may be are chosen and they are
 * nearly so; returns their number, 0: never. */
static int32_t choose_terms(problem *p) {
    uint8_t out_of_use[MOST_CANDIDATES] = {0};
    int32_t n = 0;
    double off = INFINITY;
    while (n < MOST_TERMS) {
        int32_t t = best_term(p, n, out_of_use);
        if (t < 0) {
            break;
        }
        out_of_use[t] = 1;
        if (choose(p, n, t) != 0) {
            continue;
        }
        solve(p, ++n);
        off = validate(p, n);
        if (off < AIM) {
            return n;
        }
    }
    return off < ENOUGH ? n : 0;
}

/* ---- one path ---- */

/* Errors on the test poses. */
static void test_errors(const problem *p, int32_t n, double *rows, path_fit *fit) {
    double length = 0, arm = 0;
    for (int32_t k = 0; k < TEST; k++) {
        double y[1 + MOST_OWN];
        pose_rows(p, TRAINING + VALIDATION + k, rows, y);
        for (int32_t r = 0; r <= p->n; r++) {
            double off = -y[r];
            for (int32_t i = 0; i < n; i++) {
                off += p->coef[i] * rows[r * p->m + p->chosen[i]];
            }
            off = fabs(off / p->weight[r]);
            *(r == 0 ? &length : &arm) += off * off;
            double *worst = r == 0 ? &fit->length_worst : &fit->arm_worst;
            *worst = fmax(*worst, off);
        }
    }
    fit->length_rms = sqrt(length / TEST);
    fit->arm_rms = p->n > 0 ? sqrt(arm / TEST / p->n) : 0;
}

static int fit_from(const problem *p, int32_t n_terms, path_fit *fit) {
    if (fit_allocate(fit, p->n, n_terms) != 0) {
        return -1;
    }
    for (int32_t i = 0; i < p->n; i++) {
        fit->coordinate[i] = p->own[i];
        fit->centre[i] = p->centre[i];
        fit->scale[i] = p->scale[i];
    }
    for (int32_t t = 0; t < n_terms; t++) {
        fit->coef[t] = p->coef[t];
        memcpy(fit->exponent + t * p->n, p->exponent[p->chosen[t]], (size_t)p->n);
    }
    return 0;
}

int fit_path(const simbody_model *model, const samples *s, int32_t path, double tolerance,
             path_fit *fit) {
    problem p = {.s = s, .path = path};
    p.n = model->own_start[path + 1] - model->own_start[path];
    if (model->description->paths[path].n_points == 0) { /* a polynomial by itself */
        return 0;
    }
    if (p.n < 1 || p.n > MOST_OWN) {
        (void)snprintf(fit->why, sizeof fit->why, "it depends on %d coordinates", (int)p.n);
        return 0;
    }
    p.weight[0] = 1 / tolerance;
    for (int32_t i = 0; i < p.n; i++) {
        p.own[i] = model->own[model->own_start[path] + i];
        p.centre[i] = 0.5 * (s->lower[p.own[i]] + s->upper[p.own[i]]);
        p.scale[i] = 0.5 * (s->upper[p.own[i]] - s->lower[p.own[i]]);
        p.weight[1 + i] = 0.5 / tolerance;
    }
    int status = problem_make(&p);
    int32_t n = status == 0 ? choose_terms(&p) : 0;
    if (status == 0 && n == 0) {
        (void)snprintf(fit->why, sizeof fit->why, "%d terms do not reach the tolerance",
                       MOST_TERMS);
    }
    if (n > 0) {
        status = fit_from(&p, n, fit);
        test_errors(&p, n, p.rows, fit);
        fit->fitted = fit->length_rms <= tolerance && fit->arm_rms <= 2 * tolerance;
        if (!fit->fitted) {
            (void)snprintf(fit->why, sizeof fit->why, "new poses miss the tolerance");
        }
    }
    problem_free(&p);
    return status;
}

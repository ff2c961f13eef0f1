/* SPDX-License-Identifier: Apache-2.0 */
/* fit.c: sparse polynomials for paths, as sums of products of Chebyshev's: nearly independent of
 * each other over the range, they let few terms be chosen one by one. */
#include "fit.h"

#include "../clones.h"
#include "context.h"

#include <mhe/host.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TRAINING 1600
#define VALIDATION 400
#define TEST 800
#define POSES (TRAINING + VALIDATION + TEST)
#define MOST_OWN 8    /* coordinates of one path */
#define MOST_TERMS 80 /* of one polynomial */
#define MOST_CANDIDATES 462
#define AIM 0.8        /* of the tolerance, on validation poses: for the test to hold as well */
#define MARGIN 0.05    /* of the coordinates' ranges, on both sides */
#define RIDGE 1e-12    /* relative: keeps the equations solvable */
#define TOLD_JUMP 2e-3 /* m: a larger one is a warning */
#define WIDEST_ANGLE 3.141592653589793
#define WIDEST_SHIFT 1.0 /* m */

/* Poses of all coordinates, with lengths and gradients of all paths there. */
typedef struct samples {
    int32_t n_q, n_p;
    double *q, *length, *gradient; /* [POSES x n_q], [POSES x n_p], [POSES x n_p x n_q] */
    double *lower, *upper;
} samples;

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

/* splitmix64 */
static double uniform(uint64_t *seed) {
    *seed += 0x9e3779b97f4a7c15u;
    uint64_t z = *seed;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

/* ---- samples ---- */

static void samples_free(samples *s) {
    free(s->q);
    free(s->length);
    free(s->gradient);
    free(s->lower);
}

static mhe_status samples_make(const mhe_description *d, void *model, double range, samples *s,
                               mhe_error *err) {
    size_t n_q = (size_t)d->n_coordinates, n_p = (size_t)d->n_paths;
    void *context = NULL;
    uint64_t seed = 2013;
    *s = (samples){.n_q = d->n_coordinates, .n_p = d->n_paths};
    s->q = calloc(POSES * n_q + 1, sizeof *s->q);
    s->length = calloc(POSES * n_p + 1, sizeof *s->length);
    s->gradient = calloc(POSES * n_p * n_q + 1, sizeof *s->gradient);
    s->lower = calloc(3 * n_q + 1, sizeof *s->lower);
    if (s->q == NULL || s->length == NULL || s->gradient == NULL || s->lower == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory to fit paths");
    }
    s->upper = s->lower + n_q;
    double *still = s->upper + n_q;
    for (size_t i = 0; i < n_q; i++) {
        double widest = d->coordinates[i].rotational ? WIDEST_ANGLE : WIDEST_SHIFT;
        s->lower[i] = fmax(d->coordinates[i].lower, -widest);
        s->upper[i] = fmin(d->coordinates[i].upper, widest);
        double middle = fmax(s->lower[i], fmin(s->upper[i], d->coordinates[i].value));
        s->lower[i] = middle + range * (s->lower[i] - middle);
        s->upper[i] = middle + range * (s->upper[i] - middle);
        double margin = MARGIN * (s->upper[i] - s->lower[i]);
        s->lower[i] -= margin;
        s->upper[i] += margin;
        if (!(s->upper[i] > s->lower[i])) {
            s->lower[i] = d->coordinates[i].value - 0.01;
            s->upper[i] = d->coordinates[i].value + 0.01;
        }
    }
    mhe_status status = simbody_context_create(model, &context, err);
    for (size_t k = 0; k < POSES && status == MHE_OK; k++) {
        double *q = s->q + k * n_q;
        for (size_t i = 0; i < n_q; i++) {
            q[i] = s->lower[i] + (s->upper[i] - s->lower[i]) * uniform(&seed);
        }
        mhe_kinematics out = {.size = sizeof out,
                              .length = s->length + k * n_p,
                              .length_q = s->gradient + k * n_p * n_q};
        status = simbody_kinematics(context, q, still, &out, err);
    }
    simbody_context_destroy(context);
    return status;
}

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
    static const int32_t degree[MOST_OWN + 1] = {0, 14, 12, 9, 7, 6, 5, 4, 3};
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

/* Chooses terms until the validation poses are content; returns their number, 0: never. */
static int32_t choose_terms(problem *p) {
    uint8_t out_of_use[MOST_CANDIDATES] = {0};
    int32_t n = 0;
    while (n < MOST_TERMS) {
        int32_t t = best_term(p, n, out_of_use);
        if (t < 0) {
            return 0;
        }
        out_of_use[t] = 1;
        if (choose(p, n, t) != 0) {
            continue;
        }
        solve(p, ++n);
        if (validate(p, n) < AIM) {
            return n;
        }
    }
    return 0;
}

/* ---- one path ---- */

int fit_allocate(path_fit *fit, int32_t n, int32_t n_terms) {
    size_t a = (size_t)n + 1, b = (size_t)n_terms + 1;
    fit->n = n;
    fit->n_terms = n_terms;
    fit->coordinate = calloc(a, sizeof *fit->coordinate);
    fit->centre = calloc(a, sizeof *fit->centre);
    fit->scale = calloc(a, sizeof *fit->scale);
    fit->coef = calloc(b, sizeof *fit->coef);
    fit->exponent = calloc(a * b, sizeof *fit->exponent);
    return fit->coordinate != NULL && fit->centre != NULL && fit->scale != NULL &&
                   fit->coef != NULL && fit->exponent != NULL
               ? 0
               : -1;
}

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

static int fit_path(const simbody_model *model, const samples *s, int32_t path, double tolerance,
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

/* Largest jump of the lengths where conditional points of path go on or off, over some poses. Only
 * where the coordinate is a free one. */
static double path_jump(const mhe_description *d, const samples *s, void *context, int32_t path,
                        double *length, double *q) {
    double largest = 0;
    for (int32_t k = 0; k < d->paths[path].n_points; k++) {
        const mhe_path_point *point = &d->paths[path].points[k];
        if (point->kind != MHE_POINT_CONDITIONAL || point->coordinate[0] >= d->n_coordinates) {
            continue;
        }
        int32_t c = point->coordinate[0];
        double edges[2] = {point->lower, point->upper};
        for (int e = 0; e < 2; e++) {
            for (int32_t i = 0; i < 20 && edges[e] > s->lower[c] && edges[e] < s->upper[c]; i++) {
                double value[2];
                for (int side = 0; side < 2; side++) {
                    memcpy(q, s->q + (size_t)i * (size_t)s->n_q, sizeof *q * (size_t)s->n_q);
                    q[c] = edges[e] + (side ? 1e-9 : -1e-9);
                    mhe_kinematics out = {.size = sizeof out, .length = length};
                    if (simbody_kinematics(context, q, q + s->n_q, &out, NULL) != MHE_OK) {
                        return largest;
                    }
                    value[side] = length[path];
                }
                largest = fmax(largest, fabs(value[1] - value[0]));
            }
        }
    }
    return largest;
}

static mhe_status measure_jumps(const mhe_description *d, const samples *s, void *model,
                                path_fits *fits, mhe_error *err) {
    void *context = NULL;
    double *scratch = calloc((size_t)(s->n_p + 2 * s->n_q) + 1, sizeof *scratch);
    mhe_status status = scratch == NULL ? mhe_fail(err, MHE_E_MEMORY, "no memory to fit paths")
                                        : simbody_context_create(model, &context, err);
    for (int32_t i = 0; i < s->n_p && status == MHE_OK; i++) {
        fits->fits[i].jump = path_jump(d, s, context, i, scratch, scratch + s->n_p);
    }
    simbody_context_destroy(context);
    free(scratch);
    return status;
}

/* ---- all paths ---- */

static void tell(const mhe_host *host, const mhe_description *d, const path_fits *fits) {
    int32_t n = 0;
    char text[320];
    for (int32_t i = 0; i < fits->n && host != NULL; i++) {
        const path_fit *fit = &fits->fits[i];
        n += fit->fitted;
        if (fit->fitted) {
            (void)snprintf(text, sizeof text,
                           "path '%s': %d terms in %d coordinates, off by %.2f mm RMS (%.2f at "
                           "worst), moment arms by %.2f mm RMS (%.2f)",
                           d->paths[i].name, (int)fit->n_terms, (int)fit->n, 1e3 * fit->length_rms,
                           1e3 * fit->length_worst, 1e3 * fit->arm_rms, 1e3 * fit->arm_worst);
            host->log(host, MHE_LOG_DEBUG, text);
        } else if (fit->why[0] != '\0') {
            (void)snprintf(text, sizeof text, "path '%s' stays exact: %s", d->paths[i].name,
                           fit->why);
            host->log(host, MHE_LOG_INFO, text);
        }
        if (fit->fitted && fit->jump > TOLD_JUMP) {
            (void)snprintf(text, sizeof text,
                           "path '%s': its conditional points jump by %.1f mm; fitted, it has no "
                           "jump",
                           d->paths[i].name, 1e3 * fit->jump);
            host->log(host, MHE_LOG_WARNING, text);
        }
    }
    if (host != NULL) {
        (void)snprintf(text, sizeof text, "%d of %d paths are polynomials", (int)n, (int)fits->n);
        host->log(host, MHE_LOG_INFO, text);
    }
}

/* The description with polynomials where paths were fitted. */
static int fits_describe(const mhe_description *d, path_fits *fits) {
    size_t n = (size_t)fits->n + 1;
    fits->terms = calloc(n, sizeof *fits->terms);
    fits->paths = calloc(n, sizeof *fits->paths);
    if (fits->terms == NULL || fits->paths == NULL) {
        return -1;
    }
    fits->description = *d;
    fits->description.paths = fits->paths;
    for (int32_t i = 0; i < fits->n; i++) {
        const path_fit *fit = &fits->fits[i];
        fits->paths[i] = d->paths[i];
        if (fit->fitted) {
            fits->terms[i] =
                (mhe_polynomial){fit->n,       fit->coordinate, fit->centre,  fit->scale,
                                 fit->n_terms, fit->coef,       fit->exponent};
            fits->paths[i].n_points = fits->paths[i].n_wraps = 0;
            fits->paths[i].length = &fits->terms[i];
        }
    }
    return 0;
}

static mhe_status fits_make(const mhe_description *d, void *model, double tolerance, double range,
                            path_fits *fits, mhe_error *err) {
    samples s;
    mhe_status status = samples_make(d, model, range, &s, err);
    for (int32_t i = 0; i < fits->n && status == MHE_OK; i++) {
        if (fit_path(model, &s, i, tolerance, &fits->fits[i]) != 0) {
            status = mhe_fail(err, MHE_E_MEMORY, "no memory to fit paths");
        }
    }
    if (status == MHE_OK) {
        status = measure_jumps(d, &s, model, fits, err);
    }
    samples_free(&s);
    return status;
}

mhe_status fits_create(const mhe_host *host, const mhe_description *d, void *model,
                       double tolerance, double range, path_fits **out, mhe_error *err) {
    path_fits *fits = calloc(1, sizeof *fits);
    uint64_t digest = fits_digest(d, tolerance, range);
    mhe_status status = MHE_OK;
    *out = fits;
    if (fits == NULL || (fits->fits = calloc((size_t)d->n_paths + 1, sizeof *fits->fits)) == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory to fit paths");
    }
    fits->n = d->n_paths;
    if (fits_read(digest, d->n_coordinates, fits) != 0) {
        status = fits_make(d, model, tolerance, range, fits, err);
        if (status == MHE_OK) {
            (void)fits_write(digest, fits); /* next time it takes as long again, no more */
        }
    }
    if (status == MHE_OK && fits_describe(d, fits) != 0) {
        status = mhe_fail(err, MHE_E_MEMORY, "no memory to fit paths");
    }
    if (status == MHE_OK) {
        tell(host, d, fits);
    }
    return status;
}

void fit_clear(path_fit *fit) {
    free(fit->coordinate);
    free(fit->centre);
    free(fit->scale);
    free(fit->coef);
    free(fit->exponent);
    memset(fit, 0, sizeof *fit);
}

void fits_free(path_fits *fits) {
    if (fits == NULL) {
        return;
    }
    for (int32_t i = 0; i < fits->n && fits->fits != NULL; i++) {
        fit_clear(&fits->fits[i]);
    }
    free(fits->fits);
    free(fits->terms);
    free(fits->paths);
    free(fits);
}

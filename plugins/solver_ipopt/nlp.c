/* SPDX-License-Identifier: Apache-2.0 */
#include "nlp.h"

#include "../constant_rows.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

double nlp_now(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Where the parts of a node begin in its piece of the store. */
typedef struct layout {
    int32_t cost, x_next, grad_x, grad_u, grad_p, xx, ux, uu, px, pu, pp, A, B, P, end;
} layout;

static layout node_layout(const mhe_stage_problem *problem) {
    int32_t n_x = problem->n_x, n_u = problem->n_u, n_p = problem->n_p;
    layout at = {.cost = 0, .x_next = 1};
    at.grad_x = at.x_next + n_x;
    at.grad_u = at.grad_x + n_x;
    at.grad_p = at.grad_u + n_u;
    at.xx = at.grad_p + n_p;
    at.ux = at.xx + n_x * n_x;
    at.uu = at.ux + n_u * n_x;
    at.px = at.uu + n_u * n_u;
    at.pu = at.px + n_p * n_x;
    at.pp = at.pu + n_p * n_u;
    at.A = at.pp + n_p * n_p;
    at.B = at.A + n_x * n_x;
    at.P = at.B + n_x * n_u;
    at.end = at.P + n_x * n_p;
    return at;
}

/* Position in w of x_k; u_k follows it. */
static int32_t x_at(const nlp *p, int32_t k) {
    return k * (p->problem->n_x + p->problem->n_u);
}

/* ... and of the parameters. */
static int32_t p_at(const nlp *p) {
    return x_at(p, p->problem->n_intervals) + p->problem->n_x;
}

static int32_t count(const uint8_t *pattern, int32_t n) {
    int32_t ones = 0;
    for (int32_t i = 0; i < n; i++) {
        ones += pattern[i] != 0;
    }
    return ones;
}

mhe_status nlp_create(nlp *p, const mhe_stage_problem *problem, mhe_error *err) {
    int32_t N = problem->n_intervals, n_x = problem->n_x, n_u = problem->n_u, n_p = problem->n_p;
    if ((int64_t)(N + 1) * node_layout(problem).end > INT32_MAX) { /* Ipopt counts with int */
        return mhe_fail(err, MHE_E_ARGUMENT,
                        "%d intervals of %d states and %d controls are more than Ipopt can count",
                        N, n_x, n_u);
    }
    int32_t n_jacobian = N * (n_x + count(problem->A_pattern, n_x * n_x) +
                              count(problem->B_pattern, n_x * n_u) + n_x * n_p);
    int32_t n_hessian =
        (N + 1) * count(problem->xx_pattern, n_x * n_x) +
        N * (count(problem->ux_pattern, n_u * n_x) + count(problem->uu_pattern, n_u * n_u)) +
        (N + 1) * n_p * (n_x + n_u + n_p);
    *p = (nlp){.problem = problem, .n_all = N * (n_x + n_u) + n_x + n_p, .m = N * n_x, .n = -1};
    size_t n_all = (size_t)p->n_all;
    p->stride = node_layout(problem).end;
    p->of = malloc(n_all * sizeof *p->of);
    p->number = malloc(n_all * sizeof *p->number);
    p->constant = calloc((size_t)p->m + 1, 1);
    p->w = calloc(n_all, sizeof *p->w);
    p->lower = malloc(n_all * sizeof *p->lower);
    p->upper = malloc(n_all * sizeof *p->upper);
    p->store = calloc((size_t)(N + 1) * (size_t)p->stride, sizeof *p->store);
    p->jacobian = malloc((size_t)n_jacobian * sizeof *p->jacobian);
    p->hessian = malloc(((size_t)n_hessian + 1) * sizeof *p->hessian);
    const size_t n_full = (size_t)n_p * (size_t)(n_x + n_u + n_p) + 1;
    p->full = malloc(n_full);
    if (p->full != NULL) {
        memset(p->full, 1, n_full);
    }
    if (p->full == NULL || p->constant == NULL || p->of == NULL || p->number == NULL ||
        p->w == NULL || p->lower == NULL || p->upper == NULL || p->store == NULL ||
        p->jacobian == NULL || p->hessian == NULL) {
        nlp_free(p);
        return mhe_fail(err, MHE_E_MEMORY, "no memory for a program of %d variables",
                        (int)(N * (n_x + n_u) + n_x + n_p));
    }
    return MHE_OK;
}

void nlp_free(nlp *p) {
    free(p->of);
    free(p->number);
    free(p->constant);
    free(p->w);
    free(p->lower);
    free(p->upper);
    free(p->store);
    free(p->jacobian);
    free(p->hessian);
    free(p->full);
    *p = (nlp){0};
}

void nlp_gather(const nlp *p, const double *x, const double *u, const double *parameters,
                double *w) {
    int32_t n_x = p->problem->n_x, n_u = p->problem->n_u, N = p->problem->n_intervals;
    for (int32_t k = 0; k <= N; k++) {
        memcpy(w + x_at(p, k), x + k * n_x, sizeof(double) * (size_t)n_x);
        if (k < N) {
            memcpy(w + x_at(p, k) + n_x, u + k * n_u, sizeof(double) * (size_t)n_u);
        }
    }
    for (int32_t i = 0; i < p->problem->n_p; i++) {
        w[p_at(p) + i] = parameters[i];
    }
}

void nlp_scatter(const nlp *p, const double *w, double *x, double *u, double *parameters) {
    int32_t n_x = p->problem->n_x, n_u = p->problem->n_u, N = p->problem->n_intervals;
    for (int32_t k = 0; k <= N; k++) {
        memcpy(x + k * n_x, w + x_at(p, k), sizeof(double) * (size_t)n_x);
        if (k < N) {
            memcpy(u + k * n_u, w + x_at(p, k) + n_x, sizeof(double) * (size_t)n_u);
        }
    }
    for (int32_t i = 0; i < p->problem->n_p; i++) {
        parameters[i] = w[p_at(p) + i];
    }
}

/* Appends the non-zeros of one block [n_rows x n_cols] whose first element lies at `at` in the
 * store. Rows are numbered from `row` (constraints) or by free variables from w[row]. */
static nlp_entry *add_block(const nlp *p, nlp_entry *out, const uint8_t *pattern, int32_t n_rows,
                            int32_t n_cols, int32_t row, int32_t col, int32_t at, int is_hessian) {
    for (int32_t i = 0; i < n_rows; i++) {
        for (int32_t j = 0; j < n_cols; j++) {
            int32_t r = is_hessian ? p->number[row + i] : row + i, c = p->number[col + j];
            if (pattern[i * n_cols + j] && r >= 0 && c >= 0 && (!is_hessian || c <= r)) {
                *out++ = (nlp_entry){.row = r, .col = c, .at = at + i * n_cols + j};
            }
        }
    }
    return out;
}

static void number_matrices(nlp *p) {
    const mhe_stage_problem *problem = p->problem;
    int32_t n_x = problem->n_x, n_u = problem->n_u, N = problem->n_intervals;
    const int32_t n_p = problem->n_p, par = p_at(p);
    layout at = node_layout(problem);
    nlp_entry *J = p->jacobian, *H = p->hessian;
    for (int32_t k = 0; k <= N; k++) {
        int32_t store = k * p->stride, x = x_at(p, k), u = x + n_x;
        H = add_block(p, H, problem->xx_pattern, n_x, n_x, x, x, store + at.xx, 1);
        H = add_block(p, H, p->full, n_p, n_x, par, x, store + at.px, 1);
        H = add_block(p, H, p->full, n_p, n_p, par, par, store + at.pp, 1); /* sums over nodes */
        if (k == N) {
            break;
        }
        H = add_block(p, H, problem->ux_pattern, n_u, n_x, u, x, store + at.ux, 1);
        H = add_block(p, H, problem->uu_pattern, n_u, n_u, u, u, store + at.uu, 1);
        H = add_block(p, H, p->full, n_p, n_u, par, u, store + at.pu, 1);
        J = add_block(p, J, problem->A_pattern, n_x, n_x, k * n_x, x, store + at.A, 0);
        J = add_block(p, J, problem->B_pattern, n_x, n_u, k * n_x, u, store + at.B, 0);
        J = add_block(p, J, p->full, n_x, n_p, k * n_x, par, store + at.P, 0);
        for (int32_t i = 0; i < n_x; i++) {
            int32_t col = p->number[x_at(p, k + 1) + i];
            if (col >= 0) {
                *J++ = (nlp_entry){.row = k * n_x + i, .col = col, .at = -1};
            }
        }
    }
    p->n_jacobian = (int32_t)(J - p->jacobian);
    p->n_hessian = (int32_t)(H - p->hessian);
}

int32_t nlp_read_bounds(nlp *p) {
    const mhe_stage_problem *problem = p->problem;
    int32_t n_x = problem->n_x, stage = n_x + problem->n_u, n = 0;
    int32_t first = p->n < 0, renumber = first, changed = first;
    for (int32_t i = 0; i < p->n_all; i++) {
        int32_t k = i / stage, j = i % stage;
        int32_t is_x = j < n_x, at = is_x ? k * n_x + j : k * problem->n_u + j - n_x;
        const int32_t parameter = i - p_at(p);
        double lower = parameter >= 0 ? problem->p_lower[parameter]
                       : is_x         ? problem->x_lower[at]
                                      : problem->u_lower[at];
        double upper = parameter >= 0 ? problem->p_upper[parameter]
                       : is_x         ? problem->x_upper[at]
                                      : problem->u_upper[at];
        if (!(lower <= upper)) {
            return NLP_EMPTY;
        }
        int32_t number = lower == upper ? -1 : n;
        renumber |= !first && p->number[i] != number;
        changed |= !first && number >= 0 && (p->lower[i] != lower || p->upper[i] != upper);
        p->lower[i] = lower;
        p->upper[i] = upper;
        p->number[i] = number;
        if (number >= 0) {
            p->of[n++] = i;
        }
    }
    p->n = n;
    if (renumber) {
        p->n_constant = n < p->m ? constant_rows(problem, p->constant) : 0;
        number_matrices(p);
    }
    return renumber || changed ? NLP_CHANGED : NLP_SAME;
}

void nlp_begin(nlp *p, const double *x, const double *u, const double *parameters) {
    nlp_gather(p, x, u, parameters, p->w);
    for (int32_t i = 0; i < p->n_all; i++) {
        p->w[i] = p->number[i] < 0 ? p->lower[i] : p->w[i];
    }
    p->known = NLP_NOTHING;
    p->no_value = 0;
    p->failure = MHE_OK;
    p->error.text[0] = '\0';
    p->seconds = 0;
}

/* Moves w to the free variables v; forgets what was known there if that is another point. */
static void move_to(nlp *p, const double *v) {
    int32_t moved = 0;
    for (int32_t i = 0; i < p->n; i++) {
        moved |= p->w[p->of[i]] != v[i];
        p->w[p->of[i]] = v[i];
    }
    if (moved) {
        p->known = NLP_NOTHING;
        p->no_value = 0;
    }
}

static int32_t is_finite(const double *values, int32_t n) {
    double sum = 0;
    for (int32_t i = 0; i < n; i++) {
        sum += values[i] - values[i]; /* 0, or NaN where not finite */
    }
    return sum == 0;
}

/* Evaluates node k: its values if they are not known yet, and its derivatives if `level` says so.
 */
static mhe_status evaluate_node(nlp *p, int32_t k, int32_t level) {
    const mhe_stage_problem *problem = p->problem;
    int32_t is_last = k == problem->n_intervals;
    layout at = node_layout(problem);
    double *s = p->store + (ptrdiff_t)k * p->stride;
    mhe_stage_values out = {.size = sizeof out};
    if (p->known < NLP_VALUES) {
        out.cost = s + at.cost;
        out.x_next = is_last ? NULL : s + at.x_next;
    }
    if (level == NLP_ALL) {
        out.grad_x = s + at.grad_x;
        out.hess_xx = s + at.xx;
        if (problem->n_p > 0) {
            out.grad_p = s + at.grad_p;
            out.hess_px = s + at.px;
            out.hess_pp = s + at.pp;
        }
        if (!is_last) {
            out.hess_pu = problem->n_p > 0 ? s + at.pu : NULL;
            out.P = problem->n_p > 0 ? s + at.P : NULL;
            out.grad_u = s + at.grad_u;
            out.hess_ux = s + at.ux;
            out.hess_uu = s + at.uu;
            out.A = s + at.A;
            out.B = s + at.B;
        }
    }
    const double *x = p->w + x_at(p, k), *u = is_last ? NULL : x + problem->n_x;
    mhe_status status = problem->evaluate(problem, 0, k, x, u, &out, &p->error);
    if (status != MHE_OK) {
        return status;
    }
    int32_t n = level == NLP_ALL ? at.end : at.grad_x;
    return is_finite(s, n) ? MHE_OK : MHE_RETRY;
}

int32_t nlp_evaluate(nlp *p, const double *v, int32_t level) {
    move_to(p, v);
    if (p->failure != MHE_OK || p->no_value) {
        return 0;
    }
    if (p->known >= level) {
        return 1;
    }
    /* Where full steps are the rule, the first point tried will be accepted: asking for all at once
     * spares a second evaluation. Points tried after it are asked for values first. */
    if (p->all_next) {
        level = NLP_ALL;
        p->all_next = 0;
    }
    double start = nlp_now();
    mhe_status status = MHE_OK;
    if (p->problem->n_p > 0 && p->known == NLP_NOTHING) {
        status = p->problem->set_parameters(p->problem, p->w + p_at(p), &p->error);
    }
    for (int32_t k = 0; k <= p->problem->n_intervals && status == MHE_OK; k++) {
        status = evaluate_node(p, k, level);
    }
    p->seconds += nlp_now() - start;
    p->failure = status < 0 ? status : MHE_OK;
    p->no_value = status > 0;
    p->known = status == MHE_OK ? level : NLP_NOTHING;
    return status == MHE_OK;
}

double nlp_cost(const nlp *p) {
    double sum = 0;
    for (int32_t k = 0; k <= p->problem->n_intervals; k++) {
        sum += p->store[(ptrdiff_t)k * p->stride];
    }
    return sum;
}

void nlp_constraints(const nlp *p, double *g) {
    int32_t n_x = p->problem->n_x;
    layout at = node_layout(p->problem);
    for (int32_t k = 0; k < p->problem->n_intervals; k++) {
        const double *reached = p->store + (ptrdiff_t)k * p->stride + at.x_next;
        const double *next = p->w + x_at(p, k + 1);
        for (int32_t i = 0; i < n_x; i++) {
            g[k * n_x + i] = next[i] - reached[i];
        }
    }
}

double nlp_constant_gap(const nlp *p, const double *g) {
    double largest = 0;
    for (int32_t i = 0; i < p->m && p->n_constant > 0; i++) {
        largest = p->constant[i] ? fmax(largest, fabs(g[i])) : largest;
    }
    return largest;
}

void nlp_cost_gradient(const nlp *p, double *grad) {
    int32_t n_x = p->problem->n_x, n_u = p->problem->n_u, N = p->problem->n_intervals;
    layout at = node_layout(p->problem);
    for (int32_t k = 0; k <= N; k++) { /* grad_u lies behind grad_x, as u_k behind x_k */
        memcpy(grad + x_at(p, k), p->store + (ptrdiff_t)k * p->stride + at.grad_x,
               sizeof(double) * (size_t)(k < N ? n_x + n_u : n_x));
    }
    for (int32_t i = 0; i < p->problem->n_p; i++) {
        double sum = 0;
        for (int32_t k = 0; k <= N; k++) {
            sum += p->store[(ptrdiff_t)k * p->stride + at.grad_p + i];
        }
        grad[p_at(p) + i] = sum;
    }
}

/* grad -= M^T lambda, M [n_rows x n_cols] */
static void subtract_product(const double *M, const double *lambda, int32_t n_rows, int32_t n_cols,
                             double *grad) {
    for (int32_t i = 0; i < n_rows; i++) {
        for (int32_t j = 0; j < n_cols; j++) {
            grad[j] -= M[i * n_cols + j] * lambda[i];
        }
    }
}

void nlp_lagrangian_gradient(const nlp *p, const double *lambda, double *grad) {
    int32_t n_x = p->problem->n_x, n_u = p->problem->n_u;
    layout at = node_layout(p->problem);
    nlp_cost_gradient(p, grad);
    for (int32_t k = 0; k < p->problem->n_intervals; k++) {
        const double *store = p->store + (ptrdiff_t)k * p->stride, *multiplier = lambda + k * n_x;
        double *by_x = grad + x_at(p, k), *by_next = grad + x_at(p, k + 1);
        subtract_product(store + at.A, multiplier, n_x, n_x, by_x);
        subtract_product(store + at.B, multiplier, n_x, n_u, by_x + n_x);
        subtract_product(store + at.P, multiplier, n_x, p->problem->n_p, grad + p_at(p));
        for (int32_t i = 0; i < n_x; i++) {
            by_next[i] += multiplier[i];
        }
    }
}

double nlp_scale(nlp *p, const double *v) {
    int32_t n_x = p->problem->n_x, n_u = p->problem->n_u, n = 0;
    layout at = node_layout(p->problem);
    double sum = 0; /* of logarithms */
    if (!nlp_evaluate(p, v, NLP_ALL)) {
        return 1;
    }
    for (int of_states = 0; of_states < 2 && n == 0; of_states++) {
        int32_t size = of_states ? n_x : n_u, block = of_states ? at.xx : at.uu;
        for (int32_t k = 0; k < p->problem->n_intervals; k++) {
            const double *H = p->store + (ptrdiff_t)k * p->stride + block;
            for (int32_t i = 0; i < size; i++) {
                double curvature = H[i * size + i];
                sum += curvature > 0 ? log(curvature) : 0;
                n += curvature > 0;
            }
        }
    }
    return n > 0 ? exp(-sum / n) : 1;
}

double nlp_jacobian_value(const nlp *p, const nlp_entry *entry) {
    return entry->at < 0 ? 1 : -p->store[entry->at];
}

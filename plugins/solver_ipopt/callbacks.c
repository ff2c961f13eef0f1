/* SPDX-License-Identifier: Apache-2.0 */
/* callbacks.c: the nonlinear program as Ipopt asks for it. Ipopt's new_x is not needed: the program
 * itself knows which point it holds. */
#include "ipopt_solver.h"

#include <math.h>

#define NO_BOUND 2e19 /* beyond nlp_upper_bound_inf */

/* What an iteration is beside a solution by recursions (mhe_solve_control.spent): a sparse
 * factorisation and its solutions. */
#define SOLUTIONS 40

/* A replay knows of each evaluation whether the clock broke it off: it is asked before. */
static int32_t evaluate(ipopt_solver *s, const compat_number *v, int32_t level) {
    if (s->control != NULL && s->control->late != NULL) {
        (void)s->control->late(s->control->budget, 0);
    }
    return nlp_evaluate(&s->nlp, v, level);
}

static compat_bool eval_f(compat_index n, compat_number *v, compat_bool new_x, compat_number *f,
                          void *data) {
    ipopt_solver *s = data;
    (void)n, (void)new_x;
    if (!evaluate(s, v, NLP_VALUES)) {
        return 0;
    }
    *f = nlp_cost(&s->nlp);
    return 1;
}

static compat_bool eval_g(compat_index n, compat_number *v, compat_bool new_x, compat_index m,
                          compat_number *g, void *data) {
    ipopt_solver *s = data;
    (void)n, (void)new_x, (void)m;
    if (!evaluate(s, v, NLP_VALUES)) {
        return 0;
    }
    nlp_constraints(&s->nlp, g);
    return 1;
}

static compat_bool eval_grad_f(compat_index n, compat_number *v, compat_bool new_x,
                               compat_number *grad, void *data) {
    ipopt_solver *s = data;
    (void)new_x;
    if (!evaluate(s, v, NLP_ALL)) {
        return 0;
    }
    nlp_cost_gradient(&s->nlp, s->work);
    for (compat_index i = 0; i < n; i++) {
        grad[i] = s->work[s->nlp.of[i]];
    }
    return 1;
}

static void structure(const nlp_entry *entries, compat_index n, compat_index *row,
                      compat_index *col) {
    for (compat_index i = 0; i < n; i++) {
        row[i] = entries[i].row;
        col[i] = entries[i].col;
    }
}

static compat_bool eval_jac_g(compat_index n, compat_number *v, compat_bool new_x, compat_index m,
                              compat_index n_entries, compat_index *row, compat_index *col,
                              compat_number *values, void *data) {
    ipopt_solver *s = data;
    (void)n, (void)new_x, (void)m;
    if (values == NULL) {
        structure(s->nlp.jacobian, n_entries, row, col);
        return 1;
    }
    if (!evaluate(s, v, NLP_ALL)) {
        return 0;
    }
    for (compat_index i = 0; i < n_entries; i++) {
        values[i] = nlp_jacobian_value(&s->nlp, &s->nlp.jacobian[i]);
    }
    return 1;
}

static compat_bool eval_h(compat_index n, compat_number *v, compat_bool new_x,
                          compat_number obj_factor, compat_index m, compat_number *lambda,
                          compat_bool new_lambda, compat_index n_entries, compat_index *row,
                          compat_index *col, compat_number *values, void *data) {
    ipopt_solver *s = data;
    (void)n, (void)new_x, (void)m, (void)lambda, (void)new_lambda;
    if (values == NULL) {
        structure(s->nlp.hessian, n_entries, row, col);
        return 1;
    }
    if (!evaluate(s, v, NLP_ALL)) {
        return 0;
    }
    if (s->config->adapt_curvature) {
        curvature_adapt(&s->curvature, v);
    }
    const double factor = obj_factor * s->curvature.factor;
    for (compat_index i = 0; i < n_entries; i++) {
        values[i] = factor * s->nlp.store[s->nlp.hessian[i].at];
    }
    return 1;
}

/* Would another iteration, as long as those before, end behind the deadline? */
static int32_t is_late(ipopt_solver *s) {
    const double now = nlp_now();
    if (s->iterations == 0) {
        s->begun = now;
    }
    const double one = s->iterations > 0 ? (now - s->begun) / s->iterations : 0;
    return s->control->late != NULL ? s->control->late(s->control->budget, one)
                                    : s->control->deadline > 0 && now + one >= s->control->deadline;
}

static compat_bool intermediate(compat_index mode, compat_index iteration, compat_number objective,
                                compat_number inf_pr, compat_number inf_du, compat_number mu,
                                compat_number d_norm, compat_number regularization,
                                compat_number alpha_du, compat_number alpha_pr, compat_index trials,
                                void *data) {
    ipopt_solver *s = data;
    const mhe_solve_control *control = s->control;
    (void)mode, (void)mu, (void)d_norm, (void)regularization, (void)alpha_du, (void)trials;
    s->curvature.length = alpha_pr;
    s->iterations = iteration;
    s->kkt_residual = fmax(inf_pr, inf_du);
    s->nlp.all_next = 1;
    if (control != NULL && control->progress != NULL &&
        control->progress(control->data, iteration, objective, s->kkt_residual)) {
        s->stopped = MHE_SOLVE_INTERRUPTED;
    } else if (control != NULL && (is_late(s) || (control->spent != NULL &&
                                                  control->spent(control->budget, SOLUTIONS)))) {
        s->stopped = MHE_SOLVE_DEADLINE;
    }
    return s->stopped == 0 && s->nlp.failure == MHE_OK;
}

/* What is constant in g is no equation for Ipopt, which wants as many variables as it has. */
IpoptProblem ipopt_problem(const nlp *p, double *lower, double *upper, double *g_lower,
                           double *g_upper) {
    for (int32_t i = 0; i < p->m; i++) {
        g_upper[i] = p->n_constant > 0 && p->constant[i] ? NO_BOUND : 0;
        g_lower[i] = -g_upper[i];
    }
    for (int32_t i = 0; i < p->n; i++) {
        lower[i] = p->lower[p->of[i]];
        upper[i] = p->upper[p->of[i]];
    }
    IpoptProblem ipopt =
        CreateIpoptProblem(p->n, lower, upper, p->m, g_lower, g_upper, p->n_jacobian, p->n_hessian,
                           0, eval_f, eval_g, eval_grad_f, eval_jac_g, eval_h);
    if (ipopt != NULL) {
        SetIntermediateCallback(ipopt, intermediate);
    }
    return ipopt;
}

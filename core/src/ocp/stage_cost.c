/* SPDX-License-Identifier: Apache-2.0 */
/* stage_cost.c: the terms, priors and parameters of a node as one cost with its derivatives. */
#include "ocp/ocp_private.h"

#include "base/values.h"

#include <stddef.h>
#include <string.h>

/* Full square block [n x n] of the variables from `first` on, from the lower triangle. */
static void mirror(const mhi_ocp *ocp, const double *hessian, int32_t n_z, int32_t first, int32_t n,
                   int32_t is_clear, double *block) {
    if (!is_clear) {
        memset(block, 0, sizeof(double) * (size_t)(n * n));
    }
    for (int32_t i = 0; i < n; i++) {
        const double *row = hessian + (first + i) * n_z + first;
        const int32_t reach = ocp->reach[first + i] - first;
        for (int32_t j = reach > 0 ? reach : 0; j <= i; j++) {
            block[i * n + j] = block[j * n + i] = row[j];
        }
    }
}

/* Where anything can stand in the lower triangle. */
static void clear(const mhi_ocp *ocp, int32_t n_z, double *hessian) {
    for (int32_t i = 0; i < n_z; i++) {
        const int32_t reach = ocp->reach[i];
        if (reach == i) { /* as most of muscles: no call */
            hessian[i * n_z + i] = 0;
        } else {
            memset(hessian + i * n_z + reach, 0, sizeof(double) * (size_t)(i - reach + 1));
        }
    }
}

/* Rows of the variables from `first` on, columns of x. */
static void copy_rows(const mhi_ocp *ocp, const double *hessian, int32_t n_z, int32_t first,
                      int32_t n, int32_t is_clear, double *block) {
    const int32_t n_x = ocp->n_x;
    if (!is_clear) {
        memset(block, 0, sizeof(double) * (size_t)(n * n_x));
    }
    for (int32_t i = 0; i < n; i++) {
        for (int32_t j = ocp->reach[first + i]; j < n_x; j++) {
            block[i * n_x + j] = hessian[(first + i) * n_z + j];
        }
    }
}

/* The gradient and the lower triangle of the Hessian by z, given out as what is wanted of grad_x,
 * grad_u, xx, ux, uu. */
static void spread(const mhi_ocp *ocp, const mhi_ocp_worker *w, int32_t n_z,
                   const mhe_stage_values *out) {
    const int32_t n_x = ocp->n_x, n_u = n_z > n_x ? ocp->face.n_u : 0;
    const int32_t is_clear = out->size > offsetof(mhe_stage_values, hess_clear) && out->hess_clear;
    if (ocp->signals.n_carried > 0) {
        mhi_ocp_spread_carried(ocp, w, out);
    } else {
        if (out->grad_x != NULL) {
            memcpy(out->grad_x, w->gradient, sizeof(double) * (size_t)n_x);
        }
        if (out->hess_xx != NULL) {
            mirror(ocp, w->hessian, n_z, 0, n_x, is_clear, out->hess_xx);
        }
        if (out->hess_ux != NULL && n_u > 0) {
            copy_rows(ocp, w->hessian, n_z, n_x, n_u, is_clear, out->hess_ux);
        }
    }
    if (out->grad_u != NULL && n_u > 0) {
        memcpy(out->grad_u, w->gradient + n_x, sizeof(double) * (size_t)n_u);
    }
    if (out->hess_uu != NULL && n_u > 0) {
        mirror(ocp, w->hessian, n_z, n_x, n_u, is_clear, out->hess_uu);
    }
}

static void add_prior(const mhi_ocp *ocp, const double *centre, const double *x, int32_t n_z,
                      mhi_term_sum *sum) {
    for (int32_t i = 0; i < ocp->n_x; i++) {
        const double weight = ocp->prior_weight[i], difference = x[i] - centre[i];
        sum->cost += 0.5 * weight * difference * difference;
        if (sum->gradient != NULL) {
            sum->gradient[i] += weight * difference;
            sum->hessian[i * n_z + i] += weight;
        }
    }
}

/* Room for what terms say of the parameters. */
static void begin_parameters(const mhi_ocp *ocp, mhi_ocp_worker *w, int32_t n_z,
                             int32_t derivatives, mhi_term_sum *sum) {
    const size_t n_p = (size_t)ocp->face.n_p, bytes = sizeof(double) * n_p;
    if (derivatives) {
        sum->by_p = &w->by_p;
        memset(w->by_p.gradient, 0, bytes);
        memset(w->by_p.pz, 0, bytes * (size_t)n_z);
        memset(w->by_p.pp, 0, bytes * n_p);
    }
}

/* What is known of the parameters beforehand. */
static void add_parameter_prior(const mhi_ocp *ocp, mhi_term_sum *sum) {
    const int32_t n = ocp->estimated == NULL ? 0 : ocp->parameters.setup.n;
    for (int32_t i = 0; i < n; i++) {
        const mhi_parameter *p = &ocp->parameters.setup.list[i];
        const double weight = 1 / (p->sd * p->sd), off = ocp->parameters.p[i] - p->mean;
        sum->cost += 0.5 * weight * off * off;
        if (sum->by_p != NULL) {
            sum->by_p->gradient[i] += weight * off;
            sum->by_p->pp[i * n + i] += weight;
        }
    }
}

static void spread_parameters(const mhi_ocp *ocp, const mhi_ocp_worker *w, int32_t n_z,
                              const mhe_stage_values *out) {
    const int32_t n_p = ocp->face.n_p, n_x = ocp->n_x, n_u = n_z - n_x;
    const mhi_term_by_p *by = &w->by_p;
    for (int32_t i = 0; i < n_p; i++) {
        if (out->grad_p != NULL) {
            out->grad_p[i] = by->gradient[i];
        }
        if (out->hess_px != NULL) {
            memcpy(out->hess_px + i * n_x, by->pz + i * n_z, sizeof(double) * (size_t)n_x);
        }
        if (out->hess_pu != NULL && n_u > 0) {
            memcpy(out->hess_pu + i * n_u, by->pz + i * n_z + n_x, sizeof(double) * (size_t)n_u);
        }
    }
    for (int32_t i = 0; i < n_p && out->hess_pp != NULL; i++) {
        for (int32_t j = 0; j <= i; j++) {
            out->hess_pp[i * n_p + j] = out->hess_pp[j * n_p + i] = by->pp[i * n_p + j];
        }
    }
}

mhe_status mhi_ocp_cost(const mhi_ocp *ocp, mhi_ocp_worker *w, int32_t k, const double *x,
                        const double *u, const mhe_stage_values *out, mhe_error *err) {
    const int derivatives = mhi_ocp_wants_derivatives(out);
    const int32_t n_carried = ocp->signals.n_carried;
    const int32_t n_z = u == NULL && n_carried == 0 ? ocp->n_x : ocp->signals.n_z + n_carried;
    mhe_status status = mhi_ocp_measure(ocp, w, k, ocp->wanted, x, u, derivatives, err);
    if (status != MHE_OK) {
        return status;
    }
    w->linearised = derivatives;
    mhi_ocp_read_carried(ocp, k, x, w->y);
    mhi_term_sum sum = {0};
    if (ocp->estimated != NULL) {
        status = mhi_parameters_measure(
            &ocp->parameters, &ocp->signals, ocp->system, w->system, ocp->wanted, k, x, u,
            ocp->targets + (ptrdiff_t)k * ocp->signals.n_y, w->room, w->y,
            derivatives ? w->jacobian : NULL, derivatives ? w->by : NULL, err);
        if (status != MHE_OK) {
            return status;
        }
        begin_parameters(ocp, w, n_z, derivatives, &sum);
    }
    if (derivatives) {
        sum.gradient = w->gradient;
        sum.hessian = w->hessian;
        memset(w->gradient, 0, sizeof(double) * (size_t)n_z);
        clear(ocp, n_z, w->hessian);
    }
    const mhe_stage stage = {.size = sizeof stage,
                             .node = k,
                             .n_intervals = ocp->face.n_intervals,
                             .time = ocp->times[k]};
    const double scale = ocp->node_weight > 0 ? ocp->node_weight : u == NULL ? 1 : ocp->interval;
    const double *targets = ocp->targets + (ptrdiff_t)k * ocp->signals.n_y;
    const double *before = k == 0 ? NULL : targets - ocp->signals.n_y;
    for (int32_t i = 0; i < ocp->n_terms && status == MHE_OK; i++) {
        status = mhi_term_add(&ocp->terms[i], &w->terms[i], &ocp->signals, &stage, w->y, targets,
                              before, ocp->spread, w->jacobian, scale, n_z, &sum, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    if (k == 0) {
        add_prior(ocp, ocp->prior_centre, x, n_z, &sum);
        add_parameter_prior(ocp, &sum);
    }
    if (k > 0 && ocp->prior_at != NULL && ocp->prior_at[k] != NULL) {
        add_prior(ocp, ocp->prior_at[k], x, n_z, &sum);
    }
    if (derivatives && !mhi_all_finite(w->gradient, n_z)) {
        return mhe_fail(err, MHE_RETRY, "a derivative of the costs is not finite");
    }
    if (out->cost != NULL) {
        *out->cost = sum.cost;
    }
    if (derivatives) {
        spread(ocp, w, n_z, out);
        spread_parameters(ocp, w, n_z, out);
    }
    return MHE_OK;
}

mhe_status mhi_ocp_junction_cost(const mhi_ocp *ocp, mhi_ocp_worker *w, int32_t k, const double *x,
                                 const double *u, const mhe_stage_values *out, mhe_error *err) {
    const int32_t number = ocp->junction.place[k], n_x = ocp->n_x, n_p = ocp->face.n_p;
    mhe_status status = MHE_OK;
    mhe_stage_values own = *out;
    own.grad_u = own.hess_ux = own.hess_uu = own.hess_pu = NULL;
    if (number == 0) { /* the last node of a motion */
        status = mhi_ocp_cost(ocp, w, k, x, NULL, &own, err);
    } else {
        struct {
            double *values;
            int32_t n;
        } zero[] = {{own.cost, 1},     {own.grad_x, n_x},        {own.hess_xx, n_x * n_x},
                    {own.grad_p, n_p}, {own.hess_px, n_p * n_x}, {own.hess_pp, n_p * n_p}};
        for (size_t i = 0; i < sizeof zero / sizeof zero[0]; i++) {
            if (zero[i].values != NULL) {
                memset(zero[i].values, 0, sizeof(double) * (size_t)zero[i].n);
            }
        }
    }
    if (status == MHE_OK) {
        if (out->hess_pu != NULL) {
            memset(out->hess_pu, 0, sizeof(double) * (size_t)(n_p * ocp->face.n_u));
        }
        mhi_junction_cost(&ocp->junction, number, u, out);
    }
    return status;
}

/* SPDX-License-Identifier: Apache-2.0 */
#include "ocp/loop_cost.h"

#define GAP_SIGMA 1e-5  /* m (of welds also rad) */
#define RATE_SIGMA 1e-3 /* m/s (rad/s) */

static mhe_status loop_layout(const void *self, const mhe_problem *problem, mhe_cost_layout *out,
                              mhe_error *err) {
    out->signal = problem->find_signal(problem, self, &out->n_res, &out->res_unit);
    out->jacobian = MHE_JACOBIAN_DIAGONAL;
    return out->signal < 0 ? mhe_fail(err, MHE_E_INTERNAL, "no signal '%s'", (const char *)self)
                           : MHE_OK;
}

static mhe_status loop_residual(const void *self, const mhe_stage *stage, double *r,
                                mhe_error *err) {
    (void)self, (void)err;
    for (int32_t i = 0; i < stage->ny; i++) {
        r[i] = stage->y[i];
    }
    return MHE_OK;
}

static mhe_status loop_jacobian(const void *self, const mhe_stage *stage, double *J,
                                mhe_error *err) {
    (void)self, (void)err;
    for (int32_t i = 0; i < stage->ny; i++) {
        J[i] = 1;
    }
    return MHE_OK;
}

static const mhe_cost_ops loop_ops = {.size = sizeof loop_ops,
                                      .layout = loop_layout,
                                      .residual = loop_residual,
                                      .jacobian = loop_jacobian};

static const mhe_plugin loop_plugin = {.size = sizeof loop_plugin,
                                       .id = "loops of the model",
                                       .version = "0.2.0",
                                       .summary = "Keeps the loops of a model closed.",
                                       .iface = MHE_COST_IFACE,
                                       .ops = &loop_ops};

const mhi_term_setup mhi_loop_terms[MHI_LOOP_TERMS] = {
    {.plugin = &loop_plugin, .config = "loop_gap", .weight = 1, .sigma = GAP_SIGMA},
    {.plugin = &loop_plugin, .config = "loop_rate", .weight = 1, .sigma = RATE_SIGMA}};

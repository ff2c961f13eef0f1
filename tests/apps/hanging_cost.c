/* SPDX-License-Identifier: Apache-2.0 */
/* hanging_cost.c: a cost whose evaluation never comes back. */
#include <mhe/cost.h>
#include <unistd.h>

static mhe_status layout(const void *self, const mhe_problem *problem, mhe_cost_layout *out,
                         mhe_error *err) {
    (void)self;
    out->signal = problem->find_signal(problem, "activation", &out->n_res, &out->res_unit);
    return out->signal < 0 ? mhe_fail(err, MHE_E_CONFIG, "no activations") : MHE_OK;
}

static mhe_status residual(const void *self, const mhe_stage *stage, double *r, mhe_error *err) {
    (void)self, (void)r, (void)err;
    while (stage != NULL) {
        (void)pause();
    }
    return MHE_OK;
}

static const mhe_cost_ops ops = {.size = sizeof ops, .layout = layout, .residual = residual};

static const mhe_plugin plugin = {.size = sizeof plugin,
                                  .id = "test.cost.hanging",
                                  .version = "1.0.0",
                                  .summary = "Never answers.",
                                  .iface = MHE_COST_IFACE,
                                  .ops = &ops};

MHE_PLUGIN_LIBRARY(&plugin)

/* SPDX-License-Identifier: Apache-2.0 */
/* plugin.c: the descriptor and options of mhe.integrator.sundials. */
#include "flow.h"

static const mhe_option flow_options[] = {
    MHE_OPT_ENUM(
        struct flow_config, method, "bdf", "bdf|adams",
        "Backward differentiation formulas, or Adams-Moulton for systems that are not stiff."),
    MHE_OPT_REAL(struct flow_config, rtol, 1e-9, 1e-14, 1e-2, "1", "Relative tolerance."),
    MHE_OPT_REAL(struct flow_config, atol, 1e-10, 1e-16, 1e-2, "1",
                 "Absolute tolerance of states and sensitivities, in their units."),
    MHE_OPT_INT(struct flow_config, max_steps, 20000, 1, 1e9, "1",
                "Steps inside one interval before it is given up."),
};

static const mhe_plugin flow_plugin = {
    .size = sizeof flow_plugin,
    .id = "mhe.integrator.sundials",
    .version = "0.1.0",
    .summary =
        "CVODES with forward sensitivities from exact Jacobians: the reference for the other "
        "integrators.",
    .reference = "doi:10.1145/1089014.1089020",
    .iface = MHE_INTEGRATOR_IFACE,
    .ops = &flow_ops,
    MHE_PLUGIN_OPTIONS(struct flow_config, flow_options)};

MHE_PLUGIN_LIBRARY(&flow_plugin)

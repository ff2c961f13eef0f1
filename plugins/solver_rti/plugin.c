/* SPDX-License-Identifier: Apache-2.0 */
/* solver_rti: the stage problem by Gauss-Newton sequential quadratic programming; each quadratic
 * program by an interior-point method on a Riccati recursion.
 *
 * Real-time iteration: Diehl, Bock and Schloeder (2005), doi:10.1137/S0363012902400713. Recursion:
 * Rao, Wright and Rawlings (1998), doi:10.1023/A:1021711402723; Frison and Diehl (2020),
 * doi:10.1016/j.ifacol.2020.12.073.
 *
 * Where things go wrong. A point without a value (MHE_RETRY, or anything not finite) shortens the
 * step; at the start of a solve it ends it: failed, the iterate as it came. Bounds that the
 * linearised dynamics cannot meet: the program finds the step that violates them least, the
 * iterate is cut to the bounds, and `robust` goes on as long as the gaps x_{k+1} - F_k shrink; then
 * infeasible. A Newton system that is not positive definite is solved with a larger proximal term.
 * `robust` answers a step that does not help with Levenberg's term, ever larger; when nothing
 * helps: failed, with the last good iterate. A negative status of evaluate() ends the solve with
 * it. */
#include "rti.h"

static const mhe_option rti_options[] = {
    MHE_OPT_ENUM(struct rti_config, preset, "balanced", "speed|balanced|robust",
                 "speed: one iteration a window, balanced: up to three, both with full steps; "
                 "robust: to the tolerance with a step that must help."),
    MHE_OPT_REAL(struct rti_config, tolerance, 1e-4, 1e-12, 1, "1",
                 "Largest scaled violation of the optimality conditions of a converged solve."),
    MHE_OPT_INT(struct rti_config, max_iterations, 50, 1, 100000, "1",
                "Iterations after which a solve stops with what it has, in every preset."),
    MHE_OPT_INT(struct rti_config, max_qp_iterations, 60, 1, 10000, "1",
                "Interior-point iterations of one quadratic program."),
    MHE_OPT_REAL(struct rti_config, regularisation, 0, 0, 1e6, "1",
                 "Weight of |step|^2 / 2 in every quadratic program, beside control curvatures "
                 "that are scaled to 1; robust adds its own where steps fail."),
    MHE_OPT_REAL(struct rti_config, objective_scale, 0, 0, 1e12, "1",
                 "Factor on the objective; 0: makes the mean curvature of the controls 1 at the "
                 "first start."),
    MHE_OPT_REAL(struct rti_config, settled, 0.05, 1e-12, 1e12, "1",
                 "speed, balanced: largest last change of the first control and the second state "
                 "(rad, rad/s, 1) of a converged window; torques beside activations count in "
                 "proportion to their sigmas."),
    MHE_OPT_REAL(struct rti_config, spin, 50e-6, 0, 1, "s",
                 "How long threads look for work before they sleep."),
};

static const mhe_solver_ops rti_ops = {.size = sizeof rti_ops,
                                       .create = rti_create,
                                       .destroy = rti_destroy,
                                       .solve = rti_solve,
                                       .prepare = rti_prepare,
                                       .accepts = rti_accepts,
                                       .covariance = rti_covariance};

static const mhe_plugin rti_plugin = {
    .size = sizeof rti_plugin,
    .id = "mhe.solver.rti",
    .version = "0.1.0",
    .summary = "Gauss-Newton SQP with real-time iterations; quadratic programs by a Riccati "
               "recursion.",
    .reference = "doi:10.1137/S0363012902400713",
    .iface = MHE_SOLVER_IFACE,
    .ops = &rti_ops,
    MHE_PLUGIN_OPTIONS(struct rti_config, rti_options)};

MHE_PLUGIN_LIBRARY(&rti_plugin)

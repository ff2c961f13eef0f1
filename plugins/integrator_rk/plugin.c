/* SPDX-License-Identifier: Apache-2.0 */
/* plugin.c: the descriptor and options of mhe.integrator.rk. */
#include "rk.h"

static const mhe_option rk_options[] = {
    MHE_OPT_ENUM(struct rk_config, scheme, "auto", "auto|gauss|radau|rk4",
                 "Gauss-Legendre or Radau IIA collocation (implicit), or the classical explicit "
                 "scheme; auto: radau where muscles have states beside their activation (elastic "
                 "tendons), else gauss."),
    MHE_OPT_INT(struct rk_config, stages, 0, 0, RK_MAX_STAGES, "1",
                "Stages: order twice that with gauss, one less with radau; 0: 2 of gauss, 3 of "
                "radau."),
    MHE_OPT_REAL(struct rk_config, max_step, 0, 0, 10, "s",
                 "An interval is cut into equal steps no longer than this, at least 1e-6; 0: "
                 "0.03 with gauss, else 0.0025."),
    MHE_OPT_REAL(struct rk_config, newton_tolerance, 1e-10, 1e-14, 1e-3, "1",
                 "Error left in the stage velocities, relative to 1 + |qdot|."),
    MHE_OPT_INT(struct rk_config, max_newton, 20, 1, 1000, "1",
                "Newton iterations before a step is halved."),
    MHE_OPT_REAL(struct rk_config, activation_step, 0, 0, 10, "1",
                 "Longest step of the activations, in their shortest time constant where it "
                 "starts, at least 0.01; 0: 3.4 with gauss, else 1.7."),
    MHE_OPT_REAL(struct rk_config, tolerance, 0, 0, 1e-2, "1",
                 "A Gauss step that may err by more, in units of max(1, |qdot|), at a kink or a "
                 "jump of the forces is halved; 0: never."),
};

static const mhe_plugin rk_plugin = {
    .size = sizeof rk_plugin,
    .id = "mhe.integrator.rk",
    .version = "0.1.0",
    .summary =
        "Gauss-Legendre, Radau IIA or explicit Runge-Kutta steps with the exact derivatives of the "
        "discrete map.",
    .reference =
        "Hairer, Wanner: Solving Ordinary Differential Equations II, chapters IV.5 and IV.8",
    .iface = MHE_INTEGRATOR_IFACE,
    .ops = &rk_ops,
    MHE_PLUGIN_OPTIONS(struct rk_config, rk_options)};

MHE_PLUGIN_LIBRARY(&rk_plugin)

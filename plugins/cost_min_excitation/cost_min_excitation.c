/* SPDX-License-Identifier: Apache-2.0 */
/* cost_min_excitation: markers are tracked with the least muscle control; EMG is not used.
 *
 * Source: the "minimise" cost of Bailly et al. (2021), Front. Bioeng. Biotechnol. 9:642742. */
#include "../weighted_terms.h"

struct min_excitation { /* weights */
    double markers, excitation, q, qdot, activation, residual_torque, actuator;
};

static const mhe_option min_excitation_options[] = {
    MHE_OPT_REAL(struct min_excitation, markers, 1e7, 0, 1e15, "1/m^2",
                 "Weight on the distance between estimated and measured markers."),
    MHE_OPT_REAL(struct min_excitation, excitation, 1e4, 0, 1e15, "1",
                 "Weight on muscle controls (activation-driven: on activations)."),
    MHE_OPT_REAL(struct min_excitation, q, 1, 0, 1e15, "1/rad^2", "Weight on joint positions."),
    MHE_OPT_REAL(struct min_excitation, qdot, 10, 0, 1e15, "s^2/rad^2",
                 "Weight on joint velocities."),
    MHE_OPT_REAL(struct min_excitation, activation, 1, 0, 1e15, "1",
                 "Weight on activations; excitation-driven only."),
    MHE_OPT_REAL(struct min_excitation, residual_torque, 1e7, 0, 1e15, "1/(N m)^2",
                 "Weight on residual torques, where the problem has them."),
    MHE_OPT_REAL(struct min_excitation, actuator, 1e4, 0, 1e15, "1",
                 "Weight on controls of the model's actuators, where bounds.actuators has them."),
};

static mhe_status min_excitation_create(const mhe_host *host, const mhe_problem *problem,
                                        const void *config, void **self, mhe_error *err) {
    const struct min_excitation *c = config;
    (void)host;
    int by_excitation = problem->formulation == MHE_FORMULATION_EXCITATION;
    const weighted_term terms[] = {
        {.signal = "markers", .weight = c->markers, .tracks = 1},
        {.signal = by_excitation ? "excitation" : "activation", .weight = c->excitation},
        {.signal = "q", .weight = c->q},
        {.signal = "qdot", .weight = c->qdot},
        {.signal = "activation", .weight = by_excitation ? c->activation : 0},
        {.signal = "residual_torque", .weight = c->residual_torque, .optional = 1},
        {.signal = "actuator", .weight = c->actuator, .optional = 1},
    };
    return weighted_terms_create(problem, terms, sizeof terms / sizeof terms[0], self, err);
}

static const mhe_cost_ops min_excitation_ops = {.size = sizeof min_excitation_ops,
                                                .create = min_excitation_create,
                                                .destroy = weighted_terms_destroy,
                                                .layout = weighted_terms_layout,
                                                .residual = weighted_terms_residual,
                                                .jacobian = weighted_terms_jacobian};

static const mhe_plugin min_excitation_plugin = {
    .size = sizeof min_excitation_plugin,
    .id = "mhe.cost.min-excitation",
    .version = "0.1.0",
    .summary = "Tracks markers with the least muscle excitation.",
    .reference = "doi:10.3389/fbioe.2021.642742",
    .iface = MHE_COST_IFACE,
    .ops = &min_excitation_ops,
    MHE_PLUGIN_OPTIONS(struct min_excitation, min_excitation_options)};

MHE_PLUGIN_LIBRARY(&min_excitation_plugin)

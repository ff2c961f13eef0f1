/* SPDX-License-Identifier: Apache-2.0 */
/* cost_emg_markers: markers and EMG are tracked, everything else is held small.
 *
 * Source: Bailly et al. (2021), Front. Bioeng. Biotechnol. 9:642742. The paper's high and low
 * marker weight are two plugins of this one source: MARKER_LEVEL is "high" or "low", MARKER_WEIGHT
 * 1e9 or 1e7. */
#include "../weighted_terms.h"

struct emg_markers { /* weights, and the muscles that have EMG */
    double markers, emg, q, qdot, activation, residual_torque, actuator;
    mhe_text_list tracked;
    double untracked;
};

static const mhe_option emg_markers_options[] = {
    MHE_OPT_REAL(struct emg_markers, markers, MARKER_WEIGHT, 0, 1e15, "1/m^2",
                 "Weight on the distance between estimated and measured markers."),
    MHE_OPT_REAL(struct emg_markers, emg, 1e6, 0, 1e15, "1",
                 "Weight on the difference between muscle controls and EMG."),
    MHE_OPT_REAL(struct emg_markers, q, 1, 0, 1e15, "1/rad^2", "Weight on joint positions."),
    MHE_OPT_REAL(struct emg_markers, qdot, 10, 0, 1e15, "s^2/rad^2", "Weight on joint velocities."),
    MHE_OPT_REAL(struct emg_markers, activation, 1, 0, 1e15, "1",
                 "Weight on activations; excitation-driven only."),
    MHE_OPT_REAL(struct emg_markers, residual_torque, 1e8, 0, 1e15, "1/(N m)^2",
                 "Weight on residual torques, where the problem has them."),
    MHE_OPT_REAL(struct emg_markers, actuator, 1e4, 0, 1e15, "1",
                 "Weight on controls of the model's actuators, where bounds.actuators has them."),
    MHE_OPT_TEXTS(struct emg_markers, tracked, 0, "Muscles with EMG; empty: all."),
    MHE_OPT_REAL(struct emg_markers, untracked, 1e4, 0, 1e15, "1",
                 "Weight on all muscle controls towards 0 when some muscles have no EMG; else on "
                 "a control while its EMG is missing."),
};

static mhe_status emg_markers_create(const mhe_host *host, const mhe_problem *problem,
                                     const void *config, void **self, mhe_error *err) {
    const struct emg_markers *c = config;
    (void)host;
    uint8_t *has_emg = calloc((size_t)problem->n_muscles + 1, 1);
    if (has_emg == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory for %d muscles", (int)problem->n_muscles);
    }
    int by_excitation = problem->formulation == MHE_FORMULATION_EXCITATION;
    const char *control = by_excitation ? "excitation" : "activation";
    mhe_status status = mhe_choose_entries(problem, control, "tracked", &c->tracked, has_emg, err);
    int partial = 0;
    for (int32_t i = 0; i < problem->n_muscles; i++) {
        partial |= !has_emg[i];
    }
    const weighted_term terms[] = {
        {.signal = "markers", .weight = c->markers, .tracks = 1},
        {.signal = control,
         .weight = c->emg,
         .tracks = 1,
         .missing = partial ? 0 : c->untracked,
         .selected = partial ? has_emg : NULL},
        {.signal = control, .weight = partial ? c->untracked : 0},
        {.signal = "q", .weight = c->q},
        {.signal = "qdot", .weight = c->qdot},
        {.signal = "activation", .weight = by_excitation ? c->activation : 0},
        {.signal = "residual_torque", .weight = c->residual_torque, .optional = 1},
        {.signal = "actuator", .weight = c->actuator, .optional = 1},
    };
    if (status == MHE_OK) {
        status = weighted_terms_create(problem, terms, sizeof terms / sizeof terms[0], self, err);
    }
    free(has_emg);
    return status;
}

static const mhe_cost_ops emg_markers_ops = {.size = sizeof emg_markers_ops,
                                             .create = emg_markers_create,
                                             .destroy = weighted_terms_destroy,
                                             .layout = weighted_terms_layout,
                                             .residual = weighted_terms_residual,
                                             .jacobian = weighted_terms_jacobian};

static const mhe_plugin emg_markers_plugin = {
    .size = sizeof emg_markers_plugin,
    .id = "mhe.cost.emg-markers-" MARKER_LEVEL,
    .version = "0.1.0",
    .summary = "Tracks markers (" MARKER_LEVEL " weight) and EMG.",
    .reference = "doi:10.3389/fbioe.2021.642742",
    .iface = MHE_COST_IFACE,
    .ops = &emg_markers_ops,
    MHE_PLUGIN_OPTIONS(struct emg_markers, emg_markers_options)};

MHE_PLUGIN_LIBRARY(&emg_markers_plugin)

/* SPDX-License-Identifier: Apache-2.0 */
/* plugin.c: tables of mhe.model.simbody. */
#include "model.h"

static const mhe_option simbody_options[] = {
    MHE_OPT_ENUM(struct simbody_config, dynamics, "recursive", "recursive|simbody",
                 "Who computes poses, mass matrix and torques: the plugin's own recursion (faster, "
                 "its poses compared with Simbody's at load) or Simbody; derivatives are the "
                 "recursion's."),
    MHE_OPT_ENUM(struct simbody_config, paths, "exact", "exact|fitted",
                 "Lengths of paths: exact, or polynomials fitted over the coordinates' ranges "
                 "(kept in the user's cache folder); a path that misses the tolerance stays "
                 "exact."),
    MHE_OPT_REAL(struct simbody_config, paths_tolerance, 5e-4, 1e-6, 0.1, "m",
                 "RMS error allowed in fitted lengths; twice that (per radian) in moment arms."),
    MHE_OPT_REAL(struct simbody_config, paths_range, 1.0, 0.01, 1.0, "1",
                 "Share of each coordinate's range, about its default, that paths are fitted over "
                 "where no motion is known (model.motion, data.angles: then its range and a fifth "
                 "more on both sides); beyond it they are exact."),
};

static const mhe_model_ops simbody_ops = {
    .size = sizeof simbody_ops,
    .create = simbody_create,
    .destroy = simbody_destroy,
    .context_create = simbody_context_create,
    .context_destroy = simbody_context_destroy,
    .kinematics = simbody_kinematics,
    .inverse_dynamics = simbody_inverse_dynamics,
    .forward_dynamics = simbody_forward_dynamics,
    .loads = simbody_loads,
    .path_pattern = simbody_path_pattern,
    .path_points = simbody_path_points,
    .loops = simbody_loops,
};

static const mhe_plugin simbody_plugin = {
    .size = sizeof simbody_plugin,
    .flags = MHE_FLAG_HOT_ALLOCATES,
    .id = "mhe.model.simbody",
    .version = "0.1.0",
    .summary = "Trees of rigid bodies by Simbody, with exact derivatives of dynamics and paths.",
    .reference = "Sherman, Seth & Delp 2011, doi 10.1016/j.piutam.2011.04.023; derivatives: "
                 "Carpentier & Mansard 2018, doi 10.15607/RSS.2018.XIV.038",
    .iface = MHE_MODEL_IFACE,
    .ops = &simbody_ops,
    MHE_PLUGIN_OPTIONS(struct simbody_config, simbody_options)};

MHE_PLUGIN_LIBRARY(&simbody_plugin)

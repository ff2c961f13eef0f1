/* SPDX-License-Identifier: Apache-2.0 */
/* plugin.c: the descriptor and options of mhe.muscle.hill. */
#include "hill.h"

static const mhe_option hill_options[] = {
    MHE_OPT_ENUM(struct hill_config, curves, "auto", HILL_CURVE_CHOICES,
                 "Curve set; auto: thelen2003 and millard2012 where the file states these muscles, "
                 "file where their curves stand in it (Schutte 1993), else degroote2016."),
    MHE_OPT_REAL(struct hill_config, tau_act, 0, 0, 10, "s",
                 "Activation time constant; 0: the file's, else 0.010."),
    MHE_OPT_REAL(struct hill_config, tau_deact, 0, 0, 10, "s",
                 "Deactivation time constant; 0: the file's, else 0.040."),
    MHE_OPT_REAL(struct hill_config, activation_smoothing, 0.1, 1e-3, 1e3, "1",
                 "Steepness b of the switch between activation and deactivation."),
    MHE_OPT_REAL(struct hill_config, damping, -1, -1, 10, "1",
                 "Fibre damping in maximal isometric forces at vmax, published sets only; below 0: "
                 "the file's, else 0, with millard2012 or an elastic tendon 0.1."),
    MHE_OPT_REAL(struct hill_config, vmax, 0, 0, 1e3, "1/s",
                 "Maximal contraction velocity in optimal lengths per second, published sets only; "
                 "0: the file's, else 10."),
    MHE_OPT_REAL(struct hill_config, passive, 1, 0, 10, "1",
                 "Factor of the passive fibre force; below 1 where straight paths or scaling "
                 "stretch muscles beyond what is real, 0: none."),
    MHE_OPT_REAL(struct hill_config, passive_ramp, 0, 0, 0.5, "1",
                 "Optimal lengths before the onset of paper2021's passive force over which it "
                 "rises smoothly; 0: the jump as it was."),
    MHE_OPT_ENUM(struct hill_config, tendon, "rigid", "rigid|elastic|file",
                 "Tendons; elastic ones make the fibre length a state, published sets only; file: "
                 "elastic but where the model file says to ignore tendon compliance."),
};

static const mhe_plugin hill_plugin = {
    .size = sizeof hill_plugin,
    .id = "mhe.muscle.hill",
    .version = "0.1.0",
    .summary = "Hill muscles with rigid or elastic tendons on one of five curve sets, with the "
               "smooth activation dynamics of De Groote et al. (2016).",
    .reference = "doi:10.1007/s10439-016-1591-9",
    .iface = MHE_MUSCLE_IFACE,
    .ops = &hill_ops,
    MHE_PLUGIN_OPTIONS(struct hill_config, hill_options)};

MHE_PLUGIN_LIBRARY(&hill_plugin)

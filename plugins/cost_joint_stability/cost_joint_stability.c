/* SPDX-License-Identifier: Apache-2.0 */
/* cost_joint_stability: the force in a joint stays within the cone that its socket can hold.
 *
 * R, the joint's force on the body that it carries, has a share c along the axis that points out of
 * the socket and a rest t across it. With e = smooth and s = sin(angle), k = cos(angle)
 *
 *     g = k (sqrt(|t|^2 + e^2) - e) - s c        how far outside the cone R is, N
 *     r = 0 where g <= 0;  g^2 / (2 e) up to g = e;  then g - e / 2
 *
 * One residual, 0 with its derivative inside the cone, growing as the distance to it outside. */
#include <mhe/cost.h>

#include <math.h>

#define AXES 3

struct stability_config {
    const char *joint;
    mhe_real_list axis;
    double angle, smooth;
};

static const mhe_option stability_options[] = {
    MHE_OPT_TEXT(struct stability_config, joint, MHE_OPT_REQUIRED, NULL,
                 "The joint, by its name or that of the body it carries."),
    MHE_OPT_REALS(struct stability_config, axis, MHE_OPT_REQUIRED, -1e3, 1e3, "1",
                  "Direction out of the socket's middle, x, y, z in the body that the joint sits "
                  "on; of any length."),
    MHE_OPT_REAL(struct stability_config, angle, 0.5235987755982988, 0.01, 1.5, "rad",
                 "Half angle of the cone; 30 degrees: tangential forces up to 0.58 of the "
                 "compression."),
    MHE_OPT_REAL(struct stability_config, smooth, 5.0, 1e-3, 1e3, "N",
                 "Over which force the cone's edge and its tip are rounded."),
};

/* Unit vector; 0: there is none. */
static int32_t axis_of(const struct stability_config *c, double n[AXES]) {
    double size = 0;
    for (int32_t i = 0; i < AXES; i++) {
        size += c->axis.values[i] * c->axis.values[i];
    }
    for (int32_t i = 0; i < AXES && size > 0; i++) {
        n[i] = c->axis.values[i] / sqrt(size);
    }
    return size > 0;
}

static mhe_status stability_layout(const void *self, const mhe_problem *problem,
                                   mhe_cost_layout *out, mhe_error *err) {
    const struct stability_config *c = self;
    char name[256];
    double n[AXES];
    int32_t n_y = 0;
    if (c->axis.n != AXES || !axis_of(c, n)) {
        return mhe_fail(err, MHE_E_CONFIG,
                        "axis: three numbers that are not all 0, as [0, 0, 1] (there are %d)",
                        (int)c->axis.n);
    }
    (void)snprintf(name, sizeof name, "joint_reaction/%s", c->joint);
    out->signal = problem->find_signal(problem, name, &n_y, NULL);
    if (out->signal < 0 || n_y != AXES) {
        return mhe_fail(err, MHE_E_CONFIG, "joint: the problem has no signal '%s'", name);
    }
    out->n_res = 1;
    out->jacobian = MHE_JACOBIAN_DENSE;
    out->res_unit = "N";
    return MHE_OK;
}

/* g and its derivative by R (NULL: not wanted). */
static double outside(const struct stability_config *c, const double *R, double *g_R) {
    double n[AXES], along = 0, across = 0;
    (void)axis_of(c, n);
    for (int32_t i = 0; i < AXES; i++) {
        along += n[i] * R[i];
    }
    for (int32_t i = 0; i < AXES; i++) {
        const double t = R[i] - along * n[i];
        across += t * t;
    }
    const double k = cos(c->angle), s = sin(c->angle);
    const double size = sqrt(across + c->smooth * c->smooth);
    for (int32_t i = 0; i < AXES && g_R != NULL; i++) {
        g_R[i] = k * (R[i] - along * n[i]) / size - s * n[i];
    }
    return k * (size - c->smooth) - s * along;
}

static mhe_status stability_residual(const void *self, const mhe_stage *stage, double *r,
                                     mhe_error *err) {
    const struct stability_config *c = self;
    const double g = outside(c, stage->y, NULL), e = c->smooth;
    (void)err;
    r[0] = g <= 0 ? 0 : g < e ? g * g / (2 * e) : g - e / 2; /* NaN of the last node goes through */
    return MHE_OK;
}

static mhe_status stability_jacobian(const void *self, const mhe_stage *stage, double *J,
                                     mhe_error *err) {
    const struct stability_config *c = self;
    double g_R[AXES];
    const double g = outside(c, stage->y, g_R), e = c->smooth;
    const double slope = g <= 0 ? 0 : g < e ? g / e : 1;
    (void)err;
    for (int32_t i = 0; i < AXES; i++) {
        J[i] = slope * g_R[i];
    }
    return MHE_OK;
}

static const mhe_cost_ops stability_ops = {.size = sizeof stability_ops,
                                           .layout = stability_layout,
                                           .residual = stability_residual,
                                           .jacobian = stability_jacobian};

static const mhe_plugin stability_plugin = {
    .size = sizeof stability_plugin,
    .id = "mhe.cost.joint-stability",
    .version = "0.2.0",
    .summary = "Keeps the force in a joint within the cone that its socket can hold.",
    .reference = "doi:10.1016/S1058-2746(09)80134-1",
    .iface = MHE_COST_IFACE,
    .ops = &stability_ops,
    MHE_PLUGIN_OPTIONS(struct stability_config, stability_options)};

MHE_PLUGIN_LIBRARY(&stability_plugin)

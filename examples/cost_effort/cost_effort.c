/* SPDX-License-Identifier: Apache-2.0 */
/* cost_effort: penalises activation above a resting level; one residual per muscle. */
#include <mhe/cost.h>

struct effort { /* filled and range-checked by the core before layout() */
    double rest;
    const char *signal;
};

static const mhe_option effort_options[] = {
    MHE_OPT_REAL(struct effort, rest, 0.0, 0.0, 1.0, "1", "Activation that costs nothing."),
    MHE_OPT_TEXT(struct effort, signal, 0, "activation", "Signal to penalise."),
};

static mhe_status effort_layout(const void *self, const mhe_problem *problem, mhe_cost_layout *out,
                                mhe_error *err) {
    const struct effort *c = self;
    out->signal = problem->find_signal(problem, c->signal, &out->n_res, &out->res_unit);
    if (out->signal < 0) {
        return mhe_fail(err, MHE_E_CONFIG, "the model has no signal '%s'", c->signal);
    }
    out->jacobian = MHE_JACOBIAN_DIAGONAL;
    return MHE_OK;
}

static mhe_status effort_residual(const void *self, const mhe_stage *s, double *r, mhe_error *err) {
    const struct effort *c = self;
    (void)err;
    for (int32_t i = 0; i < s->ny; i++) {
        r[i] = s->y[i] - c->rest;
    }
    return MHE_OK;
}

static mhe_status effort_jacobian(const void *self, const mhe_stage *s, double *J, mhe_error *err) {
    (void)self, (void)err;
    for (int32_t i = 0; i < s->ny; i++) {
        J[i] = 1.0; /* dr/dy, of which only the diagonal is kept */
    }
    return MHE_OK;
}

static const mhe_cost_ops effort_ops = {.size = sizeof effort_ops,
                                        .layout = effort_layout,
                                        .residual = effort_residual,
                                        .jacobian = effort_jacobian};

static const mhe_plugin effort_plugin = {.size = sizeof effort_plugin,
                                         .id = "org.example.cost.effort",
                                         .version = "1.0.0",
                                         .summary = "Penalises muscle activation above rest.",
                                         .iface = MHE_COST_IFACE,
                                         .ops = &effort_ops,
                                         MHE_PLUGIN_OPTIONS(struct effort, effort_options)};

MHE_PLUGIN_LIBRARY(&effort_plugin)

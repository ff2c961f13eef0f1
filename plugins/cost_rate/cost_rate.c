/* SPDX-License-Identifier: Apache-2.0 */
/* cost_rate: a signal that changes slowly: r_i = (y_i - y_i of the node before) / interval.
 *
 * The finite difference over one interval: with joint_moment or muscle_force a bound on how fast
 * torques and forces build up, with qdot one on accelerations. At the first node of a run, and at
 * the last one of a signal that controls make, there is nothing to compare with; these rows drop
 * out. */
#include <mhe/cost.h>

#include <stdlib.h>

struct rate_config {
    const char *signal;
    mhe_text_list of;
};

static const mhe_option rate_options[] = {
    MHE_OPT_TEXT(struct rate_config, signal, 0, "joint_moment", "Signal that is to change slowly."),
    MHE_OPT_TEXTS(struct rate_config, of, 0,
                  "Muscles, coordinates or markers that count; empty: all."),
};

struct rate {
    const mhe_problem *problem; /* its interval is known after the first frames only */
    int32_t signal, n;          /* of the signal, of its entries that count */
    int32_t *entry;             /* [n] these */
    char unit[32];
};

static void rate_destroy(void *self) {
    struct rate *t = self;
    if (t != NULL) {
        free(t->entry);
        free(t);
    }
}

/* Numbers of the entries that count. */
static mhe_status rate_select(struct rate *t, const struct rate_config *c, int32_t n,
                              mhe_error *err) {
    uint8_t *chosen = calloc((size_t)n + 1, 1);
    t->entry = calloc((size_t)n + 1, sizeof *t->entry);
    mhe_status status = chosen == NULL || t->entry == NULL
                            ? mhe_fail(err, MHE_E_MEMORY, "no memory for %d residuals", (int)n)
                            : mhe_choose_entries(t->problem, c->signal, "of", &c->of, chosen, err);
    for (int32_t i = 0; i < n && status == MHE_OK; i++) {
        if (chosen[i]) {
            t->entry[t->n++] = i;
        }
    }
    free(chosen);
    return status;
}

static mhe_status rate_create(const mhe_host *host, const mhe_problem *problem, const void *config,
                              void **self, mhe_error *err) {
    const struct rate_config *c = config;
    (void)host;
    int32_t n = 0;
    const char *unit = NULL;
    const int32_t signal = problem->find_signal(problem, c->signal, &n, &unit);
    if (signal < 0) {
        return mhe_fail(err, MHE_E_CONFIG, "the problem has no signal '%s'", c->signal);
    }
    struct rate *t = calloc(1, sizeof *t);
    if (t == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory for %d residuals", (int)n);
    }
    t->problem = problem;
    t->signal = signal;
    (void)snprintf(t->unit, sizeof t->unit, "%s/s", unit);
    const mhe_status status = rate_select(t, c, n, err);
    if (status != MHE_OK) {
        rate_destroy(t);
        return status;
    }
    *self = t;
    return MHE_OK;
}

static mhe_status rate_layout(const void *self, const mhe_problem *problem, mhe_cost_layout *out,
                              mhe_error *err) {
    const struct rate *t = self;
    (void)problem, (void)err;
    out->n_signals = 2; /* y: the signal here, and at the node before */
    out->signals[0] = out->signals[1] = t->signal;
    out->at[1] = MHE_AT_PREVIOUS;
    out->n_res = t->n;
    out->jacobian = MHE_JACOBIAN_DENSE;
    out->res_unit = t->unit;
    return MHE_OK;
}

static mhe_status rate_residual(const void *self, const mhe_stage *stage, double *r,
                                mhe_error *err) {
    const struct rate *t = self;
    const double *before = stage->y + stage->ny / 2;
    (void)err;
    for (int32_t k = 0; k < t->n; k++) { /* NaN of a node that has none before goes through */
        const int32_t i = t->entry[k];
        r[k] = (stage->y[i] - before[i]) / t->problem->interval;
    }
    return MHE_OK;
}

static mhe_status rate_jacobian(const void *self, const mhe_stage *stage, double *J,
                                mhe_error *err) {
    const struct rate *t = self;
    const int32_t n = stage->ny / 2;
    (void)err;
    for (int32_t k = 0; k < t->n; k++) {
        J[k * stage->ny + t->entry[k]] = 1 / t->problem->interval;
        J[k * stage->ny + n + t->entry[k]] = -1 / t->problem->interval;
    }
    return MHE_OK;
}

static const mhe_cost_ops rate_ops = {.size = sizeof rate_ops,
                                      .create = rate_create,
                                      .destroy = rate_destroy,
                                      .layout = rate_layout,
                                      .residual = rate_residual,
                                      .jacobian = rate_jacobian};

static const mhe_plugin rate_plugin = {.size = sizeof rate_plugin,
                                       .id = "mhe.cost.rate",
                                       .version = "0.2.0",
                                       .summary = "Keeps a signal from changing fast.",
                                       .iface = MHE_COST_IFACE,
                                       .ops = &rate_ops,
                                       MHE_PLUGIN_OPTIONS(struct rate_config, rate_options)};

MHE_PLUGIN_LIBRARY(&rate_plugin)

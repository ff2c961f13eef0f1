/* SPDX-License-Identifier: Apache-2.0 */
/* cost_track: one signal close to its target or to a constant: r_i = y_i - y_ref_i.
 *
 * The quadratic cost of optimal control: running where `nodes` is running, terminal where it is
 * last. */
#include <mhe/cost.h>

#include <stdlib.h>

enum { TRACK_ALL, TRACK_RUNNING, TRACK_LAST, TRACK_FIRST };

struct track_config {
    const char *signal;
    mhe_text_list of;
    mhe_real_list value;
    int32_t nodes; /* TRACK_* */
};

static const mhe_option track_options[] = {
    MHE_OPT_TEXT(struct track_config, signal, 0, "activation", "Signal that this cost is about."),
    MHE_OPT_TEXTS(struct track_config, of, 0,
                  "Muscles, coordinates or markers that count; empty: all."),
    MHE_OPT_REALS(
        struct track_config, value, 0, -1e9, 1e9, "of the signal",
        "Where to: one value for all entries or one an entry; none: the problem's target."),
    MHE_OPT_ENUM(struct track_config, nodes, "all", "all|running|last|first",
                 "Nodes that count; running: all but the last; first: where a window begins."),
};

struct track {
    int32_t signal, n, nodes;
    int32_t follows; /* 1: the problem's target; 0: value */
    const char *unit;
    double *value;   /* [n] */
    uint8_t *counts; /* [n] 1 or 0 */
};

static mhe_status track_values(struct track *t, const struct track_config *c, mhe_error *err) {
    t->follows = c->value.n == 0;
    if (c->value.n > 1 && c->value.n != t->n) {
        return mhe_fail(err, MHE_E_CONFIG, "value: %d values; '%s' has %d entries", (int)c->value.n,
                        c->signal, (int)t->n);
    }
    for (int32_t i = 0; i < t->n && !t->follows; i++) {
        t->value[i] = c->value.values[c->value.n == 1 ? 0 : i];
    }
    return MHE_OK;
}

static void track_destroy(void *self) {
    struct track *t = self;
    if (t != NULL) {
        free(t->value);
        free(t);
    }
}

static mhe_status track_create(const mhe_host *host, const mhe_problem *problem, const void *config,
                               void **self, mhe_error *err) {
    const struct track_config *c = config;
    (void)host;
    int32_t n = 0;
    const char *unit = NULL;
    const int32_t signal = problem->find_signal(problem, c->signal, &n, &unit);
    if (signal < 0) {
        return mhe_fail(err, MHE_E_CONFIG, "the problem has no signal '%s'", c->signal);
    }
    struct track *t = calloc(1, sizeof *t);
    if (t == NULL || (t->value = calloc((size_t)n, sizeof(double) + 1)) == NULL) {
        free(t);
        return mhe_fail(err, MHE_E_MEMORY, "no memory for %d residuals", (int)n);
    }
    t->signal = signal;
    t->n = n;
    t->nodes = c->nodes;
    t->unit = unit;
    t->counts = (uint8_t *)(t->value + n);
    mhe_status status = mhe_choose_entries(problem, c->signal, "of", &c->of, t->counts, err);
    if (status == MHE_OK) {
        status = track_values(t, c, err);
    }
    if (status != MHE_OK) {
        track_destroy(t);
        return status;
    }
    *self = t;
    return MHE_OK;
}

static mhe_status track_layout(const void *self, const mhe_problem *problem, mhe_cost_layout *out,
                               mhe_error *err) {
    const struct track *t = self;
    (void)problem, (void)err;
    out->n_signals = 1;
    out->signals[0] = t->signal;
    out->at[0] = t->nodes == TRACK_FIRST ? MHE_AT_FIRST : MHE_AT_NODE;
    out->n_res = t->n;
    out->jacobian = MHE_JACOBIAN_DIAGONAL;
    out->res_unit = t->unit;
    return MHE_OK;
}

static int32_t track_on(const struct track *t, const mhe_stage *stage) {
    const int32_t last = stage->node == stage->n_intervals;
    return t->nodes == TRACK_ALL || t->nodes == TRACK_FIRST /* y is NaN at other nodes */ ||
           (t->nodes == TRACK_LAST) == last;
}

static mhe_status track_residual(const void *self, const mhe_stage *stage, double *r,
                                 mhe_error *err) {
    const struct track *t = self;
    const int32_t on = track_on(t, stage);
    (void)err;
    for (int32_t i = 0; i < stage->ny; i++) { /* NaN of a missing sample goes through */
        const double reference = t->follows ? stage->y_ref[i] : t->value[i];
        r[i] = on && t->counts[i] != 0 ? stage->y[i] - reference : 0;
    }
    return MHE_OK;
}

static mhe_status track_jacobian(const void *self, const mhe_stage *stage, double *J,
                                 mhe_error *err) {
    const struct track *t = self;
    const int32_t on = track_on(t, stage);
    (void)err;
    for (int32_t i = 0; i < stage->ny; i++) { /* the diagonal */
        J[i] = on ? t->counts[i] : 0;
    }
    return MHE_OK;
}

static const mhe_cost_ops track_ops = {.size = sizeof track_ops,
                                       .create = track_create,
                                       .destroy = track_destroy,
                                       .layout = track_layout,
                                       .residual = track_residual,
                                       .jacobian = track_jacobian};

static const mhe_plugin track_plugin = {.size = sizeof track_plugin,
                                        .id = "mhe.cost.track",
                                        .version = "0.1.0",
                                        .summary = "Keeps one signal close to a target.",
                                        .iface = MHE_COST_IFACE,
                                        .ops = &track_ops,
                                        MHE_PLUGIN_OPTIONS(struct track_config, track_options)};

MHE_PLUGIN_LIBRARY(&track_plugin)

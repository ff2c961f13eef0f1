/* SPDX-License-Identifier: Apache-2.0 */
/* costs.c: cost plugins whose options alone matter. */
#include <mhe/cost.h>

struct config {
    double markers;
    const char *signal;
    mhe_text_list muscles;
    mhe_real_list rest;
    mhe_text_map extra;
    const char *table;
};

static const mhe_option options[] = {
    MHE_OPT_REAL(struct config, markers, 1e9, 0, 1e12, "1/m^2", "Weight of the markers."),
    MHE_OPT_TEXT(struct config, signal, 0, "activation", "Signal."),
    MHE_OPT_TEXTS(struct config, muscles, 0, "Muscles."),
    MHE_OPT_REALS(struct config, rest, 0, 0, 1, "1", "Activations at rest."),
    MHE_OPT_MAP(struct config, extra, 0, "Anything."),
    MHE_OPT_PATH(struct config, table, 0, "A file."),
};

/* A key of its own that every cost section already has. */
struct greedy {
    double weight;
};

static const mhe_option greedy_options[] = {
    MHE_OPT_REAL(struct greedy, weight, 1, 0, 10, "1", "Clashes."),
};

static mhe_status layout(const void *self, const mhe_problem *problem, mhe_cost_layout *out,
                         mhe_error *err) {
    (void)self, (void)problem, (void)out;
    return mhe_fail(err, MHE_E_UNSUPPORTED, "only its options are real");
}

static mhe_status residual(const void *self, const mhe_stage *stage, double *r, mhe_error *err) {
    (void)self, (void)stage, (void)r;
    return mhe_fail(err, MHE_E_UNSUPPORTED, "only its options are real");
}

static const mhe_cost_ops ops = {.size = sizeof ops, .layout = layout, .residual = residual};

static const mhe_plugin cost_a = {.size = sizeof cost_a,
                                  .id = "org.test.cost.a",
                                  .version = "1.0.0",
                                  .summary = "With options.",
                                  .iface = MHE_COST_IFACE,
                                  .ops = &ops,
                                  MHE_PLUGIN_OPTIONS(struct config, options)};

static const mhe_plugin cost_b = {.size = sizeof cost_b,
                                  .id = "org.test.cost.b",
                                  .version = "1.0.0",
                                  .summary = "Without options.",
                                  .iface = MHE_COST_IFACE,
                                  .ops = &ops};

static const mhe_plugin cost_greedy = {.size = sizeof cost_greedy,
                                       .id = "org.test.cost.greedy",
                                       .version = "1.0.0",
                                       .summary = "Takes a key that is not its own.",
                                       .iface = MHE_COST_IFACE,
                                       .ops = &ops,
                                       MHE_PLUGIN_OPTIONS(struct greedy, greedy_options)};

MHE_PLUGIN_LIBRARY(&cost_a, &cost_b, &cost_greedy)

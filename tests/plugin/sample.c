/* SPDX-License-Identifier: Apache-2.0 */
/* sample.c: two cost plugins whose tables hold a bit of everything; nothing ever calls them. */
#include <mhe/cost.h>
#include <string.h>

struct config {
    double gain, floor;
    int32_t count, flag, method;
    const char *signal, *file;
    mhe_real_list weights;
    mhe_text_list names;
    double old_gain;
};

static const mhe_option options[] = {
    MHE_OPT_REAL(struct config, gain, 0.5, 0.0, 1.0, "1", "Factor of every residual."),
    MHE_OPT_REAL(struct config, floor, 0.0, 0.0, 1.0 / 0.0, "N", "Forces below it do not count."),
    MHE_OPT_INT(struct config, count, 3, 1, 9, "1", "How often."),
    MHE_OPT_BOOL(struct config, flag, 1, "Whether at all; a|b."),
    MHE_OPT_ENUM(struct config, method, "gauss", "rk4|gauss|exponential", "How."),
    MHE_OPT_TEXT(struct config, signal, MHE_OPT_REQUIRED, NULL, "What."),
    MHE_OPT_PATH(struct config, file, MHE_OPT_ADVANCED, "Where from."),
    MHE_OPT_REALS(struct config, weights, 0, 0.0, 1.0, "1", "One weight a row."),
    MHE_OPT_TEXTS(struct config, names, 0, "Which."),
    {.key = "old_gain",
     .help = "Factor by its old name.",
     .unit = "1",
     .max = 1.0,
     .replaced_by = "gain",
     .type = MHE_TYPE_REAL,
     .flags = MHE_OPT_DEPRECATED,
     .offset = offsetof(struct config, old_gain)},
};

static mhe_status layout(const void *self, const mhe_problem *problem, mhe_cost_layout *out,
                         mhe_error *err) {
    (void)self, (void)problem, (void)out;
    return mhe_fail(err, MHE_E_UNSUPPORTED, "a sample");
}

static mhe_status residual(const void *self, const mhe_stage *stage, double *r, mhe_error *err) {
    (void)self, (void)stage, (void)r;
    return mhe_fail(err, MHE_E_UNSUPPORTED, "a sample");
}

static const void *extension(const char *id) {
    return strcmp(id, "mhe.cost.hessian/1") == 0 ? options : NULL;
}

static const mhe_cost_ops ops = {.size = sizeof ops, .layout = layout, .residual = residual};

static const mhe_plugin sample = {.size = sizeof sample,
                                  .id = "test.cost.sample",
                                  .version = PLUGIN_VERSION,
                                  .summary = "A sample of everything.",
                                  .reference = "doi:10.0000/none",
                                  .iface = MHE_COST_IFACE,
                                  .ops = &ops,
                                  MHE_PLUGIN_OPTIONS(struct config, options),
                                  .extension = extension};

/* As an older header would have compiled it: the descriptor ends before `extension`, the function
 * table before `jacobian`. What lies behind must not be read. */
static const mhe_cost_ops short_ops = {.size = offsetof(mhe_cost_ops, jacobian),
                                       .layout = layout,
                                       .residual = residual,
                                       .jacobian = residual};
static const mhe_plugin plain = {.size = offsetof(mhe_plugin, extension),
                                 .id = "test.cost.plain",
                                 .version = PLUGIN_VERSION,
                                 .summary = "No options.",
                                 .iface = MHE_COST_IFACE,
                                 .ops = &short_ops,
                                 .extension = extension};

MHE_PLUGIN_LIBRARY(&sample, &plain)

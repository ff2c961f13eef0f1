/* SPDX-License-Identifier: Apache-2.0 */
/* bad_plugin.c: a good cost plugin, or one with the fault that a BAD_... definition names. */
#include <mhe/cost.h>

struct config {
    double gain;
};

#ifdef BAD_DEFAULT_OUT_OF_RANGE
#define DEFAULT 2.0
#else
#define DEFAULT 0.5
#endif

static const mhe_option options[] = {
    MHE_OPT_REAL(struct config, gain, DEFAULT, 0.0, 1.0, "1", "Factor of every residual."),
#ifdef BAD_DUPLICATE_KEY
    MHE_OPT_REAL(struct config, gain, DEFAULT, 0.0, 1.0, "1", "The same once more."),
#endif
};

static mhe_status layout(const void *self, const mhe_problem *problem, mhe_cost_layout *out,
                         mhe_error *err) {
    (void)self;
    out->signal = problem->find_signal(problem, "q", &out->n_res, &out->res_unit);
    return out->signal < 0 ? mhe_fail(err, MHE_E_CONFIG, "no signal 'q'") : MHE_OK;
}

static mhe_status residual(const void *self, const mhe_stage *stage, double *r, mhe_error *err) {
    const struct config *c = self;
    (void)err;
    for (int32_t i = 0; i < stage->ny; i++) {
        r[i] = c->gain * stage->y[i];
    }
    return MHE_OK;
}

#ifdef BAD_CREATE_ALONE
static mhe_status create(const mhe_host *host, const mhe_problem *problem, const void *config,
                         void **self, mhe_error *err) {
    (void)host, (void)problem, (void)config, (void)self;
    return mhe_fail(err, MHE_E_INTERNAL, "never called");
}
#endif

static const mhe_cost_ops ops = {
#ifdef BAD_OPS_SIZE
    .size = 2,
#elif defined BAD_PAST_SIZE
    .size = offsetof(mhe_cost_ops, residual),
#else
    .size = sizeof ops,
#endif
#ifdef BAD_CREATE_ALONE
    .create = create,
#endif
    .layout = layout,
#ifndef BAD_NULL_FUNCTION
    .residual = residual,
#endif
};

static const mhe_plugin plugin = {
#ifdef BAD_PLUGIN_SIZE
    .size = 8,
#else
    .size = sizeof plugin,
#endif
#ifdef BAD_MALFORMED_ID
    .id = "Not An Id",
#elif !defined BAD_NO_ID
    .id = "test.cost.abi",
#endif
#ifndef BAD_NO_VERSION
    .version = "1.0.0",
#endif
    .summary = "Penalises positions.",
#ifdef BAD_UNKNOWN_INTERFACE
    .iface = "mhe.cost/99",
#else
    .iface = MHE_COST_IFACE,
#endif
#ifndef BAD_NULL_OPS
    .ops = &ops,
#endif
    .config_size = sizeof(struct config),
#ifdef BAD_OPTION_SIZE
    .option_size = 16,
#else
    .option_size = sizeof(mhe_option),
#endif
    .option_count = sizeof options / sizeof options[0],
#ifndef BAD_NO_OPTION_TABLE
    .options = options,
#endif
};

#ifdef BAD_NULL_PLUGIN
#define LIST NULL
#elif defined BAD_DUPLICATE_ID
#define LIST &plugin, &plugin
#else
#define LIST &plugin
#endif
static const mhe_plugin *const list[] = {LIST};

static const mhe_library library = {
#ifdef BAD_MAGIC
    .magic = MHE_MAGIC + 1,
#else
    .magic = MHE_MAGIC,
#endif
#ifdef BAD_ABI_MAJOR
    .abi_major = MHE_ABI_MAJOR + 1,
#else
    .abi_major = MHE_ABI_MAJOR,
#endif
#ifdef BAD_ABI_MINOR
    .abi_minor = MHE_ABI_MINOR + 1,
#else
    .abi_minor = MHE_ABI_MINOR,
#endif
#ifdef BAD_LIBRARY_SIZE
    .size = 12,
#else
    .size = sizeof library,
#endif
#ifndef BAD_NO_PLUGINS
    .plugin_count = sizeof list / sizeof list[0],
#endif
    .plugins = list,
};

MHE_EXPORT const mhe_library *mhe_plugin_entry(void);
const mhe_library *mhe_plugin_entry(void) {
    (void)plugin.id, (void)options, (void)ops, (void)residual; /* some faults leave them unused */
#ifdef BAD_NULL_LIBRARY
    (void)library;
    return NULL;
#else
    return &library;
#endif
}

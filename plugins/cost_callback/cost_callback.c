/* SPDX-License-Identifier: Apache-2.0 */
/* cost_callback: residuals and derivatives of a cost that the running program brings. */
#include <mhe/cost.h>
#include <stdlib.h>

struct callback_config {
    const char *function;
};

typedef struct callback {
    const mhe_cost_ops *ops; /* the program's */
    void *self;
} callback;

static const mhe_option callback_options[] = {
    MHE_OPT_TEXT(struct callback_config, function, MHE_OPT_REQUIRED, NULL,
                 "Name of the program's cost."),
};

static mhe_status callback_create(const mhe_host *host, const mhe_problem *problem,
                                  const void *config, void **self, mhe_error *err) {
    const char *name = ((const struct callback_config *)config)->function;
    const mhe_own_costs *own = host->service(host, MHE_OWN_COSTS_SERVICE);
    callback *c = calloc(1, sizeof *c);
    (void)problem;
    if (c == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    c->ops = own == NULL ? NULL : own->find(own, name, &c->self);
    if (c->ops == NULL || c->ops->layout == NULL || c->ops->residual == NULL ||
        c->ops->jacobian == NULL) {
        free(c);
        return mhe_fail(err, MHE_E_CONFIG,
                        "this program brings no cost '%s' (in Python: functions=)", name);
    }
    *self = c;
    return MHE_OK;
}

static void callback_destroy(void *self) {
    free(self);
}

static mhe_status callback_layout(const void *self, const mhe_problem *problem,
                                  mhe_cost_layout *out, mhe_error *err) {
    const callback *c = self;
    return c->ops->layout(c->self, problem, out, err);
}

static mhe_status callback_residual(const void *self, const mhe_stage *stage, double *r,
                                    mhe_error *err) {
    const callback *c = self;
    return c->ops->residual(c->self, stage, r, err);
}

static mhe_status callback_jacobian(const void *self, const mhe_stage *stage, double *J,
                                    mhe_error *err) {
    const callback *c = self;
    return c->ops->jacobian(c->self, stage, J, err);
}

static const mhe_cost_ops callback_ops = {.size = sizeof callback_ops,
                                          .create = callback_create,
                                          .destroy = callback_destroy,
                                          .layout = callback_layout,
                                          .residual = callback_residual,
                                          .jacobian = callback_jacobian};

static const mhe_plugin callback_plugin = {
    .size = sizeof callback_plugin,
    .id = "mhe.cost.callback",
    .version = "0.2.0",
    .summary = "A cost that the running program brings, for trying out; in Python too.",
    .iface = MHE_COST_IFACE,
    .ops = &callback_ops,
    MHE_PLUGIN_OPTIONS(struct callback_config, callback_options)};

MHE_PLUGIN_LIBRARY(&callback_plugin)

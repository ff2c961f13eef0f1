/* SPDX-License-Identifier: Apache-2.0 */
#include "plugin/instance.h"

#include "plugin/guard.h"

static void say_nothing(const mhe_host *host, int32_t level, const char *text) {
    (void)host, (void)level, (void)text;
}

mhe_host mhi_host_quiet(const mhe_host *host) {
    mhe_host quiet = *host;
    quiet.log = say_nothing;
    return quiet;
}

/* The arguments of any create(), carried through the guard. */
typedef struct call {
    const void *ops;
    const mhe_host *host;
    const void *subject; /* description, muscles, system, problem */
    int32_t n_muscles;
    const void *config;
    void **self;
    void *layout; /* of the interface */
    mhe_error *err;
} call;

/* `part`: MHE_PART_*, whose refusal it is; which entry of a list, the caller knows. */
static mhe_status guarded(mhe_status (*function)(void *), int32_t part, const mhe_plugin *plugin,
                          call *c) {
    *c->self = NULL;
    c->ops = plugin->ops;
    mhe_status status = mhi_guard(function, c, c->err);
    if (status != MHE_OK && c->err != NULL) {
        const mhe_error why = *c->err;
        c->err->part = part;
        return mhe_fail(c->err, status, "%s: %.600s", plugin->id, why.text);
    }
    return status;
}

static mhe_status create_model(void *data) {
    const call *c = data;
    const mhe_model_ops *ops = c->ops;
    return ops->create(c->host, c->subject, c->config, c->self, c->err);
}

static mhe_status create_muscle(void *data) {
    const call *c = data;
    const mhe_muscle_ops *ops = c->ops;
    mhe_status status = ops->create(c->host, c->subject, c->n_muscles, c->config, c->self, c->err);
    return status == MHE_OK ? ops->layout(*c->self, c->layout, c->err) : status;
}

static mhe_status create_force(void *data) {
    const call *c = data;
    const mhe_force_ops *ops = c->ops;
    mhe_status status = ops->create(c->host, c->subject, c->config, c->self, c->err);
    return status == MHE_OK ? ops->layout(*c->self, c->layout, c->err) : status;
}

static mhe_status create_integrator(void *data) {
    const call *c = data;
    const mhe_integrator_ops *ops = c->ops;
    mhe_status status = ops->accepts != NULL ? ops->accepts(c->subject, c->config, c->err) : MHE_OK;
    return status != MHE_OK ? status : ops->create(c->host, c->subject, c->config, c->self, c->err);
}

static mhe_status create_solver(void *data) {
    const call *c = data;
    const mhe_solver_ops *ops = c->ops;
    const mhe_stage_problem *problem = c->subject;
    if (ops->accepts == NULL && problem->n_p > 0) {
        return mhe_fail(c->err, MHE_E_UNSUPPORTED, "it solves problems without parameters only");
    }
    mhe_status status = ops->accepts != NULL ? ops->accepts(c->subject, c->config, c->err) : MHE_OK;
    return status != MHE_OK ? status : ops->create(c->host, c->subject, c->config, c->self, c->err);
}

static mhe_status create_cost(void *data) {
    const call *c = data;
    const mhe_cost_ops *ops = c->ops;
    mhe_status status = MHE_OK;
    if (ops->create != NULL) {
        status = ops->create(c->host, c->subject, c->config, c->self, c->err);
    }
    if (status == MHE_OK) {
        status =
            ops->layout(ops->create != NULL ? *c->self : c->config, c->subject, c->layout, c->err);
    }
    return status;
}

mhe_status mhi_model_create(const mhe_plugin *plugin, const mhe_host *host,
                            const mhe_description *description, const void *config, void **self,
                            mhe_error *err) {
    call c = {.host = host, .subject = description, .config = config, .self = self, .err = err};
    return guarded(create_model, MHE_PART_MODEL, plugin, &c);
}

mhe_status mhi_muscle_create(const mhe_plugin *plugin, const mhe_host *host,
                             const mhe_muscle *muscles, int32_t n_muscles, const void *config,
                             void **self, mhe_muscle_layout *layout, mhe_error *err) {
    call c = {.host = host,
              .subject = muscles,
              .n_muscles = n_muscles,
              .config = config,
              .self = self,
              .layout = layout,
              .err = err};
    *layout = (mhe_muscle_layout){.size = sizeof *layout};
    return guarded(create_muscle, MHE_PART_MUSCLE, plugin, &c);
}

mhe_status mhi_force_create(const mhe_plugin *plugin, const mhe_host *host,
                            const mhe_description *description, const void *config, void **self,
                            mhe_force_layout *layout, mhe_error *err) {
    call c = {.host = host,
              .subject = description,
              .config = config,
              .self = self,
              .layout = layout,
              .err = err};
    *layout = (mhe_force_layout){.size = sizeof *layout};
    return guarded(create_force, MHE_PART_FORCE, plugin, &c);
}

mhe_status mhi_integrator_create(const mhe_plugin *plugin, const mhe_host *host,
                                 const mhe_system *system, const void *config, void **self,
                                 mhe_error *err) {
    call c = {.host = host, .subject = system, .config = config, .self = self, .err = err};
    return guarded(create_integrator, MHE_PART_INTEGRATOR, plugin, &c);
}

mhe_status mhi_solver_create(const mhe_plugin *plugin, const mhe_host *host,
                             const mhe_stage_problem *problem, const void *config, void **self,
                             mhe_error *err) {
    call c = {.host = host, .subject = problem, .config = config, .self = self, .err = err};
    return guarded(create_solver, MHE_PART_SOLVER, plugin, &c);
}

mhe_status mhi_cost_create(const mhe_plugin *plugin, const mhe_host *host,
                           const mhe_problem *problem, const void *config, void **self,
                           mhe_cost_layout *layout, mhe_error *err) {
    call c = {.host = host,
              .subject = problem,
              .config = config,
              .self = self,
              .layout = layout,
              .err = err};
    *layout = (mhe_cost_layout){.size = sizeof *layout};
    return guarded(create_cost, MHE_PART_COST, plugin, &c);
}

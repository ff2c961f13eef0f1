/* SPDX-License-Identifier: Apache-2.0 */
/* parts.c: one plugin of every other kind, of which the options alone matter. */
#include <mhe/integrator.h>
#include <mhe/model.h>
#include <mhe/muscle.h>
#include <mhe/solver.h>

static mhe_status refuse(mhe_error *err) {
    return mhe_fail(err, MHE_E_UNSUPPORTED, "only its options are real");
}

static void destroy(void *self) {
    (void)self;
}

static mhe_status context_create(const void *self, void **context, mhe_error *err) {
    (void)self, (void)context;
    return refuse(err);
}

static mhe_status model_create(const mhe_host *host, const mhe_description *description,
                               const void *config, void **self, mhe_error *err) {
    (void)host, (void)description, (void)config, (void)self;
    return refuse(err);
}

static mhe_status kinematics(void *context, const double *q, const double *v,
                             const mhe_kinematics *out, mhe_error *err) {
    (void)context, (void)q, (void)v, (void)out;
    return refuse(err);
}

static mhe_status inverse_dynamics(void *context, const double *vdot, double *tau, double *tau_q,
                                   double *tau_v, mhe_error *err) {
    (void)context, (void)vdot, (void)tau, (void)tau_q, (void)tau_v;
    return refuse(err);
}

static mhe_status forward_dynamics(void *context, const double *tau, double *vdot, mhe_error *err) {
    (void)context, (void)tau, (void)vdot;
    return refuse(err);
}

static const mhe_model_ops model_ops = {.size = sizeof model_ops,
                                        .create = model_create,
                                        .destroy = destroy,
                                        .context_create = context_create,
                                        .context_destroy = destroy,
                                        .kinematics = kinematics,
                                        .inverse_dynamics = inverse_dynamics,
                                        .forward_dynamics = forward_dynamics};

static mhe_status muscle_create(const mhe_host *host, const mhe_muscle *muscles, int32_t n_muscles,
                                const void *config, void **self, mhe_error *err) {
    (void)host, (void)muscles, (void)n_muscles, (void)config, (void)self;
    return refuse(err);
}

static mhe_status muscle_layout(const void *self, mhe_muscle_layout *out, mhe_error *err) {
    (void)self, (void)out;
    return refuse(err);
}

static mhe_status evaluate(const void *self, const mhe_muscle_point *at,
                           const mhe_muscle_values *out, mhe_error *err) {
    (void)self, (void)at, (void)out;
    return refuse(err);
}

static const mhe_muscle_ops muscle_ops = {.size = sizeof muscle_ops,
                                          .create = muscle_create,
                                          .destroy = destroy,
                                          .layout = muscle_layout,
                                          .evaluate = evaluate};

static mhe_status integrator_create(const mhe_host *host, const mhe_system *system,
                                    const void *config, void **self, mhe_error *err) {
    (void)host, (void)system, (void)config, (void)self;
    return refuse(err);
}

static mhe_status integrator_context(const void *self, void *system_context, void **context,
                                     mhe_error *err) {
    (void)self, (void)system_context, (void)context;
    return refuse(err);
}

static mhe_status step(void *context, const double *x, const double *u, const double *w, double dt,
                       double *memory, double *x_next, const mhe_step_derivatives *out,
                       mhe_error *err) {
    (void)context, (void)x, (void)u, (void)w, (void)dt, (void)memory, (void)x_next, (void)out;
    return refuse(err);
}

static const mhe_integrator_ops integrator_ops = {.size = sizeof integrator_ops,
                                                  .create = integrator_create,
                                                  .destroy = destroy,
                                                  .context_create = integrator_context,
                                                  .context_destroy = destroy,
                                                  .step = step};

static mhe_status solver_create(const mhe_host *host, const mhe_stage_problem *problem,
                                const void *config, void **self, mhe_error *err) {
    (void)host, (void)problem, (void)config, (void)self;
    return refuse(err);
}

static mhe_status solve(void *self, const mhe_solve_control *control, mhe_solution *solution,
                        mhe_solve_info *info, mhe_error *err) {
    (void)self, (void)control, (void)solution, (void)info;
    return refuse(err);
}

static const mhe_solver_ops solver_ops = {
    .size = sizeof solver_ops, .create = solver_create, .destroy = destroy, .solve = solve};

struct curves {
    int32_t curves;
};

static const mhe_option muscle_options[] = {
    MHE_OPT_ENUM(struct curves, curves, "paper2021", "paper2021|biorbd", "Curves."),
};

struct limits {
    double tolerance;
    int32_t max_iterations;
};

static const mhe_option solver_options[] = {
    MHE_OPT_REAL(struct limits, tolerance, 1e-4, 1e-12, 1, "1", "Tolerance."),
    MHE_OPT_INT(struct limits, max_iterations, 15, 1, 1000, "1", "Iterations."),
};

static const mhe_plugin model = {.size = sizeof model,
                                 .id = "org.test.model.a",
                                 .version = "1.0.0",
                                 .summary = "A model.",
                                 .iface = MHE_MODEL_IFACE,
                                 .ops = &model_ops};

static const mhe_plugin muscle = {.size = sizeof muscle,
                                  .id = "org.test.muscle.a",
                                  .version = "1.0.0",
                                  .summary = "Muscles.",
                                  .iface = MHE_MUSCLE_IFACE,
                                  .ops = &muscle_ops,
                                  MHE_PLUGIN_OPTIONS(struct curves, muscle_options)};

static const mhe_plugin integrator = {.size = sizeof integrator,
                                      .id = "org.test.integrator.a",
                                      .version = "1.0.0",
                                      .summary = "An integrator.",
                                      .iface = MHE_INTEGRATOR_IFACE,
                                      .ops = &integrator_ops};

static const mhe_plugin solver = {.size = sizeof solver,
                                  .id = "org.test.solver.a",
                                  .version = "1.0.0",
                                  .summary = "A solver.",
                                  .iface = MHE_SOLVER_IFACE,
                                  .ops = &solver_ops,
                                  MHE_PLUGIN_OPTIONS(struct limits, solver_options)};

MHE_PLUGIN_LIBRARY(&model, &muscle, &integrator, &solver)

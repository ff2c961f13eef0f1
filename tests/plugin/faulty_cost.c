/* SPDX-License-Identifier: Apache-2.0 */
/* faulty_cost.c: r = y - y_ref of the activations, done well, or with the fault that a FAULT_...
 * definition names. */
#include <mhe/cost.h>
#include <stdlib.h>

struct config {
    double gain;
};

static const mhe_option options[] = {
    MHE_OPT_REAL(struct config, gain, 1.5, 0.0, 10.0, "1", "Factor of every residual."),
};

static mhe_status layout(const void *self, const mhe_problem *problem, mhe_cost_layout *out,
                         mhe_error *err) {
    (void)self;
    out->signal = problem->find_signal(problem, "activation", &out->n_res, &out->res_unit);
    out->jacobian = MHE_JACOBIAN_DIAGONAL;
    out->scratch_bytes = 24;
#ifdef FAULT_LAYOUT
    out->signal = 99;
#endif
    return out->signal < 0 ? mhe_fail(err, MHE_E_CONFIG, "no activations") : MHE_OK;
}

static mhe_status residual(const void *self, const mhe_stage *stage, double *r, mhe_error *err) {
    const struct config *c = self;
    (void)err;
    for (int32_t i = 0; i < stage->ny; i++) {
        r[i] = c->gain * (stage->y[i] - stage->y_ref[i]);
    }
#ifdef FAULT_BEHIND_OUTPUT
    r[stage->ny] = 0;
#endif
#ifdef FAULT_BEHIND_SCRATCH
    ((char *)stage->scratch)[24] = 0;
#endif
#ifdef FAULT_INPUT
    ((double *)stage->y)[1] += 1;
#endif
#ifdef FAULT_UNWRITTEN
    r[0] = 0.0 / 0.0;
#endif
#ifdef FAULT_MEMORY
    static _Atomic int calls;
    r[0] += ++calls;
#endif
#ifdef FAULT_ALLOCATES
    void *volatile memory = malloc(8);
    free(memory);
#endif
#ifdef FAULT_SWALLOWS_NAN
    for (int32_t i = 0; i < stage->ny; i++) {
        r[i] = r[i] == r[i] ? r[i] : 0;
    }
#endif
    return MHE_OK;
}

static mhe_status jacobian(const void *self, const mhe_stage *stage, double *J, mhe_error *err) {
    const struct config *c = self;
    (void)err;
    for (int32_t i = 0; i < stage->ny; i++) {
        J[i] = c->gain;
    }
#ifdef FAULT_JACOBIAN
    J[2] *= 1.00001;
#endif
    return MHE_OK;
}

#ifdef FAULT_EXPORTS
MHE_EXPORT int faulty_also_visible(void);
int faulty_also_visible(void) {
    return 1;
}
#endif

static const mhe_cost_ops ops = {
    .size = sizeof ops, .layout = layout, .residual = residual, .jacobian = jacobian};
static const mhe_plugin plugin = {.size = sizeof plugin,
                                  .id = "test.cost.faulty",
                                  .version = "1.0.0",
                                  .summary = "Tracks activations.",
                                  .iface = MHE_COST_IFACE,
                                  .ops = &ops,
                                  MHE_PLUGIN_OPTIONS(struct config, options)};
MHE_PLUGIN_LIBRARY(&plugin)

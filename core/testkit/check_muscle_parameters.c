/* SPDX-License-Identifier: Apache-2.0 */
/* check_muscle_parameters.c: derivatives of forces and rates by numbers of the description. */
#include "check_muscle.h"

#include <stddef.h>
#include <string.h>

/* A parameter is a number of the description: the plugin made anew with another one must differ as
 * force_p and rate_p say. */
static const struct {
    const char *name;
    size_t offset;
} parameters[] = {{"max_isometric_force", offsetof(mhe_muscle, max_isometric_force)},
                  {"optimal_fiber_length", offsetof(mhe_muscle, optimal_fiber_length)},
                  {"tendon_slack_length", offsetof(mhe_muscle, tendon_slack_length)},
                  {"pennation_angle", offsetof(mhe_muscle, pennation_angle)},
                  {"max_contraction_velocity", offsetof(mhe_muscle, max_contraction_velocity)},
                  {"activation_time", offsetof(mhe_muscle, activation_time)},
                  {"deactivation_time", offsetof(mhe_muscle, deactivation_time)}};

typedef struct parameter_case {
    mhi_kit *kit;
    const muscle_case *c;
    const mhe_muscle *muscles;
    const double *const *in;
    size_t offset;
} parameter_case;

/* y = [force; rates] at parameter values x [N_M] */
static int with_parameters(void *data, const double *x, double *y) {
    const parameter_case *p = data;
    muscle_case made = *p->c;
    mhe_muscle muscles[N_M];
    memcpy(muscles, p->muscles, sizeof muscles);
    for (int i = 0; i < N_M; i++) {
        memcpy((char *)&muscles[i] + p->offset, &x[i], sizeof x[i]);
    }
    if (made.ops->create(&p->kit->host, muscles, N_M, p->kit->config, &made.self, NULL) != MHE_OK) {
        return -1;
    }
    double *const out[N_OUT] = {[FORCE] = y, [RATE] = y + N_M};
    const mhe_status status = mhi_muscle_evaluate(&made, NULL, NULL, p->in, out, NULL);
    made.ops->destroy(made.self);
    return status != MHE_OK;
}

void mhi_check_muscle_parameters(mhi_kit *kit, const muscle_case *c, const mhe_muscle *muscles,
                                 const double *const *in) {
    const int32_t n_p = c->layout.n_parameters, rows = N_M + c->n_s;
    double *force_p = MHI_KIT_TAKE(kit, double, n_p *N_M);
    double *rate_p = MHI_KIT_TAKE(kit, double, n_p * c->n_s);
    const mhe_muscle_point at = {sizeof at, in[EXCITATION], in[STATE], in[LENGTH], in[VELOCITY]};
    const mhe_muscle_values out = {.size = sizeof out, .force_p = force_p, .rate_p = rate_p};
    if (n_p > 0 && c->ops->evaluate(c->self, &at, &out, NULL) != MHE_OK) {
        mhi_kit_fail(kit, "derivatives by parameters alone", "evaluate() fails");
        return;
    }
    for (int32_t p = 0; p < n_p; p++) {
        size_t k = 0;
        while (k < sizeof parameters / sizeof parameters[0] &&
               strcmp(parameters[k].name, c->layout.parameter_names[p]) != 0) {
            k++;
        }
        if (k == sizeof parameters / sizeof parameters[0]) {
            mhi_kit_skip(kit, "derivatives by a parameter", "'%s' is no number of a description",
                         c->layout.parameter_names[p]);
            continue;
        }
        parameter_case data = {kit, c, muscles, in, parameters[k].offset};
        double x[N_M], *jacobian = MHI_KIT_TAKE(kit, double, rows *N_M);
        mhi_muscle_blank(c, rate_p + p * c->n_s);
        for (int m = 0; m < N_M; m++) {
            memcpy(&x[m], (const char *)&muscles[m] + data.offset, sizeof x[m]);
            jacobian[m * N_M + m] = force_p[p * N_M + m];
            for (int32_t s = 0; s < c->layout.n_states; s++) {
                jacobian[(N_M + s * N_M + m) * N_M + m] = rate_p[p * c->n_s + s * N_M + m];
            }
        }
        (void)mhi_kit_limit(kit,
                            mhi_arena_format(&kit->arena, "derivatives by %s against differences",
                                             parameters[k].name),
                            mhi_jacobian_error(kit, with_parameters, &data, x, N_M, rows, jacobian),
                            MHI_JACOBIAN_LIMIT);
    }
}

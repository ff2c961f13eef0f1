/* SPDX-License-Identifier: Apache-2.0 */
/* instance.c: from a description and options to muscles ready to be evaluated. */
#include "hill.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

const struct hill_curve_set *const hill_curve_sets[] = {
    &hill_degroote2016, &hill_paper2021, &hill_biorbd, &hill_degroote2016, &hill_thelen2003};

double hill_or(double stated, double otherwise) {
    return isnan(stated) ? otherwise : stated;
}

void hill_published_geometry(const mhe_muscle *muscle, const struct hill_config *config,
                             struct hill_muscle *out) {
    double vmax = config->vmax > 0 ? config->vmax : hill_or(muscle->max_contraction_velocity, 10);
    out->speed = out->inverse / vmax;
    out->damping = config->damping >= 0 ? config->damping : hill_or(muscle->fiber_damping, 0);
    out->height = muscle->optimal_fiber_length * sin(hill_or(muscle->pennation_angle, 0));
    out->inv_cos = out->pull = 1; /* where the height is 0 */
}

/* What a quantity of the description must be: `lower` itself is allowed unless strict. */
struct hill_rule {
    const char *what;
    double value, lower;
    int required, strict;
};

static mhe_status hill_check(const mhe_muscle *m, mhe_error *err) {
    const struct hill_rule rules[] = {
        {"maximal isometric force", m->max_isometric_force, 0, 1, 1},
        {"optimal fibre length", m->optimal_fiber_length, 0, 1, 1},
        {"tendon slack length", m->tendon_slack_length, 0, 1, 0},
        {"pennation angle", m->pennation_angle, 0, 0, 0},
        {"maximal contraction velocity", m->max_contraction_velocity, 0, 0, 1},
        {"activation time constant", m->activation_time, 0, 0, 1},
        {"deactivation time constant", m->deactivation_time, 0, 0, 1},
        {"fibre damping", m->fiber_damping, 0, 0, 0},
        {"passive strain", m->passive_strain, 0, 0, 1},
        {"passive shape", m->passive_shape, 0, 0, 1},
        {"active shape", m->active_shape, 0, 0, 1},
        {"force-velocity shape", m->velocity_shape, 0, 0, 1},
        {"maximal lengthening force", m->max_lengthening_force, 1, 0, 1}};
    for (size_t i = 0; i < sizeof rules / sizeof rules[0]; i++) {
        const struct hill_rule *rule = &rules[i];
        if (isnan(rule->value)) {
            if (rule->required) {
                return mhe_fail(err, MHE_E_INPUT, "muscle '%s' has no %s", m->name, rule->what);
            }
        } else if (isinf(rule->value) || rule->value < rule->lower ||
                   (rule->strict && !(rule->value > rule->lower))) {
            return mhe_fail(err, MHE_E_INPUT, "muscle '%s': %s is %g, must be %s %g", m->name,
                            rule->what, rule->value, rule->strict ? "above" : "at least",
                            rule->lower);
        }
    }
    if (cos(hill_or(m->pennation_angle, 0)) < 1e-3) {
        return mhe_fail(err, MHE_E_INPUT,
                        "muscle '%s': pennation angle is %g rad, must be below pi/2", m->name,
                        m->pennation_angle);
    }
    return MHE_OK;
}

static mhe_status hill_check_config(const mhe_host *host, const struct hill_config *config,
                                    const struct hill_curve_set *set, mhe_error *err) {
    if (!set->published && (config->vmax > 0 || config->damping >= 0)) {
        return mhe_fail(err, MHE_E_CONFIG, "%s: the curves %s fix it; leave the option out",
                        config->vmax > 0 ? "vmax" : "damping", set->name);
    }
    if (!set->jumps && config->passive_ramp > 0) {
        return mhe_fail(err, MHE_E_CONFIG,
                        "passive_ramp: the curves %s do not switch the passive force on; leave the "
                        "option out",
                        set->name);
    }
    if (config->curves == 0) {
        char line[96];
        (void)snprintf(line, sizeof line, "muscle curves: %s (none chosen)", set->name);
        host->log(host, MHE_LOG_INFO, line);
    }
    return MHE_OK;
}

mhe_status hill_create(const mhe_host *host, const mhe_muscle *muscles, int32_t n_muscles,
                       const void *config_, void **self, mhe_error *err) {
    const struct hill_config *config = config_;
    const struct hill_curve_set *set = hill_curve_sets[config->curves];
    mhe_status status = hill_check_config(host, config, set, err);
    for (int32_t i = 0; i < n_muscles && status == MHE_OK; i++) {
        status = hill_check(&muscles[i], err);
    }
    if (status != MHE_OK) {
        return status;
    }
    size_t n = n_muscles > 0 ? (size_t)n_muscles : 1;
    struct hill *hill = calloc(1, sizeof *hill);
    if (hill == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory for %d muscles", n_muscles);
    }
    hill->n = n_muscles;
    hill->smoothing = config->activation_smoothing;
    hill->m = calloc(n, sizeof *hill->m);
    hill->rate_act = calloc(n, sizeof *hill->rate_act);
    hill->rate_deact = calloc(n, sizeof *hill->rate_deact);
    if (hill->m == NULL || hill->rate_act == NULL || hill->rate_deact == NULL) {
        hill_destroy(hill);
        return mhe_fail(err, MHE_E_MEMORY, "no memory for %d muscles", n_muscles);
    }
    for (int32_t i = 0; i < n_muscles; i++) {
        const mhe_muscle *from = &muscles[i];
        struct hill_muscle *m = &hill->m[i];
        m->f_max = from->max_isometric_force;
        m->l_slack = from->tendon_slack_length;
        m->inverse = 1 / from->optimal_fiber_length;
        set->prepare(from, config, m);
        m->passive_scale *= config->passive;
        hill->rate_act[i] =
            1 / (config->tau_act > 0 ? config->tau_act : hill_or(from->activation_time, 0.010));
        hill->rate_deact[i] = 1 / (config->tau_deact > 0 ? config->tau_deact
                                                         : hill_or(from->deactivation_time, 0.040));
    }
    *self = hill;
    return MHE_OK;
}

void hill_destroy(void *self) {
    struct hill *hill = self;
    if (hill != NULL) {
        free(hill->rate_act);
        free(hill->rate_deact);
        free(hill->m);
        free(hill);
    }
}

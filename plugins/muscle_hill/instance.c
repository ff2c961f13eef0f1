/* SPDX-License-Identifier: Apache-2.0 */
/* instance.c: from a description and options to muscles ready to be evaluated. */
#include "elastic.h"
#include "hill.h"
#include "millard.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const struct hill_curve_set *const hill_curve_sets[] = {NULL, /* as the file states */
                                                        &hill_paper2021,
                                                        &hill_biorbd,
                                                        &hill_degroote2016,
                                                        &hill_thelen2003,
                                                        &hill_millard2012,
                                                        &hill_file};
#define HILL_CURVE_SETS ((int32_t)(sizeof hill_curve_sets / sizeof hill_curve_sets[0]))

/* Whether its curves stand in the model file. */
static int hill_has_curves(const mhe_muscle *muscle) {
    return (muscle->type == MHE_MUSCLE_SCHUTTE1993 || muscle->type == MHE_MUSCLE_RIGID) &&
           muscle->active_force_length.n_pieces > 0;
}

/* The set of a muscle. */
static const struct hill_curve_set *hill_set_of(const mhe_muscle *muscle,
                                                const struct hill_config *config) {
    if (config->curves != 0) {
        return hill_curve_sets[config->curves];
    }
    return muscle->type == MHE_MUSCLE_THELEN2003    ? &hill_thelen2003
           : muscle->type == MHE_MUSCLE_MILLARD2012 ? &hill_millard2012
           : hill_has_curves(muscle)                ? &hill_file
                                                    : &hill_degroote2016;
}

double hill_or(double stated, double otherwise) {
    return isnan(stated) ? otherwise : stated;
}

void hill_published_geometry(const mhe_muscle *muscle, const struct hill_config *config,
                             struct hill_muscle *out) {
    double vmax = config->vmax > 0 ? config->vmax : hill_or(muscle->max_contraction_velocity, 10);
    out->speed = out->inverse / vmax;
    out->speed_o = -out->speed * out->inverse;
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
    /* infinite: no passive force */
    const double passive = m->passive_strain == INFINITY ? 1 : m->passive_strain;
    const struct hill_rule rules[] = {
        {"maximal isometric force", m->max_isometric_force, 0, 1, 1},
        {"optimal fibre length", m->optimal_fiber_length, 0, 1, 1},
        {"tendon slack length", m->tendon_slack_length, 0, 1, 0},
        {"pennation angle", m->pennation_angle, 0, 0, 0},
        {"maximal contraction velocity", m->max_contraction_velocity, 0, 0, 1},
        {"activation time constant", m->activation_time, 0, 0, 1},
        {"deactivation time constant", m->deactivation_time, 0, 0, 1},
        {"fibre damping", m->fiber_damping, 0, 0, 0},
        {"passive strain", passive, 0, 0, 1},
        {"passive shape", m->passive_shape, 0, 0, 1},
        {"active shape", m->active_shape, 0, 0, 1},
        {"force-velocity shape", m->velocity_shape, 0, 0, 1},
        {"maximal lengthening force", m->max_lengthening_force, 1, 0, 1},
        {"tendon strain", m->tendon_strain, 0, 0, 1}};
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

static mhe_status hill_check_config(const struct hill_config *config, mhe_error *err) {
    const struct hill_curve_set *set = hill_curve_sets[config->curves];
    if (set == NULL) { /* auto: published sets, none of which jumps */
        set = &hill_degroote2016;
    }
    if (!set->published && (config->vmax > 0 || config->damping >= 0)) {
        return mhe_fail(err, MHE_E_CONFIG, "%s: the curves %s fix it; leave the option out",
                        config->vmax > 0 ? "vmax" : "damping", set->name);
    }
    if (!set->jumps && config->passive_ramp > 0) {
        return mhe_fail(err, MHE_E_CONFIG,
                        "passive_ramp: the curves %s do not switch the passive force on; leave the "
                        "option out",
                        config->curves == 0 ? "of the file" : set->name);
    }
    if (!set->published && config->tendon != HILL_RIGID) {
        return mhe_fail(
            err, MHE_E_CONFIG,
            "tendon: elastic tendons; the curves %s have rigid tendons: choose degroote2016, "
            "thelen2003 or millard2012",
            set->name);
    }
    return MHE_OK;
}

/* Says which sets were taken where the config leaves it to the file. */
static void hill_tell_sets(const mhe_host *host, const mhe_muscle *muscles, int32_t n,
                           const struct hill_config *config) {
    char line[160] = "muscle curves (none chosen):";
    for (int32_t k = 1; k < HILL_CURVE_SETS; k++) {
        int32_t count = 0;
        for (int32_t i = 0; i < n; i++) {
            count += hill_set_of(&muscles[i], config) == hill_curve_sets[k];
        }
        size_t used = strlen(line);
        if (count > 0) {
            (void)snprintf(line + used, sizeof line - used, "%s %s for %d",
                           line[used - 1] == ':' ? "" : ",", hill_curve_sets[k]->name, count);
        }
    }
    host->log(host, MHE_LOG_INFO, line);
}

/* Says which tendons stay rigid although the config wants them elastic. */
static void hill_tell_rigid(const mhe_host *host, const struct hill *hill,
                            const mhe_muscle *muscles, int32_t tendon) {
    char line[256] = "";
    int32_t count = 0;
    size_t used = 0;
    for (int32_t i = 0; i < hill->n; i++) {
        if (!hill->m[i].elastic) {
            count++;
            used = strlen(line);
            (void)snprintf(line + used, sizeof line - used, "%s%s", used > 0 ? ", " : "",
                           muscles[i].name);
        }
    }
    if (count > 0) {
        char text[400];
        (void)snprintf(text, sizeof text,
                       "%d of %d tendons stay rigid, shorter than half the fibre%s: %s%s", count,
                       hill->n, tendon == HILL_FILE ? " or said to be" : "", line,
                       strlen(line) + 1 == sizeof line ? " ..." : "");
        host->log(host, MHE_LOG_WARNING, text);
    }
}

/* Whether the tendon of a muscle of an instance with elastic tendons is elastic, and its damping.
 */
static mhe_status hill_make_elastic(const mhe_muscle *from, const struct hill_config *config,
                                    struct hill_muscle *m, mhe_error *err) {
    double vmax = config->vmax > 0 ? config->vmax : hill_or(from->max_contraction_velocity, 10);
    m->elastic = m->tendon != NULL &&
                 (config->tendon == HILL_ELASTIC || from->ignore_tendon_compliance != 1) &&
                 from->tendon_slack_length >= HILL_SHORT_TENDON * from->optimal_fiber_length;
    m->vmax = vmax;
    m->beta =
        config->damping >= 0 ? config->damping : hill_or(from->fiber_damping, HILL_USUAL_DAMPING);
    if (m->elastic && m->beta < HILL_LEAST_DAMPING) {
        return mhe_fail(err, MHE_E_INPUT,
                        "muscle '%s' (line %d): fibre damping is %g; an elastic tendon needs at "
                        "least %g (%s), or tendon: rigid",
                        from->name, from->line, m->beta, HILL_LEAST_DAMPING,
                        config->damping >= 0 ? "muscle.damping"
                                             : "set muscle.damping, usually 0.1");
    }
    return MHE_OK;
}

/* Curves of muscle i: those of an earlier one that states the same, as most models' muscles do. One
 * table for all stays in the cache. */
static mhe_status hill_take_millard(struct hill *hill, int32_t i, const mhe_muscle *muscles,
                                    mhe_error *err) {
    const mhe_muscle *from = &muscles[i];
    for (int32_t j = 0; j < i; j++) {
        if (hill->m[j].millard != NULL &&
            memcmp(&muscles[j].millard, &from->millard, sizeof from->millard) == 0) {
            hill->m[i].millard = hill->m[j].millard;
            return MHE_OK;
        }
    }
    hill->m[i].millard = &hill->millard[i];
    return hill_millard_make(&from->millard, from->name, from->line, &hill->millard[i], err);
}

static mhe_status hill_fill(struct hill *hill, int32_t i, const mhe_muscle *muscles,
                            const struct hill_config *config, mhe_error *err) {
    const mhe_muscle *from = &muscles[i];
    const struct hill_curve_set *set = hill_set_of(from, config);
    struct hill_muscle *m = &hill->m[i];
    m->f_max = from->max_isometric_force;
    m->l_slack = from->tendon_slack_length;
    m->inverse = 1 / from->optimal_fiber_length;
    if (set->millard) {
        const mhe_status status = hill_take_millard(hill, i, muscles, err);
        if (status != MHE_OK) {
            return status;
        }
    }
    if (set->file && !hill_has_curves(from)) {
        return mhe_fail(err, MHE_E_CONFIG,
                        "curves: muscle '%s' (line %d) has no curves in the model file; leave the "
                        "option out",
                        from->name, from->line);
    }
    if (set->file) {
        hill->file[i] =
            (struct hill_file){from->type, from->active_force_length, from->passive_force_length,
                               from->tendon_force_length, from->force_velocity};
        m->file = &hill->file[i];
    }
    set->prepare(from, config, m);
    m->passive_scale *= config->passive;
    hill->rate_act[i] =
        1 / (config->tau_act > 0 ? config->tau_act : hill_or(from->activation_time, 0.010));
    hill->rate_deact[i] =
        1 / (config->tau_deact > 0 ? config->tau_deact : hill_or(from->deactivation_time, 0.040));
    return config->tendon != HILL_RIGID ? hill_make_elastic(from, config, m, err) : MHE_OK;
}

/* Number of states, their bounds, and who has them. */
static mhe_status hill_states(struct hill *hill, mhe_error *err) {
    int32_t n = hill->n, elastic = 0;
    for (int32_t i = 0; i < n; i++) {
        elastic += hill->m[i].elastic;
    }
    hill->n_states = elastic > 0 ? 2 : 1;
    size_t total = (size_t)hill->n_states * (size_t)(n > 0 ? n : 1);
    hill->lower = calloc(total, sizeof *hill->lower);
    hill->upper = calloc(total, sizeof *hill->upper);
    hill->present = calloc(total, sizeof *hill->present);
    if (hill->lower == NULL || hill->upper == NULL || hill->present == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory for %d muscles", n);
    }
    for (int32_t i = 0; i < n; i++) {
        hill->lower[i] = -INFINITY;
        hill->upper[i] = INFINITY;
        hill->present[i] = 1;
        if (elastic > 0) {
            hill->lower[n + i] = hill->m[i].shortest - HILL_BEHIND_STOP;
            hill->upper[n + i] = HILL_LONGEST;
            hill->present[n + i] = (uint8_t)hill->m[i].elastic;
        }
    }
    return MHE_OK;
}

mhe_status hill_create(const mhe_host *host, const mhe_muscle *muscles, int32_t n_muscles,
                       const void *config_, void **self, mhe_error *err) {
    const struct hill_config *config = config_;
    mhe_status status = hill_check_config(config, err);
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
    hill->millard = calloc(n, sizeof *hill->millard);
    hill->file = calloc(n, sizeof *hill->file);
    if (hill->m == NULL || hill->rate_act == NULL || hill->rate_deact == NULL ||
        hill->millard == NULL || hill->file == NULL) {
        status = mhe_fail(err, MHE_E_MEMORY, "no memory for %d muscles", n_muscles);
    }
    for (int32_t i = 0; i < n_muscles && status == MHE_OK; i++) {
        status = hill_fill(hill, i, muscles, config, err);
    }
    if (status == MHE_OK && hill_make_columns(hill) != MHE_OK) {
        status = mhe_fail(err, MHE_E_MEMORY, "no memory for %d muscles", n_muscles);
    }
    if (status == MHE_OK) {
        status = hill_states(hill, err);
    }
    if (status != MHE_OK) {
        hill_destroy(hill);
        return status;
    }
    if (config->curves == 0) {
        hill_tell_sets(host, muscles, n_muscles, config);
    }
    if (config->tendon != HILL_RIGID) {
        hill_tell_rigid(host, hill, muscles, config->tendon);
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
        free(hill->millard);
        free(hill->file);
        free(hill->columns);
        free(hill->lower);
        free(hill->upper);
        free(hill->present);
        free(hill);
    }
}

/* SPDX-License-Identifier: Apache-2.0 */
/* parameters.c: numbers of muscles and skeleton that a run may estimate. */
#include "base/text.h"
#include "model/system_private.h"
#include "plugin/instance.h"

#include <math.h>
#include <string.h>

/* Those that forces and the states beside the activation depend on: an activation's own rate has no
 * derivatives by parameters in mhe/integrator.h. */
static const struct {
    const char *name, *unit;
    size_t offset;
} known[] = {
    {"max_isometric_force", "N", offsetof(mhe_muscle, max_isometric_force)},
    {"optimal_fiber_length", "m", offsetof(mhe_muscle, optimal_fiber_length)},
    {"tendon_slack_length", "m", offsetof(mhe_muscle, tendon_slack_length)},
    {"pennation_angle", "rad", offsetof(mhe_muscle, pennation_angle)},
    {"max_contraction_velocity", "1/s", offsetof(mhe_muscle, max_contraction_velocity)},
    {"fiber_damping", "1", offsetof(mhe_muscle, fiber_damping)},
};
#define N_KNOWN ((int32_t)(sizeof known / sizeof known[0]))

const char *mhi_parameter_unit(const mhi_system *s, int32_t i) {
    for (int32_t k = 0; k < N_KNOWN; k++) {
        if (known[k].offset == s->parameter_at[i]) {
            return known[k].unit;
        }
    }
    return "1";
}

static double *number_of(mhe_muscle *m, size_t offset) {
    return (double *)(void *)((char *)m + offset);
}

static mhe_status find_one(mhi_system *s, const char *name, int32_t i, mhe_error *err) {
    const mhe_muscle_layout *l = &s->muscle_layout;
    char hint[256];
    int32_t k = 0, offered = 0;
    while (k < N_KNOWN && strcmp(known[k].name, name) != 0) {
        k++;
    }
    while (offered < l->n_parameters && strcmp(l->parameter_names[offered], name) != 0) {
        offered++;
    }
    if (k == N_KNOWN || offered == l->n_parameters) {
        return mhe_fail(err, MHE_E_CONFIG, "%s: no derivatives by a parameter '%s'%s",
                        s->muscle_plugin->id, name,
                        l->n_parameters == 0 ? ""
                                             : mhi_suggest(hint, sizeof hint, name,
                                                           l->parameter_names, l->n_parameters));
    }
    for (int32_t m = 0; m < s->face.n_m; m++) {
        if (!isfinite(*number_of(&s->muscles[m], known[k].offset))) {
            return mhe_fail(err, MHE_E_INPUT, "muscle '%s' has no %s", s->muscles[m].name, name);
        }
    }
    s->parameter[i] = offered;
    s->parameter_at[i] = known[k].offset;
    return MHE_OK;
}

/* Of the skeleton: see anatomy.h. */
static int32_t is_of_skeleton(const char *name) {
    return strcmp(name, MHI_INSERTION) == 0 || strcmp(name, MHI_MASS) == 0;
}

mhe_status mhi_parameters_find(mhi_system *s, const mhi_system_setup *setup, mhe_error *err) {
    s->parameter = MHI_TAKE(&s->arena, int32_t, setup->n_parameters);
    s->parameter_at = MHI_TAKE(&s->arena, size_t, setup->n_parameters);
    if (s->parameter == NULL || s->parameter_at == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < setup->n_parameters && status == MHE_OK; i++) {
        if (is_of_skeleton(setup->parameters[i])) {
            continue;
        }
        status = i > s->n_parameters
                     ? mhe_fail(err, MHE_E_INTERNAL, "muscles' parameters come first")
                     : find_one(s, setup->parameters[i], i, err);
        s->n_parameters++;
    }
    return status;
}

void mhi_system_parameters(const mhi_system *s, double *p) {
    for (int32_t i = 0; i < s->n_parameters; i++) {
        for (int32_t m = 0; m < s->face.n_m; m++) {
            p[i * s->face.n_m + m] = *number_of(&s->muscles[m], s->parameter_at[i]);
        }
    }
    if (s->anatomy != NULL) {
        mhi_anatomy_values(s->anatomy, p + s->n_parameters * s->face.n_m);
    }
}

static int32_t same_states(const mhi_system *s, const mhe_muscle_layout *l) {
    const mhe_muscle_layout *now = &s->muscle_layout;
    int32_t same = l->n_states == now->n_states && l->activation == now->activation;
    for (int32_t i = 0; i < s->n_s * s->face.n_m && same; i++) {
        same = (l->present == NULL || l->present[i]) == (now->present == NULL || now->present[i]);
    }
    return same;
}

mhe_status mhi_system_set_parameters(mhi_system *s, const double *p, mhe_error *err) {
    const int32_t n_m = s->face.n_m;
    mhi_arena arena = {0};
    mhe_muscle *before = MHI_TAKE(&arena, mhe_muscle, n_m);
    if (before == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    memcpy(before, s->muscles, sizeof *before * (size_t)n_m);
    for (int32_t i = 0; i < s->n_parameters; i++) {
        for (int32_t m = 0; m < n_m; m++) {
            *number_of(&s->muscles[m], s->parameter_at[i]) = p[i * n_m + m];
        }
    }
    void *self = NULL;
    mhe_muscle_layout layout;
    mhe_status status = mhi_muscle_create(s->muscle_plugin, &s->host, s->muscles, n_m,
                                          s->muscle_config, &self, &layout, err);
    if (status == MHE_OK && !same_states(s, &layout)) {
        status = mhe_fail(err, MHE_E_INPUT, "%s: muscles have other states at these parameters",
                          s->muscle_plugin->id);
    }
    if (status == MHE_OK && s->anatomy != NULL) {
        status = mhi_anatomy_set(s->anatomy, p + s->n_parameters * n_m, &s->model_self, err);
    }
    if (status == MHE_OK) {
        s->muscle->destroy(s->muscle_self);
        s->muscle_self = self;
        s->muscle_layout = layout;
    } else {
        if (self != NULL) {
            s->muscle->destroy(self);
        }
        memcpy(s->muscles, before, sizeof *before * (size_t)n_m);
    }
    mhi_arena_free(&arena);
    return status;
}

/* Each coordinate of muscle m's last point moves its force by F_l L_d + F_w (L_dq v) and its
 * moments by -(L_dq F + L_q dF/dd). */
static void insertion_forces(mhi_system_context *c) {
    const mhi_system *s = c->system;
    const int32_t n_q = s->face.n_q, n_p = s->face.n_p, first = s->n_parameters * s->face.n_m;
    const int32_t n = mhi_anatomy_insertions(s->anatomy), axes = n / s->face.n_m;
    for (int32_t i = 0; i < n; i++) {
        const int32_t m = i / axes;
        const double *l_dq = c->anatomy->length_dq + i * n_q, *l_q = c->length_q + m * n_q;
        const double *v = c->anatomy->state + n_q + axes;
        double by_w = 0;
        for (int32_t j = 0; j < n_q; j++) {
            by_w += l_dq[j] * v[j];
        }
        c->anatomy->velocity_d[i] = by_w;
        const double by = c->force_l[m] * c->anatomy->length_d[i] + c->force_w[m] * by_w;
        c->force_p[first + i] = by;
        for (int32_t j = 0; j < n_q; j++) {
            c->moment_p[j * n_p + first + i] = -(l_dq[j] * c->force[m] + l_q[j] * by);
        }
    }
}

void mhi_parameters_forces(mhi_system_context *c) {
    const mhi_system *s = c->system;
    const int32_t n_q = s->face.n_q, n_m = s->face.n_m, n_p = s->face.n_p;
    for (int32_t i = 0; i < s->n_parameters; i++) {
        for (int32_t m = 0; m < n_m; m++) {
            const double by = c->all_force_p[s->parameter[i] * n_m + m];
            c->force_p[i * n_m + m] = by;
            for (int32_t j = 0; j < n_q; j++) {
                c->moment_p[j * n_p + i * n_m + m] = -c->length_q[m * n_q + j] * by;
            }
        }
    }
    if (mhi_anatomy_insertions(s->anatomy) > 0) {
        insertion_forces(c);
    }
}

mhe_status mhi_parameters_masses(mhi_system_context *c, const mhe_system_point *at,
                                 const double *vdot, mhe_error *err) {
    const mhi_system *s = c->system;
    const int32_t n_q = s->face.n_q, n_p = s->face.n_p, n_b = mhi_anatomy_masses(s->anatomy);
    mhe_status status = MHE_OK;
    for (int32_t b = 0; b < n_b && status == MHE_OK; b++) {
        status = mhi_anatomy_weigh(c->anatomy, b, at->q, at->v, vdot, err);
        for (int32_t j = 0; j < n_q && status == MHE_OK; j++) {
            c->moment_p[j * n_p + n_p - n_b + b] = -c->anatomy->tau[j];
        }
    }
    return status;
}

void mhi_parameters_rates(const mhi_system_context *c, double *zdot_p) {
    const mhi_system *s = c->system;
    const int32_t n_m = s->face.n_m, n_p = s->face.n_p;
    const int32_t axes = n_m > 0 ? mhi_anatomy_insertions(s->anatomy) / n_m : 0;
    memset(zdot_p, 0, sizeof *zdot_p * (size_t)(s->face.n_z * n_p));
    for (int32_t z = 0; z < s->face.n_z; z++) {
        const int32_t m = s->face.z_muscle[z], k = s->z_state[z];
        for (int32_t i = 0; i < s->n_parameters; i++) {
            zdot_p[z * n_p + i * n_m + m] = c->all_rate_p[(s->parameter[i] * s->n_s + k) * n_m + m];
        }
        for (int32_t i = m * axes; i < (m + 1) * axes; i++) {
            zdot_p[z * n_p + s->n_parameters * n_m + i] =
                c->rate_l[k * n_m + m] * c->anatomy->length_d[i] +
                c->rate_w[k * n_m + m] * c->anatomy->velocity_d[i];
        }
    }
}

/* SPDX-License-Identifier: Apache-2.0 */
/* muscle_gauss: the least that pulls like a muscle: a rigid tendon, a bell over the fibre's length,
 * a straight line over its velocity, and an activation that follows the excitation.
 *
 *     F = F_max a fl(n) fv(w),  n = (l - l_slack) / l_opt,  fl = exp(-((n - 1) / width)^2),
 *     fv = 1 - w / (v_max l_opt) while shortening at most at v_max
 *     da/dt = (e - a) / time
 * Length and velocity l, w are those of muscle and tendon; pennation is left out. */
#include <mhe/muscle.h>

#include <math.h>
#include <stdlib.h>

struct gauss { /* filled and range-checked by the core */
    double width, time, v_max;
};

static const mhe_option gauss_options[] = {
    MHE_OPT_REAL(struct gauss, width, 0.45, 0.05, 2, "1", "Half width of the bell."),
    MHE_OPT_REAL(struct gauss, time, 0.03, 0.001, 1, "s", "Time constant of the activation."),
    MHE_OPT_REAL(struct gauss, v_max, 10, 1, 100, "1/s", "Fastest shortening, fibre lengths."),
};

typedef struct instance {
    struct gauss config;
    const mhe_muscle *muscles;
    int32_t n;
    double bounds[]; /* lower, upper [2 x n] of the activation */
} instance;

static mhe_status gauss_create(const mhe_host *host, const mhe_muscle *muscles, int32_t n_muscles,
                               const void *config, void **self, mhe_error *err) {
    (void)host;
    instance *g = calloc(1, sizeof *g + sizeof(double) * 2 * (size_t)n_muscles);
    if (g == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    g->config = *(const struct gauss *)config;
    g->muscles = muscles;
    g->n = n_muscles;
    for (int32_t i = 0; i < n_muscles; i++) {
        g->bounds[n_muscles + i] = 1;
    }
    *self = g;
    return MHE_OK;
}

static void gauss_destroy(void *self) {
    free(self);
}

static mhe_status gauss_layout(const void *self, mhe_muscle_layout *out, mhe_error *err) {
    static const char *const names[] = {"activation"}, *const units[] = {"1"};
    static const uint8_t diagonal[] = {1}; /* the rate sees excitation and activation alone */
    const instance *g = self;
    (void)err;
    out->n_states = 1;
    out->names = names;
    out->units = units;
    out->lower = g->bounds;
    out->upper = g->bounds + g->n;
    out->diagonal = diagonal;
    return MHE_OK;
}

static mhe_status gauss_rate(const void *self, int32_t k, const double *e, const double *s,
                             double *rate, double *rate_e, double *rate_s, mhe_error *err) {
    const instance *g = self;
    (void)k, (void)err;
    for (int32_t i = 0; i < g->n; i++) {
        rate[i] = (e[i] - s[i]) / g->config.time;
        if (rate_e != NULL) {
            rate_e[i] = 1 / g->config.time;
        }
        if (rate_s != NULL) {
            rate_s[i] = -1 / g->config.time;
        }
    }
    return MHE_OK;
}

static void put(double *to, int32_t i, double value) {
    if (to != NULL) { /* NULL: not wanted */
        to[i] = value;
    }
}

static mhe_status gauss_evaluate(const void *self, const mhe_muscle_point *at,
                                 const mhe_muscle_values *out, mhe_error *err) {
    const instance *g = self;
    (void)err;
    for (int32_t i = 0; i < g->n; i++) {
        const mhe_muscle *m = &g->muscles[i];
        const double fiber = at->length[i] - m->tendon_slack_length;
        const double n = (fiber / m->optimal_fiber_length - 1) / g->config.width;
        const double fl = exp(-n * n);
        const double slope = -1 / (g->config.v_max * m->optimal_fiber_length);
        const double fv = 1 + slope * at->velocity[i];
        const double F = m->max_isometric_force, a = at->state[i];
        put(out->force, i, F * a * fl * fv);
        put(out->force_s, i, F * fl * fv);
        put(out->force_l, i,
            F * a * fv * fl * -2 * n / (g->config.width * m->optimal_fiber_length));
        put(out->force_w, i, F * a * fl * slope);
        put(out->fiber_length, i, fiber);
        put(out->fiber_velocity, i, at->velocity[i]);
        put(out->pennation, i, 0);
        put(out->active, i, F * a * fl * fv);
        put(out->passive, i, 0);
        if (out->rate != NULL || out->rate_e != NULL || out->rate_s != NULL) {
            put(out->rate, i, out->rate == NULL ? 0 : (at->excitation[i] - a) / g->config.time);
            put(out->rate_e, i, 1 / g->config.time);
            put(out->rate_s, i, -1 / g->config.time);
        }
        put(out->rate_l, i, 0);
        put(out->rate_w, i, 0);
    }
    return MHE_OK;
}

static const mhe_muscle_ops gauss_ops = {.size = sizeof gauss_ops,
                                         .create = gauss_create,
                                         .destroy = gauss_destroy,
                                         .layout = gauss_layout,
                                         .evaluate = gauss_evaluate,
                                         .diagonal_rate = gauss_rate};

static const mhe_plugin gauss_plugin = {.size = sizeof gauss_plugin,
                                        .id = "org.example.muscle.gauss",
                                        .version = "1.0.0",
                                        .summary = "A bell over length, a line over velocity.",
                                        .iface = MHE_MUSCLE_IFACE,
                                        .ops = &gauss_ops,
                                        MHE_PLUGIN_OPTIONS(struct gauss, gauss_options)};

MHE_PLUGIN_LIBRARY(&gauss_plugin)

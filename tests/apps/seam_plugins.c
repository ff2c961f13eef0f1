/* SPDX-License-Identifier: Apache-2.0 */
/* seam_plugins.c: what nobody in the core has heard of: muscles with three states, forces with
 * inputs; and faults on request. */
#include <math.h>
#include <mhe/force.h>
#include <mhe/muscle.h>
#include <stdlib.h>
#include <string.h>

/* ---- muscles: an activation, a lag behind it that hears the velocity, fatigue ---- */

enum { LAG, ACTIVATION, FATIGUE, N_STATES };

#define TAU 0.015
#define TAU_LAG 0.01
#define TAU_FATIGUE 4.0
#define HEARS 0.2 /* of the velocity, s/m */

struct three_config {
    int32_t states; /* as layout() is to say */
};

struct three {
    const mhe_muscle *m;
    int32_t n, states;
    uint8_t *present;
    double *lower, *upper;
};

static void three_destroy(void *self) {
    struct three *s = self;
    if (s != NULL) {
        free(s->present);
        free(s->lower);
        free(s->upper);
        free(s);
    }
}

static mhe_status three_create(const mhe_host *host, const mhe_muscle *muscles, int32_t n,
                               const void *config, void **self, mhe_error *err) {
    struct three *s = calloc(1, sizeof *s);
    const size_t all = (size_t)n * N_STATES + 1;
    (void)host;
    if (s != NULL) {
        s->m = muscles;
        s->n = n;
        s->states = ((const struct three_config *)config)->states;
        s->present = malloc(all);
        s->lower = malloc(all * sizeof *s->lower);
        s->upper = malloc(all * sizeof *s->upper);
    }
    if (s == NULL || s->present == NULL || s->lower == NULL || s->upper == NULL) {
        three_destroy(s);
        return mhe_fail(err, MHE_E_MEMORY, "no memory");
    }
    for (size_t i = 0; i < all; i++) {
        s->present[i] = i != FATIGUE * (size_t)n; /* the first muscle does not tire */
        s->lower[i] = -1;
        s->upper[i] = 2;
    }
    *self = s;
    return MHE_OK;
}

static mhe_status three_layout(const void *self, mhe_muscle_layout *out, mhe_error *err) {
    static const char *const names[] = {"lag", "activation", "fatigue"};
    static const char *const units[] = {"1", "1", "1"};
    static const uint8_t diagonal[] = {0, 1, 0};
    const struct three *s = self;
    (void)err;
    out->n_states = s->states;
    out->activation = ACTIVATION;
    out->names = names;
    out->units = units;
    out->lower = s->lower;
    out->upper = s->upper;
    out->present = s->present;
    out->diagonal = diagonal;
    return MHE_OK;
}

static void put(double *values, int32_t at, double value) {
    if (values != NULL) {
        values[at] = value;
    }
}

/* F = F_max (lag (1 - 0.3 fatigue) bell + 0.05 w / l_opt), bell = exp(-(x / 0.6)^2). */
static void three_force(const struct three *s, int32_t i, const mhe_muscle_point *at,
                        const mhe_muscle_values *out) {
    const mhe_muscle *m = &s->m[i];
    const int32_t n = s->n, tires = s->present[FATIGUE * n + i];
    const double lag = at->state[LAG * n + i], fatigue = tires ? at->state[FATIGUE * n + i] : 0;
    const double along = (at->length[i] - m->tendon_slack_length) / m->optimal_fiber_length - 1;
    const double bell = exp(-along * along / 0.36), fresh = 1 - 0.3 * fatigue;
    const double f = m->max_isometric_force, damping = 0.05 / m->optimal_fiber_length;
    put(out->force, i, f * (lag * fresh * bell + damping * at->velocity[i]));
    put(out->force_s, LAG * n + i, f * fresh * bell);
    put(out->force_s, ACTIVATION * n + i, 0);
    put(out->force_s, FATIGUE * n + i, tires ? -0.3 * f * lag * bell : 0);
    put(out->force_l, i, f * lag * fresh * bell * -2 * along / 0.36 / m->optimal_fiber_length);
    put(out->force_w, i, f * damping);
}

static mhe_status three_diagonal_rate(const void *self, int32_t k, const double *e, const double *a,
                                      double *rate, double *rate_e, double *rate_s,
                                      mhe_error *err) {
    const struct three *s = self;
    (void)k, (void)err;
    for (int32_t i = 0; i < s->n; i++) {
        put(rate, i, (e[i] - a[i]) / TAU);
        put(rate_e, i, 1 / TAU);
        put(rate_s, i, -1 / TAU);
    }
    return MHE_OK;
}

static mhe_status three_evaluate(const void *self, const mhe_muscle_point *at,
                                 const mhe_muscle_values *out, mhe_error *err) {
    const struct three *s = self;
    const int32_t n = s->n;
    (void)err;
    for (int32_t k = 0; out->rate_s != NULL && k < N_STATES * N_STATES * n; k++) {
        out->rate_s[k] = 0;
    }
    for (int32_t i = 0; i < n; i++) {
        const double a = at->state[ACTIVATION * n + i];
        three_force(s, i, at, out);
        for (int32_t k = 0; k < N_STATES; k++) {
            put(out->rate_e, k * n + i, 0);
            put(out->rate_l, k * n + i, 0);
            put(out->rate_w, k * n + i, k == LAG ? HEARS / TAU_LAG : 0);
        }
        if (at->excitation != NULL) {
            put(out->rate, ACTIVATION * n + i, (at->excitation[i] - a) / TAU);
        }
        put(out->rate_e, ACTIVATION * n + i, 1 / TAU);
        put(out->rate_s, (ACTIVATION * N_STATES + ACTIVATION) * n + i, -1 / TAU);
        put(out->rate, LAG * n + i,
            (a - at->state[LAG * n + i] + HEARS * at->velocity[i]) / TAU_LAG);
        put(out->rate_s, (LAG * N_STATES + ACTIVATION) * n + i, 1 / TAU_LAG);
        put(out->rate_s, (LAG * N_STATES + LAG) * n + i, -1 / TAU_LAG);
        if (s->present[FATIGUE * n + i]) {
            const double fatigue = at->state[FATIGUE * n + i];
            put(out->rate, FATIGUE * n + i, (a - fatigue) / TAU_FATIGUE);
            put(out->rate_s, (FATIGUE * N_STATES + ACTIVATION) * n + i, 1 / TAU_FATIGUE);
            put(out->rate_s, (FATIGUE * N_STATES + FATIGUE) * n + i, -1 / TAU_FATIGUE);
        }
    }
    return MHE_OK;
}

static mhe_status three_equilibrium(const void *self, const double *activation,
                                    const double *length, const double *velocity, double *state,
                                    mhe_error *err) {
    const struct three *s = self;
    (void)length, (void)err;
    for (int32_t i = 0; i < s->n; i++) {
        state[LAG * s->n + i] = activation[i] + HEARS * velocity[i];
        state[ACTIVATION * s->n + i] = activation[i];
        if (s->present[FATIGUE * s->n + i]) {
            state[FATIGUE * s->n + i] = activation[i];
        }
    }
    return MHE_OK;
}

static const mhe_option three_options[] = {
    MHE_OPT_INT(struct three_config, states, N_STATES, 0, 99, "1", "What layout() says."),
};

static const mhe_muscle_ops three_ops = {.size = sizeof three_ops,
                                         .create = three_create,
                                         .destroy = three_destroy,
                                         .layout = three_layout,
                                         .evaluate = three_evaluate,
                                         .diagonal_rate = three_diagonal_rate,
                                         .equilibrium = three_equilibrium};

static const mhe_plugin three = {.size = sizeof three,
                                 .id = "test.muscle.three",
                                 .version = "1.0.0",
                                 .summary = "Muscles with three states.",
                                 .iface = MHE_MUSCLE_IFACE,
                                 .ops = &three_ops,
                                 MHE_PLUGIN_OPTIONS(struct three_config, three_options)};

/* ---- forces: a torque on the first coordinate that is an input ---- */

enum { FAULT_NONE, FAULT_NAN, FAULT_SHORT };

struct push_config {
    int32_t fault;
};

struct push {
    int32_t n_q, fault;
};

static mhe_status push_create(const mhe_host *host, const mhe_description *description,
                              const void *config, void **self, mhe_error *err) {
    struct push *s = calloc(1, sizeof *s);
    (void)host;
    if (s == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory");
    }
    s->n_q = description->n_coordinates;
    s->fault = ((const struct push_config *)config)->fault;
    *self = s;
    return MHE_OK;
}

static void push_destroy(void *self) {
    free(self);
}

static mhe_status push_layout(const void *self, mhe_force_layout *out, mhe_error *err) {
    static const char *const names[] = {"torque", "stiffness"}, *const units[] = {"N m", "N m/rad"};
    (void)self, (void)err;
    out->name = "push";
    out->generalised = 1;
    out->n_inputs = 2;
    out->input_names = names;
    out->input_units = units;
    return MHE_OK;
}

/* tau_0 = w_0 - w_1 q_0 */
static mhe_status push_evaluate(const void *self, const mhe_force_point *at,
                                const mhe_force_values *out, mhe_error *err) {
    const struct push *s = self;
    (void)err;
    put(out->tau, 0, s->fault == FAULT_NAN ? NAN : at->input[0] - at->input[1] * at->q[0]);
    put(out->tau_q, 0, -at->input[1]);
    put(out->tau_w, 0, 1);
    put(out->tau_w, 1, -at->q[0]);
    return MHE_OK;
}

static mhe_status push_input(const void *self, double t, double *w, mhe_error *err) {
    (void)self, (void)err;
    w[0] = 0.8 * sin(6 * t);
    w[1] = 0.5;
    return MHE_OK;
}

static mhe_status push_covers(const void *self, double *first, double *last, mhe_error *err) {
    const struct push *s = self;
    (void)err;
    *first = 0;
    *last = s->fault == FAULT_SHORT ? 0.1 : 1e9;
    return MHE_OK;
}

static const mhe_option push_options[] = {
    MHE_OPT_ENUM(struct push_config, fault, "none", "none|nan|short", "What is wrong with it."),
};

static const mhe_force_ops push_ops = {.size = sizeof push_ops,
                                       .create = push_create,
                                       .destroy = push_destroy,
                                       .layout = push_layout,
                                       .evaluate = push_evaluate,
                                       .input = push_input,
                                       .covers = push_covers};

static const mhe_plugin push = {.size = sizeof push,
                                .id = "test.force.push",
                                .version = "1.0.0",
                                .summary = "A torque that is an input.",
                                .iface = MHE_FORCE_IFACE,
                                .ops = &push_ops,
                                MHE_PLUGIN_OPTIONS(struct push_config, push_options)};

/* The same, fed frame by frame. */
static const mhe_force_ops fed_ops = {.size = sizeof fed_ops,
                                      .create = push_create,
                                      .destroy = push_destroy,
                                      .layout = push_layout,
                                      .evaluate = push_evaluate};

static const mhe_plugin fed = {.size = sizeof fed,
                               .id = "test.force.fed",
                               .version = "1.0.0",
                               .summary = "A torque that comes with the frames.",
                               .iface = MHE_FORCE_IFACE,
                               .ops = &fed_ops,
                               MHE_PLUGIN_OPTIONS(struct push_config, push_options)};

MHE_PLUGIN_LIBRARY(&three, &push, &fed)

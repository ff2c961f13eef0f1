/* SPDX-License-Identifier: Apache-2.0 */
/* hill.c: fibre geometry, forces, activation and fibre dynamics. */
#include "hill.h"

#include "../clones.h"
#include "elastic.h"
#include "exponential.h"

#include <math.h>

static inline void hill_fibre_here(const struct hill_muscle *m, double l, double w,
                                   struct hill_fibre *fibre) {
    double along = l - m->l_slack;
    if (m->height == 0) {
        *fibre = (struct hill_fibre){.n = along * m->inv_cos * m->inverse,
                                     .n_l = m->inv_cos * m->inverse,
                                     .s = w * m->speed,
                                     .s_w = m->speed,
                                     .pull = m->pull};
        return;
    }
    /* Constant thickness: fibre length hypot(along, height), cos(alpha) = along / length, fibre
     * velocity w cos(alpha). */
    double length = sqrt(along * along + m->height * m->height), cosine = along / length;
    double cosine_l = (1 - cosine * cosine) / length;
    *fibre = (struct hill_fibre){.n = length * m->inverse,
                                 .n_l = cosine * m->inverse,
                                 .s = w * cosine * m->speed,
                                 .s_l = w * cosine_l * m->speed,
                                 .s_w = cosine * m->speed,
                                 .pull = cosine,
                                 .pull_l = cosine_l};
    if (along <= 0) { /* a slack tendon: a pennate fibre cannot push */
        fibre->pull = fibre->pull_l = 0;
    }
}

void hill_fibre_at(const struct hill_muscle *m, double l, double w, struct hill_fibre *fibre) {
    hill_fibre_here(m, l, w, fibre);
}

/* What reports want of one muscle. */
static void hill_report(const struct hill_muscle *m, double a, double l, double w,
                        const struct hill_fibre *fibre, const mhe_muscle_values *out, int32_t i) {
    const double along = l - m->l_slack;
    struct hill_value total, passive;
    if (out->fiber_length != NULL) {
        out->fiber_length[i] = fibre->n / m->inverse;
    }
    if (out->fiber_velocity != NULL) {
        out->fiber_velocity[i] = w * (m->height == 0 ? m->inv_cos : fibre->pull);
    }
    if (out->pennation != NULL) {
        out->pennation[i] = m->height == 0 ? acos(1 / m->inv_cos) : atan2(m->height, along);
    }
    if (out->active != NULL || out->passive != NULL) {
        m->curve(m, a, fibre->n, fibre->s, &total);
        m->curve(m, 0, fibre->n, fibre->s, &passive);
    }
    if (out->active != NULL) {
        out->active[i] = m->f_max * (total.f - passive.f);
    }
    if (out->passive != NULL) {
        out->passive[i] = m->f_max * (passive.f + m->damping * fibre->s);
    }
}

static int hill_reports(const mhe_muscle_values *out) {
    return out->fiber_length != NULL || out->fiber_velocity != NULL || out->pennation != NULL ||
           out->active != NULL || out->passive != NULL;
}

/* Adds to `out` what concerns the elastic muscle i. */
static void hill_elastic_force(const struct hill *hill, int32_t i, const mhe_muscle_point *at,
                               const mhe_muscle_values *out) {
    const struct hill_muscle *m = &hill->m[i];
    const int32_t n = hill->n, z = HILL_FIBER * n + i;
    struct hill_elastic e;
    hill_elastic_at(m, at->state[i], at->state[z], at->length[i], &e);
    const struct {
        double *to;
        int32_t at;
        double value;
    } values[] = {{out->force, i, m->f_max * e.force},
                  {out->force_s, i, 0},
                  {out->force_s, z, m->f_max * e.force_z},
                  {out->force_l, i, m->f_max * e.force_l},
                  {out->force_w, i, 0},
                  {out->rate, z, e.rate},
                  {out->rate_e, z, 0},
                  {out->rate_s, n + i, 0}, /* of the activation by the fibre */
                  {out->rate_s, 2 * n + i, e.rate_a},
                  {out->rate_s, 3 * n + i, e.rate_z},
                  {out->rate_l, z, e.rate_l},
                  {out->rate_w, z, 0},
                  {out->fiber_length, i, e.n * m->l_opt},
                  {out->fiber_velocity, i, e.rate * e.cosine * m->l_opt},
                  {out->pennation, i, acos(e.cosine)},
                  {out->active, i, m->f_max * e.active},
                  {out->passive, i, m->f_max * e.passive}};
    for (size_t k = 0; k < sizeof values / sizeof values[0]; k++) {
        if (values[k].to != NULL) {
            values[k].to[values[k].at] = values[k].value;
        }
    }
}

static void hill_force(const struct hill *hill, const mhe_muscle_point *at,
                       const mhe_muscle_values *out) {
    const double *a = at->state, *l = at->length, *w = at->velocity;
    const int reports = hill_reports(out);
    for (int32_t i = 0; i < hill->n; i++) {
        struct hill_fibre fibre;
        struct hill_value value;
        i = reports ? i : hill_forces_of_many(hill, i, at, out);
        if (i == hill->n) {
            return;
        }
        const struct hill_muscle *m = &hill->m[i];
        if (m->elastic) {
            hill_elastic_force(hill, i, at, out);
            continue;
        }
        hill_fibre_here(m, l[i], w[i], &fibre);
        m->curve(m, a[i], fibre.n, fibre.s, &value);
        double along = value.f + m->damping * fibre.s;
        double along_s = value.f_s + m->damping;
        if (out->force != NULL) {
            out->force[i] = m->f_max * along * fibre.pull;
        }
        if (out->force_s != NULL) {
            out->force_s[i] = m->f_max * value.f_a * fibre.pull;
        }
        if (out->force_l != NULL) {
            out->force_l[i] =
                m->f_max *
                ((value.f_n * fibre.n_l + along_s * fibre.s_l) * fibre.pull + along * fibre.pull_l);
        }
        if (out->force_w != NULL) {
            out->force_w[i] = m->f_max * along_s * fibre.s_w * fibre.pull;
        }
        if (reports) {
            hill_report(m, a[i], l[i], w[i], &fibre, out, i);
        }
    }
}

/* De Groote et al. (2016): d = e - a, f = 0.5 tanh(b d), z = 0.5 + 1.5 a,
 * rate = ((0.5 + f) / (tau_act z) + (0.5 - f) z / tau_deact) d. No branch: the compiler takes
 * several muscles at a time. */
CLONES static void hill_rates(const struct hill *hill, const double *restrict e,
                              const double *restrict a, double *restrict rate,
                              double *restrict rate_e, double *restrict rate_a) {
    const double *restrict act = hill->rate_act, *restrict deact = hill->rate_deact;
    const double b = hill->smoothing;
    const int32_t n = hill->n;
    for (int32_t i = 0; i < n; i++) {
        double d = e[i] - a[i], f = 0.5 * hill_tanh(b * d), z = 0.5 + 1.5 * a[i];
        double up = act[i] / z, down = deact[i] * z;
        double speed = (0.5 + f) * up + (0.5 - f) * down;
        double by_d = speed + d * 0.5 * b * (1 - 4 * f * f) * (up - down);
        rate[i] = speed * d;
        rate_e[i] = by_d;
        rate_a[i] = 1.5 * d / z * ((0.5 - f) * down - (0.5 + f) * up) - by_d;
    }
}

/* The activation's, the only state that is diagonal. */
static mhe_status hill_diagonal_rate(const void *self, int32_t k, const double *e, const double *a,
                                     double *rate, double *rate_e, double *rate_a, mhe_error *err) {
    const struct hill *hill = self;
    (void)k;
    for (int32_t i = 0; i < hill->n; i++) {
        if (0.5 + 1.5 * a[i] <= 0) {
            return mhe_fail(err, MHE_RETRY, "muscle %d: activation %g is not above -1/3", i, a[i]);
        }
    }
    if (rate_e != NULL && rate_a != NULL) {
        hill_rates(hill, e, a, rate, rate_e, rate_a);
        return MHE_OK;
    }
    for (int32_t i = 0; i < hill->n; i++) {
        double unwanted[3];
        const struct hill one = {.n = 1,
                                 .smoothing = hill->smoothing,
                                 .rate_act = hill->rate_act + i,
                                 .rate_deact = hill->rate_deact + i};
        hill_rates(&one, e + i, a + i, rate != NULL ? rate + i : &unwanted[2],
                   rate_e != NULL ? rate_e + i : &unwanted[0],
                   rate_a != NULL ? rate_a + i : &unwanted[1]);
    }
    return MHE_OK;
}

static void hill_zero(double *values, int32_t n) {
    for (int32_t i = 0; values != NULL && i < n; i++) {
        values[i] = 0;
    }
}

static mhe_status hill_evaluate(const void *self, const mhe_muscle_point *at,
                                const mhe_muscle_values *out, mhe_error *err) {
    const struct hill *hill = self;
    const int32_t n = hill->n, n_s = hill->n_states;
    hill_zero(out->rate_l, n_s * n);
    hill_zero(out->rate_w, n_s * n);
    if (n_s > 1) { /* of muscles that lack a state */
        hill_zero(out->force_s, n_s * n);
        hill_zero(out->rate, n_s * n);
        hill_zero(out->rate_e, n_s * n);
        hill_zero(out->rate_s, n_s * n_s * n);
    }
    hill_force(hill, at, out);
    if (out->force_p != NULL || out->rate_p != NULL) {
        hill_by_parameters(hill, at, out);
    }
    return out->rate == NULL && out->rate_e == NULL && out->rate_s == NULL
               ? MHE_OK
               : hill_diagonal_rate(self, HILL_ACTIVATION, at->excitation, at->state, out->rate,
                                    out->rate_e, out->rate_s, err);
}

static mhe_status hill_layout(const void *self, mhe_muscle_layout *out, mhe_error *err) {
    static const char *const names[] = {"activation", "fiber_length"};
    static const char *const units[] = {"1", "1"};
    static const uint8_t diagonal[] = {1, 0};
    const struct hill *hill = self;
    (void)err;
    out->n_states = hill->n_states;
    out->activation = HILL_ACTIVATION;
    out->names = names;
    out->units = units;
    out->diagonal = diagonal;
    out->lower = hill->lower;
    out->upper = hill->upper;
    out->present = hill->present;
    out->n_parameters = hill_parameters(&out->parameter_names);
    return MHE_OK;
}

static mhe_status hill_equilibrium(const void *self, const double *activation, const double *length,
                                   const double *velocity, double *state, mhe_error *err) {
    const struct hill *hill = self;
    (void)err;
    for (int32_t i = 0; i < hill->n; i++) {
        state[i] = activation[i];
        if (hill->m[i].elastic) {
            state[HILL_FIBER * hill->n + i] =
                hill_elastic_equilibrium(&hill->m[i], activation[i], length[i], velocity[i]);
        }
    }
    return MHE_OK;
}

const mhe_muscle_ops hill_ops = {.size = sizeof hill_ops,
                                 .create = hill_create,
                                 .destroy = hill_destroy,
                                 .layout = hill_layout,
                                 .evaluate = hill_evaluate,
                                 .diagonal_rate = hill_diagonal_rate,
                                 .equilibrium = hill_equilibrium};

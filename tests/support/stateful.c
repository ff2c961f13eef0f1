/* SPDX-License-Identifier: Apache-2.0 */
#include "stateful.h"

#include <math.h>
#include <string.h>

#define Q SYSTEM_Q
#define M SYSTEM_M
#define K 3000.0
#define MOST 3 /* states of a muscle in z */

static const double arm[M][Q] = {{0.03, 0.01}, {-0.04, 0.02}, {0.0, -0.02}};
static const double inertia[Q] = {0.2, 0.1}, spring[Q] = {3, 2}, damper[Q] = {0.3, 0.2};

/* z state by state: activations where inside, f of muscles 0 and 1, g of muscle 0. */
static const int32_t outside_muscle[] = {0, 1, 0};
static const int32_t outside_of[M * 2] = {0, 2, 1, -1, -1, -1};
static const int32_t inside_muscle[] = {0, 1, 2, 0, 1, 0};
static const int32_t inside_of[M * MOST] = {0, 3, 5, 1, 4, -1, 2, -1, -1};

/* Entries of z of a muscle; -1: none. */
struct places {
    int32_t a, f, g;
};

static struct places places_of(const mhe_system *s, int32_t m) {
    int32_t skip = s->n_a > 0 ? 0 : M;
    return (struct places){s->n_a > 0 ? -1 : m, m < 2 ? skip + m : -1, m < 1 ? skip + 2 : -1};
}

/* Which of its muscle's entries a place is. */
static int32_t rank(const mhe_system *s, int32_t m, int32_t place) {
    int32_t k = 0;
    while (s->z_of[m * s->n_k + k] != place) {
        k++;
    }
    return k;
}

static void rates(const mhe_system *s, const mhe_system_point *at, int32_t m, double a, double y,
                  double yd, const mhe_acceleration *out) {
    const struct places p = places_of(s, m);
    const double *z = at->z;
    const double f = p.f >= 0 ? z[p.f] : 0, g = p.g >= 0 ? z[p.g] : 0, c = at->c[m];
    const int32_t n_k = s->n_k;
    const struct {
        int32_t place;
        double rate, by_y, by_yd, by_a, by_c, by_f, by_g;
    } rows[] = {
        {p.a, (c - a) / 0.015 * (1 + 0.2 * a) + 0.1 * yd, 0, 0.1,
         -(1 + 0.2 * a) / 0.015 + 0.2 * (c - a) / 0.015, (1 + 0.2 * a) / 0.015, 0, 0},
        {p.f,
         K * (y - f) + 0.3 * K * (y - f) * (y - f) * (y - f) - 30 * a * (1 + f * f) + 50 * g +
             2 * c,
         K + 0.9 * K * (y - f) * (y - f), 0, -30 * (1 + f * f), 2,
         -K - 0.9 * K * (y - f) * (y - f) - 60 * a * f, p.g >= 0 ? 50 : 0},
        {p.g, -400 * (g - f) + 20 * g * g + 0.5 * yd + 5 * a, 0, 0.5, 5, 0, 400, -400 + 40 * g}};
    for (int r = 0; r < 3; r++) {
        int32_t i = rows[r].place;
        if (i < 0) {
            continue;
        }
        out->zdot[i] = rows[r].rate;
        for (int j = 0; j < Q && out->zdot_q != NULL; j++) {
            out->zdot_q[i * Q + j] = -10 * arm[m][j] * rows[r].by_y;
            out->zdot_v[i * Q + j] = -10 * arm[m][j] * rows[r].by_yd;
        }
        if (out->zdot_c != NULL) {
            out->zdot_c[i] = rows[r].by_c;
        }
        if (out->zdot_a != NULL && s->n_a > 0) {
            out->zdot_a[i] = rows[r].by_a;
        }
        if (out->zdot_z != NULL) {
            memset(out->zdot_z + i * n_k, 0, sizeof(double) * (size_t)n_k);
            if (p.a >= 0) {
                out->zdot_z[i * n_k + rank(s, m, p.a)] = rows[r].by_a;
            }
            if (p.f >= 0) {
                out->zdot_z[i * n_k + rank(s, m, p.f)] = rows[r].by_f;
            }
            if (p.g >= 0) {
                out->zdot_z[i * n_k + rank(s, m, p.g)] = rows[r].by_g;
            }
        }
    }
}

static mhe_status acceleration(const mhe_system *s, void *context, const mhe_system_point *at,
                               const mhe_acceleration *out, mhe_error *err) {
    (void)context;
    const int32_t n_z = s->n_z, derivatives = out->vdot_q != NULL;
    if (!(fabs(at->q[0]) < 10)) {
        return mhe_fail(err, MHE_RETRY, "outside");
    }
    for (int i = 0; i < Q; i++) {
        out->vdot[i] = -(spring[i] * at->q[i] + damper[i] * at->v[i]) / inertia[i];
        out->vdot[i] += s->n_r > 0 ? at->r[i] / inertia[i] : 0;
        for (int j = 0; j < Q && derivatives; j++) {
            out->vdot_q[i * Q + j] = i == j ? -spring[i] / inertia[i] : 0;
            out->vdot_v[i * Q + j] = i == j ? -damper[i] / inertia[i] : 0;
            if (out->vdot_r != NULL && s->n_r > 0) {
                out->vdot_r[i * Q + j] = i == j ? 1 / inertia[i] : 0;
            }
        }
        for (int32_t k = 0; k < n_z && out->vdot_z != NULL; k++) {
            out->vdot_z[i * n_z + k] = 0;
        }
    }
    for (int32_t m = 0; m < M; m++) {
        const struct places p = places_of(s, m);
        double a = s->n_a > 0 ? at->a[m] : at->z[p.a];
        double y = 1 - 10 * (arm[m][0] * at->q[0] + arm[m][1] * at->q[1]);
        double yd = -10 * (arm[m][0] * at->v[0] + arm[m][1] * at->v[1]);
        double force =
            100 * (y - (p.f >= 0 ? at->z[p.f] : 1)) + 20 * a + (p.g >= 0 ? 3 * at->z[p.g] : 0);
        for (int i = 0; i < Q; i++) {
            double gain = arm[m][i] / inertia[i];
            out->vdot[i] += gain * force;
            for (int j = 0; j < Q && derivatives; j++) {
                out->vdot_q[i * Q + j] -= gain * 100 * 10 * arm[m][j];
            }
            if (out->vdot_a != NULL && s->n_a > 0) {
                out->vdot_a[i * M + m] = gain * 20;
            }
            if (out->vdot_z == NULL) {
                continue;
            }
            if (p.a >= 0) {
                out->vdot_z[i * n_z + p.a] = gain * 20;
            }
            if (p.f >= 0) {
                out->vdot_z[i * n_z + p.f] = gain * -100;
            }
            if (p.g >= 0) {
                out->vdot_z[i * n_z + p.g] = gain * 3;
            }
        }
        if (out->zdot != NULL) {
            rates(s, at, m, a, y, yd, out);
        }
    }
    return MHE_OK;
}

void test_stateful_system(int32_t flags, mhe_system *out) {
    const int inside = (flags & STATEFUL_INSIDE) != 0;
    test_pendulum_system(flags & (SYSTEM_EXCITATION | SYSTEM_RESIDUALS), out);
    out->acceleration = acceleration;
    out->n_a = inside ? 0 : M;
    out->n_d = inside ? 0 : out->n_d;
    out->n_z = inside ? 6 : 3;
    out->n_k = inside ? 3 : 2;
    out->z_muscle = inside ? inside_muscle : outside_muscle;
    out->z_of = inside ? inside_of : outside_of;
    out->first_z = out->first_d + out->n_d;
    out->n_x = out->first_z + out->n_z;
}

void test_stateful_state(const mhe_system *system, uint64_t *seed, double *x, double *u) {
    for (int i = 0; i < 2 * Q; i++) {
        x[i] = test_random(seed, -0.4, 0.4) * (i < Q ? 1 : 4);
    }
    for (int i = 2 * Q; i < 2 * Q + system->n_d; i++) {
        x[i] = test_random(seed, 0, 1);
    }
    for (int32_t i = 0; i < system->n_z; i++) {
        x[2 * Q + system->n_d + i] = test_random(seed, 0.7, 1.1);
    }
    for (int i = 0; i < system->n_u; i++) {
        u[i] = i < M ? test_random(seed, 0, 1) : test_random(seed, -3, 3);
    }
}

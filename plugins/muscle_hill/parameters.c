/* SPDX-License-Identifier: Apache-2.0 */
/* parameters.c: derivatives of forces and fibre rates by numbers of the description.
 *
 * A force is F_max times a function of normalised lengths. On a rigid tendon the fibre lies along
 * L - l_slack, so that dF/dl_slack = -dF/dL; with h = l_opt sin(pennation) the thickness and m =
 * hypot(L - l_slack, h) the fibre, l_opt acts on n = m / l_opt, on the velocity and on the
 * pennation; where curves switch at the slack length, both act there too. With an elastic tendon
 * both act on its stretch x = (L - z l_opt) / l_slack alone. */
#include "elastic.h"
#include "hill.h"

#include <math.h>

enum { STRENGTH, FIBER, SLACK, N_PARAMETERS };

int32_t hill_parameters(const char *const **names) {
    static const char *const all[] = {"max_isometric_force", "optimal_fiber_length",
                                      "tendon_slack_length"};
    *names = all;
    return N_PARAMETERS;
}

static void hill_rigid_by(const struct hill_muscle *m, double a, double l, double w,
                          double by[N_PARAMETERS]) {
    struct hill_fibre fibre;
    struct hill_value value;
    hill_fibre_at(m, l, w, &fibre);
    m->curve(m, a, fibre.n, fibre.s, &value);
    const double along = value.f + m->damping * fibre.s, along_s = value.f_s + m->damping;
    by[STRENGTH] = along * fibre.pull;
    const double by_from = m->passive_by == NULL ? 0 : m->passive_by(m, fibre.n);
    by[SLACK] = -m->f_max *
                ((value.f_n * fibre.n_l + along_s * fibre.s_l - by_from * m->inverse) * fibre.pull +
                 along * fibre.pull_l);
    double length_o = 0, cosine_o = 0; /* of the fibre and of cos(pennation), by l_opt */
    const double x = l - m->l_slack;
    if (m->height != 0) {
        const double length = sqrt(x * x + m->height * m->height);
        length_o = m->height * m->height * m->inverse / length;
        cosine_o = -x * length_o / (length * length);
    }
    const double n_o = (length_o - fibre.n) * m->inverse;
    const double s_o = w * m->speed * cosine_o + fibre.s * m->speed_o / m->speed;
    const double along_o = m->damping_o * fibre.s - by_from * m->passive_from * m->inverse;
    const double pull_o = fibre.pull == 0 ? 0 : cosine_o;
    by[FIBER] =
        m->f_max * ((value.f_n * n_o + along_s * s_o + along_o) * fibre.pull + along * pull_o);
}

void hill_by_parameters(const struct hill *hill, const mhe_muscle_point *at,
                        const mhe_muscle_values *out) {
    const char *const *names = NULL;
    const int32_t n = hill->n, n_p = hill_parameters(&names), all = n_p * hill->n_states * n;
    for (int32_t i = 0; i < all && out->rate_p != NULL; i++) {
        out->rate_p[i] = 0; /* activations see none of them */
    }
    for (int32_t i = 0; i < n; i++) {
        const struct hill_muscle *m = &hill->m[i];
        double by[N_PARAMETERS], rate_by[N_PARAMETERS] = {0};
        if (m->elastic) {
            const double z = at->state[HILL_FIBER * n + i];
            struct hill_elastic e;
            hill_elastic_at(m, at->state[i], z, at->length[i], &e);
            by[STRENGTH] = e.force;
            by[FIBER] = -m->f_max * e.force_x * z / m->l_slack;
            by[SLACK] = -m->f_max * e.force_x * e.x / m->l_slack;
            rate_by[FIBER] = -e.rate_x * z / m->l_slack;
            rate_by[SLACK] = -e.rate_x * e.x / m->l_slack;
        } else {
            hill_rigid_by(m, at->state[i], at->length[i], at->velocity[i], by);
        }
        for (int32_t p = 0; p < n_p; p++) {
            if (out->force_p != NULL) {
                out->force_p[p * n + i] = by[p];
            }
            if (out->rate_p != NULL && m->elastic) {
                out->rate_p[(p * hill->n_states + HILL_FIBER) * n + i] = rate_by[p];
            }
        }
    }
}

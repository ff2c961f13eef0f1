/* SPDX-License-Identifier: Apache-2.0 */
/* active_chain.c: the bounds of one control and its simple state, along the window.
 *
 * A control at its bound drives its state over one of the state's, which takes the control off its
 * bound again and the one before with it, and so on from stage to stage: each a set, and a Newton
 * system, of the whole program. But all that ties the pair to others are pulls. With these as they
 * are its bounds are followed to their end here, in scalars. */
#include "active.h"

#include <math.h>

typedef struct chain {
    qp *q;
    int32_t j, u, x;         /* which of the simple states; its control, its place in a row of x */
    double *p, *s, *K, *v;   /* cost to go 1/2 p a^2 + s a; control v - K a */
    double *e, *a;           /* [N], [N+1] */
    double *pull_e, *pull_a; /* slopes at 0 without what the pair itself has part in */
    double *because;         /* [N+1] the side to which the state was taken by its control */
} chain;

static double curvature(const qp *q, ptrdiff_t at) {
    const qp_shape *s = q->shape;
    return q->stages[at / s->ld_z].H[(at % s->ld_z) * (s->ld_z + 1)];
}

static ptrdiff_t e_at(const chain *c, int32_t k) {
    return (ptrdiff_t)k * c->q->shape->ld_z + c->u;
}

/* The simple state of stage k is a variable. */
static int32_t is_free(const chain *c, int32_t k) {
    return k > 0 || !c->q->fixed[(ptrdiff_t)c->q->shape->n_u + c->x];
}

static ptrdiff_t a_at(const chain *c, int32_t k) {
    return (ptrdiff_t)k * c->q->shape->ld_z + c->q->shape->n_u + c->x;
}

static chain open(qp *q, int32_t j) {
    const qp_shape *s = q->shape;
    const int32_t n = s->N + 1;
    double *m = q->rest_w; /* has 16 a stage */
    chain c = {.q = q, .j = j, .x = s->n_dense + j, .u = s->control_of[s->n_dense + j]};
    double **const arrays[] = {&c.p, &c.s,      &c.K,      &c.v,      &c.e,
                               &c.a, &c.pull_e, &c.pull_a, &c.because};
    for (size_t i = 0; i < sizeof arrays / sizeof arrays[0]; i++) {
        *arrays[i] = m + (ptrdiff_t)i * n;
    }
    for (int32_t k = 0; k <= s->N; k++) {
        const ptrdiff_t e = e_at(&c, k), a = a_at(&c, k);
        const double before = k > 0 ? row_x(s, q->lambda, k - 1)[c.x] : 0;
        const double after = k < s->N ? row_x(s, q->lambda, k)[c.x] : 0;
        const qp_stage *stage = &q->stages[k];
        c.pull_a[k] = q->slope[a] - curvature(q, a) * q->w[a] - before;
        if (k < s->N) {
            c.pull_a[k] += stage->by_state[c.x] * after;
            c.pull_e[k] = q->slope[e] - curvature(q, e) * q->w[e] + stage->by_control[c.x] * after;
        }
    }
    return c;
}

static void sweep_back(const chain *c) {
    const qp *q = c->q;
    const int32_t N = q->shape->N;
    for (int32_t k = N; k >= 0; k--) {
        const ptrdiff_t e = e_at(c, k), a = a_at(c, k);
        double p = curvature(q, a), s = c->pull_a[k];
        if (k < N) {
            const double alpha = q->stages[k].by_state[c->x], beta = q->stages[k].by_control[c->x];
            const double r = curvature(q, e), next = c->p[k + 1];
            double t = next * q->stages[k].b[c->x] + c->s[k + 1];
            if (q->fixed[e] || q->side[e] != 0) {
                c->K[k] = 0;
                c->v[k] = active_bound(q, e);
                t += next * beta * c->v[k];
                p += alpha * alpha * next;
                s += alpha * t;
            } else {
                const double all = r + beta * beta * next, slope = c->pull_e[k] + beta * t;
                c->K[k] = alpha * beta * next / all;
                c->v[k] = -slope / all;
                p += alpha * alpha * next * r / all;
                s += alpha * t - c->K[k] * slope;
            }
        }
        const int32_t held = is_free(c, k) && q->side[a] != 0;
        c->p[k] = p + (held ? ACTIVE_HOLD : 0);
        c->s[k] = s - (held ? ACTIVE_HOLD * active_bound(q, a) : 0);
    }
}

static void sweep_forward(const chain *c) {
    const qp *q = c->q;
    c->a[0] = is_free(c, 0) ? -c->s[0] / c->p[0] : q->w[a_at(c, 0)];
    for (int32_t k = 0; k < q->shape->N; k++) {
        const qp_stage *stage = &q->stages[k];
        c->e[k] = c->v[k] - c->K[k] * c->a[k];
        c->a[k + 1] =
            stage->by_state[c->x] * c->a[k] + stage->by_control[c->x] * c->e[k] + stage->b[c->x];
    }
}

/* Where a variable that no bound holds lies beyond one. */
static double over(const qp *q, ptrdiff_t at, double w, double crossed) {
    return q->side[at] != 0             ? 0
           : w < q->lower[at] - crossed ? -1
           : w > q->upper[at] + crossed ? 1
                                        : 0;
}

/* States that a control took over their bounds, at once or some stages before. */
static void find_reasons(const chain *c, double crossed) {
    const qp *q = c->q;
    c->because[0] = 0;
    for (int32_t k = 0; k < q->shape->N; k++) {
        const double control = q->fixed[e_at(c, k)] ? 0 : over(q, e_at(c, k), c->e[k], crossed);
        const double reason = control != 0 ? control : c->because[k];
        c->because[k + 1] = over(q, a_at(c, k + 1), c->a[k + 1], crossed) == reason ? reason : 0;
    }
}

/* The next sets; how many bounds changed. */
static int32_t update(const chain *c, double crossed, double pulled) {
    qp *q = c->q;
    const int32_t N = q->shape->N;
    int32_t changes = 0;
    double multiplier = 0; /* of the dynamics behind stage k */
    find_reasons(c, crossed);
    for (int32_t k = N; k >= 0; k--) {
        const ptrdiff_t e = e_at(c, k), a = a_at(c, k);
        if (k < N && !q->fixed[e]) {
            const double y = curvature(q, e) * c->e[k] + c->pull_e[k] -
                             q->stages[k].by_control[c->x] * multiplier;
            changes += active_turn(q, e, c->e[k], y, crossed, pulled);
        }
        if (is_free(c, k)) {
            const int32_t held = q->side[a] != 0;
            const double y = held ? -ACTIVE_HOLD * (c->a[k] - active_bound(q, a)) : 0;
            multiplier = y - curvature(q, a) * c->a[k] - c->pull_a[k] +
                         (k < N ? q->stages[k].by_state[c->x] * multiplier : 0);
            changes += c->because[k] == 0 && active_turn(q, a, c->a[k], y, crossed, pulled);
        }
    }
    return changes;
}

void active_follow(qp *q, int32_t j, double crossed, double pulled) {
    const chain c = open(q, j);
    for (int32_t i = 0; i < 3 * q->shape->N + 8; i++) {
        q->sweeps++;
        sweep_back(&c);
        sweep_forward(&c);
        if (update(&c, crossed, pulled) == 0) {
            return;
        }
    }
}

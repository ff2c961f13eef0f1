/* SPDX-License-Identifier: Apache-2.0 */
#include "bezier.h"

#include <math.h>
#include <stddef.h>

/* Slopes nearer than this count as equal: their tangents have no intersection to speak of. */
#define HILL_PARALLEL 1.5e-8
#define HILL_NEWTON 30

/* Power series of the Bezier curve with control values p0, p1, p1, p2, p2, p3. */
static void hill_power(double p0, double p1, double p2, double p3, double *c) {
    c[0] = p0;
    c[1] = 5 * (p1 - p0);
    c[2] = 10 * (p0 - p1);
    c[3] = 10 * (p2 - p0);
    c[4] = 5 * (p0 + 2 * p1 - 3 * p2);
    c[5] = p3 - p0 - c[1] - c[2] - c[3] - c[4];
}

/* Value and the first two derivatives of a power series at u. */
static inline void hill_series(const double *c, double u, double out[3]) {
    double f = c[5], d = 0, dd = 0;
    for (int k = 4; k >= 0; k--) {
        dd = dd * u + d;
        d = d * u + f;
        f = f * u + c[k];
    }
    out[0] = f;
    out[1] = d;
    out[2] = 2 * dd;
}

/* u with c(u) = x, c an increasing power series. Newton, kept between the last values on either
 * side. */
static double hill_series_root(const double *c, double x, double guess) {
    double lower = 0, upper = 1, u = guess;
    for (int i = 0; i < HILL_NEWTON; i++) {
        double f = c[5], slope = 0;
        for (int k = 4; k >= 0; k--) {
            slope = slope * u + f;
            f = f * u + c[k];
        }
        double off = f - x;
        if (off > 0) {
            upper = u;
        } else {
            lower = u;
        }
        double next = u - off / slope;
        if (!(next >= lower && next <= upper)) {
            next = 0.5 * (lower + upper);
        }
        double change = fabs(next - u);
        u = next;
        if (change < 1e-8) { /* what is left is of the order of its square */
            break;
        }
    }
    return u;
}

static void hill_corner_make(const struct hill_joint *a, const struct hill_joint *b,
                             double curviness, struct hill_corner *out) {
    double c = 0.1 + 0.8 * curviness, x, y;
    if (fabs(a->slope - b->slope) < HILL_PARALLEL) {
        x = 0.5 * (a->x + b->x);
    } else {
        x = (b->y - a->y - b->x * b->slope + a->x * a->slope) / (a->slope - b->slope);
    }
    y = b->y + (x - b->x) * b->slope;
    out->x0 = a->x;
    out->x1 = b->x;
    out->y1 = b->y;
    hill_power(a->x, a->x + c * (x - a->x), b->x + c * (x - b->x), b->x, out->x);
    hill_power(a->y, a->y + c * (y - a->y), b->y + c * (y - b->y), b->y, out->y);
    out->u[0] = 0;
    out->cells = HILL_CELLS / (b->x - a->x);
    for (int k = 1; k <= HILL_CELLS; k++) {
        double t = (double)k / HILL_CELLS;
        out->u[k] =
            k < HILL_CELLS ? hill_series_root(out->x, a->x + t * (b->x - a->x), out->u[k - 1]) : 1;
    }
    for (int k = 0; k <= HILL_CELLS; k++) {
        double at[3];
        hill_series(out->x, out->u[k], at);
        out->slope[k] = 1 / (at[1] * out->cells);
    }
}

/* u at x, nearly: a cubic between the ends of its cell. */
static double hill_corner_guess(const struct hill_corner *corner, double x) {
    double cell = (x - corner->x0) * corner->cells;
    int k = cell < HILL_CELLS ? (int)cell : HILL_CELLS - 1;
    double t = cell - k, rest = 1 - t, u0 = corner->u[k], u1 = corner->u[k + 1];
    return u0 + t * (u1 - u0) +
           t * rest *
               (rest * (corner->slope[k] - (u1 - u0)) - t * (corner->slope[k + 1] - (u1 - u0)));
}

void hill_chain_make(const struct hill_joint *joints, const double *curviness, int32_t n,
                     struct hill_chain *out) {
    out->n = n;
    out->first = joints[0];
    out->last = joints[n];
    for (int32_t i = 0; i < n; i++) {
        hill_corner_make(&joints[i], &joints[i + 1], curviness[i], &out->corner[i]);
    }
}

static struct hill_chain_value hill_line(const struct hill_joint *from, double x) {
    return (struct hill_chain_value){from->y + from->slope * (x - from->x), from->slope, 0};
}

/* The curve of a corner at u. */
static struct hill_chain_value hill_corner_at(const struct hill_corner *corner, double u) {
    double at_x[3], at_y[3];
    hill_series(corner->x, u, at_x);
    hill_series(corner->y, u, at_y);
    double inverse = 1 / at_x[1];
    return (struct hill_chain_value){at_y[0], at_y[1] * inverse,
                                     (at_y[2] * at_x[1] - at_y[1] * at_x[2]) * inverse * inverse *
                                         inverse};
}

struct hill_chain_value hill_chain_at(const struct hill_chain *chain, double x) {
    if (!(x > chain->first.x)) { /* NaN gives NaN */
        return hill_line(&chain->first, x);
    }
    if (x >= chain->last.x) {
        return hill_line(&chain->last, x);
    }
    int32_t i = 0;
    while (i < chain->n - 1 && x >= chain->corner[i].x1) {
        i++;
    }
    const struct hill_corner *corner = &chain->corner[i];
    return hill_corner_at(corner, hill_series_root(corner->x, x, hill_corner_guess(corner, x)));
}

struct hill_chain_value hill_chain_solve(const struct hill_chain *chain, double gain, double weight,
                                         double sum, double *x) {
    const struct hill_joint *first = &chain->first, *last = &chain->last;
    const struct hill_joint *line = NULL;
    if (!(sum > gain * first->y + weight * first->x)) { /* NaN gives NaN */
        line = first;
    } else if (sum >= gain * last->y + weight * last->x) {
        line = last;
    }
    if (line != NULL) {
        *x = (sum - gain * (line->y - line->slope * line->x)) / (gain * line->slope + weight);
        return hill_line(line, *x);
    }
    int32_t i = 0;
    double c[6], from = 0, to = 0;
    for (;; i++) {
        const struct hill_corner *corner = &chain->corner[i];
        to = gain * corner->y1 + weight * corner->x1;
        if (sum < to || i == chain->n - 1) {
            break;
        }
    }
    const struct hill_corner *corner = &chain->corner[i];
    for (int k = 0; k < 6; k++) {
        c[k] = gain * corner->y[k] + weight * corner->x[k];
    }
    from = c[0];
    double u = hill_series_root(c, sum, to > from ? (sum - from) / (to - from) : 0.5);
    double at[3];
    hill_series(corner->x, u, at);
    *x = at[0];
    return hill_corner_at(corner, u);
}

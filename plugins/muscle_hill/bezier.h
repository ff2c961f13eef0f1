/* SPDX-License-Identifier: Apache-2.0 */
/* bezier.h: curves that are chains of quintic Bezier corners (Millard et al. 2013,
 * doi:10.1115/1.4023390): twice continuously differentiable, straight lines outside. */
#ifndef MUSCLE_HILL_BEZIER_H
#define MUSCLE_HILL_BEZIER_H

#include <stdint.h>

#define HILL_CORNERS 5
#define HILL_CELLS 32

/* Where a corner begins or ends. */
struct hill_joint {
    double x, y, slope;
};

/* A segment: x(u), y(u) for u in 0..1 as power series, and to start from u and its slope by cells
 * at equal parts of x. */
struct hill_corner {
    double x0, x1, y1, cells; /* the last: of each unit of x */
    double x[6], y[6];
    double u[HILL_CELLS + 1], slope[HILL_CELLS + 1];
};

struct hill_chain {
    int32_t n;
    struct hill_joint first, last;
    struct hill_corner corner[HILL_CORNERS];
};

struct hill_chain_value {
    double value, slope, curvature;
};

/* The chain over joints [n + 1], x increasing; curviness [n], each 0..1. */
void hill_chain_make(const struct hill_joint *joints, const double *curviness, int32_t n,
                     struct hill_chain *out);

struct hill_chain_value hill_chain_at(const struct hill_chain *chain, double x);

/* The x, and the curve there, with gain y(x) + weight x = sum; that must increase with x. */
struct hill_chain_value hill_chain_solve(const struct hill_chain *chain, double gain, double weight,
                                         double sum, double *x);

#endif

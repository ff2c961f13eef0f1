/* SPDX-License-Identifier: Apache-2.0 */
/* shapes.h: the elementary curves that several sets are made of, each with its derivative. */
#ifndef MUSCLE_HILL_SHAPES_H
#define MUSCLE_HILL_SHAPES_H

#include "hill.h"

#include <math.h>

/* A value and its derivative by the curve's own argument, n or s. */
struct hill_shape {
    double value, slope;
};

/* Puts a fl fv + fp together; fl_a is the slope of fl by activation. */
static inline void hill_total(double a, struct hill_shape fl, double fl_a, struct hill_shape fv,
                              struct hill_shape fp, struct hill_value *out) {
    out->f = a * fl.value * fv.value + fp.value;
    out->f_a = (fl.value + a * fl_a) * fv.value;
    out->f_n = a * fl.slope * fv.value + fp.slope;
    out->f_s = a * fl.value * fv.slope;
}

/* exp(-(x - 1)^2 / width). */
static inline struct hill_shape hill_bell(double x, double width) {
    double value = exp(-(x - 1) * (x - 1) / width);
    return (struct hill_shape){value, -2 * (x - 1) / width * value};
}

/* The bell of width 0.45 over n / (0.15 (1 - a) + 1): its optimum moves with activation. */
struct hill_shape hill_moving_bell(double a, double n, double *fl_a);

/* (exp(rate (n - 1)) - offset) scale. */
static inline struct hill_shape hill_exponential(double n, double rate, double offset,
                                                 double scale) {
    double grown = exp(rate * (n - 1)) * scale;
    return (struct hill_shape){grown - offset * scale, rate * grown};
}

/* Cubic step of slope 0 at both ends: 0 at t = 0, 1 at t = 1. */
static inline struct hill_shape hill_rise(double t) {
    return (struct hill_shape){t * t * (3 - 2 * t), 6 * t * (1 - t)};
}

/* Sum over i of b[i][0] exp(-0.5 (n - b[i][1])^2 / (b[i][2] + b[i][3] n)^2)
 * (De Groote et al. 2016, doi:10.1007/s10439-016-1591-9). */
struct hill_shape hill_three_bells(const double b[3][4], double n);

/* d[0] ln(y + sqrt(y^2 + 1)) + d[3], y = d[1] s + d[2] (De Groote et al. 2016). */
struct hill_shape hill_log_velocity(const double d[4], double s);

/* Force-velocity of the types `hill`: hyperbolae through 1 at rest. At s = 0, where the slope jumps
 * from 4 on the lengthening side to 2, the slope is that of shortening. */
struct hill_shape hill_hyperbola(double s);

#endif

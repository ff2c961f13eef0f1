/* SPDX-License-Identifier: Apache-2.0 */
#include "shapes.h"

struct hill_shape hill_moving_bell(double a, double n, double *fl_a) {
    double optimum = 0.15 * (1 - a) + 1;
    struct hill_shape fl = hill_bell(n / optimum, 0.45);
    fl.slope /= optimum;
    *fl_a = fl.slope * n * 0.15 / optimum;
    return fl;
}

struct hill_shape hill_three_bells(const double b[3][4], double n) {
    struct hill_shape sum = {0, 0};
    for (int i = 0; i < 3; i++) {
        double width = b[i][2] + b[i][3] * n;
        double z = (n - b[i][1]) / width;
        /* A width of zero lies far out on the tail: there the bell is 0 to the last bit, and its
         * slope 0 times infinity in floating point. */
        if (z * z > 1400) {
            continue;
        }
        double bell = b[i][0] * exp(-0.5 * z * z);
        sum.value += bell;
        sum.slope -= bell * z * (1 - z * b[i][3]) / width;
    }
    return sum;
}

struct hill_shape hill_log_velocity(const double d[4], double s) {
    double y = d[1] * s + d[2];
    double root = sqrt(y * y + 1);
    double arsinh = copysign(log(fabs(y) + root), y); /* half the time of asinh() */
    return (struct hill_shape){d[0] * arsinh + d[3], d[0] * d[1] / root};
}

struct hill_shape hill_hyperbola(double s) {
    if (s > 0) {
        const double stretch = 0.0825, limit = 1.33;
        double under = 1 / (1 + s / stretch);
        return (struct hill_shape){(1 + limit * s / stretch) * under,
                                   (limit - 1) / stretch * under * under};
    }
    double under = 1 / (1 - s);
    return (struct hill_shape){(1 + s) * under, 2 * under * under};
}

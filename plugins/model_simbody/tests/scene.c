/* SPDX-License-Identifier: Apache-2.0 */
#include "scene.h"

#include <math.h>

void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance)) {
        fail_msg("%.17g is not %.17g", value, expected);
    }
}

scene random_scene(int32_t kind, uint64_t *seed) {
    scene c = {.surface = {.kind = kind, .side_axis = -1}};
    for (int i = 0; i < 3; i++) {
        c.surface.size[i] = test_random(seed, 0.01, 0.05);
        c.ends[i] = test_random(seed, -0.08, 0.08);
        c.ends[3 + i] = test_random(seed, -0.08, 0.08);
    }
    if (kind == MHE_OBSTACLE_CYLINDER) {
        c.surface.size[1] = 1;
    }
    if (kind == MHE_OBSTACLE_TORUS) { /* through the hole */
        c.surface.size[0] = test_random(seed, 0.005, 0.01);
        c.surface.size[1] = c.surface.size[0] + test_random(seed, 0.003, 0.02);
        for (int i = 0; i < 6; i++) {
            c.ends[i] *= i % 3 < 2 ? 0.25 : 1;
        }
        c.ends[2] = fabs(c.ends[2]);
        c.ends[5] = -fabs(c.ends[5]);
    }
    return c;
}

int solve(const scene *c, wrap_string *out) {
    return wrap_solve(&c->surface, c->ends, c->ends + 3, NULL, out);
}

void gradient(const wrap_string *string, double *y) {
    for (int i = 0; i < 3; i++) {
        y[i] = -string->t[0][i];
        y[3 + i] = string->t[1][i];
    }
}

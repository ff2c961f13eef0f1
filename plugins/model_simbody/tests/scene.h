/* SPDX-License-Identifier: Apache-2.0 */
/* scene.h: obstacles with two ends beside them, for the tests of strings. */
#ifndef SIMBODY_TEST_SCENE_H
#define SIMBODY_TEST_SCENE_H

#include "support.h"
#include "wrap/wrap.h"

typedef struct scene {
    wrap_surface surface;
    double ends[6]; /* p, s */
} scene;

void assert_near(double value, double expected, double tolerance);
scene random_scene(int32_t kind, uint64_t *seed);
int solve(const scene *c, wrap_string *out);
/* By both ends. */
void gradient(const wrap_string *string, double *y);

#endif

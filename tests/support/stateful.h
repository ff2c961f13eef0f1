/* SPDX-License-Identifier: Apache-2.0 */
/* stateful.h: a small system whose muscles have states of their own beside activations, in closed
 * form: stiff (about 3000 1/s), coupled within a muscle, none alike. */
#ifndef TEST_STATEFUL_H
#define TEST_STATEFUL_H

#include "systems.h"

/* Beside SYSTEM_EXCITATION and SYSTEM_RESIDUALS, excitation-driven: the activations are among z,
 * since their rates see the muscle's velocity. */
#define STATEFUL_INSIDE 4

#define STATEFUL_X 10 /* at most */

/* Two coordinates; muscle 0 has the states f and g, muscle 1 f, muscle 2 none:
 *     fdot = k (y - f) + 0.3 k (y - f)^3 - 30 a (1 + f^2) + 50 g + 2 c,   y = 1 - 10 arm q
 *     gdot = -400 (g - f) + 20 g^2 - 0.5 ydot + 5 a
 * and force 100 (y - f) + 20 a + 3 g, 100 (y - 1) + 20 a where there is no f. */
void test_stateful_system(int32_t flags, mhe_system *out);

/* A state near rest. */
void test_stateful_state(const mhe_system *system, uint64_t *seed, double *x, double *u);

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* forward.h: kinematics of a description by plain matrix products, to compare model files. */
#ifndef TEST_FORWARD_H
#define TEST_FORWARD_H

#include <mhe/description.h>

/* Outputs may be NULL: markers [3 n_markers], lengths [n_muscles], mass matrix [n x n] of n =
 * n_coordinates, gravity torques G(q) [n]. The last two need every function to be f(q) = q. */
void test_forward(const mhe_description *d, const double *q, double *markers, double *lengths,
                  double *mass, double *gravity);

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* leg.h: a tree of three bodies, couplers among them, with a path of every kind. */
#ifndef SIMBODY_LEG_H
#define SIMBODY_LEG_H

#include "test_models.h"

#define N_Q 6
#define N_P 9

extern const mhe_coordinate leg_coordinates[N_Q];
extern const mhe_dependent leg_dependents[2];
extern const mhe_obstacle leg_obstacles[5];
extern const mhe_path_point leg_moving[4], leg_conditional[3], leg_in_a_row[2];
extern const mhe_path_wrap leg_wraps[5], leg_row[2];
extern const mhe_path leg_paths[N_P];
extern const mhe_description leg;

/* Angles within 0.5 rad, the slider within 0.05 m. */
void leg_random(uint64_t *seed, double *q);
/* Lengths of the leg's paths with their derivatives; NULL: not wanted. A status. */
int leg_lengths(const test_instance *instance, const double *q, double *length, double *length_q,
                double *length_qq);

/* For test_jacobian_error(): length and gradient of one path of one instance. */
typedef struct leg_watch {
    const test_instance *instance;
    int32_t path;
} leg_watch;
int leg_length_of_q(void *watch, const double *q, double *y);
int leg_gradient_of_q(void *watch, const double *q, double *y);

#endif

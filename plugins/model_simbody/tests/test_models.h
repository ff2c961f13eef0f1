/* SPDX-License-Identifier: Apache-2.0 */
/* test_models.h: models made by hand, and a plugin instance opened through the loader. */
#ifndef SIMBODY_TEST_MODELS_H
#define SIMBODY_TEST_MODELS_H

#include "model.h"
#include "support.h"

/* A model, its plugin instance and one context. */
typedef struct test_instance {
    const mhe_description *description;
    const mhe_model_ops *ops;
    void *self, *context;
    int32_t n_q, n_m, n_k;
} test_instance;

/* Opens `description` with mhe.model.simbody, found by the registry; fails the test otherwise. */
void test_open(test_instance *out, const mhe_description *description, int32_t dynamics);
/* The same with paths fitted to `tolerance` (m) over `range` of the coordinates' ranges. */
void test_open_fitted(test_instance *out, const mhe_description *description, double tolerance,
                      double range);
void test_close(test_instance *instance);
/* The last line that an instance told its host. */
extern char test_told[512];
const mhe_model_ops *test_model_ops(void);

/* Two bars about z in a vertical plane: closed form in test_dynamics.c. */
#define PENDULUM_L1 0.31
#define PENDULUM_C1 0.13
#define PENDULUM_M1 1.7
#define PENDULUM_I1 0.021
#define PENDULUM_C2 0.17
#define PENDULUM_M2 1.1
#define PENDULUM_I2 0.013
#define PENDULUM_G 9.81
const mhe_description *test_pendulum(void);

/* Six coordinates drive ten pins and sliders on generic axes, with splines, branches, bodies that
 * do not move relative to each other, constant motions, and muscles across all of it. Each body is
 * a cloud of CLOUD point masses, and each point mass is a marker: that gives every dynamic quantity
 * a second way. */
#define CLOUD 4
const mhe_description *test_tangle(void);
double test_tangle_mass(int32_t marker);
void test_tangle_state(uint64_t *seed, double *q, double *v);

/* Position in ground of a point of a body, straight from the description's definition. */
void test_body_point(const mhe_description *d, int32_t body, const double *q, const double *at,
                     double *out);

#endif

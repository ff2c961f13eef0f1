/* SPDX-License-Identifier: Apache-2.0 */
/* cost_rig.h: a cost on a made-up problem of 2 coordinates, 3 muscles (Biceps, Triceps, Deltoid)
 * and 2 markers. */
#ifndef TEST_COST_RIG_H
#define TEST_COST_RIG_H

#include "use.h"

#include <mhe/cost.h>

#define COST_RIG_ROWS 64

typedef struct cost_rig {
    mhe_problem problem;
    const mhe_cost_ops *ops; /* NULL: the plugin was not built */
    void *self;              /* NULL where create() failed */
    mhe_cost_layout layout;
    mhe_stage stage; /* y and y_ref below */
    double y[COST_RIG_ROWS], y_ref[COST_RIG_ROWS], r[COST_RIG_ROWS], J[COST_RIG_ROWS];
    mhe_error err;
} cost_rig;

#define COST_RIG_TORQUES 1 /* the problem has residual torques */

/* Creates the cost with the options of `yaml`, lays it out and makes up values of all signals;
 * gives the status of create(). Skips the test where the plugin was not built. */
mhe_status cost_rig_open(cost_rig *rig, const char *id, const char *yaml, int32_t formulation,
                         int32_t flags);
void cost_rig_close(cost_rig *rig);

/* Evaluates r and J; asserts that both calls succeed and J is dr/dy (step study). */
void cost_rig_evaluate(cost_rig *rig);

/* Position in y of the nth (0 ...) occurrence of a signal; -1: the cost does not read it so often.
 */
int cost_rig_at(const cost_rig *rig, const char *signal, int nth);

/* Asserts r = sqrt(weight) (y - target) over one occurrence, target y_ref where `tracks`, else 0.
 */
void cost_rig_expect(const cost_rig *rig, const char *signal, int nth, double weight, int tracks);

#endif

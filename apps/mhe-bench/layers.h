/* SPDX-License-Identifier: Apache-2.0 */
/* layers.h: the estimator's layers, each as a call that can be timed. */
#ifndef LAYERS_H
#define LAYERS_H

#include "rig.h"

enum {
    LAYER_KINEMATICS,
    LAYER_ACCELERATION,
    LAYER_ACCELERATION_DERIVATIVES,
    LAYER_ACTIVATION_RATE,
    LAYER_INTERVAL,
    LAYER_INTERVAL_DERIVATIVES,
    LAYER_INTERVAL_AGAIN,
    LAYER_COST,
    LAYER_LINEARISATION,
    N_LAYERS
};

extern const char *const layer_keys[N_LAYERS];  /* in bench.json */
extern const char *const layer_names[N_LAYERS]; /* on the terminal */

/* What the layers of one rig read and write. */
typedef struct layers layers;
/* `r` must outlive it. [cold] */
mhe_status layers_create(rig *r, layers **result, mhe_error *err);
void layers_free(layers *l);

int layers_has(const layers *l, int32_t layer); /* 0: this problem has no such layer */
/* Seconds of `calls` calls, each at the next point of the motion; of LAYER_INTERVAL_AGAIN, each
 * 1e-3 (of every state and control) away from the last, as between the iterates of an estimator. */
mhe_status layers_time(layers *l, int32_t layer, int32_t calls, double *seconds, mhe_error *err);

#endif

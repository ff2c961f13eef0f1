/* SPDX-License-Identifier: Apache-2.0 */
/* model.h: the functions of the plugin's table; see mhe/model.h for what they promise. */
#ifndef SIMBODY_MODEL_H
#define SIMBODY_MODEL_H

#include <mhe/model.h>

#define SIMBODY_DYNAMICS_RECURSIVE 0
#define SIMBODY_DYNAMICS_SIMBODY 1

#define SIMBODY_PATHS_EXACT 0
#define SIMBODY_PATHS_FITTED 1

typedef struct simbody_config {
    int32_t dynamics;       /* SIMBODY_DYNAMICS_* */
    int32_t paths;          /* SIMBODY_PATHS_* */
    double paths_tolerance; /* m */
    double paths_range;     /* share of the coordinates' ranges */
} simbody_config;

mhe_status simbody_create(const mhe_host *host, const mhe_description *description,
                          const void *config, void **self, mhe_error *err);
void simbody_destroy(void *self);
mhe_status simbody_context_create(const void *self, void **context, mhe_error *err);
void simbody_context_destroy(void *context);
mhe_status simbody_kinematics(void *context, const double *q, const double *v,
                              const mhe_kinematics *out, mhe_error *err);
mhe_status simbody_inverse_dynamics(void *context, const double *vdot, double *tau, double *tau_q,
                                    double *tau_v, mhe_error *err);
mhe_status simbody_loads(void *context, const mhe_load *loads, int32_t n, const double *value,
                         double *tau, double *tau_q, double *tau_l, mhe_error *err);
mhe_status simbody_loops(void *context, const double *vdot, const mhe_loop_values *out,
                         mhe_error *err);
mhe_status simbody_path_pattern(const void *self, uint8_t *pattern, mhe_error *err);
int32_t simbody_path_points(void *context, int32_t path, double *points, int32_t n);
mhe_status simbody_forward_dynamics(void *context, const double *tau, double *vdot, mhe_error *err);

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* actuators.h: what an actuator of a description does to bodies. */
#ifndef MHI_ACTUATORS_H
#define MHI_ACTUATORS_H

#include <mhe/model.h>

/* Loads of a TorqueActuator or PointActuator at `force`: their number, at most 2. */
int32_t mhi_actuator_loads(const mhe_actuator *actuator, double force, mhe_load loads[2],
                           double value[18]);

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* tasks.h: what single markers and coordinates count, beside what a cost says of all markers:
 * OpenSim's inverse kinematics minimises sum w |marker - measured|^2 + sum w (q - value)^2. */
#ifndef MHI_TASKS_H
#define MHI_TASKS_H

#include <mhe/abi.h>

typedef struct mhi_tasks {
    const double *marker;     /* [n_k] factor of the squared distance; 0: left out */
    const double *coordinate; /* [n_q] weight of (q - value)^2, where a marker's is 1 */
    const double *value;      /* [n_q] rad or m */
    int32_t n_coordinates;    /* of them with a weight */
} mhi_tasks;

#endif

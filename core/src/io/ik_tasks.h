/* SPDX-License-Identifier: Apache-2.0 */
/* ik_tasks.h: OpenSim's inverse kinematics tasks, an IKTaskSet in an .xml of its own or in the
 * setup of the tool. */
#ifndef MHI_IK_TASKS_H
#define MHI_IK_TASKS_H

#include "base/arena.h"

#include <mhe/abi.h>

#define MHI_IK_MARKER 0
#define MHI_IK_DEFAULT 1 /* a coordinate, to its default value */
#define MHI_IK_VALUE 2   /* a coordinate, to `value` */
#define MHI_IK_FILE 3    /* a coordinate, to what another file says */

typedef struct mhi_ik_task {
    const char *name; /* of the marker or coordinate */
    int32_t kind;     /* MHI_IK_* */
    double weight;    /* of the squared error, m or rad; 0 where the task is off */
    double value;     /* rad or m */
} mhi_ik_task;

/* All tasks of the file; memory from `arena`. MHE_E_INPUT: it cannot be read, is no such file, or a
 * weight is negative: "file:line: what". [cold] */
mhe_status mhi_ik_tasks_read(const char *path, mhi_arena *arena, mhi_ik_task **tasks, int32_t *n,
                             mhe_error *err);

#endif

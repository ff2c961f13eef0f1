/* SPDX-License-Identifier: Apache-2.0 */
/* tree_model.h: models of any size, made up: a trunk from which limbs hang, each joint with muscles
 * of its own around it. Nobody's anatomy; what grows with coordinates and muscles is that of real
 * ones. */
#ifndef TREE_MODEL_H
#define TREE_MODEL_H

#include <mhe/abi.h>

#define TREE_LIMBS_MAX 8

typedef struct tree_size {
    int32_t muscles;
    /* Limbs from the first joint outwards, a digit a joint: its degrees of freedom, 1 to 3; "t3": a
     * trunk with so many. NULL behind the last. */
    const char *limbs[TREE_LIMBS_MAX];
} tree_size;

int32_t tree_coordinates(const tree_size *size);
/* Writes model.bioMod, excitations.sto (1.5 s at 100 Hz), sim.yaml (for mhe-sim forward) and
 * bench.yaml (which reads what that writes into FOLDER/sim) into `folder`, which exists. The same
 * bytes each time. */
mhe_status tree_write(const tree_size *size, const char *folder, mhe_error *err);

#endif

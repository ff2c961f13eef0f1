/* SPDX-License-Identifier: Apache-2.0 */
/* layout.h: the table of blocks that says what the numbers of a system are.
 *
 * The system makes it once; states, controls, inputs and parameters are vectors, each the
 * concatenation of the blocks of its role in the order of the table. Sizes, names, units and bounds
 * are read from here and counted nowhere else. Well-known blocks:
 *
 *   role       name             entries
 *   state      q, qdot          coordinates; rad, rad/s (m, m/s)
 *   state      activation       muscles, unless activation-driven; 1
 *   state      <plugin's name>  muscles that have this state ("fiber_length")
 *   control    excitation       muscles, excitation-driven; 1
 *   control    activation       muscles, activation-driven; 1
 *   control    residual_torque  coordinates, where switched on; N m (N)
 *   control    actuator         actuators of the model file, where switched on; 1, in parts of
 *                               their optimal force
 *   input      <force's name>   what a force plugin is fed with at every node
 *   parameter  <name>           what a run may estimate; constant over its nodes */
#ifndef MHE_LAYOUT_H
#define MHE_LAYOUT_H

#include <mhe/abi.h>

#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

#define MHE_ROLE_STATE 0
#define MHE_ROLE_CONTROL 1
#define MHE_ROLE_INPUT 2
#define MHE_ROLE_PARAMETER 3

#define MHE_STRUCTURE_DENSE 0 /* anything may depend on anything */
#define MHE_STRUCTURE_DIAGONAL                                             \
    1 /* states: each entry is a scalar equation of itself and the control \
       * of its own muscle; blind to q, qdot and all other entries */
#define MHE_STRUCTURE_MUSCLE                                                                    \
    2                            /* states: an entry sees the states and the control of its own \
                                  * muscle and, through its length and velocity, q and qdot */
#define MHE_STRUCTURE_CONSTANT 3 /* does not change over the nodes */

/* Arrays [count] live as long as the system. */
typedef struct mhe_block {
    const char *name;
    int32_t role;      /* MHE_ROLE_* */
    int32_t structure; /* MHE_STRUCTURE_* */
    int32_t first;     /* place of its first entry in the vector of its role */
    int32_t count;
    const char *const *entry_names; /* coordinate, muscle ... that an entry belongs to */
    const char *const *units;
    const int32_t *owner;        /* number of that coordinate, muscle ...; -1: none */
    const double *lower, *upper; /* general bounds; +-infinity where there are none */
    const double *scale;         /* a usual size > 0, in the entry's unit */
} mhe_block;

typedef struct mhe_layout {
    uint32_t size;
    uint32_t block_size; /* stride of `blocks` */
    int32_t n_blocks;
    const mhe_block *blocks;
    int32_t n_x, n_u, n_w, n_p; /* states, controls, inputs, parameters */
} mhe_layout;

static inline const mhe_block *mhe_layout_at(const mhe_layout *layout, int32_t i) {
    return (const mhe_block *)(const void *)((const char *)layout->blocks +
                                             (size_t)i * layout->block_size);
}

/* The block of a role and name; NULL if there is none. [any] */
static inline const mhe_block *mhe_layout_find(const mhe_layout *layout, int32_t role,
                                               const char *name) {
    for (int32_t i = 0; i < layout->n_blocks; i++) {
        const mhe_block *block = mhe_layout_at(layout, i);
        if (block->role == role && strcmp(block->name, name) == 0) {
            return block;
        }
    }
    return NULL;
}

#ifdef __cplusplus
}
#endif
#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* anatomy.h: numbers of the skeleton that are parameters: where muscles end and what bodies weigh.
 *
 * Skeleton plugins know no parameters, so that these are found with other descriptions of the same
 * skeleton. Where muscles end: one more model of the paths in which the last point of each muscle
 * moves with three coordinates more (always 0) along its body's axes, so that the length's
 * derivatives by them and by the posture are exact. What bodies weigh: moments are linear in the
 * masses, so that the share of one body is the inverse dynamics of a model in which it alone has a
 * mass. Mass and inertia of a body share one factor. */
#ifndef MHI_MODEL_ANATOMY_H
#define MHI_MODEL_ANATOMY_H

#include "base/arena.h"
#include "model/system.h"

#define MHI_INSERTION "insertion" /* block [n_m x 3], m in the axes of the point's body */
#define MHI_MASS "segment_mass"   /* block [n_b], factors of mass and inertia */

typedef struct mhi_anatomy mhi_anatomy;

/* Whether the last point of the path of muscle m can be a parameter: a fixed point of a body. */
int32_t mhi_insertion_is_fixed(const mhe_description *description, int32_t m);

/* Of the parameters that the setup names; *anatomy NULL where none is of the skeleton. Taken from
 * the arena. MHE_E_INPUT: a muscle has none. [cold] */
mhe_status mhi_anatomy_create(const mhi_system_setup *setup, mhi_arena *arena,
                              mhi_anatomy **anatomy, mhe_error *err);
void mhi_anatomy_free(mhi_anatomy *anatomy);                /* NULL: nothing */
int32_t mhi_anatomy_insertions(const mhi_anatomy *anatomy); /* entries of its blocks; 0: none */
int32_t mhi_anatomy_masses(const mhi_anatomy *anatomy);

/* Values of both blocks, one behind the other. */
void mhi_anatomy_values(const mhi_anatomy *anatomy, double *p);
/* Makes the models anew where they changed, and what all contexts have of them. *model: the
 * system's own. On failure all is as it was. [cold] */
mhe_status mhi_anatomy_set(mhi_anatomy *anatomy, const double *p, void **model, mhe_error *err);

/* What a context has of it. */
typedef struct mhi_anatomy_context {
    mhi_anatomy *anatomy;
    void **model; /* the system context's own */
    void *paths, **parts;
    double *state;                /* [2 x (n_q + 3)] of the paths' model */
    double *length_q, *length_qq; /* with three coordinates more */
    double *length_d, *length_dq; /* of muscles' lengths: [n_m x 3], [n_m x 3 x n_q] */
    double *velocity_d;           /* [n_m x 3] */
    double *tau;                  /* [n_q] */
    void *new_model, *new_paths;
    struct mhi_anatomy_context *next;
} mhi_anatomy_context;
mhe_status mhi_anatomy_enter(mhi_anatomy *anatomy, mhi_arena *arena, void **model,
                             mhi_anatomy_context **context, mhe_error *err);
void mhi_anatomy_leave(mhi_anatomy_context *context); /* NULL: nothing */

/* Lengths of all paths and derivatives as mhe_kinematics has them (length_qq NULL: not wanted, nor
 * length_dq). [hot] */
mhe_status mhi_anatomy_lengths(mhi_anatomy_context *context, const double *q, const double *v,
                               double *length, double *length_q, double *length_qq, mhe_error *err);
/* What body b's factor adds to the moments at (q, v, vdot): context->tau [n_q]; 0 where it has no
 * mass. [hot] */
mhe_status mhi_anatomy_weigh(mhi_anatomy_context *context, int32_t b, const double *q,
                             const double *v, const double *vdot, mhe_error *err);

#endif

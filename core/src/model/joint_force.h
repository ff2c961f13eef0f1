/* SPDX-License-Identifier: Apache-2.0 */
/* joint_force.h: the force that one joint passes on, with its derivatives by states and controls.
 *
 * The joint gets three shifts before its own motions, held at 0 (joints.h). Inverse dynamics of a
 * shift less what muscles, springs and loads do there is the joint's force on its child along an
 * axis of the parent:
 *
 *     f = ID_s(q, v, vdot) + sum_p L_p,s T_p - loads_s         vdot, T: of the system at (x, u)
 *
 * and its derivatives are those of known parts: M_sq and the accelerations' own, L_sq and the
 * tensions' own, ID_q and ID_v. */
#ifndef MHI_JOINT_FORCE_H
#define MHI_JOINT_FORCE_H

#include "model/system.h"

typedef struct mhi_joint_force mhi_joint_force;
typedef struct mhi_joint_force_context mhi_joint_force_context;

/* Joint `name`: that of a joint, or of the body that it carries. MHE_E_CONFIG: none has it, the
 * text says which there are; MHE_E_UNSUPPORTED: a path that is a polynomial, a loop, bushing or
 * point actuator that acts on one side of the joint alone. `system` must outlive it. [cold] */
mhe_status mhi_joint_force_create(const mhi_system *system, const char *name,
                                  mhi_joint_force **joint, mhe_error *err);
void mhi_joint_force_free(mhi_joint_force *joint);
/* Memory for one thread. [cold] */
mhe_status mhi_joint_force_context_create(const mhi_joint_force *joint,
                                          mhi_joint_force_context **context, mhe_error *err);
void mhi_joint_force_context_free(mhi_joint_force_context *context);

/* Force of the joint on its child, N, in the axes of the parent body; by_z [3 x width] (NULL: not
 * wanted) by z = [x; u], width n_x or n_x + n_u, activations' columns from `activation` on.
 * `system`: a context of the joint's system. Muscles pull along their true paths, also where the
 * system's are fitted. [hot] */
mhe_status mhi_joint_force_evaluate(mhi_joint_force_context *context, mhi_system_context *system,
                                    const mhe_system_point *at, int32_t width, int32_t activation,
                                    double *force, double *by_z, mhe_error *err);

#endif

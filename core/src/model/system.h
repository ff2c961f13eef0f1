/* SPDX-License-Identifier: Apache-2.0 */
/* system.h: the musculoskeletal system = skeleton (model plugin) + muscles (muscle plugin) +
 * residual torques.
 *
 *     M(q) vdot = r - L_q(q)^T F(a, L(q), Ldot) - bias(q, v),     Ldot = L_q v
 *
 * States and controls are laid out as mhe/integrator.h says. */
#ifndef MHI_SYSTEM_H
#define MHI_SYSTEM_H

#include <mhe/cost.h>
#include <mhe/integrator.h>
#include <mhe/model.h>
#include <mhe/muscle.h>

/* Plugins with their filled configs; formulation is MHE_FORMULATION_*. All lent for the system's
 * life. */
typedef struct mhi_system_setup {
    const mhe_host *host;
    const mhe_description *description;
    const mhe_plugin *model;
    const void *model_config;
    const mhe_plugin *muscle;
    const void *muscle_config;
    int32_t formulation;
    int32_t residual_torques; /* 0 or 1 */
} mhi_system_setup;

typedef struct mhi_system mhi_system;

mhe_status mhi_system_create(const mhi_system_setup *setup, mhi_system **system, mhe_error *err);
void mhi_system_free(mhi_system *system);

const mhe_description *mhi_system_description(const mhi_system *system);
int32_t mhi_system_formulation(const mhi_system *system);
/* What an integrator sees. */
const mhe_system *mhi_system_face(const mhi_system *system);

/* Memory for one thread; it is the `context` that mhe_system.acceleration takes. [cold] */
typedef struct mhi_system_context mhi_system_context;
mhe_status mhi_system_context_create(const mhi_system *system, mhi_system_context **context,
                                     mhe_error *err);
void mhi_system_context_free(mhi_system_context *context);

/* Results of mhi_system_muscles and mhi_system_kinematics, valid until the context's next call.
 * Derivatives are there only where they were asked for. n_k markers, n_m muscles, n_q coordinates;
 * row-major. */
typedef struct mhi_muscle_state {
    const double *length, *length_q; /* [n_m], [n_m x n_q] */
    const double *velocity;          /* [n_m] */
    const double *force;             /* [n_m] */
    const double *force_q, *force_v; /* [n_m x n_q] each */
    const double *force_a;           /* [n_m] */
    const double *moment;            /* -L_q^T F [n_q] */
    const double *moment_q;          /* [n_q x n_q] */
    const double *moment_v;          /* [n_q x n_q] */
} mhi_muscle_state;

/* Muscle forces and their joint moments at (q, v, a). [hot] */
mhe_status mhi_system_muscles(mhi_system_context *context, const double *q, const double *v,
                              const double *a, int32_t derivatives, mhi_muscle_state *out,
                              mhe_error *err);

/* Marker positions [n_k x 3] and, if not NULL, their Jacobian [3 n_k x n_q]. [hot] */
mhe_status mhi_system_markers(mhi_system_context *context, const double *q, double *marker,
                              double *marker_q, mhe_error *err);

#endif

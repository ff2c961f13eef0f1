/* SPDX-License-Identifier: Apache-2.0 */
/* system.h: the musculoskeletal system = skeleton (model plugin) + muscles (muscle plugin) + other
 * forces (force plugins) + residual torques.
 *
 *     M(q) vdot = r - L_q(q)^T F(s, L(q), Ldot) + tau(q, v, w) - bias(q, v) + G(q)^T lambda,
 *     Ldot = L_q v
 *
 * s are the muscles' states, w the inputs of the forces. lambda is what keeps the loops of the
 * description closed, found with the accelerations: see loops.c. What the numbers of x, u, w are
 * says the layout (mhe/layout.h), which is made here and nowhere else. */
#ifndef MHI_SYSTEM_H
#define MHI_SYSTEM_H

#include "model/work.h"

#include <mhe/cost.h>
#include <mhe/force.h>
#include <mhe/integrator.h>
#include <mhe/layout.h>
#include <mhe/model.h>
#include <mhe/muscle.h>

/* General bounds of a run; those of the coordinates are the description's. */
typedef struct mhi_bounds {
    double velocity_max; /* rad/s */
    double activation_min, activation_max, excitation_min, excitation_max;
    const double *torque_max; /* [n_q] of the residual torques, N m (N) */
} mhi_bounds;

/* A force plugin and its filled config. */
typedef struct mhi_force_setup {
    const mhe_plugin *plugin;
    const void *config;
    const char *name; /* of its inputs; NULL: as the plugin calls them */
} mhi_force_setup;

/* Plugins with their filled configs; formulation is MHE_FORMULATION_*. All but `bounds` lent for
 * the system's life. */
typedef struct mhi_system_setup {
    const mhe_host *host;
    const mhe_description *description;
    const mhe_plugin *model;
    const void *model_config;
    const mhe_plugin *muscle;
    const void *muscle_config;
    int32_t formulation;
    int32_t residual_torques; /* 0 or 1 */
    int32_t actuators;        /* 1: the description's are controls */
    const mhi_force_setup *forces;
    int32_t n_forces;
    const mhi_bounds *bounds; /* NULL: none */
    /* Parameters by which derivatives are given: numbers of a muscle ("max_isometric_force"), each
     * a block of the layout with an entry a muscle. MHE_E_CONFIG: the muscle plugin has none. */
    const char *const *parameters;
    int32_t n_parameters;
} mhi_system_setup;

typedef struct mhi_system mhi_system;

mhe_status mhi_system_create(const mhi_system_setup *setup, mhi_system **system, mhe_error *err);
void mhi_system_free(mhi_system *system);

const mhe_description *mhi_system_description(const mhi_system *system);
int32_t mhi_system_formulation(const mhi_system *system);
/* What an integrator sees. */
const mhe_system *mhi_system_face(const mhi_system *system);

/* Where x [n_x], u [n_u], w [n_w] stand in the terms of mhe/integrator.h. u and w may be NULL: what
 * they hold is then NULL. */
void mhi_system_point(const mhi_system *system, const double *x, const double *u, const double *w,
                      mhe_system_point *point);
/* Activations [n_m] of x and u; activation-driven and u NULL: NULL. */
const double *mhi_system_activation(const mhi_system *system, const double *x, const double *u);

/* Inputs of the forces that have them in a file, at time t (s); the others' entries of w [n_w] are
 * left alone. [hot] */
mhe_status mhi_system_inputs(const mhi_system *system, double t, double *w, mhe_error *err);
/* From when to when (s) the inputs of force `position` of the setup are known; as they are where it
 * has none, or none from a file. */
mhe_status mhi_system_known(const mhi_system *system, int32_t position, double *first, double *last,
                            mhe_error *err);
/* Which entries of w [n_w] are the inputs of force `position` of the setup; n 0: it has none. */
void mhi_system_inputs_of(const mhi_system *system, int32_t position, int32_t *first, int32_t *n);
/* Whether the input block `name` comes with the frames, not from a file. */
int32_t mhi_system_input_is_measured(const mhi_system *system, const char *name);
/* MHE_E_INPUT: the inputs of a force are not known from `first` to `last` (s): its file is shorter,
 * or they have none and `measured` is 0. The message begins with "forces.<position>: ". [cold] */
mhe_status mhi_system_covers(const mhi_system *system, double first, double last, int32_t measured,
                             mhe_error *err);

/* Values of the parameters p [n_p], in their units; at first those of the description. Setting them
 * makes the muscles anew: not while anything is evaluated. MHE_E_INPUT: the muscle plugin refuses
 * one; the old ones hold on. [cold] */
void mhi_system_parameters(const mhi_system *system, double *p);
mhe_status mhi_system_set_parameters(mhi_system *system, const double *p, mhe_error *err);

/* Memory for one thread; it is the `context` that mhe_system.acceleration takes. [cold] */
typedef struct mhi_system_context mhi_system_context;
mhe_status mhi_system_context_create(const mhi_system *system, mhi_system_context **context,
                                     mhe_error *err);
void mhi_system_context_free(mhi_system_context *context);

/* What the context's accelerations and kinematics take from; NULL, as at first: nothing. Lent.
 * After a series of calls mhi_system_context_settle gives the rest of the last loan back. */
void mhi_system_context_set_work(mhi_system_context *context, mhi_work *work);
void mhi_system_context_settle(mhi_system_context *context);
int32_t mhi_system_context_spent(const mhi_system_context *context); /* 1: no more work [hot] */

/* Results of mhi_system_muscles, valid until the context's next call. Derivatives are there only
 * where they were asked for. n_m muscles, n_q coordinates; row-major. */
typedef struct mhi_muscle_state {
    const double *length, *length_q; /* [n_m], [n_m x n_q] */
    const double *velocity;          /* [n_m] */
    const double *force;             /* [n_m] */
    const double *force_q, *force_v; /* [n_m x n_q] each */
    const double *force_a;           /* [n_m], where n_a > 0 */
    const double *force_z;           /* [n_z] of its own muscle */
    const double *force_p;           /* [n_p] of the parameter's own muscle */
    const double *moment_p;          /* [n_q x n_p] */
    const double *moment;            /* -L_q^T F [n_q] */
    const double *moment_q;          /* [n_q x n_q] */
    const double *moment_v;          /* [n_q x n_q] */
} mhi_muscle_state;

/* Muscle forces and their joint moments; of `at` q, v, a and z are read. [hot] */
mhe_status mhi_system_muscles(mhi_system_context *context, const mhe_system_point *at,
                              int32_t derivatives, mhi_muscle_state *out, mhe_error *err);

/* The same muscles with other lengths. Of optimal_fiber_length (`fiber`, a share of it),
 * tendon_slack_length (`tendon`, a share) and the path's (`path`, m) these are independent standard
 * deviations. All three act by the norm length of the fibres: they are moved together, each by its
 * part in it, until that is `far` of its standard deviations longer. Rigid tendons only.
 * MHE_E_INPUT: the muscle plugin refuses one. [cold] */
typedef struct mhi_variation {
    double fiber, tendon, path, far;
} mhi_variation;
typedef struct mhi_variant mhi_variant;
mhe_status mhi_variant_create(const mhi_system *system, const mhi_variation *by,
                              mhi_variant **variant, mhe_error *err);
void mhi_variant_free(mhi_variant *variant);
/* Forces [n_m] at the activations, lengths and velocities [n_m] of the system's own. [hot] */
mhe_status mhi_variant_forces(const mhi_variant *variant, const double *activation,
                              const double *length, const double *velocity, double *force,
                              mhe_error *err);

/* Muscle states in equilibrium with activations [n_m] at (q, v): d and z of a state x [n_x], the
 * rest of which is not touched. [cold] */
mhe_status mhi_system_equilibrium(mhi_system_context *context, const double *q, const double *v,
                                  const double *activation, double *x, mhe_error *err);

/* Marker positions [n_k x 3] and, if not NULL, their Jacobian [3 n_k x n_q]. [hot] */
mhe_status mhi_system_markers(mhi_system_context *context, const double *q, double *marker,
                              double *marker_q, mhe_error *err);

/* Loops of the model, n_c rows as in mhe_loop_values; 0: it has none. */
int32_t mhi_system_loop_rows(const mhi_system *system);
/* At (q, v), see mhe_loop_values; valid until the context's next call, derivatives only where they
 * were asked for. [hot] */
typedef struct mhi_loop_state {
    const double *gap, *rate;              /* [n_c] */
    const double *gap_q, *rate_q, *rate_v; /* [n_c x n_q] */
} mhi_loop_state;
mhe_status mhi_system_gaps(mhi_system_context *context, const double *q, const double *v,
                           int32_t derivatives, mhi_loop_state *out, mhe_error *err);
/* The nearest posture q [n_q] in which the loops are closed, and then the nearest speeds v (may be
 * NULL) that keep them so, both least squares of the change. MHE_RETRY: none found. [hot] */
mhe_status mhi_system_close_loops(mhi_system_context *context, double *q, double *v,
                                  mhe_error *err);
/* What keeps them closed [n_c], N (N m), ground axes, on body 2: of the context's last
 * acceleration. NULL: no loops. */
const double *mhi_system_loop_force(const mhi_system_context *context);

/* Bodies [n_b x 12] and, if not NULL, their velocities by the coordinates' [n_b x 6 x n_q], as in
 * mhe/model.h. [hot] */
mhe_status mhi_system_bodies(mhi_system_context *context, const double *q, double *body,
                             double *body_q, mhe_error *err);

/* General bounds of all entries of a role, one behind the other. */
void mhi_layout_bounds(const mhe_layout *layout, int32_t role, double *lower, double *upper);

#endif

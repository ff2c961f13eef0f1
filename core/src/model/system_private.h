/* SPDX-License-Identifier: Apache-2.0 */
/* system_private.h: the system's parts, shared by its making (system_build.c, layout.c), its
 * evaluation (system.c) and its forces (forces.c). */
#ifndef MHI_SYSTEM_PRIVATE_H
#define MHI_SYSTEM_PRIVATE_H

#include "base/arena.h"
#include "model/anatomy.h"
#include "model/system.h"

/* One force plugin at work. */
typedef struct mhi_force {
    const mhe_plugin *plugin;
    const mhe_force_ops *ops;
    void *self;
    mhe_force_layout layout;
    const char *name;
    int32_t position;    /* in the setup */
    int32_t first_input; /* in w */
} mhi_force;

struct mhi_system {
    mhe_system face;
    mhe_host host; /* for force plugins: the setup's with services of our own */
    mhe_layout layout;
    const mhe_description *description;
    int32_t formulation;
    const mhe_model_ops *model;
    const mhe_plugin *model_plugin;
    const void *model_config;
    const mhe_muscle_ops *muscle;
    void *model_self, *muscle_self;
    mhe_muscle_layout muscle_layout;
    const mhe_plugin *muscle_plugin;
    const void *muscle_config;
    mhe_muscle *muscles;     /* [n_m] the description's with the parameters' values */
    int32_t n_parameters;    /* blocks of n_m entries of the muscles; behind them the anatomy's */
    int32_t *parameter;      /* [n_parameters] which of the muscle plugin's */
    size_t *parameter_at;    /* [n_parameters] place of the number in mhe_muscle */
    mhi_anatomy *anatomy;    /* parameters of the skeleton; NULL: none */
    int32_t n_s, activation; /* states of a muscle, which of them is the activation */
    int32_t n_paths;
    int32_t *first, *end; /* [n_paths] coordinates that a path sees lie in [first, end) */
    int32_t *z_state;     /* [n_z] which of its muscle's states an entry of z is */
    mhi_force *forces;
    int32_t n_forces;                                        /* that do something */
    int32_t most_inputs, most_paths, most_loads, most_pairs; /* of one force */
    int32_t forces_see_rates;        /* one may depend on velocities: loads alone do not */
    int32_t n_residual, n_actuators; /* controls r: residual torques, actuators */
    int32_t n_c;                     /* rows of the description's loops */
    mhe_load *loop_loads;            /* [n_loop_loads] what closes them acts on */
    int32_t *loop_of;                /* [n_loop_loads] 2 loop + (0, 1) frame */
    int32_t n_loop_loads;
    mhi_arena arena;
};

/* Three blocks of columns, to whole fours: no solution for a single column. */
#define MHI_SOLVED_LD(n_q) ((3 * (n_q) + 3) / 4 * 4)

struct mhi_system_context {
    const mhi_system *system;
    void *model;
    mhi_anatomy_context *anatomy;                     /* NULL: none */
    double *zero;                                     /* [n_q] */
    double *mass, *bias;                              /* [n_q x n_q], [n_q] */
    double *length, *length_q, *length_qq;            /* [n_p], [n_p x n_q], [n_p x n_q x n_q] */
    double *velocity, *velocity_q;                    /* [n_p], [n_p x n_q] */
    double *state;                                    /* [n_s x n_m] */
    double *force, *force_l, *force_w;                /* [n_m] */
    double *force_s, *force_z;                        /* [n_s x n_m], [n_z] */
    double *rate, *rate_e, *rate_l, *rate_w, *rate_s; /* [n_s x n_m], the last [n_s x n_s x n_m] */
    double *force_q, *force_v;                        /* [n_m x n_q] */
    double *moment, *moment_q, *moment_v;             /* of the muscles: [n_q], [n_q x n_q] */
    double *tau_q, *tau_v;                            /* of the inverse dynamics [n_q x n_q] */
    double *other, *other_q, *other_v;                /* of the force plugins [n_q], [n_q x n_q] */
    double *own, *own_q, *own_v;                      /* of one of them */
    double *tension, *tension_l, *tension_w, *t_length, *t_velocity; /* [most_paths] */
    double *load;                                                    /* [most_loads x 9] */
    double *body;                           /* [n_b x 12], where forces have pairs of frames */
    double *deflection, *deflection_rate;   /* [most_pairs x 6] */
    double *push, *push_d, *push_w;         /* [most_pairs x 6], [most_pairs x 6 x 6] */
    double *pair_rows, *pair_loads;         /* [most_pairs x 6 x n_q], [n_q x 36] */
    double *pair_q, *pair_work, *pair_turn; /* [n_q x n_q], [18 x n_q], [3 x n_q] */
    double *solved;                         /* [n_q x MHI_SOLVED_LD] vdot by q, by v, by torques */
    double *row_q, *row_v;                  /* [n_q] */
    double *all_force_p, *all_rate_p; /* of the plugin's parameters [n x n_m], [n x n_s x n_m] */
    double *force_p, *moment_p;       /* [n_p], [n_q x n_p] */
    double *drive, *drive_q,
        *drive_r;        /* of the actuators: [n_q], [n_q x n_q], [n_q x n_actuators] */
    double *gap, *gap_q; /* of the loops: [n_c], [n_c x n_q] */
    double *gap_rate, *gap_rate_q, *gap_rate_v;
    double *gap_acceleration, *gap_acceleration_q, *gap_acceleration_v;
    double *loop_force, *loop_push;   /* [n_c], M^-1 G^T [n_q x n_c] */
    double *loop_factor, *loop_value; /* of G M^-1 G^T [n_c x n_c]; [n_loop_loads x 9] */
    double *loop_columns;             /* [n_c x most columns] */
    int32_t *loop_order, loop_rank;
    mhi_work *work; /* NULL: no bound */
    int64_t loan;   /* of it */
    mhi_arena arena;
};

/* layout.c: fills s->layout and the sizes of s->face from the plugins' layouts. */
mhe_status mhi_layout_make(mhi_system *s, const mhi_system_setup *setup, mhe_error *err);

/* parameters.c: finds the parameters that the setup names, muscles' first; their derivatives of
 * muscle forces and rates, out of the plugin's, into the context's; z rates' into zdot_p [n_z x
 * n_p]. Of the masses into moment_p, once the accelerations are known. */
mhe_status mhi_parameters_find(mhi_system *s, const mhi_system_setup *setup, mhe_error *err);
const char *mhi_parameter_unit(const mhi_system *s, int32_t i);
void mhi_parameters_forces(mhi_system_context *c);
void mhi_parameters_rates(const mhi_system_context *c, double *zdot_p);
mhe_status mhi_parameters_masses(mhi_system_context *c, const mhe_system_point *at,
                                 const double *vdot, mhe_error *err);

/* system.c: the functions of the face. */
mhe_status mhi_system_acceleration(const mhe_system *face, void *context,
                                   const mhe_system_point *at, const mhe_acceleration *out,
                                   mhe_error *err);
mhe_status mhi_system_activation_rate(const mhe_system *face, const double *c, const double *d,
                                      double *rate, double *rate_c, double *rate_d, mhe_error *err);

/* paths.c: Ldot = L_q v of the paths from .. to - 1; with derivatives also dLdot/dq = L_qq v. */
void mhi_path_velocities(mhi_system_context *c, int32_t from, int32_t to, const double *v,
                         int32_t derivatives);
/* Pulls along the same paths, force [to - from]: adds -L_q^T F to `moment`. */
void mhi_path_moments(const mhi_system_context *c, int32_t from, int32_t to, const double *force,
                      double *moment);
/* What dF/dL and dF/dLdot of the pulls [to - from] make of moment_q and moment_v [n_q x n_q];
 * force_q, force_v [to - from x n_q] are the pulls' own derivatives. */
typedef struct mhi_path_forces {
    const double *force, *force_l, *force_w;
    double *force_q, *force_v, *moment_q, *moment_v;
} mhi_path_forces;
void mhi_path_moment_derivatives(const mhi_system_context *c, int32_t from, int32_t to,
                                 const mhi_path_forces *forces);
/* out [n_q x n] = -M^-1 L_q^T diag(by): column k is the pull along path muscle[k] (NULL: k); M^-1
 * [n_q x n_q] in rows of ld. */
void mhi_path_accelerations(const mhi_system_context *c, const double *inverse, int32_t ld,
                            const double *by, const int32_t *muscle, int32_t n, double *out);

/* actuators.c: generalised force of the description's actuators at controls r [n_actuators], into
 * c->drive, with derivatives drive_q, drive_r. */
mhe_status mhi_actuators_check(const mhi_system *s, mhe_error *err);
mhe_status mhi_actuators_drive(mhi_system_context *c, const double *q, const double *r,
                               int32_t derivatives, mhe_error *err);

/* pairs.c, of one force plugin's pair i: how its frames stand, into the context; after the plugin's
 * evaluate(): adds what it pushes there to c->other and its derivatives. */
mhe_status mhi_pairs_place(mhi_system_context *c, const mhe_frame_pair *pair, const double *v,
                           int32_t i, mhe_error *err);
mhe_status mhi_pairs_push(mhi_system_context *c, const mhe_frame_pair *pair, const double *v,
                          int32_t i, int32_t derivatives, mhe_error *err);

/* loops.c. What the setup's loops need of a system; after the open accelerations: adds to vdot
 * [n_q] what keeps the loops closed (c->loop_force does it) and leaves all that the derivatives
 * need. Those: closed() replaces n columns of derivatives of the open accelerations [n_q x n] by
 * those of the closed ones, `by` saying what they are by. */
enum { MHI_LOOPS_BY_Q, MHI_LOOPS_BY_V, MHI_LOOPS_BY_OTHER };
mhe_status mhi_loops_prepare(mhi_system *s, mhe_error *err);
/* Warns of loops that cannot be closed from the default posture; once the system is whole. */
mhe_status mhi_loops_tell(mhi_system *s, const mhe_host *host, mhe_error *err);
mhe_status mhi_loops_close(mhi_system_context *c, int32_t derivatives, double *vdot,
                           mhe_error *err);
/* With the loops' own derivatives at vdot; takes what the closing force does off tau_q, that of the
 * inverse dynamics. */
mhe_status mhi_loops_linearise(mhi_system_context *c, const double *vdot, double *tau_q,
                               mhe_error *err);
/* `share` times what closes them on s->loop_loads, into c->loop_value [n_loop_loads x 9]: of the
 * context's last acceleration. */
void mhi_loops_loads(mhi_system_context *c, double share);
void mhi_loops_closed(const mhi_system_context *c, int32_t by, double *columns, int32_t n);

/* forces.c: instances; generalised force of all force plugins, left in c->other, with derivatives
 * in other_q, other_v. Needs the kinematics of `at` in the context. */
mhe_status mhi_forces_create(mhi_system *s, const mhi_system_setup *setup, mhe_error *err);
/* Tensions of the force plugins' paths [n_paths] and, where they are not NULL, their derivatives by
 * length and its rate, all added to what is there; and each plugin's loads. Needs the kinematics of
 * `at` in the context. */
typedef struct mhi_path_pulls {
    double *tension, *by_length, *by_rate;
} mhi_path_pulls;
typedef mhe_status mhi_force_loads(void *data, const mhe_load *loads, int32_t n,
                                   const double *values, mhe_error *err);
mhe_status mhi_forces_pull(mhi_system_context *c, const mhe_system_point *at,
                           const mhi_path_pulls *pulls, mhi_force_loads *loads, void *data,
                           mhe_error *err);
/* Each is finite at the model's default posture; once the system is whole. */
mhe_status mhi_forces_check(mhi_system *s, mhe_error *err);
void mhi_forces_destroy(mhi_system *s);
mhe_status mhi_forces_evaluate(mhi_system_context *c, const mhe_system_point *at,
                               int32_t derivatives, mhe_error *err);

#endif

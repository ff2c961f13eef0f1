/* SPDX-License-Identifier: Apache-2.0 */
/* system.c: accelerations, rates and muscle forces with their derivatives. */
#include "base/cholesky.h"
#include "model/system_private.h"

#include <string.h>

static size_t doubles(int32_t n) {
    return sizeof(double) * (size_t)n;
}

/* ---- muscles ---- */

/* The muscles' states as their plugin wants them: [n_s x n_m]. */
static const double *muscle_state(mhi_system_context *c, const double *a, const double *z) {
    const mhi_system *s = c->system;
    const int32_t n_m = s->face.n_m;
    if (s->n_s == 1) {
        return s->face.n_a > 0 ? a : z;
    }
    if (s->face.n_a > 0) {
        memcpy(c->state + s->activation * n_m, a, doubles(n_m));
    }
    for (int32_t i = 0; i < s->face.n_z; i++) {
        c->state[s->z_state[i] * n_m + s->face.z_muscle[i]] = z[i];
    }
    return c->state;
}

/* Ldot, forces and moments from the kinematics in the context; with derivatives, and the rates of
 * all states, if asked. */
static mhe_status muscles(mhi_system_context *c, const mhe_system_point *at, int32_t derivatives,
                          int32_t rates, mhe_error *err) {
    const mhi_system *s = c->system;
    const int32_t n_q = s->face.n_q, n_m = s->face.n_m;
    mhi_path_velocities(c, 0, n_m, at->v, derivatives);
    const mhe_muscle_point point = {.size = sizeof point,
                                    .excitation = at->c,
                                    .state = muscle_state(c, at->a, at->z),
                                    .length = c->length,
                                    .velocity = c->velocity};
    mhe_muscle_values out = {.size = sizeof out, .force = c->force};
    if (derivatives) {
        out.force_s = c->force_s;
        out.force_l = c->force_l;
        out.force_w = c->force_w;
    }
    if (derivatives && s->n_parameters > 0) {
        out.force_p = c->all_force_p;
        out.rate_p = rates ? c->all_rate_p : NULL;
    }
    if (rates) {
        out.rate = c->rate;
    }
    if (rates && derivatives) {
        out.rate_e = c->rate_e;
        out.rate_s = c->rate_s;
        out.rate_l = c->rate_l;
        out.rate_w = c->rate_w;
    }
    mhe_status status = s->muscle->evaluate(s->muscle_self, &point, &out, err);
    if (status != MHE_OK) {
        return status;
    }
    memset(c->moment, 0, doubles(n_q));
    mhi_path_moments(c, 0, n_m, c->force, c->moment);
    return MHE_OK;
}

static void muscle_derivatives(mhi_system_context *c) {
    const mhi_system *s = c->system;
    const int32_t n_q = s->face.n_q, n_m = s->face.n_m;
    memset(c->moment_q, 0, doubles(n_q * n_q));
    memset(c->moment_v, 0, doubles(n_q * n_q));
    const mhi_path_forces forces = {c->force,   c->force_l,  c->force_w, c->force_q,
                                    c->force_v, c->moment_q, c->moment_v};
    mhi_path_moment_derivatives(c, 0, n_m, &forces);
    if (s->face.n_p > 0) {
        mhi_parameters_forces(c);
    }
    for (int32_t i = 0; i < s->face.n_z; i++) {
        c->force_z[i] = c->force_s[s->z_state[i] * n_m + s->face.z_muscle[i]];
    }
}

/* Rates of z and their derivatives out of those of all states. */
static void state_rates(const mhi_system_context *c, const mhe_acceleration *out) {
    const mhi_system *s = c->system;
    const mhe_system *f = &s->face;
    const int32_t n_q = f->n_q, n_m = f->n_m;
    for (int32_t i = 0; i < f->n_z; i++) {
        const int32_t m = f->z_muscle[i], k = s->z_state[i], at = k * n_m + m;
        const double *l_q = c->length_q + m * n_q, *w_q = c->velocity_q + m * n_q;
        out->zdot[i] = c->rate[at];
        for (int32_t j = 0; j < n_q && out->zdot_q != NULL; j++) {
            out->zdot_q[i * n_q + j] = c->rate_l[at] * l_q[j] + c->rate_w[at] * w_q[j];
        }
        for (int32_t j = 0; j < n_q && out->zdot_v != NULL; j++) {
            out->zdot_v[i * n_q + j] = c->rate_w[at] * l_q[j];
        }
        if (out->zdot_a != NULL && f->n_a > 0) {
            out->zdot_a[i] = c->rate_s[(k * s->n_s + s->activation) * n_m + m];
        }
        if (out->zdot_c != NULL) {
            out->zdot_c[i] = c->rate_e[at];
        }
        for (int32_t j = 0; j < f->n_k && out->zdot_z != NULL; j++) {
            const int32_t other = f->z_of[m * f->n_k + j];
            out->zdot_z[i * f->n_k + j] =
                other < 0 ? 0 : c->rate_s[(k * s->n_s + s->z_state[other]) * n_m + m];
        }
    }
}

/* ---- bounded work ---- */

void mhi_system_context_set_work(mhi_system_context *c, mhi_work *work) {
    c->work = work;
}

void mhi_system_context_settle(mhi_system_context *c) {
    if (c->work != NULL) {
        mhi_work_return(c->work, &c->loan);
    }
}

int32_t mhi_system_context_spent(const mhi_system_context *c) {
    return c->work != NULL && mhi_work_spent(c->work);
}

/* ---- accelerations ---- */

static mhe_status kinematics(mhi_system_context *c, const double *q, const double *v,
                             int32_t dynamics, int32_t derivatives, mhe_error *err) {
    const int own = mhi_anatomy_insertions(c->system->anatomy) == 0;
    const mhe_kinematics out = {.size = sizeof out,
                                .mass = dynamics ? c->mass : NULL,
                                .bias = dynamics ? c->bias : NULL,
                                .length = own ? c->length : NULL,
                                .length_q = own ? c->length_q : NULL,
                                .length_qq = own && derivatives ? c->length_qq : NULL,
                                .body = c->system->most_pairs > 0 ? c->body : NULL,
                                .lengths_clear = 1}; /* nobody else writes there */
    const mhe_status status = c->system->model->kinematics(c->model, q, v, &out, err);
    return status != MHE_OK || own ? status
                                   : mhi_anatomy_lengths(c->anatomy, q, v, c->length, c->length_q,
                                                         derivatives ? c->length_qq : NULL, err);
}

/* moment' + other' - tau' into n_q columns of a row-major matrix of `ld`. */
static inline void torque_derivative(const mhi_system_context *c, const double *moment_d,
                                     const double *other_d, const double *tau_d, double *out,
                                     int32_t ld) {
    const int32_t n_q = c->system->face.n_q;
    for (int32_t i = 0; i < n_q; i++) {
        for (int32_t j = 0; j < n_q; j++) {
            out[i * ld + j] = moment_d[i * n_q + j] - tau_d[i * n_q + j];
        }
        for (int32_t j = 0; j < n_q && other_d != NULL; j++) {
            out[i * ld + j] += other_d[i * n_q + j];
        }
    }
}

/* M^-1 of the torques' derivatives by q and v, and M^-1 itself, in one solve with the factor of M
 * in place: c->solved [n_q x 3 n_q], its rows filled up to whole fours. */
static void solve_derivatives(mhi_system_context *c) {
    const int32_t n_q = c->system->face.n_q, ld = MHI_SOLVED_LD(n_q);
    const double *other_q = c->system->n_forces > 0 ? c->other_q : NULL;
    const double *other_v = c->system->forces_see_rates ? c->other_v : NULL;
    torque_derivative(c, c->moment_q, other_q, c->tau_q, c->solved, ld);
    torque_derivative(c, c->moment_v, other_v, c->tau_v, c->solved + n_q, ld);
    for (int32_t i = 0; i < n_q; i++) {
        memset(c->solved + i * ld + 2 * n_q, 0, doubles(n_q));
        c->solved[i * ld + 2 * n_q + i] = 1;
    }
    mhi_cholesky_solve(c->mass, n_q, c->solved, ld);
}

/* Block of c->solved: 0 by q, 1 by v, 2 by torques. */
static void copy_solved(const mhi_system_context *c, int32_t block, double *out) {
    const int32_t n_q = c->system->face.n_q;
    for (int32_t i = 0; i < n_q; i++) {
        memcpy(out + i * n_q, c->solved + i * MHI_SOLVED_LD(n_q) + block * n_q, doubles(n_q));
    }
}

static void acceleration_by_force(mhi_system_context *c, const double *by, const int32_t *muscle,
                                  int32_t n, double *out) {
    const int32_t n_q = c->system->face.n_q;
    mhi_path_accelerations(c, c->solved + 2 * n_q, MHI_SOLVED_LD(n_q), by, muscle, n, out);
}

/* By residual torques, which M^-1 answers, and the controls of actuators. */
static void residual_accelerations(mhi_system_context *c, double *out) {
    const mhi_system *s = c->system;
    const int32_t n_q = s->face.n_q, n_r = s->face.n_r;
    if (s->n_actuators == 0) {
        for (int32_t i = 0; i < n_q; i++) {
            memcpy(out + i * n_r, c->solved + i * MHI_SOLVED_LD(n_q) + 2 * n_q, doubles(n_r));
        }
        return;
    }
    memset(out, 0, doubles(n_q * n_r));
    for (int32_t i = 0; i < s->n_residual; i++) {
        out[i * n_r + i] = 1;
    }
    for (int32_t i = 0; i < n_q; i++) {
        memcpy(out + i * n_r + s->n_residual, c->drive_r + i * s->n_actuators,
               doubles(s->n_actuators));
    }
    mhi_cholesky_solve(c->mass, n_q, out, n_r);
}

static mhe_status acceleration_derivatives(mhi_system_context *c, const mhe_system_point *at,
                                           const mhe_acceleration *out, mhe_error *err) {
    const mhi_system *s = c->system;
    const mhe_system *f = &s->face;
    const int32_t n_q = f->n_q, n_m = f->n_m;
    /* With tau held, vdot' = M^-1 (moment' - dID/d.(q, v, vdot)): differentiate ID(q, v, vdot) =
     * tau. */
    mhe_status status =
        s->model->inverse_dynamics(c->model, out->vdot, NULL, c->tau_q, c->tau_v, err);
    if (status != MHE_OK) {
        return status;
    }
    if (s->n_c > 0) {
        status = mhi_loops_linearise(c, out->vdot, c->tau_q, err);
        if (status != MHE_OK) {
            return status;
        }
    }
    for (int32_t i = 0; i < n_q * n_q && s->n_actuators > 0; i++) {
        c->tau_q[i] -= c->drive_q[i];
    }
    muscle_derivatives(c);
    if (out->vdot_p != NULL && mhi_anatomy_masses(s->anatomy) > 0) {
        status = mhi_parameters_masses(c, at, out->vdot, err);
        if (status != MHE_OK) {
            return status;
        }
    }
    solve_derivatives(c);
    if (out->vdot_q != NULL) {
        copy_solved(c, 0, out->vdot_q);
        mhi_loops_closed(c, MHI_LOOPS_BY_Q, out->vdot_q, n_q);
    }
    if (out->vdot_v != NULL) {
        copy_solved(c, 1, out->vdot_v);
        mhi_loops_closed(c, MHI_LOOPS_BY_V, out->vdot_v, n_q);
    }
    if (out->vdot_a != NULL && f->n_a > 0) {
        acceleration_by_force(c, c->force_s + s->activation * n_m, NULL, n_m, out->vdot_a);
        mhi_loops_closed(c, MHI_LOOPS_BY_OTHER, out->vdot_a, n_m);
    }
    if (out->vdot_z != NULL && f->n_z > 0) {
        acceleration_by_force(c, c->force_z, f->z_muscle, f->n_z, out->vdot_z);
        mhi_loops_closed(c, MHI_LOOPS_BY_OTHER, out->vdot_z, f->n_z);
    }
    if (out->vdot_p != NULL && f->n_p > 0) {
        memcpy(out->vdot_p, c->moment_p, doubles(n_q * f->n_p));
        mhi_cholesky_solve(c->mass, n_q, out->vdot_p, f->n_p);
        mhi_loops_closed(c, MHI_LOOPS_BY_OTHER, out->vdot_p, f->n_p);
    }
    if (out->vdot_r != NULL && f->n_r > 0) {
        residual_accelerations(c, out->vdot_r);
        mhi_loops_closed(c, MHI_LOOPS_BY_OTHER, out->vdot_r, f->n_r);
    }
    return MHE_OK;
}

mhe_status mhi_system_acceleration(const mhe_system *face, void *context,
                                   const mhe_system_point *at, const mhe_acceleration *out,
                                   mhe_error *err) {
    mhi_system_context *c = context;
    const int32_t n_q = face->n_q, rates = face->n_z > 0 && out->zdot != NULL;
    const int32_t derivatives =
        out->vdot_q != NULL || out->vdot_v != NULL || out->vdot_a != NULL || out->vdot_r != NULL ||
        out->vdot_z != NULL || out->vdot_p != NULL ||
        (rates && (out->zdot_q != NULL || out->zdot_v != NULL || out->zdot_a != NULL ||
                   out->zdot_c != NULL || out->zdot_z != NULL || out->zdot_p != NULL));
    if (c->work != NULL &&
        !mhi_work_take(c->work, derivatives ? MHI_WORK_DERIVATIVES : MHI_WORK_ACCELERATION,
                       &c->loan)) {
        return mhe_fail(err, MHE_RETRY, "the work of this frame is used up");
    }
    mhe_status status = kinematics(c, at->q, at->v, 1, derivatives, err);
    if (status == MHE_OK) {
        status = muscles(c, at, derivatives, rates, err);
    }
    if (status == MHE_OK && c->system->n_forces > 0) {
        if (c->system->n_paths > face->n_m) {
            mhi_path_velocities(c, face->n_m, c->system->n_paths, at->v, derivatives);
        }
        status = mhi_forces_evaluate(c, at, derivatives, err);
    }
    if (status == MHE_OK && c->system->n_actuators > 0) {
        status = mhi_actuators_drive(c, at->q, at->r + c->system->n_residual, derivatives, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    if (mhi_cholesky_factor(c->mass, n_q) != 0) {
        return mhe_fail(err, MHE_RETRY, "the mass matrix is singular at this posture");
    }
    for (int32_t i = 0; i < n_q; i++) {
        out->vdot[i] = c->moment[i] - c->bias[i] + (c->system->n_residual > 0 ? at->r[i] : 0.0);
    }
    for (int32_t i = 0; i < n_q && c->system->n_forces > 0; i++) {
        out->vdot[i] += c->other[i];
    }
    for (int32_t i = 0; i < n_q && c->system->n_actuators > 0; i++) {
        out->vdot[i] += c->drive[i];
    }
    mhi_cholesky_solve(c->mass, n_q, out->vdot, 1);
    if (c->system->n_c > 0) {
        status = mhi_loops_close(c, derivatives, out->vdot, err);
        if (status != MHE_OK) {
            return status;
        }
    }
    if (rates) {
        state_rates(c, out);
    }
    status = derivatives ? acceleration_derivatives(c, at, out, err) : MHE_OK;
    if (status == MHE_OK && rates && out->zdot_p != NULL && face->n_p > 0) {
        mhi_parameters_rates(c, out->zdot_p);
    }
    return status;
}

mhe_status mhi_system_activation_rate(const mhe_system *face, const double *control,
                                      const double *d, double *rate, double *rate_c, double *rate_d,
                                      mhe_error *err) {
    const mhi_system *s = face->data;
    return s->muscle->diagonal_rate(s->muscle_self, s->activation, control, d, rate, rate_c, rate_d,
                                    err);
}

/* ---- outside of the integrators ---- */

mhe_status mhi_system_muscles(mhi_system_context *c, const mhe_system_point *at,
                              int32_t derivatives, mhi_muscle_state *out, mhe_error *err) {
    const mhi_system *s = c->system;
    mhe_status status = kinematics(c, at->q, at->v, 0, derivatives, err);
    if (status == MHE_OK) {
        status = muscles(c, at, derivatives, 0, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    if (derivatives) {
        muscle_derivatives(c);
    }
    *out = (mhi_muscle_state){.length = c->length,
                              .length_q = c->length_q,
                              .velocity = c->velocity,
                              .force = c->force,
                              .force_q = c->force_q,
                              .force_v = c->force_v,
                              .force_a = c->force_s + s->activation * s->face.n_m,
                              .force_z = c->force_z,
                              .force_p = c->force_p,
                              .moment_p = c->moment_p,
                              .moment = c->moment,
                              .moment_q = c->moment_q,
                              .moment_v = c->moment_v};
    return MHE_OK;
}

mhe_status mhi_system_equilibrium(mhi_system_context *c, const double *q, const double *v,
                                  const double *activation, double *x, mhe_error *err) {
    const mhi_system *s = c->system;
    const mhe_system *f = &s->face;
    double *d = x + f->n_x - f->n_z - f->n_d, *z = x + f->n_x - f->n_z;
    if (f->n_d > 0) {
        memcpy(d, activation, doubles(f->n_d));
    }
    if (f->n_z == 0) {
        return MHE_OK;
    }
    mhe_status status = kinematics(c, q, v, 0, 0, err);
    if (status == MHE_OK) {
        mhi_path_velocities(c, 0, f->n_m, v, 0);
        memcpy(c->state + s->activation * f->n_m, activation, doubles(f->n_m));
    }
    if (status == MHE_OK && s->n_s > 1) {
        status = s->muscle->equilibrium(s->muscle_self, activation, c->length, c->velocity,
                                        c->state, err);
    }
    for (int32_t i = 0; i < f->n_z && status == MHE_OK; i++) {
        z[i] = c->state[s->z_state[i] * f->n_m + f->z_muscle[i]];
    }
    return status;
}

mhe_status mhi_system_markers(mhi_system_context *c, const double *q, double *marker,
                              double *marker_q, mhe_error *err) {
    const mhe_kinematics out = {.size = sizeof out, .marker = marker, .marker_q = marker_q};
    if (c->work != NULL) { /* bounded by itself: never refused */
        (void)mhi_work_count(c->work, marker_q != NULL ? 2 : 1, &c->loan);
    }
    return c->system->model->kinematics(c->model, q, c->zero, &out, err);
}

mhe_status mhi_system_bodies(mhi_system_context *c, const double *q, double *body, double *body_q,
                             mhe_error *err) {
    const mhe_kinematics out = {.size = sizeof out, .body = body, .body_q = body_q};
    return c->system->model->kinematics(c->model, q, c->zero, &out, err);
}

const double *mhi_system_activation(const mhi_system *s, const double *x, const double *u) {
    const mhe_block *block = mhe_layout_find(&s->layout, MHE_ROLE_STATE, "activation");
    return block != NULL ? x + block->first : u;
}

void mhi_system_point(const mhi_system *s, const double *x, const double *u, const double *w,
                      mhe_system_point *point) {
    const mhe_system *f = &s->face;
    const double *d = x + f->first_d;
    *point = (mhe_system_point){.size = sizeof *point,
                                .q = x,
                                .v = x + f->n_q,
                                .a = f->n_d > 0 ? d : (f->n_a > 0 ? u : NULL),
                                .z = f->n_z > 0 ? d + f->n_d : NULL,
                                .c = u,
                                .r = f->n_r > 0 && u != NULL ? u + f->n_m : NULL,
                                .w = w};
}

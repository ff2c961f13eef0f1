/* SPDX-License-Identifier: Apache-2.0 */
/* model.c: evaluation; from joints theta = f(q) to coordinates.
 *
 * With J = dtheta/dq (row i: f_i' in the column of joint i's coordinate), T the joints' torques:
 *     theta' = f' v,  theta'' = f' vdot + f'' v^2,  M_q = J^T M J,  tau = J^T T,
 * and the derivatives of tau follow by the chain rule with f'', f'''. */
#include "context.h"
#include "numbers.h"

#include "../clones.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

/* Four doubles, wherever they lie. */
typedef double lanes __attribute__((vector_size(32), aligned(8), may_alias));

/* In sums that do not wait for each other. */
static inline __attribute__((always_inline)) int finite(const double *values, size_t n) {
    lanes sum[2] = {{0}};
    double rest = 0;
    size_t i = 0;
    for (; i + 8 <= n; i += 8) {
        sum[0] += *(const lanes *)(values + i) * 0.0;
        sum[1] += *(const lanes *)(values + i + 4) * 0.0;
    }
    for (; i < n; i++) {
        rest += values[i] * 0.0;
    }
    sum[0] += sum[1];
    return (sum[0][0] + sum[0][1]) + (sum[0][2] + sum[0][3]) + rest == 0;
}

static int all_finite(const double *values, size_t n) {
    return finite(values, n);
}

CLONES static int many_finite(const double *values, size_t n) {
    return finite(values, n);
}

/* out [n_q] = J^T torque */
static void to_coordinates(const simbody_context *c, const double *torque, double *out) {
    if (c->tree->direct) {
        memcpy(out, torque, sizeof *out * (size_t)c->tree->n_q);
        return;
    }
    memset(out, 0, sizeof *out * (size_t)c->tree->n_q);
    for (int32_t i = 0; i < c->tree->n_joints; i++) {
        out[c->tree->joints[i].coordinate] += c->slopes[4 * i + 1] * torque[i];
    }
}

static mhe_status context_place(simbody_context *c, const double *q, const double *v,
                                mhe_error *err) {
    const tree *t = c->tree;
    c->placed = c->has_mass = c->has_motion = c->has_rates = 0;
    memcpy(c->v, v, sizeof *v * (size_t)t->n_q);
    numbers_evaluate(c->description, q, c->numbers);
    for (int32_t i = 0; i < t->n_joints; i++) {
        const tree_joint *joint = &t->joints[i];
        double *f = c->slopes + 4 * i;
        if (joint->affine) {
            const double *coef = joint->function->coef;
            f[0] = coef[1] * (q[joint->number] - joint->function->origin[0]) + coef[0];
            f[1] = coef[1];
            f[2] = f[3] = 0;
        } else {
            function_compose(joint->function, c->numbers + 4 * joint->number, f);
        }
        c->angle[i] = f[0];
        c->speed[i] = f[1] * v[joint->coordinate];
    }
    if (!all_finite(c->slopes, 4 * (size_t)t->n_joints)) {
        return mhe_fail(err, MHE_RETRY, "a joint's function of its coordinate is not finite");
    }
    if (c->dynamics == SIMBODY_DYNAMICS_SIMBODY) {
        mhe_status status = skeleton_place(c->skeleton, c->angle, c->r, c->p, err);
        if (status != MHE_OK) {
            return status;
        }
    } else {
        dynamics_place(t, c->angle, c->r, c->p);
    }
    dynamics_axes(t, c->r, c->p, c->links);
    c->placed = 1;
    return MHE_OK;
}

static mhe_status context_mass(simbody_context *c, mhe_error *err) {
    const tree *t = c->tree;
    size_t n = (size_t)t->n_joints, n_q = (size_t)t->n_q;
    if (c->has_mass) {
        return MHE_OK;
    }
    double *joint_mass = t->direct ? c->mass : c->joint_mass;
    dynamics_inertias(t, c->r, c->p, c->links, c->points);
    if (c->dynamics == SIMBODY_DYNAMICS_SIMBODY) {
        mhe_status status = skeleton_dynamics(c->skeleton, NULL, NULL, NULL, joint_mass, err);
        if (status != MHE_OK) {
            return status;
        }
    } else {
        dynamics_mass(t, c->links, joint_mass);
    }
    c->has_mass = 1;
    if (t->direct) {
        return MHE_OK;
    }
    memset(c->mass, 0, n_q * n_q * sizeof *c->mass);
    for (size_t i = 0; i < n; i++) {
        size_t row = (size_t)t->joints[i].coordinate;
        for (size_t j = 0; j < n; j++) {
            size_t column = (size_t)t->joints[j].coordinate;
            c->mass[row * n_q + column] +=
                c->slopes[4 * i + 1] * c->joint_mass[i * n + j] * c->slopes[4 * j + 1];
        }
    }
    return MHE_OK;
}

/* Torques of the joints, left in c->torque, for accelerations vdot of the coordinates (NULL: 0). */
static mhe_status context_torque(simbody_context *c, const double *vdot, mhe_error *err) {
    const tree *t = c->tree;
    for (int32_t i = 0; i < t->n_joints; i++) {
        int32_t coordinate = t->joints[i].coordinate;
        const double *f = c->slopes + 4 * i;
        double v = c->v[coordinate];
        c->acceleration[i] = f[2] * v * v + (vdot == NULL ? 0 : f[1] * vdot[coordinate]);
    }
    if (c->dynamics == SIMBODY_DYNAMICS_SIMBODY) {
        return skeleton_dynamics(c->skeleton, c->speed, c->acceleration, c->torque, NULL, err);
    }
    dynamics_inverse(t, c->speed, c->acceleration, c->links, c->torque);
    for (int32_t i = 0; i < t->n_joints; i++) {
        c->torque[i] += c->rounding_torque[i];
    }
    return MHE_OK;
}

static mhe_status context_motion(simbody_context *c, mhe_error *err) {
    if (c->has_motion) {
        return MHE_OK;
    }
    mhe_status status = context_mass(c, err);
    if (status != MHE_OK) {
        return status;
    }
    dynamics_velocities(c->tree, c->speed, c->links);
    if (c->rounding != NULL) {
        rounding_torque(c->tree, c->r, c->p, c->speed, c->links, c->points, c->rounding,
                        c->rounding_torque);
    }
    status = context_torque(c, NULL, err);
    to_coordinates(c, c->torque, c->bias);
    c->has_motion = status == MHE_OK;
    return status;
}

/* Up to so many coordinates all entries are looked at, beyond only the paths' own. */
#define FEW_COORDINATES 8

/* Derivatives of lengths are 0 but in each path's own coordinates. */
static int lengths_finite(const simbody_context *c, const mhe_kinematics *out) {
    size_t n_q = (size_t)c->tree->n_q, n_p = (size_t)c->tree->n_muscles;
    double sum = 0;
    if (n_q <= FEW_COORDINATES) {
        return (out->length_q == NULL || many_finite(out->length_q, n_p * n_q)) &&
               (out->length_qq == NULL || many_finite(out->length_qq, n_p * n_q * n_q));
    }
    for (size_t p = 0; p < n_p; p++) {
        const int32_t *own = c->own + c->own_start[p];
        int32_t n = c->own_start[p + 1] - c->own_start[p];
        for (int32_t i = 0; i < n; i++) {
            size_t row = p * n_q + (size_t)own[i];
            double of_row = out->length_q != NULL ? out->length_q[row] * 0.0 : 0;
            for (int32_t j = 0; j <= i && out->length_qq != NULL; j++) {
                of_row += out->length_qq[row * n_q + (size_t)own[j]] * 0.0;
            }
            sum += of_row; /* the rows do not wait for each other */
        }
    }
    return sum == 0;
}

/* Zeros for what the paths add up; length_q may be another array than that of `out`. */
static void clear_lengths(const simbody_context *c, const mhe_kinematics *out, double *length_q) {
    const size_t n_q = (size_t)c->tree->n_q, n_p = (size_t)c->tree->n_muscles;
    const int own_only = out->size > offsetof(mhe_kinematics, lengths_clear) &&
                         out->lengths_clear && n_q > FEW_COORDINATES && length_q == out->length_q;
    if (!own_only) {
        if (length_q != NULL) {
            memset(length_q, 0, sizeof *length_q * n_p * n_q);
        }
        if (out->length_qq != NULL) {
            memset(out->length_qq, 0, sizeof *out->length_qq * n_p * n_q * n_q);
        }
        return;
    }
    for (size_t p = 0; p < n_p; p++) {
        for (int32_t i = c->own_start[p]; i < c->own_start[p + 1]; i++) {
            const size_t row = p * n_q + (size_t)c->own[i];
            if (length_q != NULL) {
                length_q[row] = 0;
            }
            for (int32_t j = c->own_start[p]; j < c->own_start[p + 1] && out->length_qq != NULL;
                 j++) {
                out->length_qq[row * n_q + (size_t)c->own[j]] = 0;
            }
        }
    }
}

/* Whatever of the outputs was asked for is finite. */
static int results_finite(const simbody_context *c, const mhe_kinematics *out) {
    const tree *t = c->tree;
    size_t n_q = (size_t)t->n_q, n_m = (size_t)t->n_muscles, n_k = 3 * (size_t)t->n_markers;
    size_t n_b = (size_t)t->n_bodies;
    return (out->mass == NULL || all_finite(out->mass, n_q * n_q)) &&
           (out->bias == NULL || all_finite(out->bias, n_q)) &&
           (out->length == NULL || all_finite(out->length, n_m)) && lengths_finite(c, out) &&
           (out->marker == NULL || all_finite(out->marker, n_k)) &&
           (out->marker_q == NULL || many_finite(out->marker_q, n_k * n_q)) &&
           (out->body == NULL || all_finite(out->body, 12 * n_b)) &&
           (out->body_q == NULL || many_finite(out->body_q, 6 * n_b * n_q));
}

mhe_status simbody_kinematics(void *context, const double *q, const double *v,
                              const mhe_kinematics *out, mhe_error *err) {
    simbody_context *c = context;
    const tree *t = c->tree;
    size_t n_q = (size_t)t->n_q;
    c->placed = 0;
    if (!all_finite(q, n_q) || !all_finite(v, n_q)) {
        return mhe_fail(err, MHE_RETRY, "a position or speed is not finite");
    }
    mhe_status status = context_place(c, q, v, err);
    if (status == MHE_OK && out->mass != NULL) {
        status = context_mass(c, err);
    }
    if (status == MHE_OK && out->bias != NULL) {
        status = context_motion(c, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    if (out->mass != NULL) {
        memcpy(out->mass, c->mass, n_q * n_q * sizeof *out->mass);
    }
    if (out->bias != NULL) {
        memcpy(out->bias, c->bias, n_q * sizeof *out->bias);
    }
    path_pose pose = {.r = c->r, .p = c->p, .slopes = c->slopes};
    if (out->length != NULL || out->length_q != NULL || out->length_qq != NULL) {
        int scratch = out->length_qq != NULL && out->length_q == NULL;
        double *length_q = scratch ? c->length_q : out->length_q;
        clear_lengths(c, out, length_q);
        path_lengths(t, c->bundles, c->n_bundles, &pose, c->steps, out->length, length_q,
                     out->length_qq);
        routes_lengths(t, c->routes, &pose, c->numbers, &c->route_work, out->length, out->length_q,
                       out->length_qq);
    }
    if (out->marker != NULL || out->marker_q != NULL) {
        path_markers(t, &pose, out->marker, out->marker_q);
    }
    bodies_place(c, out->body, out->body_q);
    for (int32_t i = 0; i < c->description->n_dependents && out->dependent != NULL; i++) {
        out->dependent[i] = c->numbers[4 * (t->n_q + i)];
    }
    return results_finite(c, out) ? MHE_OK
                                  : mhe_fail(err, MHE_RETRY, "a result of the model is not finite");
}

/* tau_q and tau_v from the derivatives of the joints' torques; NULL: not wanted. */
static void chain_derivatives(const simbody_context *c, const double *vdot, double *tau_q,
                              double *tau_v) {
    const tree *t = c->tree;
    size_t n = (size_t)t->n_joints, n_q = (size_t)t->n_q;
    for (size_t j = 0; j < n; j++) {
        const double *f = c->slopes + 4 * j;
        size_t column = (size_t)t->joints[j].coordinate;
        double v = c->v[column];
        double acceleration_q = f[2] * vdot[column] + f[3] * v * v;
        for (size_t i = 0; i < n; i++) {
            size_t entry = (size_t)t->joints[i].coordinate * n_q + column;
            double slope = c->slopes[4 * i + 1], mass = c->joint_mass[i * n + j];
            if (tau_q != NULL) {
                tau_q[entry] += slope * (c->by_angle[i * n + j] * f[1] +
                                         c->by_speed[i * n + j] * f[2] * v + mass * acceleration_q);
            }
            if (tau_v != NULL) {
                tau_v[entry] += slope * (c->by_speed[i * n + j] * f[1] + mass * 2 * f[2] * v);
            }
        }
        if (tau_q != NULL) { /* J itself */
            tau_q[column * n_q + column] += f[2] * c->torque[j];
        }
    }
}

mhe_status simbody_inverse_dynamics(void *context, const double *vdot, double *tau, double *tau_q,
                                    double *tau_v, mhe_error *err) {
    simbody_context *c = context;
    const tree *t = c->tree;
    size_t n_q = (size_t)t->n_q;
    if (!c->placed || !all_finite(vdot, n_q)) {
        return mhe_fail(err, MHE_RETRY, "no state is set, or an acceleration is not finite");
    }
    mhe_status status = context_motion(c, err);
    if (status == MHE_OK) {
        status = context_torque(c, vdot, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    if (tau_q != NULL || tau_v != NULL) {
        if (c->dynamics == SIMBODY_DYNAMICS_SIMBODY) { /* the derivatives need the links' forces */
            dynamics_inverse(t, c->speed, c->acceleration, c->links, c->torque);
        }
        if (!c->has_rates) {
            dynamics_rates(t, c->links);
            c->has_rates = 1;
        }
        const int direct = t->direct;
        dynamics_derivatives(t, c->links, direct && tau_q != NULL ? tau_q : c->by_angle,
                             direct && tau_v != NULL ? tau_v : c->by_speed);
    }
    if (tau_q != NULL && !t->direct) {
        memset(tau_q, 0, n_q * n_q * sizeof *tau_q);
    }
    if (tau_v != NULL && !t->direct) {
        memset(tau_v, 0, n_q * n_q * sizeof *tau_v);
    }
    if (!t->direct) {
        chain_derivatives(c, vdot, tau_q, tau_v);
    }
    if (tau != NULL) {
        to_coordinates(c, c->torque, tau);
    }
    const int sound = (tau == NULL || all_finite(tau, n_q)) &&
                      (tau_q == NULL || all_finite(tau_q, n_q * n_q)) &&
                      (tau_v == NULL || all_finite(tau_v, n_q * n_q));
    return sound ? MHE_OK : mhe_fail(err, MHE_RETRY, "a torque of the model is not finite");
}

/* Solves a x = b in place of b by Cholesky, in place of a; not 0: a is not positive definite. */
static int solve_positive(double *a, double *b, size_t n) {
    for (size_t j = 0; j < n; j++) {
        for (size_t i = j; i < n; i++) {
            double sum = a[i * n + j];
            for (size_t k = 0; k < j; k++) {
                sum -= a[i * n + k] * a[j * n + k];
            }
            if (i == j && !(sum > 0)) {
                return 1;
            }
            a[i * n + j] = i == j ? sqrt(sum) : sum / a[j * n + j];
        }
    }
    for (size_t i = 0; i < n; i++) {
        for (size_t k = 0; k < i; k++) {
            b[i] -= a[i * n + k] * b[k];
        }
        b[i] /= a[i * n + i];
    }
    for (size_t i = n; i-- > 0;) {
        for (size_t k = i + 1; k < n; k++) {
            b[i] -= a[k * n + i] * b[k];
        }
        b[i] /= a[i * n + i];
    }
    return 0;
}

mhe_status simbody_forward_dynamics(void *context, const double *tau, double *vdot,
                                    mhe_error *err) {
    simbody_context *c = context;
    size_t n_q = (size_t)c->tree->n_q;
    if (!c->placed || !all_finite(tau, n_q)) {
        return mhe_fail(err, MHE_RETRY, "no state is set, or a torque is not finite");
    }
    mhe_status status = context_motion(c, err);
    if (status != MHE_OK) {
        return status;
    }
    memcpy(c->factor, c->mass, n_q * n_q * sizeof *c->factor);
    for (size_t i = 0; i < n_q; i++) {
        c->rest[i] = tau[i] - c->bias[i];
    }
    if (solve_positive(c->factor, c->rest, n_q) != 0 || !all_finite(c->rest, n_q)) {
        return mhe_fail(err, MHE_RETRY, "the mass matrix is singular at this position");
    }
    memcpy(vdot, c->rest, n_q * sizeof *vdot);
    return MHE_OK;
}

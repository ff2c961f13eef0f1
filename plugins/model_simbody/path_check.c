/* SPDX-License-Identifier: Apache-2.0 */
/* path_check.c: refuses couplers, paths and obstacles that make no sense. */
#include "route.h"
#include "vector.h"

#include <math.h>

static int finite_all(const double *values, int32_t n) {
    double sum = 0;
    for (int32_t i = 0; i < n; i++) {
        sum += values[i] * 0.0;
    }
    return sum == 0;
}

static int function_is_sound(const mhe_function *f) {
    if (f->n_pieces < 1 || f->n_coef < 1 || f->origin == NULL || f->coef == NULL ||
        !finite_all(f->origin, f->n_pieces) || !finite_all(f->coef, f->n_pieces * f->n_coef)) {
        return 0;
    }
    for (int32_t i = 2; i < f->n_pieces; i++) {
        if (!(f->origin[i] > f->origin[i - 1])) {
            return 0;
        }
    }
    return 1;
}

static int is_number(const mhe_description *d, int32_t number) {
    return number >= 0 && number < d->n_coordinates + d->n_dependents;
}

mhe_status check_dependents(const mhe_description *d, mhe_error *err) {
    for (int32_t i = 0; i < d->n_dependents; i++) {
        const mhe_dependent *dependent = &d->dependents[i];
        if (dependent->independent < 0 || dependent->independent >= d->n_coordinates + i) {
            return mhe_fail(err, MHE_E_INPUT,
                            "dependent coordinate '%s': it can only be a function of a free "
                            "coordinate or of a dependent one before it",
                            dependent->coordinate.name);
        }
        if (!function_is_sound(&dependent->function)) {
            return mhe_fail(err, MHE_E_INPUT,
                            "dependent coordinate '%s': its function is not valid",
                            dependent->coordinate.name);
        }
    }
    return MHE_OK;
}

static mhe_status check_obstacle(const mhe_description *d, const mhe_obstacle *o, mhe_error *err) {
    static const int32_t n_sizes[] = {1, 2, 3, 2};
    if (o->kind < MHE_OBSTACLE_SPHERE || o->kind > MHE_OBSTACLE_TORUS) {
        return mhe_fail(err, MHE_E_INPUT, "obstacle '%s': unknown kind %d", o->name, (int)o->kind);
    }
    if (o->body < -1 || o->body >= d->n_bodies || !finite_all(o->p, 3) ||
        !(off_orthogonal3(o->r) < 1e-3)) {
        return mhe_fail(err, MHE_E_INPUT, "obstacle '%s': its body or frame is not valid", o->name);
    }
    for (int32_t k = 0; k < n_sizes[o->kind]; k++) {
        if (!(o->size[k] > 0) || !isfinite(o->size[k])) {
            return mhe_fail(err, MHE_E_INPUT, "obstacle '%s': size %g m is not > 0", o->name,
                            o->size[k]);
        }
    }
    if (o->kind == MHE_OBSTACLE_TORUS && !(o->size[0] < o->size[1])) {
        return mhe_fail(err, MHE_E_INPUT,
                        "obstacle '%s': the tube's radius %g m is not less than the ring's, %g m",
                        o->name, o->size[0], o->size[1]);
    }
    if (o->side_axis < -1 || o->side_axis > 2 ||
        (o->side_axis >= 0 && o->side_sign != 1 && o->side_sign != -1)) {
        return mhe_fail(err, MHE_E_INPUT, "obstacle '%s': its side is not one of +-x, +-y, +-z",
                        o->name);
    }
    return MHE_OK;
}

static mhe_status check_point(const mhe_description *d, const mhe_path *path, int32_t k,
                              mhe_error *err) {
    const mhe_path_point *point = &path->points[k];
    if (point->kind < MHE_POINT_FIXED || point->kind > MHE_POINT_CONDITIONAL || point->body < -1 ||
        point->body >= d->n_bodies || !finite_all(point->location, 3)) {
        return mhe_fail(err, MHE_E_INPUT,
                        "path '%s': point %d: its kind, body or location is not "
                        "valid",
                        path->name, (int)k + 1);
    }
    for (int i = 0; i < 3 && point->kind == MHE_POINT_MOVING; i++) {
        if (point->coordinate[i] != -1 &&
            (!is_number(d, point->coordinate[i]) || !function_is_sound(&point->function[i]))) {
            return mhe_fail(err, MHE_E_INPUT,
                            "path '%s': point %d moves with a coordinate or function that is not "
                            "valid",
                            path->name, (int)k + 1);
        }
    }
    if (point->kind == MHE_POINT_CONDITIONAL &&
        (!is_number(d, point->coordinate[0]) || !(point->lower <= point->upper))) {
        return mhe_fail(err, MHE_E_INPUT,
                        "path '%s': point %d is on in a range that is none, from %g to %g",
                        path->name, (int)k + 1, point->lower, point->upper);
    }
    return MHE_OK;
}

static mhe_status check_polynomial(const mhe_description *d, const mhe_path *path, mhe_error *err) {
    const mhe_polynomial *p = path->length;
    int valid = p->n >= 0 && p->n_terms >= 0 && finite_all(p->centre, p->n) &&
                finite_all(p->scale, p->n) && finite_all(p->coef, p->n_terms);
    for (int32_t k = 0; k < p->n && valid; k++) {
        valid = is_number(d, p->coordinate[k]) && p->scale[k] != 0;
    }
    for (int32_t i = 0; i < p->n_terms && valid; i++) {
        int32_t factors = 0;
        for (int32_t k = 0; k < p->n; k++) {
            int32_t e = p->exponent[i * p->n + k];
            valid = valid && e < POLYNOMIAL_POWERS;
            factors += e > 0;
        }
        valid = valid && factors <= POLYNOMIAL_FACTORS;
    }
    return valid ? MHE_OK
                 : mhe_fail(err, MHE_E_INPUT,
                            "path '%s': its polynomial is not valid (exponents "
                            "below %d, at most %d coordinates in a term)",
                            path->name, POLYNOMIAL_POWERS, POLYNOMIAL_FACTORS);
}

static mhe_status check_path(const mhe_description *d, const mhe_path *path, mhe_error *err) {
    if (path->n_points == 0 && path->length != NULL) {
        return check_polynomial(d, path, err);
    }
    if (path->n_points < 2) {
        return mhe_fail(err, MHE_E_INPUT, "path '%s': %d points, where two are the least",
                        path->name, (int)path->n_points);
    }
    int32_t always = 0;
    for (int32_t k = 0; k < path->n_points; k++) {
        mhe_status status = check_point(d, path, k, err);
        if (status != MHE_OK) {
            return status;
        }
        always += path->points[k].kind != MHE_POINT_CONDITIONAL;
    }
    if (always == 0) {
        return mhe_fail(err, MHE_E_INPUT, "path '%s' (line %d): every point is conditional",
                        path->name, (int)path->line);
    }
    for (int32_t w = 0; w < path->n_wraps; w++) {
        const mhe_path_wrap *wrap = &path->wraps[w];
        if (wrap->obstacle < 0 || wrap->obstacle >= d->n_obstacles || wrap->first < -1 ||
            wrap->last < -1 || wrap->first >= path->n_points || wrap->last >= path->n_points) {
            return mhe_fail(err, MHE_E_INPUT,
                            "path '%s': wrap %d: its obstacle or range is not "
                            "there",
                            path->name, (int)w + 1);
        }
        for (int32_t k = 0; k < w; k++) {
            const mhe_path_wrap *other = &path->wraps[k];
            int after = other->last >= 0 && wrap->first >= other->last;
            int before = wrap->last >= 0 && other->first >= wrap->last;
            if (other->obstacle == wrap->obstacle && !after && !before) {
                return mhe_fail(err, MHE_E_INPUT,
                                "path '%s': it wraps twice around '%s' between the same points",
                                path->name, d->obstacles[wrap->obstacle].name);
            }
        }
    }
    return MHE_OK;
}

mhe_status check_paths(const mhe_description *d, mhe_error *err) {
    for (int32_t i = 0; i < d->n_obstacles; i++) {
        mhe_status status = check_obstacle(d, &d->obstacles[i], err);
        if (status != MHE_OK) {
            return status;
        }
    }
    for (int32_t i = 0; i < d->n_paths; i++) {
        mhe_status status = check_path(d, &d->paths[i], err);
        if (status != MHE_OK) {
            return status;
        }
    }
    return MHE_OK;
}

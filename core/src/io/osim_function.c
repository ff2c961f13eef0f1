/* SPDX-License-Identifier: Apache-2.0 */
/* osim_function.c: OpenSim's functions of one variable as rows of polynomial pieces. */
#include "io/osim.h"

#include <math.h>
#include <string.h>

/* Points that are nearer to each other are one point written twice, with a rounding between. */
#define X_APART 1e-13

/* The function element of a holder: named "function", within <function>, or the one child that is
 * nothing else. */
static xmlNode *function_element(xmlNode *holder) {
    xmlNode *wrapper = mhi_xml_child(holder, "function");
    if (wrapper != NULL) {
        return mhi_xml_first(wrapper);
    }
    xmlNode *node = mhi_xml_first(holder);
    while (node != NULL && (mhi_xml_is(node, "coordinates") || mhi_xml_is(node, "axis") ||
                            mhi_xml_is(node, "scale"))) {
        node = mhi_xml_next(node);
    }
    return node;
}

static int32_t read_linear(mhi_osim *o, xmlNode *node, const char *whose, mhe_function *function) {
    double c[2] = {1, 0};
    (void)whose;
    (void)mhi_xml_numbers(o, node, "coefficients", c, 2);
    *function = mhi_function_polynomial(&o->b, (const double[2]){c[1], c[0]}, 2);
    return 1;
}

static int32_t read_constant(mhi_osim *o, xmlNode *node, const char *whose,
                             mhe_function *function) {
    double value = 0;
    (void)whose;
    (void)mhi_xml_numbers(o, node, "value", &value, 1);
    *function = mhi_function_constant(&o->b, value);
    return 1;
}

/* Coefficients with the highest power first. */
static int32_t read_polynomial(mhi_osim *o, xmlNode *node, const char *whose,
                               mhe_function *function) {
    int32_t n;
    double *c = mhi_xml_all_numbers(o, mhi_xml_property(node, "coefficients"), &n);
    if (c == NULL || n < 1) {
        mhi_build_fail(&o->b, mhi_xml_line(node), "<PolynomialFunction> of %s has no coefficients",
                       whose);
        return -1;
    }
    for (int32_t i = 0; i < n / 2; i++) {
        double swap = c[i];
        c[i] = c[n - 1 - i];
        c[n - 1 - i] = swap;
    }
    *function = mhi_function_polynomial(&o->b, c, n);
    return 1;
}

/* A point that stands there twice is moved by what OpenSim takes for the least step of x
 * (SimmMacros.h, TINY_NUMBER): its spline is then level there, and so is this one. 0: it is no such
 * point. */
static int32_t repeated(mhi_osim *o, xmlNode *node, const char *whose, double *x, const double *y,
                        int32_t i) {
    const double least = 1e-7;
    const double at = x[i];
    if (!(x[i - 1] - at <= least) || y[i] != y[i - 1]) {
        return 0;
    }
    mhi_build_warn(&o->b, mhi_xml_line(node),
                   "<%s> of %s has the point at %g twice: as in OpenSim it is level there",
                   (const char *)node->name, whose, at);
    x[i] = x[i - 1] + least;
    return 1;
}

/* x and y of a spline or broken line; 0 after an error. */
static int32_t read_points(mhi_osim *o, xmlNode *node, const char *whose, const double **x,
                           const double **y, int32_t *n) {
    int32_t n_y;
    double *place = mhi_xml_all_numbers(o, mhi_xml_property(node, "x"), n);
    *x = place;
    *y = mhi_xml_all_numbers(o, mhi_xml_property(node, "y"), &n_y);
    if (o->b.status != MHE_OK) {
        return 0;
    }
    if (*x == NULL || *y == NULL || *n != n_y || *n < 2) {
        mhi_build_fail(&o->b, mhi_xml_line(node),
                       "<%s> of %s needs as many x as y, at least 2 (has %d and %d)",
                       (const char *)node->name, whose, (int)*n, (int)n_y);
        return 0;
    }
    for (int32_t i = 1; i < *n; i++) {
        if (place[i] - place[i - 1] <= X_APART * fabs(place[i]) &&
            !repeated(o, node, whose, place, *y, i)) {
            mhi_build_fail(&o->b, mhi_xml_line(node), "<%s> of %s: x does not increase at %g",
                           (const char *)node->name, whose, (*x)[i]);
            return 0;
        }
    }
    return 1;
}

/* The smallest number of points that OpenSim's fit of that order takes is 2 half_order; a larger
 * error variance than 0 would smooth. */
static int32_t read_gcv(mhi_osim *o, xmlNode *node, const char *whose, mhe_function *function) {
    const double *x, *y;
    double half_order = 3, variance = 0;
    int32_t n;
    (void)mhi_xml_numbers(o, node, "half_order", &half_order, 1);
    (void)mhi_xml_numbers(o, node, "error_variance", &variance, 1);
    if (!read_points(o, node, whose, &x, &y, &n)) {
        return -1;
    }
    if (variance != 0) {
        mhi_build_unsupported(&o->b, mhi_xml_line(node),
                              "GCVSpline of %s: its error_variance %g would smooth; it is not "
                              "applied",
                              whose, variance);
    }
    if (!(half_order >= 1 && half_order <= 4) || half_order != floor(half_order) ||
        n < 2 * (int32_t)half_order) {
        mhi_build_fail(&o->b, mhi_xml_line(node),
                       "<GCVSpline> of %s: half_order %g needs to be 1, 2, 3 or 4, and at least "
                       "twice as many points as that (has %d)",
                       whose, half_order, (int)n);
        return -1;
    }
    *function = mhi_function_natural_spline(&o->b, x, y, n, (int32_t)half_order);
    return 1;
}

/* From start_value to end_value by a quintic with flat ends. */
static int32_t read_step(mhi_osim *o, xmlNode *node, const char *whose, mhe_function *function) {
    double t0 = 0, t1 = 1, y0 = 0, y1 = 1;
    (void)mhi_xml_numbers(o, node, "start_time", &t0, 1);
    (void)mhi_xml_numbers(o, node, "end_time", &t1, 1);
    (void)mhi_xml_numbers(o, node, "start_value", &y0, 1);
    (void)mhi_xml_numbers(o, node, "end_value", &y1, 1);
    if (!(t1 > t0)) {
        mhi_build_fail(&o->b, mhi_xml_line(node),
                       "<StepFunction> of %s ends (%g) before it begins "
                       "(%g)",
                       whose, t1, t0);
        return -1;
    }
    *function = mhi_function_step(&o->b, t0, t1, y0, y1);
    return 1;
}

static int32_t read_spline(mhi_osim *o, xmlNode *node, const char *whose, mhe_function *function) {
    const double *x, *y;
    int32_t n;
    if (!read_points(o, node, whose, &x, &y, &n)) {
        return -1;
    }
    *function = mhi_function_spline(&o->b, x, y, n);
    return 1;
}

static int32_t read_broken_line(mhi_osim *o, xmlNode *node, const char *whose,
                                mhe_function *function) {
    const double *x, *y;
    int32_t n;
    if (!read_points(o, node, whose, &x, &y, &n)) {
        return -1;
    }
    *function = mhi_function_broken_line(&o->b, x, y, n);
    return 1;
}

static int32_t read_multiplier(mhi_osim *o, xmlNode *node, const char *whose,
                               mhe_function *function) {
    double scale = 1;
    mhe_function inner = {0};
    (void)mhi_xml_numbers(o, node, "scale", &scale, 1);
    int32_t found = mhi_osim_function(o, node, whose, &inner);
    if (found == 1) {
        *function = mhi_function_scaled(&o->b, scale, inner);
    }
    return found;
}

static int32_t read_element(mhi_osim *o, xmlNode *node, const char *whose, mhe_function *function) {
    static const struct {
        const char *tag;
        int32_t (*read)(mhi_osim *, xmlNode *, const char *, mhe_function *);
    } readers[] = {{"LinearFunction", read_linear},
                   {"Constant", read_constant},
                   {"SimmSpline", read_spline},
                   {"NaturalCubicSpline", read_spline},
                   {"natCubicSpline", read_spline},
                   {"GCVSpline", read_gcv},
                   {"StepFunction", read_step},
                   {"PiecewiseLinearFunction", read_broken_line},
                   {"PolynomialFunction", read_polynomial},
                   {"MultiplierFunction", read_multiplier}};
    if (node == NULL) {
        return 0;
    }
    for (size_t i = 0; i < sizeof readers / sizeof *readers; i++) {
        if (mhi_xml_is(node, readers[i].tag)) {
            int32_t found = readers[i].read(o, node, whose, function);
            for (int32_t k = 0; found == 1 && k < function->n_pieces * function->n_coef; k++) {
                if (!isfinite(function->coef[k])) {
                    mhi_build_fail(&o->b, mhi_xml_line(node),
                                   "<%s> of %s: its slopes are beyond any number: are two x as "
                                   "good as the same?",
                                   readers[i].tag, whose);
                    break;
                }
            }
            return o->b.status == MHE_OK ? found : -1;
        }
    }
    mhi_build_unsupported(&o->b, mhi_xml_line(node),
                          "function <%s> of %s: what it gives stays at 0", (const char *)node->name,
                          whose);
    return -1;
}

int32_t mhi_osim_function(mhi_osim *o, xmlNode *holder, const char *whose, mhe_function *function) {
    return read_element(o, function_element(holder), whose, function);
}

int32_t mhi_osim_function_of(mhi_osim *o, xmlNode *object, const char *name, const char *whose,
                             mhe_function *function) {
    xmlNode *node = mhi_xml_property(object, name);
    if (node != NULL) {
        return read_element(o, mhi_xml_first(node), whose, function);
    }
    for (node = mhi_xml_first(object); node != NULL; node = mhi_xml_next(node)) {
        if (strcmp(mhi_xml_name(o, node), name) == 0) {
            return read_element(o, node, whose, function);
        }
    }
    return 0;
}

/* SPDX-License-Identifier: Apache-2.0 */
/* osim_path.c: paths of muscles, ligaments and springs: points, wraps, or a polynomial. */
#include "io/osim.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* OpenSim takes a conditional point as on this far outside of its range (rad or m). */
#define RANGE_MARGIN 1e-5

/* A property that was an element before 4.0 and is a socket since; NULL: neither. */
static const char *coordinate_of(mhi_osim *o, xmlNode *point, const char *name) {
    const char *text = mhi_osim_socket(o, point, name);
    return text != NULL ? text : mhi_xml_word(o, point, name);
}

static void read_conditional(mhi_osim *o, xmlNode *node, const char *whose, mhe_path_point *out) {
    const char *coordinate = coordinate_of(o, node, "coordinate");
    double range[2] = {0, 0};
    out->kind = MHE_POINT_CONDITIONAL;
    if (coordinate == NULL) { /* before 2.0 */
        coordinate = mhi_xml_word(o, node, "coordinates");
    }
    if (coordinate == NULL) {
        mhi_build_fail(&o->b, mhi_xml_line(node), "%s has no coordinate", whose);
        return;
    }
    out->coordinate[0] = mhi_osim_coordinate(o, coordinate, mhi_xml_line(node), whose);
    if (!mhi_xml_range(o, node, "range", range)) {
        mhi_build_warn(&o->b, mhi_xml_line(node),
                       "%s has no range: as in OpenSim it is there at 0 alone", whose);
    }
    if (range[0] > range[1]) {
        mhi_build_fail(&o->b, mhi_xml_line(node), "%s: its range ends (%g) before it begins (%g)",
                       whose, range[1], range[0]);
    }
    if (out->coordinate[0] >= 0) {
        const mhi_coordinate_draft *c = o->b.coordinates.items[out->coordinate[0]];
        mhi_build_warn_degrees(&o->b, mhi_xml_line(node), whose, &c->coordinate, range);
    }
    out->lower = range[0] - RANGE_MARGIN;
    out->upper = range[1] + RANGE_MARGIN;
}

/* Location along one axis of the point's frame. */
static void read_moving_axis(mhi_osim *o, xmlNode *node, const char *whose, int axis,
                             mhe_path_point *out) {
    static const char *const coordinates[] = {"x_coordinate", "y_coordinate", "z_coordinate"};
    static const char *const locations[] = {"x_location", "y_location", "z_location"};
    static const char *const old[] = {"XAttachment", "YAttachment", "ZAttachment"};
    const char *coordinate = coordinate_of(o, node, coordinates[axis]);
    mhe_function f = {0};
    int32_t found = mhi_osim_function_of(o, node, locations[axis], whose, &f);
    if (found == 0) {
        found = mhi_osim_function_of(o, node, old[axis], whose, &f);
    }
    if (found == 0) {
        mhi_build_warn(&o->b, mhi_xml_line(node), "%s has no %s: as in OpenSim it stays at 0 there",
                       whose, locations[axis]);
    }
    if (found != 1) {
        return;
    }
    if (coordinate == NULL || mhi_function_is_constant(&f)) {
        out->location[axis] = mhi_function_value(&f, 0);
        return;
    }
    out->function[axis] = f;
    out->coordinate[axis] = mhi_osim_coordinate(o, coordinate, mhi_xml_line(node), whose);
}

/* A moving point in an offset frame: its location is brought to the body by hand. */
static void read_moving(mhi_osim *o, xmlNode *node, const char *whose, mhi_point_draft *draft) {
    const mhi_transform none = mhi_transform_identity();
    const char *socket = mhi_osim_socket(o, node, "parent_frame");
    mhi_transform in_body;
    draft->point.kind = MHE_POINT_MOVING;
    if (socket == NULL) {
        socket = mhi_xml_word(o, node, "body");
    }
    if (!mhi_osim_resolve(o, socket, "", draft->line, &draft->body, &in_body)) {
        return;
    }
    memset(draft->point.location, 0, sizeof draft->point.location);
    for (int axis = 0; axis < 3; axis++) {
        read_moving_axis(o, node, whose, axis, &draft->point);
    }
    if (memcmp(&in_body, &none, sizeof none) != 0) {
        mhi_build_unsupported(&o->b, draft->line,
                              "%s moves in an offset frame: it is taken as if in the body's",
                              whose);
    }
}

static void read_point(mhi_osim *o, xmlNode *node, mhi_path_draft *path) {
    const char *whose =
        mhi_arena_format(&o->b.arena, "%s '%s' of %s '%s'", (const char *)node->name,
                         mhi_xml_name(o, node), path->what, path->name);
    int32_t conditional =
        mhi_xml_is(node, "ConditionalPathPoint") || mhi_xml_is(node, "MuscleViaPoint");
    int32_t moving = mhi_xml_is(node, "MovingPathPoint") || mhi_xml_is(node, "MovingMusclePoint");
    if (!conditional && !moving && !mhi_xml_is(node, "PathPoint") &&
        !mhi_xml_is(node, "MusclePoint")) {
        mhi_build_unsupported(&o->b, mhi_xml_line(node), "%s: the path goes without it", whose);
        return;
    }
    mhi_point_draft *draft = mhi_build_push(&o->b, &path->points, sizeof *draft);
    if (draft == NULL || whose == NULL) {
        return;
    }
    draft->line = mhi_xml_line(node);
    draft->point = (mhe_path_point){.coordinate = {-1, -1, -1}};
    if (moving) {
        read_moving(o, node, whose, draft);
        return;
    }
    if (mhi_osim_location(o, node, &draft->body, draft->point.location) && conditional) {
        read_conditional(o, node, whose, &draft->point);
    }
}

static void read_wrap(mhi_osim *o, xmlNode *node, mhi_path_draft *path) {
    static const char *const methods[] = {"hybrid", "midpoint", "axial"};
    const char *object = mhi_xml_word(o, node, "wrap_object");
    const char *method = mhi_xml_word(o, node, "method");
    double range[2] = {-1, -1};
    if (object == NULL) {
        mhi_build_fail(&o->b, mhi_xml_line(node), "a PathWrap of %s '%s' names no wrap object",
                       path->what, path->name);
        return;
    }
    mhi_wrap_draft *draft = mhi_build_push(&o->b, &path->wraps, sizeof *draft);
    if (draft == NULL) {
        return;
    }
    draft->obstacle = object;
    draft->line = mhi_xml_line(node);
    int32_t known = method == NULL || mhi_same_word(method, "unassigned");
    for (int32_t i = 0; method != NULL && i < 3; i++) {
        if (mhi_same_word(method, methods[i])) {
            draft->wrap.method = i;
            known = 1;
        }
    }
    if (!known) {
        mhi_build_warn(&o->b, draft->line,
                       "the method of a wrap of %s '%s' is '%s', not hybrid, midpoint or axial: it "
                       "makes no difference here",
                       path->what, path->name, method);
    }
    (void)mhi_xml_numbers(o, node, "range", range, 2); /* points counted from 1; -1: no end */
    if (range[0] != floor(range[0]) || range[1] != floor(range[1])) {
        mhi_build_fail(&o->b, draft->line,
                       "the range of a wrap of %s '%s' is %g %g; it takes numbers of points",
                       path->what, path->name, range[0], range[1]);
    }
    draft->wrap.first = range[0] >= 1 && range[0] < INT32_MAX ? (int32_t)range[0] - 1 : -1;
    draft->wrap.last = range[1] >= 1 && range[1] < INT32_MAX ? (int32_t)range[1] - 1 : -1;
}

static void read_geometry(mhi_osim *o, xmlNode *geometry, mhi_path_draft *out) {
    static const char *const points[] = {"PathPointSet", "MusclePointSet"};
    static const char *const wraps[] = {"PathWrapSet", "MuscleWrapSet"};
    for (int i = 0; i < 2; i++) {
        for (xmlNode *n = mhi_xml_objects(geometry, points[i]); n != NULL; n = mhi_xml_next(n)) {
            read_point(o, n, out);
        }
        for (xmlNode *n = mhi_xml_objects(geometry, wraps[i]); n != NULL; n = mhi_xml_next(n)) {
            if (mhi_xml_is(n, "PathWrap") || mhi_xml_is(n, "MuscleWrap")) {
                read_wrap(o, n, out);
            }
        }
    }
}

/* ---- paths by a polynomial ---- */

/* Exponents of all terms up to `order` of n variables, the first variable slowest, each from 0 up
 * (the order of OpenSim's coefficients). Writes what fits into `out` [room x n]; their number. */
static int32_t list_exponents(int32_t n, int32_t order, uint8_t *out, int32_t room) {
    int32_t power[16] = {0}, sum = 0, count = 0, at = n - 1;
    while (at >= 0) {
        if (count < room) {
            for (int32_t k = 0; k < n; k++) {
                out[count * n + k] = (uint8_t)power[k];
            }
        }
        count++;
        for (at = n - 1; at >= 0; at--) {
            if (sum < order) {
                power[at]++;
                sum++;
                break;
            }
            sum -= power[at];
            power[at] = 0;
        }
    }
    return count;
}

/* Names of the coordinates, as numbers; their count, 0 after an error. */
static int32_t path_coordinates(mhi_osim *o, xmlNode *node, const char *whose, int32_t *out,
                                int32_t room) {
    const char *text = mhi_xml_text(o, mhi_xml_child(node, "coordinate_paths"));
    int32_t n = 0;
    while (*text != '\0') {
        size_t length = strcspn(text, " \t\r\n");
        if (length > 0) {
            const char *name = mhi_arena_text_n(&o->b.arena, text, length);
            if (n == room || name == NULL) {
                mhi_build_fail(&o->b, mhi_xml_line(node), "%s takes more than %d coordinates",
                               whose, (int)room);
                return 0;
            }
            out[n++] = mhi_osim_coordinate(o, name, mhi_xml_line(node), whose);
        }
        text += length + (text[length] != '\0');
    }
    return n;
}

static void read_polynomial(mhi_osim *o, xmlNode *function, const char *whose,
                            const int32_t *coordinate, int32_t n, mhi_path_draft *out) {
    double order = -1, dimension = -1;
    int32_t n_coef = 0, line = mhi_xml_line(function);
    const double *coef =
        mhi_xml_all_numbers(o, mhi_xml_property(function, "coefficients"), &n_coef);
    (void)mhi_xml_numbers(o, function, "order", &order, 1);
    (void)mhi_xml_numbers(o, function, "dimension", &dimension, 1);
    uint8_t *exponent = mhi_build_take(&o->b, n_coef * n, 1);
    int32_t *numbers = mhi_build_take(&o->b, n, sizeof *numbers);
    double *centre = mhi_build_take(&o->b, n, sizeof *centre);
    double *scale = mhi_build_take(&o->b, n, sizeof *scale);
    out->length = mhi_build_take(&o->b, 1, sizeof *out->length);
    if (o->b.status != MHE_OK || coef == NULL) {
        return;
    }
    if (dimension != n || !(order >= 0 && order <= 20) ||
        list_exponents(n, (int32_t)order, exponent, n_coef) != n_coef) {
        mhi_build_fail(&o->b, line,
                       "the polynomial of %s: %d coefficients do not fit dimension %g, order %g "
                       "and %d coordinates",
                       whose, (int)n_coef, dimension, order, (int)n);
        return;
    }
    memcpy(numbers, coordinate, sizeof *numbers * (size_t)n);
    for (int32_t k = 0; k < n; k++) {
        scale[k] = 1;
    }
    *out->length = (mhe_polynomial){.n = n,
                                    .coordinate = numbers,
                                    .centre = centre,
                                    .scale = scale,
                                    .n_terms = n_coef,
                                    .coef = coef,
                                    .exponent = exponent};
}

/* A polynomial of one variable, as any function of a file that is one. */
static void read_single(mhi_osim *o, xmlNode *node, const char *whose, int32_t coordinate,
                        mhi_path_draft *out) {
    mhe_function f = {0};
    if (mhi_osim_function_of(o, node, "length_function", whose, &f) != 1) {
        return;
    }
    if (f.n_pieces != 1) {
        mhi_build_unsupported(&o->b, mhi_xml_line(node),
                              "%s: its length is no single polynomial; the path is left out",
                              whose);
        return;
    }
    uint8_t *exponent = mhi_build_take(&o->b, f.n_coef, 1);
    int32_t *number = mhi_build_take(&o->b, 1, sizeof *number);
    double *scale = mhi_build_take(&o->b, 1, sizeof *scale);
    mhe_polynomial *length = mhi_build_take(&o->b, 1, sizeof *length);
    if (o->b.status != MHE_OK) {
        return;
    }
    for (int32_t i = 0; i < f.n_coef; i++) {
        exponent[i] = (uint8_t)i;
    }
    *number = coordinate;
    *scale = 1;
    *length = (mhe_polynomial){.n = 1,
                               .coordinate = number,
                               .centre = f.origin,
                               .scale = scale,
                               .n_terms = f.n_coef,
                               .coef = f.coef,
                               .exponent = exponent};
    out->length = length;
}

/* OpenSim's moment arm and speed functions of such a path are not read: -dL/dq is its moment arm.
 */
static void read_function_path(mhi_osim *o, xmlNode *node, mhi_path_draft *out) {
    const char *whose = mhi_arena_format(&o->b.arena, "the path of %s '%s'", out->what, out->name);
    int32_t coordinate[16];
    int32_t n = path_coordinates(o, node, whose != NULL ? whose : "", coordinate, 16);
    xmlNode *function = mhi_xml_child(node, "length_function");
    function = function != NULL ? mhi_xml_first(function)
                                : mhi_xml_child(node, "MultivariatePolynomialFunction");
    if (n == 0 || o->b.status != MHE_OK || whose == NULL) {
        mhi_build_fail(&o->b, mhi_xml_line(node), "%s names no coordinates", out->name);
    } else if (function != NULL && mhi_xml_is(function, "MultivariatePolynomialFunction")) {
        read_polynomial(o, function, whose, coordinate, n, out);
    } else if (n == 1) {
        read_single(o, node, whose, coordinate[0], out);
    } else {
        mhi_build_unsupported(&o->b, mhi_xml_line(node),
                              "%s: its length is no polynomial; it is left out", whose);
    }
}

/* The path: a GeometryPath or FunctionBasedPath, bare or in an element <path>. */
static xmlNode *path_element(xmlNode *object) {
    static const char *const kinds[] = {"GeometryPath", "FunctionBasedPath",
                                        "Scholz2015GeometryPath"};
    xmlNode *wrapper = mhi_xml_child(object, "path");
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        xmlNode *node = mhi_xml_child(object, kinds[i]);
        node = node != NULL ? node : mhi_xml_child(wrapper, kinds[i]);
        if (node != NULL) {
            return node;
        }
    }
    /* before 2.3 the points stood in the muscle itself */
    return mhi_xml_child(object, "MusclePointSet") != NULL ? object : NULL;
}

int32_t mhi_osim_path(mhi_osim *o, xmlNode *object, const char *what, mhi_path_draft *out) {
    xmlNode *node = path_element(object);
    int32_t unsupported = o->b.unsupported.n;
    *out = (mhi_path_draft){
        .what = what, .name = mhi_xml_name(o, object), .line = mhi_xml_line(object)};
    if (node == NULL) {
        mhi_build_fail(&o->b, out->line, "%s '%s' has no GeometryPath", what, out->name);
        return 0;
    }
    if (mhi_xml_is(node, "FunctionBasedPath")) {
        read_function_path(o, node, out);
        return out->length != NULL && o->b.status == MHE_OK;
    }
    if (mhi_xml_is(node, "Scholz2015GeometryPath")) {
        mhi_build_unsupported(&o->b, mhi_xml_line(node), "%s of %s '%s': it is left out",
                              (const char *)node->name, what, out->name);
        return 0;
    }
    read_geometry(o, node, out);
    if (o->b.unsupported.n > unsupported && out->points.n < 2) {
        mhi_build_warn(&o->b, out->line,
                       "%s '%s' skipped: without its unsupported points no path is left", what,
                       out->name);
        return 0;
    }
    return o->b.status == MHE_OK;
}

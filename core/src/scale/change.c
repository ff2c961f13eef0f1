/* SPDX-License-Identifier: Apache-2.0 */
/* change.c: what scaling a body does to the elements of a model file, in OpenSim's conventions. */
#include "scale/scale_private.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

void mhi_scale_write(xmlNode *node, const double *values, int32_t n) {
    char text[400] = "";
    size_t length = 0;
    for (int32_t i = 0; i < n && length < sizeof text; i++) {
        length += (size_t)snprintf(text + length, sizeof text - length, i > 0 ? " %.17g" : "%.17g",
                                   values[i]);
    }
    xmlNodeSetContent(node, (const xmlChar *)text);
}

static const double unscaled[3] = {1, 1, 1};

static const double *factors_of(const mhi_scaled *m, const char *body) {
    const int32_t i = body == NULL ? -1 : mhi_scale_body(m, body);
    return i < 0 ? unscaled : m->factors + 3 * i;
}

/* The body around an element. */
static const char *around(mhi_scaled *m, const xmlNode *node) {
    while (node != NULL && node->type == XML_ELEMENT_NODE && !mhi_xml_is(node, "Body")) {
        node = node->parent;
    }
    return node == NULL || node->type != XML_ELEMENT_NODE ? NULL : mhi_xml_name(&m->file.o, node);
}

/* What owns the element, for sockets that begin there: "/jointset/hip_r". */
static const char *owner_of(mhi_scaled *m, const xmlNode *node) {
    static const char *const sets[][2] = {{"JointSet", "/jointset"},
                                          {"ConstraintSet", "/constraintset"},
                                          {"ForceSet", "/forceset"},
                                          {"MarkerSet", "/markerset"},
                                          {"BodySet", "/bodyset"}};
    for (; node != NULL && node->parent != NULL && node->parent->parent != NULL;
         node = node->parent) {
        for (size_t i = 0; i < sizeof sets / sizeof sets[0]; i++) {
            if (node->parent->parent->type == XML_ELEMENT_NODE &&
                mhi_xml_is(node->parent->parent, sets[i][0])) {
                return mhi_arena_format(&m->arena, "%s/%s", sets[i][1],
                                        mhi_xml_name(&m->file.o, node));
            }
        }
    }
    return "";
}

/* The body that a socket, or before 4.0 a name, means; NULL: ground, or around the element. */
static const char *body_of(mhi_scaled *m, xmlNode *node, const char *socket, const char *before) {
    const char *path = mhi_osim_socket(&m->file.o, node, socket), *body = NULL;
    mhi_transform unused;
    if (path == NULL) {
        const char *name = mhi_xml_word(&m->file.o, node, before);
        return name != NULL ? name : around(m, node);
    }
    return mhi_osim_resolve(&m->file.o, path, owner_of(m, node), mhi_xml_line(node), &body, &unused)
               ? body
               : NULL;
}

static void stretch(mhi_scaled *m, xmlNode *node, const char *key, const double by[3]) {
    double at[3];
    xmlNode *element = mhi_xml_child(node, key);
    if (element != NULL && mhi_xml_numbers(&m->file.o, node, key, at, 3)) {
        for (int32_t i = 0; i < 3; i++) {
            at[i] *= by[i];
        }
        mhi_scale_write(element, at, 3);
    }
}

/* ---- bodies ---- */

/* The body's moments of a mass that is stretched and then `ratio` times as heavy: the matrix of
 * second moments of its density is stretched on both sides. */
static void stretch_inertia(double inertia[6], const double by[3], double ratio) {
    const double trace = 0.5 * (inertia[0] + inertia[1] + inertia[2]);
    double second[3];
    for (int32_t i = 0; i < 3; i++) {
        second[i] = (trace - inertia[i]) * by[i] * by[i];
    }
    const double sum = second[0] + second[1] + second[2];
    for (int32_t i = 0; i < 3; i++) {
        inertia[i] = ratio * (sum - second[i]);
    }
    inertia[3] *= ratio * by[0] * by[1];
    inertia[4] *= ratio * by[0] * by[2];
    inertia[5] *= ratio * by[1] * by[2];
}

static void change_inertia(mhi_scaled *m, xmlNode *body, const double by[3], double ratio) {
    static const char *const keys[] = {"inertia_xx", "inertia_yy", "inertia_zz",
                                       "inertia_xy", "inertia_xz", "inertia_yz"};
    double inertia[6] = {0};
    xmlNode *whole = mhi_xml_child(body, "inertia");
    if (whole != NULL) {
        (void)mhi_xml_numbers(&m->file.o, body, "inertia", inertia, 6);
    }
    for (int32_t i = 0; i < 6 && whole == NULL; i++) {
        (void)mhi_xml_numbers(&m->file.o, body, keys[i], &inertia[i], 1);
    }
    stretch_inertia(inertia, by, ratio);
    if (whole != NULL) {
        mhi_scale_write(whole, inertia, 6);
    }
    for (int32_t i = 0; i < 6 && whole == NULL; i++) {
        xmlNode *part = mhi_xml_child(body, keys[i]);
        if (part != NULL) {
            mhi_scale_write(part, &inertia[i], 1);
        }
    }
}

static double mass_of(mhi_scaled *m, xmlNode *body) {
    double mass = 0;
    (void)mhi_xml_numbers(&m->file.o, body, "mass", &mass, 1);
    return mass;
}

static double volume(const double by[3]) {
    return by[0] * by[1] * by[2];
}

/* Masses keep their shares, or follow the volumes; then all are the person's together. */
static void change_masses(mhi_scaled *m) {
    xmlNode *const first = mhi_xml_objects(m->file.o.model, "BodySet");
    double together = 0;
    for (xmlNode *n = first; n != NULL; n = mhi_xml_next(n)) {
        const double *by = factors_of(m, mhi_xml_name(&m->file.o, n));
        const double mass = mass_of(m, n);
        m->mass_before += mass;
        together += m->setup->preserve ? mass : mass * volume(by);
    }
    const double wanted = m->setup->mass > 0 ? m->setup->mass : together;
    m->mass_after = together > 0 ? wanted : 0;
    for (xmlNode *n = first; n != NULL && together > 0; n = mhi_xml_next(n)) {
        const double *by = factors_of(m, mhi_xml_name(&m->file.o, n));
        const double ratio = wanted / together * (m->setup->preserve ? 1 : volume(by));
        const double mass = ratio * mass_of(m, n);
        if (mhi_xml_child(n, "mass") != NULL) {
            mhi_scale_write(mhi_xml_child(n, "mass"), &mass, 1);
        }
        stretch(m, n, "mass_center", by);
        change_inertia(m, n, by, ratio);
    }
}

/* ---- geometry ---- */

/* Translations of a joint are lengths in its parent; a sliding coordinate itself is not one of
 * them. */
static void change_translations(mhi_scaled *m, xmlNode *joint, const char *parent) {
    xmlNode *transform = mhi_xml_child(joint, "SpatialTransform");
    xmlNode *holder = mhi_xml_child(transform, "objects");
    const double *by = factors_of(m, parent);
    int32_t number = 0;
    for (xmlNode *axis = mhi_xml_first(holder != NULL ? holder : transform); axis != NULL;
         axis = mhi_xml_next(axis)) {
        double direction[3] = {0}, line[2] = {0};
        xmlNode *function;
        if (!mhi_xml_is(axis, "TransformAxis") || number++ < 3 ||
            (function = mhi_scale_find_function(&m->file, axis)) == NULL ||
            !mhi_xml_numbers(&m->file.o, axis, "axis", direction, 3)) {
            continue;
        }
        if (mhi_xml_is(function, "LinearFunction") &&
            mhi_xml_numbers(&m->file.o, function, "coefficients", line, 2) && line[0] == 1 &&
            line[1] == 0) {
            continue;
        }
        double squares = 0, stretched = 0;
        for (int32_t i = 0; i < 3; i++) {
            squares += direction[i] * direction[i];
            stretched += direction[i] * direction[i] * by[i] * by[i];
        }
        m->arena.failed |=
            squares > 0 && !mhi_scale_function(&m->file, function, sqrt(stretched / squares));
    }
}

static int32_t is_joint(const xmlNode *node) {
    const size_t length = strlen((const char *)node->name);
    return length > 5 && strcmp((const char *)node->name + length - 5, "Joint") == 0;
}

static void change_joint(mhi_scaled *m, xmlNode *joint) {
    const char *parent = mhi_xml_word(&m->file.o, joint, "parent_body");
    if (parent == NULL) { /* 4.0 and later */
        parent = body_of(m, joint, "parent_frame", "parent_body");
    } else {
        stretch(m, joint, "location_in_parent", factors_of(m, parent));
        stretch(m, joint, "location", factors_of(m, around(m, joint)));
    }
    change_translations(m, joint, parent);
}

static void change_moving_point(mhi_scaled *m, xmlNode *point) {
    static const char *const keys[] = {"x_location", "y_location", "z_location"};
    const double *by = factors_of(m, body_of(m, point, "parent_frame", "body"));
    for (int32_t i = 0; i < 3; i++) {
        xmlNode *function = mhi_scale_find_function(&m->file, mhi_xml_child(point, keys[i]));
        if (function != NULL && !mhi_scale_function(&m->file, function, by[i])) {
            m->arena.failed = 1;
        }
    }
}

/* How much the axes of a wrap object's own frame are stretched, which may be turned. */
static void own_factors(mhi_scaled *m, xmlNode *object, const double by[3], double own[3]) {
    double angles[3] = {0}, r[9];
    (void)mhi_xml_numbers(&m->file.o, object, "xyz_body_rotation", angles, 3);
    mhi_rotation_sequence("xyz", angles, r);
    for (int32_t axis = 0; axis < 3; axis++) {
        double squares = 0;
        for (int32_t i = 0; i < 3; i++) {
            const double entry = by[i] * r[3 * i + axis];
            squares += entry * entry;
        }
        own[axis] = sqrt(squares);
    }
}

static void multiply(mhi_scaled *m, xmlNode *object, const char *key, double factor) {
    double value = 0;
    xmlNode *node = mhi_xml_child(object, key);
    if (node != NULL && mhi_xml_numbers(&m->file.o, object, key, &value, 1)) {
        value *= factor;
        mhi_scale_write(node, &value, 1);
    }
}

static void change_wrap(mhi_scaled *m, xmlNode *object) {
    double own[3];
    const double *by = factors_of(m, body_of(m, object, "frame", "body"));
    own_factors(m, object, by, own);
    stretch(m, object, "translation", by);
    if (mhi_xml_is(object, "WrapSphere")) {
        multiply(m, object, "radius", (own[0] + own[1] + own[2]) / 3);
    } else if (mhi_xml_is(object, "WrapCylinder")) {
        multiply(m, object, "radius", (own[0] + own[1]) / 2);
        multiply(m, object, "length", own[2]);
    } else if (mhi_xml_is(object, "WrapEllipsoid")) {
        stretch(m, object, "dimensions", own);
    } else {
        multiply(m, object, "inner_radius", (own[0] + own[1]) / 2);
        multiply(m, object, "outer_radius", (own[0] + own[1]) / 2);
    }
}

/* Before 4.0 constraints and bushings hold places in two bodies. */
static void change_two_bodies(mhi_scaled *m, xmlNode *node) {
    for (int32_t i = 1; i <= 2; i++) {
        char body[16], location[32];
        (void)snprintf(body, sizeof body, "body_%d", (int)i);
        (void)snprintf(location, sizeof location, "location_body_%d", (int)i);
        stretch(m, node, location, factors_of(m, mhi_xml_word(&m->file.o, node, body)));
    }
}

static void change_element(mhi_scaled *m, xmlNode *node) {
    static const char *const points[] = {"PathPoint", "ConditionalPathPoint", "Marker"};
    static const char *const wraps[] = {"WrapSphere", "WrapCylinder", "WrapEllipsoid", "WrapTorus"};
    if (mhi_xml_one_of(node, points, sizeof points / sizeof *points)) {
        stretch(m, node, "location", factors_of(m, body_of(m, node, "parent_frame", "body")));
    } else if (mhi_xml_is(node, "MovingPathPoint")) {
        change_moving_point(m, node);
    } else if (mhi_xml_one_of(node, wraps, sizeof wraps / sizeof *wraps)) {
        change_wrap(m, node);
    } else if (mhi_xml_is(node, "PhysicalOffsetFrame")) {
        stretch(m, node, "translation", factors_of(m, body_of(m, node, "parent", "body")));
    } else if (is_joint(node)) {
        change_joint(m, node);
    } else if (mhi_xml_child(node, "location_body_1") != NULL) {
        change_two_bodies(m, node);
    }
    const int32_t is_picture = mhi_xml_child(node, "scale_factors") != NULL &&
                               !mhi_xml_is(node, "FrameGeometry"); /* axes stay as they are */
    if (is_picture && around(m, node) != NULL) {
        stretch(m, node, "scale_factors", factors_of(m, around(m, node)));
    }
}

/* Functions that are put around others are not gone into. */
static void change_below(mhi_scaled *m, xmlNode *node) {
    for (xmlNode *n = mhi_xml_first(node); n != NULL; n = mhi_xml_next(n)) {
        if (!mhi_xml_is(n, "defaults") && !mhi_xml_is(n, "SpatialTransform")) {
            change_element(m, n);
            change_below(m, n);
        }
    }
}

mhe_status mhi_scale_change(mhi_scaled *m, mhe_error *err) {
    change_below(m, m->file.o.model);
    change_masses(m);
    if (m->setup->name != NULL && *m->setup->name != '\0') {
        (void)xmlSetProp(m->file.o.model, (const xmlChar *)"name", (const xmlChar *)m->setup->name);
    }
    return m->arena.failed                ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
           : m->file.o.b.status != MHE_OK ? m->file.o.b.status
                                          : MHE_OK;
}

/* Lengths of a muscle, ligament or spring by that of its path. */
static void change_lengths(mhi_scaled *m, xmlNode *node, const char *name, double factor) {
    static const char *const keys[] = {"optimal_fiber_length", "tendon_slack_length",
                                       "resting_length"};
    for (xmlNode *n = mhi_xml_first(node); n != NULL; n = mhi_xml_next(n)) {
        const int32_t has_path = mhi_xml_child(n, "GeometryPath") != NULL;
        if (has_path && strcmp(mhi_xml_name(&m->file.o, n), name) == 0) {
            for (size_t i = 0; i < sizeof keys / sizeof *keys; i++) {
                multiply(m, n, keys[i], factor);
            }
        } else if (!has_path) {
            change_lengths(m, n, name, factor);
        }
    }
}

mhe_status mhi_scale_muscles(mhi_scaled *m, const mhe_description *d, const double *before,
                             const double *after, mhe_error *err) {
    for (int32_t i = 0; i < d->n_paths; i++) {
        if (!(before[i] > 0) || !(after[i] > 0)) {
            return mhe_fail(err, MHE_E_INPUT, "%s: the path of '%s' has no length", m->file.path,
                            d->paths[i].name);
        }
        change_lengths(m, m->file.o.model, d->paths[i].name, after[i] / before[i]);
    }
    return MHE_OK;
}

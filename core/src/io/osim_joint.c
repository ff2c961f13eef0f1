/* SPDX-License-Identifier: Apache-2.0 */
/* osim_joint.c: bodies, joints and coordinates of a .osim file. */
#include "io/osim.h"

#include <string.h>

/* Coordinates of a joint: numbers [first, first + n) of the builder's. */
typedef struct joint {
    xmlNode *node;
    const char *name;
    mhi_body_draft *body;
    int32_t first, n;
} joint;

static void read_inertia(mhi_osim *o, xmlNode *node, double inertia[9]) {
    static const char *const tags[] = {"inertia_xx", "inertia_yy", "inertia_zz",
                                       "inertia_xy", "inertia_xz", "inertia_yz"};
    static const int at[] = {0, 4, 8, 1, 2, 5};
    double six[6] = {0};
    if (!mhi_xml_numbers(o, node, "inertia", six, 6)) { /* before 4.0 */
        for (int i = 0; i < 6; i++) {
            (void)mhi_xml_numbers(o, node, tags[i], &six[i], 1);
        }
    }
    for (int i = 0; i < 6; i++) {
        inertia[at[i]] = six[i];
    }
    inertia[3] = inertia[1];
    inertia[6] = inertia[2];
    inertia[7] = inertia[5];
}

static void read_coordinate(mhi_osim *o, xmlNode *node) {
    double range[2];
    const char *name = mhi_xml_name(o, node);
    mhi_coordinate_draft *draft = mhi_build_coordinate(&o->b, name, mhi_xml_line(node));
    if (draft == NULL) {
        return;
    }
    (void)mhi_xml_numbers(o, node, "default_value", &draft->coordinate.value, 1);
    (void)mhi_xml_numbers(o, node, "default_speed_value", &draft->coordinate.speed, 1);
    if (mhi_xml_numbers(o, node, "range", range, 2)) {
        draft->coordinate.lower = range[0];
        draft->coordinate.upper = range[1];
    }
    draft->locked = mhi_xml_flag(o, node, "locked");
    if (mhi_xml_flag(o, node, "prescribed")) {
        mhi_build_unsupported(&o->b, draft->line, "prescribed motion of coordinate '%s'", name);
    }
}

static void read_coordinates(mhi_osim *o, joint *j) {
    j->first = o->b.coordinates.n;
    xmlNode *node = mhi_xml_first(mhi_xml_child(j->node, "coordinates"));
    if (node == NULL) {
        node = mhi_xml_objects(o, j->node, "CoordinateSet");
    }
    for (; node != NULL; node = mhi_xml_next(node)) {
        if (mhi_xml_is(node, "Coordinate")) {
            read_coordinate(o, node);
        }
    }
    j->n = o->b.coordinates.n - j->first;
}

/* Joints of a fixed kind: motions in order, each "R" or "T", its axis and its coordinate. The
 * translations of a PlanarJoint and FreeJoint are along axes of the parent, so they come first. */
static const struct {
    const char *type, *motions;
} plain_joints[] = {{"WeldJoint", ""},
                    {"PinJoint", "Rz0"},
                    {"SliderJoint", "Tx0"},
                    {"UniversalJoint", "Rx0Ry1"},
                    {"GimbalJoint", "Rx0Ry1Rz2"},
                    {"BallJoint", "Rx0Ry1Rz2"},
                    {"PlanarJoint", "Tx1Ty2Rz0"},
                    {"FreeJoint", "Tx3Ty4Tz5Rx0Ry1Rz2"}};

static void build_plain(mhi_osim *o, joint *j, const char *motions) {
    int32_t line = mhi_xml_line(j->node), n = (int32_t)strlen(motions) / 3;
    for (int32_t i = j->n; i < n; i++) { /* OpenSim's own names for those not listed */
        const char *name = mhi_arena_format(&o->b.arena, "%s_coord_%d", j->name, (int)i);
        (void)mhi_build_coordinate(&o->b, name != NULL ? name : "", line);
    }
    for (const char *m = motions; *m != '\0' && o->b.status == MHE_OK; m += 3) {
        int32_t at = j->first + (m[2] - '0');
        mhi_coordinate_draft *draft = o->b.coordinates.items[at];
        draft->coordinate.rotational = m[0] == 'R';
        const double axis[3] = {m[1] == 'x', m[1] == 'y', m[1] == 'z'};
        mhi_build_motion(&o->b, j->body, m[0] == 'R' ? MHE_MOTION_ROTATION : MHE_MOTION_TRANSLATION,
                         at, axis, mhi_function_identity(&o->b), line);
    }
}

/* The joint's coordinate `name`; -1 after an error. */
static int32_t joint_coordinate(mhi_osim *o, const joint *j, const char *name, int32_t line) {
    for (int32_t i = j->first; i < j->first + j->n; i++) {
        const mhi_coordinate_draft *draft = o->b.coordinates.items[i];
        if (strcmp(draft->coordinate.name, name) == 0) {
            return i;
        }
    }
    mhi_build_fail(&o->b, line, "joint '%s' has no coordinate '%s'", j->name, name);
    return -1;
}

static void build_axis(mhi_osim *o, joint *j, xmlNode *node, int32_t kind) {
    const char *name = mhi_xml_name(o, node);
    const char *coordinates = mhi_xml_text(o, mhi_xml_child(node, "coordinates"));
    int32_t line = mhi_xml_line(node), coordinate = -1;
    double axis[3] = {0};
    mhe_function function = {0};
    const char *whose = mhi_arena_format(&o->b.arena, "%s of joint '%s'", name, j->name);
    int32_t found = mhi_osim_function(o, node, whose != NULL ? whose : "", &function);
    if (coordinates[strcspn(coordinates, " \t\r\n")] != '\0') {
        mhi_build_unsupported(&o->b, line, "%s of joint '%s' depends on several coordinates (%s)",
                              name, j->name, coordinates);
        return;
    }
    if (*coordinates != '\0') {
        coordinate = joint_coordinate(o, j, coordinates, line);
    }
    if (found == 0 && coordinate >= 0) {
        function = mhi_function_identity(&o->b);
    } else if (found != 1) {
        return;
    }
    if (o->b.status != MHE_OK) {
        return;
    }
    if (coordinate >= 0 && kind == MHE_MOTION_ROTATION) {
        mhi_coordinate_draft *draft = o->b.coordinates.items[coordinate];
        draft->coordinate.rotational = 1;
    }
    (void)mhi_xml_numbers(o, node, "axis", axis, 3);
    mhi_build_motion(&o->b, j->body, kind, coordinate, axis, function, line);
}

/* Translations are along axes of the parent's joint frame, so they come before the rotations. */
static void build_custom(mhi_osim *o, joint *j) {
    static const char *const order[] = {"translation1", "translation2", "translation3",
                                        "rotation1",    "rotation2",    "rotation3"};
    xmlNode *transform = mhi_xml_child(j->node, "SpatialTransform");
    if (transform == NULL) {
        mhi_build_fail(&o->b, mhi_xml_line(j->node), "CustomJoint '%s' has no SpatialTransform",
                       j->name);
    }
    for (size_t i = 0; i < sizeof order / sizeof *order; i++) {
        for (xmlNode *n = mhi_xml_first(transform); n != NULL; n = mhi_xml_next(n)) {
            if (mhi_xml_is(n, "TransformAxis") && strcmp(mhi_xml_name(o, n), order[i]) == 0) {
                build_axis(o, j, n, i < 3 ? MHE_MOTION_TRANSLATION : MHE_MOTION_ROTATION);
            }
        }
    }
}

static void set_frames(mhi_osim *o, mhi_body_draft *draft, const char *parent,
                       const mhi_transform *in_parent, const mhi_transform *in_child) {
    mhi_transform body = mhi_transform_inverse(in_child);
    (void)o;
    draft->parent = parent;
    draft->carried = 1;
    memcpy(draft->body.joint_r, in_parent->r, sizeof in_parent->r);
    memcpy(draft->body.joint_p, in_parent->p, sizeof in_parent->p);
    memcpy(draft->body.body_r, body.r, sizeof body.r);
    memcpy(draft->body.body_p, body.p, sizeof body.p);
}

/* Before 4.0 the joint sits in its child body. */
static void frames_before_4(mhi_osim *o, xmlNode *node, mhi_body_draft *body) {
    mhi_transform in_parent = mhi_transform_identity(), in_child = in_parent;
    double parent_angles[3] = {0}, child_angles[3] = {0};
    (void)mhi_xml_numbers(o, node, "location_in_parent", in_parent.p, 3);
    (void)mhi_xml_numbers(o, node, "orientation_in_parent", parent_angles, 3);
    (void)mhi_xml_numbers(o, node, "location", in_child.p, 3);
    (void)mhi_xml_numbers(o, node, "orientation", child_angles, 3);
    mhi_rotation_sequence("xyz", parent_angles, in_parent.r);
    mhi_rotation_sequence("xyz", child_angles, in_child.r);
    set_frames(o, body, mhi_xml_word(o, node, "parent_body"), &in_parent, &in_child);
}

/* The body that a joint of 4.x carries; NULL after an error or for a joint that closes a loop. */
static mhi_body_draft *frames_since_4(mhi_osim *o, xmlNode *node, const char *name) {
    const char *owner = mhi_arena_format(&o->b.arena, "/jointset/%s", name);
    const char *parent, *child;
    mhi_transform in_parent, in_child;
    int32_t line = mhi_xml_line(node);
    owner = owner != NULL ? owner : "";
    if (!mhi_osim_resolve(o, mhi_osim_socket(o, node, "parent_frame"), owner, line, &parent,
                          &in_parent) ||
        !mhi_osim_resolve(o, mhi_osim_socket(o, node, "child_frame"), owner, line, &child,
                          &in_child)) {
        return NULL;
    }
    for (int32_t i = 0; child != NULL && i < o->b.bodies.n; i++) {
        mhi_body_draft *draft = o->b.bodies.items[i];
        if (strcmp(draft->body.name, child) != 0) {
            continue;
        }
        if (draft->carried) {
            mhi_build_unsupported(&o->b, line, "%s '%s' closes a loop at body '%s'",
                                  (const char *)node->name, name, child);
            return NULL;
        }
        set_frames(o, draft, parent, &in_parent, &in_child);
        return draft;
    }
    mhi_build_fail(&o->b, line, "joint '%s' has ground as its child", name);
    return NULL;
}

void mhi_osim_joint(mhi_osim *o, xmlNode *node, mhi_body_draft *body) {
    joint j = {.node = node, .name = mhi_xml_name(o, node), .body = body};
    if (body != NULL) {
        frames_before_4(o, node, body);
    } else {
        j.body = frames_since_4(o, node, j.name);
    }
    if (j.body == NULL) {
        return;
    }
    if (mhi_xml_flag(o, node, "reverse")) {
        mhi_build_unsupported(&o->b, mhi_xml_line(node), "reversed joint '%s'", j.name);
    }
    for (size_t i = 0; i < sizeof plain_joints / sizeof *plain_joints; i++) {
        if (mhi_xml_is(node, plain_joints[i].type)) {
            read_coordinates(o, &j);
            build_plain(o, &j, plain_joints[i].motions);
            return;
        }
    }
    if (mhi_xml_is(node, "CustomJoint")) {
        read_coordinates(o, &j);
        build_custom(o, &j);
    } else {
        mhi_build_unsupported(&o->b, mhi_xml_line(node), "%s '%s' (held rigid)",
                              (const char *)node->name, j.name);
    }
}

void mhi_osim_bodies(mhi_osim *o) {
    for (xmlNode *n = mhi_xml_objects(o, o->model, "BodySet"); n != NULL; n = mhi_xml_next(n)) {
        const char *name = mhi_xml_name(o, n);
        if (!mhi_xml_is(n, "Body") || mhi_same_word(name, "ground")) {
            continue;
        }
        mhi_body_draft *draft = mhi_build_body(&o->b, name, NULL, mhi_xml_line(n));
        if (draft == NULL) {
            return;
        }
        (void)mhi_xml_numbers(o, n, "mass", &draft->body.mass, 1);
        (void)mhi_xml_numbers(o, n, "mass_center", draft->body.com, 3);
        read_inertia(o, n, draft->body.inertia);
        xmlNode *node = mhi_xml_first(mhi_xml_child(n, "Joint"));
        if (node == NULL) {
            node = mhi_xml_first(mhi_xml_child(n, "joint"));
        }
        if (node != NULL) {
            mhi_osim_joint(o, node, draft);
        }
    }
}

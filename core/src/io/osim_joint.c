/* SPDX-License-Identifier: Apache-2.0 */
/* osim_joint.c: bodies and the joints that carry them. */
#include "base/text.h"
#include "io/osim.h"

#include <stdio.h>
#include <string.h>

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

/* What has no mass has no inertia either: OpenSim takes 0 there (Body::getInertia()). */
static void drop_inertia_without_mass(mhi_osim *o, mhi_body_draft *draft) {
    double most = 0;
    for (int i = 0; i < 9; i++) {
        most = fmax(most, fabs(draft->body.inertia[i]));
    }
    if (draft->body.mass == 0 && most > 0) {
        mhi_build_warn(&o->b, draft->line,
                       "body '%s' has no mass but an inertia: as in OpenSim it has none",
                       draft->body.name);
        memset(draft->body.inertia, 0, sizeof draft->body.inertia);
    }
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

static void build_plain(mhi_osim *o, mhi_osim_joint *j, const char *motions) {
    mhi_osim_coordinates(o, j, (int32_t)strlen(motions) / 3);
    for (const char *m = motions; *m != '\0' && o->b.status == MHE_OK; m += 3) {
        const double axis[3] = {m[1] == 'x', m[1] == 'y', m[1] == 'z'};
        mhi_osim_motion(o, j, m[0] == 'R' ? MHE_MOTION_ROTATION : MHE_MOTION_TRANSLATION,
                        m[2] - '0', axis);
    }
}

/* The joint's coordinate `name`; -1 after an error. */
static int32_t joint_coordinate(mhi_osim *o, const mhi_osim_joint *j, const char *name,
                                int32_t line) {
    const char **names = mhi_build_take(&o->b, j->n, sizeof *names);
    char hint[256] = "";
    for (int32_t i = 0; names != NULL && i < j->n; i++) {
        const mhi_coordinate_draft *draft = o->b.coordinates.items[j->first + i];
        names[i] = draft->in_joint != NULL ? draft->in_joint : draft->coordinate.name;
        if (strcmp(names[i], name) == 0) {
            return j->first + i;
        }
    }
    if (names != NULL && j->n > 0) {
        mhi_suggest(hint, sizeof hint, name, names, j->n);
    }
    mhi_build_fail(&o->b, line, "joint '%s' has no coordinate '%s'%s", j->name, name, hint);
    return -1;
}

static void build_axis(mhi_osim *o, mhi_osim_joint *j, xmlNode *node, int32_t kind) {
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
static void build_custom(mhi_osim *o, mhi_osim_joint *j) {
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

static void set_frames(mhi_body_draft *draft, const char *parent, const mhi_transform *in_parent,
                       const mhi_transform *in_child) {
    mhi_transform body = mhi_transform_inverse(in_child);
    draft->parent = parent;
    draft->carried = 1;
    memcpy(draft->body.joint_r, in_parent->r, sizeof in_parent->r);
    memcpy(draft->body.joint_p, in_parent->p, sizeof in_parent->p);
    memcpy(draft->body.body_r, body.r, sizeof body.r);
    memcpy(draft->body.body_p, body.p, sizeof body.p);
}

static void build_motions(mhi_osim *o, mhi_osim_joint *j) {
    j->body->joint = j->name;
    for (size_t i = 0; i < sizeof plain_joints / sizeof *plain_joints; i++) {
        if (mhi_xml_is(j->node, plain_joints[i].type)) {
            build_plain(o, j, plain_joints[i].motions);
            return;
        }
    }
    if (mhi_xml_is(j->node, "CustomJoint")) {
        mhi_osim_coordinates(o, j, 0);
        build_custom(o, j);
    } else if (mhi_xml_is(j->node, "EllipsoidJoint")) {
        mhi_osim_ellipsoid_joint(o, j);
    } else if (mhi_xml_is(j->node, "ScapulothoracicJoint")) {
        mhi_osim_scapulothoracic_joint(o, j);
    } else {
        mhi_osim_coordinates(o, j, 0);
        mhi_build_unsupported(&o->b, mhi_xml_line(j->node), "%s '%s': it is held rigid",
                              (const char *)j->node->name, j->name);
    }
}

/* The joint seen from its child, which then carries its parent: the inverse motions in the opposite
 * order. */
static void reverse_motions(mhi_osim *o, mhi_body_draft *body) {
    mhi_list *motions = &body->motions;
    for (int32_t i = 0, k = motions->n - 1; i < k; i++, k--) {
        void *swap = motions->items[i];
        motions->items[i] = motions->items[k];
        motions->items[k] = swap;
    }
    for (int32_t i = 0; i < motions->n; i++) {
        mhe_motion *motion = motions->items[i];
        motion->function = mhi_function_scaled(&o->b, -1, motion->function);
    }
}

/* Before 4.0 the joint sits in its child body. */
static void joint_before_4(mhi_osim *o, xmlNode *node, mhi_body_draft *body) {
    mhi_osim_joint j = {.node = node, .name = mhi_xml_name(o, node), .body = body};
    mhi_transform in_parent = mhi_transform_identity(), in_child = in_parent;
    double parent_angles[3] = {0}, child_angles[3] = {0};
    (void)mhi_xml_numbers(o, node, "location_in_parent", in_parent.p, 3);
    (void)mhi_xml_numbers(o, node, "orientation_in_parent", parent_angles, 3);
    (void)mhi_xml_numbers(o, node, "location", in_child.p, 3);
    (void)mhi_xml_numbers(o, node, "orientation", child_angles, 3);
    mhi_rotation_sequence("xyz", parent_angles, in_parent.r);
    mhi_rotation_sequence("xyz", child_angles, in_child.r);
    set_frames(body, mhi_xml_word(o, node, "parent_body"), &in_parent, &in_child);
    build_motions(o, &j);
    if (mhi_xml_flag(o, node, "reverse")) {
        reverse_motions(o, body);
    }
}

/* A joint of 4.x: the two bodies (NULL: ground) and its frames in them. */
typedef struct ends {
    mhi_osim_joint joint;
    const char *parent, *child;
    mhi_transform in_parent, in_child;
    int32_t built;
} ends;

static mhi_body_draft *body_named(mhi_osim *o, const char *name) {
    for (int32_t i = 0; name != NULL && i < o->b.bodies.n; i++) {
        mhi_body_draft *draft = o->b.bodies.items[i];
        if (strcmp(draft->body.name, name) == 0) {
            return draft;
        }
    }
    return NULL;
}

/* One end of a joint; between 3.3 and 4.0 its place in the body stands in the joint itself. */
static int32_t read_end(mhi_osim *o, xmlNode *node, const char *owner, const char *which,
                        const char **body, mhi_transform *in_body) {
    char name[64];
    double angles[3] = {0};
    mhi_transform offset = mhi_transform_identity(), place;
    (void)snprintf(name, sizeof name, "%s_frame", which);
    const char *socket = mhi_osim_socket(o, node, name);
    if (socket == NULL) {
        (void)snprintf(name, sizeof name, "%s_body", which);
        socket = mhi_osim_socket(o, node, name);
        (void)snprintf(name, sizeof name, "location_in_%s", which);
        (void)mhi_xml_numbers(o, node, name, offset.p, 3);
        (void)snprintf(name, sizeof name, "orientation_in_%s", which);
        (void)mhi_xml_numbers(o, node, name, angles, 3);
        mhi_rotation_sequence("xyz", angles, offset.r);
    }
    if (!mhi_osim_resolve(o, socket, owner, mhi_xml_line(node), body, &place)) {
        return 0;
    }
    *in_body = mhi_transform_times(&place, &offset);
    return 1;
}

static int32_t read_ends(mhi_osim *o, xmlNode *node, const char *set, ends *e) {
    const char *name = mhi_xml_name(o, node);
    const char *owner = mhi_arena_format(&o->b.arena, "%s/%s", set, name);
    *e = (ends){.joint = {.node = node, .name = name}};
    return owner != NULL && read_end(o, node, owner, "parent", &e->parent, &e->in_parent) &&
           read_end(o, node, owner, "child", &e->child, &e->in_child);
}

/* Joints whose child is carried already run the other way: their child carries their parent. What
 * is left then closes a loop. */
static void build_turned(mhi_osim *o, ends *e) {
    mhi_osim_joint *j = &e->joint;
    mhi_body_draft *parent = body_named(o, e->parent);
    if (parent == NULL || parent->carried) {
        mhi_osim_coordinates(o, j, 0);
        mhi_build_unsupported(
            &o->b, mhi_xml_line(j->node), "%s '%s' closes a loop at body '%s': it is left out",
            (const char *)j->node->name, j->name, e->child != NULL ? e->child : "ground");
        return;
    }
    j->body = parent;
    set_frames(parent, e->child, &e->in_child, &e->in_parent);
    build_motions(o, j);
    reverse_motions(o, parent);
}

/* A body that no joint carries floats freely, as OpenSim has it. */
static void build_free(mhi_osim *o, mhi_body_draft *draft) {
    xmlNode node = {.type = XML_ELEMENT_NODE,
                    .name = (const xmlChar *)"FreeJoint",
                    .line = (unsigned short)draft->line};
    const char *name = mhi_arena_format(&o->b.arena, "free_%s", draft->body.name);
    mhi_osim_joint j = {.node = &node, .name = name != NULL ? name : "", .body = draft};
    draft->carried = 1;
    mhi_build_warn(&o->b, draft->line, "body '%s' has no joint: it floats freely",
                   draft->body.name);
    build_motions(o, &j);
}

void mhi_osim_joints(mhi_osim *o) {
    mhi_list joints = {0};
    mhi_osim_walk walk = mhi_osim_begin(o, "JointSet");
    for (xmlNode *n = walk.node; n != NULL && o->b.status == MHE_OK; n = mhi_osim_next(&walk)) {
        if (!mhi_xml_ends(n, "Joint")) {
            continue;
        }
        ends *e = mhi_build_push(&o->b, &joints, sizeof *e);
        if (e == NULL || !read_ends(o, n, walk.owner, e)) {
            return;
        }
        e->joint.body = body_named(o, e->child);
        if (e->joint.body != NULL && !e->joint.body->carried) {
            set_frames(e->joint.body, e->parent, &e->in_parent, &e->in_child);
            e->built = 1;
        }
    }
    for (int32_t i = 0; i < joints.n && o->b.status == MHE_OK;
         i++) { /* coordinates in file order */
        ends *e = joints.items[i];
        if (e->built) {
            build_motions(o, &e->joint);
        } else {
            build_turned(o, e);
        }
    }
    for (int32_t i = 0; i < o->b.bodies.n && o->b.status == MHE_OK; i++) {
        mhi_body_draft *draft = o->b.bodies.items[i];
        if (!draft->carried) {
            build_free(o, draft);
        }
    }
}

static void read_body(mhi_osim *o, xmlNode *n) {
    const char *name = mhi_xml_name(o, n);
    mhi_body_draft *draft = mhi_build_body(&o->b, name, NULL, mhi_xml_line(n));
    if (draft == NULL) {
        return;
    }
    if (mhi_xml_word(o, n, "mass") == NULL) {
        mhi_build_warn(&o->b, mhi_xml_line(n), "body '%s' has no mass: as in OpenSim it is 0",
                       name);
    }
    (void)mhi_xml_numbers(o, n, "mass", &draft->body.mass, 1);
    (void)mhi_xml_numbers(o, n, "mass_center", draft->body.com, 3);
    read_inertia(o, n, draft->body.inertia);
    drop_inertia_without_mass(o, draft);
    xmlNode *node = mhi_xml_first(mhi_xml_child(n, "Joint"));
    if (node == NULL) {
        node = mhi_xml_first(mhi_xml_child(n, "joint"));
    }
    if (node != NULL) {
        joint_before_4(o, node, draft);
    }
}

void mhi_osim_bodies(mhi_osim *o) {
    mhi_osim_walk walk = mhi_osim_begin(o, "BodySet");
    for (xmlNode *n = walk.node; n != NULL; n = mhi_osim_next(&walk)) {
        if (mhi_xml_is(n, "Body") && !mhi_same_word(mhi_xml_name(o, n), "ground")) {
            read_body(o, n);
        }
    }
}

/* SPDX-License-Identifier: Apache-2.0 */
/* osim_wrap.c: wrap objects of bodies, ground and frames. */
#include "io/osim.h"

#include <string.h>

/* Side that a path must pass: axis and sign of its frame; anything else: any side. */
static void read_side(mhi_osim *o, xmlNode *node, mhe_obstacle *out) {
    const char *word = mhi_xml_word(o, node, "quadrant");
    out->side_axis = -1;
    if (word == NULL || mhi_same_word(word, "all") || mhi_same_word(word, "Unassigned")) {
        return;
    }
    const char *axis = word + (*word == '+' || *word == '-');
    for (int i = 0; i < 3; i++) {
        const char name[2] = {"xyz"[i], '\0'};
        if (mhi_same_word(axis, name)) {
            out->side_axis = i;
            out->side_sign = *word == '-' ? -1 : 1;
        }
    }
    if (out->side_axis < 0) {
        mhi_build_fail(&o->b, mhi_xml_line(node),
                       "the quadrant of '%s' is '%s'; it can be all, +x, -x, +y, -y, +z or -z",
                       out->name, word);
    }
}

static void read_sizes(mhi_osim *o, xmlNode *node, mhe_obstacle *out) {
    switch (out->kind) {
    case MHE_OBSTACLE_SPHERE:
        (void)mhi_xml_numbers(o, node, "radius", &out->size[0], 1);
        break;
    case MHE_OBSTACLE_CYLINDER:
        out->size[1] = 1; /* OpenSim's own where the file is silent */
        (void)mhi_xml_numbers(o, node, "radius", &out->size[0], 1);
        (void)mhi_xml_numbers(o, node, "length", &out->size[1], 1);
        break;
    case MHE_OBSTACLE_ELLIPSOID:
        (void)mhi_xml_numbers(o, node, "dimensions", out->size, 3);
        break;
    default:
        (void)mhi_xml_numbers(o, node, "inner_radius", &out->size[0], 1);
        (void)mhi_xml_numbers(o, node, "outer_radius", &out->size[1], 1);
        break;
    }
}

static void read_obstacle(mhi_osim *o, xmlNode *node, const char *body, const mhi_transform *at) {
    static const char *const types[] = {"WrapSphere", "WrapCylinder", "WrapEllipsoid", "WrapTorus"};
    mhi_transform frame = mhi_transform_identity();
    double angles[3] = {0};
    int32_t kind = 0;
    while (kind < 4 && !mhi_xml_is(node, types[kind])) {
        kind++;
    }
    mhi_obstacle_draft *draft = mhi_build_push(&o->b, &o->b.obstacles, sizeof *draft);
    if (draft == NULL) {
        return;
    }
    draft->body = body;
    draft->line = mhi_xml_line(node);
    draft->active = mhi_xml_stated_flag(o, node, "active") != 0;
    draft->obstacle.name = mhi_xml_name(o, node);
    if (kind == 4) { /* nothing is missing unless a path goes around it */
        draft->unknown = (const char *)mhi_arena_text(&o->b.arena, (const char *)node->name);
        draft->active = 0;
        return;
    }
    draft->obstacle.kind = kind;
    (void)mhi_xml_numbers(o, node, "xyz_body_rotation", angles, 3);
    (void)mhi_xml_numbers(o, node, "translation", frame.p, 3);
    mhi_rotation_sequence("xyz", angles, frame.r);
    frame = mhi_transform_times(at, &frame);
    memcpy(draft->obstacle.r, frame.r, sizeof frame.r);
    memcpy(draft->obstacle.p, frame.p, sizeof frame.p);
    read_sizes(o, node, &draft->obstacle);
    read_side(o, node, &draft->obstacle);
}

static void read_set(mhi_osim *o, xmlNode *holder, const char *body, const mhi_transform *at) {
    for (xmlNode *n = mhi_xml_objects(holder, "WrapObjectSet"); n != NULL; n = mhi_xml_next(n)) {
        read_obstacle(o, n, body, at);
    }
}

/* Wrap objects of frames among the children of `holder`, which live at `owner`. */
static void read_frames(mhi_osim *o, xmlNode *holder, const char *owner) {
    for (xmlNode *n = mhi_xml_first(holder); n != NULL; n = mhi_xml_next(n)) {
        const char *body;
        mhi_transform at;
        const char *path = NULL;
        if (mhi_xml_is(n, "PhysicalOffsetFrame") || mhi_xml_is(n, "StationDefinedFrame")) {
            path = mhi_arena_format(&o->b.arena, "%s/%s", owner, mhi_xml_name(o, n));
        }
        if (path == NULL) {
            continue;
        }
        read_frames(o, mhi_xml_child(n, "components"), path); /* frames of frames */
        if (mhi_xml_objects(n, "WrapObjectSet") != NULL) {
            if (mhi_osim_resolve(o, path, "", mhi_xml_line(n), &body, &at)) {
                read_set(o, n, body, &at);
            }
        }
    }
}

static const char *member_path(mhi_osim *o, const mhi_osim_walk *walk, const xmlNode *node) {
    const char *path = mhi_arena_format(&o->b.arena, "%s/%s", walk->owner, mhi_xml_name(o, node));
    return path != NULL ? path : "";
}

void mhi_osim_obstacles(mhi_osim *o) {
    const mhi_transform here = mhi_transform_identity();
    read_set(o, mhi_xml_child(o->model, "Ground"), NULL, &here);
    read_frames(o, mhi_xml_child(mhi_xml_child(o->model, "Ground"), "components"), "/ground");
    read_frames(o, mhi_xml_child(o->model, "components"), "");
    mhi_osim_walk walk = mhi_osim_begin(o, "BodySet");
    for (xmlNode *n = walk.node; n != NULL; n = mhi_osim_next(&walk)) {
        if (mhi_xml_is(n, "Body")) {
            read_set(o, n, mhi_xml_name(o, n), &here);
            read_frames(o, mhi_xml_child(n, "components"), member_path(o, &walk, n));
        }
    }
    walk = mhi_osim_begin(o, "JointSet");
    for (xmlNode *n = walk.node; n != NULL; n = mhi_osim_next(&walk)) {
        if (mhi_xml_ends(n, "Joint")) {
            read_frames(o, mhi_xml_child(n, "frames"), member_path(o, &walk, n));
        }
    }
}

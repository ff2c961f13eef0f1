/* SPDX-License-Identifier: Apache-2.0 */
/* osim_frame.c: sockets, offset frames, and the bodies they lead to. */
#include "base/text.h"
#include "io/osim.h"

#include <stdio.h>
#include <string.h>

/* Frames fixed to frames; a file of nothing else would exhaust the stack. */
#define FRAMES_DEEP 100

#define FRAME(o, i) ((mhi_osim_frame *)(o)->frames.items[i])

static const char *member(mhi_osim *o, const char *owner, const xmlNode *node) {
    const char *path = mhi_arena_format(&o->b.arena, "%s/%s", owner, mhi_xml_name(o, node));
    return path != NULL ? path : "";
}

static void collect_station(mhi_osim *o, xmlNode *node, const char *path) {
    mhi_osim_station *station = mhi_build_push(&o->b, &o->stations, sizeof *station);
    if (station != NULL) {
        *station = (mhi_osim_station){.path = path, .node = node};
    }
}

/* Frames and points among the children of `holder`, which live at `owner`. */
static void collect(mhi_osim *o, xmlNode *holder, const char *owner) {
    for (xmlNode *node = mhi_xml_first(holder); node != NULL; node = mhi_xml_next(node)) {
        const char *path = member(o, owner, node);
        if (mhi_xml_is(node, "Station") || mhi_xml_is(node, "Marker")) {
            collect_station(o, node, path);
        }
        const int32_t landmarks = mhi_xml_is(node, "StationDefinedFrame");
        if (!landmarks && !mhi_xml_is(node, "PhysicalOffsetFrame")) {
            continue;
        }
        mhi_osim_frame *frame = mhi_build_push(&o->b, &o->frames, sizeof *frame);
        if (frame == NULL) {
            return;
        }
        double angles[3] = {0};
        frame->path = path;
        frame->owner = owner;
        frame->parent = mhi_osim_socket(o, node, "parent");
        frame->landmarks = landmarks ? node : NULL;
        frame->line = mhi_xml_line(node);
        (void)mhi_xml_numbers(o, node, "orientation", angles, 3);
        (void)mhi_xml_numbers(o, node, "translation", frame->in_parent.p, 3);
        mhi_rotation_sequence("xyz", angles, frame->in_parent.r);
        collect(o, mhi_xml_child(node, "components"), frame->path);
    }
}

/* Frames within the members of a set, and of those that stand free. */
static void collect_members(mhi_osim *o, const char *set) {
    mhi_osim_walk walk = mhi_osim_begin(o, set);
    for (xmlNode *n = walk.node; n != NULL; n = mhi_osim_next(&walk)) {
        const char *path =
            walk.place == 0 || strcmp(set, "BodySet") == 0 ? member(o, walk.owner, n) : NULL;
        if (path != NULL) { /* those that stand free are the same for every set */
            collect(o, mhi_xml_child(n, "frames"), path);
            collect(o, mhi_xml_child(n, "components"), path);
        }
    }
}

void mhi_osim_frames(mhi_osim *o) {
    collect(o, mhi_xml_child(o->model, "components"), "");
    collect(o, mhi_xml_child(mhi_xml_child(o->model, "ComponentSet"), "objects"), "/componentset");
    collect(o, mhi_xml_child(mhi_xml_child(o->model, "Ground"), "components"), "/ground");
    collect(o, mhi_xml_child(mhi_xml_child(o->model, "MarkerSet"), "objects"), "/markerset");
    collect_members(o, "BodySet");
    collect_members(o, "JointSet");
    collect_members(o, "ConstraintSet");
    collect_members(o, "ForceSet");
}

/* Between 3.3 and 4.0: <connectors><Connector_.. name="parent_frame"><connectee_name>. */
static const char *connector(mhi_osim *o, xmlNode *object, const char *name) {
    xmlNode *node = mhi_xml_first(mhi_xml_child(object, "connectors"));
    while (node != NULL && strcmp(mhi_xml_name(o, node), name) != 0) {
        node = mhi_xml_next(node);
    }
    const char *text = mhi_xml_text(o, mhi_xml_child(node, "connectee_name"));
    return *text != '\0' ? text : NULL;
}

const char *mhi_osim_socket(mhi_osim *o, xmlNode *object, const char *name) {
    static const struct {
        const char *before, *after;
    } spellings[] = {
        {"socket_", ""}, {"socket_", "_connectee_name"}, {"connector_", "_connectee_name"}};
    const char *text = NULL;
    for (size_t i = 0; text == NULL && i < sizeof spellings / sizeof *spellings; i++) {
        char tag[64];
        (void)snprintf(tag, sizeof tag, "%s%s%s", spellings[i].before, name, spellings[i].after);
        text = mhi_xml_word(o, object, tag);
    }
    return text != NULL ? text : connector(o, object, name);
}

const char *mhi_osim_absolute(mhi_osim *o, const char *socket, const char *owner) {
    char *out = mhi_arena_take(&o->b.arena, strlen(owner) + strlen(socket) + 3);
    if (out == NULL) {
        return "";
    }
    strcpy(out, *socket == '/' ? "" : owner);
    while (*socket != '\0') {
        size_t length = strcspn(socket, "/");
        if (length == 2 && strncmp(socket, "..", 2) == 0) {
            char *slash = strrchr(out, '/');
            *(slash != NULL ? slash : out) = '\0';
        } else if (length > 0 && !(length == 1 && *socket == '.')) {
            strcat(out, "/");
            strncat(out, socket, length);
        }
        socket += length + (socket[length] == '/');
    }
    return out;
}

static const char *last_part(const char *path) {
    const char *slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

static const char *body_named(const mhi_osim *o, const char *name) {
    for (int32_t i = 0; i < o->b.bodies.n; i++) {
        const mhi_body_draft *draft = o->b.bodies.items[i];
        if (strcmp(draft->body.name, name) == 0) {
            return draft->body.name;
        }
    }
    return NULL;
}

/* The frame at `path`, else, by its last part, one of the owner's own, else any. */
static mhi_osim_frame *frame_named(const mhi_osim *o, const char *path, const char *owner) {
    mhi_osim_frame *own = NULL, *any = NULL;
    for (int32_t i = 0; i < o->frames.n; i++) {
        mhi_osim_frame *frame = FRAME(o, i);
        if (strcmp(frame->path, path) == 0) {
            return frame;
        }
        if (strcmp(last_part(frame->path), last_part(path)) == 0) {
            own = own == NULL && strcmp(frame->owner, owner) == 0 ? frame : own;
            any = any == NULL ? frame : any;
        }
    }
    return own != NULL ? own : any;
}

static void fail_unknown(mhi_osim *o, const char *socket, int32_t line) {
    int32_t n = o->b.bodies.n;
    const char **names = MHI_TAKE(&o->b.arena, const char *, n + 1);
    char hint[256] = "";
    for (int32_t i = 0; names != NULL && i < n; i++) {
        names[i] = ((mhi_body_draft *)o->b.bodies.items[i])->body.name;
    }
    if (names != NULL) {
        names[n] = "ground";
        mhi_suggest(hint, sizeof hint, last_part(socket), names, n + 1);
    }
    mhi_build_fail(&o->b, line, "'%s' is no body or frame%s", socket, hint);
}

int32_t mhi_osim_resolve(mhi_osim *o, const char *socket, const char *owner, int32_t line,
                         const char **body, mhi_transform *in_body) {
    *body = NULL;
    *in_body = mhi_transform_identity();
    if (socket == NULL) {
        mhi_build_fail(&o->b, line, "this element names no body that it is fixed to");
        return 0;
    }
    const char *path = mhi_osim_absolute(o, socket, owner), *name = last_part(path);
    mhi_osim_frame *frame = frame_named(o, path, owner);
    int32_t exact = frame != NULL && strcmp(frame->path, path) == 0;
    *body = body_named(o, name);
    /* a bare name may be that of a frame of the joint itself, and of a body elsewhere */
    int32_t own = frame != NULL && strcmp(frame->owner, owner) == 0 && *socket != '/';
    if (!exact && !own && (*body != NULL || mhi_same_word(name, "ground"))) {
        return 1;
    }
    if (frame == NULL) {
        fail_unknown(o, socket, line);
        return 0;
    }
    if (frame->visiting) {
        mhi_build_fail(&o->b, frame->line, "frame '%s' is fixed to itself", frame->path);
        return 0;
    }
    if (o->depth == FRAMES_DEEP) {
        mhi_build_fail(&o->b, frame->line, "frame '%s': more than %d frames fixed to each other",
                       frame->path, FRAMES_DEEP);
        return 0;
    }
    mhi_transform parent;
    int32_t ok;
    frame->visiting = 1;
    o->depth++;
    if (frame->landmarks != NULL) {
        ok = mhi_osim_landmark_frame(o, frame, body, in_body);
    } else {
        ok = mhi_osim_resolve(o, frame->parent, frame->path, frame->line, body, &parent);
        *in_body = mhi_transform_times(&parent, &frame->in_parent);
    }
    o->depth--;
    frame->visiting = 0;
    return ok;
}

/* Frame number k (0, 1) of the two. */
static int32_t one_frame(mhi_osim *o, xmlNode *object, const char *owner, int k, const char *socket,
                         const char *before, const char **body, mhi_transform *frame) {
    char name[64];
    double angles[3] = {0};
    mhi_transform place, offset = mhi_transform_identity();
    (void)snprintf(name, sizeof name, "%s%d", socket, k + 1);
    const char *target = mhi_osim_socket(o, object, name);
    if (target == NULL) {
        (void)snprintf(name, sizeof name, "%s%d", before, k + 1);
        target = mhi_xml_word(o, object, name);
    }
    (void)snprintf(name, sizeof name, "location_%s%d", before, k + 1);
    (void)mhi_xml_numbers(o, object, name, offset.p, 3);
    (void)snprintf(name, sizeof name, "orientation_%s%d", before, k + 1);
    (void)mhi_xml_numbers(o, object, name, angles, 3);
    mhi_rotation_sequence("xyz", angles, offset.r);
    if (!mhi_osim_resolve(o, target, owner, mhi_xml_line(object), body, &place)) {
        return 0;
    }
    *frame = mhi_transform_times(&place, &offset);
    return 1;
}

int32_t mhi_osim_two_frames(mhi_osim *o, xmlNode *object, const char *set, const char *socket,
                            const char *before, const char *body[2], mhi_transform frame[2]) {
    const char *owner = member(o, set, object);
    for (int k = 0; k < 2; k++) {
        if (!one_frame(o, object, owner, k, socket, before, &body[k], &frame[k])) {
            return 0;
        }
    }
    return 1;
}

int32_t mhi_osim_location(mhi_osim *o, xmlNode *object, const char **body, double location[3]) {
    const char *socket = mhi_osim_socket(o, object, "parent_frame");
    mhi_transform in_body;
    double point[3] = {0};
    if (socket == NULL) {
        socket = mhi_xml_word(o, object, "body");
    }
    if (mhi_xml_word(o, object, "location") == NULL) {
        mhi_build_warn(&o->b, mhi_xml_line(object),
                       "%s '%s' has no location: as in OpenSim it lies at 0 0 0 of its frame",
                       (const char *)object->name, mhi_xml_name(o, object));
    }
    (void)mhi_xml_numbers(o, object, "location", point, 3);
    if (!mhi_osim_resolve(o, socket, "", mhi_xml_line(object), body, &in_body)) {
        return 0;
    }
    mhi_transform_point(&in_body, point, location);
    return 1;
}

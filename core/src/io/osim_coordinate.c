/* SPDX-License-Identifier: Apache-2.0 */
/* osim_coordinate.c: coordinates of joints. */
#include "base/text.h"
#include "io/osim.h"

#include <string.h>

#define COORDINATE(o, i) ((mhi_coordinate_draft *)(o)->b.coordinates.items[i])

/* A prescribed coordinate stands at its function's value at time 0; a function that moves would
 * need the time. */
static void read_prescribed(mhi_osim *o, xmlNode *node, mhi_coordinate_draft *draft) {
    const char *whose = mhi_arena_format(&o->b.arena, "the prescribed motion of coordinate '%s'",
                                         draft->coordinate.name);
    mhe_function f = {0};
    if (draft->locked || !mhi_xml_flag(o, node, "prescribed") || whose == NULL) {
        return; /* locked goes before prescribed, as in OpenSim */
    }
    int32_t found = mhi_osim_function_of(o, node, "prescribed_function", whose, &f);
    if (found != 1) {
        return; /* without a function OpenSim ignores the flag */
    }
    draft->locked = 1;
    draft->coordinate.value = mhi_function_value(&f, 0);
    if (!mhi_function_is_constant(&f)) {
        mhi_build_unsupported(&o->b, draft->line,
                              "%s is a function of time: it stands where that begins, at %g", whose,
                              draft->coordinate.value);
    }
}

/* Since 4.0 coordinates of several joints may share a name, as those that programs make up ("rx")
 * do; the later ones are called after their joint as well. */
static const char *unique_name(mhi_osim *o, const mhi_osim_joint *j, const char *name,
                               int32_t line) {
    for (int32_t i = 0; i < j->first; i++) {
        if (strcmp(COORDINATE(o, i)->coordinate.name, name) == 0) {
            const char *longer = mhi_arena_format(&o->b.arena, "%s_%s", j->name, name);
            mhi_build_warn(&o->b, line,
                           "coordinate '%s' of joint '%s' is called '%s': there is one of that "
                           "name in line %d",
                           name, j->name, longer != NULL ? longer : "",
                           (int)COORDINATE(o, i)->line);
            return longer != NULL ? longer : name;
        }
    }
    return name;
}

static void read_coordinate(mhi_osim *o, const mhi_osim_joint *j, xmlNode *node) {
    double range[2];
    const char *name = mhi_xml_name(o, node);
    mhi_coordinate_draft *draft = mhi_build_coordinate(
        &o->b, unique_name(o, j, name, mhi_xml_line(node)), mhi_xml_line(node));
    if (draft == NULL) {
        return;
    }
    draft->joint = j->name;
    draft->in_joint = name;
    if (*draft->coordinate.name == '\0') { /* before an axis looks for it */
        mhi_build_fail(&o->b, draft->line, "this coordinate has no name");
    }
    (void)mhi_xml_numbers(o, node, "default_value", &draft->coordinate.value, 1);
    (void)mhi_xml_numbers(o, node, "default_speed_value", &draft->coordinate.speed, 1);
    if (mhi_xml_range(o, node, "range", range)) {
        draft->coordinate.lower = range[0];
        draft->coordinate.upper = range[1];
    }
    draft->locked = mhi_xml_flag(o, node, "locked");
    read_prescribed(o, node, draft);
}

void mhi_osim_coordinates(mhi_osim *o, mhi_osim_joint *j, int32_t n) {
    j->first = o->b.coordinates.n;
    xmlNode *node = mhi_xml_first(mhi_xml_child(j->node, "coordinates"));
    if (node == NULL) {
        node = mhi_xml_objects(j->node, "CoordinateSet");
    }
    for (; node != NULL; node = mhi_xml_next(node)) {
        if (mhi_xml_is(node, "Coordinate")) {
            read_coordinate(o, j, node);
        }
    }
    for (int32_t i = o->b.coordinates.n - j->first; i < n; i++) {
        const char *name = mhi_arena_format(&o->b.arena, "%s_coord_%d", j->name, (int)i);
        (void)mhi_build_coordinate(&o->b, name != NULL ? name : "", mhi_xml_line(j->node));
    }
    j->n = o->b.coordinates.n - j->first;
}

void mhi_osim_motion(mhi_osim *o, mhi_osim_joint *j, int32_t kind, int32_t i,
                     const double axis[3]) {
    if (o->b.status != MHE_OK) {
        return;
    }
    COORDINATE(o, j->first + i)->coordinate.rotational = kind == MHE_MOTION_ROTATION;
    mhi_build_motion(&o->b, j->body, kind, j->first + i, axis, mhi_function_identity(&o->b),
                     mhi_xml_line(j->node));
}

/* "../elbow/rx": the coordinate rx of the joint elbow; -1: there is none. */
static int32_t coordinate_at(const mhi_osim *o, const char *path, const char *plain) {
    for (int32_t i = 0; plain > path && i < o->b.coordinates.n; i++) {
        const mhi_coordinate_draft *draft = COORDINATE(o, i);
        const size_t n = draft->joint == NULL ? 0 : strlen(draft->joint);
        if (n > 0 && strcmp(draft->in_joint, plain) == 0 && (size_t)(plain - path) > n &&
            strncmp(plain - 1 - n, draft->joint, n) == 0 &&
            (plain - 1 - n == path || plain[-2 - (ptrdiff_t)n] == '/')) {
            return i;
        }
    }
    return -1;
}

int32_t mhi_osim_coordinate(mhi_osim *o, const char *name, int32_t line, const char *whose) {
    const char *slash = strrchr(name, '/');
    const char *plain = slash != NULL ? slash + 1 : name;
    int32_t n = o->b.coordinates.n, exact = coordinate_at(o, name, plain);
    if (exact >= 0) {
        return exact;
    }
    const char **names = mhi_build_take(&o->b, n, sizeof *names);
    for (int32_t i = 0; names != NULL && i < n; i++) {
        names[i] = COORDINATE(o, i)->coordinate.name;
        if (strcmp(names[i], plain) == 0) {
            return i;
        }
    }
    char hint[256] = "";
    if (names != NULL) {
        mhi_suggest(hint, sizeof hint, plain, names, n);
    }
    mhi_build_fail(&o->b, line, "%s names an unknown coordinate '%s'%s", whose, plain, hint);
    return -1;
}

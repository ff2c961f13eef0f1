/* SPDX-License-Identifier: Apache-2.0 */
/* osim_constraint.c: couplers become dependent coordinates, points and frames that stay together
 * loops. */
#include "io/osim.h"

#include <string.h>

/* The single independent coordinate; -1 after an error. */
static int32_t independent_of(mhi_osim *o, xmlNode *node, const char *whose) {
    const char *names = mhi_xml_word(o, node, "independent_coordinate_names");
    int32_t line = mhi_xml_line(node);
    if (names == NULL) {
        mhi_build_fail(&o->b, line, "%s names no independent coordinate", whose);
        return -1;
    }
    if (names[strcspn(names, " \t\r\n")] != '\0') {
        mhi_build_fail(&o->b, line,
                       "%s has several independent coordinates (%s); a dependent one can follow "
                       "only one",
                       whose, names);
        return -1;
    }
    return mhi_osim_coordinate(o, names, line, whose);
}

static void read_coupler(mhi_osim *o, xmlNode *node) {
    const char *name = mhi_xml_name(o, node);
    const char *whose = mhi_arena_format(&o->b.arena, "coupler '%s'", name);
    const char *dependent = mhi_xml_word(o, node, "dependent_coordinate_name");
    double scale = 1;
    mhe_function f = {0};
    if (whose == NULL) {
        return;
    }
    if (dependent == NULL) {
        mhi_build_fail(&o->b, mhi_xml_line(node), "%s names no dependent coordinate", whose);
        return;
    }
    int32_t independent = independent_of(o, node, whose);
    int32_t found = mhi_osim_function_of(o, node, "coupled_coordinates_function", whose, &f);
    if (found == 0) {
        mhi_build_fail(&o->b, mhi_xml_line(node), "%s has no coupled_coordinates_function", whose);
    }
    (void)mhi_xml_numbers(o, node, "scale_factor", &scale, 1);
    int32_t driven = mhi_osim_coordinate(o, dependent, mhi_xml_line(node), whose);
    if (found != 1 || independent < 0 || driven < 0) {
        return; /* an unsupported function: the coordinate stays free, and it is listed */
    }
    mhi_coupler_draft *draft = mhi_build_push(&o->b, &o->b.couplers, sizeof *draft);
    if (draft != NULL) {
        *draft =
            (mhi_coupler_draft){.name = name,
                                .dependent = driven,
                                .independent = independent,
                                .function = scale == 1 ? f : mhi_function_scaled(&o->b, scale, f),
                                .line = mhi_xml_line(node)};
    }
}

static void read_loop(mhi_osim *o, xmlNode *node, const char *set, int32_t kind) {
    const char *body[2];
    mhi_transform frame[2];
    int32_t weld = kind == MHE_LOOP_WELD;
    if (!mhi_osim_two_frames(o, node, set, weld ? "frame" : "body_", "body_", body, frame)) {
        return;
    }
    if (body[0] == body[1] ||
        (body[0] != NULL && body[1] != NULL && strcmp(body[0], body[1]) == 0)) {
        mhi_build_fail(&o->b, mhi_xml_line(node), "%s '%s' holds '%s' to itself",
                       (const char *)node->name, mhi_xml_name(o, node),
                       body[0] != NULL ? body[0] : "ground");
        return;
    }
    mhi_loop_draft *draft = mhi_build_push(&o->b, &o->b.loops, sizeof *draft);
    if (draft == NULL) {
        return;
    }
    draft->loop =
        (mhe_loop){.name = mhi_xml_name(o, node), .kind = kind, .line = mhi_xml_line(node)};
    for (int k = 0; k < 2; k++) {
        draft->body[k] = body[k];
        memcpy(draft->loop.r[k], frame[k].r, sizeof frame[k].r);
        memcpy(draft->loop.p[k], frame[k].p, sizeof frame[k].p);
    }
}

void mhi_osim_constraints(mhi_osim *o) {
    mhi_osim_walk walk = mhi_osim_begin(o, "ConstraintSet");
    for (xmlNode *n = walk.node; n != NULL && o->b.status == MHE_OK; n = mhi_osim_next(&walk)) {
        if (!mhi_xml_ends(n, "Constraint") || !mhi_xml_enabled(o, n)) {
            continue;
        }
        if (mhi_xml_is(n, "CoordinateCouplerConstraint")) {
            read_coupler(o, n);
        } else if (mhi_xml_is(n, "PointConstraint")) {
            read_loop(o, n, walk.owner, MHE_LOOP_POINT);
        } else if (mhi_xml_is(n, "WeldConstraint")) {
            read_loop(o, n, walk.owner, MHE_LOOP_WELD);
        } else {
            mhi_build_unsupported(&o->b, mhi_xml_line(n), "%s '%s': not enforced",
                                  (const char *)n->name, mhi_xml_name(o, n));
        }
    }
}

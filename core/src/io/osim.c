/* SPDX-License-Identifier: Apache-2.0 */
/* osim.c: OpenSim model reader, layouts of OpenSim 2.x to 4.x. */
#include "io/osim.h"
#include "base/number.h"
#include "io/model_file.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include <libxml/parser.h>

#define FORWARD_ONLY "controllers drive a forward simulation only"
#define AFTER 50000 /* of versions, as files write them */

/* What drives a forward simulation, and what is only computed beside it. */
static void drop_set(mhi_osim *o, const char *set, const char *why) {
    for (xmlNode *n = mhi_xml_objects(o->model, set); n != NULL; n = mhi_xml_next(n)) {
        if (mhi_xml_enabled(o, n)) {
            mhi_build_dropped(&o->b, mhi_xml_line(n), "%s '%s': %s", (const char *)n->name,
                              mhi_xml_name(o, n), why);
        }
    }
}

static void list_components(mhi_osim *o, xmlNode *holder) {
    static const char *const harmless[] = {"Body",
                                           "PhysicalOffsetFrame",
                                           "StationDefinedFrame",
                                           "Station",
                                           "Marker",
                                           "PathPoint",
                                           "IMU",
                                           "Mesh",
                                           "Sphere",
                                           "Brick",
                                           "Cone",
                                           "Cylinder",
                                           "Arrow",
                                           "Ellipsoid",
                                           "Torus",
                                           "Line",
                                           "FrameGeometry"};
    for (xmlNode *n = mhi_xml_first(holder); n != NULL; n = mhi_xml_next(n)) {
        if (mhi_xml_ends(n, "Reporter") || mhi_xml_ends(n, "Metabolics") ||
            mhi_xml_ends(n, "MetabolicCost")) {
            mhi_build_dropped(&o->b, mhi_xml_line(n), "%s '%s': it is computed beside a simulation",
                              (const char *)n->name, mhi_xml_name(o, n));
        } else if (mhi_xml_ends(n, "Controller")) {
            mhi_build_dropped(&o->b, mhi_xml_line(n), "%s '%s': %s", (const char *)n->name,
                              mhi_xml_name(o, n), FORWARD_ONLY);
        } else if (!mhi_xml_one_of(n, harmless, sizeof harmless / sizeof *harmless) &&
                   !mhi_xml_ends(n, "Joint") && !mhi_xml_ends(n, "Constraint") &&
                   !mhi_osim_force(o, n)) {
            mhi_build_unsupported(&o->b, mhi_xml_line(n), "component %s '%s': left out",
                                  (const char *)n->name, mhi_xml_name(o, n));
        }
    }
}

/* Elements of <Model> that are read elsewhere or have no part in the mechanics; a
 * ContactGeometrySet alone makes no force, a wrap object that no path names neither. */
static void list_unknown(mhi_osim *o) {
    enum { WORDS = 5 }; /* the first of them change nothing, however many there are */
    static const char *const known[] = {"credits",
                                        "publications",
                                        "notes",
                                        "model_version",
                                        "VisibleObject",
                                        "length_units",
                                        "force_units",
                                        "gravity",
                                        "Ground",
                                        "BodySet",
                                        "JointSet",
                                        "ForceSet",
                                        "MarkerSet",
                                        "ConstraintSet",
                                        "ControllerSet",
                                        "ContactGeometrySet",
                                        "ProbeSet",
                                        "ComponentSet",
                                        "components",
                                        "defaults",
                                        "WrapObjectSet",
                                        "FrameSet",
                                        "show_visualizer",
                                        "ModelVisualPreferences",
                                        "frames",
                                        "ModelVisualizer",
                                        "assembly_accuracy"};
    for (xmlNode *n = mhi_xml_first(o->model); n != NULL; n = mhi_xml_next(n)) {
        if (!mhi_xml_one_of(n, known, sizeof known / sizeof *known)) {
            mhi_build_unsupported(&o->b, mhi_xml_line(n), "element <%s>: left out",
                                  (const char *)n->name);
        } else if (mhi_xml_one_of(n, known, WORDS)) {
            continue;
        } else if (mhi_xml_child(o->model, (const char *)n->name) != n) {
            mhi_build_unsupported(&o->b, mhi_xml_line(n), "a second <%s>: left out",
                                  (const char *)n->name);
        } else if (*mhi_xml_attribute(o, n, "file") != '\0') {
            mhi_build_unsupported(&o->b, mhi_xml_line(n), "<%s> kept in another file",
                                  (const char *)n->name);
        }
    }
}

static void read_markers(mhi_osim *o) {
    for (xmlNode *n = mhi_xml_objects(o->model, "MarkerSet"); n != NULL; n = mhi_xml_next(n)) {
        const char *body;
        double location[3];
        if (mhi_xml_is(n, "Marker") && mhi_osim_location(o, n, &body, location)) {
            mhi_build_marker(&o->b, mhi_xml_name(o, n), body, location, mhi_xml_line(n));
        }
    }
}

static void read_model(mhi_osim *o) {
    const char *name = mhi_xml_name(o, o->model);
    o->b.name = *name != '\0' ? name : NULL;
    (void)mhi_xml_numbers(o, o->model, "gravity", o->b.gravity, 3);
    mhi_osim_frames(o);
    mhi_osim_bodies(o);
    mhi_build_check_bodies(&o->b);
    mhi_osim_joints(o);
    mhi_osim_constraints(o);
    mhi_osim_obstacles(o);
    mhi_osim_forces(o);
    read_markers(o);
    drop_set(o, "ControllerSet", FORWARD_ONLY);
    drop_set(o, "ProbeSet", "probes are computed beside a simulation");
    list_components(o, mhi_xml_child(o->model, "components"));
    list_components(o, mhi_xml_child(mhi_xml_child(o->model, "ComponentSet"), "objects"));
    list_unknown(o);
}

/* Lengths and forces are taken as they stand, whatever their units are called, as OpenSim does. */
static void check_unit(mhi_osim *o, const char *tag, const char *const *names, size_t n) {
    const char *unit = mhi_xml_word(o, o->model, tag);
    size_t i = 0;
    while (unit != NULL && i < n && !mhi_same_word(unit, names[i])) {
        i++;
    }
    if (unit != NULL && i == n) {
        mhi_build_warn(&o->b, mhi_xml_line(mhi_xml_child(o->model, tag)),
                       "<%s> is '%s': as in OpenSim the numbers are taken as %s", tag, unit,
                       names[0]);
    }
}

static void check_units(mhi_osim *o) {
    static const char *const lengths[] = {"m", "meters", "meter", "metres", "metre", "Unassigned"};
    static const char *const forces[] = {"N", "newtons", "newton", "Unassigned"};
    check_unit(o, "length_units", lengths, sizeof lengths / sizeof *lengths);
    check_unit(o, "force_units", forces, sizeof forces / sizeof *forces);
}

/* How a file is read follows from its elements; the version only says what may be in it. */
static void check_version(mhi_osim *o, const xmlNode *root) {
    const char *text = mhi_xml_attribute(o, root, "Version");
    double version = 0;
    if (*text != '\0' && (!mhi_number((mhi_cell){text, strlen(text)}, &version) || version < 1)) {
        mhi_build_warn(&o->b, mhi_xml_line(root),
                       "Version=\"%s\" is no version of OpenSim (20302, 30000, 40000 or the like)",
                       text);
    } else if (version >= AFTER) {
        mhi_build_warn(&o->b, mhi_xml_line(root),
                       "Version=\"%s\" is newer than what is known here (below %d)", text, AFTER);
    }
}

static void read_document(mhi_osim *o, xmlDoc *document) {
    xmlNode *root = xmlDocGetRootElement(document);
    if (document->intSubset != NULL) { /* entities: none is needed, and some are bombs */
        mhi_build_fail(&o->b, 0, "a document type declaration has no place in a model file");
        return;
    }
    if (root == NULL || !mhi_xml_is(root, "OpenSimDocument")) {
        mhi_build_fail(&o->b, root != NULL ? mhi_xml_line(root) : 0,
                       "not an OpenSim model: the outermost element is <%s>, not "
                       "<OpenSimDocument>",
                       root != NULL ? (const char *)root->name : "");
        return;
    }
    o->model = mhi_xml_child(root, "Model");
    if (o->model == NULL) {
        mhi_build_fail(&o->b, mhi_xml_line(root), "<OpenSimDocument> holds no <Model>");
        return;
    }
    check_version(o, root);
    check_units(o);
    read_model(o);
    for (xmlNode *n = mhi_xml_next(o->model); n != NULL; n = mhi_xml_next(n)) {
        if (mhi_xml_is(n, "Model")) {
            mhi_build_unsupported(&o->b, mhi_xml_line(n), "a second <Model> '%s': left out",
                                  mhi_xml_name(o, n));
        }
    }
}

/* libxml2's message without its line end. */
static void fail_syntax(mhi_osim *o, xmlParserCtxt *context) {
    const xmlError *problem = xmlCtxtGetLastError(context);
    const char *text = problem != NULL && problem->message != NULL ? problem->message : "not XML";
    mhi_build_fail(&o->b, problem != NULL ? problem->line : 0, "%.*s", (int)strcspn(text, "\r\n"),
                   text);
}

static void quiet(void *data, xmlError *problem) {
    (void)data, (void)problem; /* told by fail_syntax() */
}

/* Parses without network. */
static xmlDoc *parse(xmlParserCtxt *context, const char *text, int length) {
    return xmlCtxtReadMemory(context, text, length, NULL, NULL,
                             XML_PARSE_NONET | XML_PARSE_NOERROR | XML_PARSE_NOWARNING |
                                 XML_PARSE_BIG_LINES);
}

/* libxml2 does not always say so where it had no memory: a document that it gives may end early, an
 * error may name what the lack of memory made of the file. `document` NULL: the file is wrong where
 * it is so twice in the same way. */
static int32_t lacked_memory(xmlParserCtxt *context, const xmlDoc *document, const char *text,
                             int length) {
    if (document != NULL) {
        return context->errNo == XML_ERR_NO_MEMORY || context->disableSAX != 0;
    }
    xmlParserCtxt *again = xmlNewParserCtxt();
    xmlDoc *second = again == NULL ? NULL : parse(again, text, length);
    const int32_t same = again != NULL && second == NULL && again->errNo == context->errNo &&
                         context->errNo != XML_ERR_NO_MEMORY &&
                         again->lastError.line == context->lastError.line;
    xmlFreeDoc(second);
    xmlFreeParserCtxt(again);
    return !same;
}

static void fail_memory(mhi_osim *o) {
    o->b.status = mhe_fail(o->b.err, MHE_E_MEMORY, "%s: out of memory", o->b.source);
}

static void read_text(mhi_osim *o, const char *text, int length);

/* The text once more, as OpenSim's parser takes it; 0: it takes it no otherwise. */
static int32_t read_tidied(mhi_osim *o, const char *text, int length) {
    mhi_osim_tidied t;
    if (o->tidied || !mhi_osim_tidy(text, (size_t)length, &t)) {
        return 0;
    }
    o->tidied = 1;
    if (t.text == NULL || t.length > INT_MAX) {
        fail_memory(o);
    } else {
        if (t.plain_line > 0) {
            mhi_build_warn(&o->b, t.plain_line, "'&' should be '&amp;': read as the letter");
        }
        if (t.comment_line > 0) {
            mhi_build_warn(&o->b, t.comment_line,
                           "a comment with '--' in it is no XML: it ends at its first '-->', as in "
                           "OpenSim");
        }
        read_text(o, t.text, (int)t.length);
    }
    free(t.text);
    return 1;
}

static void read_text(mhi_osim *o, const char *text, int length) {
    xmlParserCtxt *context = xmlNewParserCtxt();
    xmlDoc *document = context == NULL ? NULL : parse(context, text, length);
    if (context == NULL || lacked_memory(context, document, text, length)) {
        fail_memory(o);
    } else if (document != NULL) {
        read_document(o, document);
    } else if (!read_tidied(o, text, length)) {
        fail_syntax(o, context);
    }
    xmlFreeDoc(document);
    xmlFreeParserCtxt(context);
}

static mhe_status parse_model(const char *name, const char *text, size_t length, int32_t unlocked,
                              mhe_description **description, mhe_error *err) {
    mhi_osim o = {0};
    *description = NULL;
    mhi_build_start(&o.b, name, err);
    o.b.gravity[1] = -9.80665;
    o.b.unlocked = unlocked;
    if (length > INT_MAX) {
        mhi_build_fail(&o.b, 0, "the file is too large");
        return mhi_build_abandon(&o.b);
    }
    /* Not a word from below: complaints about memory and the encoding would go to stderr. */
    const xmlStructuredErrorFunc handler = xmlStructuredError;
    void *handler_data = xmlStructuredErrorContext;
    xmlSetStructuredErrorFunc(NULL, quiet);
    mhi_c_locale saved = mhi_c_locale_begin();
    read_text(&o, text, (int)length);
    mhi_c_locale_end(saved);
    xmlSetStructuredErrorFunc(handler_data, handler);
    return mhi_build_finish(&o.b, description);
}

mhe_status mhi_osim_parse(const char *name, const char *text, size_t length,
                          mhe_description **description, mhe_error *err) {
    return parse_model(name, text, length, 0, description, err);
}

mhe_status mhi_osim_parse_unlocked(const char *name, const char *text, size_t length,
                                   mhe_description **description, mhe_error *err) {
    return parse_model(name, text, length, 1, description, err);
}

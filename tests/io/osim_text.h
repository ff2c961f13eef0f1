/* SPDX-License-Identifier: Apache-2.0 */
/* osim_text.h: .osim documents written out in tests, piece by piece. */
#ifndef TEST_OSIM_TEXT_H
#define TEST_OSIM_TEXT_H

#include "io/model_file.h"
#include "support.h"

#include <math.h>
#include <string.h>

static inline mhe_description *parse_with(mhe_status (*reader)(const char *, const char *, size_t,
                                                               mhe_description **, mhe_error *),
                                          const char *text) {
    mhe_description *d = NULL;
    mhe_error err = {0};
    if (reader("m.osim", text, strlen(text), &d, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    return d;
}

static inline mhe_description *parse(const char *text) {
    return parse_with(mhi_osim_parse, text);
}

static inline void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance)) {
        fail_msg("%.17g is not %.17g", value, expected);
    }
}

#define DOCUMENT(content)                                                          \
    "<OpenSimDocument Version=\"40000\"><Model name=\"m\">\n" content "</Model></" \
    "OpenSimDocument>\n"
#define SET(name, content) "<" name "><objects>\n" content "</objects></" name ">\n"
#define BODY(name, extra) \
    "<Body name=\"" name "\"><mass>1</mass><inertia>1 1 1 0 0 0</inertia>" extra "</Body>\n"
#define SOCKETS(parent, child)                              \
    "<socket_parent_frame>" parent "</socket_parent_frame>" \
    "<socket_child_frame>" child "</socket_child_frame>\n"
#define COORDINATE(name, extra) "<Coordinate name=\"" name "\">" extra "</Coordinate>"
#define PIN(name, parent, child, coordinate, extra)                                   \
    "<PinJoint name=\"" name "\">" SOCKETS(parent, child) "<coordinates>" COORDINATE( \
        coordinate, extra) "</coordinates></PinJoint>\n"
/* three bodies in a row, coordinates p, q, r */
#define CHAIN_WITH(p, q, r, extra)                                                             \
    SET("BodySet", BODY("a", extra) BODY("b", "") BODY("c", ""))                               \
    SET("JointSet",                                                                            \
        PIN("i", "/ground", "/bodyset/a", "p", p) PIN("j", "/bodyset/a", "/bodyset/b", "q", q) \
            PIN("k", "/bodyset/b", "/bodyset/c", "r", r))
#define CHAIN CHAIN_WITH("", "", "", "")
#define COUPLER(name, from, to, function, extra)                                             \
    "<CoordinateCouplerConstraint name=\"" name "\"><coupled_coordinates_function>" function \
    "</coupled_coordinates_function><independent_coordinate_names>" from                     \
    "</independent_coordinate_names><dependent_coordinate_name>" to                          \
    "</dependent_coordinate_name>" extra "</CoordinateCouplerConstraint>\n"
#define LINE(slope, at) \
    "<LinearFunction><coefficients>" slope " " at "</coefficients></LinearFunction>"
#define FRAME(body) "<socket_parent_frame>/bodyset/" body "</socket_parent_frame>"
#define POINT(body, at) "<PathPoint>" FRAME(body) "<location>" at "</location></PathPoint>\n"
#define LOCKED "<locked>true</locked><default_value>0.5</default_value>"

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* .osim reader: what public models have and a strict reader would refuse, OpenSim not. */
#include "io/description_builder.h"
#include "osim_text.h"

static void assert_warned(const mhe_description *d, const char *what) {
    for (int32_t i = 0; i < d->n_warnings; i++) {
        if (strstr(d->warnings[i], what) != NULL) {
            return;
        }
    }
    fail_msg("no warning says '%s'", what);
}

static void assert_refused(const char *text, const char *what) {
    mhe_description *d = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_osim_parse("m.osim", text, strlen(text), &d, &err), MHE_E_INPUT);
    assert_null(d);
    if (strstr(err.text, what) == NULL) {
        fail_msg("'%s' does not say '%s'", err.text, what);
    }
}

#define CURVED(x, y)                                                                     \
    DOCUMENT(CHAIN SET("ConstraintSet", COUPLER("c", "p", "q",                           \
                                                "<SimmSpline><x>" x "</x><y>" y "</y></" \
                                                "SimmSpline>",                           \
                                                "")))

/* The passive curves of MoBL-ARMS have it: OpenSim's spline is level there, whatever follows. */
static void a_point_of_a_spline_twice(void **state) {
    (void)state;
    mhe_description *d = parse(CURVED("0 1 2 2 3 4", "0 0 0 0 1 4"));
    const mhe_function *f = &d->dependents[0].function;
    double at[3];
    assert_warned(d, "has the point at 2 twice");
    for (int i = 0; i <= 40; i++) { /* nothing of what comes after is felt before */
        assert_near(mhi_function_value(f, i / 20.0), 0, 1e-6);
    }
    mhi_function_derivatives(f, 2.0001, at);
    assert_near(at[1], 0, 1e-3);
    assert_near(mhi_function_value(f, 3), 1, 1e-12);
    mhi_description_free(d);
    assert_refused(CURVED("0 1 2 2 3 4", "0 0 0 1 1 4"), "x does not increase at 2");
}

static void comments_and_ampersands_that_are_no_xml(void **state) {
    (void)state;
    mhe_description *d = parse(DOCUMENT(
        "<credits>Smith & Jones, &lt;2&gt;, R&D &#38; &unknown; more</credits>\n<!-- a -- b <!--\n"
        "another -->\n<notes><![CDATA[a & b]]></notes>" CHAIN));
    assert_int_equal(d->n_coordinates, 3);
    assert_warned(d, "m.osim:2: '&' should be '&amp;'");
    assert_warned(d, "m.osim:4: a comment with '--' in it");
    mhi_description_free(d);
    d = parse(DOCUMENT("<publications>A</publications><publications>B</publications>" CHAIN));
    assert_int_equal(d->n_unsupported, 0); /* OpenCap's models */
    mhi_description_free(d);
    /* what is wrong otherwise still is, in its line */
    assert_refused("<OpenSimDocument>\n<!-- a -- b -->\n<Model>\n</Modl></OpenSimDocument>",
                   "m.osim:4: Opening and ending tag mismatch");
    /* and what is right is read as ever, comments and all */
    d = parse(DOCUMENT("<!-- one - two -->" CHAIN "<!-- -->"));
    assert_int_equal(d->n_warnings, 0);
    mhi_description_free(d);
}

#define FRAMED                                                          \
    "<PinJoint name=\"j\">" SOCKETS(                                    \
        "near", "/b") "<coordinates><Coordinate name=\"q\"/>"           \
                      "</coordinates><frames><PhysicalOffsetFrame "     \
                      "name=\"near\"><socket_parent>/a</socket_parent>" \
                      "<translation>0 5 0</translation></PhysicalOffsetFrame></frames></PinJoint>"

/* Programs that build models may add bodies, joints and constraints to the model itself. */
static void bodies_and_joints_outside_of_their_sets(void **state) {
    (void)state;
    mhe_description *d = parse(DOCUMENT(
        "<components>" BODY("a", "<WrapObjectSet><objects><WrapSphere name=\"w\"><radius>0.1"
                                 "</radius></WrapSphere></objects></WrapObjectSet>") BODY("b", "")
            PIN("i", "/ground", "/a", "p", "")
                FRAMED COUPLER("c", "p", "q", LINE("2", "0"),
                               "") "<PathPoint name=\"free\"/>"
                                   "<StatesTrajectoryReporter name=\"r\"/></components>\n"
                                   "<ComponentSet><objects>" BODY("c", "")
                                       PIN("k", "/b", "/c", "r", "") "</objects>"
                                                                     "</ComponentSet>"));
    assert_int_equal(d->n_unsupported, 0);
    assert_int_equal(d->n_dropped, 1); /* the reporter */
    assert_int_equal(d->n_bodies, 3);
    assert_int_equal(d->bodies[1].parent, 0);
    assert_near(d->bodies[1].joint_p[1], 5, 0);
    assert_int_equal(d->bodies[2].parent, 1);
    assert_int_equal(d->n_coordinates, 2);
    assert_int_equal(d->n_dependents, 1);
    mhi_description_free(d);
}

#define TWICE                                                                              \
    SET("BodySet", BODY("a", "") BODY("b", "") BODY("c", ""))                              \
    SET("JointSet",                                                                        \
        PIN("i", "/ground", "/bodyset/a", "rx", "<default_value>1</default_value>")        \
            PIN("j", "/bodyset/a", "/bodyset/b", "rx", "<default_value>2</default_value>") \
                PIN("k", "/bodyset/b", "/bodyset/c", "r", ""))

/* Their full names differ, "/jointset/i/rx" and "/jointset/j/rx". */
static void coordinates_of_one_name(void **state) {
    (void)state;
    mhe_description *d = parse(DOCUMENT(TWICE));
    assert_int_equal(d->n_coordinates, 3);
    assert_string_equal(d->coordinates[0].name, "rx");
    assert_string_equal(d->coordinates[1].name, "j_rx");
    assert_warned(d, "coordinate 'rx' of joint 'j' is called 'j_rx'");
    mhi_description_free(d);
    /* axes name the coordinates of their own joint */
    d = parse(DOCUMENT(SET("BodySet", BODY("a", "") BODY("b", "")) SET(
        "JointSet",
        PIN("i", "/ground", "/bodyset/a", "rx", "") "<CustomJoint name=\"j\">" SOCKETS(
            "/bodyset/a", "/bodyset/b") "<coordinates><Coordinate name=\"rx\"/>"
                                        "</coordinates><SpatialTransform>"
                                        "<TransformAxis name=\"rotation1\">"
                                        "<coordinates>rx</coordinates><axis>1 0 0</axis>"
                                        "</TransformAxis></SpatialTransform>"
                                        "</CustomJoint>")));
    assert_int_equal(d->bodies[1].motions[0].coordinate, 1);
    mhi_description_free(d);
    /* a bare name means the first, a path the one at its end */
    d = parse(DOCUMENT(
        TWICE SET("ConstraintSet", COUPLER("c", "/jointset/j/rx", "r", LINE("3", "0"), ""))));
    assert_int_equal(d->dependents[0].independent, 1);
    mhi_description_free(d);
    d = parse(DOCUMENT(TWICE SET("ConstraintSet", COUPLER("c", "rx", "r", LINE("3", "0"), ""))));
    assert_int_equal(d->dependents[0].independent, 0);
    mhi_description_free(d);
}

#define MASS(mass, inertia)                                                                       \
    DOCUMENT(SET("BodySet",                                                                       \
                 "<Body name=\"a\"><mass>" mass "</mass><inertia>" inertia "</inertia></Body>\n") \
                 SET("JointSet", PIN("i", "/ground", "/bodyset/a", "p", "")))

static void inertias_that_no_body_has(void **state) {
    (void)state;
    mhe_description *d = parse(MASS("1", "1 1 -1 0 0 0"));
    assert_warned(d, "is not positive about every axis: kept");
    assert_near(d->bodies[0].inertia[8], -1, 0);
    mhi_description_free(d);
    d = parse(MASS("0", "1 1 1 0 0 0"));
    assert_warned(d, "has no mass but an inertia");
    assert_near(d->bodies[0].inertia[0], 0, 0);
    mhi_description_free(d);
}

#define STATION(name, at)                                                                   \
    "<Station name=\"" name "\"><socket_parent_frame>..</socket_parent_frame><location>" at \
    "</location></Station>"
#define LANDMARKS(a, b, c, at, axes)                                               \
    "<StationDefinedFrame name=\"f\"><socket_point_a>" a "</socket_point_a>"       \
    "<socket_point_b>" b "</socket_point_b><socket_point_c>" c "</socket_point_c>" \
    "<socket_origin_point>" at "</socket_origin_point>" axes "</StationDefinedFrame>"
#define ON_LANDMARKS(frame, elsewhere)                                                            \
    DOCUMENT(SET("BodySet",                                                                       \
                 BODY("a", "<components>" STATION("o", "1 2 3") STATION("x", "1 3 3")             \
                               STATION("y", "1 2 5") STATION("z", "1 4 3") frame "</components>") \
                     BODY("b", "<components>" elsewhere "</components>"))                         \
                 SET("JointSet", PIN("i", "/ground", "/bodyset/a", "p", "")                       \
                                     PIN("j", "/bodyset/a/f", "/bodyset/b", "q", "")))

/* Axis 1 along y of the body, axis 2 along y x z = x, and so the third along z. */
static void frames_that_stand_on_points(void **state) {
    (void)state;
    static const double plain[9] = {0, 1, 0, 1, 0, 0, 0, 0, -1};
    static const double turned[9] = {0, 0, -1, 0, -1, 0, -1, 0, 0};
    mhe_description *d =
        parse(ON_LANDMARKS(LANDMARKS("../o", "/bodyset/a/x", "../y", "../z", ""), ""));
    assert_int_equal(d->n_unsupported, 0);
    for (int i = 0; i < 9; i++) { /* x along ab, y along ab x ac */
        assert_near(d->bodies[1].joint_r[i], plain[i], 1e-15);
    }
    assert_near(d->bodies[1].joint_p[1], 4, 0);
    mhi_description_free(d);
    d = parse(ON_LANDMARKS(LANDMARKS("../o", "../x", "../y", "../o",
                                     "<ab_axis>-y</ab_axis><ab_x_ac_axis>-z</ab_x_ac_axis>"),
                           ""));
    for (int i = 0; i < 9; i++) {
        assert_near(d->bodies[1].joint_r[i], turned[i], 1e-15);
    }
    mhi_description_free(d);
    assert_refused(ON_LANDMARKS(LANDMARKS("../o", "../x", "../z", "../o", ""), ""),
                   "its points a, b, c lie on one line");
    assert_refused(
        ON_LANDMARKS(LANDMARKS("../o", "../x", "/bodyset/b/w", "../o", ""), STATION("w", "0 0 0")),
        "its points lie on several bodies");
    assert_refused(ON_LANDMARKS(LANDMARKS("../o", "../x", "../nowhere", "../o", ""), ""),
                   "its point_c '/bodyset/a/nowhere' is no Station or Marker");
}

#define TAUT(content)                                                         \
    "<GeometryPath name=\"path\"><PathPointSet><objects>" POINT("a", "0 0 0") \
        POINT("b", "1 0 0") "</objects></PathPointSet></GeometryPath>" content

static void ligaments_of_blankevoort(void **state) {
    (void)state;
    mhe_description *d = parse(DOCUMENT(CHAIN SET(
        "ForceSet",
        "<Blankevoort1991Ligament name=\"l\">" TAUT(
            "<slack_length>0.5</slack_length><linear_stiffness>2000</linear_stiffness>"
            "<transition_strain>0.06</transition_strain>") "</Blankevoort1991Ligament>")));
    const mhe_ligament *l = &d->ligaments[0];
    assert_int_equal(d->n_unsupported, 0);
    assert_near(l->rest, 0.5, 0);
    const double at[] = {0.5, 1, 1.03, 1.06, 1.16}, force[] = {0, 0, 15, 60, 260};
    for (int i = 0; i < 5; i++) {
        double out[3];
        mhi_function_derivatives(&l->curve, at[i], out);
        assert_near(l->scale * out[0], force[i], 1e-10);
    }
    mhi_description_free(d);
    assert_refused(DOCUMENT(CHAIN SET("ForceSet", "<Blankevoort1991Ligament name=\"l\">" TAUT(
                                                      "") "</Blankevoort1991Ligament>")),
                   "ligament 'l' needs a slack_length > 0");
}

#define ONE_MUSCLE(type, content) \
    DOCUMENT(CHAIN SET("ForceSet", "<" type " name=\"m\">" TAUT(content) "</" type ">\n"))

static void muscles_with_their_own_ways(void **state) {
    (void)state;
    mhe_description *d =
        parse(ONE_MUSCLE("DeGrooteFregly2016Muscle",
                         "<active_force_width_scale>1.5</active_force_width_scale>"
                         "<ignore_passive_fiber_force>true</ignore_passive_fiber_force>"));
    assert_int_equal(d->n_unsupported, 0);
    assert_near(d->muscles[0].active_shape, 1.5, 0);
    assert_true(isinf(d->muscles[0].passive_strain));
    mhi_description_free(d);
    assert_refused(ONE_MUSCLE("DeGrooteFregly2016Muscle",
                              "<active_force_width_scale>0.5</active_force_width_scale>"),
                   "active_force_width_scale 0.5 needs to be at least 1");
    /* a patellar ligament written as a muscle */
    d = parse(ONE_MUSCLE("Schutte1993Muscle",
                         "<activation1>0</activation1><activation2>0</activation2>"));
    assert_warned(d, "activation2 0, with which no activation ever falls");
    assert_true(isnan(d->muscles[0].activation_time));
    mhi_description_free(d);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_point_of_a_spline_twice),
                                       cmocka_unit_test(comments_and_ampersands_that_are_no_xml),
                                       cmocka_unit_test(bodies_and_joints_outside_of_their_sets),
                                       cmocka_unit_test(coordinates_of_one_name),
                                       cmocka_unit_test(inertias_that_no_body_has),
                                       cmocka_unit_test(frames_that_stand_on_points),
                                       cmocka_unit_test(ligaments_of_blankevoort),
                                       cmocka_unit_test(muscles_with_their_own_ways)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* .osim reader: layouts of OpenSim 3 and 4, joints, functions, muscles. */
#include "io/description_builder.h"
#include "io/model_file.h"
#include "support.h"

#include <math.h>
#include <string.h>

static mhe_description *parse(const char *text) {
    mhe_description *d = NULL;
    mhe_error err = {0};
    if (mhi_osim_parse("m.osim", text, strlen(text), &d, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    return d;
}

#define DOCUMENT(version, content)                                 \
    "<?xml version=\"1.0\"?>\n<OpenSimDocument Version=\"" version \
    "\">\n<Model name=\"test\">\n" content "</Model></OpenSimDocument>\n"
#define SET(name, content) "<" name "><objects>\n" content "</objects></" name ">\n"
#define BODY(name) "<Body name=\"" name "\"><mass>1</mass><inertia>1 1 1 0 0 0</inertia></Body>\n"
#define SOCKETS(parent, child)                                \
    "<socket_parent_frame>" parent "</socket_parent_frame>\n" \
    "<socket_child_frame>" child "</socket_child_frame>\n"
#define POINT(frame, at)                                                         \
    "<PathPoint name=\"p\"><socket_parent_frame>" frame "</socket_parent_frame>" \
    "<location>" at "</location></PathPoint>\n"

static void assert_vector(const double *v, double x, double y, double z) {
    if (!(fabs(v[0] - x) < 1e-14 && fabs(v[1] - y) < 1e-14 && fabs(v[2] - z) < 1e-14)) {
        fail_msg("(%.17g %.17g %.17g), expected (%.17g %.17g %.17g)", v[0], v[1], v[2], x, y, z);
    }
}

static void layout_of_opensim_4(void **state) {
    (void)state;
    mhe_description *d = parse(DOCUMENT(
        "40000",
        "<Ground name=\"ground\"/>\n" SET(
            "BodySet",
            "<Body name=\"arm\"><mass> 2 </mass><mass_center>0 -0.1 0</mass_center>"
            "<inertia>1 2 2.5 0.1 0.2 0.3</inertia><components>"
            "<PhysicalOffsetFrame name=\"tip\"><socket_parent>..</socket_parent>"
            "<translation>0 -0.3 0</translation></PhysicalOffsetFrame></components></Body>\n")
            SET("JointSet",
                "<PinJoint name=\"shoulder\">\n" SOCKETS(
                    "ground_offset",
                    "../shoulder/arm_offset") "<coordinates><Coordinate name=\"angle\"><!-- rad -->"
                                              "<default_value>0.5</"
                                              "default_value><default_speed_value>-1</"
                                              "default_speed_value>"
                                              "<range> -1 2 </range></Coordinate></coordinates>\n"
                                              "<frames><PhysicalOffsetFrame name=\"ground_offset\">"
                                              "<socket_parent>/ground</"
                                              "socket_parent><translation>1 2 3</translation>"
                                              "<orientation>0 0 "
                                              "1.5707963267948966</orientation></"
                                              "PhysicalOffsetFrame>\n"
                                              "<PhysicalOffsetFrame "
                                              "name=\"arm_offset\"><socket_parent>/bodyset/arm"
                                              "</socket_parent><translation>0 0.1 "
                                              "0</translation></PhysicalOffsetFrame>"
                                              "</frames></PinJoint>\n")
                SET("MarkerSet",
                    "<Marker name=\"T\"><socket_parent_frame>/bodyset/arm/tip</socket_parent_frame>"
                    "<location>0.01 0 0</location></Marker>\n"
                    "<Marker name=\"G\"><socket_parent_frame>/ground</socket_parent_frame>"
                    "<location>1 0 0</location></Marker>\n")));
    assert_string_equal(d->name, "test");
    assert_vector(d->gravity, 0, -9.80665, 0);
    const mhe_body *arm = &d->bodies[0];
    assert_int_equal(d->n_bodies, 1);
    assert_int_equal(arm->parent, -1);
    assert_vector(arm->joint_p, 1, 2, 3);
    assert_vector(&arm->joint_r[3], 1, 0, 0);
    assert_vector(arm->body_p, 0, -0.1, 0);
    assert_vector(arm->inertia, 1, 0.1, 0.2);
    assert_vector(&arm->inertia[6], 0.2, 0.3, 2.5);
    assert_int_equal(d->n_coordinates, 1);
    assert_true(d->coordinates[0].rotational == 1 && d->coordinates[0].value == 0.5 &&
                d->coordinates[0].speed == -1 && d->coordinates[0].lower == -1 &&
                d->coordinates[0].upper == 2);
    assert_vector(arm->motions[0].axis, 0, 0, 1);
    assert_vector(d->markers[0].location, 0.01, -0.3, 0);
    assert_int_equal(d->markers[0].body, 0);
    assert_int_equal(d->markers[1].body, -1);
    assert_int_equal(d->n_unsupported + d->n_warnings, 0);
    mhi_description_free(d);
}

static void layout_of_opensim_3(void **state) {
    (void)state;
    mhe_description *d = parse(DOCUMENT(
        "30000",
        "<defaults><Thelen2003Muscle name=\"default\"><KshapeActive>0.5</KshapeActive>"
        "<optimal_fiber_length>0.2</optimal_fiber_length></Thelen2003Muscle></defaults>\n"
        "<gravity>0 0 -9.8</gravity>\n" SET(
            "BodySet",
            "<Body name=\"ground\"><mass>0</mass><Joint/></Body>\n"
            "<Body name=\"arm\"><mass>2</mass><inertia_xx>1</inertia_xx><inertia_yy>1</inertia_yy>"
            "<inertia_zz>1.5</inertia_zz><inertia_xy>0.25</inertia_xy>\n"
            "<Joint><CustomJoint name=\"shoulder\"><parent_body>ground</parent_body>"
            "<location_in_parent>1 0 0</location_in_parent>"
            "<orientation_in_parent>0 0 0</orientation_in_parent><location>0 0.2 0</location>\n"
            "<CoordinateSet><objects><Coordinate name=\"angle\"><locked>false</locked>"
            "</Coordinate><Coordinate name=\"fixed\"><default_value>2</default_value>"
            "<locked>true</locked></Coordinate></objects></CoordinateSet>\n"
            "<SpatialTransform><TransformAxis name=\"rotation1\"><coordinates>angle</coordinates>"
            "<axis>0 0 2</axis><function><LinearFunction><coefficients>3 0.5</coefficients>"
            "</LinearFunction></function></TransformAxis>\n"
            "<TransformAxis name=\"translation2\"><coordinates>fixed</coordinates>"
            "<axis>0 1 0</axis><function><MultiplierFunction><function><PolynomialFunction>"
            "<coefficients>1 0 1</coefficients></PolynomialFunction></function>"
            "<scale>0.1</scale></MultiplierFunction></function></TransformAxis>\n"
            "</SpatialTransform></CustomJoint></Joint></Body>\n")
            SET("ForceSet", "<Thelen2003Muscle name=\"off\"><isDisabled>true</isDisabled>"
                            "</Thelen2003Muscle>\n"
                            "<Thelen2003Muscle name=\"on\"><isDisabled>false</isDisabled>"
                            "<GeometryPath><PathPointSet><objects>"
                            "<PathPoint name=\"a\"><location>0 0 0</location><body>ground</body>"
                            "</PathPoint><PathPoint name=\"b\"><location>0 1 0</location>"
                            "<body>arm</body></PathPoint></objects></PathPointSet></GeometryPath>"
                            "<max_isometric_force>600</max_isometric_force>"
                            "<tendon_slack_length>0.3</tendon_slack_length><Flen>1.8</Flen>"
                            "</Thelen2003Muscle>\n")));
    const mhe_body *arm = &d->bodies[0];
    assert_int_equal(d->n_bodies, 1);
    assert_vector(arm->body_p, 0, -0.2, 0);
    assert_vector(arm->inertia, 1, 0.25, 0);
    assert_int_equal(d->n_coordinates, 1);
    assert_true(d->coordinates[0].lower == -INFINITY && d->coordinates[0].upper == INFINITY);
    assert_int_equal(arm->n_motions, 2);
    /* the locked one stands at 0.1 (2 2 + 1) */
    assert_int_equal(arm->motions[0].kind, MHE_MOTION_TRANSLATION);
    assert_int_equal(arm->motions[0].coordinate, -1);
    assert_true(fabs(mhi_function_value(&arm->motions[0].function, 0) - 0.5) < 1e-15);
    assert_int_equal(arm->motions[1].coordinate, 0);
    assert_vector(arm->motions[1].axis, 0, 0, 1);
    assert_true(mhi_function_value(&arm->motions[1].function, 2) == 6.5);
    assert_int_equal(d->n_muscles, 1);
    const mhe_muscle *m = &d->muscles[0];
    assert_int_equal(m->type, MHE_MUSCLE_THELEN2003);
    assert_true(m->optimal_fiber_length == 0.2 && m->active_shape == 0.5 &&
                m->max_lengthening_force == 1.8 && m->pennation_angle == 0);
    assert_true(isnan(m->passive_shape) && isnan(m->activation_time));
    assert_int_equal(d->n_warnings, 1);
    assert_non_null(strstr(d->warnings[0], "Thelen2003Muscle 'off' is switched off: skipped"));
    assert_int_equal(d->n_unsupported, 0);
    mhi_description_free(d);
}

#define CUSTOM(function)                                                                         \
    DOCUMENT("40000",                                                                            \
             SET("BodySet", BODY("b"))                                                           \
                 SET("JointSet",                                                                 \
                     "<CustomJoint name=\"j\">" SOCKETS(                                         \
                         "/ground",                                                              \
                         "/bodyset/b") "<coordinates><Coordinate name=\"q\"/></coordinates>"     \
                                       "<SpatialTransform><TransformAxis name=\"translation1\">" \
                                       "<coordinates>q</coordinates><axis>1 0 0</axis>" function \
                                       "</TransformAxis></SpatialTransform></CustomJoint>\n"))

static void check_function(const char *text, const double (*points)[2], int n, double tolerance) {
    mhe_description *d = parse(text);
    assert_int_equal(d->bodies[0].n_motions, 1);
    assert_int_equal(d->coordinates[0].rotational, 0);
    for (int i = 0; i < n; i++) {
        double value = mhi_function_value(&d->bodies[0].motions[0].function, points[i][0]);
        if (!(fabs(value - points[i][1]) <= tolerance)) {
            fail_msg("f(%g) = %.17g, expected %.17g", points[i][0], value, points[i][1]);
        }
    }
    assert_int_equal(d->n_unsupported, 0);
    mhi_description_free(d);
}

/* Values from a dense solve of the spline's defining equations (both end third derivatives those of
 * the Lagrange cubic through the outer four points) in exact rational arithmetic. */
static void spline_values(void **state) {
    (void)state;
    const double points[][2] = {{-3, 2.0219563546818597},   {-1.8, -0.1862466800560936},
                                {-1, 0.03581496766546712},  {0, 0.3069317916746669},
                                {0.7, 0.43681813896008653}, {1, 0.9},
                                {2.5, 4.050221695041997},   {-2, 0.1}};
    check_function(CUSTOM("<SimmSpline name=\"function\"><x>-2 -1.5 -0.5 0.2 1</x>"
                          "<y>0.1 -0.3 0.4 0.25 0.9</y></SimmSpline>"),
                   points, 8, 1e-13);
    /* t^3 - t^2/2 + 2 t - 1 is kept inside; outside it goes straight on */
    const double cubic[][2] = {{-0.5, -2.25},
                               {0.3, -0.41800000000000004},
                               {1.7, 5.867999999999999},
                               {2.75, 21.515625},
                               {4.0, 53.5},
                               {-2.0, -10.5}};
    check_function(CUSTOM("<SimmSpline name=\"function\"><x>-1 0 1 2.5 3</x><y>-4.5 -1.0 1.5 16.5 "
                          "27.5</y></SimmSpline>"),
                   cubic, 6, 1e-13);
    const double line[][2] = {{-1, -1}, {0.5, 0.5}, {3, 3}};
    check_function(CUSTOM("<SimmSpline name=\"function\"><x>0 1</x><y>0 1</y></SimmSpline>"), line,
                   3, 0);
}

static void other_functions(void **state) {
    (void)state;
    const double cubic[][2] = {{0, 4}, {1, 10}, {-2, -2}};
    check_function(CUSTOM("<PolynomialFunction name=\"function\"><coefficients>1 2 3 4"
                          "</coefficients></PolynomialFunction>"),
                   cubic, 3, 0);
    const double broken[][2] = {{-1, -2}, {0.5, 1}, {1.5, 2.5}, {3, 4}};
    check_function(CUSTOM("<function><PiecewiseLinearFunction><x>0 1 2</x><y>0 2 3</y>"
                          "</PiecewiseLinearFunction></function>"),
                   broken, 4, 1e-15);
    const double identity[][2] = {{0.7, 0.7}};
    check_function(CUSTOM(""), identity, 1, 0);
}

#define PLAIN(type, extra)                                                                     \
    DOCUMENT("40000", SET("BodySet", BODY("b"))                                                \
                          SET("JointSet", "<" type " name=\"j\">" SOCKETS("ground", "b") extra \
                              "</" type ">\n"))

static void joints_of_fixed_kind(void **state) {
    (void)state;
    const struct {
        const char *text;
        int n;
        const char *kinds; /* R or T of the motions, in order */
        int coordinates[6];
    } cases[] = {{PLAIN("WeldJoint", ""), 0, "", {0}},
                 {PLAIN("PinJoint", ""), 1, "R", {0}},
                 {PLAIN("SliderJoint", ""), 1, "T", {0}},
                 {PLAIN("UniversalJoint", ""), 2, "RR", {0, 1}},
                 {PLAIN("GimbalJoint", ""), 3, "RRR", {0, 1, 2}},
                 {PLAIN("PlanarJoint", ""), 3, "TTR", {1, 2, 0}},
                 {PLAIN("FreeJoint", ""), 6, "TTTRRR", {3, 4, 5, 0, 1, 2}}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        mhe_description *d = parse(cases[i].text);
        assert_int_equal(d->n_coordinates, cases[i].n);
        assert_int_equal(d->bodies[0].n_motions, cases[i].n);
        for (int k = 0; k < cases[i].n; k++) {
            const mhe_motion *m = &d->bodies[0].motions[k];
            assert_int_equal(m->coordinate, cases[i].coordinates[k]);
            assert_int_equal(m->kind == MHE_MOTION_ROTATION, cases[i].kinds[k] == 'R');
            assert_int_equal(d->coordinates[m->coordinate].rotational, cases[i].kinds[k] == 'R');
        }
        assert_int_equal(d->n_unsupported, 0);
        mhi_description_free(d);
    }
}

static void bodies_come_after_their_parents(void **state) {
    (void)state;
    mhe_description *d = parse(DOCUMENT(
        "40000",
        SET("BodySet", BODY("hand") BODY("arm"))
            SET("JointSet", "<PinJoint name=\"wrist\">" SOCKETS(
                                "/bodyset/arm", "/bodyset/hand") "</PinJoint>\n<PinJoint "
                                                                 "name=\"shoulder\">" SOCKETS(
                                                                     "../ground", "/bodyset/"
                                                                                  "arm") "</"
                                                                                         "PinJo"
                                                                                         "int>"
                                                                                         "\n")));
    assert_string_equal(d->bodies[0].name, "arm");
    assert_string_equal(d->bodies[1].name, "hand");
    assert_int_equal(d->bodies[1].parent, 0);
    assert_string_equal(d->coordinates[0].name, "wrist_coord_0");
    mhi_description_free(d);
}

static void muscles_of_opensim_4_5(void **state) {
    (void)state;
    mhe_description *d = parse(DOCUMENT(
        "40500", SET("BodySet", BODY("b")) SET(
                     "JointSet", "<PinJoint name=\"j\">" SOCKETS("ground", "b") "</PinJoint>\n")
                     SET("ForceSet",
                         "<DeGrooteFregly2016Muscle name=\"m\"><GeometryPath name=\"path\">"
                         "<PathPointSet><objects>" POINT("/ground", "0 1 0") POINT(
                             "/bodyset/b",
                             "0 0 1") "</objects></PathPointSet></GeometryPath>"
                                      "<max_isometric_force>100</max_isometric_force>"
                                      "<pennation_angle_at_optimal>0.1</pennation_angle_at_optimal>"
                                      "<activation_time_constant>0.015</activation_time_constant>"
                                      "<passive_fiber_strain_at_one_norm_force>0.7"
                                      "</passive_fiber_strain_at_one_norm_force></"
                                      "DeGrooteFregly2016Muscle>\n")));
    const mhe_muscle *m = &d->muscles[0];
    assert_int_equal(m->type, MHE_MUSCLE_DEGROOTE2016);
    assert_int_equal(d->paths[0].n_points, 2);
    assert_true(m->activation_time == 0.015 && m->passive_strain == 0.7 &&
                m->pennation_angle == 0.1 && isnan(m->deactivation_time));
    assert_true(m->optimal_fiber_length == 0.1 && m->tendon_slack_length == 0.2);
    assert_int_equal(d->n_warnings, 2); /* the two defaults above */
    assert_non_null(strstr(d->warnings[0], "has no optimal_fiber_length: OpenSim's default 0.1"));
    mhi_description_free(d);
}

/* What a file leaves out, and OpenSim takes as 0, is told with its place. */
static void what_is_left_out_is_told(void **state) {
    (void)state;
    mhe_description *d = parse(DOCUMENT(
        "40500",
        SET("BodySet", "<Body name=\"b\"><inertia>1 1 1 0 0 0</inertia></Body>\n")
            SET("JointSet", "<PinJoint name=\"j\">" SOCKETS("ground", "b") "</PinJoint>\n")
                SET("MarkerSet", "<Marker name=\"knee\"><socket_parent_frame>/bodyset/b"
                                 "</socket_parent_frame></Marker>\n")
                    SET("ForceSet",
                        "<PathSpring name=\"s\"><resting_length>1</resting_length>"
                        "<stiffness>1</stiffness><GeometryPath><PathPointSet><objects>"
                        "<PathPoint name=\"p\"><socket_parent_frame>/bodyset/b"
                        "</socket_parent_frame></PathPoint>" POINT(
                            "/ground",
                            "0 1 0") "</objects></PathPointSet></GeometryPath></PathSpring>\n")));
    static const char *const told[] = {
        "body 'b' has no mass: as in OpenSim it is 0",
        "Marker 'knee' has no location: as in OpenSim it lies at 0 0 0 of its frame",
        "PathPoint 'p' has no location"};
    for (size_t k = 0; k < sizeof told / sizeof *told; k++) {
        int32_t found = 0;
        for (int32_t i = 0; i < d->n_warnings; i++) {
            found += strstr(d->warnings[i], told[k]) != NULL &&
                     strncmp(d->warnings[i], "m.osim:", 7) == 0;
        }
        if (found != 1) {
            fail_msg("'%s' is told %d times", told[k], (int)found);
        }
    }
    assert_int_equal(d->n_markers, 1);
    mhi_description_free(d);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(layout_of_opensim_4),    cmocka_unit_test(layout_of_opensim_3),
        cmocka_unit_test(spline_values),          cmocka_unit_test(other_functions),
        cmocka_unit_test(joints_of_fixed_kind),   cmocka_unit_test(bodies_come_after_their_parents),
        cmocka_unit_test(muscles_of_opensim_4_5), cmocka_unit_test(what_is_left_out_is_told)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

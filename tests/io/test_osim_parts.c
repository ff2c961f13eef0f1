/* SPDX-License-Identifier: Apache-2.0 */
/* .osim reader: couplers, moving and conditional points, wraps, splines, joints on ellipsoids, and
 * what locking makes of them. */
#include "base/pi.h"
#include "io/description_builder.h"
#include "osim_text.h"

/* r = 3 (2 p + 0.25), listed before what it depends on: q = 2 p + 0.25 */
#define COUPLED                                                                       \
    SET("ConstraintSet",                                                              \
        COUPLER("second", "q", "r", LINE("1", "0"), "<scale_factor>3</scale_factor>") \
            COUPLER("first", "p", "q", LINE("2", "0.25"), ""))

static void couplers_become_a_chain_of_dependents(void **state) {
    (void)state;
    mhe_description *d = parse(DOCUMENT(CHAIN COUPLED));
    assert_int_equal(d->n_coordinates, 1);
    assert_int_equal(d->n_dependents, 2);
    assert_string_equal(d->dependents[0].coordinate.name, "q");
    assert_string_equal(d->dependents[1].coordinate.name, "r");
    assert_int_equal(d->dependents[0].independent, 0);
    assert_int_equal(d->dependents[1].independent, 1);
    assert_near(mhi_function_value(&d->dependents[0].function, 0.5), 1.25, 0);
    assert_near(mhi_function_value(&d->dependents[1].function, 1.25), 3.75, 0);
    assert_int_equal(d->bodies[2].motions[0].coordinate, 2);
    assert_int_equal(d->n_unsupported, 0);
    mhi_description_free(d);
}

static void what_follows_a_locked_coordinate_is_constant(void **state) {
    (void)state;
    const char *text = DOCUMENT(CHAIN_WITH(LOCKED, "", "", "") COUPLED);
    mhe_description *d = parse(text);
    assert_int_equal(d->n_coordinates + d->n_dependents, 0);
    assert_int_equal(d->n_constants, 3);
    const char *const names[] = {"p", "q", "r"};
    const double values[] = {0.5, 1.25, 3.75};
    for (int i = 0; i < 3; i++) {
        assert_string_equal(d->constants[i].name, names[i]);
        assert_near(d->constants[i].value, values[i], 0);
        assert_int_equal(d->constants[i].body, i);
        assert_int_equal(d->bodies[i].motions[0].coordinate, -1);
        assert_near(mhi_function_value(&d->bodies[i].motions[0].function, 9), values[i], 0);
    }
    mhi_description_free(d);
    d = parse_with(mhi_osim_parse_unlocked, text);
    assert_int_equal(d->n_coordinates, 1);
    assert_int_equal(d->n_dependents, 2);
    assert_int_equal(d->n_constants, 0);
    mhi_description_free(d);
}

#define MUSCLE(points, path)                                                                    \
    SET("ForceSet", "<Thelen2003Muscle name=\"m\"><GeometryPath><PathPointSet><objects>" points \
                    "</objects></PathPointSet>" path "</GeometryPath></Thelen2003Muscle>\n")
#define MOVING                                                                           \
    "<MovingPathPoint>" FRAME(                                                           \
        "b") "<socket_x_coordinate>/jointset/j/q</socket_x_coordinate>"                  \
             "<socket_y_coordinate>/jointset/k/r</socket_y_coordinate>"                  \
             "<SimmSpline name=\"x_location\"><x>0 1</x><y>1 2</y>"                      \
             "</SimmSpline><y_location>" LINE(                                           \
                 "1", "0.5") "</y_location>"                                             \
                             "<Constant name=\"z_location\"><value>7</value></Constant>" \
                             "</MovingPathPoint>\n"
#define CONDITIONAL                                                                            \
    "<ConditionalPathPoint>" FRAME("c") "<socket_coordinate>/jointset/k/r</socket_coordinate>" \
                                        "<range>-1 0.25</range></ConditionalPathPoint>\n"

static void points_that_move_and_come_and_go(void **state) {
    (void)state;
    mhe_description *d = parse(
        DOCUMENT(CHAIN MUSCLE(POINT("a", "0 0 0") MOVING CONDITIONAL POINT("c", "1 0 0"), "")));
    const mhe_path *path = &d->paths[0];
    assert_int_equal(path->n_points, 4);
    const mhe_path_point *moving = &path->points[1], *conditional = &path->points[2];
    assert_int_equal(moving->kind, MHE_POINT_MOVING);
    assert_int_equal(moving->coordinate[0], 1);
    assert_int_equal(moving->coordinate[1], 2);
    assert_int_equal(moving->coordinate[2], -1);
    assert_near(mhi_function_value(&moving->function[0], 0.5), 1.5, 0);
    assert_near(mhi_function_value(&moving->function[1], 2), 2.5, 0);
    assert_near(moving->location[2], 7, 0);
    assert_int_equal(conditional->kind, MHE_POINT_CONDITIONAL);
    assert_int_equal(conditional->coordinate[0], 2);
    assert_near(conditional->lower, -1, 1.0001e-5); /* OpenSim's margin */
    assert_near(conditional->upper, 0.25, 1.0001e-5);
    assert_int_equal(d->n_unsupported, 0);
    mhi_description_free(d);
}

/* r stands at 0.5: out of the conditional point's range, and the moving point's y is 1 for good. */
static void points_of_locked_coordinates_stand_still(void **state) {
    (void)state;
    mhe_description *d = parse(DOCUMENT(CHAIN_WITH("", "", LOCKED, "") MUSCLE(
        POINT("a", "0 0 0") MOVING CONDITIONAL POINT("c", "1 0 0"), "")));
    const mhe_path *path = &d->paths[0];
    assert_int_equal(path->n_points, 3);
    assert_int_equal(path->points[1].kind, MHE_POINT_MOVING);
    assert_int_equal(path->points[1].coordinate[0], 1);
    assert_int_equal(path->points[1].coordinate[1], -1);
    assert_near(path->points[1].location[1], 1, 0);
    assert_near(path->points[2].location[0], 1, 0);
    mhi_description_free(d);
}

#define WRAPS                                                                                     \
    "<WrapObjectSet><objects>"                                                                    \
    "<WrapCylinder name=\"round\"><active>true</active><radius>0.02</radius><length>0.3</length>" \
    "<quadrant>-y</quadrant><xyz_body_rotation>0 0 1.5707963267948966</xyz_body_rotation>"        \
    "<translation>1 2 3</translation></WrapCylinder>"                                             \
    "<WrapTorus name=\"off\"><active>false</active><inner_radius>0</inner_radius></WrapTorus>"    \
    "<WrapEllipsoid name=\"egg\"><dimensions>1 2 3</dimensions><quadrant>all</quadrant>"          \
    "</WrapEllipsoid><WrapSphere name=\"unused\"><radius>-1</radius></WrapSphere>"                \
    "</objects></WrapObjectSet>"
#define AROUND(object, extra) "<PathWrap><wrap_object>" object "</wrap_object>" extra "</PathWrap>"

static void wraps_in_their_order(void **state) {
    (void)state;
    mhe_description *d = parse(DOCUMENT(CHAIN_WITH("", "", "", WRAPS) MUSCLE(
        POINT("a", "0 0 0") POINT("b", "0 0 0") POINT("c", "1 0 0"),
        "<PathWrapSet><objects>" AROUND("egg", "<method>axial</method><range>2 3</range>")
            AROUND("off", "") AROUND("round", "<range>-1 -1</range>") "</objects></PathWrapSet>")));
    const mhe_path *path = &d->paths[0];
    assert_int_equal(path->n_wraps, 2); /* one is inactive */
    assert_int_equal(d->n_obstacles, 2);
    const mhe_obstacle *first = &d->obstacles[path->wraps[0].obstacle];
    const mhe_obstacle *second = &d->obstacles[path->wraps[1].obstacle];
    assert_string_equal(first->name, "egg");
    assert_true(first->kind == MHE_OBSTACLE_ELLIPSOID && first->size[2] == 3);
    assert_int_equal(first->side_axis, -1);
    assert_int_equal(path->wraps[0].method, MHE_WRAP_AXIAL);
    assert_int_equal(path->wraps[0].first, 1);
    assert_int_equal(path->wraps[0].last, 2);
    assert_string_equal(second->name, "round");
    assert_true(second->side_axis == 1 && second->side_sign == -1 && second->body == 0);
    assert_true(second->size[0] == 0.02 && second->size[1] == 0.3 && second->p[2] == 3);
    assert_near(second->r[3], 1, 1e-15);
    assert_int_equal(path->wraps[1].first, -1);
    assert_int_equal(d->n_unsupported, 0);
    mhi_description_free(d);
}

#define CUSTOM(function)                                                                        \
    DOCUMENT(SET("BodySet", BODY("b", "")) SET(                                                 \
        "JointSet",                                                                             \
        "<CustomJoint name=\"j\">" SOCKETS("/ground", "/bodyset/b") "<coordinates>" COORDINATE( \
            "q", "") "</coordinates><SpatialTransform><TransformAxis name=\"translation1\">"    \
                     "<coordinates>q</coordinates><axis>1 0 0</axis>" function                  \
                     "</TransformAxis></SpatialTransform></CustomJoint>\n"))

static double slope(const mhe_function *f, double t, int order) {
    double h = 1e-3, sum = 0;
    static const double weights[4][4] = {{1}, {-1, 1}, {1, -2, 1}, {-1, 3, -3, 1}};
    for (int k = 0; k <= order; k++) {
        sum += weights[order][k] * mhi_function_value(f, t + (k - order / 2.0) * h);
    }
    return sum / pow(h, order);
}

/* Order 2: the natural cubic, here through points of which it is known in closed form: with points
 * (0 0) (1 1) (2 0) (3 1) the slopes solve [2 1; 1 4 1; 1 4 1; 1 2] s = 3 [1 0 0 1]'. */
static void splines_of_every_order(void **state) {
    (void)state;
    mhe_description *d = parse(CUSTOM("<GCVSpline name=\"function\"><half_order>2</half_order>"
                                      "<x>0 1 2 3</x><y>0 1 0 1</y></GCVSpline>"));
    const mhe_function *f = &d->bodies[0].motions[0].function;
    assert_near(mhi_function_value(f, 1), 1, 1e-14);
    assert_near(mhi_function_value(f, 2), 0, 1e-14);
    /* slopes s0 = s3 = 5/3, s1 = s2 = -1/3: Hermite at 1/2: 1/2 + (s0 - s1) / 8 */
    assert_near(mhi_function_value(f, 0.5), 0.5 + 2.0 / 8, 1e-14);
    assert_near(mhi_function_value(f, -1), -5.0 / 3, 1e-14);
    assert_near(mhi_function_value(f, 5), 1 + 2 * 5.0 / 3, 1e-14);
    mhi_description_free(d);
    /* any order: a polynomial of degree half_order - 1 is its own spline, inside and beyond; and
     * the quintic's derivatives 3 vanish at the ends */
    d = parse(CUSTOM("<GCVSpline name=\"function\"><half_order>3</half_order>"
                     "<x>-1 0 0.5 2 3 4.5 5</x><y>2 1 1.25 5 10 21.25 26</y></GCVSpline>"));
    f = &d->bodies[0].motions[0].function;
    for (double t = -3; t < 8; t += 0.37) {
        assert_near(mhi_function_value(f, t), t * t + 1, 1e-12 * (1 + t * t));
    }
    mhi_description_free(d);
    d = parse(CUSTOM("<GCVSpline name=\"function\"><half_order>3</half_order>"
                     "<x>-1 0 0.5 2 3 4.5 5</x><y>2 -1 1.5 -3 1 0.25 2</y></GCVSpline>"));
    f = &d->bodies[0].motions[0].function;
    const double knots[] = {-1, 0, 0.5, 2, 3, 4.5, 5};
    const double values[] = {2, -1, 1.5, -3, 1, 0.25, 2};
    for (int i = 0; i < 7; i++) { /* through the points, with two continuous derivatives and more */
        assert_near(mhi_function_value(f, knots[i]), values[i], 1e-12);
        assert_near(slope(f, knots[i] + 2e-3, 3), slope(f, knots[i] - 2e-3, 3), 3);
    }
    assert_near(slope(f, -1 + 2e-3, 3), 0, 1);
    mhi_description_free(d);
}

/* Where the chain of motions puts the body's origin. */
static void origin(const mhe_body *body, const double *q, double out[3]) {
    mhi_transform x = mhi_transform_identity(), part;
    for (int32_t k = 0; k < body->n_motions; k++) {
        const mhe_motion *m = &body->motions[k];
        double value = mhi_function_value(&m->function, m->coordinate < 0 ? 0 : q[m->coordinate]);
        part = mhi_transform_identity();
        if (m->kind == MHE_MOTION_TRANSLATION) {
            for (int i = 0; i < 3; i++) {
                part.p[i] = value * m->axis[i];
            }
        } else { /* axes of the frame */
            const double angles[3] = {value * m->axis[0], value * m->axis[1], value * m->axis[2]};
            mhi_rotation_sequence("xyz", angles, part.r);
        }
        x = mhi_transform_times(&x, &part);
    }
    memcpy(out, x.p, sizeof x.p);
}

static void an_ellipsoid_joint_slides_on_its_ellipsoid(void **state) {
    (void)state;
    const struct {
        const char *radii;
        double r[3];
    } cases[] = {{"0.1 0.2 0.4", {0.1, 0.2, 0.4}},
                 {"0.3 0.2 0.2", {0.3, 0.2, 0.2}},
                 {"0.2 0.2 0.2", {0.2, 0.2, 0.2}}};
    char text[2048];
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        (void)snprintf(
            text, sizeof text,
            DOCUMENT(SET("BodySet", BODY("b", "")) SET(
                "JointSet", "<EllipsoidJoint name=\"j\">" SOCKETS(
                                "ground", "b") "<radii_x_y_z>%s</radii_x_y_z></EllipsoidJoint>\n")),
            cases[i].radii);
        mhe_description *d = parse(text);
        assert_int_equal(d->n_coordinates, 3);
        for (double a = -2; a < 2; a += 0.7) {
            for (double b = -1.4; b < 1.5; b += 0.6) {
                const double q[3] = {a, b, 0.8}, *r = cases[i].r;
                double at[3];
                origin(&d->bodies[0], q, at);
                assert_near(at[0], r[0] * sin(b), 1e-15);
                assert_near(at[1], -r[1] * sin(a) * cos(b), 1e-15);
                assert_near(at[2], r[2] * cos(a) * cos(b), 1e-15);
            }
        }
        mhi_description_free(d);
    }
}

/* Child and parent exchanged: the same place of b seen from a. */
static void joints_drawn_the_other_way_round(void **state) {
    (void)state;
    mhe_description *d = parse(DOCUMENT(SET("BodySet", BODY("a", "") BODY("b", "")) SET(
        "JointSet",
        PIN("i", "/ground", "/bodyset/a", "p", "") PIN("j", "/bodyset/b", "/bodyset/a", "q", ""))));
    assert_int_equal(d->n_unsupported, 0);
    assert_int_equal(d->bodies[1].parent, 0);
    assert_near(mhi_function_value(&d->bodies[1].motions[0].function, 0.3), -0.3, 0);
    mhi_description_free(d);
}

static void a_body_without_joint_floats(void **state) {
    (void)state;
    mhe_description *d = parse(DOCUMENT(SET("BodySet", BODY("b", ""))));
    assert_int_equal(d->n_coordinates, 6);
    assert_string_equal(d->coordinates[0].name, "free_b_coord_0");
    assert_int_equal(d->n_warnings, 1);
    mhi_description_free(d);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(couplers_become_a_chain_of_dependents),
        cmocka_unit_test(what_follows_a_locked_coordinate_is_constant),
        cmocka_unit_test(points_that_move_and_come_and_go),
        cmocka_unit_test(points_of_locked_coordinates_stand_still),
        cmocka_unit_test(wraps_in_their_order),
        cmocka_unit_test(splines_of_every_order),
        cmocka_unit_test(an_ellipsoid_joint_slides_on_its_ellipsoid),
        cmocka_unit_test(joints_drawn_the_other_way_round),
        cmocka_unit_test(a_body_without_joint_floats)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* .osim reader: forces, lengths by polynomials, muscles' curves; layouts of OpenSim 3 and 4. */
#include "base/pi.h"
#include "io/description_builder.h"
#include "osim_text.h"

#define LIMIT                                                                                  \
    "<CoordinateLimitForce name=\"l\"><coordinate>p</coordinate><upper_limit>90</upper_limit>" \
    "<lower_limit>-45</lower_limit><upper_stiffness>2</upper_stiffness><lower_stiffness>1"     \
    "</lower_stiffness><damping>0.5</damping><transition>10</transition></CoordinateLimitForce>\n"

static void forces_in_their_units(void **state) {
    (void)state;
    mhe_description *d = parse(DOCUMENT(CHAIN SET(
        "ForceSet", LIMIT
        "<SpringGeneralizedForce name=\"s\"><coordinate>q</coordinate><stiffness>3</stiffness>"
        "<rest_length>0.2</rest_length><viscosity>0.1</viscosity></SpringGeneralizedForce>\n"
        "<CoordinateActuator name=\"t\"><coordinate>r</coordinate><optimal_force>100"
        "</optimal_force><min_control>-inf</min_control><max_control>inf</max_control>"
        "</CoordinateActuator>\n"
        "<Ligament name=\"g\"><GeometryPath><PathPointSet><objects>" POINT("a", "0 0 0") POINT(
            "c", "1 0 0") "</objects></PathPointSet></GeometryPath><resting_length>0.4"
                          "</resting_length><pcsa_force>50</pcsa_force></Ligament>\n"
                          "<BushingForce name=\"h\"><body_1>a</body_1><location_body_1>0 1 "
                          "0</location_body_1>"
                          "<body_2>b</body_2><orientation_body_2>0 0 0.5</orientation_body_2>"
                          "<rotational_stiffness>1 2 3</rotational_stiffness></BushingForce>\n"
                          "<HuntCrossleyForce name=\"contact\"/>\n")));
    const double degree = MHI_PI / 180;
    assert_near(d->limits[0].upper, MHI_PI / 2, 1e-15);
    assert_near(d->limits[0].lower_stiffness, 1 / degree, 1e-12);
    assert_near(d->limits[0].damping, 0.5 / degree, 1e-12);
    assert_near(d->limits[0].transition, 10 * degree, 1e-15);
    assert_int_equal(d->coordinate_springs[0].coordinate, 1);
    assert_true(d->actuators[0].optimal_force == 100 && d->actuators[0].max_control == INFINITY);
    assert_int_equal(d->ligaments[0].path, 0);
    assert_int_equal(d->n_paths, 1);
    assert_near(mhi_function_value(&d->ligaments[0].curve, 1.2), 0.12, 1e-15);
    assert_near(mhi_function_value(&d->ligaments[0].curve, 0.9985), 0, 1e-3);
    assert_true(d->bushings[0].body[1] == 1 && d->bushings[0].p[0][1] == 1);
    assert_near(d->bushings[0].r[1][3], sin(0.5), 1e-15);
    assert_int_equal(d->n_dropped, 2); /* and the actuator */
    assert_non_null(strstr(d->dropped[0], "HuntCrossleyForce 'contact': contact and prescribed"));
    mhi_description_free(d);
}

/* 1 + 2 q + 3 q^2 + 4 p + 5 p q + 6 p^2 in OpenSim's order, the first coordinate slowest */
static void paths_given_as_polynomials(void **state) {
    (void)state;
    const char *text = DOCUMENT(CHAIN SET(
        "ForceSet", "<Thelen2003Muscle name=\"m\"><FunctionBasedPath name=\"path\">"
                    "<coordinate_paths>/jointset/i/p /jointset/j/q</coordinate_paths>"
                    "<MultivariatePolynomialFunction name=\"length_function\"><coefficients>"
                    "1 2 3 4 5 6</coefficients><dimension>2</dimension><order>2</order>"
                    "</MultivariatePolynomialFunction></FunctionBasedPath></Thelen2003Muscle>\n"));
    mhe_description *d = parse(text);
    const mhe_polynomial *f = d->paths[0].length;
    const uint8_t expected[6][2] = {{0, 0}, {0, 1}, {0, 2}, {1, 0}, {1, 1}, {2, 0}};
    assert_non_null(f);
    assert_int_equal(f->n_terms, 6);
    assert_memory_equal(f->exponent, expected, sizeof expected);
    const double at[] = {0.5, NAN, NAN}; /* p = 0.5: 1 + 2 + 1.5, 2 + 2.5, 3 */
    double total[3] = {0};
    mhe_error err = {0};
    assert_int_equal(mhi_description_lock(d, at, &err), MHE_OK);
    f = d->paths[0].length;
    assert_int_equal(f->n, 1);
    assert_int_equal(f->coordinate[0], 0);
    for (int t = 0; t < f->n_terms; t++) {
        total[f->exponent[t]] += f->coef[t];
    }
    assert_near(total[0], 4.5, 1e-15);
    assert_near(total[1], 4.5, 1e-15);
    assert_near(total[2], 3, 1e-15);
    mhi_description_free(d);
}

static void muscle_curves_of_the_file(void **state) {
    (void)state;
    mhe_description *d = parse(DOCUMENT(
        "<defaults><Millard2012EquilibriumMuscle name=\"default\"><ignore_tendon_compliance>true"
        "</ignore_tendon_compliance><TendonForceLengthCurve><curviness>0.4</curviness>"
        "</TendonForceLengthCurve></Millard2012EquilibriumMuscle></defaults>\n" CHAIN SET(
            "ForceSet",
            "<Millard2012EquilibriumMuscle name=\"m\"><GeometryPath><PathPointSet><objects>" POINT(
                "a", "0 0 0")
                POINT(
                    "c",
                    "1 0 0") "</objects></PathPointSet></"
                             "GeometryPath><ForceVelocityCurve><isometric_slope>6"
                             "</isometric_slope></ForceVelocityCurve><min_control>0.02</"
                             "min_control>"
                             "<max_contraction_velocity>0</max_contraction_velocity>"
                             "</Millard2012EquilibriumMuscle>\n"
                             "<Schutte1993Muscle_Deprecated "
                             "name=\"s\"><GeometryPath><PathPointSet><objects>" POINT("a", "0 0 0")
                                 POINT(
                                     "c",
                                     "1 0 0") "</objects></PathPointSet></"
                                              "GeometryPath><active_force_length_curve><SimmSpline>"
                                              "<x>0 1 2</x><y>0 1 "
                                              "0</y></SimmSpline></active_force_length_curve>"
                                              "<SimmSpline "
                                              "name=\"passive_force_length_curve\"><x>0 1</x><y>0 "
                                              "2</y></SimmSpline>"
                                              "<tendon_force_length_curve>" LINE(
                                                  "3", "0") "</tendon_force_length_curve>"
                                                            "</Schutte1993Muscle_Deprecated>\n")));
    const mhe_muscle *m = &d->muscles[0], *s = &d->muscles[1];
    assert_true(m->millard.isometric_slope == 6 && m->millard.tendon_curviness == 0.4);
    assert_true(isnan(m->millard.minimum_value) && m->min_control == 0.02);
    assert_int_equal(m->ignore_tendon_compliance, 1);
    assert_int_equal(m->ignore_activation_dynamics, -1);
    assert_true(isnan(m->max_contraction_velocity)); /* 0 is no refusal */
    assert_int_equal(s->type, MHE_MUSCLE_SCHUTTE1993);
    assert_near(mhi_function_value(&s->active_force_length, 1), 1, 1e-15);
    assert_near(mhi_function_value(&s->passive_force_length, 0.5), 1, 1e-15);
    assert_near(mhi_function_value(&s->tendon_force_length, 0.5), 1.5, 0);
    assert_near(s->deactivation_time, 0.1 / 1.459854, 1e-15);
    assert_int_equal(d->n_unsupported, 0);
    mhi_description_free(d);
}

#define CONNECTOR(name, to)                                           \
    "<Connector_PhysicalFrame_ name=\"" name "\"><connectee_name>" to \
    "</connectee_name></Connector_PhysicalFrame_>"

/* 30501: the joint stands beside its bodies, its place in them in itself; forces among components.
 */
static void layouts_between_3_and_4(void **state) {
    (void)state;
    mhe_description *d = parse(DOCUMENT(SET("BodySet", BODY("a", "")) SET(
        "JointSet",
        "<PinJoint name=\"i\"><connectors>" CONNECTOR("parent_body", "../ground") CONNECTOR(
            "child_body",
            "../a") "</connectors><location_in_parent>1 2 3"
                    "</location_in_parent><location_in_child>0 0.5 "
                    "0</location_in_child></PinJoint>\n") "<components><IMU "
                                                          "name=\"u\"/><RigidTendonMuscle "
                                                          "name=\"m\"><GeometryPath><PathPointSet>"
                                                          "<objects>" POINT("a", "0 0 0") POINT(
                                                              "a",
                                                              "0 1 0") "</objects></PathPointSet></"
                                                                       "GeometryPath><force_"
                                                                       "velocity_curve><Constant><"
                                                                       "value>1</value>"
                                                                       "</Constant></"
                                                                       "force_velocity_curve></"
                                                                       "RigidTendonMuscle></"
                                                                       "components>\n"));
    assert_int_equal(d->bodies[0].parent, -1);
    assert_near(d->bodies[0].joint_p[2], 3, 0);
    assert_near(d->bodies[0].body_p[1], -0.5, 0);
    assert_int_equal(d->n_muscles, 1);
    assert_near(mhi_function_value(&d->muscles[0].passive_force_length, 1.3), 0.26, 1e-15);
    assert_near(mhi_function_value(&d->muscles[0].active_force_length, 1.045), 0.993333, 1e-15);
    assert_int_equal(d->n_unsupported, 0);
    mhi_description_free(d);
}

/* What OpenSim writes and XML with namespaces dislikes. */
static void names_with_colons(void **state) {
    (void)state;
    mhe_description *d = parse(DOCUMENT(CHAIN SET(
        "ProbeSet", "<Umberger2010::Probe name=\"u::v\"><a::b/></Umberger2010::Probe>\n")));
    assert_int_equal(d->n_coordinates, 3);
    assert_int_equal(d->n_dropped, 1);
    mhi_description_free(d);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(forces_in_their_units), cmocka_unit_test(paths_given_as_polynomials),
        cmocka_unit_test(muscle_curves_of_the_file), cmocka_unit_test(layouts_between_3_and_4),
        cmocka_unit_test(names_with_colons)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* Actuators of a model file as controls: what they do is their force times the speed of what they
 * push, within the file's bounds, with exact derivatives. */
#include "use.h"

#include "io/model_file.h"
#include "model/system.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define N_Q 4
#define N_A 4

#define BODY(name)                                                                      \
    "<Body name=\"" name "\"><mass>1.5</mass><mass_center>0.05 -0.1 0.02</mass_center>" \
    "<inertia>0.02 0.03 0.025 0 0 0</inertia></Body>\n"
#define COORDINATE(name) "<Coordinate name=\"" name "\"/>"
/* a on a ball joint, b on a pin of it, c on a pin of b that follows b's */
static const char *const text =
    "<OpenSimDocument Version=\"40000\"><Model name=\"m\"><gravity>0 -9.81 0</gravity>\n"
    "<BodySet><objects>" BODY("a") BODY("b") BODY(
        "c") "</objects></BodySet>\n"
             "<JointSet><objects><BallJoint "
             "name=\"j\"><socket_parent_frame>/ground</socket_parent_frame>"
             "<socket_child_frame>/bodyset/a</socket_child_frame><coordinates>" COORDINATE("x")
                 COORDINATE("y") COORDINATE(
                     "z") "</coordinates></BallJoint>\n"
                          "<PinJoint "
                          "name=\"k\"><socket_parent_frame>/bodyset/a</"
                          "socket_parent_frame><socket_child_frame>"
                          "/bodyset/b</socket_child_frame><coordinates>" COORDINATE(
                              "q") "</coordinates></PinJoint>\n"
                                   "<PinJoint "
                                   "name=\"l\"><socket_parent_frame>/bodyset/b</"
                                   "socket_parent_frame><socket_child_frame>"
                                   "/bodyset/c</socket_child_frame><coordinates>" COORDINATE(
                                       "s") "</coordinates></PinJoint>\n"
                                            "</objects></"
                                            "JointSet>\n<ConstraintSet><objects><"
                                            "CoordinateCouplerConstraint name=\"c\">"
                                            "<coupled_coordinates_function><PolynomialFunction><"
                                            "coefficients>0.3 0.5 0.1</coefficients>"
                                            "</PolynomialFunction></"
                                            "coupled_coordinates_function><independent_coordinate_"
                                            "names>q"
                                            "</"
                                            "independent_coordinate_names><dependent_coordinate_"
                                            "name>s</dependent_coordinate_name>"
                                            "</CoordinateCouplerConstraint></objects></"
                                            "ConstraintSet>\n<ForceSet><objects>"
                                            "<CoordinateActuator "
                                            "name=\"motor\"><coordinate>s</"
                                            "coordinate><optimal_force>7</optimal_force>"
                                            "<min_control>-2</min_control><max_control>3</"
                                            "max_control></CoordinateActuator>\n"
                                            "<TorqueActuator "
                                            "name=\"between\"><bodyA>b</bodyA><bodyB>a</"
                                            "bodyB><torque_is_global>false"
                                            "</torque_is_global><axis>0.6 0 "
                                            "0.8</axis><optimal_force>5</optimal_force></"
                                            "TorqueActuator>\n"
                                            "<TorqueActuator "
                                            "name=\"ground\"><bodyA>ground</bodyA><bodyB>c</"
                                            "bodyB><axis>0 1 0</axis>"
                                            "<optimal_force>4</optimal_force></TorqueActuator>\n"
                                            "<PointActuator name=\"push\"><body>c</body><point>0.1 "
                                            "-0.2 0.03</point><force_is_global>false"
                                            "</force_is_global><direction>0 0.6 "
                                            "0.8</direction><optimal_force>9</optimal_force>"
                                            "</PointActuator></objects></ForceSet></Model></"
                                            "OpenSimDocument>\n";

typedef struct rig {
    mhe_description *d;
    mhi_system *system;
    mhi_system_context *context;
    const mhe_system *face;
    const mhe_model_ops *model;
    void *self, *skeleton; /* beside the system's */
    const double *q, *v, *r;
} rig;

static void open_rig(rig *r, int32_t torques) {
    const mhe_plugin *model = test_plugin("mhe.model.simbody", MHE_MODEL_IFACE);
    const mhe_plugin *muscle = test_plugin("mhe.muscle.hill", MHE_MUSCLE_IFACE);
    mhe_error err = {0};
    if (model == NULL || muscle == NULL) {
        skip();
    }
    *r = (rig){.model = model->ops};
    if (mhi_osim_parse("m.osim", text, strlen(text), &r->d, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    const mhi_system_setup setup = {.host = test_host(),
                                    .description = r->d,
                                    .model = model,
                                    .model_config = test_config(model, ""),
                                    .muscle = muscle,
                                    .muscle_config = test_config(muscle, ""),
                                    .formulation = MHE_FORMULATION_EXCITATION,
                                    .residual_torques = torques,
                                    .actuators = 1};
    if (mhi_system_create(&setup, &r->system, &err) != MHE_OK ||
        mhi_system_context_create(r->system, &r->context, &err) != MHE_OK ||
        r->model->create(test_host(), r->d, test_config(model, ""), &r->self, &err) != MHE_OK ||
        r->model->context_create(r->self, &r->skeleton, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    r->face = mhi_system_face(r->system);
    assert_int_equal(r->face->n_q, N_Q);
    assert_int_equal(r->face->n_r, N_A + (torques ? N_Q : 0));
}

static void close_rig(rig *r) {
    r->model->context_destroy(r->skeleton);
    r->model->destroy(r->self);
    mhi_system_context_free(r->context);
    mhi_system_free(r->system);
    mhi_description_free(r->d);
}

static int accelerate(rig *r, const double *q, const double *v, const double *control,
                      const mhe_acceleration *out) {
    static const double none[1];
    const mhe_system_point at = {
        .size = sizeof at, .q = q, .v = v, .a = none, .c = none, .r = control};
    mhe_error err = {0};
    if (r->face->acceleration(r->face, r->context, &at, out, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    return 0;
}

/* Power of the actuators at `control`: M (vdot with them - vdot without), times v. */
static double power(rig *r, const double *q, const double *v, const double *control) {
    static const double none[N_A + N_Q];
    double mass[N_Q * N_Q], one[N_Q], two[N_Q], sum = 0;
    const mhe_kinematics out = {.size = sizeof out, .mass = mass};
    assert_int_equal(r->model->kinematics(r->skeleton, q, v, &out, NULL), MHE_OK);
    accelerate(r, q, v, control,
               &(mhe_acceleration){.size = sizeof(mhe_acceleration), .vdot = one});
    accelerate(r, q, v, none, &(mhe_acceleration){.size = sizeof(mhe_acceleration), .vdot = two});
    for (int i = 0; i < N_Q; i++) {
        for (int j = 0; j < N_Q; j++) {
            sum += v[i] * mass[i * N_Q + j] * (one[j] - two[j]);
        }
    }
    return sum;
}

/* Speeds of what the four push, by their optimal forces. */
static void pushed(rig *r, const double *q, const double *v, double speed[N_A]) {
    double body[36], body_q[18 * N_Q], move[18] = {0}, at[3];
    const mhe_kinematics out = {.size = sizeof out, .body = body, .body_q = body_q};
    assert_int_equal(r->model->kinematics(r->skeleton, q, v, &out, NULL), MHE_OK);
    for (int i = 0; i < 18; i++) {
        for (int j = 0; j < N_Q; j++) {
            move[i] += body_q[i * N_Q + j] * v[j];
        }
    }
    const double *a = move, *b = move + 6, *c = move + 12, *rb = body + 15, *rc = body + 27;
    speed[0] = 7 * (0.6 * q[3] + 0.5) * v[3];
    speed[1] = 0;
    for (int i = 0; i < 3; i++) {
        speed[1] += 5 * (0.6 * rb[3 * i] + 0.8 * rb[3 * i + 2]) * (b[i] - a[i]);
        at[i] = 0.1 * rc[3 * i] - 0.2 * rc[3 * i + 1] + 0.03 * rc[3 * i + 2];
    }
    speed[2] = -4 * c[1];
    const double velocity[3] = {c[3] + c[1] * at[2] - c[2] * at[1],
                                c[4] + c[2] * at[0] - c[0] * at[2],
                                c[5] + c[0] * at[1] - c[1] * at[0]};
    speed[3] = 0;
    for (int i = 0; i < 3; i++) {
        speed[3] += 9 * (0.6 * rc[3 * i + 1] + 0.8 * rc[3 * i + 2]) * velocity[i];
    }
}

static void random_state(uint64_t *seed, double *q, double *v) {
    for (int i = 0; i < N_Q; i++) {
        q[i] = test_random(seed, -0.8, 0.8);
        v[i] = test_random(seed, -2, 2);
    }
}

static void an_actuator_does_the_work_of_its_force(void **state) {
    (void)state;
    rig r;
    uint64_t seed = 61;
    open_rig(&r, 0);
    for (int i = 0; i < 10; i++) {
        double q[N_Q], v[N_Q], speed[N_A];
        random_state(&seed, q, v);
        pushed(&r, q, v, speed);
        for (int k = 0; k < N_A; k++) {
            double control[N_A] = {0};
            control[k] = test_random(&seed, -2, 2);
            const double expected = control[k] * speed[k];
            assert_true(fabs(power(&r, q, v, control) - expected) < 1e-11 * (1 + fabs(expected)));
        }
    }
    close_rig(&r);
}

static void controls_have_the_files_names_and_bounds(void **state) {
    (void)state;
    rig r;
    open_rig(&r, 1);
    const mhe_block *block = mhe_layout_find(r.face->layout, MHE_ROLE_CONTROL, "actuator");
    assert_non_null(block);
    assert_int_equal(block->count, N_A);
    assert_int_equal(block->first, r.face->n_m + N_Q); /* behind the residual torques */
    assert_string_equal(block->entry_names[0], "motor");
    assert_string_equal(block->entry_names[3], "push");
    assert_true(block->lower[0] == -2 && block->upper[0] == 3);
    assert_true(block->lower[1] == -INFINITY && block->upper[1] == INFINITY);
    close_rig(&r);
}

static int by_q(void *data, const double *q, double *y) {
    rig *r = data;
    return accelerate(r, q, r->v, r->r,
                      &(mhe_acceleration){.size = sizeof(mhe_acceleration), .vdot = y});
}
static int by_r(void *data, const double *control, double *y) {
    rig *r = data;
    return accelerate(r, r->q, r->v, control,
                      &(mhe_acceleration){.size = sizeof(mhe_acceleration), .vdot = y});
}

static void derivatives_are_exact(void **state) {
    (void)state;
    rig r;
    uint64_t seed = 62;
    double worst = 0;
    open_rig(&r, 1);
    for (int i = 0; i < 20; i++) {
        double q[N_Q], v[N_Q], control[N_Q + N_A], vdot[N_Q], vdot_q[N_Q * N_Q];
        double vdot_r[N_Q * (N_Q + N_A)];
        random_state(&seed, q, v);
        for (int k = 0; k < N_Q + N_A; k++) {
            control[k] = test_random(&seed, -2, 2);
        }
        r.q = q;
        r.v = v;
        r.r = control;
        accelerate(&r, q, v, control,
                   &(mhe_acceleration){.size = sizeof(mhe_acceleration),
                                       .vdot = vdot,
                                       .vdot_q = vdot_q,
                                       .vdot_r = vdot_r});
        worst = fmax(worst, test_jacobian_error(by_q, &r, q, N_Q, N_Q, vdot_q));
        worst = fmax(worst, test_jacobian_error(by_r, &r, control, N_Q + N_A, N_Q, vdot_r));
    }
    print_message("derivatives: %.1e\n", worst);
    assert_true(worst < 1e-7);
    close_rig(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_actuator_does_the_work_of_its_force),
        cmocka_unit_test(controls_have_the_files_names_and_bounds),
        cmocka_unit_test(derivatives_are_exact),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

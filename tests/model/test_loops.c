/* SPDX-License-Identifier: Apache-2.0 */
/* Loops: mechanisms that a PointConstraint or a WeldConstraint closes move as those that are built
 * without, the force that closes them is the joint's, and every derivative of the accelerations is
 * exact, with open loops too. */
#include "use.h"

#include "io/model_file.h"
#include "model/system.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DOCUMENT(content)                                                                         \
    "<OpenSimDocument Version=\"40000\"><Model name=\"m\"><gravity>0 -9.81 0</gravity>\n" content \
    "</Model></OpenSimDocument>\n"
#define SET(name, content) "<" name "><objects>\n" content "</objects></" name ">\n"
#define BODY(name, mass, com, inertia)                               \
    "<Body name=\"" name "\"><mass>" mass "</mass><mass_center>" com \
    "</mass_center><inertia>" inertia "</inertia></Body>\n"
#define FRAME(name, parent, at)                                                        \
    "<PhysicalOffsetFrame name=\"" name "\"><socket_parent>" parent "</socket_parent>" \
    "<translation>" at "</translation></PhysicalOffsetFrame>"
#define JOINT(kind, name, parent, child, at, coordinates)                                         \
    "<" kind " name=\"" name "\"><socket_parent_frame>p</socket_parent_frame>"                    \
    "<socket_child_frame>c</socket_child_frame><coordinates>" coordinates                         \
    "</coordinates><frames>" FRAME("p", parent, at) FRAME("c", child, "0 0 0") "</frames></" kind \
                                                                               ">\n"
#define COORDINATE(name) "<Coordinate name=\"" name "\"/>"
#define POINT(one, two, at_one, at_two)                                                           \
    SET("ConstraintSet",                                                                          \
        "<PointConstraint name=\"pin\"><socket_body_1>" one "</socket_body_1><socket_body_2>" two \
        "</socket_body_2><location_body_1>" at_one "</location_body_1><location_body_2>" at_two   \
        "</location_body_2></PointConstraint>")
#define WELD(one, two)                                                                            \
    SET("ConstraintSet",                                                                          \
        "<WeldConstraint name=\"weld\"><socket_frame1>" one "</socket_frame1><socket_frame2>" two \
        "</socket_frame2></WeldConstraint>")

/* a plate that can go anywhere in its plane, pinned to ground at its origin */
#define PLATE(constraint)                                                         \
    DOCUMENT(SET("BodySet", BODY("a", "2", "0.3 0 0", "0.1 0.1 0.05 0 0 0")) SET( \
        "JointSet", JOINT("PlanarJoint", "j", "/ground", "/bodyset/a", "0 0 0",   \
                          COORDINATE("r") COORDINATE("x") COORDINATE("y"))) constraint)
#define PLATE_INERTIA (0.05 + 2 * 0.3 * 0.3)

/* a pendulum, and a free body that is welded to it: together one heavier pendulum */
#define CARRIER BODY("a", "2", "0.3 0 0", "0.1 0.1 0.05 0 0 0")
#define CARRIED BODY("b", "1.5", "0.1 -0.2 0.05", "0.02 0.03 0.04 0 0 0")
#define PENDULUM JOINT("PinJoint", "j", "/ground", "/bodyset/a", "0 0 0", COORDINATE("r"))
#define FREE                                                                                   \
    JOINT("FreeJoint", "k", "/ground", "/bodyset/b", "0 0 0",                                  \
          COORDINATE("rx") COORDINATE("ry") COORDINATE("rz") COORDINATE("tx") COORDINATE("ty") \
              COORDINATE("tz"))

/* four bars: crank and rocker on ground, the coupler on the crank; a muscle over it */
#define BARS                                                                                    \
    SET("BodySet", BODY("crank", "0.8", "0.1 0 0", "0.01 0.01 0.01 0 0 0")                      \
                       BODY("coupler", "0.9", "0.2 0.05 0", "0.02 0.02 0.02 0 0 0")             \
                           BODY("rocker", "0.7", "0.15 0 0", "0.01 0.01 0.01 0 0 0"))           \
    SET("JointSet",                                                                             \
        JOINT("PinJoint", "j", "/ground", "/bodyset/crank", "0 0 0", COORDINATE("q1")) JOINT(   \
            "PinJoint", "k", "/bodyset/crank", "/bodyset/coupler", "0.2 0 0", COORDINATE("q2")) \
            JOINT("PinJoint", "l", "/ground", "/bodyset/rocker", "0.4 0 0", COORDINATE("q3")))
#define MUSCLE                                                                                   \
    SET("ForceSet",                                                                              \
        "<DeGrooteFregly2016Muscle name=\"m\"><GeometryPath><PathPointSet><objects>"             \
        "<PathPoint name=\"a\"><socket_parent_frame>/ground</socket_parent_frame>"               \
        "<location>-0.1 0.2 0.05</location></PathPoint><PathPoint "                              \
        "name=\"b\"><socket_parent_frame>"                                                       \
        "/bodyset/coupler</socket_parent_frame><location>0.25 0.03 0</location></PathPoint>"     \
        "</objects></PathPointSet></GeometryPath><max_isometric_force>300</max_isometric_force>" \
        "<optimal_fiber_length>0.3</optimal_fiber_length><tendon_slack_length>0.2"               \
        "</tendon_slack_length></DeGrooteFregly2016Muscle>")

typedef struct rig {
    mhe_description *d;
    mhi_system *system;
    mhi_system_context *context;
    const mhe_system *face;
    double control[1]; /* of the muscle, where there is one */
    double a[1];
    const double *vary; /* [n_q] the speeds, where positions are varied, and the other way round */
} rig;

static void open_rig(rig *r, const char *text, const char *model_yaml, int32_t torques) {
    const mhe_plugin *model = test_plugin("mhe.model.simbody", MHE_MODEL_IFACE);
    const mhe_plugin *muscle = test_plugin("mhe.muscle.hill", MHE_MUSCLE_IFACE);
    mhe_error err = {0};
    if (model == NULL || muscle == NULL) {
        skip();
    }
    *r = (rig){.a = {0.4}, .control = {0.4}};
    if (mhi_osim_parse("m.osim", text, strlen(text), &r->d, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    assert_int_equal(r->d->n_unsupported, 0);
    const mhi_system_setup setup = {.host = test_host(),
                                    .description = r->d,
                                    .model = model,
                                    .model_config = test_config(model, model_yaml),
                                    .muscle = muscle,
                                    .muscle_config = test_config(muscle, ""),
                                    .formulation = MHE_FORMULATION_EXCITATION,
                                    .residual_torques = torques};
    if (mhi_system_create(&setup, &r->system, &err) != MHE_OK ||
        mhi_system_context_create(r->system, &r->context, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    r->face = mhi_system_face(r->system);
}

static void close_rig(rig *r) {
    mhi_system_context_free(r->context);
    mhi_system_free(r->system);
    mhi_description_free(r->d);
}

static void accelerate(rig *r, const double *q, const double *v, const double *torque,
                       const mhe_acceleration *out) {
    const mhe_system_point at = {
        .size = sizeof at, .q = q, .v = v, .a = r->a, .c = r->control, .r = torque};
    mhe_error err = {0};
    if (r->face->acceleration(r->face, r->context, &at, out, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
}

static void assert_near(const char *what, double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance * (1 + fabs(expected)))) {
        fail_msg("%s: %.15g is not %.15g", what, value, expected);
    }
}

/* m g c cos r over the inertia about the pin; the pin's force is the mass times what its centre
 * lacks of falling. The loop has a row that nothing opens, out of the plane. */
static void a_pinned_plate_is_a_pendulum(void **state) {
    (void)state;
    rig r;
    uint64_t seed = 31;
    for (int simbody = 0; simbody < 2; simbody++) {
        open_rig(&r, PLATE(POINT("/ground", "/bodyset/a", "0 0 0", "0 0 0")),
                 simbody ? "dynamics: simbody" : "", 0);
        assert_int_equal(mhi_system_loop_rows(r.system), 3);
        for (int i = 0; i < 10; i++) {
            const double q[3] = {test_random(&seed, -3, 3), 0, 0};
            const double v[3] = {test_random(&seed, -3, 3), 0, 0};
            double vdot[3];
            accelerate(&r, q, v, NULL,
                       &(mhe_acceleration){.size = sizeof(mhe_acceleration), .vdot = vdot});
            const double turn = -2 * 9.81 * 0.3 * cos(q[0]) / PLATE_INERTIA;
            const double along[2] = {-v[0] * v[0] * 0.3, turn * 0.3}; /* of the centre, x' and y' */
            const double force[2] = {2 * (along[0] * cos(q[0]) - along[1] * sin(q[0])),
                                     2 * (along[0] * sin(q[0]) + along[1] * cos(q[0]) + 9.81)};
            assert_near("turn", vdot[0], turn, 1e-12);
            assert_near("x", vdot[1], 0, 1e-12);
            assert_near("y", vdot[2], 0, 1e-12);
            const double *lambda = mhi_system_loop_force(r.context);
            assert_near("force x", lambda[0], force[0], 1e-12);
            assert_near("force y", lambda[1], force[1], 1e-12);
            assert_near("force z", lambda[2], 0, 0);
        }
        close_rig(&r);
    }
}

static void a_welded_body_is_part_of_what_carries_it(void **state) {
    (void)state;
    rig open, one;
    uint64_t seed = 32;
    open_rig(&open,
             DOCUMENT(SET("BodySet", CARRIER CARRIED) SET("JointSet", PENDULUM FREE)
                          WELD("/bodyset/a", "/bodyset/b")),
             "", 0);
    open_rig(
        &one,
        DOCUMENT(SET("BodySet", CARRIER CARRIED) SET(
            "JointSet", PENDULUM JOINT("WeldJoint", "k", "/bodyset/a", "/bodyset/b", "0 0 0", ""))),
        "", 0);
    assert_int_equal(open.face->n_q, 7);
    assert_int_equal(one.face->n_q, 1);
    for (int i = 0; i < 10; i++) {
        double q[7] = {0}, v[7] = {0}, vdot[7], expected;
        q[0] = test_random(&seed, -1.2, 1.2);
        v[0] = test_random(&seed, -3, 3);
        q[3] = q[0]; /* rz */
        v[3] = v[0];
        accelerate(&open, q, v, NULL,
                   &(mhe_acceleration){.size = sizeof(mhe_acceleration), .vdot = vdot});
        accelerate(&one, q, v, NULL,
                   &(mhe_acceleration){.size = sizeof(mhe_acceleration), .vdot = &expected});
        assert_near("welded", vdot[0], expected, 1e-11);
        assert_near("carried", vdot[3], expected, 1e-11);
    }
    close_rig(&open);
    close_rig(&one);
}

/* Kinetic and potential energy of four bars whose loop is closed do not change: power 0. */
static void a_closed_linkage_keeps_its_energy(void **state) {
    (void)state;
    rig r;
    uint64_t seed = 33;
    open_rig(&r, DOCUMENT(BARS POINT("/bodyset/coupler", "/bodyset/rocker", "0.35 0 0", "0.3 0 0")),
             "", 0);
    for (int i = 0; i < 10; i++) {
        double q[3] = {test_random(&seed, 0.6, 1.4), -0.6, 1.6}, v[3], vdot[3];
        mhi_loop_state loop;
        for (int k = 0; k < 3; k++) {
            v[k] = test_random(&seed, -3, 3);
        }
        assert_int_equal(mhi_system_close_loops(r.context, q, v, NULL), MHE_OK);
        assert_int_equal(mhi_system_gaps(r.context, q, v, 0, &loop, NULL), MHE_OK);
        for (int k = 0; k < 3; k++) {
            assert_near("gap", loop.gap[k], 0, 1e-10);
            assert_near("rate", loop.rate[k], 0, 1e-9);
        }
        accelerate(&r, q, v, NULL,
                   &(mhe_acceleration){.size = sizeof(mhe_acceleration), .vdot = vdot});
        /* centres of mass and their accelerations, straight from the angles */
        const double m[3] = {0.8, 0.9, 0.7}, inertia[3] = {0.01, 0.02, 0.01};
        const double angle[3] = {q[0], q[0] + q[1], q[2]}, w[3] = {v[0], v[0] + v[1], v[2]};
        const double turn[3] = {vdot[0], vdot[0] + vdot[1], vdot[2]};
        const double local[3][2] = {{0.1, 0}, {0.2, 0.05}, {0.15, 0}};
        double power = 0, scale = 0;
        for (int k = 0; k < 3; k++) {
            double speed[2] = {0, 0}, a[2] = {0, 0};
            for (int on = k == 1 ? 0 : 1; on < 2; on++) { /* the crank's end carries the coupler */
                const int bar = on == 0 ? 0 : k;
                const double x = on == 0 ? 0.2 : local[k][0], y = on == 0 ? 0 : local[k][1];
                const double p[2] = {x * cos(angle[bar]) - y * sin(angle[bar]),
                                     x * sin(angle[bar]) + y * cos(angle[bar])};
                speed[0] += -w[bar] * p[1];
                speed[1] += w[bar] * p[0];
                a[0] += -turn[bar] * p[1] - w[bar] * w[bar] * p[0];
                a[1] += turn[bar] * p[0] - w[bar] * w[bar] * p[1];
            }
            power +=
                m[k] * (speed[0] * a[0] + speed[1] * (a[1] + 9.81)) + inertia[k] * w[k] * turn[k];
            scale += m[k] * 9.81 * hypot(speed[0], speed[1]);
        }
        assert_near("power", power / scale, 0, 1e-9);
    }
    close_rig(&r);
}

static int by_q(void *data, const double *q, double *y) {
    rig *r = data;
    static const double torque[3] = {0.4, -0.3, 0.2};
    accelerate(r, q, r->vary, torque,
               &(mhe_acceleration){.size = sizeof(mhe_acceleration), .vdot = y});
    return 0;
}
static int by_v(void *data, const double *v, double *y) {
    rig *r = data;
    static const double torque[3] = {0.4, -0.3, 0.2};
    accelerate(r, r->vary, v, torque,
               &(mhe_acceleration){.size = sizeof(mhe_acceleration), .vdot = y});
    return 0;
}

/* Anywhere: loops open and opening, too. By the activation and the residual torques they are
 * linear: compared with differences of two calls. */
static void derivatives_are_exact(void **state) {
    (void)state;
    rig r;
    uint64_t seed = 34;
    double worst = 0;
    open_rig(
        &r,
        DOCUMENT(BARS MUSCLE POINT("/bodyset/coupler", "/bodyset/rocker", "0.35 0 0", "0.3 0 0")),
        "", 1);
    for (int i = 0; i < 20; i++) {
        double q[3] = {test_random(&seed, 0.6, 1.4), -0.6, 1.6}, v[3], vdot[3], other[3];
        double vdot_q[9], vdot_v[9], vdot_a[3], vdot_r[9], torque[3] = {0.4, -0.3, 0.2};
        for (int k = 0; k < 3; k++) {
            q[k] += test_random(&seed, -0.1, 0.1);
            v[k] = test_random(&seed, -2, 2);
        }
        if (i % 2 == 0) {
            assert_int_equal(mhi_system_close_loops(r.context, q, v, NULL), MHE_OK);
        }
        const mhe_acceleration all = {.size = sizeof all,
                                      .vdot = vdot,
                                      .vdot_q = vdot_q,
                                      .vdot_v = vdot_v,
                                      .vdot_a = vdot_a,
                                      .vdot_r = vdot_r};
        accelerate(&r, q, v, torque, &all);
        r.vary = v;
        double error = test_jacobian_error(by_q, &r, q, 3, 3, vdot_q);
        worst = fmax(worst, error);
        assert_true(error >= 0 && error < 1e-7);
        r.vary = q;
        error = test_jacobian_error(by_v, &r, v, 3, 3, vdot_v);
        worst = fmax(worst, error);
        assert_true(error >= 0 && error < 1e-7);
        const mhe_acceleration value = {.size = sizeof value, .vdot = other};
        for (int k = 0; k < 3; k++) {
            torque[k] += 1;
            accelerate(&r, q, v, torque, &value);
            torque[k] -= 1;
            for (int j = 0; j < 3; j++) {
                assert_near("by torque", vdot_r[3 * j + k], other[j] - vdot[j], 1e-9);
            }
        }
        r.a[0] += 0.25;
        accelerate(&r, q, v, torque, &value);
        r.a[0] -= 0.25;
        for (int j = 0; j < 3; j++) {
            assert_near("by activation", vdot_a[j], (other[j] - vdot[j]) / 0.25, 1e-9);
        }
    }
    close_rig(&r);
    print_message("derivatives %.1e\n", worst);
}

/* A loop that no posture closes is told, not looped over. */
static void what_cannot_close_is_told(void **state) {
    (void)state;
    rig r;
    mhe_error err = {0};
    open_rig(&r, DOCUMENT(BARS POINT("/bodyset/coupler", "/bodyset/rocker", "5 0 0", "0.3 0 0")),
             "", 0);
    double q[3] = {1, -0.6, 1.6};
    assert_int_equal(mhi_system_close_loops(r.context, q, NULL, &err), MHE_RETRY);
    assert_non_null(strstr(err.text, "loop 'pin' cannot be closed from here"));
    close_rig(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_pinned_plate_is_a_pendulum),
        cmocka_unit_test(a_welded_body_is_part_of_what_carries_it),
        cmocka_unit_test(a_closed_linkage_keeps_its_energy),
        cmocka_unit_test(derivatives_are_exact),
        cmocka_unit_test(what_cannot_close_is_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* Muscles whose curves stand in the model file: Schutte 1993 and RigidTendonMuscle of OpenSim. */
#include "test_muscle.h"

#include "io/model_file.h"

#include <string.h>

#define MUSCLE(type, extra)                                                                       \
    "<OpenSimDocument Version=\"40000\"><Model name=\"m\"><BodySet><objects><Body name=\"a\">"    \
    "<mass>1</mass><inertia>1 1 1 0 0 0</inertia></Body></objects></BodySet><JointSet><objects>"  \
    "<PinJoint name=\"j\"><socket_parent_frame>/ground</socket_parent_frame><socket_child_frame>" \
    "/bodyset/a</socket_child_frame><coordinates><Coordinate name=\"q\"/></coordinates>"          \
    "</PinJoint></objects></JointSet><ForceSet><objects><" type " name=\"m\"><GeometryPath>"      \
    "<PathPointSet><objects><PathPoint name=\"p\"><socket_parent_frame>/ground"                   \
    "</socket_parent_frame><location>0 1 0</location></PathPoint><PathPoint name=\"o\">"          \
    "<socket_parent_frame>/bodyset/a</socket_parent_frame><location>0.1 0 0</location>"           \
    "</PathPoint></objects></PathPointSet></GeometryPath><max_isometric_force>100"                \
    "</max_isometric_force><optimal_fiber_length>0.1</optimal_fiber_length><tendon_slack_length>" \
    "0.2</tendon_slack_length><pennation_angle_at_optimal>0.2</pennation_angle_at_optimal>"       \
    "<time_scale>0.1</time_scale><max_contraction_velocity>10</max_contraction_velocity>" extra   \
    "</" type "></objects></ForceSet></Model></OpenSimDocument>\n"
#define PASSIVE                                                                                 \
    "<passive_force_length_curve><SimmSpline><x>-5 0.998 0.999 1 1.1 1.2 1.3 1.4 1.5 1.6 1.601" \
    " 1.602 5</x><y>0 0 0 0 0.035 0.12 0.26 0.55 1.17 2 2 2 2</y></SimmSpline>"                 \
    "</passive_force_length_curve>"
#define DAMPING 0.1
#define HEIGHT (0.1 * sin(0.2))

struct sample {
    mhe_description *d;
    struct test_hill hill;
};

static struct sample open_sample(const char *text, const char *yaml) {
    struct sample s = {0};
    mhe_error err = {0};
    if (mhi_osim_parse("m.osim", text, strlen(text), &s.d, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    assert_int_equal(s.d->n_unsupported, 0);
    s.hill = test_hill(s.d->muscles, 1, yaml);
    if (s.hill.ops == NULL) {
        fail_msg("%s", s.hill.err.text);
    }
    return s;
}

static void close_sample(struct sample *s) {
    s->hill.ops->destroy(s->hill.self);
    mhi_description_free(s->d);
}

/* The fibre's force (of F_max) at its length (of l_opt) and velocity (1/s, of l_opt). */
static double fibre_force(const struct sample *s, double a, double n, double velocity) {
    const double along = sqrt(0.01 * n * n - HEIGHT * HEIGHT), cosine = along / (0.1 * n);
    const double l = 0.2 + along, w = 0.1 * velocity / cosine;
    double f = NAN;
    const mhe_muscle_values out = {.size = sizeof out, .force = &f};
    assert_int_equal(test_hill_at(&s->hill, &a, &l, &w, &out, NULL), MHE_OK);
    return f / (100 * cosine);
}

static void near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance * (1 + fabs(expected)))) {
        fail_msg("%.15g is not %.15g", value, expected);
    }
}

/* The knots of OpenSim's own curves, and the exponential where the file states no passive one. */
static void curves_are_the_files(void **state) {
    (void)state;
    static const double n[] = {0.71875, 0.86125, 1.045, 1.2175};
    static const double fl[] = {0.856667, 0.95, 0.993333, 0.77};
    struct sample bare = open_sample(MUSCLE("Schutte1993Muscle_Deprecated", ""), "");
    struct sample stated = open_sample(MUSCLE("Schutte1993Muscle_Deprecated", PASSIVE), "");
    for (int i = 0; i < 4; i++) {
        const double passive = fibre_force(&bare, 0, n[i], 0);
        near(passive, exp(8 * (n[i] - 1) - 4), 1e-12);
        near(fibre_force(&bare, 0.7, n[i], 0) - passive, 0.7 * fl[i], 1e-6);
    }
    near(fibre_force(&stated, 0, 1.3, 0), 0.26, 1e-12);
    near(fibre_force(&stated, 0, 1.5, 0), 1.17, 1e-12);
    close_sample(&bare);
    close_sample(&stated);
}

/* OpenSim's fibre velocity (of l_opt per time scale) of a force that depends on it, x = a fl: the
 * equation with its damping solved. */
static double velocity_of(double f, double x) {
    const double kv = 0.15, slope = 0.13, most = 1.4;
    double b, c;
    if (f < -DAMPING) {
        return f / DAMPING;
    }
    if (f < x) {
        c = kv * (f - x) / DAMPING;
        b = -kv * (f / kv + x + DAMPING) / DAMPING;
        return (-b - sqrt(b * b - 4 * c)) / 2;
    }
    c = -slope * kv / (DAMPING * (kv + 1)) * (f - x);
    b = -(f / DAMPING - most * x / DAMPING - slope * kv / (kv + 1));
    return (-b + sqrt(b * b - 4 * c)) / 2;
}

static void schuttes_velocity_is_inverted(void **state) {
    (void)state;
    uint64_t seed = 51;
    struct sample s = open_sample(MUSCLE("Schutte1993Muscle_Deprecated", ""), "");
    for (int i = 0; i < 200; i++) {
        const double a = test_random(&seed, 0.05, 1), n = test_random(&seed, 0.6, 1.4);
        const double speed = test_random(&seed, -1.4, 1); /* of l_opt per time scale */
        const double passive = fibre_force(&s, 0, n, 0);
        const double x = fibre_force(&s, a, n, 0) - passive;
        const double f = fibre_force(&s, a, n, speed / 0.1) - passive;
        near(velocity_of(f, x), speed, 1e-9);
    }
    close_sample(&s);
}

#define CURVE(name, x, y)                                                                          \
    "<" name "><PiecewiseLinearFunction><x>" x "</x><y>" y "</y></PiecewiseLinearFunction></" name \
    ">"

/* RigidTendonMuscle: all curves of the file; its tendon stays rigid whatever the config wants. */
static void a_rigid_tendon_muscle_has_its_curves(void **state) {
    (void)state;
    struct sample s = open_sample(
        MUSCLE("RigidTendonMuscle", CURVE("active_force_length_curve", "0 1 2", "0 1 0")
                                        CURVE("passive_force_length_curve", "0 1 2", "0 0 1")
                                            CURVE("force_velocity_curve", "-1 0 1", "0 1 1.5")),
        "tendon: elastic");
    mhe_muscle_layout layout = {.size = sizeof layout};
    assert_int_equal(s.hill.ops->layout(s.hill.self, &layout, NULL), MHE_OK);
    assert_int_equal(layout.n_states, 1);
    near(fibre_force(&s, 0.5, 0.8, 0), 0.5 * 0.8, 1e-12);
    near(fibre_force(&s, 1, 1.2, -5), 0.8 * 0.5 + 0.2, 1e-12);
    near(fibre_force(&s, 1, 1.2, 5), 0.8 * 1.25 + 0.2, 1e-12);
    close_sample(&s);
}

static int force_of(void *data, const double *x, double *y) {
    const struct sample *s = data;
    const mhe_muscle_values out = {.size = sizeof out, .force = y};
    return test_hill_at(&s->hill, x, x + 1, x + 2, &out, NULL);
}

/* y = [force, rate of the fibre] at x = (a, z, L) of the elastic muscle. */
static int elastic_of(void *data, const double *x, double *y) {
    const struct sample *s = data;
    const double still = 0;
    double rate[2];
    const mhe_muscle_point at = {
        .size = sizeof at, .excitation = x, .state = x, .length = x + 2, .velocity = &still};
    const mhe_muscle_values out = {.size = sizeof out, .force = y, .rate = rate};
    const mhe_status status = s->hill.ops->evaluate(s->hill.self, &at, &out, NULL);
    y[1] = rate[1];
    return status;
}

static void derivatives_are_exact(void **state) {
    (void)state;
    uint64_t seed = 52;
    double worst = 0;
    struct sample s = open_sample(MUSCLE("Schutte1993Muscle_Deprecated", PASSIVE), "");
    struct sample e =
        open_sample(MUSCLE("Schutte1993Muscle_Deprecated", PASSIVE), "tendon: elastic");
    for (int i = 0; i < 100; i++) {
        double x[3] = {test_random(&seed, 0.05, 1), test_random(&seed, 0.26, 0.33),
                       test_random(&seed, -0.8, 0.8)};
        double f, jacobian[3];
        const mhe_muscle_values out = {.size = sizeof out,
                                       .force = &f,
                                       .force_s = jacobian,
                                       .force_l = jacobian + 1,
                                       .force_w = jacobian + 2};
        assert_int_equal(test_hill_at(&s.hill, x, x + 1, x + 2, &out, NULL), MHE_OK);
        const double error = test_jacobian_error(force_of, &s, x, 3, 1, jacobian);
        worst = fmax(worst, error);
        assert_true(error >= 0 && error < 1e-6);
        double y[3] = {x[0], test_random(&seed, 0.7, 1.3), 0}, g, rate[2];
        double force_s[2], force_l, rate_s[4], rate_l[2];
        y[2] = 0.1 * y[1] + 0.2 * test_random(&seed, 1.001, 1.012);
        const double still = 0;
        const mhe_muscle_point at = {
            .size = sizeof at, .excitation = y, .state = y, .length = y + 2, .velocity = &still};
        const mhe_muscle_values all = {.size = sizeof all,
                                       .force = &g,
                                       .force_s = force_s,
                                       .force_l = &force_l,
                                       .rate = rate,
                                       .rate_s = rate_s,
                                       .rate_l = rate_l};
        assert_int_equal(e.hill.ops->evaluate(e.hill.self, &at, &all, NULL), MHE_OK);
        const double both[6] = {force_s[0], force_s[1], force_l, rate_s[2], rate_s[3], rate_l[1]};
        const double off = test_jacobian_error(elastic_of, &e, y, 3, 2, both);
        worst = fmax(worst, off);
        assert_true(off >= 0 && off < 1e-6);
    }
    print_message("derivatives: %.1e\n", worst);
    close_sample(&s);
    close_sample(&e);
}

static void a_muscle_without_curves_is_told(void **state) {
    (void)state;
    const mhe_muscle m = test_muscle(MHE_MUSCLE_HILL, 500, 0.1, 0.2, 0);
    const struct test_hill hill = test_hill(&m, 1, "curves: file");
    assert_null(hill.ops);
    assert_int_equal(hill.err.code, MHE_E_CONFIG);
    assert_non_null(strstr(hill.err.text, "muscle 'sample' (line 0) has no curves in the model "
                                          "file"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(curves_are_the_files), cmocka_unit_test(schuttes_velocity_is_inverted),
        cmocka_unit_test(a_rigid_tendon_muscle_has_its_curves),
        cmocka_unit_test(derivatives_are_exact), cmocka_unit_test(a_muscle_without_curves_is_told)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

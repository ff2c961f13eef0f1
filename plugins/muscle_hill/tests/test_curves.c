/* SPDX-License-Identifier: Apache-2.0 */
/* Derivatives of every curve set, published landmarks, parameters that must be there. */
#include "test_muscle.h"

#include <string.h>

static const char *const sets[] = {"curves: paper2021", "curves: biorbd", "curves: degroote2016",
                                   "curves: thelen2003", "{curves: paper2021, passive_ramp: 0.3}"};
static const int32_t types[] = {
    MHE_MUSCLE_UNSTATED,   MHE_MUSCLE_HILL,        MHE_MUSCLE_HILL_THELEN, MHE_MUSCLE_HILL_DEGROOTE,
    MHE_MUSCLE_THELEN2003, MHE_MUSCLE_MILLARD2012, MHE_MUSCLE_DEGROOTE2016};
#define N_TYPES ((int32_t)(sizeof types / sizeof types[0]))

/* y = F at x = (a, L, Ldot) of one muscle. */
static int force_of(void *data, const double *x, double *y) {
    const struct test_hill *hill = data;
    const mhe_muscle_values out = {.size = sizeof out, .force = y};
    return test_hill_at(hill, x, x + 1, x + 2, &out, NULL);
}

static double force_at(const struct test_hill *hill, double a, double l, double w) {
    double x[3] = {a, l, w}, f = NAN;
    assert_int_equal(force_of((void *)hill, x, &f), MHE_OK);
    return f;
}

/* Away from the kinks: differences reach 1e-2 at most, in length scaled by the step study to where
 * they no longer cross one. */
static void force_derivatives(void **state) {
    (void)state;
    uint64_t seed = 7;
    double worst = 0;
    for (size_t set = 0; set < sizeof sets / sizeof sets[0]; set++) {
        for (int32_t type = 0; type < N_TYPES; type++) {
            for (int trial = 0; trial < 40; trial++) {
                double l_opt = test_random(&seed, 0.05, 0.2), ls = test_random(&seed, 0.02, 0.2);
                mhe_muscle m = test_muscle(types[type], test_random(&seed, 100, 1500), l_opt, ls,
                                           trial % 4 == 0 ? NAN : test_random(&seed, 0, 0.6));
                if (trial % 2 == 0) {
                    m.fiber_damping = 0.05;
                    m.passive_strain = 0.5, m.passive_shape = 4.5;
                    m.active_shape = 0.5, m.velocity_shape = 0.3, m.max_lengthening_force = 1.8;
                    m.max_contraction_velocity = 12;
                }
                struct test_hill hill = test_hill(&m, 1, sets[set]);
                assert_non_null(hill.ops);
                double x[3], f, jacobian[3];
                x[0] = test_random(&seed, 0.02, 1);
                x[1] = ls + l_opt * test_random(&seed, 0.4, 1.5);
                x[2] = test_random(&seed, -0.9, 0.9);
                const mhe_muscle_values out = {.size = sizeof out,
                                               .force = &f,
                                               .force_s = jacobian,
                                               .force_l = jacobian + 1,
                                               .force_w = jacobian + 2};
                assert_int_equal(test_hill_at(&hill, x, x + 1, x + 2, &out, NULL), MHE_OK);
                assert_true(f == force_at(&hill, x[0], x[1], x[2]));
                double error = test_jacobian_error(force_of, &hill, x, 3, 1, jacobian);
                assert_true(error >= 0);
                worst = fmax(worst, error);
                hill.ops->destroy(hill.self);
            }
        }
    }
    print_message("force derivatives: %.1e of the largest\n", worst);
    assert_true(worst < 1e-6);
}

typedef struct numbered {
    const char *set;
    mhe_muscle muscle;
    double a, l, w;
} numbered;

/* y = F at x = (F_max in kN, l_opt, l_slack): a muscle made anew. */
static int force_of_numbers(void *data, const double *x, double *y) {
    const numbered *at = data;
    mhe_muscle m = at->muscle;
    m.max_isometric_force = 1000 * x[0];
    m.optimal_fiber_length = x[1];
    m.tendon_slack_length = x[2];
    struct test_hill hill = test_hill(&m, 1, at->set);
    assert_non_null(hill.ops);
    *y = force_at(&hill, at->a, at->l, at->w);
    hill.ops->destroy(hill.self);
    return 0;
}

/* By the numbers that a calibration estimates. */
static void derivatives_by_numbers(void **state) {
    (void)state;
    uint64_t seed = 19;
    double worst = 0, ramped = 0;
    for (size_t set = 0; set < sizeof sets / sizeof sets[0]; set++) {
        for (int32_t type = 0; type < N_TYPES; type++) {
            for (int trial = 0; trial < 40; trial++) {
                const double l_opt = test_random(&seed, 0.05, 0.2),
                             ls = test_random(&seed, 0.02, 0.2);
                numbered at = {sets[set],
                               test_muscle(types[type], 500, l_opt, ls,
                                           trial % 4 == 0 ? NAN : test_random(&seed, 0, 0.6)),
                               test_random(&seed, 0.02, 1),
                               ls + l_opt * test_random(&seed, 0.4, 1.5),
                               test_random(&seed, -0.9, 0.9)};
                double jacobian[3];
                struct test_hill hill = test_hill(&at.muscle, 1, at.set);
                mhe_muscle_layout layout = {.size = sizeof layout};
                assert_non_null(hill.ops);
                assert_int_equal(hill.ops->layout(hill.self, &layout, NULL), MHE_OK);
                assert_int_equal(layout.n_parameters, 3);
                const mhe_muscle_values out = {.size = sizeof out, .force_p = jacobian};
                assert_int_equal(test_hill_at(&hill, &at.a, &at.l, &at.w, &out, NULL), MHE_OK);
                jacobian[0] *= 1000;
                const double x[3] = {0.5, l_opt, ls};
                const double error = test_jacobian_error(force_of_numbers, &at, x, 3, 1, jacobian);
                assert_true(error >= 0);
                worst = fmax(worst, error);
                const double n = (at.l - ls) / l_opt / cos(fmax(0, at.muscle.pennation_angle));
                ramped += set == 4 && n < ls / l_opt && n > ls / l_opt - 0.3;
                hill.ops->destroy(hill.self);
            }
        }
    }
    print_message("by strengths and lengths: %.1e of the largest\n", worst);
    assert_true(worst < 1e-6);
    assert_true(ramped > 20); /* where the ramp moves with both lengths */
}

/* What the headers of the curves and docs/outputs.md say of negative forces: up to the largest
 * shortening speed no set pushes by itself; the damping of `paper2021` does, by as much as it is.
 */
static void pushes_only_by_its_damping(void **state) {
    (void)state;
    const double l_opt = 0.1, f_max = 1000, rate = 0.1 * f_max / (10 * l_opt);
    int pushing = 0;
    for (size_t set = 0; set < sizeof sets / sizeof sets[0]; set++) {
        const int paper = strstr(sets[set], "paper2021") != NULL;
        for (int32_t type = 0; type < N_TYPES; type++) {
            const mhe_muscle m = test_muscle(types[type], f_max, l_opt, 0.2, 0);
            struct test_hill hill = test_hill(&m, 1, sets[set]);
            assert_non_null(hill.ops);
            for (int i = 0; i < 5 * 14 * 40; i++) {
                const double a = i % 5 / 4.0, n = 0.3 + 0.1 * (i / 5 % 14);
                const double w = 10 * l_opt * (i / 70 - 19.9) / 20;
                const double f = force_at(&hill, a, 0.2 + l_opt * n, w);
                if (!(f - (paper ? rate * w : 0) >= -1e-9 * f_max)) {
                    fail_msg("%s, type %d: %g N at a %g, n %g, %g m/s", sets[set], (int)type, f, a,
                             n, w);
                }
                pushing += f < 0;
            }
            hill.ops->destroy(hill.self);
        }
    }
    assert_true(pushing > 0); /* an idle muscle of paper2021 */
}

/* OpenSim's active_force_width_scale w and ignore_passive_fiber_force: with full activation at rest
 * the force is that of the plain curve at 1 + (n - 1) / w, its passive part taken off. */
static void active_curve_as_wide_as_the_file_says(void **state) {
    (void)state;
    const double l_opt = 0.1, slack = 0.2, width = 1.5;
    mhe_muscle m = test_muscle(MHE_MUSCLE_DEGROOTE2016, 1000, l_opt, slack, 0);
    m.passive_strain = INFINITY;
    struct test_hill plain = test_hill(&m, 1, "curves: degroote2016");
    m.active_shape = width;
    struct test_hill wide = test_hill(&m, 1, "curves: degroote2016");
    assert_true(plain.ops != NULL && wide.ops != NULL);
    for (int i = 0; i < 30; i++) {
        const double n = 0.4 + 0.05 * i, narrow = 1 + (n - 1) / width;
        const double f = force_at(&wide, 1, slack + l_opt * n, 0);
        assert_true(fabs(f - force_at(&plain, 1, slack + l_opt * narrow, 0)) < 1e-9);
        assert_true(force_at(&wide, 0, slack + l_opt * n, 0) == 0); /* nothing passive */
    }
    plain.ops->destroy(plain.self);
    wide.ops->destroy(wide.self);
    /* a Thelen curve does not take it for its own shape */
    struct test_hill thelen = test_hill(&m, 1, "curves: thelen2003");
    m.active_shape = NAN;
    struct test_hill unstated = test_hill(&m, 1, "curves: thelen2003");
    assert_true(force_at(&thelen, 1, 0.27, 0) == force_at(&unstated, 1, 0.27, 0));
    thelen.ops->destroy(thelen.self);
    unstated.ops->destroy(unstated.self);
}

static int rate_of(void *data, const double *x, double *y) {
    const struct test_hill *hill = data;
    return hill->ops->diagonal_rate(hill->self, 0, x, x + 1, y, NULL, NULL, NULL);
}

static void activation_derivatives(void **state) {
    (void)state;
    uint64_t seed = 11;
    const mhe_muscle m = test_muscle(MHE_MUSCLE_HILL, 500, 0.1, 0.1, 0);
    static const char *const configs[] = {"", "{activation_smoothing: 10, tau_act: 0.015}",
                                          "{tau_deact: 0.06}"};
    for (int i = 0; i < 3; i++) {
        struct test_hill hill = test_hill(&m, 1, configs[i]);
        assert_non_null(hill.ops);
        for (int trial = 0; trial < 100; trial++) {
            double x[2] = {test_random(&seed, -0.1, 1.1), test_random(&seed, -0.1, 1.1)};
            double rate, jacobian[2];
            assert_int_equal(hill.ops->diagonal_rate(hill.self, 0, x, x + 1, &rate, jacobian,
                                                     jacobian + 1, NULL),
                             MHE_OK);
            assert_true(test_jacobian_error(rate_of, &hill, x, 2, 1, jacobian) < 1e-7);
        }
        double a = -0.4, e = 0, rate;
        assert_int_equal(hill.ops->diagonal_rate(hill.self, 0, &e, &a, &rate, NULL, NULL, NULL),
                         MHE_RETRY);
        hill.ops->destroy(hill.self);
    }
}

/* muscle-curves.md: 50/z + 12.5 z per second where e and a are close: 1/9, 1/18, 1/20 ms. */
static void activation_landmarks(void **state) {
    (void)state;
    const mhe_muscle m = test_muscle(MHE_MUSCLE_HILL, 500, 0.1, 0.1, 0);
    struct test_hill hill = test_hill(&m, 1, "");
    const double at[] = {0, 0.5, 1}, expected[] = {106.25, 55.625, 50};
    for (int i = 0; i < 3; i++) {
        double rate, rate_e, rate_a;
        assert_int_equal(
            hill.ops->diagonal_rate(hill.self, 0, &at[i], &at[i], &rate, &rate_e, &rate_a, NULL),
            MHE_OK);
        assert_true(rate == 0);
        assert_true(fabs(rate_e - expected[i]) < 1e-12 * expected[i]);
        assert_true(fabs(rate_a + expected[i]) < 1e-12 * expected[i]);
    }
    hill.ops->destroy(hill.self);
}

/* Force in units of f_max of a muscle with l_opt 0.1 and slack length 0.2, no pennation, at
 * normalised length n and musculotendon velocity w. */
static double normal_force(int32_t type, const char *yaml, double a, double n, double w) {
    const mhe_muscle m = test_muscle(type, 1000, 0.1, 0.2, 0);
    struct test_hill hill = test_hill(&m, 1, yaml);
    assert_non_null(hill.ops);
    double f = force_at(&hill, a, 0.2 + 0.1 * n, w) / 1000;
    hill.ops->destroy(hill.self);
    return f;
}

static void close_to(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance)) {
        fail_msg("%.9g is not %.9g within %g", value, expected, tolerance);
    }
}

static void landmarks(void **state) {
    (void)state;
    const char *dg = "curves: degroote2016", *th = "curves: thelen2003";
    const int32_t any = MHE_MUSCLE_UNSTATED;
    /* active part at n = 1: fl = 1 and, at rest, fv = 1. OpenSim's own check of the De Groote
     * curves has fl(1) = 1, fv(-1) = 0, fv(0) = 1, fv(1) = 1.794 (to 1e-3). */
    double passive = normal_force(any, dg, 0, 1, 0);
    close_to(passive, 0.0182, 1e-4);
    close_to(normal_force(any, dg, 1, 1, 0) - passive, 1, 1e-5);
    close_to(normal_force(any, dg, 1, 1, -1) - passive, 0, 1e-5);
    close_to(normal_force(any, dg, 1, 1, 1) - passive, 1.794, 1e-3);
    close_to(normal_force(any, dg, 0, 0.2, 0), 0, 1e-15); /* passive curve through 0 ... */
    close_to(normal_force(any, dg, 0, 1.6, 0), 1, 1e-12); /* ... and 1 */
    /* Thelen: fl(1) = 1, fp(1) = 0, fp(1.6) = 1, fv(0) = 1, fv(-1) = 0, fv(infinity) = F_len. */
    close_to(normal_force(any, th, 0, 1, 0), 0, 1e-15);
    close_to(normal_force(any, th, 0, 1.6, 0), 1, 1e-12);
    close_to(normal_force(any, th, 1, 1, 0), 1, 1e-12);
    close_to(normal_force(any, th, 0.5, 1, 0), 0.5, 1e-12);
    close_to(normal_force(any, th, 1, 1, -1), 0, 1e-12);
    close_to(normal_force(any, th, 1, 1, -2), 0, 1e-15);
    close_to(normal_force(any, th, 1, 1, 1e9), 1.4, 1e-6);
    /* Full activation, half of vmax: (1 - 0.5) / (1 + 0.5 / 0.25). */
    close_to(normal_force(any, th, 1, 1, -0.5), 0.5 / 3, 1e-12);
    /* The library's curves: optimum at full activation, w in tenths of m/s. */
    close_to(normal_force(MHE_MUSCLE_HILL, "curves: biorbd", 1, 1, 0), 1 + exp(-5), 1e-12);
    close_to(normal_force(MHE_MUSCLE_HILL_THELEN, "curves: biorbd", 1, 1, 0), 1, 1e-12);
    close_to(normal_force(MHE_MUSCLE_HILL_THELEN, "curves: biorbd", 1, 1, -1), 0, 1e-12);
    close_to(normal_force(MHE_MUSCLE_HILL, "curves: biorbd", 0, 1.5, 0), 1, 1e-12);
    close_to(normal_force(MHE_MUSCLE_HILL_THELEN, "curves: biorbd", 0, 1.6, 0), 1, 1e-12);
    close_to(normal_force(MHE_MUSCLE_HILL_DEGROOTE, "curves: biorbd", 0, 1.6, 0), 1, 1e-12);
}

/* Thelen's velocity equation (eq. 6, 7) put back: the velocity of the force is the velocity. */
static void thelen_velocity_is_inverted(void **state) {
    (void)state;
    const double af = 0.25, flen = 1.4;
    uint64_t seed = 3;
    for (int trial = 0; trial < 200; trial++) {
        double a = test_random(&seed, 0.05, 1), n = test_random(&seed, 0.6, 1);
        double s = test_random(&seed, -(0.25 + 0.75 * a), 1),
               x = a * exp(-(n - 1) * (n - 1) / 0.45);
        double f = normal_force(MHE_MUSCLE_THELEN2003, "curves: thelen2003", a, n, s);
        double b = f <= x ? x + f / af : (2 + 2 / af) * (x * flen - f) / (flen - 1);
        close_to((0.25 + 0.75 * a) * (f - x) / b, s, 1e-10);
    }
}

/* L = slack: a pennate fibre of the published sets stands across the tendon and pulls nothing. */
static void slack_tendon(void **state) {
    (void)state;
    for (int set = 2; set < 4; set++) {
        const mhe_muscle m = test_muscle(MHE_MUSCLE_UNSTATED, 1000, 0.1, 0.2, 0.4);
        struct test_hill hill = test_hill(&m, 1, sets[set]);
        close_to(force_at(&hill, 1, 0.19, 0.1), 0, 0);
        close_to(force_at(&hill, 1, 0.2 + 1e-9, 0.1), 0, 1e-4);
        hill.ops->destroy(hill.self);
    }
}

/* The passive force of paper2021 (l_opt 0.1, slack length 0.2: it begins at n = 2) with a ramp:
 * that of the jump above n = 2 and below the ramp, half of it halfway, and no corner at either end.
 */
static void ramp_instead_of_a_jump(void **state) {
    (void)state;
    const char *jump = "curves: paper2021", *ramp = "{curves: paper2021, passive_ramp: 0.02}";
    const int32_t both[] = {MHE_MUSCLE_HILL, MHE_MUSCLE_HILL_THELEN};
    for (int i = 0; i < 2; i++) {
        const double full = normal_force(both[i], jump, 0, 2 + 1e-12, 0);
        close_to(normal_force(both[i], ramp, 0, 2.001, 0), normal_force(both[i], jump, 0, 2.001, 0),
                 0);
        close_to(normal_force(both[i], jump, 0, 1.999, 0), 0, 0);
        close_to(normal_force(both[i], ramp, 0, 1.979, 0), 0, 0);
        close_to(normal_force(both[i], ramp, 0, 1.98 + 1e-6, 0), 0, 1e-8 * full);
        close_to(normal_force(both[i], ramp, 0, 1.99, 0) / full, 0.5 * exp(-10 * 0.01), 1e-3);
        close_to(normal_force(both[i], ramp, 0, 2 - 1e-9, 0) / full, 1, 1e-7);
    }
    const mhe_muscle m = test_muscle(MHE_MUSCLE_HILL, 500, 0.1, 0.2, 0);
    const struct test_hill hill = test_hill(&m, 1, "{curves: biorbd, passive_ramp: 0.02}");
    assert_null(hill.ops);
    assert_int_equal(hill.err.code, MHE_E_CONFIG);
}

static void options_matter(void **state) {
    (void)state;
    const int32_t any = MHE_MUSCLE_UNSTATED;
    close_to(normal_force(any, "", 1, 0.9, -0.3),
             normal_force(any, "curves: degroote2016", 1, 0.9, -0.3), 0);
    close_to(normal_force(any, "{vmax: 5}", 1, 1, -0.25),
             normal_force(any, "{vmax: 10}", 1, 1, -0.5), 1e-12);
    close_to(normal_force(any, "{damping: 0.2}", 1, 1, 0.5) - normal_force(any, "", 1, 1, 0.5), 0.1,
             1e-12);
}

static void refusals(void **state) {
    (void)state;
    mhe_muscle m[2] = {test_muscle(MHE_MUSCLE_HILL, 500, 0.1, 0.2, 0),
                       test_muscle(MHE_MUSCLE_HILL, 500, 0.1, 0.2, 0)};
    m[1].name = "Biceps";
    const struct {
        double *field;
        double value;
        const char *says;
    } cases[] = {{&m[1].max_isometric_force, NAN, "'Biceps' has no maximal isometric force"},
                 {&m[1].max_isometric_force, -1, "'Biceps': maximal isometric force is -1"},
                 {&m[1].optimal_fiber_length, 0, "'Biceps': optimal fibre length is 0"},
                 {&m[1].tendon_slack_length, NAN, "'Biceps' has no tendon slack length"},
                 {&m[1].tendon_slack_length, INFINITY, "'Biceps': tendon slack length is inf"},
                 {&m[1].pennation_angle, 1.58, "'Biceps': pennation angle"},
                 {&m[1].max_lengthening_force, 1, "'Biceps': maximal lengthening force is 1"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        double kept = *cases[i].field;
        *cases[i].field = cases[i].value;
        struct test_hill hill = test_hill(m, 2, "");
        assert_null(hill.ops);
        assert_int_equal(hill.err.code, MHE_E_INPUT);
        if (strstr(hill.err.text, cases[i].says) == NULL) {
            fail_msg("'%s' does not say '%s'", hill.err.text, cases[i].says);
        }
        *cases[i].field = kept;
    }
    struct test_hill hill = test_hill(m, 2, "{curves: paper2021, vmax: 8}");
    assert_null(hill.ops);
    assert_int_equal(hill.err.code, MHE_E_CONFIG);
    hill = test_hill(m, 2, "");
    assert_non_null(hill.ops);
    hill.ops->destroy(hill.self);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(force_derivatives),
                                       cmocka_unit_test(active_curve_as_wide_as_the_file_says),
                                       cmocka_unit_test(derivatives_by_numbers),
                                       cmocka_unit_test(pushes_only_by_its_damping),
                                       cmocka_unit_test(activation_derivatives),
                                       cmocka_unit_test(activation_landmarks),
                                       cmocka_unit_test(landmarks),
                                       cmocka_unit_test(thelen_velocity_is_inverted),
                                       cmocka_unit_test(slack_tendon),
                                       cmocka_unit_test(ramp_instead_of_a_jump),
                                       cmocka_unit_test(options_matter),
                                       cmocka_unit_test(refusals)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

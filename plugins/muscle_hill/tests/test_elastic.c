/* SPDX-License-Identifier: Apache-2.0 */
/* Elastic tendons: what holds wherever a solver may get to, and what is refused. */
#include "test_muscle.h"

#include <string.h>

static const char *const sets[] = {"degroote2016", "thelen2003", "millard2012"};
#define N_SETS 3
#define L_OPT 0.1

static struct test_hill elastic(const mhe_muscle *muscles, int32_t n, const char *set,
                                const char *more) {
    char yaml[128];
    (void)snprintf(yaml, sizeof yaml, "{curves: %s, tendon: elastic%s}", set, more);
    return test_hill(muscles, n, yaml);
}

/* y = (force, rate of z) of one muscle at x = (a, z, L, Ldot). */
static int elastic_at(void *data, const double *x, double *y) {
    const struct test_hill *hill = data;
    double rate[2];
    const mhe_muscle_point at = {
        .size = sizeof at, .excitation = x, .state = x, .length = x + 2, .velocity = x + 3};
    const mhe_muscle_values out = {.size = sizeof out, .force = y, .rate = rate};
    mhe_status status = hill->ops->evaluate(hill->self, &at, &out, NULL);
    y[1] = rate[1];
    return status;
}

/* The same derivatives as the plugin gives them, [2 x 4]. */
static void elastic_slopes(const struct test_hill *hill, const double *x, double *jacobian) {
    double force[2], rate[4];
    const mhe_muscle_point at = {
        .size = sizeof at, .excitation = x, .state = x, .length = x + 2, .velocity = x + 3};
    double rate_l[2], rate_w[2];
    const mhe_muscle_values out = {.size = sizeof out,
                                   .force_s = force,
                                   .force_l = jacobian + 2,
                                   .force_w = jacobian + 3,
                                   .rate_s = rate,
                                   .rate_l = rate_l,
                                   .rate_w = rate_w};
    assert_int_equal(hill->ops->evaluate(hill->self, &at, &out, NULL), MHE_OK);
    memcpy(jacobian, force, sizeof force);
    memcpy(jacobian + 4, rate + 2, 2 * sizeof *rate);
    jacobian[6] = rate_l[1];
    jacobian[7] = rate_w[1];
}

/* At activation 0, with slack and overstretched tendons, at the stop: off the kinks of Thelen's
 * curves, which the step study does not reach. */
static void derivatives(void **state) {
    (void)state;
    uint64_t seed = 31;
    for (int set = 0; set < N_SETS; set++) {
        double worst = 0;
        for (int trial = 0; trial < 400; trial++) {
            double slack = test_random(&seed, 0.06, 0.3);
            const mhe_muscle m = test_muscle(MHE_MUSCLE_UNSTATED, 900, L_OPT, slack,
                                             trial % 3 == 0 ? 0 : test_random(&seed, 0, 0.5));
            struct test_hill hill = elastic(&m, 1, sets[set], "");
            assert_non_null(hill.ops);
            double z = test_random(&seed, 0.4, 1.5), y[2], jacobian[8];
            double strain = test_random(&seed, -0.03, 0.08);
            double x[4] = {trial % 5 == 0 ? 1e-3 : test_random(&seed, 0.01, 1), z,
                           z * L_OPT + slack * (1 + strain), test_random(&seed, -0.5, 0.5)};
            assert_int_equal(elastic_at(&hill, x, y), 0);
            elastic_slopes(&hill, x, jacobian);
            double error = test_jacobian_error(elastic_at, &hill, x, 4, 2, jacobian);
            assert_true(error >= 0);
            worst = fmax(worst, error);
            hill.ops->destroy(hill.self);
        }
        print_message("%s: force and rate of elastic tendons: %.1e of the largest\n", sets[set],
                      worst);
        assert_true(worst < 1e-6);
    }
}

/* No activation, length or tendon leaves it without a finite rate, and no fibre runs away: it
 * lengthens under a taut tendon, shortens under a slack one, and stops where it is shortest. */
static void holds_everywhere(void **state) {
    (void)state;
    static const double activations[] = {-0.05, 0, 1e-9, 0.01, 0.5, 1, 1.3};
    for (int set = 0; set < N_SETS; set++) {
        for (int pennate = 0; pennate < 2; pennate++) {
            const mhe_muscle m =
                test_muscle(MHE_MUSCLE_UNSTATED, 900, L_OPT, 0.2, pennate ? 0.4 : 0);
            struct test_hill hill = elastic(&m, 1, sets[set], "");
            mhe_muscle_layout layout = {.size = sizeof layout};
            assert_int_equal(hill.ops->layout(hill.self, &layout, NULL), MHE_OK);
            double lower = layout.lower[1], upper = layout.upper[1];
            for (size_t i = 0; i < sizeof activations / sizeof *activations; i++) {
                double a = activations[i], y[2];
                for (int k = 0; k <= 100; k++) {
                    double z = lower + (upper - lower) * k / 100;
                    for (double strain = -1; strain < 1; strain += 0.0501) {
                        double x[4] = {a, z, z * L_OPT + 0.2 * (1 + strain), 0};
                        assert_int_equal(elastic_at(&hill, x, y), 0);
                        assert_true(isfinite(y[0]) && isfinite(y[1]) && y[0] >= 0);
                    }
                    double slack[4] = {a, z, z * L_OPT + 0.19, 0};
                    double taut[4] = {a, fmin(z, 1.2), fmin(z, 1.2) * L_OPT + 0.2 * 1.2, 0};
                    assert_int_equal(elastic_at(&hill, slack, y), 0);
                    assert_true(y[0] == 0);
                    assert_true(a < 0 || z < lower + 0.021 || y[1] <= 0);
                    assert_int_equal(elastic_at(&hill, taut, y), 0);
                    assert_true(y[1] > 0);
                }
                double stop[4] = {a, lower, lower * L_OPT + 0.1, 0};
                assert_int_equal(elastic_at(&hill, stop, y), 0);
                assert_true(a < 0 || y[1] >= 0);
            }
            hill.ops->destroy(hill.self);
        }
    }
}

/* The rate is 0 in static equilibrium; under way the tendon's force stays what it is. */
static void equilibrium(void **state) {
    (void)state;
    uint64_t seed = 32;
    for (int set = 0; set < N_SETS; set++) {
        for (int trial = 0; trial < 300; trial++) {
            double slack = test_random(&seed, 0.06, 0.3);
            const mhe_muscle m = test_muscle(MHE_MUSCLE_UNSTATED, 900, L_OPT, slack,
                                             trial % 3 == 0 ? 0 : test_random(&seed, 0, 0.5));
            struct test_hill hill = elastic(&m, 1, sets[set], "");
            double a = trial % 4 == 0 ? 0 : test_random(&seed, 0, 1), s[2], y[2];
            double l = slack + L_OPT * test_random(&seed, 0.3, 1.5), still = 0;
            double w = test_random(&seed, 0, 0.2);
            assert_int_equal(hill.ops->equilibrium(hill.self, &a, &l, &still, s, NULL), MHE_OK);
            double x[4] = {a, s[1], l, 0};
            mhe_muscle_layout layout = {.size = sizeof layout};
            assert_int_equal(hill.ops->layout(hill.self, &layout, NULL), MHE_OK);
            double stop = layout.lower[1] + 0.041; /* from here on it is felt */
            assert_true(s[0] == a);
            assert_int_equal(elastic_at(&hill, x, y), 0);
            assert_true(fabs(y[1]) < 1e-9 || (y[0] == 0 && y[1] <= 1e-9));
            assert_int_equal(hill.ops->equilibrium(hill.self, &a, &l, &w, s, NULL), MHE_OK);
            x[1] = s[1];
            assert_int_equal(elastic_at(&hill, x, y), 0);
            assert_true(y[0] == 0 || s[1] < stop || fabs(y[1] - w / L_OPT) < 1e-8);
            hill.ops->destroy(hill.self);
        }
    }
}

/* A tendon that hardly gives pulls as the rigid one does. */
static void stiff_as_rigid(void **state) {
    (void)state;
    for (int set = 0; set < N_SETS; set++) {
        mhe_muscle m = test_muscle(MHE_MUSCLE_UNSTATED, 900, L_OPT, 0.2, 0.3);
        char yaml[64];
        m.tendon_strain = m.millard.tendon_strain_at_one_norm_force = 1e-6;
        (void)snprintf(yaml, sizeof yaml, "{curves: %s, damping: 0.1}", sets[set]);
        struct test_hill rigid = test_hill(&m, 1, yaml);
        struct test_hill hill = elastic(&m, 1, sets[set], "");
        for (int i = 0; i < 20; i++) {
            double a = 0.05 * i, l = 0.2 + L_OPT * (0.75 + 0.025 * i), w = 0, s[2], f, y[2];
            assert_int_equal(hill.ops->equilibrium(hill.self, &a, &l, &w, s, NULL), MHE_OK);
            double x[4] = {a, s[1], l, 0};
            assert_int_equal(elastic_at(&hill, x, y), 0);
            const mhe_muscle_point at = {
                .size = sizeof at, .state = &a, .length = &l, .velocity = &w};
            const mhe_muscle_values out = {.size = sizeof out, .force = &f};
            assert_int_equal(rigid.ops->evaluate(rigid.self, &at, &out, NULL), MHE_OK);
            /* the strain moves the fibre by 2e-6 l_opt */
            assert_true(fabs(fmax(f, 0) - y[0]) < 900 * 2e-5);
        }
        rigid.ops->destroy(rigid.self);
        hill.ops->destroy(hill.self);
    }
}

/* F_max at the stated strain, nothing below the slack length. */
static void tendon_landmarks(void **state) {
    (void)state;
    static const double strain[] = {0.049, 0.04, 0.049};
    for (int set = 0; set < N_SETS; set++) {
        const mhe_muscle m = test_muscle(MHE_MUSCLE_UNSTATED, 900, L_OPT, 0.2, 0);
        struct test_hill hill = elastic(&m, 1, sets[set], "");
        double y[2], x[4] = {0.5, 0.9, 0.09 + 0.2 * (1 + strain[set]), 0};
        assert_int_equal(elastic_at(&hill, x, y), 0);
        assert_true(fabs(y[0] - 900) < 1e-9 * 900);
        x[2] = 0.09 + 0.2 * 0.994;
        assert_int_equal(elastic_at(&hill, x, y), 0);
        assert_true(y[0] == 0);
        hill.ops->destroy(hill.self);
    }
}

/* A tendon shorter than half the fibre, or of which the file says so where it is asked, has no
 * state and pulls as it does beside none; its entries are not read. */
static void rigid_among_elastic(void **state) {
    (void)state;
    mhe_muscle m[3];
    for (int i = 0; i < 3; i++) {
        m[i] = test_muscle(MHE_MUSCLE_MILLARD2012, 900, L_OPT, i == 1 ? 0.04 : 0.2, 0.2);
    }
    m[2].ignore_tendon_compliance = 1;
    struct test_hill hill = test_hill(m, 3, "tendon: elastic"), rigid = test_hill(m, 3, "");
    static const uint8_t all[] = {1, 1, 1, 1, 0, 1}, expected[] = {1, 1, 1, 1, 0, 0};
    mhe_muscle_layout layout = {.size = sizeof layout};
    assert_non_null(hill.ops);
    assert_int_equal(hill.ops->layout(hill.self, &layout, NULL), MHE_OK);
    assert_int_equal(layout.n_states, 2);
    assert_int_equal(layout.activation, 0);
    assert_string_equal(layout.names[1], "fiber_length");
    assert_memory_equal(layout.present, all, sizeof all);
    hill.ops->destroy(hill.self);
    hill = test_hill(m, 3, "tendon: file");
    assert_non_null(hill.ops);
    assert_int_equal(hill.ops->layout(hill.self, &layout, NULL), MHE_OK);
    assert_memory_equal(layout.present, expected, sizeof expected);
    double s[6] = {0.2, 0.5, 0.8, 0.9, NAN, NAN}, e[3] = {0.5, 0.5, 0.5};
    double l[3] = {0.297, 0.13, 0.3}, w[3] = {0.1, -0.1, 0.2}, f[3], f_s[6], rigid_f[3];
    const mhe_muscle_point at = {
        .size = sizeof at, .excitation = e, .state = s, .length = l, .velocity = w};
    const mhe_muscle_values out = {.size = sizeof out, .force = f, .force_s = f_s};
    const mhe_muscle_values rigid_out = {.size = sizeof out, .force = rigid_f};
    assert_int_equal(hill.ops->evaluate(hill.self, &at, &out, NULL), MHE_OK);
    assert_int_equal(rigid.ops->evaluate(rigid.self, &at, &rigid_out, NULL), MHE_OK);
    assert_true(f[1] == rigid_f[1] && f[2] == rigid_f[2] && f[0] != rigid_f[0]);
    assert_true(f_s[4] == 0 && f_s[5] == 0 && f_s[3] < 0);
    hill.ops->destroy(hill.self);
    rigid.ops->destroy(rigid.self);
}

static void refused(void **state) {
    (void)state;
    static const struct {
        const char *yaml, *text;
        double damping;
    } cases[] = {
        {"{tendon: elastic, curves: thelen2003}",
         "muscle 'sample' (line 7): fibre damping is 0.005; an elastic tendon needs at least 0.01 "
         "(set muscle.damping, usually 0.1), or tendon: rigid",
         0.005},
        {"{tendon: elastic, curves: millard2012, damping: 0}",
         "muscle 'sample' (line 7): fibre damping is 0; an elastic tendon needs at least 0.01 "
         "(muscle.damping), or tendon: rigid",
         0.1},
        {"{tendon: elastic, curves: paper2021}",
         "tendon: elastic tendons; the curves paper2021 have rigid tendons: choose degroote2016, "
         "thelen2003 "
         "or millard2012",
         NAN}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        mhe_muscle m = test_muscle(MHE_MUSCLE_UNSTATED, 900, L_OPT, 0.2, 0);
        m.line = 7;
        m.fiber_damping = cases[i].damping;
        struct test_hill hill = test_hill(&m, 1, cases[i].yaml);
        assert_null(hill.ops);
        assert_string_equal(hill.err.text, cases[i].text);
    }
    mhe_muscle m = test_muscle(MHE_MUSCLE_MILLARD2012, 900, L_OPT, 0.2, 0);
    m.line = 7;
    m.millard.max_norm_active_fiber_length = 0.9;
    struct test_hill hill = test_hill(&m, 1, "");
    assert_null(hill.ops);
    assert_string_equal(hill.err.text,
                        "muscle 'sample' (line 7): max_norm_active_fiber_length is 0.9, must be "
                        "above 1.1");
    m.millard.max_norm_active_fiber_length = NAN;
    m.millard.tendon_curviness = 0.5;
    hill = test_hill(&m, 1, "");
    assert_null(hill.ops);
    assert_non_null(strstr(hill.err.text, "or none of them"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(derivatives),      cmocka_unit_test(holds_everywhere),
        cmocka_unit_test(equilibrium),      cmocka_unit_test(stiff_as_rigid),
        cmocka_unit_test(tendon_landmarks), cmocka_unit_test(rigid_among_elastic),
        cmocka_unit_test(refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

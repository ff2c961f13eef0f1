/* SPDX-License-Identifier: Apache-2.0 */
/* Paths of every kind on one tree: that derivatives are those of the length, that lengths are what
 * they are by other means, that nothing is remembered, and what is refused. */
#include "leg.h"
#include "vector.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance)) {
        fail_msg("%.17g is not %.17g", value, expected);
    }
}

static test_instance instance;

static int setup(void **state) {
    (void)state;
    test_open(&instance, &leg, 0);
    return 0;
}

static int teardown(void **state) {
    (void)state;
    test_close(&instance);
    return 0;
}

static void derivatives_are_those_of_the_length(void **state) {
    (void)state;
    uint64_t seed = 3;
    double worst[2][N_P] = {{0}};
    int wrapped[N_P] = {0};
    for (int trial = 0; trial < 25; trial++) {
        double q[N_Q], length[N_P], gradient[N_P * N_Q], hessian[N_P * N_Q * N_Q];
        leg_random(&seed, q);
        assert_int_equal(leg_lengths(&instance, q, length, gradient, hessian), 0);
        for (int32_t i = 0; i < N_P; i++) {
            leg_watch watch = {&instance, i};
            double first =
                test_jacobian_error(leg_length_of_q, &watch, q, N_Q, 1, gradient + i * N_Q);
            double second = test_jacobian_error(leg_gradient_of_q, &watch, q, N_Q, N_Q,
                                                hessian + i * N_Q * N_Q);
            worst[0][i] = fmax(worst[0][i], first);
            worst[1][i] = fmax(worst[1][i], second);
            int same = fabs(length[i] - length[2]) < 1e-6 && i != 2;
            wrapped[i] += !same;
        }
    }
    for (int i = 0; i < N_P; i++) {
        print_message("%s: first %.1e, second %.1e (%d)\n", leg_paths[i].name, worst[0][i],
                      worst[1][i], wrapped[i]);
        assert_true(worst[0][i] < 1e-7);
        assert_true(worst[1][i] < 1e-5);
    }
}

/* The same bits, whatever was evaluated before, and on another context. */
static void nothing_is_remembered(void **state) {
    (void)state;
    uint64_t seed = 8;
    double q[20][N_Q], length[20][N_P], hessian[20][N_P * N_Q * N_Q];
    for (int i = 0; i < 20; i++) {
        leg_random(&seed, q[i]);
        assert_int_equal(leg_lengths(&instance, q[i], length[i], NULL, hessian[i]), 0);
    }
    for (int i = 19; i >= 0; i -= 3) {
        double again[N_P], second[N_P * N_Q * N_Q];
        assert_int_equal(leg_lengths(&instance, q[i], again, NULL, second), 0);
        assert_memory_equal(again, length[i], sizeof again);
        assert_memory_equal(second, hessian[i], sizeof second);
    }
}

/* Points along a path lie where its length says. */
static void points_for_drawing_follow_the_path(void **state) {
    (void)state;
    uint64_t seed = 12;
    for (int trial = 0; trial < 20; trial++) {
        double q[N_Q], length[N_P], at[64][3];
        leg_random(&seed, q);
        assert_int_equal(leg_lengths(&instance, q, length, NULL, NULL), 0);
        for (int32_t p = 0; p < N_P; p++) {
            int32_t n = instance.ops->path_points(instance.context, p, at[0], 64);
            double along = 0;
            assert_true(n <= 64 && (n >= 2 || leg_paths[p].n_points == 0));
            for (int32_t k = 1; k < n; k++) {
                double d[3] = {at[k][0] - at[k - 1][0], at[k][1] - at[k - 1][1],
                               at[k][2] - at[k - 1][2]};
                along += sqrt(dot3(d, d));
            }
            if (n > 0) { /* chords are a little shorter than arcs */
                assert_true(along < length[p] + 1e-9 && along > length[p] - 4e-4);
            }
        }
    }
}

/* Strings in a row: shorter than with one of the two obstacles alone is impossible, and beyond
 * both alone it has to be in some poses. */
static void obstacles_in_a_row_both_count(void **state) {
    (void)state;
    static const mhe_path_wrap egg = {2, -1, -1, 0}, rod = {1, -1, -1, 0};
    mhe_path three[] = {{"both", 2, 2, leg_in_a_row, leg_row, NULL, 1},
                        {"egg", 2, 1, leg_in_a_row, &egg, NULL, 1},
                        {"rod", 2, 1, leg_in_a_row, &rod, NULL, 1}};
    mhe_description d = leg;
    test_instance other;
    uint64_t seed = 3;
    int more = 0;
    d.n_paths = d.n_muscles = 3;
    d.paths = three;
    test_open(&other, &d, 0);
    for (int trial = 0; trial < 60; trial++) {
        double q[N_Q], v[N_Q] = {0}, length[3];
        leg_random(&seed, q);
        mhe_kinematics out = {.size = sizeof out, .length = length};
        assert_int_equal(other.ops->kinematics(other.context, q, v, &out, NULL), 0);
        assert_true(length[0] > fmax(length[1], length[2]) - 1e-12);
        more += length[0] > fmax(length[1], length[2]) + 1e-5;
    }
    print_message("both obstacles touch in %d of 60 poses\n", more);
    assert_true(more > 5);
    test_close(&other);
}

static int torque_of(const test_instance *i, const double *q, const double *v, const double *a,
                     double *tau, double *tau_q, double *mass) {
    mhe_kinematics out = {.size = sizeof out, .mass = mass};
    int status = i->ops->kinematics(i->context, q, v, &out, NULL);
    return status != 0 ? status : i->ops->inverse_dynamics(i->context, a, tau, tau_q, NULL, NULL);
}

static double speed[N_Q], acceleration[N_Q];

static int torque_of_q(void *data, const double *q, double *y) {
    (void)data;
    return torque_of(&instance, q, speed, acceleration, y, NULL, NULL);
}

/* Couplers: Simbody and the recursion say the same, and derivatives follow. */
static void couplers_are_carried_by_both_dynamics(void **state) {
    (void)state;
    test_instance simbody;
    uint64_t seed = 17;
    test_open(&simbody, &leg, 1);
    for (int trial = 0; trial < 20; trial++) {
        double q[N_Q], tau[2][N_Q], mass[2][N_Q * N_Q], tau_q[N_Q * N_Q];
        leg_random(&seed, q);
        for (int i = 0; i < N_Q; i++) {
            speed[i] = test_random(&seed, -2, 2);
            acceleration[i] = test_random(&seed, -9, 9);
        }
        assert_int_equal(torque_of(&simbody, q, speed, acceleration, tau[1], NULL, mass[1]), 0);
        assert_int_equal(torque_of(&instance, q, speed, acceleration, tau[0], tau_q, mass[0]), 0);
        for (int i = 0; i < N_Q; i++) {
            assert_near(tau[0][i], tau[1][i], 1e-10 * (1 + fabs(tau[1][i])));
        }
        for (int i = 0; i < N_Q * N_Q; i++) {
            assert_near(mass[0][i], mass[1][i], 1e-11);
        }
        assert_true(test_jacobian_error(torque_of_q, NULL, q, N_Q, N_Q, tau_q) < 1e-6);
    }
    test_close(&simbody);
}

static void a_point_inside_an_obstacle_is_told(void **state) {
    (void)state;
    mhe_description d = leg;
    mhe_obstacle larger[5];
    test_instance other;
    memcpy(larger, leg_obstacles, sizeof larger);
    larger[0].size[0] = 0.5;
    d.obstacles = larger;
    test_open(&other, &d, 0);
    assert_non_null(strstr(test_told, ":3: path 'sphere' has a point inside 'ball'"));
    test_close(&other);
}

static void refused(const mhe_description *d, const char *part) {
    void *self = NULL;
    mhe_error err = {0};
    double config[64] = {0};
    mhe_status status = instance.ops->create(NULL, d, config, &self, &err);
    if (status != MHE_E_INPUT || strstr(err.text, part) == NULL) {
        fail_msg("status %d, '%s' does not say '%s'", (int)status, err.text, part);
    }
}

static void senseless_paths_are_refused(void **state) {
    (void)state;
    mhe_description d = leg;
    mhe_obstacle broken[5];
    mhe_path path = leg_paths[0];
    mhe_path_point points[4];
    mhe_path_wrap wrap = leg_wraps[0];
    mhe_dependent circle[2] = {leg_dependents[0], leg_dependents[1]};
    d.obstacles = broken;
    memcpy(broken, leg_obstacles, sizeof broken);
    broken[2].size[1] = 0;
    refused(&d, "obstacle 'egg': size 0 m");
    memcpy(broken, leg_obstacles, sizeof broken);
    broken[3].size[0] = 0.05;
    refused(&d, "obstacle 'ring': the tube's radius");
    memcpy(broken, leg_obstacles, sizeof broken);
    circle[0].independent = 7;
    d.dependents = circle;
    refused(&d, "dependent coordinate 'g'");
    d.dependents = leg_dependents;
    d.n_paths = d.n_muscles = 1;
    d.paths = &path;
    path.points = points;
    memcpy(points, leg_moving, sizeof points);
    points[1].coordinate[1] = 8;
    refused(&d, "path 'moving': point 2 moves");
    memcpy(points, leg_conditional, sizeof leg_conditional);
    path.n_points = 3;
    points[1].lower = 10;
    refused(&d, "path 'moving': point 2 is on in a range that is none");
    path = leg_paths[2];
    path.wraps = &wrap;
    wrap.obstacle = 5;
    refused(&d, "wrap 1: its obstacle");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(derivatives_are_those_of_the_length),
        cmocka_unit_test(nothing_is_remembered),
        cmocka_unit_test(points_for_drawing_follow_the_path),
        cmocka_unit_test(obstacles_in_a_row_both_count),
        cmocka_unit_test(couplers_are_carried_by_both_dynamics),
        cmocka_unit_test(a_point_inside_an_obstacle_is_told),
        cmocka_unit_test(senseless_paths_are_refused),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

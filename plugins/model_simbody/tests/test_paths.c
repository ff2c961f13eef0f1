/* SPDX-License-Identifier: Apache-2.0 */
/* Paths of every kind on one tree: that derivatives are those of the length, that lengths are what
 * they are by other means, that nothing is remembered, and what is refused. */
#include "test_models.h"
#include "vector.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define N_Q 6
#define N_P 9
#define UNIT \
    { 1, 0, 0, 0, 1, 0, 0, 0, 1 }

static const double zero[] = {0};
static const double line[] = {0, 1};
static const double bent[] = {0.1, 0.8, -0.3, 0.2, 0.1}; /* degree 4 */
static const double pieces_origin[] = {0, 0.05};
static const double pieces[] = {0.02, 0.03, 0.02, 0, 0.02155, 0.032, 0.02, -0.05};
static const mhe_motion ball[] = {{MHE_MOTION_ROTATION, 0, {1, 0, 0}, {zero, line, 1, 2}},
                                  {MHE_MOTION_ROTATION, 1, {0, 0.6, 0.8}, {zero, line, 1, 2}},
                                  {MHE_MOTION_ROTATION, 2, {0, 0, 1}, {zero, line, 1, 2}}};
/* number 6: bending(q3); number 7: bending(number 6) */
static const mhe_motion knee[] = {
    {MHE_MOTION_TRANSLATION, 7, {0, 1, 0}, {pieces_origin, pieces, 2, 4}},
    {MHE_MOTION_ROTATION, 3, {0, 0, 1}, {zero, line, 1, 2}},
    {MHE_MOTION_ROTATION, 6, {0.8, 0, 0.6}, {zero, bent, 1, 5}}};
static const mhe_motion branch[] = {{MHE_MOTION_TRANSLATION, 4, {0, 0, 1}, {zero, line, 1, 2}},
                                    {MHE_MOTION_ROTATION, 5, {0, 1, 0}, {zero, line, 1, 2}}};

static const mhe_body bodies[] = {{"thigh",
                                   -1,
                                   3,
                                   ball,
                                   UNIT,
                                   {0, 0.1, 0},
                                   UNIT,
                                   {0},
                                   3,
                                   {0, -0.1, 0},
                                   {0.02, 0, 0, 0, 0.02, 0, 0, 0, 0.02}},
                                  {"shank",
                                   0,
                                   3,
                                   knee,
                                   UNIT,
                                   {0.01, -0.3, 0.02},
                                   {0.8, 0.6, 0, -0.6, 0.8, 0, 0, 0, 1},
                                   {0, 0, 0.01},
                                   2,
                                   {0, -0.1, 0},
                                   {0.02, 0, 0, 0, 0.02, 0, 0, 0, 0.02}},
                                  {"arm",
                                   -1,
                                   2,
                                   branch,
                                   UNIT,
                                   {0.1, 0, 0},
                                   UNIT,
                                   {0},
                                   1,
                                   {0, 0.1, 0},
                                   {0.01, 0, 0, 0, 0.01, 0, 0, 0, 0.01}}};

static const mhe_coordinate coordinates[N_Q] = {{.name = "a"}, {.name = "b"}, {.name = "c"},
                                                {.name = "d"}, {.name = "e"}, {.name = "f"}};
static const mhe_dependent dependents[] = {{{.name = "g"}, 3, {zero, bent, 1, 5}},
                                           {{.name = "h"}, 6, {zero, bent, 1, 5}}};

/* frames of obstacles are turned by a rotation of Pythagorean entries */
#define TURNED \
    { 0.8, -0.6, 0, 0.6, 0.8, 0, 0, 0, 1 }
static const mhe_obstacle obstacles[] = {
    {"ball", MHE_OBSTACLE_SPHERE, 0, UNIT, {0.01, -0.15, 0}, {0.04}, -1, 0},
    {"rod", MHE_OBSTACLE_CYLINDER, 1, TURNED, {0, -0.02, 0}, {0.03, 0.3}, -1, 0},
    {"egg", MHE_OBSTACLE_ELLIPSOID, 0, TURNED, {0, -0.15, 0}, {0.05, 0.04, 0.03}, -1, 0},
    {"ring",
     MHE_OBSTACLE_TORUS,
     0,
     {1, 0, 0, 0, 0, -1, 0, 1, 0},
     {0.01, -0.1, 0.01},
     {0.008, 0.02},
     -1,
     0},
    {"half rod", MHE_OBSTACLE_CYLINDER, 0, UNIT, {0, -0.15, 0}, {0.03, 0.3}, 0, 1}};

static const mhe_path_point from_hip[] = {
    {.body = -1, .location = {0.0, 0.2, 0.01}, .coordinate = {-1, -1, -1}},
    {.body = 1, .location = {0.02, -0.15, 0.0}, .coordinate = {-1, -1, -1}}};
static const mhe_path_point moving[] = {
    {.body = -1, .location = {0.0, 0.2, 0.03}, .coordinate = {-1, -1, -1}},
    {.kind = MHE_POINT_MOVING,
     .body = 0,
     .location = {0.05, 0, 0.01},
     .coordinate = {-1, 3, 7},
     .function = {{0}, {zero, bent, 1, 5}, {pieces_origin, pieces, 2, 4}}},
    {.kind = MHE_POINT_MOVING,
     .body = 0,
     .location = {0.04, -0.1, 0},
     .coordinate = {0, -1, 6},
     .function = {{pieces_origin, pieces, 2, 4}, {0}, {pieces_origin, pieces, 2, 4}}},
    {.body = 2, .location = {0.02, -0.15, 0.0}, .coordinate = {-1, -1, -1}}};
static const mhe_path_point conditional[] = {
    {.body = -1, .location = {0.0, 0.2, 0.03}, .coordinate = {-1, -1, -1}},
    {.kind = MHE_POINT_CONDITIONAL,
     .body = 0,
     .location = {0.05, -0.1, 0.01},
     .coordinate = {7, -1, -1},
     .lower = 0.15,
     .upper = 9},
    {.body = 1, .location = {0.02, -0.15, 0.0}, .coordinate = {-1, -1, -1}}};
static const mhe_path_point in_a_row[] = {
    {.body = -1, .location = {0.03, 0.2, 0.01}, .coordinate = {-1, -1, -1}},
    {.kind = MHE_POINT_MOVING,
     .body = 1,
     .location = {0.02, -0.15, 0.0},
     .coordinate = {-1, -1, 7},
     .function = {{0}, {0}, {pieces_origin, pieces, 2, 4}}}};
static const mhe_path_point through_ring[] = {
    {.body = 2, .location = {-0.08, 0.15, 0.01}, .coordinate = {-1, -1, -1}},
    {.body = 1, .location = {0.04, -0.15, 0.03}, .coordinate = {-1, -1, -1}}};

static const mhe_path_wrap wraps[] = {
    {0, -1, -1, 0}, {1, -1, -1, 0}, {2, 0, 1, 0}, {3, -1, -1, 0}, {4, -1, -1, 0}};
static const mhe_path_wrap row[] = {{2, -1, -1, 0}, {1, -1, -1, 0}};

static const int32_t in_numbers[] = {0, 7, 3};
static const double centre[] = {0.1, 0.2, -0.1}, scale[] = {0.7, 0.5, 0.9};
static const double terms[] = {0.3, 0.02, -0.03, 0.04, 0.01};
static const uint8_t exponents[] = {0, 0, 0, 1, 0, 0, 0, 2, 1, 3, 1, 1, 0, 0, 4};
static const mhe_polynomial polynomial = {3, in_numbers, centre, scale, 5, terms, exponents};

static const mhe_path paths[N_P] = {{"moving", 4, 0, moving, NULL, NULL, 1},
                                    {"conditional", 3, 0, conditional, NULL, NULL, 2},
                                    {"sphere", 2, 1, from_hip, wraps, NULL, 3},
                                    {"cylinder", 2, 1, from_hip, wraps + 1, NULL, 4},
                                    {"ellipsoid", 2, 1, from_hip, wraps + 2, NULL, 5},
                                    {"torus", 2, 1, through_ring, wraps + 3, NULL, 6},
                                    {"in a row", 2, 2, in_a_row, row, NULL, 7},
                                    {"polynomial", 0, 0, NULL, NULL, &polynomial, 8},
                                    {"one side", 2, 1, from_hip, wraps + 4, NULL, 9}};
static const mhe_muscle muscles[N_P] = {
    {.name = "moving"},   {.name = "conditional"}, {.name = "sphere"},
    {.name = "cylinder"}, {.name = "ellipsoid"},   {.name = "torus"},
    {.name = "in a row"}, {.name = "polynomial"},  {.name = "one side"}};

static const mhe_description leg = {.size = sizeof leg,
                                    .name = "leg",
                                    .gravity = {0, -9.81, 0},
                                    .n_bodies = 3,
                                    .n_coordinates = N_Q,
                                    .n_muscles = N_P,
                                    .bodies = bodies,
                                    .coordinates = coordinates,
                                    .muscles = muscles,
                                    .n_dependents = 2,
                                    .dependents = dependents,
                                    .n_paths = N_P,
                                    .n_obstacles = 5,
                                    .paths = paths,
                                    .obstacles = obstacles};

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance)) {
        fail_msg("%.17g is not %.17g", value, expected);
    }
}

static test_instance instance;

static int setup(void **state) {
    (void)state;
    assert_int_equal(setenv("XDG_CACHE_HOME", MHE_TEST_BINARY_DIR "/paths-cache", 1), 0);
    assert_int_equal(system("rm -rf '" MHE_TEST_BINARY_DIR "/paths-cache'"), 0);
    test_open(&instance, &leg, 0);
    return 0;
}

static int teardown(void **state) {
    (void)state;
    test_close(&instance);
    return 0;
}

static void random_pose(uint64_t *seed, double *q) {
    for (int i = 0; i < N_Q; i++) {
        q[i] = test_random(seed, -0.5, 0.5) * (i == 4 ? 0.1 : 1);
    }
}

static int evaluate(const double *q, double *length, double *length_q, double *length_qq) {
    static const double still[N_Q] = {0};
    mhe_kinematics out = {
        .size = sizeof out, .length = length, .length_q = length_q, .length_qq = length_qq};
    return instance.ops->kinematics(instance.context, q, still, &out, NULL);
}

static int32_t watched; /* path */

static int length_of_q(void *data, const double *q, double *y) {
    double length[N_P];
    (void)data;
    int status = evaluate(q, length, NULL, NULL);
    *y = length[watched];
    return status;
}

static int gradient_of_q(void *data, const double *q, double *y) {
    double gradient[N_P * N_Q];
    (void)data;
    int status = evaluate(q, NULL, gradient, NULL);
    memcpy(y, gradient + watched * N_Q, N_Q * sizeof *y);
    return status;
}

static void derivatives_are_those_of_the_length(void **state) {
    (void)state;
    uint64_t seed = 3;
    double worst[2][N_P] = {{0}};
    int wrapped[N_P] = {0};
    for (int trial = 0; trial < 25; trial++) {
        double q[N_Q], length[N_P], gradient[N_P * N_Q], hessian[N_P * N_Q * N_Q];
        random_pose(&seed, q);
        assert_int_equal(evaluate(q, length, gradient, hessian), 0);
        for (watched = 0; watched < N_P; watched++) {
            double first =
                test_jacobian_error(length_of_q, NULL, q, N_Q, 1, gradient + watched * N_Q);
            double second = test_jacobian_error(gradient_of_q, NULL, q, N_Q, N_Q,
                                                hessian + watched * N_Q * N_Q);
            worst[0][watched] = fmax(worst[0][watched], first);
            worst[1][watched] = fmax(worst[1][watched], second);
            int same = fabs(length[watched] - length[2]) < 1e-6 && watched != 2;
            wrapped[watched] += !same;
        }
    }
    for (int i = 0; i < N_P; i++) {
        print_message("%s: first %.1e, second %.1e (%d)\n", paths[i].name, worst[0][i], worst[1][i],
                      wrapped[i]);
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
        random_pose(&seed, q[i]);
        assert_int_equal(evaluate(q[i], length[i], NULL, hessian[i]), 0);
    }
    for (int i = 19; i >= 0; i -= 3) {
        double again[N_P], second[N_P * N_Q * N_Q];
        assert_int_equal(evaluate(q[i], again, NULL, second), 0);
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
        random_pose(&seed, q);
        assert_int_equal(evaluate(q, length, NULL, NULL), 0);
        for (int32_t p = 0; p < N_P; p++) {
            int32_t n = instance.ops->path_points(instance.context, p, at[0], 64);
            double along = 0;
            assert_true(n <= 64 && (n >= 2 || paths[p].n_points == 0));
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
    mhe_path three[] = {{"both", 2, 2, in_a_row, row, NULL, 1},
                        {"egg", 2, 1, in_a_row, &egg, NULL, 1},
                        {"rod", 2, 1, in_a_row, &rod, NULL, 1}};
    mhe_description d = leg;
    test_instance other;
    uint64_t seed = 3;
    int more = 0;
    d.n_paths = d.n_muscles = 3;
    d.paths = three;
    test_open(&other, &d, 0);
    for (int trial = 0; trial < 60; trial++) {
        double q[N_Q], v[N_Q] = {0}, length[3];
        random_pose(&seed, q);
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
        random_pose(&seed, q);
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

/* ---- fitted ---- */

#define TOLERANCE 2e-3 /* m */

static mhe_coordinate ranged[N_Q];
static mhe_description fitted_leg;

static void fitted_open(test_instance *out) {
    fitted_leg = leg;
    memcpy(ranged, coordinates, sizeof ranged);
    for (int i = 0; i < N_Q; i++) {
        ranged[i].lower = i == 4 ? -0.05 : -0.5;
        ranged[i].upper = -ranged[i].lower;
        ranged[i].rotational = i != 4;
    }
    fitted_leg.coordinates = ranged;
    test_open_fitted(out, &fitted_leg, TOLERANCE, 0.5);
}

/* Errors are what was asked for, on poses that the fit has not seen; derivatives are those of the
 * fitted length; beyond the range it is exact, and points are still there to draw. */
static void fitted_paths_keep_their_tolerance(void **state) {
    (void)state;
    test_instance fitted, exact = instance;
    uint64_t seed = 99;
    double square[N_P] = {0}, worst = 0;
    fitted_open(&fitted);
    for (int trial = 0; trial < 200; trial++) {
        double q[N_Q], a[N_P], b[N_P];
        random_pose(&seed, q);
        for (int i = 0; i < N_Q; i++) {
            q[i] *= 0.5;
        }
        assert_int_equal(evaluate(q, a, NULL, NULL), 0);
        instance = fitted;
        assert_int_equal(evaluate(q, b, NULL, NULL), 0);
        instance = exact;
        for (int i = 0; i < N_P; i++) {
            square[i] += (a[i] - b[i]) * (a[i] - b[i]);
            worst = fmax(worst, fabs(a[i] - b[i]));
        }
    }
    int32_t off = 0;
    for (int i = 0; i < N_P; i++) {
        print_message("%s: %.3f mm RMS\n", paths[i].name, 1e3 * sqrt(square[i] / 200));
        assert_true(sqrt(square[i] / 200) < 1.3 * TOLERANCE);
        off += square[i] > 1e-12;
    }
    print_message("%d paths are fitted, worst %.2f mm\n", (int)off, 1e3 * worst);
    assert_true(off >= 4);
    instance = fitted;
    for (int trial = 0; trial < 5; trial++) {
        double q[N_Q], gradient[N_P * N_Q], hessian[N_P * N_Q * N_Q], at[3 * 64];
        random_pose(&seed, q);
        for (int i = 0; i < N_Q; i++) {
            q[i] *= 0.5;
        }
        assert_int_equal(evaluate(q, NULL, gradient, hessian), 0);
        for (watched = 0; watched < N_P; watched++) {
            assert_true(
                test_jacobian_error(length_of_q, NULL, q, N_Q, 1, gradient + watched * N_Q) < 1e-7);
            assert_true(test_jacobian_error(gradient_of_q, NULL, q, N_Q, N_Q,
                                            hessian + watched * N_Q * N_Q) < 1e-5);
        }
        assert_true(fitted.ops->path_points(fitted.context, 2, at, 64) >= 2);
    }
    double out[N_Q] = {0.1, 0.2, 0.7, 0.8, 0.02, 0.9}, a[N_P], b[N_P];
    assert_int_equal(evaluate(out, b, NULL, NULL), 0);
    instance = exact;
    assert_int_equal(evaluate(out, a, NULL, NULL), 0);
    for (int i = 0; i < N_P; i++) { /* (what does not depend on those stays fitted) */
        assert_near(b[i], a[i], i == 0 || i == 7 ? 1e-2 : 1e-12);
    }
    test_close(&fitted);
}

/* From the cache come the same bits; a file that is damaged is not believed. */
static void fits_are_kept(void **state) {
    (void)state;
    test_instance first, second, third, exact = instance;
    double q[N_Q] = {0.1, -0.2, 0.2, 0.2, 0.01, -0.2}, a[N_P], b[N_P], c[N_P];
    char command[1400];
    fitted_open(&first);
    fitted_open(&second);
    instance = first;
    assert_int_equal(evaluate(q, a, NULL, NULL), 0);
    instance = second;
    assert_int_equal(evaluate(q, b, NULL, NULL), 0);
    assert_memory_equal(a, b, sizeof a);
    (void)snprintf(command, sizeof command,
                   "for f in '%s'/mhe/paths-*.fit; do head -c 500 \"$f\" > \"$f.cut\" && mv "
                   "\"$f.cut\" \"$f\"; done",
                   MHE_TEST_BINARY_DIR "/paths-cache");
    assert_int_equal(system(command), 0);
    fitted_open(&third);
    instance = third;
    assert_int_equal(evaluate(q, c, NULL, NULL), 0);
    assert_memory_equal(a, c, sizeof a);
    instance = exact;
    test_close(&first);
    test_close(&second);
    test_close(&third);
}

static void a_point_inside_an_obstacle_is_told(void **state) {
    (void)state;
    mhe_description d = leg;
    mhe_obstacle larger[5];
    test_instance other;
    memcpy(larger, obstacles, sizeof larger);
    larger[0].size[0] = 0.5;
    d.obstacles = larger;
    test_open(&other, &d, 0);
    assert_non_null(strstr(test_told, "path 'sphere' (line 3) has a point inside 'ball'"));
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
    mhe_path path = paths[0];
    mhe_path_point points[4];
    mhe_path_wrap wrap = wraps[0];
    mhe_dependent circle[2] = {dependents[0], dependents[1]};
    d.obstacles = broken;
    memcpy(broken, obstacles, sizeof broken);
    broken[2].size[1] = 0;
    refused(&d, "obstacle 'egg': size 0 m");
    memcpy(broken, obstacles, sizeof broken);
    broken[3].size[0] = 0.05;
    refused(&d, "obstacle 'ring': the tube's radius");
    memcpy(broken, obstacles, sizeof broken);
    circle[0].independent = 7;
    d.dependents = circle;
    refused(&d, "dependent coordinate 'g'");
    d.dependents = dependents;
    d.n_paths = d.n_muscles = 1;
    d.paths = &path;
    path.points = points;
    memcpy(points, moving, sizeof points);
    points[1].coordinate[1] = 8;
    refused(&d, "path 'moving': point 2 moves");
    memcpy(points, conditional, sizeof conditional);
    path.n_points = 3;
    points[1].lower = 10;
    refused(&d, "path 'moving': point 2 is on in a range that is none");
    path = paths[2];
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
        cmocka_unit_test(fitted_paths_keep_their_tolerance),
        cmocka_unit_test(fits_are_kept),
        cmocka_unit_test(a_point_inside_an_obstacle_is_told),
        cmocka_unit_test(senseless_paths_are_refused),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

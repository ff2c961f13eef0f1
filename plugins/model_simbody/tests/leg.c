/* SPDX-License-Identifier: Apache-2.0 */
#include "leg.h"

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

const mhe_coordinate leg_coordinates[N_Q] = {{.name = "a"}, {.name = "b"}, {.name = "c"},
                                             {.name = "d"}, {.name = "e"}, {.name = "f"}};
const mhe_dependent leg_dependents[2] = {{{.name = "g"}, 3, {zero, bent, 1, 5}},
                                         {{.name = "h"}, 6, {zero, bent, 1, 5}}};

/* frames of obstacles are turned by a rotation of Pythagorean entries */
#define TURNED \
    { 0.8, -0.6, 0, 0.6, 0.8, 0, 0, 0, 1 }
const mhe_obstacle leg_obstacles[5] = {
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
const mhe_path_point leg_moving[4] = {
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
const mhe_path_point leg_conditional[3] = {
    {.body = -1, .location = {0.0, 0.2, 0.03}, .coordinate = {-1, -1, -1}},
    {.kind = MHE_POINT_CONDITIONAL,
     .body = 0,
     .location = {0.05, -0.1, 0.01},
     .coordinate = {7, -1, -1},
     .lower = 0.15,
     .upper = 9},
    {.body = 1, .location = {0.02, -0.15, 0.0}, .coordinate = {-1, -1, -1}}};
const mhe_path_point leg_in_a_row[2] = {
    {.body = -1, .location = {0.03, 0.2, 0.01}, .coordinate = {-1, -1, -1}},
    {.kind = MHE_POINT_MOVING,
     .body = 1,
     .location = {0.02, -0.15, 0.0},
     .coordinate = {-1, -1, 7},
     .function = {{0}, {0}, {pieces_origin, pieces, 2, 4}}}};
static const mhe_path_point through_ring[] = {
    {.body = 2, .location = {-0.08, 0.15, 0.01}, .coordinate = {-1, -1, -1}},
    {.body = 1, .location = {0.04, -0.15, 0.03}, .coordinate = {-1, -1, -1}}};

const mhe_path_wrap leg_wraps[5] = {
    {0, -1, -1, 0}, {1, -1, -1, 0}, {2, 0, 1, 0}, {3, -1, -1, 0}, {4, -1, -1, 0}};
const mhe_path_wrap leg_row[2] = {{2, -1, -1, 0}, {1, -1, -1, 0}};

static const int32_t in_numbers[] = {0, 7, 3};
static const double centre[] = {0.1, 0.2, -0.1}, scale[] = {0.7, 0.5, 0.9};
static const double terms[] = {0.3, 0.02, -0.03, 0.04, 0.01};
static const uint8_t exponents[] = {0, 0, 0, 1, 0, 0, 0, 2, 1, 3, 1, 1, 0, 0, 4};
static const mhe_polynomial polynomial = {3, in_numbers, centre, scale, 5, terms, exponents};

const mhe_path leg_paths[N_P] = {{"moving", 4, 0, leg_moving, NULL, NULL, 1},
                                 {"conditional", 3, 0, leg_conditional, NULL, NULL, 2},
                                 {"sphere", 2, 1, from_hip, leg_wraps, NULL, 3},
                                 {"cylinder", 2, 1, from_hip, leg_wraps + 1, NULL, 4},
                                 {"ellipsoid", 2, 1, from_hip, leg_wraps + 2, NULL, 5},
                                 {"torus", 2, 1, through_ring, leg_wraps + 3, NULL, 6},
                                 {"in a row", 2, 2, leg_in_a_row, leg_row, NULL, 7},
                                 {"polynomial", 0, 0, NULL, NULL, &polynomial, 8},
                                 {"one side", 2, 1, from_hip, leg_wraps + 4, NULL, 9}};
static const mhe_muscle muscles[N_P] = {
    {.name = "moving"},   {.name = "conditional"}, {.name = "sphere"},
    {.name = "cylinder"}, {.name = "ellipsoid"},   {.name = "torus"},
    {.name = "in a row"}, {.name = "polynomial"},  {.name = "one side"}};

const mhe_description leg = {.size = sizeof leg,
                             .name = "leg",
                             .gravity = {0, -9.81, 0},
                             .n_bodies = 3,
                             .n_coordinates = N_Q,
                             .n_muscles = N_P,
                             .bodies = bodies,
                             .coordinates = leg_coordinates,
                             .muscles = muscles,
                             .n_dependents = 2,
                             .dependents = leg_dependents,
                             .n_paths = N_P,
                             .n_obstacles = 5,
                             .paths = leg_paths,
                             .obstacles = leg_obstacles};

void leg_random(uint64_t *seed, double *q) {
    for (int i = 0; i < N_Q; i++) {
        q[i] = test_random(seed, -0.5, 0.5) * (i == 4 ? 0.1 : 1);
    }
}

int leg_lengths(const test_instance *instance, const double *q, double *length, double *length_q,
                double *length_qq) {
    static const double still[N_Q] = {0};
    mhe_kinematics out = {
        .size = sizeof out, .length = length, .length_q = length_q, .length_qq = length_qq};
    return instance->ops->kinematics(instance->context, q, still, &out, NULL);
}

int leg_length_of_q(void *data, const double *q, double *y) {
    const leg_watch *watch = data;
    double length[N_P];
    int status = leg_lengths(watch->instance, q, length, NULL, NULL);
    *y = length[watch->path];
    return status;
}

int leg_gradient_of_q(void *data, const double *q, double *y) {
    const leg_watch *watch = data;
    double gradient[N_P * N_Q];
    int status = leg_lengths(watch->instance, q, NULL, gradient, NULL);
    memcpy(y, gradient + watch->path * N_Q, N_Q * sizeof *y);
    return status;
}

/* SPDX-License-Identifier: Apache-2.0 */
/* made_up.c: a made-up skeleton: three bodies on a pin, a slider and a pin whose coordinate also
 * moves the joint along a spline; two muscles, a ligament and a spring, two markers, forces of
 * every kind. */
#include "kit.h"

#define IDENTITY \
    { 1, 0, 0, 0, 1, 0, 0, 0, 1 }

static const double zero = 0.0, minus_one = -1.0;
static const double linear[] = {0, 1};
static const double spline[] = {0.01, 0.02, 0.015, -0.008}; /* m over rad */
#define LINEAR \
    { &zero, linear, 1, 2 }

static const mhe_motion upper_motion[] = {{MHE_MOTION_ROTATION, 0, {0, 0, 1}, LINEAR}};
static const mhe_motion slide_motion[] = {{MHE_MOTION_TRANSLATION, 1, {0.6, 0, 0.8}, LINEAR}};
static const mhe_motion lower_motion[] = {
    {MHE_MOTION_ROTATION, 2, {0.36, 0.48, 0.8}, LINEAR},
    {MHE_MOTION_TRANSLATION, 2, {0, 1, 0}, {&minus_one, spline, 1, 4}}};

static const mhe_body bodies[] = {{"upper",
                                   -1,
                                   1,
                                   upper_motion,
                                   IDENTITY,
                                   {0, 0.1, 0},
                                   IDENTITY,
                                   {0, 0, 0},
                                   1.9,
                                   {0.01, -0.15, 0.02},
                                   {0.014, 0.001, 0, 0.001, 0.003, 0, 0, 0, 0.015}},
                                  {"sleeve",
                                   0,
                                   1,
                                   slide_motion,
                                   {0, -1, 0, 1, 0, 0, 0, 0, 1},
                                   {0.02, -0.2, 0},
                                   IDENTITY,
                                   {0.01, 0, 0},
                                   0.4,
                                   {0, 0.02, 0},
                                   {0.001, 0, 0, 0, 0.002, 0, 0, 0, 0.0015}},
                                  {"lower",
                                   1,
                                   2,
                                   lower_motion,
                                   IDENTITY,
                                   {0, -0.1, 0.01},
                                   {0, 0, 1, 1, 0, 0, 0, 1, 0},
                                   {0, 0.01, 0.02},
                                   1.3,
                                   {0.02, -0.12, 0.01},
                                   {0.009, 0, 0.0004, 0, 0.0012, 0, 0.0004, 0, 0.0095}}};

static const mhe_coordinate coordinates[] = {
    {"swing", 1, -3.0, 3.0, 0, 0}, {"slide", 0, -0.2, 0.2, 0, 0}, {"bend", 1, -2.0, 2.0, 0, 0}};
static const mhe_marker markers[MHI_MADE_UP_MARKERS] = {{"near", 0, {0.03, -0.1, 0.02}},
                                                        {"far", 2, {0.01, -0.25, 0.04}}};
static const mhe_path_point long_path[] = {{.body = -1, .location = {0.05, 0.15, 0.02}},
                                           {.body = 0, .location = {0.04, -0.1, 0.03}},
                                           {.body = 2, .location = {0.03, -0.05, 0.02}}};
static const mhe_path_point short_path[] = {{.body = 0, .location = {-0.03, -0.1, 0.0}},
                                            {.body = 1, .location = {-0.02, -0.05, 0.01}}};

static const mhe_path_point cord_path[] = {{.body = -1, .location = {0.04, 0.1, -0.03}},
                                           {.body = 2, .location = {0.02, -0.06, -0.02}}};
static const mhe_path paths[MHI_MADE_UP_PATHS] = {
    {.name = "long", .n_points = 3, .points = long_path},
    {.name = "short", .n_points = 2, .points = short_path},
    {.name = "cord", .n_points = 2, .points = cord_path},
    {.name = "band", .n_points = 3, .points = long_path}};

static const mhe_coordinate_limit limits[] = {{.name = "bend_limit",
                                               .coordinate = 2,
                                               .upper = 0.6,
                                               .lower = -0.7,
                                               .upper_stiffness = 90,
                                               .lower_stiffness = 70,
                                               .damping = 2,
                                               .transition = 0.3}};
static const mhe_path_spring springs[] = {
    {.path = 2, .stiffness = 800, .rest = 0.2, .dissipation = 0.4}};
static const double band_coef[] = {0.0, 0.2, 0.9};
static const mhe_ligament ligaments[] = {
    {.path = 3, .rest = 0.15, .scale = 60, .curve = {&zero, band_coef, 1, 3}}};
static const mhe_coordinate_spring coordinate_springs[] = {
    {.name = "swing_spring", .coordinate = 0, .stiffness = 30, .rest = 0.2, .viscosity = 1.5}};

const mhe_description *mhi_kit_description(void) {
    static mhe_muscle muscles[MHI_MADE_UP_MUSCLES];
    static const mhe_description description = {.size = sizeof description,
                                                .name = "made up",
                                                .source = "testkit",
                                                .gravity = {0, -9.81, 0},
                                                .n_bodies = MHI_MADE_UP_BODIES,
                                                .n_coordinates = MHI_MADE_UP_Q,
                                                .n_markers = MHI_MADE_UP_MARKERS,
                                                .n_muscles = MHI_MADE_UP_MUSCLES,
                                                .bodies = bodies,
                                                .coordinates = coordinates,
                                                .markers = markers,
                                                .muscles = muscles,
                                                .n_paths = MHI_MADE_UP_PATHS,
                                                .paths = paths,
                                                .n_limits = 1,
                                                .limits = limits,
                                                .n_path_springs = 1,
                                                .path_springs = springs,
                                                .n_ligaments = 1,
                                                .ligaments = ligaments,
                                                .n_coordinate_springs = 1,
                                                .coordinate_springs = coordinate_springs};
    for (int i = 0; i < MHI_MADE_UP_MUSCLES; i++) {
        muscles[i] = mhe_muscle_unstated(paths[i].name);
        muscles[i].max_isometric_force = 500;
        muscles[i].optimal_fiber_length = 0.1;
        muscles[i].tendon_slack_length = 0.1;
        muscles[i].pennation_angle = 0;
    }
    return &description;
}

/* SPDX-License-Identifier: Apache-2.0 */
/* The reduction of descriptions: what merges, what remains, what is refused. */
#include "numbers.h"
#include "support.h"
#include "tree.h"

#include <math.h>
#include <string.h>

#define UNIT \
    { 1, 0, 0, 0, 1, 0, 0, 0, 1 }

static const double zero[] = {0};
static const double straight[] = {0, 1};
static const double still[] = {0.5, 0, 0, 0};
static const mhe_motion pin[] = {{MHE_MOTION_ROTATION, 0, {0, 0, 1}, {zero, straight, 1, 2}}};
static const mhe_motion slides[] = {{MHE_MOTION_TRANSLATION, -1, {0, 1, 0}, {zero, still, 1, 4}},
                                    {MHE_MOTION_TRANSLATION, 1, {1, 0, 0}, {zero, still, 1, 4}}};
static const mhe_motion twist[] = {{MHE_MOTION_ROTATION, 1, {1, 0, 0}, {zero, straight, 1, 2}}};
static const mhe_coordinate coordinates[] = {{.name = "first"}, {.name = "second"}};

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance)) {
        fail_msg("%.17g is not %.17g", value, expected);
    }
}

/* ground - pin - a - (b moved by constants only) - twist - c */
typedef struct chain {
    mhe_body bodies[3];
    mhe_marker markers[2];
    mhe_path_point points[4];
    mhe_muscle muscles[1];
    mhe_path paths[1];
    mhe_description d;
} chain;

static void make_chain(chain *c) {
    const chain made = {
        .bodies = {{"a", -1, 1, pin, UNIT, {0, 0, 0.5}, UNIT, {0}, 2, {1, 0, 0}, UNIT},
                   {"b", 0, 2, slides, UNIT, {0, 0, 1}, UNIT, {0}, 6, {0}, UNIT},
                   {"c", 1, 1, twist, UNIT, {0}, UNIT, {0, 0, 0.25}, 1, {0}, UNIT}},
        .markers = {{"on b", 1, {0, 0, 1}}, {"on ground", -1, {1, 2, 3}}},
        .points = {{.body = -1, .location = {0}},
                   {.body = 0, .location = {1, 0, 0}},
                   {.body = 1, .location = {1, 0, 0}},
                   {.body = 2, .location = {0}}},
        .muscles = {{.name = "m"}},
        .paths = {{.name = "m", .n_points = 4}},
        .d = {.name = "chain",
              .n_bodies = 3,
              .n_coordinates = 2,
              .n_markers = 2,
              .n_muscles = 1,
              .n_paths = 1,
              .coordinates = coordinates}};
    *c = made;
    c->paths[0].points = c->points;
    c->d.bodies = c->bodies;
    c->d.markers = c->markers;
    c->d.muscles = c->muscles;
    c->d.paths = c->paths;
}

static void bodies_that_do_not_move_are_one_link(void **state) {
    (void)state;
    chain c;
    tree *t = NULL;
    make_chain(&c);
    assert_int_equal(tree_create(&c.d, &t, NULL), MHE_OK);
    assert_int_equal(t->n_joints, 2);
    assert_int_equal(t->joints[0].parent, -1);
    assert_int_equal(t->joints[1].parent, 0);
    assert_int_equal(t->joints[1].coordinate, 1);
    /* b is 0.5 along x and y and 1 along z from a: masses 2 at (1,0,0), 6 at (0.5, 0.5, 1). The
     * link's frame is turned about z by the choice of the pin's frame, so only what does not
     * depend on that is compared. */
    const tree_joint *link = &t->joints[0];
    double reduced = 2.0 * 6 / 8, apart = 0.25 + 0.25 + 1;
    double radius = hypot(link->com[0], link->com[1]);
    assert_near(link->mass, 8, 1e-15);
    assert_near(radius, hypot((2 + 3) / 8.0, 3 / 8.0), 1e-15);
    assert_near(link->com[2], 6.0 / 8, 1e-15);
    assert_near(link->inertia[8], 2 + reduced * 0.5, 1e-14);
    assert_near(link->inertia[0] + link->inertia[4] + link->inertia[8], 6 + 2 * reduced * apart,
                1e-14);
    assert_int_equal(t->markers[0].link, 0);
    assert_near(t->markers[0].at[2], 2, 1e-15);
    assert_int_equal(t->markers[1].link, -1);
    tree_free(t);
}

static void only_segments_between_links_remain(void **state) {
    (void)state;
    chain c;
    tree *t = NULL;
    make_chain(&c);
    assert_int_equal(tree_create(&c.d, &t, NULL), MHE_OK);
    assert_int_equal(t->n_segments, 2); /* ground-a and b-c; a-b is one link */
    double inside = sqrt(0.5 * 0.5 + 0.5 * 0.5 + 1);
    assert_near(t->fixed_length[0], inside, 1e-15);
    assert_int_equal(t->segments[0].n_to, 1);
    assert_int_equal(t->segments[0].n_from, 0);
    assert_int_equal(t->segments[0].joints[0], 0);
    assert_int_equal(t->segments[1].n_to, 1); /* the pin carries both ends and is left out */
    assert_int_equal(t->segments[1].joints[0], 1);
    tree_free(t);
}

static void functions_and_their_derivatives(void **state) {
    (void)state;
    const double origin[] = {9, 1, 2}, coef[] = {1, 2, 0, 0, 3, 1, 1, 1, -1, 0, 4, 0};
    const mhe_function f = {origin, coef, 3, 4};
    double y[4];
    function_evaluate(&f, 0.5, y); /* piece 0 about 9 */
    assert_near(y[0], 1 + 2 * -8.5, 1e-15);
    assert_near(y[1], 2, 1e-15);
    function_evaluate(&f, 1, y); /* a knot belongs to the piece that begins there */
    assert_near(y[0], 3, 1e-15);
    function_evaluate(&f, 1.5, y);
    assert_near(y[0], 3 + 0.5 + 0.25 + 0.125, 1e-15);
    assert_near(y[1], 1 + 1 + 0.75, 1e-15);
    assert_near(y[2], 2 + 3, 1e-15);
    assert_near(y[3], 6, 1e-15);
    function_evaluate(&f, 4, y);
    assert_near(y[0], -1 + 16, 1e-15);
    assert_near(y[2], 8, 1e-15);
}

static void assert_refused(const chain *c, const char *text) {
    tree *t = NULL;
    mhe_error err = {0};
    assert_int_equal(tree_create(&c->d, &t, &err), MHE_E_INPUT);
    assert_null(t);
    if (strstr(err.text, text) == NULL) {
        fail_msg("'%s' does not say '%s'", err.text, text);
    }
}

static void wrong_descriptions_are_refused(void **state) {
    (void)state;
    chain c;
    mhe_motion wrong = pin[0];
    make_chain(&c);
    c.bodies[1].mass = -1;
    assert_refused(&c, "body 'b': mass -1");
    make_chain(&c);
    c.bodies[1].mass = NAN;
    assert_refused(&c, "body 'b': mass");
    make_chain(&c);
    c.bodies[1].parent = 2;
    assert_refused(&c, "body 'b': its parent");
    make_chain(&c);
    c.bodies[2].joint_r[0] = 2;
    assert_refused(&c, "body 'c': a frame");
    make_chain(&c);
    c.bodies[0].motions = &wrong;
    wrong.coordinate = 2;
    assert_refused(&c, "body 'a': a motion of coordinate 2");
    wrong = pin[0];
    wrong.axis[1] = 1;
    assert_refused(&c, "body 'a': a motion's axis");
    wrong = pin[0];
    wrong.function.n_pieces = 0;
    assert_refused(&c, "body 'a': a motion's function");
    make_chain(&c);
    c.markers[0].body = 3;
    assert_refused(&c, "marker 'on b'");
    make_chain(&c);
    c.paths[0].n_points = 1;
    assert_refused(&c, "path 'm'");
    make_chain(&c);
    c.points[2].location[1] = INFINITY;
    assert_refused(&c, "path 'm'");
    make_chain(&c);
    c.bodies[0].body_r[8] = -1;
    assert_refused(&c, "coordinate 'second': its joint's frame is mirrored");
}

/* As in a shoulder model of biobuddy: one frame swaps two axes, the next swaps them back. */
static void coordinates_without_mass_are_known(void **state) {
    (void)state;
    chain c;
    tree *t = NULL;
    make_chain(&c);
    c.bodies[2].mass = 0;
    assert_int_equal(tree_create(&c.d, &t, NULL), MHE_OK);
    assert_true(tree_moves_mass(t, 0));
    assert_false(tree_moves_mass(t, 1));
    tree_free(t);
}

static void frames_with_few_digits_are_noticed(void **state) {
    (void)state;
    chain c;
    tree *t = NULL;
    make_chain(&c);
    c.bodies[2].body_r[1] = 1e-9; /* within the last link, which turns as a whole */
    assert_int_equal(tree_create(&c.d, &t, NULL), MHE_OK);
    assert_int_equal(t->rounded, 0);
    tree_free(t);
    c.bodies[1].body_r[1] = 1e-9; /* carries the last link's joint */
    assert_int_equal(tree_create(&c.d, &t, NULL), MHE_OK);
    assert_int_equal(t->rounded, 1);
    tree_free(t);
}

static void mirrored_frames_that_cancel_are_allowed(void **state) {
    (void)state;
    chain c;
    tree *t = NULL;
    make_chain(&c);
    c.bodies[1].joint_r[8] = -1;
    c.bodies[1].body_r[8] = -1;
    assert_int_equal(tree_create(&c.d, &t, NULL), MHE_OK);
    assert_near(t->markers[0].at[2], 2, 1e-15);
    tree_free(t);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bodies_that_do_not_move_are_one_link),
        cmocka_unit_test(only_segments_between_links_remain),
        cmocka_unit_test(functions_and_their_derivatives),
        cmocka_unit_test(wrong_descriptions_are_refused),
        cmocka_unit_test(coordinates_without_mass_are_known),
        cmocka_unit_test(frames_with_few_digits_are_noticed),
        cmocka_unit_test(mirrored_frames_that_cancel_are_allowed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

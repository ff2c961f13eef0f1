/* SPDX-License-Identifier: Apache-2.0 */
/* Strings that let go of their obstacle: no length jumps, and derivatives are the length's own. */
#include "scene.h"
#include "vector.h"
#include "wrap/fade.h"

#include <math.h>
#include <string.h>

static const int both_move[2] = {1, 1};
static const int all_hold = HOLD_ANY | HOLD_P | HOLD_S;

static void straight_derivatives(const scene *c, double *length, double *g) {
    double d[3] = {c->ends[3] - c->ends[0], c->ends[4] - c->ends[1], c->ends[5] - c->ends[2]};
    *length = sqrt(dot3(d, d));
    for (int i = 0; i < 3; i++) {
        g[i] = -d[i] / *length;
        g[3 + i] = d[i] / *length;
    }
}

/* Length with the fading, as paths have it, with its gradient; `h` (second derivatives) is set
 * where it fades. 1: there. */
static int fading(const scene *c, double *length, double *g, double *h) {
    double pp[9], ps[9], ss[9];
    wrap_string string;
    if (solve(c, &string) <= 0) {
        straight_derivatives(c, length, g);
        return 0;
    }
    if (!wrap_fades(&c->surface, c->ends, c->ends + 3, both_move, all_hold, &string)) {
        *length = wrap_length(&string);
        gradient(&string, g);
        return 0;
    }
    *length =
        wrap_faded(&c->surface, c->ends, c->ends + 3, both_move, all_hold, &string, g, pp, ps, ss);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            h[6 * i + j] = pp[3 * i + j];
            h[6 * i + 3 + j] = ps[3 * i + j];
            h[6 * (3 + i) + j] = ps[3 * j + i];
            h[6 * (3 + i) + 3 + j] = ss[3 * i + j];
        }
    }
    return 1;
}

static double fading_length(const scene *c) {
    double length, g[6], h[36];
    (void)fading(c, &length, g, h);
    return length;
}

static int fading_of_ends(void *data, const double *ends, double *y) {
    scene c = *(const scene *)data;
    memcpy(c.ends, ends, sizeof c.ends);
    *y = fading_length(&c);
    return 0;
}

static int fading_gradient_of_ends(void *data, const double *ends, double *y) {
    scene c = *(const scene *)data;
    double length, h[36];
    memcpy(c.ends, ends, sizeof c.ends);
    (void)fading(&c, &length, y, h);
    return 0;
}

/* The worst errors of first and second derivatives, and the most that lengths differ by, in m. */
typedef struct tally {
    int met;
    double first, second, most;
} tally;

static void count(tally *all, const scene *c, const double *g, const double *h, double most) {
    scene at = *c;
    all->met++;
    all->most = fmax(all->most, most);
    all->first = fmax(all->first, test_jacobian_error(fading_of_ends, &at, at.ends, 6, 1, g));
    all->second =
        fmax(all->second, test_jacobian_error(fading_gradient_of_ends, &at, at.ends, 6, 6, h));
}

/* As many as wanted were met, they differ by more than a millimetre, and derivatives are the
 * length's own. */
static void assert_own_derivatives(const tally *all, int wanted, const char *what) {
    print_message("%d %s, first %.1e, second %.1e, by up to %.1f mm\n", all->met, what, all->first,
                  all->second, 1e3 * all->most);
    assert_int_equal(all->met, wanted);
    assert_true(all->most > 1e-3);
    assert_true(all->first < 1e-7);
    assert_true(all->second < 1e-5);
}

/* Brings end p `out` outside the surface, along a line from the middle (of a torus, of its section
 * there). 0: done. */
static int bring_near(scene *c, double out) {
    double low = 0, high = 8, middle[3] = {0, 0, 0}, way[3];
    wrap_string string;
    if (c->surface.kind == MHE_OBSTACLE_TORUS) {
        double rho = hypot(c->ends[0], c->ends[1]);
        middle[0] = c->ends[0] / rho * c->surface.size[1];
        middle[1] = c->ends[1] / rho * c->surface.size[1];
    }
    for (int i = 0; i < 3; i++) {
        way[i] = c->ends[i] - middle[i];
    }
    for (int k = 0; k < 60; k++) {
        double at = 0.5 * (low + high);
        scene far = *c;
        for (int i = 0; i < 3; i++) {
            far.ends[i] = middle[i] + at * way[i];
            far.ends[3 + i] = i < 2 ? 1 : 2;
        }
        *(solve(&far, &string) == WRAP_INSIDE ? &low : &high) = at;
    }
    for (int i = 0; i < 3; i++) {
        c->ends[i] = middle[i] + (high + out / sqrt(dot3(way, way))) * way[i];
    }
    return high < 8 ? 0 : -1;
}

/* Where an end comes into the obstacle, the length goes over into the straight line's without a
 * jump, and its derivatives are its own all the way. */
static void letting_go_is_no_jump(void **state) {
    (void)state;
    static const char *const kinds[] = {"let go of spheres", "of cylinders", "of ellipsoids",
                                        "of tori"};
    uint64_t seed = 47;
    for (int32_t kind = MHE_OBSTACLE_SPHERE; kind <= MHE_OBSTACLE_TORUS; kind++) {
        tally all = {0};
        for (int trial = 0; trial < 20000 && all.met < 60; trial++) {
            scene c = random_scene(kind, &seed), at = c;
            wrap_string string;
            double length, y[6], h[36], excess = 0;
            if (bring_near(&at, test_random(&seed, 3e-4, 2e-3)) != 0 ||
                fading(&at, &length, y, h) == 0) {
                continue;
            }
            (void)bring_near(&c, 1e-9);
            double straight, unused[6];
            straight_derivatives(&c, &straight, unused);
            if (solve(&c, &string) > 0) {
                excess = wrap_length(&string) - straight;
            }
            count(&all, &at, y, h, excess);
            assert_near(fading_length(&c), straight, 1e-9);
        }
        assert_own_derivatives(&all, 60, kinds[kind]);
    }
}

/* A string pulled along the cylinder until it is off: no step is longer than the way allows. */
static void slipping_off_is_no_jump(void **state) {
    (void)state;
    scene c = {.surface = {.kind = MHE_OBSTACLE_CYLINDER, .side_axis = -1, .size = {0.01, 0.04}},
               .ends = {-0.03, 0.004, 0, 0.04, -0.003, 0.005}};
    double last = fading_length(&c), whole = last, y[6], h[36], length;
    int met = 0;
    for (int k = 1; k <= 4000; k++) {
        for (int e = 0; e < 2; e++) {
            c.ends[3 * e + 2] = 0.03 * k / 4000 + (e ? 0.005 : 0);
        }
        if (fading(&c, &length, y, h) && k % 20 == 0) {
            assert_true(test_jacobian_error(fading_of_ends, &c, c.ends, 6, 1, y) < 1e-7);
            assert_true(test_jacobian_error(fading_gradient_of_ends, &c, c.ends, 6, 6, h) < 1e-5);
            met++;
        }
        assert_near(length, last, 5e-5);
        last = length;
    }
    straight_derivatives(&c, &length, y);
    assert_near(last, length, 1e-12);
    assert_true(whole > last + 2e-3 && met > 5);
}

/* A string whose tangent point crosses the border of the side asked for turns about the cylinder:
 * from the length one way round to that of the other, with derivatives of its own. */
static void turning_about_is_no_jump(void **state) {
    (void)state;
    uint64_t seed = 59;
    tally all = {0};
    int turned = 0;
    for (int trial = 0; trial < 20000 && all.met < 60; trial++) {
        scene c = random_scene(MHE_OBSTACLE_CYLINDER, &seed);
        wrap_string string, ways[2];
        double y[6], h[36], length;
        jet share;
        c.surface.side_axis = trial % 2;
        c.surface.side_sign = trial % 4 < 2 ? 1 : -1;
        if (solve(&c, &string) <= 0 || string.other < 0.02) {
            continue;
        }
        assert_int_equal(fading(&c, &length, y, h), 1);
        wrap_both_ways(&c.surface, c.ends, c.ends + 3, &ways[0], &ways[1], &share);
        count(&all, &c, y, h, fabs(wrap_length(&ways[0]) - wrap_length(&ways[1])));
    }
    assert_own_derivatives(&all, 60, "turn");
    /* one end goes about the axis: the way round changes, and no step is a jump */
    scene c = {.surface = {.kind = MHE_OBSTACLE_CYLINDER,
                           .side_axis = 0,
                           .side_sign = 1,
                           .size = {0.01, 0.2}},
               .ends = {-0.03, 0.001, 0, 0.04, 0, 0.005}};
    double last = NAN;
    int way = 0;
    for (int k = 0; k <= 4000; k++) {
        double angle = 3.1 + 0.55 * k / 4000;
        wrap_string string;
        c.ends[0] = 0.03 * cos(angle);
        c.ends[1] = 0.03 * sin(angle);
        double length = fading_length(&c);
        assert_true(solve(&c, &string) > 0);
        double about_axis = string.n[0][0] * string.t[0][1] - string.n[0][1] * string.t[0][0];
        int now = about_axis > 0 ? 1 : -1;
        turned += way != 0 && now != way;
        way = now;
        assert_true(k == 0 || fabs(length - last) < 5e-5);
        last = length;
    }
    assert_int_equal(turned, 1);
}

/* Strings that are held on one side of an ellipsoid and begin to slip over: between the length of
 * the string held and that of the shortest, with derivatives of its own. */
static void slipping_over_has_its_own_derivatives(void **state) {
    (void)state;
    uint64_t seed = 53;
    tally all = {0};
    for (int trial = 0; trial < 200000 && all.met < 40; trial++) {
        scene c = random_scene(MHE_OBSTACLE_ELLIPSOID, &seed);
        wrap_string string, shortest, pass;
        double y[6], h[36], length;
        c.surface.side_axis = trial % 3;
        c.surface.side_sign = trial % 2 ? 1 : -1;
        if (solve(&c, &string) <= 0 || !string.held ||
            !wrap_slips(&c.surface, c.ends, c.ends + 3, &string, &shortest, &pass)) {
            continue;
        }
        double over = wrap_length(&string) - wrap_length(&shortest);
        int one_fades =
            wrap_outside(&c.surface, c.ends) > over && wrap_outside(&c.surface, c.ends + 3) > over;
        assert_true(over > 0 && wrap_length(&pass) > wrap_length(&string));
        if (!one_fades || !fading(&c, &length, y, h)) {
            continue;
        }
        double left = (length - wrap_length(&shortest)) / over;
        assert_true(left > -1e-9 && left < 1 + 1e-9);
        if (left > 0.05 && left < 0.95) {
            count(&all, &c, y, h, over);
        }
    }
    assert_own_derivatives(&all, 40, "slip");
}

/* Where the string goes on or off while the straight line is free, nothing but the side has held
 * it: on the way there it fades. */
static void what_the_side_holds_goes_without_a_jump(void **state) {
    (void)state;
    uint64_t seed = 59;
    tally all = {0};
    int changes = 0;
    double most = 0;
    for (int trial = 0; trial < 20000 && (all.met < 60 || changes < 60); trial++) {
        scene c = random_scene(MHE_OBSTACLE_CYLINDER, &seed), other;
        scene two[2] = {c, random_scene(MHE_OBSTACLE_CYLINDER, &seed)};
        wrap_string string;
        double length, y[6], h[36];
        for (int e = 0; e < 2; e++) {
            two[e].surface = c.surface;
            two[e].surface.side_axis = trial % 2;
            two[e].surface.side_sign = trial % 4 < 2 ? 1 : -1;
            memcpy(two[e].ends, c.ends, 3 * sizeof c.ends[0]);
        }
        c = two[0];
        if (all.met < 60 && solve(&c, &string) == WRAP_POSSIBLE && fading(&c, &length, y, h) &&
            string.other == 0 && wrap_outside(&c.surface, c.ends) > 0.02 &&
            wrap_outside(&c.surface, c.ends + 3) > 0.02) {
            count(&all, &c, y, h, wrap_length(&string) - length);
        }
        int on[2] = {solve(&two[0], &string), solve(&two[1], &string)};
        if (on[0] == WRAP_INSIDE || on[1] == WRAP_INSIDE || (on[0] > 0) == (on[1] > 0)) {
            continue;
        }
        for (int k = 0; k < 60; k++) { /* to where it changes */
            other = two[0];
            for (int i = 3; i < 6; i++) {
                other.ends[i] = 0.5 * (two[0].ends[i] + two[1].ends[i]);
            }
            int now = solve(&other, &string);
            two[(now > 0) == (on[1] > 0)] = other;
        }
        on[0] = solve(&two[0], &string);
        on[1] = solve(&two[1], &string);
        if (on[0] == WRAP_POSSIBLE || on[1] == WRAP_POSSIBLE) {
            (void)solve(&two[on[1] == WRAP_POSSIBLE], &string);
            most = fmax(most, wrap_length(&string));
            changes++;
            assert_near(fading_length(&two[0]), fading_length(&two[1]), 1e-9);
        }
    }
    print_message("%d go on or off, with strings of up to %.0f mm\n", changes, 1e3 * most);
    assert_true(changes >= 60);
    assert_own_derivatives(&all, 60, "held by the side");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(letting_go_is_no_jump),
        cmocka_unit_test(slipping_off_is_no_jump),
        cmocka_unit_test(turning_about_is_no_jump),
        cmocka_unit_test(slipping_over_has_its_own_derivatives),
        cmocka_unit_test(what_the_side_holds_goes_without_a_jump),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

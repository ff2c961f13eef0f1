/* SPDX-License-Identifier: Apache-2.0 */
/* The cone of a socket: nothing inside, the distance outside, and what is refused. */
#include "support.h"
#include "use.h"

#include <mhe/cost.h>

#include <math.h>
#include <string.h>

#define STABILITY "mhe.cost.joint-stability"
#define SMOOTH 2.0

static int32_t find_signal(const mhe_problem *problem, const char *name, int32_t *n_y,
                           const char **unit) {
    (void)problem, (void)unit;
    if (n_y != NULL) {
        *n_y = 3;
    }
    return strcmp(name, "joint_reaction/glenohumeral") == 0 ? 0 : -1;
}

typedef struct rig {
    const mhe_cost_ops *ops;
    const void *self;
    mhe_cost_layout layout;
    mhe_error err;
} rig;

static mhe_status lay_out(rig *r, const char *yaml) {
    const mhe_problem problem = {.size = sizeof problem, .find_signal = find_signal};
    const mhe_plugin *plugin = test_plugin(STABILITY, MHE_COST_IFACE);
    *r = (rig){.layout = {.size = sizeof r->layout}};
    if (plugin == NULL) {
        skip();
    }
    r->ops = plugin->ops;
    r->self = test_config(plugin, yaml);
    return r->ops->layout(r->self, &problem, &r->layout, &r->err);
}

/* Out along (0.6, 0, 0.8), half angle 0.5. */
static void open_rig(rig *r) {
    assert_int_equal(lay_out(r, "{joint: glenohumeral, axis: [3, 0, 4], angle: 0.5, smooth: 2}"),
                     MHE_OK);
    assert_int_equal(r->layout.n_res, 1);
    assert_int_equal(r->layout.jacobian, MHE_JACOBIAN_DENSE);
    assert_string_equal(r->layout.res_unit, "N");
}

static int residual(void *data, const double *y, double *out) {
    rig *r = data;
    const double target[3] = {NAN, NAN, NAN};
    const mhe_stage stage = {.size = sizeof stage, .ny = 3, .y = y, .y_ref = target};
    return r->ops->residual(r->self, &stage, out, &r->err);
}

/* A force of `size` at `angle` from the axis, turned about it by `turn`. */
static void force(double size, double angle, double turn, double *y) {
    const double n[3] = {0.6, 0, 0.8}, a[3] = {0, 1, 0}, b[3] = {-0.8, 0, 0.6};
    for (int i = 0; i < 3; i++) {
        y[i] = size * (cos(angle) * n[i] + sin(angle) * (cos(turn) * a[i] + sin(turn) * b[i]));
    }
}

static double at(rig *r, double size, double angle, double turn) {
    double y[3], out = NAN;
    force(size, angle, turn, y);
    assert_int_equal(residual(r, y, &out), MHE_OK);
    return out;
}

static void nothing_inside_the_distance_outside(void **state) {
    (void)state;
    rig r;
    open_rig(&r);
    for (double turn = 0; turn < 6; turn += 0.7) {
        assert_true(at(&r, 500, 0, turn) == 0);
        assert_true(at(&r, 500, 0.499, turn) == 0);
        const double distance = 500 * sin(0.9 - 0.5); /* of a point to the cone's side */
        assert_true(fabs(at(&r, 500, 0.9, turn) - distance) < 2 * SMOOTH);
        assert_true(at(&r, 500, 3, turn) > at(&r, 500, 1.2, turn) / 2); /* pulled out of it */
    }
    assert_true(at(&r, 0, 0, 0) == 0); /* no force, no fault */
    assert_true(at(&r, 100, 3.14159, 0) > 40);
}

static void derivatives_match_differences(void **state) {
    (void)state;
    rig r;
    uint64_t seed = 4;
    open_rig(&r);
    for (int trial = 0; trial < 60; trial++) {
        double y[3], J[3] = {0, 0, 0};
        const double size = trial % 3 == 0 ? test_random(&seed, 0, 20) : 400;
        force(size, test_random(&seed, 0, trial % 2 == 0 ? 3.1 : 0.6), test_random(&seed, 0, 6), y);
        const mhe_stage stage = {.size = sizeof stage, .ny = 3, .y = y, .y_ref = y};
        assert_int_equal(r.ops->jacobian(r.self, &stage, J, &r.err), MHE_OK);
        const double error = test_jacobian_error(residual, &r, y, 3, 1, J);
        assert_true(error >= 0 && error < 1e-6);
    }
}

static void what_is_not_known_stays_unknown(void **state) {
    (void)state;
    rig r;
    double out = 0;
    const double y[3] = {NAN, NAN, NAN};
    open_rig(&r);
    assert_int_equal(residual(&r, y, &out), MHE_OK);
    assert_true(isnan(out));
}

static void test_refused(void **state) {
    (void)state;
    rig r;
    assert_int_equal(lay_out(&r, "{joint: elbow, axis: [0, 0, 1]}"), MHE_E_CONFIG);
    assert_string_equal(r.err.text, "joint: the problem has no signal 'joint_reaction/elbow'");
    assert_int_equal(lay_out(&r, "{joint: glenohumeral, axis: [0, 0]}"), MHE_E_CONFIG);
    assert_string_equal(r.err.text,
                        "axis: three numbers that are not all 0, as [0, 0, 1] (there are 2)");
    assert_int_equal(lay_out(&r, "{joint: glenohumeral, axis: [0, 0, 0]}"), MHE_E_CONFIG);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(nothing_inside_the_distance_outside),
                                       cmocka_unit_test(derivatives_match_differences),
                                       cmocka_unit_test(what_is_not_known_stays_unknown),
                                       cmocka_unit_test(test_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

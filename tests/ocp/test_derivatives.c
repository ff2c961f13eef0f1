/* SPDX-License-Identifier: Apache-2.0 */
/* Everything a solver is given against central differences, on the 19-muscle arm with the real
 * plugins: accelerations, shooting intervals, cost gradients; both formulations, with and without
 * residual torques; what joints pass on among them. */
#include "fixture.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TOLERANCE 1e-6 /* what the project demands of every derivative */

static const char *const problems[] = {
    "model: {file: $ARM19}\nmuscle: {curves: paper2021}\ncosts: [{plugin: "
    "mhe.cost.emg-markers-high}]\n",
    "model: {file: $ARM19}\nmuscle: {curves: paper2021}\nformulation: activation\n"
    "bounds: {residual_torques: true}\ncosts: [{plugin: mhe.cost.emg-markers-low}]\n",
    "model: {file: $ARM19}\nmuscle: {curves: degroote2016}\nbounds: {residual_torques: true}\n"
    "costs: [{plugin: mhe.cost.min-excitation}, {plugin: mhe.cost.emg-markers-high, tracked: [BRA, "
    "BRD]}]\n",
    "model: {file: $ARM35}\nmuscle: {curves: degroote2016}\nformulation: activation\n"
    "costs: [{plugin: mhe.cost.min-excitation}]\n",
    /* Huber's loss: some of the markers lie beyond its limit, some within */
    "model: {file: $ARM19}\nmuscle: {curves: biorbd, passive: 0.5}\nformulation: activation\n"
    "costs: [{plugin: mhe.cost.track, signal: markers, sigma: 0.1, huber: 3},\n"
    "  {plugin: mhe.cost.track, sigma: 0.1, huber: 1}]\n",
    /* what the node before had: of states alone, of controls too, of markers; and the first node */
    "model: {file: $ARM19}\nmuscle: {curves: paper2021}\ncosts: [{plugin: mhe.cost.rate},\n"
    "  {plugin: mhe.cost.rate, signal: excitation, of: [BRA]},\n"
    "  {plugin: mhe.cost.track, signal: q, nodes: first}, {plugin: mhe.cost.min-excitation}]\n",
    "model: {file: $ARM19}\nmuscle: {curves: paper2021}\nformulation: activation\n"
    "costs: [{plugin: mhe.cost.rate, signal: markers, sigma: 0.1, huber: 1},\n"
    "  {plugin: mhe.cost.rate, signal: muscle_force, sigma: 100}]\n",
    /* markers that count differently, and a coordinate's own task beside them */
    "model: {file: $ARM19}\nmuscle: {curves: paper2021}\n"
    "data: {marker_weights: {file: " MHE_TEST_SOURCE_DIR "/tests/ocp/tasks.xml, LARMl: 4}}\n"
    "costs: [{plugin: mhe.cost.min-excitation, markers: 100},\n"
    "  {plugin: mhe.cost.track, signal: markers, sigma: 0.1, huber: 3}]\n",
    /* what joints pass on: of controls, residual torques and accelerations; without residuals, also
     * at the last node; of the node before; two of them */
    "model: {file: $ARM19}\nmuscle: {curves: paper2021}\nformulation: activation\n"
    "bounds: {residual_torques: true}\ncosts: [{plugin: mhe.cost.track, signal: "
    "joint_reaction/Arm, sigma: 100}, {plugin: mhe.cost.min-excitation}]\n",
    "model: {file: $ARM19}\nmuscle: {curves: paper2021}\ncosts: [{plugin: mhe.cost.track, signal: "
    "joint_reaction/LowerArm1, sigma: 100, value: [0]}, {plugin: mhe.cost.min-excitation}]\n",
    "model: {file: $ARM19}\nmuscle: {curves: paper2021}\nformulation: activation\n"
    "costs: [{plugin: mhe.cost.rate, signal: joint_reaction/Arm, sigma: 1e4},\n"
    "  {plugin: mhe.cost.track, signal: joint_reaction/LowerArm1, sigma: 100, value: [0]}]\n",
    /* with a load in the hand */
    "model: {file: $ARM19}\nmuscle: {curves: paper2021}\nformulation: activation\n"
    "bounds: {residual_torques: true}\ndata: {external_loads: " MHE_TEST_SOURCE_DIR
    "/tests/ocp/hand_loads.xml}\ncosts: [{plugin: mhe.cost.track, signal: joint_reaction/Arm, "
    "sigma: 100, value: [0]}]\n",
};

typedef struct point {
    const mhe_stage_problem *problem;
    mhi_ocp *ocp;
    int32_t k;
    double *z; /* [x; u] */
} point;

static void random_point(const test_fixture *f, uint64_t *seed, double *z) {
    const mhe_system *s = mhi_system_face(f->system);
    const int32_t n_carried = mhi_ocp_face(f->ocp)->n_x - s->n_x;
    for (int32_t i = 0; i < n_carried; i++) {
        z[s->n_x + i] = test_random(seed, -1, 1);
    }
    for (int32_t j = 0; j < s->n_x + s->n_u; j++) {
        const int32_t i = j < s->n_x ? j : j + n_carried; /* place in [x; m; u] */
        const int position = i < s->n_q, speed = !position && i < 2 * s->n_q;
        const int torque = j >= s->n_x + s->n_m;
        z[i] = position ? test_random(seed, -0.4, 0.4)
               : speed  ? test_random(seed, 0.5, 2) * (i % 2 == 0 ? 1 : -1)
               : torque ? test_random(seed, -5, 5)
                        : test_random(seed, 0.1, 0.9);
    }
}

static int step_value(void *data, const double *z, double *y) {
    const point *p = data;
    const mhe_stage_values out = {.size = sizeof out, .x_next = y};
    return p->problem->evaluate(p->problem, 0, p->k, z, z + p->problem->n_x, &out, NULL);
}

static int cost_value(void *data, const double *z, double *y) {
    const point *p = data;
    const mhe_stage_values out = {.size = sizeof out, .cost = y};
    const int last = p->k == p->problem->n_intervals;
    return p->problem->evaluate(p->problem, 0, p->k, z, last ? NULL : z + p->problem->n_x, &out,
                                NULL);
}

static void set_targets(mhi_ocp *ocp, uint64_t *seed) {
    const mhi_signals *signals = mhi_ocp_signals(ocp);
    for (int32_t k = 0; k <= mhi_ocp_face(ocp)->n_intervals; k++) {
        for (int32_t i = 0; i < MHI_N_SIGNALS; i++) {
            double *target = mhi_ocp_target(ocp, i, k);
            for (int32_t j = 0; j < signals->signal[i].n_y; j++) {
                target[j] = j % 7 == 5 ? NAN : test_random(seed, 0, 0.3); /* some data missing */
            }
        }
    }
}

typedef struct values {
    double cost, *grad, *xx, *ux, *uu, *x_next, *A, *B, *AB;
} values;

static values take_values(int32_t n_x, int32_t n_u) {
    const size_t x = (size_t)n_x, u = (size_t)n_u, d = sizeof(double);
    return (values){.grad = calloc(x + u, d),
                    .xx = calloc(x * x, d),
                    .ux = calloc(u * x, d),
                    .uu = calloc(u * u, d),
                    .x_next = calloc(x, d),
                    .A = calloc(x * x, d),
                    .B = calloc(x * u, d),
                    .AB = calloc(x * (x + u), d)};
}

static void free_values(values *v) {
    double *all[] = {v->grad, v->xx, v->ux, v->uu, v->x_next, v->A, v->B, v->AB};
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        free(all[i]);
    }
}

static void linearise(const point *p, values *v) {
    const int32_t n_x = p->problem->n_x, n_u = p->problem->n_u;
    const int last = p->k == p->problem->n_intervals;
    const mhe_stage_values out = {.size = sizeof out,
                                  .cost = &v->cost,
                                  .grad_x = v->grad,
                                  .grad_u = v->grad + n_x,
                                  .hess_xx = v->xx,
                                  .hess_ux = v->ux,
                                  .hess_uu = v->uu,
                                  .x_next = v->x_next,
                                  .A = v->A,
                                  .B = v->B};
    mhe_error err = {0};
    assert_int_equal(
        p->problem->evaluate(p->problem, 0, p->k, p->z, last ? NULL : p->z + n_x, &out, &err),
        MHE_OK);
    for (int32_t i = 0; i < n_x; i++) {
        memcpy(v->AB + i * (n_x + n_u), v->A + i * n_x, sizeof(double) * (size_t)n_x);
        memcpy(v->AB + i * (n_x + n_u) + n_x, v->B + i * n_u, sizeof(double) * (size_t)n_u);
    }
}

/* Entries outside the declared structure must be zero. */
static void check_pattern(const uint8_t *pattern, const double *matrix, int32_t n) {
    for (int32_t i = 0; i < n; i++) {
        assert_true(pattern[i] || matrix[i] == 0);
    }
}

/* Anything where something can stand. */
static void fill_pattern(const uint8_t *pattern, double *matrix, int32_t n) {
    for (int32_t i = 0; i < n; i++) {
        matrix[i] = pattern[i] ? 7 : 0;
    }
}

/* Hessians into arrays that hold 0 outside of their patterns, and numbers of before within. */
static void check_kept(const point *p, const values *all) {
    const int32_t n_x = p->problem->n_x, n_u = p->problem->n_u;
    const int last = p->k == p->problem->n_intervals;
    values v = take_values(n_x, n_u);
    fill_pattern(p->problem->xx_pattern, v.xx, n_x * n_x);
    fill_pattern(p->problem->ux_pattern, v.ux, last ? 0 : n_u * n_x);
    fill_pattern(p->problem->uu_pattern, v.uu, last ? 0 : n_u * n_u);
    const mhe_stage_values out = {
        .size = sizeof out, .hess_xx = v.xx, .hess_ux = v.ux, .hess_uu = v.uu, .hess_clear = 1};
    assert_int_equal(
        p->problem->evaluate(p->problem, 0, p->k, p->z, last ? NULL : p->z + n_x, &out, NULL),
        MHE_OK);
    const size_t x = (size_t)n_x, w = (size_t)n_u, d = sizeof(double);
    assert_memory_equal(v.xx, all->xx, d * x * x);
    assert_memory_equal(v.ux, all->ux, d * w * x);
    assert_memory_equal(v.uu, all->uu, d * w * w);
    free_values(&v);
}

/* What is asked for alone is what is given with everything else. */
static void check_parts(const point *p, const values *all) {
    const int32_t n_x = p->problem->n_x, n_u = p->problem->n_u;
    const int last = p->k == p->problem->n_intervals;
    const double *u = last ? NULL : p->z + n_x;
    values v = take_values(n_x, n_u);
    const mhe_stage_values parts[] = {
        {.size = sizeof *parts, .grad_x = v.grad}, {.size = sizeof *parts, .grad_u = v.grad + n_x},
        {.size = sizeof *parts, .hess_xx = v.xx},  {.size = sizeof *parts, .hess_ux = v.ux},
        {.size = sizeof *parts, .hess_uu = v.uu},  {.size = sizeof *parts, .x_next = v.x_next}};
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) {
        assert_int_equal(p->problem->evaluate(p->problem, 0, p->k, p->z, u, &parts[i], NULL),
                         MHE_OK);
    }
    const size_t x = (size_t)n_x, w = (size_t)n_u, d = sizeof(double);
    assert_memory_equal(v.grad, all->grad, d * (x + w));
    assert_memory_equal(v.xx, all->xx, d * x * x);
    assert_memory_equal(v.ux, all->ux, d * w * x);
    assert_memory_equal(v.uu, all->uu, d * w * w);
    for (size_t i = 0; i < x; i++) { /* an iterative step ends elsewhere where it needs no A, B */
        assert_true(fabs(v.x_next[i] - all->x_next[i]) <= 1e-9 * fmax(1, fabs(v.x_next[i])));
    }
    free_values(&v);
}

static void check_node(test_fixture *f, int32_t k, uint64_t *seed) {
    const mhe_stage_problem *p = mhi_ocp_face(f->ocp);
    const int32_t n_x = p->n_x, n_u = p->n_u;
    const int last = k == p->n_intervals;
    double *z = calloc((size_t)(n_x + n_u), sizeof *z);
    point at = {p, f->ocp, k, z};
    values v = take_values(n_x, n_u);
    random_point(f, seed, z);
    linearise(&at, &v);
    check_parts(&at, &v);
    check_kept(&at, &v);
    double error = test_jacobian_error(cost_value, &at, z, last ? n_x : n_x + n_u, 1, v.grad);
    assert_true(error >= 0 && error < TOLERANCE);
    check_pattern(p->xx_pattern, v.xx, n_x * n_x);
    if (!last) {
        error = test_jacobian_error(step_value, &at, z, n_x + n_u, n_x, v.AB);
        assert_true(error >= 0 && error < TOLERANCE);
        check_pattern(p->A_pattern, v.A, n_x * n_x);
        check_pattern(p->B_pattern, v.B, n_x * n_u);
        check_pattern(p->ux_pattern, v.ux, n_u * n_x);
        check_pattern(p->uu_pattern, v.uu, n_u * n_u);
    }
    free_values(&v);
    free(z);
}

/* Told where muscles outnumber the states and have none of their own, and there alone. */
static void check_low_rank(const test_fixture *f) {
    const mhe_stage_problem *p = mhi_ocp_face(f->ocp);
    const mhe_system *s = mhi_system_face(f->system);
    const int holds = mhi_system_formulation(f->system) == MHE_FORMULATION_ACTIVATION &&
                      p->n_x == s->n_x && s->n_u > 2 * s->n_q;
    assert_int_equal(p->low_rank != NULL, holds);
    for (int32_t i = 0; holds && i < p->n_x * p->n_u; i++) { /* B has no row beyond them */
        assert_true(!p->B_pattern[i] || i / p->n_u < p->low_rank->n_directions);
    }
}

static void stages_match_differences(void **state) {
    (void)state;
    for (size_t i = 0; i < sizeof problems / sizeof problems[0]; i++) {
        test_fixture f;
        uint64_t seed = 7 + i;
        mhe_status status = test_fixture_open(&f, problems[i]);
        if (status != MHE_OK) {
            print_error("%s\n", f.err.text);
        }
        assert_int_equal(status, MHE_OK);
        mhi_ocp_set_interval(f.ocp, 0.03);
        set_targets(f.ocp, &seed);
        check_low_rank(&f);
        check_node(&f, 0, &seed);
        check_node(&f, 3, &seed);
        check_node(&f, mhi_ocp_face(f.ocp)->n_intervals, &seed);
        test_fixture_close(&f);
    }
}

typedef struct acceleration_point {
    const mhe_system *system;
    void *context;
} acceleration_point;

/* z = [q v a r] */
static mhe_system_point point_at(const mhe_system *s, const double *z) {
    const double *a = z + 2 * s->n_q;
    return (mhe_system_point){
        .size = sizeof(mhe_system_point), .q = z, .v = z + s->n_q, .a = a, .r = a + s->n_m};
}

static int acceleration_value(void *data, const double *z, double *vdot) {
    const acceleration_point *p = data;
    const mhe_system *s = p->system;
    const mhe_acceleration out = {.size = sizeof out, .vdot = vdot};
    const mhe_system_point at = point_at(s, z);
    return s->acceleration(s, p->context, &at, &out, NULL);
}

static void put_block(double *to, int32_t width, int32_t column, const double *block, int32_t rows,
                      int32_t columns) {
    for (int32_t i = 0; i < rows; i++) {
        memcpy(to + i * width + column, block + i * columns, sizeof(double) * (size_t)columns);
    }
}

static void accelerations_match_differences(void **state) {
    (void)state;
    test_fixture f;
    assert_int_equal(test_fixture_open(&f, problems[1]), MHE_OK);
    const mhe_system *s = mhi_system_face(f.system);
    enum { Q = 4, M = 19, Z = 2 * Q + M + Q };
    assert_int_equal(s->n_q, Q);
    assert_int_equal(s->n_m, M);
    double z[Z], vdot[Q], q[Q * Q], v[Q * Q], a[Q * M], r[Q * Q], jacobian[Q * Z];
    uint64_t seed = 3;
    for (int trial = 0; trial < 5; trial++) {
        for (int i = 0; i < Z; i++) {
            z[i] = i < Q ? test_random(&seed, -0.5, 0.5)
                   : i < 2 * Q
                       ? test_random(&seed, 0.5, 3)
                       : (i < 2 * Q + M ? test_random(&seed, 0, 1) : test_random(&seed, -9, 9));
        }
        acceleration_point p = {s, mhi_ocp_context(f.ocp)};
        const mhe_acceleration out = {
            .size = sizeof out, .vdot = vdot, .vdot_q = q, .vdot_v = v, .vdot_a = a, .vdot_r = r};
        const mhe_system_point at = point_at(s, z);
        assert_int_equal(s->acceleration(s, p.context, &at, &out, NULL), MHE_OK);
        put_block(jacobian, Z, 0, q, Q, Q);
        put_block(jacobian, Z, Q, v, Q, Q);
        put_block(jacobian, Z, 2 * Q, a, Q, M);
        put_block(jacobian, Z, 2 * Q + M, r, Q, Q);
        const double error = test_jacobian_error(acceleration_value, &p, z, Z, Q, jacobian);
        assert_true(error >= 0 && error < TOLERANCE);
    }
    test_fixture_close(&f);
}

/* Where all residuals are linear in x and u, the Gauss-Newton Hessian is the derivative of the
 * gradient. */
static void hessian_of_linear_residuals(void **state) {
    (void)state;
    test_fixture f;
    assert_int_equal(test_fixture_open(&f, "model: {file: $ARM19}\ncosts:\n"
                                           "  - {plugin: mhe.cost.emg-markers-high, markers: 0}\n"),
                     MHE_OK);
    const mhe_stage_problem *p = mhi_ocp_face(f.ocp);
    const int32_t n_x = p->n_x, n_u = p->n_u, n_z = n_x + n_u;
    uint64_t seed = 11;
    set_targets(f.ocp, &seed);
    double *z = calloc((size_t)n_z, sizeof *z);
    point at = {p, f.ocp, 2, z};
    values here = take_values(n_x, n_u), there = take_values(n_x, n_u);
    random_point(&f, &seed, z);
    linearise(&at, &here);
    for (int32_t j = 0; j < n_z; j++) {
        const double before = z[j];
        z[j] += 0.125;
        linearise(&at, &there);
        z[j] = before;
        for (int32_t i = 0; i < n_z; i++) {
            const double expected = (there.grad[i] - here.grad[i]) / 0.125;
            const double hessian = i < n_x && j < n_x     ? here.xx[i * n_x + j]
                                   : i >= n_x && j < n_x  ? here.ux[(i - n_x) * n_x + j]
                                   : i >= n_x && j >= n_x ? here.uu[(i - n_x) * n_u + j - n_x]
                                                          : here.ux[(j - n_x) * n_x + i];
            assert_true(fabs(expected - hessian) <= 1e-9 * fmax(1, fabs(hessian)));
        }
    }
    free_values(&here);
    free_values(&there);
    free(z);
    test_fixture_close(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(accelerations_match_differences),
                                       cmocka_unit_test(stages_match_differences),
                                       cmocka_unit_test(hessian_of_linear_residuals)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

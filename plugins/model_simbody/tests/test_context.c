/* SPDX-License-Identifier: Apache-2.0 */
/* Contexts on threads, states without a value, paths through coincident points. */
#include "test_models.h"

#include <math.h>
#include <pthread.h>
#include <string.h>

#define N_Q 6
#define N_M 4
#define N_K (6 * CLOUD)
#define STATES 200

typedef struct results {
    double mass[N_Q * N_Q], bias[N_Q], length[N_M], length_q[N_M * N_Q];
    double length_qq[N_M * N_Q * N_Q], marker[3 * N_K], marker_q[3 * N_K * N_Q];
    double tau[N_Q], tau_q[N_Q * N_Q], tau_v[N_Q * N_Q], vdot[N_Q];
} results;

typedef struct job {
    const test_instance *instance;
    void *context;
    int32_t failed;
    results all[STATES];
} job;

static mhe_status evaluate(const test_instance *t, void *context, const double *q, const double *v,
                           results *r) {
    mhe_kinematics out = {.size = sizeof out,
                          .mass = r->mass,
                          .bias = r->bias,
                          .length = r->length,
                          .length_q = r->length_q,
                          .length_qq = r->length_qq,
                          .marker = r->marker,
                          .marker_q = r->marker_q};
    mhe_status status = t->ops->kinematics(context, q, v, &out, NULL);
    if (status == MHE_OK) {
        status = t->ops->inverse_dynamics(context, v, r->tau, r->tau_q, r->tau_v, NULL);
    }
    return status == MHE_OK ? t->ops->forward_dynamics(context, r->tau, r->vdot, NULL) : status;
}

static void *run(void *data) {
    job *j = data;
    uint64_t seed = 5;
    for (int i = 0; i < STATES; i++) {
        double q[N_Q], v[N_Q];
        test_tangle_state(&seed, q, v);
        j->failed |= evaluate(j->instance, j->context, q, v, &j->all[i]) != MHE_OK;
    }
    return NULL;
}

static void two_threads_give_the_same_bits(void **state) {
    (void)state;
    static job jobs[3]; /* two at once, then one alone */
    pthread_t threads[2];
    test_instance t;
    for (int32_t dynamics = 0; dynamics < 2; dynamics++) {
        test_open(&t, test_tangle(), dynamics);
        for (int i = 0; i < 3; i++) {
            jobs[i].instance = &t;
            assert_int_equal(t.ops->context_create(t.self, &jobs[i].context, NULL), MHE_OK);
        }
        for (int i = 0; i < 2; i++) {
            assert_int_equal(pthread_create(&threads[i], NULL, run, &jobs[i]), 0);
        }
        for (int i = 0; i < 2; i++) {
            assert_int_equal(pthread_join(threads[i], NULL), 0);
        }
        (void)run(&jobs[2]);
        for (int i = 0; i < 3; i++) {
            assert_false(jobs[i].failed);
            assert_memory_equal(jobs[i].all, jobs[0].all, sizeof jobs[0].all);
            t.ops->context_destroy(jobs[i].context);
        }
        test_close(&t);
    }
}

static void what_is_not_finite_is_no_state(void **state) {
    (void)state;
    static results r;
    test_instance t;
    uint64_t seed = 6;
    double q[N_Q], v[N_Q];
    test_open(&t, test_tangle(), SIMBODY_DYNAMICS_RECURSIVE);
    test_tangle_state(&seed, q, v);
    assert_int_equal(t.ops->forward_dynamics(t.context, v, r.vdot, NULL), MHE_RETRY);
    const double bad[] = {NAN, INFINITY, -INFINITY};
    for (int i = 0; i < 3; i++) {
        double keep = q[2];
        q[2] = bad[i];
        assert_int_equal(evaluate(&t, t.context, q, v, &r), MHE_RETRY);
        assert_int_equal(t.ops->inverse_dynamics(t.context, v, r.tau, NULL, NULL, NULL), MHE_RETRY);
        q[2] = keep;
        keep = v[4];
        v[4] = bad[i];
        assert_int_equal(evaluate(&t, t.context, q, v, &r), MHE_RETRY);
        v[4] = keep;
        assert_int_equal(evaluate(&t, t.context, q, v, &r), MHE_OK);
        double wrong[N_Q] = {0, bad[i]};
        assert_int_equal(t.ops->inverse_dynamics(t.context, wrong, r.tau, NULL, NULL, NULL),
                         MHE_RETRY);
        assert_int_equal(t.ops->forward_dynamics(t.context, wrong, r.vdot, NULL), MHE_RETRY);
    }
    v[0] = 1e200; /* finite, but its square is not */
    assert_int_equal(evaluate(&t, t.context, q, v, &r), MHE_RETRY);
    test_close(&t);
}

/* Outputs asked for one by one are those asked for together. */
static void outputs_do_not_depend_on_each_other(void **state) {
    (void)state;
    static results all, one;
    test_instance t;
    uint64_t seed = 8;
    double q[N_Q], v[N_Q];
    test_open(&t, test_tangle(), SIMBODY_DYNAMICS_RECURSIVE);
    test_tangle_state(&seed, q, v);
    assert_int_equal(evaluate(&t, t.context, q, v, &all), MHE_OK);
    const mhe_kinematics single[] = {{.mass = one.mass},           {.bias = one.bias},
                                     {.length = one.length},       {.length_q = one.length_q},
                                     {.marker = one.marker},       {.marker_q = one.marker_q},
                                     {.length_qq = one.length_qq}, {.size = sizeof single[0]}};
    for (size_t i = 0; i < sizeof single / sizeof single[0]; i++) {
        assert_int_equal(t.ops->kinematics(t.context, q, v, &single[i], NULL), MHE_OK);
    }
    assert_int_equal(t.ops->inverse_dynamics(t.context, v, one.tau, NULL, NULL, NULL), MHE_OK);
    assert_int_equal(t.ops->inverse_dynamics(t.context, v, NULL, one.tau_q, NULL, NULL), MHE_OK);
    assert_int_equal(t.ops->inverse_dynamics(t.context, v, NULL, NULL, one.tau_v, NULL), MHE_OK);
    assert_int_equal(t.ops->forward_dynamics(t.context, one.tau, one.vdot, NULL), MHE_OK);
    assert_memory_equal(&one, &all, sizeof all);
    test_close(&t);
}

/* A path point on the pin's axis and one at the same place in ground: their segment has no
 * direction, and the rest of the path is as without it. */
static void coincident_points_have_no_direction(void **state) {
    (void)state;
    const mhe_path_point points[] = {{.body = -1, .location = {0, 0, 0}},
                                     {.body = 0, .location = {0, 0, 0}},
                                     {.body = -1, .location = {0.3, 0, 0}}};
    const mhe_muscle muscle = {.name = "m"};
    const mhe_path path = {.name = "m", .n_points = 3, .points = points};
    mhe_description d = *test_pendulum();
    test_instance t;
    d.n_muscles = 1;
    d.muscles = &muscle;
    d.n_paths = 1;
    d.paths = &path;
    test_open(&t, &d, SIMBODY_DYNAMICS_RECURSIVE);
    double length, length_q[2], length_qq[4];
    mhe_kinematics out = {
        .size = sizeof out, .length = &length, .length_q = length_q, .length_qq = length_qq};
    assert_int_equal(
        t.ops->kinematics(t.context, (double[]){0.3, 0.4}, (double[]){1, 1}, &out, NULL), MHE_OK);
    assert_true(fabs(length - 0.3) < 1e-15);
    for (int i = 0; i < 4; i++) {
        assert_true(fabs(length_q[i / 2]) < 1e-15);
        assert_true(fabs(length_qq[i]) < 1e-15);
    }
    test_close(&t);
}

static void create_says_what_is_wrong(void **state) {
    (void)state;
    const mhe_model_ops *ops = test_model_ops();
    simbody_config config = {0};
    mhe_description d = *test_pendulum();
    mhe_body bodies[2] = {d.bodies[0], d.bodies[1]};
    mhe_error err = {0};
    void *self = NULL;
    bodies[1].mass = -2;
    d.bodies = bodies;
    assert_int_equal(ops->create(NULL, &d, &config, &self, &err), MHE_E_INPUT);
    assert_non_null(strstr(err.text, "body 'second': mass -2"));
    assert_null(self);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(two_threads_give_the_same_bits),
        cmocka_unit_test(what_is_not_finite_is_no_state),
        cmocka_unit_test(outputs_do_not_depend_on_each_other),
        cmocka_unit_test(coincident_points_have_no_direction),
        cmocka_unit_test(create_says_what_is_wrong),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

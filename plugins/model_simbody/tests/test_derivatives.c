/* SPDX-License-Identifier: Apache-2.0 */
/* Every derivative against central differences, with a study of the step. */
#include "test_models.h"

#include <math.h>
#include <string.h>

#define MAX_Q 6
#define MAX_K (3 * 6 * CLOUD)
#define LIMIT                                                                          \
    1e-6 /* relative to the row's largest entry; differences cannot see less than 1e-9 \
          */

typedef struct probe {
    test_instance *instance;
    const double *q, *v, *vdot;
} probe;

static int probe_kinematics(const probe *p, const double *q, const double *v, mhe_kinematics *out) {
    out->size = sizeof *out;
    return p->instance->ops->kinematics(p->instance->context, q, v, out, NULL);
}

static int length_of_q(void *data, const double *q, double *y) {
    probe *p = data;
    return probe_kinematics(p, q, p->v, &(mhe_kinematics){.length = y});
}

static int length_q_of_q(void *data, const double *q, double *y) {
    probe *p = data;
    return probe_kinematics(p, q, p->v, &(mhe_kinematics){.length_q = y});
}

static int marker_of_q(void *data, const double *q, double *y) {
    probe *p = data;
    return probe_kinematics(p, q, p->v, &(mhe_kinematics){.marker = y});
}

static int torque(const probe *p, const double *q, const double *v, double *tau) {
    int status = probe_kinematics(p, q, v, &(mhe_kinematics){0});
    return status != 0 ? status
                       : p->instance->ops->inverse_dynamics(p->instance->context, p->vdot, tau,
                                                            NULL, NULL, NULL);
}

static int torque_of_q(void *data, const double *q, double *y) {
    probe *p = data;
    return torque(p, q, p->v, y);
}

static int torque_of_v(void *data, const double *v, double *y) {
    probe *p = data;
    return torque(p, p->q, v, y);
}

static double worst[5];

static void check(int what, test_function f, probe *p, const double *x, int n_y,
                  const double *jacobian) {
    static const char *const names[] = {"length_q", "length_qq", "marker_q", "tau_q", "tau_v"};
    double error = test_jacobian_error(f, p, x, p->instance->n_q, n_y, jacobian);
    if (!(error >= 0 && error < LIMIT)) {
        fail_msg("%s: relative error %g", names[what], error);
    }
    worst[what] = fmax(worst[what], error);
}

static void check_all(test_instance *t, const double *q, const double *v, const double *vdot) {
    static double length_q[4 * MAX_Q], length_qq[4 * MAX_Q * MAX_Q], marker_q[MAX_K * MAX_Q];
    double tau[MAX_Q], tau_q[MAX_Q * MAX_Q], tau_v[MAX_Q * MAX_Q];
    probe p = {.instance = t, .q = q, .v = v, .vdot = vdot};
    mhe_kinematics out = {.length_q = length_q, .length_qq = length_qq, .marker_q = marker_q};
    assert_int_equal(probe_kinematics(&p, q, v, &out), MHE_OK);
    assert_int_equal(t->ops->inverse_dynamics(t->context, vdot, tau, tau_q, tau_v, NULL), MHE_OK);
    check(0, length_of_q, &p, q, t->n_m, length_q);
    check(1, length_q_of_q, &p, q, t->n_m * t->n_q, length_qq);
    check(2, marker_of_q, &p, q, 3 * t->n_k, marker_q);
    check(3, torque_of_q, &p, q, t->n_q, tau_q);
    check(4, torque_of_v, &p, v, t->n_q, tau_v);
}

static void derivatives_of_the_tangle(void **state) {
    (void)state;
    test_instance t;
    uint64_t seed = 11;
    for (int32_t dynamics = 0; dynamics < 2; dynamics++) {
        test_open(&t, test_tangle(), dynamics);
        for (int i = 0; i < 30; i++) {
            double q[MAX_Q], v[MAX_Q], vdot[MAX_Q], unused[MAX_Q];
            test_tangle_state(&seed, q, v);
            test_tangle_state(&seed, vdot, unused);
            /* one of the spline's three pieces after the other, away from its knots: there the
             * third derivative jumps and differences converge slowly */
            q[2] = (double[]){-0.8, 0.1, 0.9}[i % 3] + test_random(&seed, -0.2, 0.2);
            check_all(&t, q, v, vdot);
        }
        test_close(&t);
    }
    print_message("length_q %.1e, length_qq %.1e, marker_q %.1e, tau_q %.1e, tau_v %.1e\n",
                  worst[0], worst[1], worst[2], worst[3], worst[4]);
}

static void derivatives_of_the_pendulum(void **state) {
    (void)state;
    test_instance t;
    test_open(&t, test_pendulum(), SIMBODY_DYNAMICS_RECURSIVE);
    check_all(&t, (double[]){0.4, -1.1}, (double[]){2, -3}, (double[]){5, 7});
    test_close(&t);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(derivatives_of_the_tangle),
        cmocka_unit_test(derivatives_of_the_pendulum),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

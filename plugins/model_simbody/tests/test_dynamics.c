/* SPDX-License-Identifier: Apache-2.0 */
/* Poses, mass matrix and forces against closed forms and against clouds of point masses. */
#include "test_models.h"
#include "vector.h"

#include <math.h>
#include <string.h>

#define MAX_Q 6
#define MAX_K (3 * 6 * CLOUD)

/* Largest difference relative to the largest entry. */
static double relative(const double *a, const double *b, int n) {
    double off = 0, scale = 1e-12;
    for (int i = 0; i < n; i++) {
        off = fmax(off, fabs(a[i] - b[i]));
        scale = fmax(scale, fabs(b[i]));
    }
    return off / scale;
}

static void assert_close(const char *what, const double *a, const double *b, int n, double limit) {
    double error = relative(a, b, n);
    if (!(error < limit)) {
        fail_msg("%s: relative error %g, limit %g", what, error, limit);
    }
}

static void pendulum_has_its_closed_form(void **state) {
    (void)state;
    test_instance p;
    uint64_t seed = 1;
    for (int32_t dynamics = 0; dynamics < 2; dynamics++) {
        test_open(&p, test_pendulum(), dynamics);
        for (int i = 0; i < 20; i++) {
            double q[2] = {test_random(&seed, -4, 4), test_random(&seed, -4, 4)};
            double v[2] = {test_random(&seed, -5, 5), test_random(&seed, -5, 5)};
            double mass[4], bias[2];
            mhe_kinematics out = {.size = sizeof out, .mass = mass, .bias = bias};
            assert_int_equal(p.ops->kinematics(p.context, q, v, &out, NULL), MHE_OK);
            double far = PENDULUM_M2 * PENDULUM_L1 * PENDULUM_C2;
            double m22 = PENDULUM_I2 + PENDULUM_M2 * PENDULUM_C2 * PENDULUM_C2;
            double m12 = m22 + far * cos(q[1]);
            double m11 = m22 + 2 * far * cos(q[1]) + PENDULUM_I1 +
                         PENDULUM_M1 * PENDULUM_C1 * PENDULUM_C1 +
                         PENDULUM_M2 * PENDULUM_L1 * PENDULUM_L1;
            double g2 = PENDULUM_M2 * PENDULUM_C2 * PENDULUM_G * cos(q[0] + q[1]);
            double g1 =
                (PENDULUM_M1 * PENDULUM_C1 + PENDULUM_M2 * PENDULUM_L1) * PENDULUM_G * cos(q[0]) +
                g2;
            double h = far * sin(q[1]);
            double expected_mass[] = {m11, m12, m12, m22};
            double expected_bias[] = {g1 - h * (2 * v[0] + v[1]) * v[1], g2 + h * v[0] * v[0]};
            assert_close("mass", mass, expected_mass, 4, 1e-13);
            assert_close("bias", bias, expected_bias, 2, 1e-12);
        }
        test_close(&p);
    }
}

static double path_length(const mhe_description *d, int32_t muscle, const double *q) {
    const mhe_path *m = &d->paths[muscle];
    double length = 0, last[3] = {0}, here[3];
    for (int32_t k = 0; k < m->n_points; k++) {
        test_body_point(d, m->points[k].body, q, m->points[k].location, here);
        double step[3] = {here[0] - last[0], here[1] - last[1], here[2] - last[2]};
        length += k > 0 ? sqrt(dot3(step, step)) : 0;
        memcpy(last, here, sizeof last);
    }
    return length;
}

static void points_are_where_the_description_says(void **state) {
    (void)state;
    test_instance t;
    uint64_t seed = 2;
    test_open(&t, test_tangle(), SIMBODY_DYNAMICS_RECURSIVE);
    for (int i = 0; i < 20; i++) {
        double q[MAX_Q], v[MAX_Q], marker[MAX_K], length[4], expected[MAX_K];
        test_tangle_state(&seed, q, v);
        mhe_kinematics out = {.size = sizeof out, .marker = marker, .length = length};
        assert_int_equal(t.ops->kinematics(t.context, q, v, &out, NULL), MHE_OK);
        for (int32_t k = 0; k < t.n_k; k++) {
            const mhe_marker *m = &t.description->markers[k];
            test_body_point(t.description, m->body, q, m->location, expected + 3 * k);
        }
        assert_close("markers", marker, expected, 3 * t.n_k, 1e-13);
        for (int32_t m = 0; m < t.n_m; m++) {
            expected[m] = path_length(t.description, m, q);
        }
        assert_close("lengths", length, expected, t.n_m, 1e-13);
    }
    test_close(&t);
}

/* J v at q + h v: velocities of the point masses along the motion of constant v. */
static void cloud_velocity(test_instance *t, const double *q, const double *v, double h,
                           double *velocity) {
    double at[MAX_Q], jacobian[MAX_K * MAX_Q];
    mhe_kinematics out = {.size = sizeof out, .marker_q = jacobian};
    for (int i = 0; i < t->n_q; i++) {
        at[i] = q[i] + h * v[i];
    }
    assert_int_equal(t->ops->kinematics(t->context, at, v, &out, NULL), MHE_OK);
    for (int i = 0; i < 3 * t->n_k; i++) {
        velocity[i] = 0;
        for (int j = 0; j < t->n_q; j++) {
            velocity[i] += jacobian[i * t->n_q + j] * v[j];
        }
    }
}

/* M = sum m J^T J and bias = sum m J^T (dJ/dt v - g) over point masses, with dJ/dt v by a fourth
 * order difference of the velocities (step 1e-3: truncation 1e-10 of the scale). */
static void cloud_dynamics(test_instance *t, const double *q, const double *v,
                           const double *jacobian, double *mass, double *bias) {
    double rate[MAX_K], a[MAX_K], b[MAX_K], h = 1e-3;
    cloud_velocity(t, q, v, h, a);
    cloud_velocity(t, q, v, -h, b);
    for (int i = 0; i < 3 * t->n_k; i++) {
        rate[i] = 8 * (a[i] - b[i]) / (12 * h);
    }
    cloud_velocity(t, q, v, 2 * h, a);
    cloud_velocity(t, q, v, -2 * h, b);
    memset(mass, 0, sizeof *mass * MAX_Q * MAX_Q);
    memset(bias, 0, sizeof *bias * MAX_Q);
    for (int k = 0; k < 3 * t->n_k; k++) {
        rate[k] -= (a[k] - b[k]) / (12 * h) + t->description->gravity[k % 3];
        for (int i = 0; i < t->n_q; i++) {
            double push = test_tangle_mass(k / 3) * jacobian[k * t->n_q + i];
            bias[i] += push * rate[k];
            for (int j = 0; j < t->n_q; j++) {
                mass[i * t->n_q + j] += push * jacobian[k * t->n_q + j];
            }
        }
    }
}

static void rigid_bodies_move_as_their_point_masses(void **state) {
    (void)state;
    test_instance t;
    uint64_t seed = 3;
    for (int32_t dynamics = 0; dynamics < 2; dynamics++) {
        test_open(&t, test_tangle(), dynamics);
        for (int i = 0; i < 20; i++) {
            double q[MAX_Q], v[MAX_Q], mass[MAX_Q * MAX_Q], bias[MAX_Q];
            double jacobian[MAX_K * MAX_Q], cloud_mass[MAX_Q * MAX_Q], cloud_bias[MAX_Q];
            test_tangle_state(&seed, q, v);
            mhe_kinematics out = {
                .size = sizeof out, .mass = mass, .bias = bias, .marker_q = jacobian};
            assert_int_equal(t.ops->kinematics(t.context, q, v, &out, NULL), MHE_OK);
            cloud_dynamics(&t, q, v, jacobian, cloud_mass, cloud_bias);
            assert_close("mass", mass, cloud_mass, t.n_q * t.n_q, 1e-12);
            assert_close("bias", bias, cloud_bias, t.n_q, 1e-8);
        }
        test_close(&t);
    }
}

/* The tangle without gravity and with frames that are rotations to about three digits only. */
static const mhe_description *rounded_tangle(void) {
    static mhe_body bodies[8];
    static mhe_description d;
    uint64_t seed = 5;
    d = *test_tangle();
    assert_true(d.n_bodies <= 8);
    memcpy(bodies, d.bodies, sizeof *bodies * (size_t)d.n_bodies);
    for (int32_t b = 0; b < d.n_bodies; b++) {
        for (int i = 0; i < 9; i++) {
            bodies[b].joint_r[i] += test_random(&seed, -1e-4, 1e-4);
            bodies[b].body_r[i] += test_random(&seed, -1e-4, 1e-4);
        }
    }
    d.bodies = bodies;
    memset(d.gravity, 0, sizeof d.gravity);
    return &d;
}

/* out = dM/dx by a fourth order difference along `way` */
static void mass_rate(test_instance *t, const double *q, const double *way, double *out) {
    static const double steps[] = {-2, -1, 1, 2}, factors[] = {1, -8, 8, -1};
    double at[MAX_Q], none[MAX_Q] = {0}, mass[MAX_Q * MAX_Q], h = 1e-3;
    memset(out, 0, sizeof mass);
    for (int k = 0; k < 4; k++) {
        mhe_kinematics kinematics = {.size = sizeof kinematics, .mass = mass};
        for (int i = 0; i < t->n_q; i++) {
            at[i] = q[i] + steps[k] * h * way[i];
        }
        assert_int_equal(t->ops->kinematics(t->context, at, none, &kinematics, NULL), MHE_OK);
        for (int i = 0; i < t->n_q * t->n_q; i++) {
            out[i] += factors[k] * mass[i] / (12 * h);
        }
    }
}

/* bias = dM/dt v - 1/2 d(v^T M v)/dq, whatever the frames are: the bias neither makes nor loses
 * energy. */
static void bias_is_that_of_the_mass_matrix(void **state) {
    (void)state;
    test_instance t;
    uint64_t seed = 6;
    test_open(&t, rounded_tangle(), SIMBODY_DYNAMICS_RECURSIVE);
    for (int s = 0; s < 20; s++) {
        double q[MAX_Q], v[MAX_Q], bias[MAX_Q], expected[MAX_Q] = {0}, rate[MAX_Q * MAX_Q];
        test_tangle_state(&seed, q, v);
        /* between the knots of its spline, where the third derivative jumps */
        q[2] = (double[]){-0.8, 0.1, 0.9}[s % 3];
        for (int c = -1; c < t.n_q; c++) {
            double way[MAX_Q] = {0}, energy = 0;
            if (c >= 0) {
                way[c] = 1;
            }
            mass_rate(&t, q, c < 0 ? v : way, rate);
            for (int i = 0; i < t.n_q; i++) {
                for (int j = 0; j < t.n_q; j++) {
                    expected[i] += c < 0 ? rate[i * t.n_q + j] * v[j] : 0;
                    energy += 0.5 * v[i] * rate[i * t.n_q + j] * v[j];
                }
            }
            if (c >= 0) {
                expected[c] -= energy;
            }
        }
        mhe_kinematics out = {.size = sizeof out, .bias = bias};
        assert_int_equal(t.ops->kinematics(t.context, q, v, &out, NULL), MHE_OK);
        assert_close("bias", bias, expected, t.n_q, 1e-8);
    }
    test_close(&t);
}

/* Both ways to the same numbers, and forward dynamics as the inverse of inverse dynamics. */
static void recursion_and_simbody_agree(void **state) {
    (void)state;
    test_instance t[2];
    uint64_t seed = 4;
    double worst = 0;
    test_open(&t[0], test_tangle(), SIMBODY_DYNAMICS_RECURSIVE);
    test_open(&t[1], test_tangle(), SIMBODY_DYNAMICS_SIMBODY);
    for (int i = 0; i < 50; i++) {
        double q[MAX_Q], v[MAX_Q], vdot[MAX_Q], mass[2][MAX_Q * MAX_Q], bias[2][MAX_Q];
        double tau[2][MAX_Q], tau_q[2][MAX_Q * MAX_Q], back[MAX_Q], sum[MAX_Q];
        test_tangle_state(&seed, q, v);
        test_tangle_state(&seed, vdot, back);
        for (int k = 0; k < 2; k++) {
            mhe_kinematics out = {.size = sizeof out, .mass = mass[k], .bias = bias[k]};
            assert_int_equal(t[k].ops->kinematics(t[k].context, q, v, &out, NULL), MHE_OK);
            assert_int_equal(
                t[k].ops->inverse_dynamics(t[k].context, vdot, tau[k], tau_q[k], NULL, NULL),
                MHE_OK);
            assert_int_equal(t[k].ops->forward_dynamics(t[k].context, tau[k], back, NULL), MHE_OK);
            assert_close("forward of inverse", back, vdot, t[k].n_q, 1e-9);
            for (int a = 0; a < t[k].n_q; a++) {
                sum[a] = bias[k][a];
                for (int b = 0; b < t[k].n_q; b++) {
                    sum[a] += mass[k][a * t[k].n_q + b] * vdot[b];
                }
            }
            assert_close("M vdot + bias", sum, tau[k], t[k].n_q, 1e-12);
        }
        worst = fmax(worst, relative(mass[0], mass[1], t[0].n_q * t[0].n_q));
        worst = fmax(worst, relative(bias[0], bias[1], t[0].n_q));
        worst = fmax(worst, relative(tau[0], tau[1], t[0].n_q));
        worst = fmax(worst, relative(tau_q[0], tau_q[1], t[0].n_q * t[0].n_q));
    }
    print_message("recursion against Simbody: %.1e\n", worst);
    assert_true(worst < 1e-10);
    test_close(&t[0]);
    test_close(&t[1]);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pendulum_has_its_closed_form),
        cmocka_unit_test(points_are_where_the_description_says),
        cmocka_unit_test(rigid_bodies_move_as_their_point_masses),
        cmocka_unit_test(bias_is_that_of_the_mass_matrix),
        cmocka_unit_test(recursion_and_simbody_agree),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

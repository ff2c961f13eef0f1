/* SPDX-License-Identifier: Apache-2.0 */
/* mhe.integrator.rk on the 19-muscle arm: against CVODES at random states, and the seed's motion.
 */
#include "systems.h"

#include "io/model_file.h"
#include "io/table.h"
#include "model/system.h"

#include <math.h>
#include <string.h>
#include <time.h>

#define RK "mhe.integrator.rk"
#define CVODES "mhe.integrator.sundials"
#define EXACT "{rtol: 1e-10, atol: 1e-12}"
#define FIXED "{stages: 4, max_step: 0.015, activation_step: 1.7}"
#define REFINED "{stages: 4, max_step: 0.015, activation_step: 1.7, tolerance: 5e-6}"
#define N_Q 4
#define N_M 19
#define N_X (2 * N_Q + N_M)

/* The arm, with its accelerations counted. */
struct arm {
    mhe_description *description;
    mhi_system *system;
    mhi_system_context *context;
    mhe_system counted;
    int64_t plain, full; /* accelerations without and with derivatives */
};

static mhe_status count(const mhe_system *system, void *context, const mhe_system_point *at,
                        const mhe_acceleration *out, mhe_error *err) {
    struct arm *arm = context;
    const mhe_system *face = system->data;
    *(out->vdot_q != NULL ? &arm->full : &arm->plain) += 1;
    return face->acceleration(face, arm->context, at, out, err);
}

static mhe_status pass(const mhe_system *system, const double *e, const double *a, double *rate,
                       double *rate_e, double *rate_a, mhe_error *err) {
    const mhe_system *face = system->data;
    return face->activation_rate(face, e, a, rate, rate_e, rate_a, err);
}

/* 0 where the data or a plugin is absent. */
static int arm_open(struct arm *arm, const char *muscle_yaml) {
    char path[1024];
    mhe_error err = {0};
    memset(arm, 0, sizeof *arm);
    const mhe_plugin *model = test_plugin("mhe.model.simbody", MHE_MODEL_IFACE);
    const mhe_plugin *muscle = test_plugin("mhe.muscle.hill", MHE_MUSCLE_IFACE);
    if (model == NULL || muscle == NULL ||
        test_data_path(path, sizeof path, "arm19/arm_wt_rot_scap.bioMod") == NULL) {
        return 0;
    }
    if (mhi_model_read(path, &arm->description, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    const mhi_system_setup setup = {.host = test_host(),
                                    .description = arm->description,
                                    .model = model,
                                    .model_config = test_config(model, ""),
                                    .muscle = muscle,
                                    .muscle_config = test_config(muscle, muscle_yaml),
                                    .formulation = MHE_FORMULATION_EXCITATION};
    if (mhi_system_create(&setup, &arm->system, &err) != MHE_OK ||
        mhi_system_context_create(arm->system, &arm->context, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    const mhe_system *face = mhi_system_face(arm->system);
    assert_int_equal(face->n_x, N_X);
    arm->counted = *face;
    arm->counted.data = (void *)face;
    arm->counted.acceleration = count;
    arm->counted.activation_rate = pass;
    return 1;
}

static void arm_close(struct arm *arm) {
    mhi_system_context_free(arm->context);
    mhi_system_free(arm->system);
    mhi_description_free(arm->description);
}

static double now(void) {
    struct timespec t;
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* ---- states near the seed's motion ---- */

#define N_STATES 60

struct sample {
    double x[N_STATES][N_X], u[N_STATES][N_M], exact[N_STATES][N_X];
};

static mhi_table *seed_motion(void) {
    char path[1024];
    mhe_error err = {0};
    mhi_table *table = NULL;
    if (test_data_path(path, sizeof path, "arm19/seed_reference_states.sto") == NULL) {
        return NULL;
    }
    if (mhi_sto_read(path, &table, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    assert_int_equal(table->n_columns, N_X + N_M);
    return table;
}

/* A node of the motion, moved in all directions, under excitations that leave the activations. */
static void random_state(uint64_t *seed, const mhi_table *motion, double *x, double *u) {
    int32_t row = (int32_t)test_random(seed, 0, motion->n_rows);
    const double *node = motion->values + row * motion->n_columns;
    for (int i = 0; i < N_X; i++) {
        x[i] = node[i] + test_random(seed, -1, 1) * (i < N_Q ? 0.1 : i < 2 * N_Q ? 0.5 : 0.05);
    }
    for (int i = 0; i < N_M; i++) {
        double *a = &x[2 * N_Q + i];
        *a = fmin(1, fmax(0.01, *a));
        u[i] = fmin(1, fmax(0, *a + test_random(seed, -0.2, 0.2)));
    }
}

/* Whether no muscle passes a kink of paper2021 (Ldot = 0, l = l_slack) on the way. */
static int away_from_kinks(struct arm *arm, const struct test_integrator *fine, const double *x,
                           const double *u, double dt) {
    double y[N_X], velocity[N_M] = {0}, passive[N_M] = {0};
    mhe_error err = {0};
    memcpy(y, x, sizeof y);
    for (int k = 0; k <= 30; k++) {
        mhi_muscle_state now_at;
        mhe_system_point point;
        mhi_system_point(arm->system, y, u, NULL, &point);
        assert_int_equal(mhi_system_muscles(arm->context, &point, 0, &now_at, &err), MHE_OK);
        for (int i = 0; i < N_M; i++) {
            const mhe_muscle *m = &arm->description->muscles[i];
            double fibre = (now_at.length[i] - m->tendon_slack_length) / cos(m->pennation_angle);
            double beyond = fibre - m->tendon_slack_length;
            if (k > 0 && (velocity[i] * now_at.velocity[i] <= 0 || passive[i] * beyond <= 0)) {
                return 0;
            }
            velocity[i] = now_at.velocity[i];
            passive[i] = beyond;
        }
        test_integrate(fine, y, u, dt / 30, y, NULL, NULL);
    }
    return 1;
}

/* Random intervals of length dt and where CVODES at 1e-10 ends them. */
static void draw(struct arm *arm, const mhi_table *motion, double dt, struct sample *out) {
    struct test_integrator exact = test_integrator_open(CVODES, EXACT, &arm->counted, arm);
    uint64_t seed = 31;
    for (int k = 0; k < N_STATES; k++) {
        random_state(&seed, motion, out->x[k], out->u[k]);
        test_integrate(&exact, out->x[k], out->u[k], dt, out->exact[k], NULL, NULL);
    }
    test_integrator_close(&exact);
}

/* Largest error over a sample; prints a row of the table in README.md. */
static double study(struct arm *arm, const char *yaml, double dt, const struct sample *sample) {
    struct test_integrator rk = test_integrator_open(RK, yaml, &arm->counted, arm);
    double next[N_X], A[N_X * N_X], B[N_X * N_M], worst = 0, mean = 0, price[2];
    int64_t plain[2], full[2];
    for (int derivatives = 0; derivatives < 2; derivatives++) {
        arm->plain = arm->full = 0;
        double start = now();
        for (int k = 0; k < N_STATES; k++) {
            test_integrate(&rk, sample->x[k], sample->u[k], dt, next, derivatives ? A : NULL,
                           derivatives ? B : NULL);
            double error = test_relative(next, sample->exact[k], N_X);
            worst = fmax(worst, error);
            mean += 0.5 * error / N_STATES;
        }
        price[derivatives] = 1e6 * (now() - start) / N_STATES;
        plain[derivatives] = arm->plain;
        full[derivatives] = arm->full;
    }
    print_message("| %.0f | %s | %.1e | %.1e | %.0f + %.0f | %.0f + %.0f | %.0f | %.0f |\n",
                  1e3 * dt, yaml[0] == '\0' ? "defaults" : yaml, worst, mean,
                  (double)plain[0] / N_STATES, (double)full[0] / N_STATES,
                  (double)plain[1] / N_STATES, (double)full[1] / N_STATES, price[0], price[1]);
    test_integrator_close(&rk);
    return worst;
}

static const double intervals[] = {0.01, 0.02, 0.03, 0.06};
#define N_INTERVALS (sizeof intervals / sizeof intervals[0])

/* Columns: interval (ms), options, largest and mean error, accelerations without + with derivatives
 * of a step without A and B and of one with them, and their times (us). */
static void degroote2016_against_cvodes(void **state) {
    (void)state;
    static struct sample sample;
    static const char *const others[] = {"",
                                         "{stages: 2, max_step: 0.005}",
                                         "{stages: 3, max_step: 0.01}",
                                         "{stages: 4, max_step: 0.03}",
                                         "{stages: 6, max_step: 0.03}",
                                         "{scheme: rk4, max_step: 0.0025}"};
    struct arm arm;
    mhi_table *motion = seed_motion();
    if (motion == NULL || test_plugin(CVODES, MHE_INTEGRATOR_IFACE) == NULL ||
        !arm_open(&arm, "curves: degroote2016")) {
        mhi_table_free(motion);
        skip();
    }
    for (size_t d = 0; d < N_INTERVALS; d++) {
        draw(&arm, motion, intervals[d], &sample);
        double worst = study(&arm, FIXED, intervals[d], &sample);
        for (size_t k = 0; k < sizeof others / sizeof others[0]; k++) {
            (void)study(&arm, others[k], intervals[d], &sample);
        }
        assert_true(worst < 1e-5);
    }
    arm_close(&arm);
    mhi_table_free(motion);
}

/* Kinks and jumps (paper2021: Ldot = 0, fibre length = tendon slack length; biorbd: Ldot = 0;
 * thelen2003: n = 1, Ldot = 0) are met in most intervals. */
static void kinks_against_cvodes(void **state) {
    (void)state;
    static struct sample sample;
    static const char *const curves[] = {"curves: paper2021", "curves: biorbd",
                                         "curves: thelen2003", "curves: degroote2016"};
    mhi_table *motion = seed_motion();
    if (motion == NULL || test_plugin(CVODES, MHE_INTEGRATOR_IFACE) == NULL) {
        mhi_table_free(motion);
        skip();
    }
    for (size_t k = 0; k < sizeof curves / sizeof curves[0]; k++) {
        struct arm arm;
        if (!arm_open(&arm, curves[k])) {
            mhi_table_free(motion);
            skip();
        }
        print_message("%s\n", curves[k]);
        for (size_t d = 0; d < N_INTERVALS; d++) {
            draw(&arm, motion, intervals[d], &sample);
            (void)study(&arm, FIXED, intervals[d], &sample);
            assert_true(study(&arm, REFINED, intervals[d], &sample) < 1e-5);
        }
        arm_close(&arm);
    }
    mhi_table_free(motion);
}

/* Where forces jump, BDF and Adams formulas still converge, and to the same end: the reference is
 * one. */
static void reference_converges(void **state) {
    (void)state;
    static struct sample sample;
    struct arm arm;
    mhi_table *motion = seed_motion();
    if (motion == NULL || test_plugin(CVODES, MHE_INTEGRATOR_IFACE) == NULL ||
        !arm_open(&arm, "curves: paper2021")) {
        mhi_table_free(motion);
        skip();
    }
    static const char *const finer[] = {
        "{rtol: 1e-12, atol: 1e-14, max_steps: 1000000}",
        "{rtol: 1e-12, atol: 1e-14, max_steps: 1000000, method: adams}"};
    draw(&arm, motion, 0.03, &sample);
    for (int i = 0; i < 2; i++) {
        struct test_integrator other = test_integrator_open(CVODES, finer[i], &arm.counted, &arm);
        double worst = 0;
        for (int k = 0; k < N_STATES; k++) {
            double next[N_X];
            test_integrate(&other, sample.x[k], sample.u[k], 0.03, next, NULL, NULL);
            worst = fmax(worst, test_relative(next, sample.exact[k], N_X));
        }
        print_message("CVODES against itself, %s: %.1e\n", finer[i], worst);
        assert_true(worst < 1e-6);
        test_integrator_close(&other);
    }
    arm_close(&arm);
    mhi_table_free(motion);
}

/* Worst error of A and B against differences at five random states, away from kinks if asked. */
static void differences(const char *curves, const char *yaml, double dt, int smooth) {
    struct arm arm;
    mhi_table *motion = seed_motion();
    if (motion == NULL || !arm_open(&arm, curves)) {
        mhi_table_free(motion);
        skip();
    }
    struct test_integrator rk = test_integrator_open(RK, yaml, &arm.counted, &arm);
    struct test_integrator fine =
        test_integrator_open(RK, "{stages: 2, tolerance: 0}", &arm.counted, &arm);
    uint64_t seed = 41;
    double worst = 0;
    for (int trial = 0; trial < 5;) {
        double x[N_X], u[N_M];
        random_state(&seed, motion, x, u);
        if (!smooth || away_from_kinks(&arm, &fine, x, u, dt)) {
            double error = test_step_derivatives(&rk, x, u, dt);
            assert_true(error >= 0);
            worst = fmax(worst, error);
            trial++;
        }
    }
    print_message("%s, %s: A, B against differences: %.1e\n", curves, yaml, worst);
    assert_true(worst < 1e-6);
    test_integrator_close(&rk);
    test_integrator_close(&fine);
    arm_close(&arm);
    mhi_table_free(motion);
}

static void derivatives(void **state) {
    (void)state;
    differences("curves: degroote2016", "", 0.03, 0);
}

/* The second tolerance cuts smooth steps too: A and B are those of the steps taken. */
static void derivatives_of_cut_steps(void **state) {
    (void)state;
    differences("curves: paper2021", REFINED, 0.01, 1);
    differences("curves: degroote2016", "{stages: 4, tolerance: 1e-9}", 0.03, 0);
}

/* One interval from each node of the seed's motion lands on the next. */
static void landing(struct arm *arm, const mhi_table *motion, const char *id, const char *yaml,
                    double *dq, double *dv, double *da) {
    struct test_integrator integrator = test_integrator_open(id, yaml, &arm->counted, arm);
    *dq = *dv = *da = 0;
    for (int32_t k = 0; k + 1 < motion->n_rows; k++) {
        const double *node = motion->values + k * motion->n_columns;
        const double *following = node + motion->n_columns;
        double next[N_X];
        test_integrate(&integrator, node, node + N_X, 0.01, next, NULL, NULL);
        for (int i = 0; i < N_X; i++) {
            double *error = i < N_Q ? dq : i < 2 * N_Q ? dv : da;
            *error = fmax(*error, fabs(next[i] - following[i]));
        }
    }
    print_message("%s, %s: lands within %.1e rad, %.1e rad/s, %.1e\n", id,
                  yaml[0] == '\0' ? "defaults" : yaml, *dq, *dv, *da);
    test_integrator_close(&integrator);
}

/* The motion was made with five steps of the classical scheme an interval: those repeat it. An
 * exact solution is as far from it as that scheme errs where a muscle passes a kink. */
static void seed_landing(void **state) {
    (void)state;
    struct arm arm;
    double dq, dv, da;
    mhi_table *motion = seed_motion();
    if (motion == NULL || !arm_open(&arm, "curves: paper2021")) {
        mhi_table_free(motion);
        skip();
    }
    landing(&arm, motion, RK, "{scheme: rk4, max_step: 0.002}", &dq, &dv, &da);
    assert_true(dq < 1e-6 && dv < 1e-4 && da < 1e-6);
    landing(&arm, motion, RK, REFINED, &dq, &dv, &da);
    assert_true(dq < 1e-5 && da < 1e-6);
    arm_close(&arm);
    mhi_table_free(motion);
}

static void seed_landing_by_cvodes(void **state) {
    (void)state;
    struct arm arm;
    double dq, dv, da;
    mhi_table *motion = seed_motion();
    if (motion == NULL || test_plugin(CVODES, MHE_INTEGRATOR_IFACE) == NULL ||
        !arm_open(&arm, "curves: paper2021")) {
        mhi_table_free(motion);
        skip();
    }
    assert_int_equal(motion->n_rows, 801);
    landing(&arm, motion, CVODES, EXACT, &dq, &dv, &da);
    assert_true(dq < 1e-5 && dv < 1e-3 && da < 1e-6);
    arm_close(&arm);
    mhi_table_free(motion);
}

/* Every interval of the seed's motion ends where CVODES ends it, without cuts those that cross no
 * kink. */
static void seed_against_cvodes(void **state) {
    (void)state;
    struct arm arm;
    mhi_table *motion = seed_motion();
    if (motion == NULL || test_plugin(CVODES, MHE_INTEGRATOR_IFACE) == NULL ||
        !arm_open(&arm, "curves: paper2021")) {
        mhi_table_free(motion);
        skip();
    }
    struct test_integrator fixed = test_integrator_open(RK, FIXED, &arm.counted, &arm);
    struct test_integrator refined = test_integrator_open(RK, REFINED, &arm.counted, &arm);
    struct test_integrator exact = test_integrator_open(CVODES, EXACT, &arm.counted, &arm);
    double worst[2] = {0, 0}, worst_refined = 0; /* with and without kinks; all */
    int count[2] = {0, 0};
    int64_t price[2] = {0, 0}; /* evaluations on intervals without kinks */
    for (int32_t k = 0; k + 1 < motion->n_rows; k++) {
        const double *x = motion->values + k * motion->n_columns, *u = x + N_X;
        double next[N_X], expected[N_X];
        int smooth = away_from_kinks(&arm, &fixed, x, u, 0.01);
        test_integrate(&exact, x, u, 0.01, expected, NULL, NULL);
        arm.plain = arm.full = 0;
        test_integrate(&fixed, x, u, 0.01, next, NULL, NULL);
        worst[smooth] = fmax(worst[smooth], test_relative(next, expected, N_X));
        price[0] += smooth * (arm.plain + arm.full);
        arm.plain = arm.full = 0;
        test_integrate(&refined, x, u, 0.01, next, NULL, NULL);
        worst_refined = fmax(worst_refined, test_relative(next, expected, N_X));
        price[1] += smooth * (arm.plain + arm.full);
        count[smooth]++;
    }
    print_message("seed's motion against CVODES: fixed steps %.1e over %d intervals, %.1e over %d "
                  "with kinks; refined %.1e; accelerations without kinks %.2f, refined %.2f\n",
                  worst[1], count[1], worst[0], count[0], worst_refined,
                  (double)price[0] / count[1], (double)price[1] / count[1]);
    assert_true(count[1] > 400);
    assert_true(worst[1] < 1e-5);
    assert_true(worst_refined < 1e-5);
    assert_true(price[1] - price[0] < 2 * count[1]);
    test_integrator_close(&fixed);
    test_integrator_close(&refined);
    test_integrator_close(&exact);
    arm_close(&arm);
    mhi_table_free(motion);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(degroote2016_against_cvodes), cmocka_unit_test(kinks_against_cvodes),
        cmocka_unit_test(reference_converges),         cmocka_unit_test(derivatives),
        cmocka_unit_test(derivatives_of_cut_steps),    cmocka_unit_test(seed_landing),
        cmocka_unit_test(seed_landing_by_cvodes),      cmocka_unit_test(seed_against_cvodes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* Curves, fibres and forces of OpenSim's muscles as its files state them, against OpenSim 4.5.1:
 * rigid tendons of Millard2012EquilibriumMuscle, static equilibrium of Thelen2003Muscle. */
#include "json.h"
#include "test_muscle.h"

#include "io/model_file.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What the plugin says of all muscles at one pose. */
struct pose {
    double *a, *l, *w, *state;
    double *length, *velocity, *pennation, *active, *passive, *force;
};

struct model {
    mhe_description *description;
    struct test_hill hill;
    cJSON *json;
    struct pose pose;
    double *memory;
};

static void model_open(struct model *m, const char *name, const char *yaml) {
    char file[128], path[1024];
    mhe_error err = {0};
    (void)snprintf(file, sizeof file, "opensim/%s.osim", name);
    if (test_data_path(path, sizeof path, file) == NULL) {
        skip();
    }
    if (mhi_model_read(path, &m->description, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    (void)snprintf(file, sizeof file, "opensim/%s.oracle.json", name);
    assert_non_null(test_data_path(path, sizeof path, file));
    m->json = test_json(path);
    int32_t n = m->description->n_muscles;
    m->hill = test_hill(m->description->muscles, n, yaml);
    if (m->hill.ops == NULL) {
        fail_msg("%s: %s", name, m->hill.err.text);
    }
    m->memory = calloc((size_t)(11 * n), sizeof *m->memory);
    assert_non_null(m->memory);
    double **const arrays[] = {
        &m->pose.a,         &m->pose.l,      &m->pose.w,       &m->pose.length, &m->pose.velocity,
        &m->pose.pennation, &m->pose.active, &m->pose.passive, &m->pose.force,  &m->pose.state};
    for (size_t i = 0; i < sizeof arrays / sizeof arrays[0]; i++) {
        *arrays[i] = m->memory + i * (size_t)n; /* the last takes two */
    }
}

static void model_close(struct model *m) {
    m->hill.ops->destroy(m->hill.self);
    cJSON_Delete(m->json);
    mhi_description_free(m->description);
    free(m->memory);
}

static void evaluate(struct model *m) {
    const struct pose *p = &m->pose;
    const mhe_muscle_point at = {
        .size = sizeof at, .excitation = p->a, .state = p->state, .length = p->l, .velocity = p->w};
    const mhe_muscle_values out = {.size = sizeof out,
                                   .force = p->force,
                                   .fiber_length = p->length,
                                   .fiber_velocity = p->velocity,
                                   .pennation = p->pennation,
                                   .active = p->active,
                                   .passive = p->passive};
    assert_int_equal(m->hill.ops->evaluate(m->hill.self, &at, &out, NULL), MHE_OK);
}

static double number(const cJSON *object, const char *key) {
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, key);
    assert_non_null(item);
    return item->valuedouble;
}

/* The n numbers of `key` of a line; 0: not there. */
static int numbers(const cJSON *line, const char *key, int n, double *out) {
    const cJSON *array = cJSON_GetObjectItemCaseSensitive(line, key);
    if (array == NULL) {
        return 0;
    }
    assert_int_equal(cJSON_GetArraySize(array), n);
    for (int i = 0; i < n; i++) {
        out[i] = cJSON_GetArrayItem(array, i)->valuedouble;
    }
    return 1;
}

/* Lengths and speeds of a pose into m->pose; a = 0.5. */
static void take_pose(struct model *m, const cJSON *lines) {
    for (int32_t i = 0; i < m->description->n_muscles; i++) {
        const cJSON *line =
            cJSON_GetObjectItemCaseSensitive(lines, m->description->muscles[i].name);
        assert_non_null(line);
        m->pose.a[i] = m->pose.state[i] = 0.5;
        m->pose.l[i] = number(line, "length");
        m->pose.w[i] = number(line, "speed");
    }
}

struct worst {
    double length, velocity, pennation, force;
    int rows, clamped, pushing, slack;
};

static void note(double *worst, double value, double expected, double scale) {
    double error = fabs(value - expected) / scale;
    *worst = error <= *worst ? *worst : error;
}

/* The shortest fibre OpenSim allows, m. */
static double shortest(const mhe_muscle *m, double least) {
    double most = isnan(m->maximum_pennation_angle) ? acos(0.1) : m->maximum_pennation_angle;
    return fmax(least * m->optimal_fiber_length,
                m->optimal_fiber_length * sin(m->pennation_angle) / sin(most));
}

/* expected: activation, fibre length, velocity, pennation, fl, fv, fp, active, passive (with
 * damping) along the fibre, tendon force. */
static void compare_rigid(const struct model *m, int32_t i, const double *expected,
                          struct worst *worst) {
    const mhe_muscle *muscle = &m->description->muscles[i];
    const struct pose *p = &m->pose;
    const double f_max = muscle->max_isometric_force, l_opt = muscle->optimal_fiber_length;
    const double x0 = muscle->millard.min_norm_active_fiber_length;
    const double bound = shortest(muscle, isnan(x0) ? 0.4441 : x0);
    worst->rows++;
    if (expected[2] == 0 && expected[1] <= bound * (1 + 1e-12) && expected[9] == 0) {
        /* OpenSim holds the fibre at its shortest: ours is there or shorter, with no active force
         */
        assert_true(p->l[i] <= muscle->tendon_slack_length || p->length[i] <= bound * (1 + 1e-9));
        assert_true(p->l[i] <= muscle->tendon_slack_length || p->active[i] < 1e-6 * f_max);
        worst->clamped++;
        return;
    }
    note(&worst->length, p->length[i], expected[1], l_opt);
    note(&worst->velocity, p->velocity[i], expected[2], l_opt);
    note(&worst->pennation, p->pennation[i], expected[3], 1);
    note(&worst->force, p->active[i], expected[7], f_max);
    note(&worst->force, p->active[i], 0.5 * expected[4] * expected[5] * f_max, f_max);
    if (p->force[i] < 0) { /* OpenSim lets no fibre push */
        assert_true(expected[9] == 0 && expected[8] == -expected[7]);
        worst->pushing++;
        return;
    }
    note(&worst->force, p->passive[i], expected[8], f_max);
    note(&worst->force, p->force[i], expected[9], f_max);
}

static void millard_rigid(void **state) {
    (void)state;
    static const char *const names[] = {"gait10dof18musc",
                                        "subject01_metabolics_path_spring",
                                        "gait2392_millard2012muscle",
                                        "Rajagopal2016",
                                        "RajagopalLaiUhlrich2023",
                                        "Tug_of_War_Millard",
                                        "MOBL_ARMS_41",
                                        "HYOID",
                                        "ThoracoscapularShoulderModel"};
    struct worst worst = {0};
    for (size_t k = 0; k < sizeof names / sizeof names[0]; k++) {
        struct model m = {0};
        const cJSON *pose = NULL;
        model_open(&m, names[k], "");
        cJSON_ArrayForEach(pose, cJSON_GetObjectItemCaseSensitive(m.json, "poses")) {
            const cJSON *lines = cJSON_GetObjectItemCaseSensitive(pose, "lines");
            take_pose(&m, lines);
            evaluate(&m);
            for (int32_t i = 0; i < m.description->n_muscles; i++) {
                double expected[10];
                const char *name = m.description->muscles[i].name;
                if (numbers(cJSON_GetObjectItemCaseSensitive(lines, name), "rigid_tendon", 10,
                            expected)) {
                    compare_rigid(&m, i, expected, &worst);
                }
            }
        }
        model_close(&m);
    }
    print_message("%d rows, %d with the fibre held, %d pushing: length %.1e velocity %.1e l_opt, "
                  "pennation %.1e, forces %.1e F_max\n",
                  worst.rows, worst.clamped, worst.pushing, worst.length, worst.velocity,
                  worst.pennation, worst.force);
    assert_true(worst.rows >= 4944 && worst.clamped < 250 && worst.pushing < 20);
    assert_true(worst.length < 1e-11 && worst.velocity < 1e-11 && worst.pennation < 1e-11);
    assert_true(worst.force < 1e-11);
}

/* expected: activation, fibre length, pennation, fl, fp, active, passive, tendon force. */
static void compare_equilibrium(const struct model *m, int32_t i, const double *expected,
                                struct worst *worst) {
    const mhe_muscle *muscle = &m->description->muscles[i];
    const struct pose *p = &m->pose;
    const double f_max = muscle->max_isometric_force, l_opt = muscle->optimal_fiber_length;
    const int slack = expected[1] <= shortest(muscle, 0) * (1 + 1e-9);
    worst->rows++;
    worst->slack += slack;
    note(&worst->length, p->length[i], expected[1], l_opt);
    note(&worst->pennation, p->pennation[i], expected[2], 1);
    if (!slack) { /* OpenSim says 0 there although a fl is not */
        note(&worst->force, p->active[i], expected[5], f_max);
        note(&worst->force, p->passive[i], expected[6], f_max);
    }
    note(&worst->force, p->force[i], expected[7], f_max);
}

static const char *const thelen_models[] = {"arm26",
                                            "CoupledCoordinatesMPPsMomentArmTest",
                                            "FullBodyModel_Hamner2010_v2_0",
                                            "MovingPathPointMomentArmTest",
                                            "MultipleMPPsMomentArmTest",
                                            "P2PBallJointMomentArmTest",
                                            "PathOnConstrainedBodyMomentArmTest",
                                            "WrapPathCustomJointMomentArmTest",
                                            "Wu_Shoulder_Model_via_points",
                                            "gait2354_simbody",
                                            "gait2392_thelen2003muscle",
                                            "leg39",
                                            "testMomentArmsConstraintA",
                                            "testMomentArmsConstraintB"};
#define N_THELEN (sizeof thelen_models / sizeof thelen_models[0])

static void thelen_equilibrium(void **state) {
    (void)state;
    struct worst worst = {0};
    int rigid = 0;
    for (size_t k = 0; k < N_THELEN; k++) {
        struct model m = {0};
        const cJSON *pose = NULL;
        model_open(&m, thelen_models[k], "tendon: elastic");
        mhe_muscle_layout layout = {.size = sizeof layout};
        assert_int_equal(m.hill.ops->layout(m.hill.self, &layout, NULL), MHE_OK);
        int32_t n = m.description->n_muscles;
        cJSON_ArrayForEach(pose, cJSON_GetObjectItemCaseSensitive(m.json, "poses")) {
            const cJSON *lines = cJSON_GetObjectItemCaseSensitive(pose, "lines");
            mhe_error err = {0};
            take_pose(&m, lines);
            memset(m.pose.w, 0, sizeof(double) * (size_t)n);
            assert_int_equal(m.hill.ops->equilibrium(m.hill.self, m.pose.a, m.pose.l, m.pose.w,
                                                     m.pose.state, &err),
                             MHE_OK);
            evaluate(&m);
            for (int32_t i = 0; i < n; i++) {
                double expected[8];
                const cJSON *line =
                    cJSON_GetObjectItemCaseSensitive(lines, m.description->muscles[i].name);
                if (!numbers(line, "static_equilibrium", 8, expected)) {
                    continue;
                }
                if (layout.n_states == 1 || !layout.present[n + i]) {
                    rigid++; /* a short tendon stays rigid */
                    continue;
                }
                compare_equilibrium(&m, i, expected, &worst);
            }
        }
        model_close(&m);
    }
    print_message("%d rows, %d slack, %d beside with rigid tendons: length %.1e l_opt, pennation "
                  "%.1e, forces %.1e F_max\n",
                  worst.rows, worst.slack, rigid, worst.length, worst.pennation, worst.force);
    assert_true(worst.rows > 3000);
    assert_true(worst.length < 1e-6 && worst.pennation < 1e-6 && worst.force < 1e-6);
}

/* expected: fibre length, pennation, fl, fp with the tendon at its slack length. */
static void thelen_rigid(void **state) {
    (void)state;
    struct worst worst = {0};
    for (size_t k = 0; k < N_THELEN; k++) {
        struct model m = {0};
        const cJSON *pose = NULL;
        model_open(&m, thelen_models[k], "");
        cJSON_ArrayForEach(pose, cJSON_GetObjectItemCaseSensitive(m.json, "poses")) {
            const cJSON *lines = cJSON_GetObjectItemCaseSensitive(pose, "lines");
            take_pose(&m, lines);
            memset(m.pose.w, 0, sizeof(double) * (size_t)m.description->n_muscles);
            evaluate(&m);
            for (int32_t i = 0; i < m.description->n_muscles; i++) {
                const mhe_muscle *muscle = &m.description->muscles[i];
                double f_max = muscle->max_isometric_force, expected[4];
                if (numbers(cJSON_GetObjectItemCaseSensitive(lines, muscle->name),
                            "at_rigid_tendon_length", 4, expected)) {
                    worst.rows++;
                    note(&worst.length, m.pose.length[i], expected[0],
                         muscle->optimal_fiber_length);
                    note(&worst.pennation, m.pose.pennation[i], expected[1], 1);
                    note(&worst.force, m.pose.active[i], 0.5 * expected[2] * f_max, f_max);
                    note(&worst.force, m.pose.passive[i], expected[3] * f_max,
                         f_max * fmax(1, expected[3]));
                }
            }
        }
        model_close(&m);
    }
    print_message("%d rows: length %.1e l_opt, pennation %.1e, forces %.1e F_max\n", worst.rows,
                  worst.length, worst.pennation, worst.force);
    assert_true(worst.rows > 4000);
    assert_true(worst.length < 1e-11 && worst.pennation < 1e-11 && worst.force < 1e-11);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(millard_rigid),
                                       cmocka_unit_test(thelen_rigid),
                                       cmocka_unit_test(thelen_equilibrium)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

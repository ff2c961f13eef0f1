/* SPDX-License-Identifier: Apache-2.0 */
/* What must hold between the answers, whoever is right about a model: velocity terms are those of
 * the mass matrix, reactions are Newton's.
 *
 * The knee of Rajagopal2016 turns about three axes by one coordinate. OpenSim's inverse dynamics
 * there is not that of its own mass matrix (test_opensim.c), so this stands in for it. */
#include "support.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <mhe/inspect.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAX_N 40

static cJSON *ask(const char *path, cJSON *question) {
    char *text = cJSON_PrintUnformatted(question), *answer = NULL;
    mhe_error err = {0};
    if (mhe_model_evaluate(NULL, path, "poses", text, strlen(text), MHE_PATHS_EXACT, &answer,
                           &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    cJSON *out = cJSON_Parse(answer);
    assert_non_null(out);
    mhe_free(answer);
    free(text);
    cJSON_Delete(question);
    return out;
}

static cJSON *new_pose(cJSON *list) {
    cJSON *pose = cJSON_CreateObject();
    (void)cJSON_AddItemToArray(list, pose);
    return pose;
}

static const cJSON *pose_of(const cJSON *answer, int k) {
    return cJSON_GetArrayItem(cJSON_GetObjectItemCaseSensitive(answer, "poses"), k);
}

static double member(const cJSON *pose, const char *key, const char *name) {
    return cJSON_GetObjectItemCaseSensitive(cJSON_GetObjectItemCaseSensitive(pose, key), name)
        ->valuedouble;
}

/* dM/dq_k of the answers at +-h and +-2h. */
static void difference(const cJSON *answer, int first, double h, int n, double *out) {
    static const double weights[4] = {8, -8, -1, 1};
    memset(out, 0, sizeof *out * (size_t)(n * n));
    for (int s = 0; s < 4; s++) {
        const cJSON *row =
            cJSON_GetObjectItemCaseSensitive(pose_of(answer, first + s), "mass_matrix")->child;
        for (int i = 0; i < n; i++, row = row->next) {
            const cJSON *entry = row->child;
            for (int k = 0; k < n; k++, entry = entry->next) {
                out[i * n + k] += weights[s] * entry->valuedouble / (12 * h);
            }
        }
    }
}

/* Velocity terms v' dM/dt - (1/2) d(v' M v)/dq against those of inverse dynamics. */
static void check_velocity_terms(const char *path, uint64_t seed) {
    static const double steps[4] = {1, -1, 2, -2};
    const double h = 1e-4;
    mhe_error err = {0};
    char *info = NULL;
    if (mhe_model_info(NULL, path, MHE_FORMAT_JSON, &info, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    cJSON *model = cJSON_Parse(info), *question = cJSON_CreateObject();
    const cJSON *free_ones = cJSON_GetObjectItemCaseSensitive(model, "coordinates"), *c = NULL;
    cJSON *list = cJSON_AddArrayToObject(question, "poses");
    const int n = cJSON_GetArraySize(free_ones);
    const char *names[MAX_N];
    double q[MAX_N], v[MAX_N], expected[MAX_N] = {0}, *slope = calloc(MAX_N * MAX_N, sizeof *slope);
    int at = 0;
    mhe_free(info);
    assert_true(n <= MAX_N && slope != NULL);
    cJSON_ArrayForEach(c, free_ones) {
        names[at] = cJSON_GetObjectItemCaseSensitive(c, "name")->valuestring;
        q[at] = test_random(&seed, 0.1, 0.9);
        v[at++] = test_random(&seed, -2, 2);
    }
    for (int k = -2; k < 4 * n; k++) { /* moving, still, then the steps */
        cJSON *pose = new_pose(list), *angles = cJSON_AddObjectToObject(pose, "q");
        cJSON *rates = cJSON_AddObjectToObject(pose, "u");
        for (int i = 0; i < n; i++) {
            const double step = k >= 0 && i == k / 4 ? h * steps[k % 4] : 0;
            (void)cJSON_AddNumberToObject(angles, names[i], q[i] + step);
            (void)cJSON_AddNumberToObject(rates, names[i], k == -2 ? v[i] : 0);
        }
    }
    cJSON *answer = ask(path, question);
    for (int k = 0; k < n; k++) {
        difference(answer, 2 + 4 * k, h, n, slope);
        for (int i = 0; i < n; i++) {
            for (int j = 0; j < n; j++) {
                expected[i] += v[k] * slope[i * n + j] * v[j];
                expected[k] -= 0.5 * v[i] * slope[i * n + j] * v[j];
            }
        }
    }
    for (int i = 0; i < n; i++) {
        const double got = member(pose_of(answer, 0), "inverse_dynamics", names[i]) -
                           member(pose_of(answer, 1), "inverse_dynamics", names[i]);
        if (!(fabs(got - expected[i]) < 1e-7 * fmax(1, fabs(expected[i])))) {
            fail_msg("%s: %.12g, by the mass matrix %.12g", names[i], got, expected[i]);
        }
    }
    free(slope);
    cJSON_Delete(answer);
    cJSON_Delete(model);
}

static void velocity_terms_are_those_of_the_mass_matrix(void **state) {
    static const char *const models[] = {
        "opensim/Rajagopal2016.osim", "opensim/RajagopalLaiUhlrich2023.osim", "opensim/leg39.osim"};
    char path[1024];
    (void)state;
    for (size_t i = 0; i < sizeof models / sizeof *models; i++) {
        if (test_data_path(path, sizeof path, models[i]) == NULL) {
            skip();
        }
        check_velocity_terms(path, 3 + i);
    }
}

#define BODY(name, mass)                                                               \
    "<Body name=\"" name "\"><mass>" mass "</mass><mass_center>0 -0.5 0</mass_center>" \
    "<inertia>0.1 0.1 0.1 0 0 0</inertia></Body>"
#define FRAME(name, body, at)                                                        \
    "<PhysicalOffsetFrame name=\"" name "\"><socket_parent>" body "</socket_parent>" \
    "<translation>" at "</translation></PhysicalOffsetFrame>"
#define PIN(name, parent, child)                                                               \
    "<PinJoint name=\"" name "\"><socket_parent_frame>p</socket_parent_frame>"                 \
    "<socket_child_frame>c</socket_child_frame><coordinates><Coordinate name=\"" name "_q\"/>" \
    "</coordinates><frames>" FRAME("p", parent, "0 -1 0")                                      \
        FRAME("c", child, "0 0 0") "</frames></PinJoint>"
#define POINT(body, at)                                                           \
    "<PathPoint><socket_parent_frame>" body "</socket_parent_frame><location>" at \
    "</location></PathPoint>"

/* Two rods in a row, a muscle along the lower joint, hanging still: the joints carry what is below
 * them, and the lower one the muscle's pull besides. */
static void joints_carry_what_hangs_on_them(void **state) {
    (void)state;
    const char *text =
        "<OpenSimDocument Version=\"40000\"><Model name=\"m\"><BodySet><objects>" BODY("a", "2")
            BODY("b", "3") "</objects></BodySet><JointSet><objects>" PIN("upper", "/ground",
                                                                         "/bodyset/a")
                PIN("lower", "/bodyset/a",
                    "/bodyset/b") "</objects></JointSet><ForceSet><objects><Thelen2003Muscle "
                                  "name=\"m\"><GeometryPath>"
                                  "<PathPointSet><objects>" POINT("/bodyset/a", "0.1 -0.5 0") POINT(
                                      "/bodyset/b",
                                      "0.1 -0.5 0") "</objects></PathPointSet></GeometryPath></"
                                                    "Thelen2003Muscle></objects></ForceSet>"
                                                    "</Model></OpenSimDocument>";
    char path[1024];
    (void)snprintf(path, sizeof path, "%s/tests/inspect_rods.osim", MHE_TEST_BINARY_DIR);
    FILE *stream = fopen(path, "wb");
    assert_non_null(stream);
    (void)fputs(text, stream);
    (void)fclose(stream);
    cJSON *question = cJSON_CreateObject();
    cJSON *pose = new_pose(cJSON_AddArrayToObject(question, "poses"));
    (void)cJSON_AddNumberToObject(cJSON_AddObjectToObject(pose, "forces"), "m", 70);
    cJSON *load = cJSON_CreateObject();
    (void)cJSON_AddItemToArray(cJSON_AddArrayToObject(pose, "external"), load);
    (void)cJSON_AddStringToObject(load, "body", "b");
    const double force[3] = {5, 0, 0}, point[3] = {0, -2.5, 0};
    (void)cJSON_AddItemToObject(load, "force", cJSON_CreateDoubleArray(force, 3));
    (void)cJSON_AddItemToObject(load, "point", cJSON_CreateDoubleArray(point, 3));
    cJSON *answer = ask(path, question);
    const double g = 9.80665;
    /* upper joint at (0 -1 0), lower at (0 -2 0): weights below, the load of 5 N at 0.5 m below the
     * lower; the muscle pulls b up by 70 N at x = 0.1 */
    const double expected[2][2][3] = {{{-5, 5 * g, 0}, {0, 0, -7.5}},
                                      {{-5, 3 * g - 70, 0}, {0, 0, -2.5 - 7}}};
    static const char *const joints[] = {"upper", "lower"}, *const parts[] = {"force", "moment"};
    const cJSON *reactions = cJSON_GetObjectItemCaseSensitive(pose_of(answer, 0), "reactions");
    for (int j = 0; j < 2; j++) {
        const cJSON *reaction = cJSON_GetObjectItemCaseSensitive(reactions, joints[j]);
        for (int p = 0; p < 2; p++) {
            for (int i = 0; i < 3; i++) {
                const cJSON *list = cJSON_GetObjectItemCaseSensitive(reaction, parts[p]);
                const double got = cJSON_GetArrayItem(list, i)->valuedouble;
                if (!(fabs(got - expected[j][p][i]) < 1e-12)) {
                    fail_msg("%s of %s, %d: %.15g, not %.15g", parts[p], joints[j], i, got,
                             expected[j][p][i]);
                }
            }
        }
    }
    cJSON_Delete(answer);
    (void)remove(path);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(velocity_terms_are_those_of_the_mass_matrix),
        cmocka_unit_test(joints_carry_what_hangs_on_them)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: Apache-2.0 */
#include "oracle.h"
#include "json.h"

#include "support.h"

#include <mhe/inspect.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *path_of(char *out, size_t size, const char *name, const char *ending) {
    char file[256];
    (void)snprintf(file, sizeof file, "opensim/%s%s", name, ending);
    return test_data_path(out, size, file);
}

static int is_angular(const char *joint_type) {
    static const char *const types[] = {"BallJoint", "FreeJoint", "EllipsoidJoint",
                                        "ScapulothoracicJoint"};
    for (size_t i = 0; i < sizeof types / sizeof *types; i++) {
        if (strcmp(joint_type, types[i]) == 0) {
            return 1;
        }
    }
    return 0;
}

static const char *word(const cJSON *object, const char *name) {
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, name);
    return cJSON_IsString(item) ? item->valuestring : "";
}

int oracle_open(oracle *o, const char *name) {
    *o = (oracle){.root = test_oracle(name)};
    if (o->root == NULL) {
        return 0;
    }
    o->coordinates = cJSON_GetObjectItemCaseSensitive(o->root, "coordinates");
    o->poses = cJSON_GetObjectItemCaseSensitive(o->root, "poses");
    const char *joint = "";
    int first = 0;
    const cJSON *c = NULL;
    cJSON_ArrayForEach(c, o->coordinates) {
        assert_true(o->n < MAX_C);
        if (strcmp(word(c, "joint"), joint) != 0) {
            joint = word(c, "joint");
            first = o->n;
        }
        o->name[o->n] = word(c, "name");
        o->dependent[o->n] = cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(c, "dependent"));
        o->triple[o->n] = is_angular(word(c, "joint_type")) && o->n < first + 3 ? first : -1;
        o->angular |= o->triple[o->n] >= 0;
        o->n++;
    }
    return 1;
}

void oracle_close(oracle *o) {
    cJSON_Delete(o->root);
}

int oracle_number(const oracle *o, const char *coordinate) {
    for (int i = 0; i < o->n; i++) {
        if (strcmp(o->name[i], coordinate) == 0) {
            return i;
        }
    }
    fail_msg("the oracle has no coordinate '%s'", coordinate);
    return -1;
}

double oracle_value(const cJSON *object, const char *name) {
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, name);
    return cJSON_IsNumber(item) ? item->valuedouble : 0;
}

int oracle_mass(const oracle *o, const cJSON *pose, double *mass) {
    const cJSON *entry = cJSON_GetObjectItemCaseSensitive(pose, "mass_matrix_upper");
    entry = entry != NULL ? entry->child : NULL;
    if (entry == NULL) {
        return 0;
    }
    for (int i = 0; i < o->n; i++) {
        for (int k = i; k < o->n; k++, entry = entry->next) {
            assert_non_null(entry);
            mass[i * o->n + k] = mass[k * o->n + i] = entry->valuedouble;
        }
    }
    return 1;
}

/* Accelerations of the coordinates that give the oracle's accelerations of the speeds: of the three
 * angles of a joint N qddot = udot - (dN/dt) qdot, by Cramer's rule. */
static void add_accelerations(const oracle *o, const cJSON *pose, cJSON *out) {
    double map[MAX_C * MAX_C], rest[MAX_C];
    const cJSON *udot = cJSON_GetObjectItemCaseSensitive(pose, "udot");
    angular_map(o, pose, map, rest);
    for (int i = 0; i < o->n; i++) {
        double value = oracle_value(udot, o->name[i]);
        const int t = o->triple[i];
        if (o->dependent[i]) {
            continue;
        }
        if (t >= 0) {
            double a[3][3], b[3][3], det[2];
            for (int r = 0; r < 3; r++) {
                for (int c = 0; c < 3; c++) {
                    a[r][c] = b[r][c] = map[(t + r) * o->n + t + c];
                }
                b[r][i - t] = oracle_value(udot, o->name[t + r]) - rest[t + r];
            }
            for (int m = 0; m < 2; m++) {
                double(*x)[3] = m == 0 ? a : b;
                det[m] = x[0][0] * (x[1][1] * x[2][2] - x[1][2] * x[2][1]) -
                         x[0][1] * (x[1][0] * x[2][2] - x[1][2] * x[2][0]) +
                         x[0][2] * (x[1][0] * x[2][1] - x[1][1] * x[2][0]);
            }
            value = det[1] / det[0];
        }
        (void)cJSON_AddNumberToObject(out, o->name[i], value);
    }
}

static cJSON *question(const oracle *o) {
    cJSON *root = cJSON_CreateObject();
    cJSON *list = cJSON_AddArrayToObject(root, "poses");
    const cJSON *pose = NULL;
    cJSON_ArrayForEach(pose, o->poses) {
        cJSON *out = cJSON_CreateObject();
        const cJSON *u = cJSON_GetObjectItemCaseSensitive(pose, "qdot");
        u = u != NULL ? u : cJSON_GetObjectItemCaseSensitive(pose, "u");
        (void)cJSON_AddItemToObject(
            out, "q", cJSON_Duplicate(cJSON_GetObjectItemCaseSensitive(pose, "q"), 1));
        (void)cJSON_AddItemToObject(out, "u", cJSON_Duplicate(u, 1));
        add_accelerations(o, pose, cJSON_AddObjectToObject(out, "udot"));
        (void)cJSON_AddNumberToObject(out, "activation", 0.5);
        (void)cJSON_AddItemToArray(list, out);
    }
    return root;
}

cJSON *oracle_ask(const oracle *o, const char *name) {
    char path[1024], *answer = NULL;
    mhe_error err = {0};
    cJSON *asked = question(o);
    char *text = cJSON_PrintUnformatted(asked);
    assert_non_null(path_of(path, sizeof path, name, ".osim"));
    if (mhe_model_evaluate(NULL, path, "poses", text, strlen(text), MHE_PATHS_EXACT, &answer,
                           &err) != MHE_OK) {
        fail_msg("%s: %s", name, err.text);
    }
    cJSON *out = cJSON_Parse(answer);
    assert_non_null(out);
    mhe_free(answer);
    free(text);
    cJSON_Delete(asked);
    return out;
}

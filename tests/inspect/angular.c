/* SPDX-License-Identifier: Apache-2.0 */
/* angular.c: from rates of body-fixed x-y-z angles to the angular velocity in the parent's axes,
 * which OpenSim has as speeds of ball, free and ellipsoid joints. */
#include "oracle.h"

#include <math.h>
#include <string.h>

void angular_map(const oracle *o, const cJSON *pose, double *map, double *rest) {
    const cJSON *q = cJSON_GetObjectItemCaseSensitive(pose, "q");
    const cJSON *rates = cJSON_GetObjectItemCaseSensitive(pose, "qdot");
    rates =
        rates != NULL ? rates : cJSON_GetObjectItemCaseSensitive(pose, "u"); /* the same there */
    memset(map, 0, sizeof *map * (size_t)(o->n * o->n));
    for (int i = 0; i < o->n; i++) {
        rest[i] = 0;
        map[i * o->n + i] = o->triple[i] < 0;
    }
    for (int t = 0; t < o->n; t++) {
        if (o->triple[t] != t) {
            continue;
        }
        const double a = oracle_value(q, o->name[t]), b = oracle_value(q, o->name[t + 1]);
        const double da = oracle_value(rates, o->name[t]), db = oracle_value(rates, o->name[t + 1]);
        const double dc = oracle_value(rates, o->name[t + 2]);
        /* columns: the axes of the three turns, and how they turn themselves */
        const double axes[3][3] = {
            {1, 0, sin(b)}, {0, cos(a), -sin(a) * cos(b)}, {0, sin(a), cos(a) * cos(b)}};
        const double turn[3][2] = {{0, cos(b) * db},
                                   {-sin(a) * da, -cos(a) * cos(b) * da + sin(a) * sin(b) * db},
                                   {cos(a) * da, -sin(a) * cos(b) * da - cos(a) * sin(b) * db}};
        for (int r = 0; r < 3; r++) {
            for (int c = 0; c < 3; c++) {
                map[(t + r) * o->n + t + c] = axes[r][c];
            }
            rest[t + r] = turn[r][0] * db + turn[r][1] * dc;
        }
    }
}

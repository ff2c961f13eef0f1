/* SPDX-License-Identifier: Apache-2.0 */
/* oracle.h: what OpenSim said of a model at a pose, and what we say. */
#ifndef TEST_ORACLE_H
#define TEST_ORACLE_H

#include <cjson/cJSON.h>
#include <stdint.h>

#define MAX_C 48 /* coordinates of one model */

typedef struct oracle {
    cJSON *root;
    const cJSON *coordinates, *poses;
    int n; /* coordinates */
    const char *name[MAX_C];
    int dependent[MAX_C];
    int triple[MAX_C];  /* first of three angles whose speeds are an angular velocity; -1 */
    int angular;        /* there are such */
    int loops;          /* constraints other than couplers are in the file */
    int turns_together; /* one coordinate drives several rotation axes of a joint */
} oracle;

/* Reads NAME.oracle.json; 0 where the data is not there. Fails the test where it cannot be read. */
int oracle_open(oracle *o, const char *name);
void oracle_close(oracle *o);
int oracle_number(const oracle *o, const char *coordinate);

/* The model's answer at all poses; the caller's to delete. */
cJSON *oracle_ask(const oracle *o, const char *name);

/* Member as a number, 0 where it is absent. */
double oracle_value(const cJSON *object, const char *name);

/* Rows of M [n x n] of a pose; 0 where the file has none. */
int oracle_mass(const oracle *o, const cJSON *pose, double *mass);

/* angular.c: speeds u = N(q) qdot of the pose's coordinates: N [n x n], and (dN/dt) qdot [n]. */
void angular_map(const oracle *o, const cJSON *pose, double *map, double *rest);

#endif

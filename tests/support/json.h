/* SPDX-License-Identifier: Apache-2.0 */
/* json.h: JSON files as tests read them. */
#ifndef TEST_JSON_H
#define TEST_JSON_H

#include <cjson/cJSON.h>

/* The file's content; the caller's to delete. Fails the test where it cannot be read. */
cJSON *test_json(const char *path);

/* What OpenSim said of a model of the reference data, opensim/NAME.oracle.json; NULL where that is
 * not there. */
cJSON *test_oracle(const char *name);

#endif

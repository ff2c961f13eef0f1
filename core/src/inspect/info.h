/* SPDX-License-Identifier: Apache-2.0 */
/* info.h: parts of mhe_model_info(). */
#ifndef MHI_INFO_H
#define MHI_INFO_H

#include "base/text.h"

#include <mhe/description.h>

#include <cjson/cJSON.h>

/* 1 where path `path` depends on coordinate c (free, [0, n_coordinates)) directly or by what
 * follows it: crossed [n_coordinates]. */
void mhi_info_crossed(const mhe_description *d, int32_t path, uint8_t *crossed);
/* The free coordinate that number c follows in the end. */
int32_t mhi_info_root(const mhe_description *d, int32_t c);
const char *mhi_info_coordinate(const mhe_description *d, int32_t c);
const char *mhi_info_body(const mhe_description *d, int32_t body); /* -1: "ground" */
const char *mhi_info_muscle_type(int32_t type);
extern const char *const mhi_info_obstacles[4];

/* The same as JSON. NULL: out of memory. */
cJSON *mhi_info_json(const mhe_description *d);

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* scaled.h: the generic model scaled to the person, before anything else. */
#ifndef CALIBRATE_SCALED_H
#define CALIBRATE_SCALED_H

#include "base/text.h"

#include <mhe/host.h>

/* Scales as `setup` says to `out`/scaled.osim; *path is where that is, for model.file. What was
 * done is printed unless `quiet`. [cold] */
mhe_status scaled_make(const mhe_host *host, const char *setup, const char *out, int32_t quiet,
                       mhi_text *path, mhe_error *err);

#endif

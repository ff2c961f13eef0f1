/* SPDX-License-Identifier: Apache-2.0 */
/* recording.h: what a public recording holds. */
#ifndef MHI_LIBRARY_RECORDING_H
#define MHI_LIBRARY_RECORDING_H

#include "estimator/recording.h"

#include <mhe/recording.h>

struct mhe_recording {
    mhi_recording *data;
    mhe_recording_info info;
};

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* taping.h: everything that the feed takes, as an .xdf. */
#ifndef MHI_TAPING_H
#define MHI_TAPING_H

#include "live/feed.h"

typedef struct mhi_taping mhi_taping;

/* Begins a file. `title`: the config's name. MHE_E_IO. [cold] */
mhe_status mhi_taping_open(const char *path, const char *title, mhi_taping **record,
                           mhe_error *err);
/* A packet as the feed takes it: a description, or samples. What cannot be written ends the
 * recording: MHE_E_IO. [cold] */
mhe_status mhi_taping_take(mhi_taping *record, const mhi_packet *packet, mhe_error *err);
/* A frame as it was estimated. [cold] */
mhe_status mhi_taping_frame(mhi_taping *record, const mhe_estimate *estimate, double host_time,
                            mhe_error *err);
/* What the frame of the packet taken last was granted. [cold] */
mhe_status mhi_taping_grant(mhi_taping *record, const mhe_grant *grant, double host_time,
                            mhe_error *err);
/* A maximum of a channel of the config that is taken from the next packet on. [cold] */
mhe_status mhi_taping_maximum(mhi_taping *record, int32_t channel, double value, mhe_error *err);
mhe_status mhi_taping_close(mhi_taping *record, mhe_error *err); /* NULL is fine. [cold] */
const char *mhi_taping_path(const mhi_taping *record);

#endif

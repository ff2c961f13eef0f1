/* SPDX-License-Identifier: Apache-2.0 */
/* marker_unit.h: are the markers in the unit that their file says, and anywhere at all? */
#ifndef MHI_MARKER_UNIT_H
#define MHI_MARKER_UNIT_H

#include "estimator/recording.h"

/* Distances of markers on one body are known; the measured ones still get `factor`. Where the
 * measured ones are larger or smaller by a power of ten as between mm, cm and m, the recording's
 * markers and unit are put right; that, or distances that fit in no way, is told to the host.
 * [cold] */
void mhi_marker_settle_unit(mhi_recording *recording, const mhe_description *model, double factor,
                            const char *path, const mhe_host *host);
/* Samples beyond any laboratory (a broken file's bytes read as numbers) become gaps; how many is
 * told to the host. [cold] */
void mhi_marker_leave_out_distant(mhi_recording *recording, int32_t n_markers, const char *path,
                                  const mhe_host *host);

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* c3d_write.h: markers and analog channels as one .c3d (c3d.org, user guide of 2008): Intel,
 * floats.
 */
#ifndef MHI_C3D_WRITE_H
#define MHI_C3D_WRITE_H

#include <mhe/outbox.h>

typedef struct mhi_c3d_content {
    const char *const *markers;  /* [n_markers] */
    const char *const *channels; /* [n_channels] */
    const char *unit;            /* of the channels */
    int32_t n_markers, n_channels, n_frames;
    int32_t per_frame;    /* analog samples in a frame's time */
    double rate, first;   /* of frames, Hz; time of the first one, s */
    const double *points; /* [n_frames x 3 n_markers], m; NaN: a gap */
    const double *analog; /* [n_frames per_frame x n_channels] */
} mhi_c3d_content;

/* A whole file; lengths are written in mm. MHE_E_INPUT: more than a .c3d holds (255 markers or
 * channels, 65535 frames or analog samples a frame), a first time that is no multiple of a frame's
 * time from 0 on, a missing analog sample; MHE_E_IO. [cold] */
mhe_status mhi_outbox_c3d(mhe_outbox *outbox, const char *name, const mhi_c3d_content *content,
                          mhe_error *err);

#endif

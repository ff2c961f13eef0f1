/* SPDX-License-Identifier: Apache-2.0 */
/* c3d_layout.h: where in a .c3d file which sample stands. */
#ifndef MHI_C3D_LAYOUT_H
#define MHI_C3D_LAYOUT_H

#include "io/c3d_parameters.h"

/* What the frames are made of. */
typedef struct mhi_c3d_layout {
    int32_t n_points, n_channels, per_frame; /* per_frame: samples of a channel */
    int32_t first, n_frames;                 /* number of the first frame, from 1 */
    int32_t is_float;
    double scale, rate;
    size_t start, frame_bytes, word;
    int32_t words;                                                /* analog samples in a frame */
    int32_t scales_differ, starts_differ, counts_differ, by_size; /* what was settled: told */
    int64_t lost; /* frames that the header promises and the file does not hold */
} mhi_c3d_layout;

/* From the header and the parameters, which say much of it twice and may contradict each other.
 * MHE_E_INPUT. [cold] */
mhe_status mhi_c3d_read_layout(const mhi_c3d_file *file, mhi_c3d_layout *layout);
/* A parameter of one number, `fallback` where there is none. */
double mhi_c3d_find_number(const mhi_c3d_file *file, const char *group, const char *name,
                           double fallback);

#endif

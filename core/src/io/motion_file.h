/* SPDX-License-Identifier: Apache-2.0 */
/* motion_file.h: measured markers and signals, whatever the format. */
#ifndef MHI_MOTION_FILE_H
#define MHI_MOTION_FILE_H

#include "io/table.h"

/* Markers: the points of a .c3d, the markers of an .xdf, anything else as .trc. MHE_E_INPUT as the
 * format's reader, and for a container without any. [cold] */
mhe_status mhi_markers_read(const char *path, mhi_table **table, mhe_error *err);
/* Signals: the analog channels of a .c3d, the EMG of an .xdf, anything else as .sto. [cold] */
mhe_status mhi_signals_read(const char *path, mhi_table **table, mhe_error *err);

#endif

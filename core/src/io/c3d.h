/* SPDX-License-Identifier: Apache-2.0 */
/* c3d.h: .c3d motion files (c3d.org, user guide of 2008): points and analog channels. */
#ifndef MHI_C3D_H
#define MHI_C3D_H

#include "io/table.h"

/* Reads points and analog channels; either pointer may be NULL, and either table is NULL where the
 * file has none. Integers and floats, Intel, DEC and MIPS; more than 255 labels (LABELS2, ...) and
 * more than 65535 frames (TRIAL:ACTUAL_...).
 *   points: as mhi_trc_read gives markers: metres by POINT:UNITS (mm where it says nothing), gaps
 *     (residual below 0, or exactly 0 0 0) are NaN.
 *   analog: (sample - OFFSET) SCALE GEN_SCALE, each channel a column; in ANALOG:UNITS.
 * The first frame's time is (its number - 1) / rate. Points without a label are "point_<number>",
 * channels "analog_<number>"; of equal labels the later ones get their number too.
 * MHE_E_INPUT: "file: what": not a .c3d, parameters that reach beyond the file, no frame. [cold] */
mhe_status mhi_c3d_read(const char *path, mhi_table **points, mhi_table **analog, mhe_error *err);
/* The same from memory. */
mhe_status mhi_c3d_parse(const char *name, const char *data, size_t length, mhi_table **points,
                         mhi_table **analog, mhe_error *err);

#endif

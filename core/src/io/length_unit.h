/* SPDX-License-Identifier: Apache-2.0 */
/* length_unit.h: units of length as motion files name them. */
#ifndef MHI_LENGTH_UNIT_H
#define MHI_LENGTH_UNIT_H

#include "base/number.h"

/* A unit in any of its spellings (mm, "[mm]", millimeters, Metre, inch ...). */
typedef struct mhi_length_unit {
    char name[8]; /* "mm", "cm", "m", ...; "" where the text is none */
    double metres;
} mhi_length_unit;

/* Letter case, brackets and dots do not matter. `metres` is 0 where the text is no unit. [any] */
mhi_length_unit mhi_length_unit_of(mhi_cell text);

#endif

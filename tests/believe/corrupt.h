/* SPDX-License-Identifier: Apache-2.0 */
/* corrupt.h: kinds of systematic error of a recording. */
#ifndef CORRUPT_H
#define CORRUPT_H

#include "io/motion_file.h"

typedef struct recording {
    mhi_table *markers, *emg;
    const char *unit; /* what the header of the markers says */
    uint64_t seed;
} recording;

typedef struct corruption {
    const char *name, *what;
    void (*apply)(recording *r);
} corruption;

extern const corruption corrupt_markers[], corrupt_emg[];
extern const size_t corrupt_n_markers, corrupt_n_emg;

double corrupt_uniform(recording *r);
double corrupt_normal(recording *r);
double *corrupt_cell(mhi_table *t, int32_t row, int32_t column);
void corrupt_stretch(mhi_table *t, double factor); /* its times */

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* picture_script.h: the gnuplot script of the picture. */
#ifndef MHE_RUN_PICTURE_SCRIPT_H
#define MHE_RUN_PICTURE_SCRIPT_H

#include "base/text.h"
#include "io/table.h"

#define PICTURE_ANGLES_MAX 12
#define PICTURE_FORCES_MAX 8
#define PICTURE_PANELS_MAX (PICTURE_ANGLES_MAX + PICTURE_FORCES_MAX)

/* One small diagram over time. */
typedef struct picture_panel {
    const char *name;
    int32_t of_forces; /* column of `forces`, else of `estimates` (rad) */
    int32_t column;
    int32_t reference_column; /* -1: no truth is known */
    double reference_scale;   /* to degrees or N */
} picture_panel;

typedef struct picture {
    const mhi_table *estimates, *forces;
    const mhi_table *reference; /* or NULL */
    picture_panel panels[PICTURE_PANELS_MAX];
    int32_t n_panels, n_angles; /* angles first */
} picture;

/* Appends the script, which holds all data it shows. */
void picture_script(const picture *p, mhi_text *script);

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* figure.h: small multiples over time (or another quantity), drawn by gnuplot: blocks of panels
 * under headings, four a row, one legend, one look. */
#ifndef FIGURE_H
#define FIGURE_H

#include "base/text.h"

#define FIGURE_DIRECT "to_standard_output" /* a gnuplot variable: set, no file is opened */

#define FIGURE_BLOCKS_MAX 2
#define FIGURE_PANELS_MAX 20
#define FIGURE_SERIES_MAX 5

/* Styles of lines. */
#define FIGURE_MADE 1   /* what was computed: blue */
#define FIGURE_TRUE 2   /* what is true: red, dashed */
#define FIGURE_SHADES 4 /* 4, 5 ... 7: light to dark, for an ordered few */

/* Values stand `stride` apart; what is not finite breaks the line; few have dots. Lent
 * to the figure. */
typedef struct figure_series {
    const double *time, *values; /* [n] */
    int32_t n, stride;
    double scale; /* factor of the values */
    int32_t style;
} figure_series;

typedef struct figure_panel {
    const char *name;
    figure_series series[FIGURE_SERIES_MAX];
    int32_t n_series;
} figure_panel;

typedef struct figure_block {
    char heading[96];
    const char *axis;    /* "force (N)" */
    double least;        /* an axis is no narrower than this */
    int32_t holds_zero;  /* every axis shows 0 */
    int32_t logarithmic; /* one logarithmic axis, the same for all its panels */
    int32_t n_panels;
} figure_block;

typedef struct figure {
    const char *program, *name; /* name.gp makes name.svg */
    const char *abscissa;       /* NULL: "time (s)" */
    int32_t per_row;            /* panels; 0: four. Fewer are wider and higher */
    double begin, end;          /* of the abscissa, s */
    figure_block blocks[FIGURE_BLOCKS_MAX];
    figure_panel panels[FIGURE_PANELS_MAX]; /* block by block */
    struct {
        const char *text;
        int32_t style;
    } legend[FIGURE_SERIES_MAX]; /* from the right */
    int32_t n_blocks, n_panels, n_legend;
} figure;

/* Appends the gnuplot script, which holds all data it shows. */
void figure_script(const figure *f, mhi_text *script);

/* Writes dir/<name>.gp, which can be edited and run again, and makes dir/<name>.svg of it.
 * MHE_E_UNSUPPORTED: gnuplot is not installed; the script is there, a picture of an earlier run is
 * not. [cold] */
mhe_status figure_draw(const figure *f, const char *dir, mhe_error *err);

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* figure_script.c: the figure in gnuplot's language. */
#include "base/number.h"
#include "figure.h"

#include <math.h>
#include <string.h>

#define DOTS_MAX 30
#define POINTS_MAX 1500 /* a line: more cannot be seen at this size */

/* Sizes in pixels. */
#define WIDTH 1180
#define LEFT 66
#define GAP_X 58
#define RIGHT 22
#define PANEL_Y 132
#define GAP_Y 40
#define TOP 34
#define BLOCK_TOP 54 /* heading of a block and the names of its first row */
#define BLOCK_END 66 /* time axis */

static int32_t per_row(const figure *f) {
    return f->per_row > 0 ? f->per_row : 4;
}

static int32_t panel_width(const figure *f) {
    return (WIDTH - LEFT - RIGHT - (per_row(f) - 1) * GAP_X) / per_row(f);
}

static int32_t panel_height(const figure *f) {
    return per_row(f) < 4 ? 2 * PANEL_Y : PANEL_Y;
}

static int32_t block_height(const figure *f, int32_t panels) {
    int32_t rows = (panels + per_row(f) - 1) / per_row(f);
    return rows == 0 ? 0 : BLOCK_TOP + rows * panel_height(f) + (rows - 1) * GAP_Y + BLOCK_END;
}

typedef struct range {
    double lower, upper;
} range;

/* One series as a data block; where it is longer than the eye can follow, evenly thinned. Widens
 * `y` to what it holds. */
static void add_data(mhi_text *script, const figure *f, int32_t panel, int32_t number, range *y) {
    const figure_series *line = &f->panels[panel].series[number];
    mhi_text_add(script, "$line%d_%d << END\n", panel, number);
    int32_t step = line->n / POINTS_MAX + 1;
    for (int32_t k = 0; k < line->n; k += step) {
        double value = line->scale * line->values[(ptrdiff_t)k * line->stride];
        if (line->time[k] < f->begin || line->time[k] > f->end) {
            continue;
        }
        if (isfinite(value)) {
            mhi_text_add(script, "%.7g %.6g\n", line->time[k], value);
            y->lower = fmin(y->lower, value);
            y->upper = fmax(y->upper, value);
        } else {
            mhi_text_add(script, "\n"); /* a break in the line */
        }
    }
    mhi_text_add(script, "END\n");
}

/* An axis over `y` with about four round steps; no narrower than `least`. */
static void add_axis(mhi_text *script, range y, double least) {
    if (!(y.lower <= y.upper)) { /* no number at all */
        y = (range){0, least};
    }
    double middle = (y.lower + y.upper) / 2, half = fmax(y.upper - y.lower, least) / 2;
    double rough = 2 * half / 4, ten = pow(10, floor(log10(rough)));
    double step = ten * (rough < 1.5 * ten   ? 1
                         : rough < 3.5 * ten ? 2
                         : rough < 7.5 * ten ? 5
                                             : 10);
    double lower = step * floor((middle - 1.02 * half) / step);
    double upper = step * ceil((middle + 1.02 * half) / step);
    mhi_text_add(script, "set yrange [%.9g:%.9g]\nset ytics %.9g\n",
                 y.lower >= 0 && lower < 0 ? 0 : lower, upper, step);
}

/* A logarithmic axis over `y` from and to 1, 2 or 5 of a decade, with these as its steps. */
static void add_decades(mhi_text *script, range y) {
    static const double steps[] = {1, 2, 5};
    if (!(y.lower <= y.upper) || !(y.lower > 0)) { /* nothing that it could show */
        y = (range){1, 10};
    }
    double lower = 0, upper = 0;
    mhi_text_add(script, "set logscale y\nset ytics (");
    for (int32_t i = 3 * (int32_t)floor(log10(y.lower)); upper <= y.upper; i++) {
        const int32_t decade = (i < 0 ? i - 2 : i) / 3;
        upper = steps[i - 3 * decade] * pow(10, decade);
        lower = upper <= y.lower ? upper : lower;
        mhi_text_add(script, "%.9g%s", upper, upper > y.upper ? "" : ",");
    }
    lower *= 1 - 1e-6; /* gnuplot's own rounding would lose the lowest step */
    mhi_text_add(script, ")\nset yrange [%.9g:%.9g]\n", lower, upper);
}

/* Text of a gnuplot string in single quotes. */
static void add_quoted(mhi_text *script, const char *text) {
    mhi_text_add(script, "'");
    for (const char *c = text; *c != '\0'; c++) {
        if (*c == '\'') {
            mhi_text_add(script, "''");
        } else {
            mhi_text_add(script, "%c", *c == '\n' ? ' ' : *c);
        }
    }
    mhi_text_add(script, "'");
}

static void add_look(mhi_text *script, const figure *f, int32_t height) {
    mhi_text_add(script,
                 "# Made by %s. Change and run it again: gnuplot %s.gp\n"
                 "set terminal svg size %d,%d enhanced font 'Helvetica,Arial,sans-serif,12' "
                 "background rgb 'white'\n"
                 "if (!exists('" FIGURE_DIRECT "')) set output '%s.svg'\n",
                 f->program, f->name, WIDTH, height, f->name);
    mhi_text_add(script, "set style line 1 lc rgb '#1b6ca8' lw 1.8\n"
                         "set style line 2 lc rgb '#d1495b' lw 1.8 dt (8,5)\n"
                         "set style line 3 lc rgb '#e3e3e3' lw 0.6\n"
                         "set style line 4 lc rgb '#8fc1e3' lw 1.8\n"
                         "set style line 5 lc rgb '#1b6ca8' lw 1.8\n"
                         "set style line 6 lc rgb '#0b2d48' lw 1.8\n"
                         "set style line 7 lc rgb '#000000' lw 1.8\n"
                         "set border 3 lc rgb '#555555' lw 0.8\n"
                         "set tics out nomirror scale 0.5 font ',10' textcolor rgb '#444444'\n"
                         "set grid ls 3\nunset key\nset multiplot\n");
    mhi_text_add(script, "set xrange [%.9g:%.9g]\n", f->begin,
                 f->end > f->begin ? f->end : f->begin + 1);
}

/* "screen x, screen y" of a point in pixels from the top left. */
static void add_point(mhi_text *script, double x, double y, int32_t height) {
    mhi_text_add(script, " screen %.5f, screen %.5f", x / WIDTH, 1 - y / height);
}

static void add_heading(mhi_text *script, int32_t y, int32_t height, const char *text) {
    mhi_text_add(script, "set label '%s' at", text);
    add_point(script, LEFT, y, height);
    mhi_text_add(script, " font ',15'\n");
}

/* One line of the legend at the top right: its sample ends at x. */
static void add_legend(mhi_text *script, int32_t x, int32_t height, const char *text,
                       int32_t style) {
    mhi_text_add(script, "set arrow from");
    add_point(script, x - 46, TOP, height);
    mhi_text_add(script, " to");
    add_point(script, x, TOP, height);
    mhi_text_add(script, " nohead ls %d\nset label '%s' at", style, text);
    add_point(script, x - 54, TOP, height);
    mhi_text_add(script, " right font ',13'\n");
}

/* Where a block's panels begin, and its first row in pixels. */
typedef struct place {
    int32_t first, top;
} place;

/* Few computed values are shown one by one. */
static int dotted(const figure_series *line) {
    return line->style == FIGURE_MADE && line->n <= DOTS_MAX;
}

static void add_panel(const figure *f, const figure_block *block, place at, int32_t number,
                      int32_t height, range values, mhi_text *script) {
    const figure_panel *panel = &f->panels[number];
    const int32_t wide = panel_width(f), high = panel_height(f);
    int32_t position = number - at.first, column = position % per_row(f),
            row = position / per_row(f);
    const int32_t left = LEFT + column * (wide + GAP_X);
    const double x = left, y = at.top + BLOCK_TOP + row * (high + GAP_Y);
    mhi_text_add(script, "set lmargin at screen %.5f\nset rmargin at screen %.5f\n", x / WIDTH,
                 (double)(left + wide) / WIDTH);
    mhi_text_add(script, "set tmargin at screen %.5f\nset bmargin at screen %.5f\n", 1 - y / height,
                 1 - (y + high) / height);
    mhi_text_add(script, "set title ");
    add_quoted(script, panel->name);
    mhi_text_add(script, " noenhanced offset 0,-0.6 font ',12'\n");
    if (column == 0) {
        mhi_text_add(script, "set label '%s' at", block->axis);
        add_point(script, 16, y + high / 2.0, height);
        mhi_text_add(script, " center rotate\n");
    }
    if (position + per_row(f) >= block->n_panels) { /* the lowest of its column */
        mhi_text_add(script, "set xlabel '%s' offset 0,0.6\nset format x\n",
                     f->abscissa != NULL ? f->abscissa : "time (s)");
    } else {
        mhi_text_add(script, "unset xlabel\nset format x ''\n");
    }
    if (block->logarithmic) {
        add_decades(script, values);
    } else {
        add_axis(script, values, block->least);
    }
    for (int32_t i = 0; i < panel->n_series; i++) {
        const int dots = dotted(&panel->series[i]);
        mhi_text_add(script, "%s $line%d_%d using 1:2 with %s ls %d%s", i == 0 ? "plot" : ",",
                     number, i, dots ? "linespoints" : "lines", panel->series[i].style,
                     dots ? " pt 7 ps 0.5" : "");
    }
    mhi_text_add(script, "\nunset label\nunset arrow\n");
}

static void add_legends(const figure *f, int32_t height, mhi_text *script) {
    int32_t x = WIDTH - RIGHT;
    for (int32_t i = 0; i < f->n_legend; i++) {
        add_legend(script, x, height, f->legend[i].text, f->legend[i].style);
        x -= 78 + 8 * (int32_t)strlen(f->legend[i].text);
    }
}

/* Gives n panels what all of them hold. */
static void share_range(range *y, int32_t n) {
    range all = {INFINITY, -INFINITY};
    for (int32_t i = 0; i < n; i++) {
        all = (range){fmin(all.lower, y[i].lower), fmax(all.upper, y[i].upper)};
    }
    for (int32_t i = 0; i < n; i++) {
        y[i] = all;
    }
}

void figure_script(const figure *f, mhi_text *script) {
    mhi_c_locale locale = mhi_c_locale_begin();
    range y[FIGURE_PANELS_MAX];
    place at[FIGURE_BLOCKS_MAX] = {{0, TOP}};
    int32_t height = TOP, n_panels = 0;
    for (int32_t b = 0; b < f->n_blocks; b++) {
        at[b] = (place){n_panels, height};
        height += block_height(f, f->blocks[b].n_panels);
        n_panels += f->blocks[b].n_panels;
    }
    add_look(script, f, height);
    for (int32_t b = 0; b < f->n_blocks; b++) {
        const figure_block *block = &f->blocks[b];
        for (int32_t i = at[b].first; i < at[b].first + block->n_panels; i++) {
            y[i] = block->holds_zero ? (range){0, 0} : (range){INFINITY, -INFINITY};
            for (int32_t k = 0; k < f->panels[i].n_series; k++) {
                add_data(script, f, i, k, &y[i]);
            }
        }
        if (block->logarithmic) {
            share_range(y + at[b].first, block->n_panels);
        }
    }
    for (int32_t b = 0; b < f->n_blocks; b++) { /* before the first panel takes its labels away */
        if (f->blocks[b].n_panels > 0) {
            add_heading(script, at[b].top, height, f->blocks[b].heading);
        }
    }
    add_legends(f, height, script);
    for (int32_t b = 0; b < f->n_blocks; b++) {
        const figure_block *block = &f->blocks[b];
        for (int32_t i = at[b].first; i < at[b].first + block->n_panels; i++) {
            add_panel(f, block, at[b], i, height, y[i], script);
        }
    }
    mhi_text_add(script, "unset multiplot\n");
    mhi_c_locale_end(locale);
}

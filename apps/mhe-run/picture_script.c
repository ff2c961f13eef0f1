/* SPDX-License-Identifier: Apache-2.0 */
/* Small multiples: joint angles above, muscle forces below, four a row, one legend, one look. */
#include "picture_script.h"

#include "io/number.h"

#include <math.h>
#include <string.h>

#define DEGREES (180 / 3.14159265358979323846)
#define PER_ROW 4
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
#define PANEL_X ((WIDTH - LEFT - RIGHT - (PER_ROW - 1) * GAP_X) / PER_ROW)

static int32_t rows_of(int32_t panels) {
    return (panels + PER_ROW - 1) / PER_ROW;
}

static int32_t block_height(int32_t panels) {
    int32_t rows = rows_of(panels);
    return rows == 0 ? 0 : BLOCK_TOP + rows * PANEL_Y + (rows - 1) * GAP_Y + BLOCK_END;
}

typedef struct range {
    double lower, upper;
} range;

/* One series as a data block; where one is longer than the eye can follow, evenly thinned. Widens
 * `y` to what it holds. */
static void add_data(mhi_text *script, const char *name, int32_t number, const mhi_table *t,
                     int32_t column, double scale, range time, range *y) {
    mhi_text_add(script, "$%s%d << END\n", name, number);
    int32_t step = t->n_rows / POINTS_MAX + 1;
    for (int32_t k = 0; k < t->n_rows; k += step) {
        double value = scale * t->values[(size_t)k * (size_t)t->n_columns + (size_t)column];
        if (t->time[k] < time.lower || t->time[k] > time.upper) {
            continue;
        }
        if (isfinite(value)) {
            mhi_text_add(script, "%.7g %.6g\n", t->time[k], value);
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

static void add_look(mhi_text *script, int32_t height, range time) {
    mhi_text_add(script,
                 "# Made by mhe-run. Change and run it again: gnuplot estimates.gp\n"
                 "set terminal svg size %d,%d enhanced font 'Helvetica,Arial,sans-serif,12' "
                 "background rgb 'white'\nset output 'estimates.svg'\n",
                 WIDTH, height);
    mhi_text_add(script, "set style line 1 lc rgb '#1b6ca8' lw 1.8\n"
                         "set style line 2 lc rgb '#d1495b' lw 1.8 dt (8,5)\n"
                         "set style line 3 lc rgb '#e3e3e3' lw 0.6\n"
                         "set border 3 lc rgb '#555555' lw 0.8\n"
                         "set tics out nomirror scale 0.5 font ',10' textcolor rgb '#444444'\n"
                         "set grid ls 3\nunset key\nset multiplot\n");
    mhi_text_add(script, "set xrange [%.9g:%.9g]\n", time.lower,
                 time.upper > time.lower ? time.upper : time.lower + 1);
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

/* Panels of one kind under their heading. */
typedef struct block {
    int32_t first, n, top;
} block;

static void add_panel(const picture *p, int32_t number, block at, int32_t height, range values,
                      mhi_text *script) {
    const picture_panel *panel = &p->panels[number];
    int32_t place = number - at.first, column = place % PER_ROW, row = place / PER_ROW;
    const int32_t left = LEFT + column * (PANEL_X + GAP_X);
    const double x = left, y = at.top + BLOCK_TOP + row * (PANEL_Y + GAP_Y);
    mhi_text_add(script, "set lmargin at screen %.5f\nset rmargin at screen %.5f\n", x / WIDTH,
                 (double)(left + PANEL_X) / WIDTH);
    mhi_text_add(script, "set tmargin at screen %.5f\nset bmargin at screen %.5f\n", 1 - y / height,
                 1 - (y + PANEL_Y) / height);
    mhi_text_add(script, "set title ");
    add_quoted(script, panel->name);
    mhi_text_add(script, " noenhanced offset 0,-0.6 font ',12'\n");
    if (column == 0) {
        mhi_text_add(script, "set label '%s' at", panel->of_forces ? "force (N)" : "angle (°)");
        add_point(script, 16, y + PANEL_Y / 2.0, height);
        mhi_text_add(script, " center rotate\n");
    }
    int32_t is_lowest = place + PER_ROW >= at.n;
    mhi_text_add(script, is_lowest ? "set xlabel 'time (s)' offset 0,0.6\nset format x\n"
                                   : "unset xlabel\nset format x ''\n");
    add_axis(script, values, panel->of_forces ? 1 : 0.1);
    mhi_text_add(script, "plot $estimate%d using 1:2 with lines ls 1", number);
    if (panel->reference_column >= 0) {
        mhi_text_add(script, ", $truth%d using 1:2 with lines ls 2", number);
    }
    mhi_text_add(script, "\nunset label\nunset arrow\n");
}

void picture_script(const picture *p, mhi_text *script) {
    mhi_c_locale locale = mhi_c_locale_begin();
    range time = {p->estimates->time[0], p->estimates->time[p->estimates->n_rows - 1]};
    range y[PICTURE_PANELS_MAX];
    block angles = {0, p->n_angles, TOP};
    block forces = {p->n_angles, p->n_panels - p->n_angles, TOP + block_height(p->n_angles)};
    int32_t height = forces.top + block_height(forces.n);
    add_look(script, height, time);
    for (int32_t i = 0; i < p->n_panels; i++) {
        const picture_panel *panel = &p->panels[i];
        y[i] = panel->of_forces ? (range){0, 0} : (range){INFINITY, -INFINITY};
        add_data(script, "estimate", i, panel->of_forces ? p->forces : p->estimates, panel->column,
                 panel->of_forces ? 1 : DEGREES, time, &y[i]);
        if (panel->reference_column >= 0) {
            add_data(script, "truth", i, p->reference, panel->reference_column,
                     panel->reference_scale, time, &y[i]);
        }
    }
    char heading[96] = "Muscle forces";
    if (forces.n < p->forces->n_labels) {
        (void)snprintf(heading, sizeof heading, "Muscle forces: the %d strongest of %d", forces.n,
                       p->forces->n_labels);
    }
    add_heading(script, forces.top, height, heading);
    if (angles.n > 0) {
        add_heading(script, angles.top, height, "Joint angles");
    }
    if (p->reference != NULL) {
        add_legend(script, WIDTH - RIGHT, height, "true", 2);
    }
    add_legend(script, WIDTH - RIGHT - 110, height, "estimated", 1);
    for (int32_t i = 0; i < p->n_panels; i++) {
        add_panel(p, i, i < angles.n ? angles : forces, height, y[i], script);
    }
    mhi_text_add(script, "unset multiplot\n");
    mhi_c_locale_end(locale);
}

/* SPDX-License-Identifier: Apache-2.0 */
#include "reference_picture.h"

#include "base/pi.h"
#include "figure.h"
#include "io/table.h"

#include <math.h>
#include <string.h>

#define DEGREES (180 / MHI_PI)
#define MOTIONS_MAX 4 /* as many shades as a figure has */
#define ANGLES_MAX 12
#define MUSCLES_MAX 8

_Static_assert(ANGLES_MAX + MUSCLES_MAX <= FIGURE_PANELS_MAX, "all panels fit the figure");

typedef struct motions {
    int32_t n, n_q, n_m;
    mhi_table *table[MOTIONS_MAX];
    figure figure;
} motions;

/* The first column whose label begins so; past the last where there is none. */
static int32_t first_of(const mhi_table *t, const char *prefix) {
    int32_t i = 0;
    while (i < t->n_columns && strncmp(t->labels[i], prefix, strlen(prefix)) != 0) {
        i++;
    }
    return i;
}

static mhe_status read_all(motions *m, const char *dir, const char *const *outputs,
                           mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < m->n && status == MHE_OK; i++) {
        mhi_text path = {0};
        mhi_text_add(&path, "%s/%s/reference.sto", dir, outputs[i]);
        status = path.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                             : mhi_sto_read(path.data, &m->table[i], err);
        if (status == MHE_OK && (m->table[i]->n_columns != m->table[0]->n_columns ||
                                 first_of(m->table[i], "q_") + m->n_q > m->table[i]->n_columns ||
                                 first_of(m->table[i], "e_") + m->n_m > m->table[i]->n_columns)) {
            status = mhe_fail(err, MHE_E_INPUT, "%s: not the columns of these motions", path.data);
        }
        mhi_text_free(&path);
    }
    return status;
}

static int32_t style(const motions *m, int32_t motion) {
    return m->n == 1 ? FIGURE_MADE : FIGURE_SHADES + motion;
}

/* One column of all motions; `prefix` letters of its label are the quantity. */
static void add_panel(motions *m, figure_block *block, int32_t column, int32_t prefix,
                      double scale) {
    figure_panel *panel = &m->figure.panels[m->figure.n_panels++];
    block->n_panels++;
    panel->name = m->table[0]->labels[column] + prefix;
    for (int32_t i = 0; i < m->n; i++) {
        const mhi_table *t = m->table[i];
        panel->series[panel->n_series++] = (figure_series){.time = t->time,
                                                           .values = t->values + column,
                                                           .n = t->n_rows,
                                                           .stride = t->n_columns,
                                                           .scale = scale,
                                                           .style = style(m, i)};
    }
}

static double peak(const motions *m, int32_t column) {
    double most = 0;
    for (int32_t i = 0; i < m->n; i++) {
        const mhi_table *t = m->table[i];
        for (int32_t k = 0; k < t->n_rows; k++) {
            most = fmax(most, t->values[(ptrdiff_t)k * t->n_columns + column]);
        }
    }
    return most;
}

static void add_muscles(motions *m, figure_block *block) {
    const int32_t first = first_of(m->table[0], "e_");
    *block = (figure_block){
        .heading = "Excitations", .axis = "excitation (1)", .least = 0.01, .holds_zero = 1};
    for (int32_t i = 0; i < m->n_m; i++) {
        const double own = peak(m, first + i);
        int32_t stronger = 0;
        for (int32_t j = 0; j < m->n_m; j++) {
            const double other = peak(m, first + j);
            stronger += other > own || (other == own && j < i);
        }
        if (stronger < MUSCLES_MAX) {
            add_panel(m, block, first + i, 2, 1);
        }
    }
    if (block->n_panels < m->n_m) {
        (void)snprintf(block->heading, sizeof block->heading, "Excitations: the %d highest of %d",
                       (int)block->n_panels, (int)m->n_m);
    }
}

static void compose(motions *m, const char *const *outputs) {
    figure *f = &m->figure;
    *f = (figure){.program = "mhe-sim", .name = "motion", .n_blocks = 2, .n_legend = m->n};
    for (int32_t i = 0; i < m->n; i++) {
        f->end = fmax(f->end, m->table[i]->time[m->table[i]->n_rows - 1]);
        f->legend[i].text = outputs[i];
        f->legend[i].style = style(m, i);
    }
    f->blocks[0] = (figure_block){.heading = "Joint angles", .axis = "angle (°)", .least = 0.1};
    for (int32_t i = 0; i < m->n_q && i < ANGLES_MAX; i++) {
        add_panel(m, &f->blocks[0], i, 2, DEGREES);
    }
    add_muscles(m, &f->blocks[1]);
}

mhe_status reference_picture(const char *dir, const char *const *outputs, int32_t n, int32_t n_q,
                             int32_t n_m, mhe_error *err) {
    motions m = {.n = n < MOTIONS_MAX ? n : MOTIONS_MAX, .n_q = n_q, .n_m = n_m};
    mhe_status status = read_all(&m, dir, outputs, err);
    if (status == MHE_OK) {
        compose(&m, outputs);
        status = figure_draw(&m.figure, dir, err);
    }
    for (int32_t i = 0; i < m.n; i++) {
        mhi_table_free(m.table[i]);
    }
    return status;
}

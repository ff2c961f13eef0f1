/* SPDX-License-Identifier: Apache-2.0 */
/* picture.c: what of a run is shown. */
#include "picture.h"

#include "base/pi.h"
#include "figure.h"
#include "rows.h"

#include <string.h>

#define ANGLES_MAX 12
#define FORCES_MAX 8

typedef struct picture {
    const rows *estimates, *forces;
    const rows *reference; /* or NULL */
    figure figure;
} picture;

static void add_series(figure_panel *panel, const rows *t, int32_t column, double scale,
                       int32_t style) {
    panel->series[panel->n_series++] = (figure_series){.time = t->is.time,
                                                       .values = t->is.values + column,
                                                       .n = t->is.n_rows,
                                                       .stride = t->is.n_columns,
                                                       .scale = scale,
                                                       .style = style};
}

static figure_panel *add_panel(picture *p, figure_block *block, const char *name) {
    block->n_panels++;
    figure_panel *panel = &p->figure.panels[p->figure.n_panels++];
    panel->name = name;
    return panel;
}

/* The coordinates: columns q_<name> of the estimates, as many as there is room for. */
static void choose_angles(picture *p, figure_block *block) {
    const rows *t = p->estimates;
    *block = (figure_block){.heading = "Joint angles", .axis = "angle (°)", .least = 0.1};
    for (int32_t i = 0; i < t->is.n_labels && block->n_panels < ANGLES_MAX; i++) {
        if (strncmp(t->is.labels[i], "q_", 2) != 0) {
            continue;
        }
        figure_panel *panel = add_panel(p, block, t->is.labels[i] + 2);
        add_series(panel, t, i, MHI_DEGREES, FIGURE_MADE);
        if (p->reference != NULL) {
            char numbered[16];
            (void)snprintf(numbered, sizeof numbered, "q%d", block->n_panels - 1);
            int32_t column = mhe_table_find(p->reference->table, t->is.labels[i]);
            column = column >= 0 ? column : mhe_table_find(p->reference->table, numbered);
            if (column >= 0) {
                add_series(panel, p->reference, column,
                           p->reference->is.in_degrees ? 1 : MHI_DEGREES, FIGURE_TRUE);
            }
        }
    }
}

static double largest(const rows *t, int32_t column) {
    double most = 0;
    for (int32_t k = 0; k < t->is.n_rows; k++) {
        double value = t->is.values[(size_t)k * (size_t)t->is.n_columns + (size_t)column];
        most = value > most ? value : most;
    }
    return most;
}

/* The muscles with the largest forces, in the order of the model. */
static void choose_forces(picture *p, figure_block *block) {
    const rows *t = p->forces;
    *block = (figure_block){
        .heading = "Muscle forces", .axis = "force (N)", .least = 1, .holds_zero = 1};
    for (int32_t i = 0; i < t->is.n_labels; i++) {
        int32_t stronger = 0;
        double force = largest(t, i);
        for (int32_t j = 0; j < t->is.n_labels; j++) {
            double other = largest(t, j);
            stronger += other > force || (other == force && j < i);
        }
        if (stronger >= FORCES_MAX) {
            continue;
        }
        figure_panel *panel = add_panel(p, block, t->is.labels[i]);
        add_series(panel, t, i, 1, FIGURE_MADE);
        if (p->reference != NULL) {
            char label[256];
            (void)snprintf(label, sizeof label, "F_%s", t->is.labels[i]);
            int32_t column = mhe_table_find(p->reference->table, label);
            if (column >= 0) {
                add_series(panel, p->reference, column, 1, FIGURE_TRUE);
            }
        }
    }
    if (block->n_panels < t->is.n_labels) {
        (void)snprintf(block->heading, sizeof block->heading,
                       "Muscle forces: the %d strongest of %d", block->n_panels, t->is.n_labels);
    }
}

static void compose(picture *p) {
    figure *f = &p->figure;
    *f = (figure){.program = "mhe-run",
                  .name = "estimates",
                  .begin = p->estimates->is.time[0],
                  .end = p->estimates->is.time[p->estimates->is.n_rows - 1],
                  .n_blocks = 2};
    choose_angles(p, &f->blocks[0]);
    choose_forces(p, &f->blocks[1]);
    if (p->reference != NULL) {
        f->legend[f->n_legend].text = "true";
        f->legend[f->n_legend++].style = FIGURE_TRUE;
    }
    f->legend[f->n_legend].text = "estimated";
    f->legend[f->n_legend++].style = FIGURE_MADE;
}

mhe_status picture_estimates(const char *dir, const char *reference, mhe_error *err) {
    rows estimates = {0}, forces = {0}, truth = {0};
    mhe_status status = rows_read_in(dir, "estimates.sto", &estimates, err);
    if (status == MHE_OK) {
        status = rows_read_in(dir, "forces.sto", &forces, err);
    }
    if (status == MHE_OK && reference != NULL) {
        status = rows_read(reference, &truth, err);
    }
    if (status == MHE_OK) {
        picture p = {.estimates = &estimates,
                     .forces = &forces,
                     .reference = reference != NULL ? &truth : NULL};
        compose(&p);
        status = figure_draw(&p.figure, dir, err);
    }
    rows_close(&estimates);
    rows_close(&forces);
    rows_close(&truth);
    return status;
}

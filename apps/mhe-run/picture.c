/* SPDX-License-Identifier: Apache-2.0 */
/* picture.c: what of a run is shown. */
#include "picture.h"

#include "figure.h"
#include "io/table.h"

#include <string.h>

#define DEGREES (180 / 3.14159265358979323846)
#define ANGLES_MAX 12
#define FORCES_MAX 8

typedef struct picture {
    const mhi_table *estimates, *forces;
    const mhi_table *reference; /* or NULL */
    figure figure;
} picture;

static void add_series(figure_panel *panel, const mhi_table *t, int32_t column, double scale,
                       int32_t style) {
    panel->series[panel->n_series++] = (figure_series){.time = t->time,
                                                       .values = t->values + column,
                                                       .n = t->n_rows,
                                                       .stride = t->n_columns,
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
    const mhi_table *t = p->estimates;
    *block = (figure_block){.heading = "Joint angles", .axis = "angle (°)", .least = 0.1};
    for (int32_t i = 0; i < t->n_labels && block->n_panels < ANGLES_MAX; i++) {
        if (strncmp(t->labels[i], "q_", 2) != 0) {
            continue;
        }
        figure_panel *panel = add_panel(p, block, t->labels[i] + 2);
        add_series(panel, t, i, DEGREES, FIGURE_MADE);
        if (p->reference != NULL) {
            char numbered[16];
            (void)snprintf(numbered, sizeof numbered, "q%d", block->n_panels - 1);
            int32_t column = mhi_table_find(p->reference, t->labels[i]);
            column = column >= 0 ? column : mhi_table_find(p->reference, numbered);
            if (column >= 0) {
                add_series(panel, p->reference, column, p->reference->in_degrees ? 1 : DEGREES,
                           FIGURE_TRUE);
            }
        }
    }
}

static double largest(const mhi_table *t, int32_t column) {
    double most = 0;
    for (int32_t k = 0; k < t->n_rows; k++) {
        double value = t->values[(size_t)k * (size_t)t->n_columns + (size_t)column];
        most = value > most ? value : most;
    }
    return most;
}

/* The muscles with the largest forces, in the order of the model. */
static void choose_forces(picture *p, figure_block *block) {
    const mhi_table *t = p->forces;
    *block = (figure_block){
        .heading = "Muscle forces", .axis = "force (N)", .least = 1, .holds_zero = 1};
    for (int32_t i = 0; i < t->n_labels; i++) {
        int32_t stronger = 0;
        double force = largest(t, i);
        for (int32_t j = 0; j < t->n_labels; j++) {
            double other = largest(t, j);
            stronger += other > force || (other == force && j < i);
        }
        if (stronger >= FORCES_MAX) {
            continue;
        }
        figure_panel *panel = add_panel(p, block, t->labels[i]);
        add_series(panel, t, i, 1, FIGURE_MADE);
        if (p->reference != NULL) {
            char label[256];
            (void)snprintf(label, sizeof label, "F_%s", t->labels[i]);
            int32_t column = mhi_table_find(p->reference, label);
            if (column >= 0) {
                add_series(panel, p->reference, column, 1, FIGURE_TRUE);
            }
        }
    }
    if (block->n_panels < t->n_labels) {
        (void)snprintf(block->heading, sizeof block->heading,
                       "Muscle forces: the %d strongest of %d", block->n_panels, t->n_labels);
    }
}

static void compose(picture *p) {
    figure *f = &p->figure;
    *f = (figure){.program = "mhe-run",
                  .name = "estimates",
                  .begin = p->estimates->time[0],
                  .end = p->estimates->time[p->estimates->n_rows - 1],
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

static mhe_status read_in(const char *dir, const char *name, mhi_table **table, mhe_error *err) {
    char path[4096];
    int n = snprintf(path, sizeof path, "%s/%s", dir, name);
    if (n < 0 || (size_t)n >= sizeof path) {
        return mhe_fail(err, MHE_E_ARGUMENT, "%s: the path is too long", dir);
    }
    return mhi_sto_read(path, table, err);
}

mhe_status picture_estimates(const char *dir, const char *reference, mhe_error *err) {
    mhi_table *estimates = NULL, *forces = NULL, *truth = NULL;
    mhe_status status = read_in(dir, "estimates.sto", &estimates, err);
    if (status == MHE_OK) {
        status = read_in(dir, "forces.sto", &forces, err);
    }
    if (status == MHE_OK && reference != NULL) {
        status = mhi_sto_read(reference, &truth, err);
    }
    if (status == MHE_OK) {
        picture p = {.estimates = estimates, .forces = forces, .reference = truth};
        compose(&p);
        status = figure_draw(&p.figure, dir, err);
    }
    mhi_table_free(estimates);
    mhi_table_free(forces);
    mhi_table_free(truth);
    return status;
}

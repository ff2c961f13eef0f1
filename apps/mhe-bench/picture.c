/* SPDX-License-Identifier: Apache-2.0 */
/* picture.c: how many estimates per second each window leaves, as Figure 3 of Bailly et al. (2021)
 * (doi:10.3389/fbioe.2021.642742), one panel for each group of variants. */
#include "picture.h"

#include "figure.h"

#include <stdlib.h>

#define BIOFEEDBACK                                                               \
    13.3 /* Hz: one image in 75 ms, the delay that biofeedback bears (same paper) \
          */
#define PER_ROW 4

typedef struct line {
    double window[VARIANTS_MAX], rate[VARIANTS_MAX];
    int32_t n;
} line;

static void insert(line *l, double window, double rate) {
    int32_t i = l->n++;
    for (; i > 0 && l->window[i - 1] > window; i--) {
        l->window[i] = l->window[i - 1];
        l->rate[i] = l->rate[i - 1];
    }
    l->window[i] = window;
    l->rate[i] = rate;
}

typedef struct picture {
    figure figure;
    line lines[FIGURE_PANELS_MAX];
    double ends[2], biofeedback[2];
} picture;

static figure_series series(const double *x, const double *y, int32_t n, int32_t style) {
    return (figure_series){.time = x, .values = y, .n = n, .stride = 1, .scale = 1, .style = style};
}

static void compose(picture *p, const bench *b) {
    const variants *v = b->setup->variants;
    figure *f = &p->figure;
    f->program = "mhe-bench";
    f->name = "rate";
    f->abscissa = "window (intervals)";
    f->n_blocks = 1;
    f->n_panels = v->n_groups < FIGURE_PANELS_MAX ? v->n_groups : FIGURE_PANELS_MAX;
    f->per_row = f->n_panels < PER_ROW ? f->n_panels : PER_ROW;
    f->blocks[0] = (figure_block){.heading = "Estimates per second",
                                  .axis = "rate (Hz)",
                                  .logarithmic = 1,
                                  .n_panels = f->n_panels};
    f->begin = f->end = b->runs[0].rig.info.window;
    for (int32_t i = 0; i < v->n; i++) {
        const double window = b->runs[i].rig.info.window;
        f->begin = window < f->begin ? window : f->begin;
        f->end = window > f->end ? window : f->end;
        if (v->list[i].group < f->n_panels) {
            insert(&p->lines[v->list[i].group], window, b->runs[i].rate);
            f->panels[v->list[i].group].name = v->list[i].group_name;
        }
    }
    f->begin -= 1;
    f->end += 1;
    p->ends[0] = f->begin;
    p->ends[1] = f->end;
    p->biofeedback[0] = p->biofeedback[1] = BIOFEEDBACK;
    for (int32_t g = 0; g < f->n_panels; g++) {
        figure_panel *panel = &f->panels[g];
        const line *l = &p->lines[g];
        panel->series[panel->n_series++] = series(p->ends, p->biofeedback, 2, FIGURE_TRUE);
        panel->series[panel->n_series++] = series(l->window, l->rate, l->n, FIGURE_MADE);
    }
    f->legend[0].text = "biofeedback, 13.3 Hz";
    f->legend[0].style = FIGURE_TRUE;
    f->legend[1].text = "median run";
    f->legend[1].style = FIGURE_MADE;
    f->n_legend = 2;
}

mhe_status picture_rate(const bench *b, const char *dir, mhe_error *err) {
    picture *p = calloc(1, sizeof *p);
    if (p == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    compose(p, b);
    mhe_status status = figure_draw(&p->figure, dir, err);
    free(p);
    return status;
}

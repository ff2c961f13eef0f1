/* SPDX-License-Identifier: Apache-2.0 */
/* noise_picture.c: an example of the noise, after figure 2 of Bailly et al. 2021. */
#include "figure.h"
#include "noise.h"

#define MUSCLES_MAX 8
#define LEVELS_MAX MHI_NOISE_LEVELS_MAX

_Static_assert(LEVELS_MAX < FIGURE_SERIES_MAX, "the levels and the truth fit one panel");

typedef struct example {
    const mhi_recording *reference;
    const mhe_description *model;
    int32_t n_levels;
    double level[LEVELS_MAX];
    mhi_record emg[LEVELS_MAX];
    char legend[LEVELS_MAX][32];
    figure figure;
} example;

/* The levels asked for, or the recording's own. */
static mhe_status choose_levels(const mhi_noise_config *config, example *e, mhe_error *err) {
    const mhe_real_list *asked = &config->output.levels;
    e->n_levels = asked->n > 0 ? asked->n : 1;
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < e->n_levels && status == MHE_OK; i++) {
        mhi_noise noise = config->noise;
        noise.emg.level = asked->n > 0 ? asked->values[i] : noise.emg.level;
        e->level[i] = noise.emg.level;
        status = mhi_noise_emg(&noise, e->reference, e->model, &e->emg[i], err);
    }
    return status;
}

static double largest(const example *e, int32_t muscle) {
    double most = 0;
    for (int32_t k = 0; k < e->reference->n_frames; k++) {
        const double value =
            e->reference->reference.excitation[(ptrdiff_t)k * e->model->n_muscles + muscle];
        most = value > most ? value : most;
    }
    return most;
}

static void add_panel(example *e, int32_t muscle) {
    const mhi_recording *r = e->reference;
    figure *f = &e->figure;
    figure_panel *panel = &f->panels[f->n_panels++];
    f->blocks[0].n_panels++;
    panel->name = e->model->muscles[muscle].name;
    for (int32_t i = e->n_levels - 1; i >= 0; i--) { /* the truth lies on top */
        const mhi_record *emg = &e->emg[i];
        panel->series[panel->n_series++] = (figure_series){.time = emg->time,
                                                           .values = emg->values + muscle,
                                                           .n = emg->n_samples,
                                                           .stride = emg->n_channels,
                                                           .scale = 1,
                                                           .style = f->legend[1 + i].style};
    }
    panel->series[panel->n_series++] = (figure_series){.time = r->time,
                                                       .values = r->reference.excitation + muscle,
                                                       .n = r->n_frames,
                                                       .stride = e->model->n_muscles,
                                                       .scale = 1,
                                                       .style = FIGURE_TRUE};
}

/* The muscles with the largest excitations, in the order of the model. */
static void add_panels(example *e) {
    const int32_t n = e->model->n_muscles;
    for (int32_t i = 0; i < n; i++) {
        int32_t stronger = 0;
        const double own = largest(e, i);
        for (int32_t j = 0; j < n; j++) {
            const double other = largest(e, j);
            stronger += other > own || (other == own && j < i);
        }
        if (stronger < MUSCLES_MAX) {
            add_panel(e, i);
        }
    }
}

static void compose(example *e) {
    figure *f = &e->figure;
    *f = (figure){.program = "mhe-sim",
                  .name = "noise",
                  .begin = e->reference->time[0],
                  .end = e->reference->time[e->reference->n_frames - 1],
                  .n_blocks = 1,
                  .n_legend = 1 + e->n_levels};
    f->blocks[0] =
        (figure_block){.heading = "EMG", .axis = "excitation (1)", .least = 0.01, .holds_zero = 1};
    f->legend[0].text = "true";
    f->legend[0].style = FIGURE_TRUE;
    for (int32_t i = 0; i < e->n_levels; i++) {
        (void)snprintf(e->legend[i], sizeof e->legend[i], "noise level %g", e->level[i]);
        f->legend[1 + i].text = e->legend[i];
        f->legend[1 + i].style = e->n_levels == 1 ? FIGURE_MADE : FIGURE_SHADES + i;
    }
    add_panels(e);
    if (f->n_panels < e->model->n_muscles) {
        (void)snprintf(f->blocks[0].heading, sizeof f->blocks[0].heading,
                       "EMG: the %d strongest of %d", f->n_panels, e->model->n_muscles);
    }
}

mhe_status noise_picture(const mhi_noise_config *config, const mhi_recording *reference,
                         const mhe_description *model, const char *out, mhe_error *err) {
    example e = {.reference = reference, .model = model};
    mhe_status status = choose_levels(config, &e, err);
    if (status == MHE_OK) {
        compose(&e);
        status = figure_draw(&e.figure, out, err);
    }
    for (int32_t i = 0; i < LEVELS_MAX; i++) {
        mhi_record_free(&e.emg[i]);
    }
    return status;
}

/* SPDX-License-Identifier: Apache-2.0 */
#include "live/figure.h"
#include "library/config.h"

#include <math.h>
#include <mhe/figure.h>
#include <stdlib.h>
#include <string.h>

struct mhe_figure {
    mhi_arena arena;
    mhi_figure figure;
    mhi_figure_view view;
    const char **coordinates;
    int32_t up;
};

static mhe_status open_all(mhe_figure *f, mhe_config *config, mhe_error *err) {
    const mhe_description *model = NULL;
    mhe_status status = mhi_config_model(config, &model, err);
    if (status == MHE_OK) {
        status = mhi_figure_open(config->host, config->run, model, &f->arena, &f->figure, err);
    }
    if (status == MHE_OK) {
        status = mhi_figure_view_open(&f->figure, &f->arena, &f->view, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    f->up = 1;
    for (int32_t i = 0; i < 3; i++) {
        f->up = fabs(model->gravity[i]) > fabs(model->gravity[f->up]) ? i : f->up;
    }
    f->coordinates = MHI_TAKE(&f->arena, const char *, model->n_coordinates + 1);
    if (f->coordinates == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < model->n_coordinates; i++) {
        f->coordinates[i] = model->coordinates[i].name;
    }
    return MHE_OK;
}

mhe_status mhe_figure_open(mhe_config *config, mhe_figure **figure, mhe_error *err) {
    if (config == NULL || figure == NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT, "a figure needs a config and a place");
    }
    *figure = NULL;
    mhe_figure *f = calloc(1, sizeof *f);
    if (f == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    const mhe_status status = open_all(f, config, err);
    if (status != MHE_OK) {
        mhe_figure_close(f);
        return status;
    }
    *figure = f;
    return MHE_OK;
}

void mhe_figure_close(mhe_figure *f) {
    if (f != NULL) {
        mhi_figure_view_close(&f->view);
        mhi_figure_close(&f->figure);
        mhi_arena_free(&f->arena);
        free(f);
    }
}

mhe_status mhe_figure_describe(const mhe_figure *f, mhe_figure_info *info, mhe_error *err) {
    if (f == NULL || info == NULL || info->size < sizeof info->size) {
        return mhe_fail(err, MHE_E_ARGUMENT, "a description needs a figure and a place");
    }
    const mhi_figure *is = &f->figure;
    const mhe_figure_info all = {.size = info->size,
                                 .n_coordinates = is->description->n_coordinates,
                                 .coordinates = f->coordinates,
                                 .n_bones = 6 * is->n_bones,
                                 .bones = is->bone_labels,
                                 .n_paths = 3 * MHI_FIGURE_POINTS * is->n_paths,
                                 .paths = is->path_labels,
                                 .up = f->up};
    memcpy(info, &all, info->size < sizeof all ? info->size : sizeof all);
    return MHE_OK;
}

mhe_status mhe_figure_draw(mhe_figure *f, const double *q, double *bones, double *paths,
                           mhe_error *err) {
    if (f == NULL || q == NULL || bones == NULL || paths == NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT, "a figure is drawn of a posture into two places");
    }
    mhi_figure_draw(&f->view, q, bones, paths);
    return MHE_OK;
}

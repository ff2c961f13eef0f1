/* SPDX-License-Identifier: Apache-2.0 */
/* figure.h: what a page draws of the model: bones and the paths of muscles, at a posture. */
#ifndef MHI_LIVE_FIGURE_H
#define MHI_LIVE_FIGURE_H

#include "base/arena.h"
#include "config/run.h"

#include <mhe/description.h>
#include <mhe/model.h>

#define MHI_FIGURE_POINTS 8 /* of a path at most; longer ones are thinned */

typedef struct mhi_figure {
    const mhe_description *description;
    const mhe_model_ops *ops;
    void *self;
    /* Bones: [6 n_bones] numbers, from a body's origin to that of the one that carries it. */
    int32_t n_bones;
    const char **bone_labels; /* [6 n_bones] "humerus.x" .. twice */
    /* Paths: [3 x MHI_FIGURE_POINTS x muscles] numbers, NaN behind a path's last point. */
    int32_t n_paths;
    const char **path_labels; /* [3 x MHI_FIGURE_POINTS x n_paths] "BRA.x" .. */
} mhi_figure;

/* One thread's memory. */
typedef struct mhi_figure_view {
    const mhi_figure *figure;
    void *context;
    double *body, *zero, *points;
} mhi_figure_view;

/* The model of the run once more, for drawing. Strings are of the arena. What the model plugin
 * cannot say leaves the counts 0. [cold] */
mhe_status mhi_figure_open(const mhe_host *host, const mhi_run *run,
                           const mhe_description *description, mhi_arena *arena, mhi_figure *figure,
                           mhe_error *err);
void mhi_figure_close(mhi_figure *figure);
mhe_status mhi_figure_view_open(const mhi_figure *figure, mhi_arena *arena, mhi_figure_view *view,
                                mhe_error *err);
void mhi_figure_view_close(mhi_figure_view *view);

/* bones [6 n_bones] and paths [3 x MHI_FIGURE_POINTS x n_paths] at q, m in ground; NaN where the
 * posture is none. [hot] */
void mhi_figure_draw(mhi_figure_view *view, const double *q, double *bones, double *paths);

#endif

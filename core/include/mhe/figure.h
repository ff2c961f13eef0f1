/* SPDX-License-Identifier: Apache-2.0 */
/* figure.h: what a picture of a posture is made of: bones and the paths of muscles.
 *
 *     mhe_figure_open(config, &figure, &err);
 *     mhe_figure_describe(figure, &info, &err);
 *     mhe_figure_draw(figure, q, bones, paths, &err);    // as often as wished
 *     mhe_figure_close(figure);
 *
 * Threads: a figure belongs to one thread at a time. */
#ifndef MHE_FIGURE_H
#define MHE_FIGURE_H

#include <mhe/config.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct mhe_figure mhe_figure;

/* Names live as long as the figure. */
typedef struct mhe_figure_info {
    uint32_t size;
    int32_t n_coordinates;
    const char *const *coordinates; /* [n_coordinates], the order of q */
    int32_t n_bones;                /* numbers of `bones`: two points each, from a body's origin to
                                     * that of the body that carries it */
    const char *const *bones;       /* [n_bones] "humerus.x", "humerus.y", ... */
    int32_t n_paths;                /* numbers of `paths`: as many points a muscle */
    const char *const *paths;       /* [n_paths] "BRA.x", "BRA.y", ... */
    int32_t up;                     /* the vertical axis of ground, 0..2 */
} mhe_figure_info;

/* Of the model that the config names. The config must outlive it. A model plugin that cannot say
 * where paths run makes a figure of nothing (both counts 0). MHE_E_INPUT, MHE_E_CONFIG: the model.
 * [cold] */
MHE_API mhe_status mhe_figure_open(mhe_config *config, mhe_figure **figure, mhe_error *err);
MHE_API void mhe_figure_close(mhe_figure *figure); /* NULL is fine. [cold] */
MHE_API mhe_status mhe_figure_describe(const mhe_figure *figure, mhe_figure_info *info,
                                       mhe_error *err);
/* The figure at q [n_coordinates] (rad, m), in ground, m: bones [n_bones], paths [n_paths]; NaN
 * behind a path's last point, and all NaN where the posture is none. [cold] */
MHE_API mhe_status mhe_figure_draw(mhe_figure *figure, const double *q, double *bones,
                                   double *paths, mhe_error *err);

#ifdef __cplusplus
}
#endif
#endif

/* SPDX-License-Identifier: Apache-2.0 */
#include "live/figure.h"

#include "plugin/instance.h"

#include <math.h>
#include <string.h>

#define MOST_POINTS 128 /* of a path, before it is thinned */

static mhe_status no_memory(mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

static mhe_status name_all(mhi_figure *f, mhi_arena *arena, mhe_error *err) {
    const mhe_description *d = f->description;
    const int32_t per_path = 3 * MHI_FIGURE_POINTS;
    f->bone_labels = MHI_TAKE(arena, const char *, 6 * d->n_bodies + 1);
    f->path_labels = MHI_TAKE(arena, const char *, per_path * d->n_muscles + 1);
    if (f->bone_labels == NULL || f->path_labels == NULL) {
        return no_memory(err);
    }
    for (int32_t i = 0; i < d->n_bodies; i++) {
        for (int32_t k = 0; k < 6 && d->bodies[i].parent >= 0; k++) {
            const char *label = mhi_arena_format(arena, "%s.%c", d->bodies[i].name, "xyz"[k % 3]);
            if (label == NULL) {
                return no_memory(err);
            }
            f->bone_labels[6 * f->n_bones + k] = label;
        }
        f->n_bones += d->bodies[i].parent >= 0;
    }
    for (int32_t i = 0; i < per_path * d->n_muscles; i++) {
        f->path_labels[i] =
            mhi_arena_format(arena, "%s.%c", d->muscles[i / per_path].name, "xyz"[i % 3]);
        if (f->path_labels[i] == NULL) {
            return no_memory(err);
        }
    }
    f->n_paths = d->n_muscles;
    return MHE_OK;
}

mhe_status mhi_figure_open(const mhe_host *host, const mhi_run *run,
                           const mhe_description *description, mhi_arena *arena, mhi_figure *f,
                           mhe_error *err) {
    *f = (mhi_figure){.description = description, .ops = run->model.plugin->ops};
    mhe_host *quiet = MHI_TAKE(arena, mhe_host, 1);
    if (quiet == NULL) {
        return no_memory(err);
    }
    *quiet = mhi_host_quiet(host); /* the estimator's model has told all */
    const mhe_status status =
        mhi_model_create(run->model.plugin, quiet, description, run->model.config, &f->self, err);
    if (status != MHE_OK) {
        return status;
    }
    return f->ops->path_points == NULL ? MHE_OK : name_all(f, arena, err);
}

void mhi_figure_close(mhi_figure *f) {
    if (f->self != NULL) {
        f->ops->destroy(f->self);
    }
    *f = (mhi_figure){0};
}

mhe_status mhi_figure_view_open(const mhi_figure *f, mhi_arena *arena, mhi_figure_view *v,
                                mhe_error *err) {
    *v = (mhi_figure_view){.figure = f};
    if (f->n_paths == 0) {
        return MHE_OK;
    }
    v->body = MHI_TAKE(arena, double, 12 * f->description->n_bodies + 1);
    v->zero = MHI_TAKE(arena, double, f->description->n_coordinates + 1);
    v->points = MHI_TAKE(arena, double, 3 * MOST_POINTS);
    return v->body == NULL || v->zero == NULL || v->points == NULL
               ? no_memory(err)
               : f->ops->context_create(f->self, &v->context, err);
}

void mhi_figure_view_close(mhi_figure_view *v) {
    if (v->context != NULL) {
        v->figure->ops->context_destroy(v->context);
    }
    *v = (mhi_figure_view){0};
}

/* At most MHI_FIGURE_POINTS of n points, its ends among them. */
static void thin(const double *points, int32_t n, double *out) {
    const int32_t kept = n < MHI_FIGURE_POINTS ? n : MHI_FIGURE_POINTS;
    for (int32_t k = 0; k < kept; k++) {
        const int32_t from = kept < 2 ? 0 : (k * (n - 1) + (kept - 1) / 2) / (kept - 1);
        memcpy(out + 3 * (ptrdiff_t)k, points + 3 * (ptrdiff_t)from, 3 * sizeof *out);
    }
}

void mhi_figure_draw(mhi_figure_view *v, const double *q, double *bones, double *paths) {
    const mhi_figure *f = v->figure;
    const mhe_kinematics wanted = {.size = sizeof wanted, .body = v->body};
    mhe_error err = {0};
    const int32_t n_numbers = 3 * MHI_FIGURE_POINTS * f->n_paths;
    for (int32_t i = 0; i < n_numbers; i++) {
        paths[i] = NAN;
    }
    for (int32_t i = 0; i < 6 * f->n_bones; i++) {
        bones[i] = NAN;
    }
    if (v->context == NULL || f->ops->kinematics(v->context, q, v->zero, &wanted, &err) != MHE_OK) {
        return;
    }
    for (int32_t i = 0, k = 0; i < f->description->n_bodies; i++) {
        const int32_t parent = f->description->bodies[i].parent;
        if (parent >= 0) {
            memcpy(bones + 6 * (ptrdiff_t)k, v->body + 12 * (ptrdiff_t)i, 3 * sizeof *bones);
            memcpy(bones + 6 * (ptrdiff_t)k++ + 3, v->body + 12 * (ptrdiff_t)parent,
                   3 * sizeof *bones);
        }
    }
    for (int32_t i = 0; i < f->n_paths; i++) {
        const int32_t n = f->ops->path_points(v->context, i, v->points, MOST_POINTS);
        thin(v->points, n < MOST_POINTS ? n : MOST_POINTS,
             paths + (ptrdiff_t)i * 3 * MHI_FIGURE_POINTS);
    }
}

/* SPDX-License-Identifier: Apache-2.0 */
/* sweep.c: where lengths of paths jump while one coordinate goes through its range. */
#include "inspect/info.h"
#include "inspect/inspected.h"

#include "base/need.h"
#include "base/number.h"
#include "base/pi.h"
#include "io/description_builder.h"

#include <mhe/inspect.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define JUMP 1e-3        /* m */
#define STEEPER 1.5      /* than the slopes at both ends of a step say */
#define HALVINGS 40      /* of a step, towards where it is steepest */
#define WIDEST_SHIFT 1.0 /* m; angles: half a turn to both sides */

typedef struct jump {
    int32_t path, coordinate, conditional;
    double at, size; /* m: with growing coordinate */
} jump;

typedef struct sweep {
    const mhi_skeleton *skeleton;
    const mhe_description *d;
    double *q, *before, *still;               /* [n_coordinates] */
    double *length, *last, *slope, *length_q; /* [n_paths]; the last with [x n_coordinates] */
    jump *jumps;
    int32_t n, room, n_free;
} sweep;

static mhe_status evaluate(sweep *s, const double *q, mhe_error *err) {
    mhe_kinematics out = {.size = sizeof out, .length = s->length, .length_q = s->length_q};
    return s->skeleton->ops->kinematics(s->skeleton->context, q, s->still, &out, err);
}

static double number_at(const mhe_description *d, const double *q, int32_t c) {
    if (c < d->n_coordinates) {
        return q[c];
    }
    const mhe_dependent *dependent = &d->dependents[c - d->n_coordinates];
    return mhi_function_value(&dependent->function, number_at(d, q, dependent->independent));
}

/* 1 where a conditional point of the path goes on or off between the poses. */
static int32_t goes_on_or_off(const mhe_description *d, int32_t path, const double *a,
                              const double *b) {
    for (int32_t k = 0; k < d->paths[path].n_points; k++) {
        const mhe_path_point *p = &d->paths[path].points[k];
        if (p->kind == MHE_POINT_CONDITIONAL) {
            const double x = number_at(d, a, p->coordinate[0]);
            const double y = number_at(d, b, p->coordinate[0]);
            if ((x >= p->lower && x <= p->upper) != (y >= p->lower && y <= p->upper)) {
                return 1;
            }
        }
    }
    return 0;
}

/* The largest jump of the path between coordinate c at `from` and at `to`, into *found. s->q is the
 * pose. */
static mhe_status find_jump(sweep *s, int32_t path, int32_t c, double from, double to, jump *found,
                            mhe_error *err) {
    double ends[2] = {from, to}, value[2] = {0};
    mhe_status status = MHE_OK;
    for (int32_t e = 0; e < 2 && status == MHE_OK; e++) {
        s->q[c] = ends[e];
        status = evaluate(s, s->q, err);
        value[e] = s->length[path];
    }
    for (int32_t k = 0; k < HALVINGS && status == MHE_OK; k++) {
        const double middle = 0.5 * (ends[0] + ends[1]);
        s->q[c] = middle;
        status = evaluate(s, s->q, err);
        /* the half in which more happens is kept */
        const int32_t e = fabs(s->length[path] - value[0]) > fabs(s->length[path] - value[1]);
        ends[e] = middle;
        value[e] = s->length[path];
    }
    s->q[c] = to;
    *found = (jump){.path = path, .coordinate = c, .at = ends[1], .size = value[1] - value[0]};
    return status;
}

static mhe_status keep(sweep *s, const jump *found, mhe_error *err) {
    if (s->n == s->room) {
        jump *more = realloc(s->jumps, sizeof *more * (size_t)(2 * s->room + 16));
        if (more == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
        s->jumps = more;
        s->room = 2 * s->room + 16;
    }
    s->jumps[s->n++] = *found;
    return MHE_OK;
}

/* What the step that ended at s->q, from s->before, changed. */
static mhe_status look_at_step(sweep *s, int32_t c, mhe_error *err) {
    const mhe_description *d = s->d;
    const double step = s->q[c] - s->before[c];
    mhe_status status = MHE_OK;
    for (int32_t p = 0; p < d->n_paths && status == MHE_OK; p++) {
        const double slope = fabs(s->length_q[p * d->n_coordinates + c]);
        const double change = fabs(s->length[p] - s->last[p]);
        if (change > JUMP && change > STEEPER * step * fmax(slope, fabs(s->slope[p]))) {
            jump found;
            const int32_t conditional = goes_on_or_off(d, p, s->before, s->q);
            status = find_jump(s, p, c, s->before[c], s->q[c], &found, err);
            found.conditional = conditional;
            if (status == MHE_OK && fabs(found.size) >= JUMP) {
                status = keep(s, &found, err);
            }
            status = status == MHE_OK ? evaluate(s, s->q, err) : status;
        }
    }
    return status;
}

static mhe_status sweep_coordinate(sweep *s, int32_t c, int32_t steps, mhe_error *err) {
    const mhe_description *d = s->d;
    const double widest = d->coordinates[c].rotational ? MHI_PI : WIDEST_SHIFT;
    const double lower = fmax(d->coordinates[c].lower, -widest);
    const double upper = fmin(d->coordinates[c].upper, widest);
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        s->q[i] = d->coordinates[i].value;
    }
    for (int32_t k = 0; k <= steps && upper > lower && status == MHE_OK; k++) {
        memcpy(s->before, s->q, sizeof *s->q * (size_t)d->n_coordinates);
        s->q[c] = lower + (upper - lower) * k / steps;
        status = evaluate(s, s->q, err);
        if (status == MHE_OK && k > 0) {
            status = look_at_step(s, c, err);
        }
        for (int32_t p = 0; p < d->n_paths; p++) {
            s->last[p] = s->length[p];
            s->slope[p] = s->length_q[p * d->n_coordinates + c];
        }
    }
    return status;
}

static double shown(const mhe_description *d, const jump *j) {
    return d->coordinates[j->coordinate].rotational ? j->at * 180 / MHI_PI : j->at;
}

static void add_text(const sweep *s, int32_t steps, mhi_text *out) {
    int32_t conditional = 0;
    for (int32_t i = 0; i < s->n; i++) {
        conditional += s->jumps[i].conditional;
    }
    mhi_text_add(out,
                 "%d paths, %d coordinates in %d steps each, the others at their defaults\n"
                 "jumps over %g mm: %d, of these %d where a conditional point goes on or off\n",
                 (int)s->d->n_paths, (int)s->n_free, (int)steps, 1e3 * JUMP, (int)s->n,
                 (int)conditional);
    for (int32_t i = 0; i < s->n; i++) {
        const jump *j = &s->jumps[i];
        mhi_text_add(out, "  %-28s %+8.2f mm at %s = %.5g %s%s\n", s->d->paths[j->path].name,
                     1e3 * j->size, s->d->coordinates[j->coordinate].name, shown(s->d, j),
                     s->d->coordinates[j->coordinate].rotational ? "deg" : "m",
                     j->conditional ? ", conditional point" : "");
    }
}

static mhe_status add_json(const sweep *s, int32_t steps, mhi_text *out, mhe_error *err) {
    cJSON *root = cJSON_CreateObject();
    (void)cJSON_AddNumberToObject(root, "paths", s->d->n_paths);
    (void)cJSON_AddNumberToObject(root, "steps", steps);
    (void)cJSON_AddNumberToObject(root, "least", JUMP);
    cJSON *list = cJSON_AddArrayToObject(root, "jumps");
    for (int32_t i = 0; i < s->n; i++) {
        const jump *j = &s->jumps[i];
        cJSON *item = cJSON_CreateObject();
        (void)cJSON_AddStringToObject(item, "path", s->d->paths[j->path].name);
        (void)cJSON_AddStringToObject(item, "coordinate", s->d->coordinates[j->coordinate].name);
        mhi_json_number(item, "at", j->at);
        mhi_json_number(item, "size", j->size);
        (void)cJSON_AddBoolToObject(item, "conditional", j->conditional);
        (void)cJSON_AddItemToArray(list, item);
    }
    char *printed = cJSON_Print(root);
    cJSON_Delete(root);
    if (printed == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhi_text_add(out, "%s\n", printed);
    free(printed);
    return MHE_OK;
}

/* Those that the file locks stand still. */
static mhe_status sweep_all(mhi_inspected *m, int32_t steps, int32_t format, mhi_text *out,
                            mhe_error *err) {
    const mhe_description *d = m->all;
    sweep s = {.skeleton = &m->skeleton, .d = d, .n_free = m->file->n_coordinates};
    s.q = MHI_TAKE(&m->arena, double, d->n_coordinates);
    s.before = MHI_TAKE(&m->arena, double, d->n_coordinates);
    s.still = MHI_TAKE(&m->arena, double, d->n_coordinates);
    s.length = MHI_TAKE(&m->arena, double, d->n_paths);
    s.last = MHI_TAKE(&m->arena, double, d->n_paths);
    s.slope = MHI_TAKE(&m->arena, double, d->n_paths);
    s.length_q = MHI_TAKE(&m->arena, double, d->n_paths * d->n_coordinates);
    mhe_status status = m->arena.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    for (int32_t i = 0; i < s.n_free && status == MHE_OK; i++) {
        status = sweep_coordinate(&s, m->place[i], steps, err);
    }
    if (status == MHE_OK) {
        const mhi_c_locale saved = mhi_c_locale_begin();
        if (format == MHE_FORMAT_JSON) {
            status = add_json(&s, steps, out, err);
        } else {
            add_text(&s, steps, out);
        }
        mhi_c_locale_end(saved);
    }
    free(s.jumps);
    return status;
}

mhe_status mhe_model_sweep(const mhe_host *host, const char *file, int32_t steps, int32_t format,
                           char **text, mhe_error *err) {
    mhi_text out = {0};
    mhi_inspected m = {0};
    mhe_status status = MHI_NEED(err, {"file", file}, {"text", text});
    if (status != MHE_OK) {
        return status;
    }
    if (steps < 1 || steps > 100000) {
        return mhe_fail(err, MHE_E_ARGUMENT, "%d steps: 1 to 100000", (int)steps);
    }
    *text = NULL;
    status = mhi_inspected_open(&m, host, file, MHE_PATHS_EXACT, err);
    if (status == MHE_OK) {
        status = sweep_all(&m, steps, format, &out, err);
    }
    mhi_inspected_close(&m);
    if (status != MHE_OK) {
        mhi_text_free(&out);
        return status;
    }
    return mhi_text_give(&out, text, err);
}

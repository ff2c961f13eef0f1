/* SPDX-License-Identifier: Apache-2.0 */
/* place.c: a model's markers moved to where a static pose has them. */
#include "scale/scale_private.h"

#include "estimator/start.h"
#include "model/system.h"

#include <math.h>
#include <string.h>

typedef struct placing {
    mhi_scaled *m;
    mhi_inspected *open;
    mhi_system *system;
    mhi_system_context *context;
    mhi_start *start;
    mhi_tasks tasks;
    double *seen, *q, *all_q; /* [3 n_k]; [n_q] free; [n_q] all */
    double rms, before;       /* m, of the pose: weighed markers; of all before they are moved */
} placing;

static mhe_status fail_memory(mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

static mhe_status read_trial(placing *p, mhe_error *err) {
    const mhi_scale_setup *s = p->m->setup;
    const mhe_description *d = p->open->file;
    mhi_table *trial = NULL;
    double *mean = NULL;
    mhe_status status = mhi_trc_read(s->static_trial, &trial, err);
    if (status == MHE_OK) {
        mean = MHI_TAKE(&p->m->arena, double, trial->n_columns);
        p->seen = MHI_TAKE(&p->m->arena, double, 3 * d->n_markers);
        status = mean == NULL || p->seen == NULL
                     ? fail_memory(err)
                     : mhi_scale_mean(s, trial, s->static_range, "MarkerPlacer", mean, err);
    }
    int32_t n = 0;
    for (int32_t i = 0; i < d->n_markers && status == MHE_OK; i++) {
        const int32_t column = mhi_table_find(trial, d->markers[i].name);
        for (int32_t axis = 0; axis < 3; axis++) {
            p->seen[3 * i + axis] = column < 0 ? NAN : mean[3 * column + axis];
        }
        n += column >= 0;
    }
    if (status == MHE_OK && n == 0) {
        status =
            mhe_fail(err, MHE_E_INPUT, "%s: none of the model's markers is in it", s->static_trial);
    }
    mhi_table_free(trial);
    return status;
}

/* Weights of the setup's tasks; a marker without a task does not count. */
static mhe_status read_tasks(placing *p, mhe_error *err) {
    const mhi_scale_setup *s = p->m->setup;
    const mhe_description *d = p->open->file;
    double *marker = MHI_TAKE(&p->m->arena, double, d->n_markers);
    double *coordinate = MHI_TAKE(&p->m->arena, double, d->n_coordinates);
    double *value = MHI_TAKE(&p->m->arena, double, d->n_coordinates);
    if (marker == NULL || coordinate == NULL || value == NULL) {
        return fail_memory(err);
    }
    for (int32_t t = 0; t < s->n_tasks; t++) {
        const mhi_ik_task *task = &s->tasks[t];
        for (int32_t i = 0; i < d->n_markers && task->kind == MHI_IK_MARKER; i++) {
            marker[i] = strcmp(d->markers[i].name, task->name) == 0 ? task->weight : marker[i];
        }
        for (int32_t i = 0; i < d->n_coordinates && task->kind != MHI_IK_MARKER; i++) {
            const mhe_coordinate *c = &d->coordinates[i];
            if (strcmp(c->name, task->name) == 0 && task->weight > 0) {
                if (task->kind == MHI_IK_FILE) {
                    return mhe_fail(err, MHE_E_UNSUPPORTED,
                                    "%s: task '%s': value_type from_file is not read; "
                                    "default_value and manual_value are",
                                    s->file.path, task->name);
                }
                coordinate[i] = task->weight;
                value[i] = task->kind == MHI_IK_VALUE ? task->value : c->value;
                p->tasks.n_coordinates++;
            }
        }
    }
    p->tasks.marker = marker;
    p->tasks.coordinate = coordinate;
    p->tasks.value = value;
    return MHE_OK;
}

static mhe_status open_system(placing *p, mhe_error *err) {
    const mhi_inspected *open = p->open;
    const mhi_system_setup setup = {.host = open->host,
                                    .description = open->file,
                                    .model = open->model,
                                    .model_config = open->model_config,
                                    .muscle = open->muscle_plugin,
                                    .muscle_config = open->muscle_config,
                                    .formulation = MHE_FORMULATION_ACTIVATION};
    mhe_status status = mhi_system_create(&setup, &p->system, err);
    if (status == MHE_OK) {
        status = mhi_system_context_create(p->system, &p->context, err);
    }
    return status == MHE_OK ? mhi_start_create(p->system, p->context, &p->start, err) : status;
}

static mhe_status find_pose(placing *p, mhe_error *err) {
    const mhe_description *d = p->open->file;
    p->q = MHI_TAKE(&p->m->arena, double, d->n_coordinates);
    p->all_q = MHI_TAKE(&p->m->arena, double, p->open->all->n_coordinates);
    if (p->q == NULL || p->all_q == NULL) {
        return fail_memory(err);
    }
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        p->q[i] = d->coordinates[i].value;
    }
    mhi_start_set_tasks(p->start, &p->tasks);
    mhe_status status = mhi_start_posture(p->start, p->seen, p->q, &p->rms, err);
    if (status == MHE_OK && isnan(p->rms)) {
        status = mhe_fail(err, MHE_E_INPUT, "%s: no task weighs a marker of the trial",
                          p->m->setup->file.path);
    }
    for (int32_t i = 0; i < p->open->all->n_coordinates && status == MHE_OK; i++) {
        p->all_q[i] = p->open->all->coordinates[i].value;
    }
    for (int32_t i = 0; i < d->n_coordinates && status == MHE_OK; i++) {
        p->all_q[p->open->place[i]] = p->q[i];
    }
    return status;
}

/* The marker's element and its body. */
static xmlNode *element_of(mhi_scaled *m, const char *name) {
    xmlNode *node = mhi_xml_objects(m->file.o.model, "MarkerSet");
    while (node != NULL && strcmp(mhi_xml_name(&m->file.o, node), name) != 0) {
        node = mhi_xml_next(node);
    }
    return node;
}

/* In the frame of the marker's body at this pose. Markers in ground stay. */
static mhe_status move_markers(placing *p, mhe_error *err) {
    const mhe_description *d = p->open->file;
    double *bodies = MHI_TAKE(&p->m->arena, double, 12 * d->n_bodies);
    double *now = MHI_TAKE(&p->m->arena, double, 3 * d->n_markers);
    mhe_status status = bodies == NULL || now == NULL
                            ? fail_memory(err)
                            : mhi_scale_look(p->open, p->all_q, now, NULL, bodies, err);
    double squares = 0;
    int32_t n = 0;
    for (int32_t i = 0; i < d->n_markers && status == MHE_OK; i++) {
        const double *seen = p->seen + 3 * i;
        xmlNode *node = element_of(p->m, d->markers[i].name);
        const int32_t body = d->markers[i].body;
        if (isnan(seen[0] + seen[1] + seen[2]) || node == NULL || body < 0) {
            continue;
        }
        double place[3] = {0}, way[3];
        for (int32_t k = 0; k < 3; k++) {
            way[k] = seen[k] - bodies[12 * body + k];
            squares += (seen[k] - now[3 * i + k]) * (seen[k] - now[3 * i + k]);
        }
        n++;
        for (int32_t k = 0; k < 9; k++) { /* R^T */
            place[k % 3] += bodies[12 * body + 3 + k] * way[k / 3];
        }
        if (!mhi_xml_flag(&p->m->file.o, node, "fixed")) {
            mhi_scale_write(mhi_xml_child(node, "location"), place, 3);
        }
    }
    p->before = n > 0 ? sqrt(squares / n) : NAN;
    return status;
}

static void tell(const placing *p, mhi_text *report) {
    const mhe_description *d = p->open->file;
    mhi_text_add(report, "static pose: markers %.1f mm off (RMS) before they are placed\n",
                 1e3 * p->before);
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        const int32_t turns = d->coordinates[i].rotational;
        mhi_text_add(report, "  %-28s %8.3f %s\n", d->coordinates[i].name,
                     turns ? 57.29577951308232 * p->q[i] : p->q[i], turns ? "deg" : "m");
    }
}

mhe_status mhi_scale_place(mhi_scaled *m, mhi_inspected *open, mhi_text *report, mhe_error *err) {
    placing p = {.m = m, .open = open};
    mhe_status status = read_trial(&p, err);
    if (status == MHE_OK) {
        status = read_tasks(&p, err);
    }
    if (status == MHE_OK) {
        status = open_system(&p, err);
    }
    if (status == MHE_OK) {
        status = find_pose(&p, err);
    }
    if (status == MHE_OK) {
        status = move_markers(&p, err);
    }
    if (status == MHE_OK) {
        tell(&p, report);
    }
    mhi_start_free(p.start);
    mhi_system_context_free(p.context);
    mhi_system_free(p.system);
    return status;
}

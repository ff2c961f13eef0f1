/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/tasks.h"

#include "base/number.h"
#include "base/text.h"
#include "io/ik_tasks.h"

#include <fnmatch.h>
#include <string.h>

typedef struct reader {
    const mhi_run *run;
    const mhe_description *d;
    const mhe_host *host;
    mhi_arena *arena;
    double *marker, *coordinate, *value;
    mhi_text absent; /* markers of the file that the model lacks */
    int32_t n_absent;
    mhi_text unread; /* coordinates that another file would tell */
    mhe_error *err;
} reader;

static const mhi_node *node_of(const reader *r, const char *key) {
    const mhi_node *data = mhi_node_find(mhi_tree_root(r->run->tree), "data");
    const mhi_node *map = data == NULL ? NULL : mhi_node_find(data, "marker_weights");
    const mhi_node *node = map == NULL ? NULL : mhi_node_find(map, key);
    return node != NULL ? node : map;
}

static void take_coordinate(reader *r, const mhi_ik_task *task) {
    for (int32_t i = 0; i < r->d->n_coordinates; i++) {
        const mhe_coordinate *c = &r->d->coordinates[i];
        if (strcmp(c->name, task->name) != 0) {
            continue; /* locked and coupled ones are not free to follow */
        }
        if (task->kind == MHI_IK_FILE) {
            mhi_text_add(&r->unread, "%s%s", r->unread.length > 0 ? ", " : "", task->name);
            return;
        }
        r->coordinate[i] = task->weight;
        r->value[i] = task->kind == MHI_IK_DEFAULT ? c->value : task->value;
    }
}

/* Markers that the tasks do not name do not count, as in OpenSim. */
static mhe_status read_file(reader *r, const char *file) {
    mhi_ik_task *tasks = NULL;
    int32_t n = 0;
    mhe_status status = mhi_ik_tasks_read(file, r->arena, &tasks, &n, r->err);
    for (int32_t i = 0; i < r->d->n_markers && status == MHE_OK; i++) {
        r->marker[i] = 0;
    }
    for (int32_t k = 0; k < n && status == MHE_OK; k++) {
        int32_t found = tasks[k].kind != MHI_IK_MARKER;
        for (int32_t i = 0; i < r->d->n_markers && !found; i++) {
            if (strcmp(r->d->markers[i].name, tasks[k].name) == 0) {
                r->marker[i] = tasks[k].weight;
                found = 1;
            }
        }
        if (tasks[k].kind != MHI_IK_MARKER) {
            take_coordinate(r, &tasks[k]);
        } else if (!found && tasks[k].weight > 0) {
            mhi_text_add(&r->absent, "%s%s", r->n_absent++ > 0 ? ", " : "", tasks[k].name);
        }
    }
    return status;
}

static mhe_status read_entry(reader *r, const char *key, const char *text) {
    double weight = 0;
    int32_t n = 0;
    const mhi_c_locale saved = mhi_c_locale_begin();
    const int32_t known = mhi_number((mhi_cell){text, strlen(text)}, &weight);
    mhi_c_locale_end(saved);
    if (!known || weight < 0) {
        return mhi_fail_at(r->err, MHE_E_CONFIG, r->run->tree, node_of(r, key),
                           "data.marker_weights: '%s' of '%s' is not a number of at least 0", text,
                           key);
    }
    for (int32_t i = 0; i < r->d->n_markers; i++) {
        if (fnmatch(key, r->d->markers[i].name, 0) == 0) {
            r->marker[i] = weight;
            n++;
        }
    }
    if (n > 0) {
        return MHE_OK;
    }
    char hint[256];
    const char **names = MHI_TAKE(r->arena, const char *, r->d->n_markers);
    for (int32_t i = 0; i < r->d->n_markers && names != NULL; i++) {
        names[i] = r->d->markers[i].name;
    }
    return mhi_fail_at(
        r->err, MHE_E_CONFIG, r->run->tree, node_of(r, key),
        "data.marker_weights: the model has no marker '%s'%s", key,
        mhi_suggest(hint, sizeof hint, key, names, names != NULL ? r->d->n_markers : 0));
}

static void tell(const reader *r) {
    mhi_text line = {0};
    if (r->n_absent > 0 && r->host != NULL) {
        mhi_text_add(&line, "data.marker_weights: tasks of markers that the model lacks: %s",
                     r->absent.data);
        r->host->log(r->host, MHE_LOG_INFO, line.failed ? "" : line.data);
        mhi_text_free(&line);
    }
    if (r->unread.length > 0 && r->host != NULL) {
        line = (mhi_text){0};
        mhi_text_add(&line,
                     "data.marker_weights: tasks of coordinates that follow a file are left out "
                     "(data.angles does that): %s",
                     r->unread.data);
        r->host->log(r->host, MHE_LOG_WARNING, line.failed ? "" : line.data);
        mhi_text_free(&line);
    }
}

mhe_status mhi_tasks_read(const mhi_run *run, const mhe_description *d, const mhe_host *host,
                          mhi_arena *arena, const mhi_tasks **tasks, mhe_error *err) {
    const mhe_text_map *map = &run->data.marker_weights;
    *tasks = NULL;
    if (map->n == 0) {
        return MHE_OK;
    }
    mhi_tasks *out = MHI_TAKE(arena, mhi_tasks, 1);
    reader r = {.run = run,
                .d = d,
                .host = host,
                .arena = arena,
                .marker = MHI_TAKE(arena, double, d->n_markers),
                .coordinate = MHI_TAKE(arena, double, d->n_coordinates),
                .value = MHI_TAKE(arena, double, d->n_coordinates),
                .err = err};
    if (out == NULL || r.marker == NULL || r.coordinate == NULL || r.value == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < d->n_markers; i++) {
        r.marker[i] = 1;
    }
    mhe_status status = MHE_OK;
    for (int32_t pass = 0; pass < 2; pass++) { /* single weights stand over the file's */
        for (int32_t i = 0; i < map->n && status == MHE_OK; i++) {
            const int32_t is_file = strcmp(map->keys[i], MHI_MARKER_TASK_FILE) == 0;
            if (is_file == (pass == 0)) {
                status = is_file ? read_file(&r, map->values[i])
                                 : read_entry(&r, map->keys[i], map->values[i]);
            }
        }
    }
    *out = (mhi_tasks){.marker = r.marker, .coordinate = r.coordinate, .value = r.value};
    double sum = 0;
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        out->n_coordinates += r.coordinate[i] > 0;
    }
    for (int32_t i = 0; i < d->n_markers; i++) {
        sum += r.marker[i];
    }
    if (status == MHE_OK && run->data.markers != NULL && sum == 0) {
        status = mhi_fail_at(err, MHE_E_CONFIG, run->tree, node_of(&r, ""),
                             "data.marker_weights: no marker of the model has a weight");
    }
    if (status == MHE_OK) {
        tell(&r);
        *tasks = out;
    }
    mhi_text_free(&r.absent);
    mhi_text_free(&r.unread);
    return status;
}

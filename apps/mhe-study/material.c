/* SPDX-License-Identifier: Apache-2.0 */
#include "material.h"

#include "config/options_value.h"
#include "config/run_steps.h"
#include "estimator/create.h"
#include "io/model_file.h"
#include "process.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char *file_in_map(const study *s, const char *name) {
    for (int32_t i = 0; i < s->keys.motions.n; i++) {
        if (strcmp(s->keys.motions.keys[i], name) == 0) {
            return s->keys.motions.values[i];
        }
    }
    return NULL;
}

/* Path of a motion's file; NULL where it is to be made and there is no folder. */
static mhe_status motion_path(const study *s, const char *name, const char *dir, mhi_arena *arena,
                              const char **path, mhe_error *err) {
    const char *file = file_in_map(s, name);
    if (file == NULL && dir == NULL) {
        *path = NULL;
        return MHE_OK;
    }
    *path = file != NULL ? mhi_path_absolute(s->dir, file, arena)
                         : mhi_arena_format(arena, "%s/motions/%s/reference.sto", dir, name);
    return *path == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
}

/* ---- names ---- */

#define NAMES_MAX 64

typedef struct motion_names {
    const char *list[NAMES_MAX];
    int32_t n;
} motion_names;

static void add_name(motion_names *names, const char *name) {
    if (names->n < NAMES_MAX && name != NULL && *name != '\0') {
        names->list[names->n++] = name;
    }
}

static int holds(const motion_names *names, const char *name) {
    for (int32_t i = 0; i < names->n; i++) {
        if (strcmp(names->list[i], name) == 0) {
            return 1;
        }
    }
    return 0;
}

/* Where the study file names the condition's motion. */
static const mhi_node *reference_node(const study *s, const condition *c) {
    const mhi_node *node = mhi_node_find(mhi_tree_root(s->tree), "reference");
    for (int32_t i = 0; i < c->n_set; i++) {
        if (strncmp(c->set[i].text, "reference=", 10) == 0) {
            node = c->set[i].node;
        }
    }
    return node;
}

mhe_status material_check(const study *s, mhi_registry *registry, mhe_error *err) {
    motion_names names = {0};
    mhi_run *run = NULL;
    mhi_step *steps = NULL;
    int32_t n_steps = 0;
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < s->keys.motions.n; i++) {
        add_name(&names, s->keys.motions.keys[i]);
    }
    if (s->keys.reference_config != NULL) {
        const mhe_text_list *set = &s->keys.reference_set;
        status =
            mhi_run_read_base(s->keys.reference_config, set->values, set->n, registry, &run, err);
        if (status == MHE_OK) {
            status = mhi_run_read_steps(run, registry, &steps, &n_steps, err);
        }
    }
    for (int32_t i = 0; i < n_steps; i++) {
        add_name(&names, steps[i].output);
    }
    for (int32_t i = 0; i < s->n_conditions && status == MHE_OK && s->keys.program == NULL; i++) {
        const char *wanted = s->conditions[i].reference;
        char hint[256];
        if (!holds(&names, wanted)) {
            status = mhi_fail_at(err, MHE_E_CONFIG, s->tree, reference_node(s, &s->conditions[i]),
                                 "reference: there is no motion '%s'%s", wanted,
                                 mhi_suggest(hint, sizeof hint, wanted, names.list, names.n));
        }
    }
    mhi_run_free(run);
    return status;
}

/* ---- making ---- */

static mhe_status find_missing(const study *s, const char *dir, const char **missing,
                               mhe_error *err) {
    mhi_arena arena = {0};
    mhe_status status = MHE_OK;
    *missing = NULL;
    for (int32_t i = 0; i < s->n_conditions && status == MHE_OK && *missing == NULL; i++) {
        const char *path = NULL;
        status = motion_path(s, s->conditions[i].reference, dir, &arena, &path, err);
        if (status == MHE_OK && file_in_map(s, s->conditions[i].reference) == NULL &&
            access(path, R_OK) != 0) {
            *missing = s->conditions[i].reference;
        }
    }
    mhi_arena_free(&arena);
    return status;
}

mhe_status material_make(const study *s, const char *dir, int quiet, mhe_error *err) {
    const char *missing = NULL;
    mhe_status status = s->keys.program != NULL ? MHE_OK : find_missing(s, dir, &missing, err);
    if (status != MHE_OK || missing == NULL) {
        return status;
    }
    mhi_arena arena = {0};
    const mhe_text_list *set = &s->keys.reference_set;
    const char *program = NULL;
    const char **argv = MHI_TAKE(&arena, const char *, 6 + 2 * set->n);
    const char *out = mhi_arena_format(&arena, "%s/motions", dir);
    status = argv == NULL || out == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                         : process_beside("mhe-sim", &arena, &program, err);
    if (status == MHE_OK) {
        int n = 0;
        argv[n++] = program;
        argv[n++] = "reference";
        argv[n++] = s->keys.reference_config;
        argv[n++] = "--out";
        argv[n++] = out;
        for (int32_t i = 0; i < set->n; i++) {
            argv[n++] = "--set";
            argv[n++] = set->values[i];
        }
        if (!quiet) {
            (void)printf("making the reference motions (%s)\n", s->keys.reference_config);
            (void)fflush(stdout);
        }
        status = process_run(argv, quiet, err);
    }
    if (status == MHE_OK) {
        status = find_missing(s, dir, &missing, err);
    }
    if (status == MHE_OK && missing != NULL) {
        status = mhe_fail(err, MHE_E_INPUT, "%s: makes no motion '%s'", s->keys.reference_config,
                          missing);
    }
    mhi_arena_free(&arena);
    return status;
}

/* ---- reading ---- */

static int32_t same_texts(const char *const *a, int32_t n_a, const char *const *b, int32_t n_b) {
    for (int32_t i = 0; i < n_a && i < n_b; i++) {
        if (strcmp(a[i], b[i]) != 0) {
            return 0;
        }
    }
    return n_a == n_b;
}

/* The same file, read in the same way. */
static int32_t same_model(const mhi_model_section *a, const mhi_model_section *b) {
    const mhe_text_map *at_a = &a->locked_at, *at_b = &b->locked_at;
    return strcmp(a->file, b->file) == 0 && a->unsupported == b->unsupported &&
           same_texts(a->locked.values, a->locked.n, b->locked.values, b->locked.n) &&
           same_texts(at_a->keys, at_a->n, at_b->keys, at_b->n) &&
           same_texts(at_a->values, at_a->n, at_b->values, at_b->n);
}

static mhe_status find_model(material *m, const mhi_run *run, const mhe_host *host,
                             material_model **found, mhe_error *err) {
    const mhi_model_section *section = &run->model_file;
    for (int32_t i = 0; i < m->n_models; i++) {
        if (same_model(m->models[i].section, section)) {
            *found = &m->models[i];
            return MHE_OK;
        }
    }
    *found = &m->models[m->n_models++];
    **found = (material_model){.section = section};
    return mhi_estimator_read_model(run, host, &(*found)->description, err);
}

static mhe_status find_motion(material *m, const char *path, const material_model *model,
                              const mhe_host *host, material_motion **found, mhe_error *err) {
    for (int32_t i = 0; i < m->n_motions; i++) {
        if (strcmp(m->motions[i].path, path) == 0 && m->motions[i].model == model) {
            *found = &m->motions[i];
            return MHE_OK;
        }
    }
    *found = &m->motions[m->n_motions++];
    **found = (material_motion){.path = path, .model = model};
    return mhi_recording_read_reference(path, model->description, host, &(*found)->recording, err);
}

static mhe_status too_short(const study *s, const condition *c, mhe_error *err) {
    const mhi_horizon_section *h = &c->run->horizon;
    mhi_text text = {0};
    study_condition_text(s, c, &text);
    mhe_status status = mhi_fail_at(
        err, MHE_E_CONFIG, s->tree, c->node,
        "%s: %d samples of '%s' are too few for a window of %d intervals at ratio %d", text.data,
        (int)c->motion->n_frames, c->reference, (int)h->window, (int)h->ratio);
    mhi_text_free(&text);
    return status;
}

mhe_status material_load(study *s, const char *dir, const mhe_host *host, material *m,
                         mhe_error *err) {
    *m = (material){0};
    m->models = MHI_TAKE(&m->arena, material_model, s->n_conditions);
    m->motions = MHI_TAKE(&m->arena, material_motion, s->n_conditions);
    mhe_status status = m->models == NULL || m->motions == NULL
                            ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                            : MHE_OK;
    for (int32_t i = 0; i < s->n_conditions && status == MHE_OK; i++) {
        condition *c = &s->conditions[i];
        material_model *model = NULL;
        material_motion *motion = NULL;
        const char *path = NULL;
        status = find_model(m, c->run, host, &model, err);
        if (status == MHE_OK && s->keys.program == NULL) {
            c->model = model->description;
            status = motion_path(s, c->reference, dir, &m->arena, &path, err);
        }
        if (status != MHE_OK || path == NULL) {
            continue;
        }
        status = find_motion(m, path, model, host, &motion, err);
        if (status == MHE_OK) {
            c->motion = motion->recording;
            c->motion_path = motion->path;
            const mhi_horizon_section *h = &c->run->horizon;
            const int64_t span = (int64_t)h->window * h->ratio;
            status = c->noise.markers.clock.rate == 0 && c->motion->n_frames <= span
                         ? too_short(s, c, err)
                         : MHE_OK;
        }
    }
    return status;
}

void material_free(material *m) {
    for (int32_t i = 0; i < m->n_motions; i++) {
        mhi_recording_free(m->motions[i].recording);
    }
    for (int32_t i = 0; i < m->n_models; i++) {
        mhi_description_free(m->models[i].description);
    }
    mhi_arena_free(&m->arena);
    *m = (material){0};
}

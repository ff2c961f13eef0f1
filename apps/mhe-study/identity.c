/* SPDX-License-Identifier: Apache-2.0 */
#include "identity.h"

#include "base/digest.h"
#include "io/slurp.h"
#include "plugin/loader.h"
#include "study_json.h"
#include <mhe/outbox.h>

#include <inttypes.h>
#include <mhe/version.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define FILE_NAME "study.id"

static mhe_status no_memory(mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

static mhe_status add_file(mhi_text *key, const char *path, mhe_error *err) {
    size_t length = 0;
    uint64_t digest = 0;
    mhe_status status = mhi_file_digest(path, &length, &digest, err);
    if (status == MHE_OK) {
        mhi_text_add(key, "%zu %016" PRIx64 "\n", length, digest);
    }
    return status;
}

/* Digests of files, each once: conditions share them. */
typedef struct seen {
    const char **list;
    int32_t n;
} seen;

static mhe_status add_once(seen *known, const char *path, mhi_text *key, mhe_error *err) {
    for (int32_t i = 0; i < known->n; i++) {
        if (strcmp(known->list[i], path) == 0) {
            return MHE_OK;
        }
    }
    known->list[known->n++] = path;
    return add_file(key, path, err);
}

static mhe_status add_plugin(seen *known, const mhe_plugin *plugin, mhi_text *key, mhe_error *err) {
    const char *library = NULL;
    mhe_status status = mhi_plugin_library(plugin, &library, err);
    return status == MHE_OK ? add_once(known, library, key, err) : status;
}

/* The libraries of all plugins that the conditions use, and the models. */
static mhe_status add_parts(const study *s, seen *known, mhi_text *program, mhi_text *models,
                            mhe_error *err) {
    mhe_status status = add_once(known, "/proc/self/exe", program, err);
    if (status == MHE_OK && s->keys.program != NULL) {
        status = add_once(known, s->keys.program, program, err);
    }
    for (int32_t i = 0; i < s->n_conditions && status == MHE_OK; i++) {
        const mhi_run *run = s->conditions[i].run;
        const mhe_plugin *const plugins[] = {run->model.plugin, run->muscle.plugin,
                                             run->integrator.plugin, run->solver.plugin};
        for (size_t k = 0; k < sizeof plugins / sizeof plugins[0] && status == MHE_OK; k++) {
            status = add_plugin(known, plugins[k], program, err);
        }
        for (int32_t k = 0; k < run->n_costs && status == MHE_OK; k++) {
            status = add_plugin(known, run->costs[k].plugin, program, err);
        }
        if (status == MHE_OK) {
            status = add_once(known, run->model_file.file, models, err);
        }
        if (status == MHE_OK && run->model_file.motion != NULL) {
            status = add_once(known, run->model_file.motion, models, err);
        }
    }
    return status;
}

static void add_conditions(const study *s, mhi_text *key) {
    mhi_text_add(key, "seed %d, measure %d, exclude %a\n", (int)s->keys.seed, (int)s->keys.measure,
                 s->keys.exclude_below);
    for (int32_t i = 0; i < s->n_conditions; i++) {
        const condition *c = &s->conditions[i];
        study_condition_text(s, c, key);
        mhi_text_add(key, " reference %s, trials %d, forces %d\n", c->reference, (int)c->trials,
                     (int)c->keep_forces);
        mhi_node_write(mhi_tree_root(c->run->tree), key);
        const mhi_node *noise = mhi_node_find(mhi_tree_root(c->noise_tree), "noise");
        if (noise != NULL) {
            mhi_node_write(noise, key);
        }
    }
}

static void add_line(mhi_text *out, const char *name, const mhi_text *key) {
    mhi_text_add(out, "%s %016" PRIx64 "\n", name,
                 key->data == NULL ? 0 : mhi_digest(key->data, key->length));
}

static void add_motions(const study *s, mhi_text *key) {
    for (int32_t i = 0; i < s->n_conditions; i++) {
        const condition *c = &s->conditions[i];
        const mhi_recording *m = c->motion;
        if (m == NULL) { /* a program makes the trials */
            continue;
        }
        const size_t rows = (size_t)m->n_frames;
        const mhi_reference *r = &m->reference;
        const size_t n_q = (size_t)c->model->n_coordinates, n_m = (size_t)c->model->n_muscles;
        const struct {
            const double *values;
            size_t n;
        } parts[] = {{m->time, rows},
                     {r->q, rows * n_q},
                     {r->qdot, rows * n_q},
                     {r->activation, rows * n_m},
                     {r->excitation, rows * n_m},
                     {r->force, rows * n_m}};
        if (i > 0 && m == s->conditions[i - 1].motion) {
            continue;
        }
        for (size_t k = 0; k < sizeof parts / sizeof parts[0]; k++) {
            mhi_text_add(key, "%016" PRIx64 "\n",
                         mhi_digest(parts[k].values, parts[k].n * sizeof(double)));
        }
    }
}

mhe_status identity_text(const study *s, int32_t motions, mhi_text *out, mhe_error *err) {
    mhi_text program = {0}, key = {0}, motion_key = {0};
    seen known = {calloc((size_t)s->n_conditions * 16 + 16, sizeof(char *)), 0};
    mhe_status status = known.list == NULL ? no_memory(err) : MHE_OK;
    if (status == MHE_OK) {
        status = add_parts(s, &known, &program, &key, err);
    }
    if (status == MHE_OK) {
        add_conditions(s, &key);
        mhi_text_add(out, "mhe-study rows 1\nversion %s\n", MHE_VERSION);
        add_line(out, "program", &program);
        add_line(out, "study", &key);
    }
    if (status == MHE_OK && motions) {
        add_motions(s, &motion_key);
        add_line(out, "motions", &motion_key);
    }
    if (status == MHE_OK && (out->failed || key.failed || program.failed || motion_key.failed)) {
        status = no_memory(err);
    }
    free(known.list);
    mhi_text_free(&program);
    mhi_text_free(&key);
    mhi_text_free(&motion_key);
    return status;
}

static mhe_status refuse(const char *path, int32_t number, const char *line, mhe_error *err) {
    static const struct {
        const char *begin, *why;
    } reasons[] = {
        {"version", "the results here were made by another version of mhe-study"},
        {"program", "the results here were made by another build of mhe-study or its plugins"},
        {"study", "the results here are of another study"},
        {"motions", "the results here were made from other reference motions"},
    };
    const char *why = "this is not the results folder of a study";
    for (size_t i = 0; i < sizeof reasons / sizeof reasons[0]; i++) {
        why = strncmp(line, reasons[i].begin, strlen(reasons[i].begin)) == 0 ? reasons[i].why : why;
    }
    return mhe_fail(err, MHE_E_INPUT, "%s:%d: %s; give another folder", path, (int)number, why);
}

mhe_status identity_check(const char *dir, const mhi_text *text, int32_t *known, mhe_error *err) {
    mhi_arena arena = {0};
    const char *path = mhi_arena_format(&arena, "%s/" FILE_NAME, dir);
    char *found = NULL;
    size_t length = 0;
    mhe_status status = path == NULL ? no_memory(err) : MHE_OK;
    *known = status == MHE_OK && access(path, F_OK) == 0;
    if (*known) {
        status = mhi_slurp(path, &found, &length, err);
    }
    int32_t number = 1;
    const char *line = text->data;
    for (size_t i = 0; *known && status == MHE_OK && text->data[i] != '\0'; i++) {
        if (i >= length || found[i] != text->data[i]) {
            status = refuse(path, number, line, err);
        } else if (text->data[i] == '\n') {
            line = text->data + i + 1;
            number++;
        }
    }
    free(found);
    mhi_arena_free(&arena);
    return status;
}

mhe_status identity_write(const study *s, const char *dir, const mhi_text *text, mhe_error *err) {
    mhe_outbox *outbox = NULL;
    mhi_text yaml = {0}, json = {0}, config = {0};
    for (const mhi_node *n = mhi_tree_root(s->tree)->first; n != NULL; n = n->next) {
        mhi_text_add(&yaml, "%s: ", n->key);
        mhi_node_write(n, &yaml);
        mhi_text_add(&yaml, "\n");
    }
    mhi_run_write(s->conditions[0].run, &config);
    mhe_status status = study_json(s, &json, err);
    if (status == MHE_OK && (yaml.failed || config.failed || json.failed)) {
        status = no_memory(err);
    }
    if (status == MHE_OK) {
        status = mhe_outbox_open(dir, &outbox, err);
    }
    const struct {
        const char *name, *text;
    } files[] = {{"study.yaml", yaml.data},
                 {"study.json", json.data},
                 {"config.yaml", config.data},
                 {FILE_NAME, text->data}};
    for (size_t i = 0; i < sizeof files / sizeof files[0] && status == MHE_OK; i++) {
        status = mhe_outbox_text(outbox, files[i].name, files[i].text, err);
    }
    if (status == MHE_OK) {
        status = mhe_outbox_commit(outbox, err);
    }
    mhe_outbox_close(outbox);
    mhi_text_free(&yaml);
    mhi_text_free(&json);
    mhi_text_free(&config);
    return status;
}

/* SPDX-License-Identifier: Apache-2.0 */
#include "calibrate/person.h"

#include "base/arena.h"
#include "config/run.h"
#include "io/motion_file.h"
#include "io/slurp.h"

#include <libxml/parser.h>
#include <libxml/tree.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- the model file ---- */

static int32_t is_called(const xmlNode *node, const char *name) {
    return node->type == XML_ELEMENT_NODE && strcmp((const char *)node->name, name) == 0;
}

static xmlNode *child_of(const xmlNode *node, const char *name) {
    xmlNode *child = node->children;
    while (child != NULL && !is_called(child, name)) {
        child = child->next;
    }
    return child;
}

/* An element of that name attribute with a child `child`, in the order of the file. */
static xmlNode *find_named(xmlNode *from, const char *name, const char *child) {
    for (xmlNode *node = from; node != NULL; node = node->next) {
        if (node->type != XML_ELEMENT_NODE) {
            continue;
        }
        xmlChar *own = xmlGetProp(node, (const xmlChar *)"name");
        const int32_t same = own != NULL && strcmp((const char *)own, name) == 0;
        xmlFree(own);
        if (same && child_of(node, child) != NULL) {
            return node;
        }
        xmlNode *deeper = find_named(node->children, name, child);
        if (deeper != NULL) {
            return deeper;
        }
    }
    return NULL;
}

static void set_number(xmlNode *owner, const char *tag, double value) {
    char text[32];
    (void)snprintf(text, sizeof text, "%.10g", value);
    xmlNode *node = child_of(owner, tag);
    if (node == NULL) { /* it had the class's default */
        (void)xmlNewChild(owner, NULL, (const xmlChar *)tag, (const xmlChar *)text);
    } else {
        xmlNodeSetContent(node, (const xmlChar *)text);
    }
}

static mhe_status set_muscle(const mhi_calibration *c, xmlNode *root, int32_t m, mhe_error *err) {
    const mhe_muscle *muscle = &c->model->muscles[m];
    const double now[] = {muscle->max_isometric_force, muscle->optimal_fiber_length,
                          muscle->tendon_slack_length};
    xmlNode *node = NULL;
    for (int32_t kind = MHI_OF_STRENGTH; kind <= MHI_OF_SLACK; kind++) {
        if (mhi_calibration_find(c, kind, m, -1) == NULL) {
            continue;
        }
        node = node != NULL ? node : find_named(root, muscle->name, "max_isometric_force");
        node = node != NULL ? node : find_named(root, muscle->name, "GeometryPath");
        if (node == NULL) {
            return mhe_fail(err, MHE_E_INPUT, "%s: muscle '%s' is not found to be written",
                            c->run->model_file.file, muscle->name);
        }
        set_number(node, mhi_plan_names[kind], now[kind] * mhi_calibration_of(c, kind, m));
    }
    return MHE_OK;
}

static mhe_status set_marker(const mhi_calibration *c, xmlNode *root, int32_t k, mhe_error *err) {
    const mhe_marker *marker = &c->model->markers[k];
    if (mhi_calibration_find(c, MHI_OF_MARKER, k, 0) == NULL) {
        return MHE_OK;
    }
    xmlNode *node = find_named(root, marker->name, "location");
    if (node == NULL) {
        return mhe_fail(err, MHE_E_INPUT, "%s: marker '%s' is not found to be written",
                        c->run->model_file.file, marker->name);
    }
    char text[96];
    double at[3];
    for (int32_t axis = 0; axis < 3; axis++) {
        at[axis] = marker->location[axis] + mhi_calibration_find(c, MHI_OF_MARKER, k, axis)->value;
    }
    (void)snprintf(text, sizeof text, "%.10g %.10g %.10g", at[0], at[1], at[2]);
    xmlNodeSetContent(child_of(node, "location"), (const xmlChar *)text);
    return MHE_OK;
}

mhe_status mhi_person_model(const mhi_calibration *c, mhi_text *out, mhe_error *err) {
    const char *path = c->run->model_file.file;
    const size_t n = strlen(path);
    if (n < 5 || strcmp(path + n - 5, ".osim") != 0) {
        return mhe_fail(err, MHE_E_UNSUPPORTED,
                        "%s: calibrated models are written as .osim, and this is none", path);
    }
    char *text = NULL;
    size_t length = 0;
    mhe_status status = mhi_slurp(path, &text, &length, err);
    xmlDoc *doc = status == MHE_OK
                      ? xmlReadMemory(text, (int)length, path, NULL,
                                      XML_PARSE_NONET | XML_PARSE_NOERROR | XML_PARSE_NOWARNING)
                      : NULL;
    if (status == MHE_OK && doc == NULL) {
        status = mhe_fail(err, MHE_E_INPUT, "%s: cannot be read as XML", path);
    }
    for (int32_t m = 0; m < c->model->n_muscles && status == MHE_OK; m++) {
        status = set_muscle(c, xmlDocGetRootElement(doc), m, err);
    }
    for (int32_t k = 0; k < c->model->n_markers && status == MHE_OK; k++) {
        status = set_marker(c, xmlDocGetRootElement(doc), k, err);
    }
    if (status == MHE_OK) {
        xmlChar *dump = NULL;
        int size = 0;
        xmlDocDumpMemory(doc, &dump, &size);
        if (dump == NULL) {
            status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
        } else {
            mhi_text_add(out, "%s", (const char *)dump);
        }
        xmlFree(dump);
    }
    xmlFreeDoc(doc);
    free(text);
    return status;
}

/* ---- the config ---- */

/* How the EMG file calls the column of a muscle; NULL: there is none. */
static const char *column_of(const mhi_table *table, const char *muscle, mhi_arena *arena) {
    static const char *const before[] = {"e_", "", ""}, *const behind[] = {"", "", ".excitation"};
    for (int32_t i = 0; i < 3; i++) {
        const char *name = mhi_arena_format(arena, "%s%s%s", before[i], muscle, behind[i]);
        if (name != NULL && mhi_table_find(table, name) >= 0) {
            return name;
        }
    }
    return NULL;
}

static double *one_each(int32_t n, double value, mhi_arena *arena) {
    double *values = MHI_TAKE(arena, double, n);
    for (int32_t i = 0; i < n && values != NULL; i++) {
        values[i] = value;
    }
    return values;
}

/* Columns of muscles become channels, each of its own muscle. */
static mhe_status make_channels(const mhi_calibration *c, mhi_run *run, mhi_arena *arena,
                                mhe_error *err) {
    mhi_table *table = NULL;
    mhe_status status = mhi_signals_read(run->data.emg, &table, err);
    mhi_emg_channel *list = MHI_TAKE(arena, mhi_emg_channel, c->model->n_muscles);
    run->emg.process = 0;
    run->emg.channels = list;
    for (int32_t m = 0; m < c->model->n_muscles && status == MHE_OK && list != NULL; m++) {
        const char *name = column_of(table, c->model->muscles[m].name, arena);
        const char **muscles = MHI_TAKE(arena, const char *, 1);
        if (name != NULL && muscles != NULL) {
            muscles[0] = c->model->muscles[m].name;
            list[run->emg.n_channels++] = (mhi_emg_channel){
                .name = name, .muscles = {muscles, 1}, .gain = 1, .mvc = 1, .delay = -1};
        }
    }
    mhi_table_free(table);
    return status == MHE_OK && list == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : status;
}

static int32_t muscle_number(const mhe_description *d, const char *name) {
    for (int32_t m = 0; m < d->n_muscles; m++) {
        if (strcmp(d->muscles[m].name, name) == 0) {
            return m;
        }
    }
    return -1;
}

/* Gains and shape factors of a channel's muscles. */
static mhe_status set_channel(const mhi_calibration *c, mhi_emg_channel *channel, mhi_arena *arena,
                              mhe_error *err) {
    const int32_t n = channel->muscles.n;
    double *gains = one_each(n, 1, arena), *shape = one_each(n, 0, arena);
    if (gains == NULL || shape == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < n; i++) {
        const int32_t m = muscle_number(c->model, channel->muscles.values[i]);
        gains[i] = channel->gains.n > 0 ? channel->gains.values[i] : 1;
        shape[i] = channel->shape.n == 0 ? 0 : channel->shape.values[channel->shape.n == n ? i : 0];
        if (m >= 0) {
            gains[i] *= mhi_calibration_of(c, MHI_OF_GAIN, m);
            shape[i] += mhi_calibration_of(c, MHI_OF_SHAPE, m);
        }
    }
    channel->gains = (mhe_real_list){gains, n};
    channel->shape = (mhe_real_list){shape, n};
    return MHE_OK;
}

mhe_status mhi_person_config(const mhi_calibration *c, const char *file, mhi_text *out,
                             mhe_error *err) {
    mhi_arena arena = {0};
    mhi_run run = *c->run;
    mhe_status status = MHE_OK;
    run.model_file.file = file;
    if (run.data.emg == NULL) {
        for (int32_t i = 0; i < c->plan.n_recordings && run.data.emg == NULL; i++) {
            run.data.markers = c->plan.recordings[i].markers;
            run.data.emg = c->plan.recordings[i].emg;
        }
    }
    int32_t of_emg = 0;
    for (int32_t i = 0; i < c->n; i++) {
        of_emg |= c->list[i].kind == MHI_OF_GAIN || c->list[i].kind == MHI_OF_SHAPE;
    }
    if (of_emg && run.emg.n_channels == 0) {
        status = make_channels(c, &run, &arena, err);
    } else if (of_emg) {
        mhi_emg_channel *copy = MHI_TAKE(&arena, mhi_emg_channel, run.emg.n_channels);
        status = copy == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
        for (int32_t i = 0; i < run.emg.n_channels && copy != NULL; i++) {
            copy[i] = run.emg.channels[i];
        }
        run.emg.channels = copy;
    }
    for (int32_t i = 0; i < run.emg.n_channels && of_emg && status == MHE_OK; i++) {
        status = set_channel(c, &run.emg.channels[i], &arena, err);
    }
    if (status == MHE_OK) {
        mhi_run_write(&run, out);
    }
    mhi_arena_free(&arena);
    return status;
}

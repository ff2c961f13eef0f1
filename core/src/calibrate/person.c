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

static void set_location(xmlNode *owner, const double *at) {
    char text[96];
    (void)snprintf(text, sizeof text, "%.10g %.10g %.10g", at[0], at[1], at[2]);
    xmlNodeSetContent(child_of(owner, "location"), (const xmlChar *)text);
}

/* The last point of a muscle's path in the file; NULL: not found. */
static xmlNode *last_point(xmlNode *root, const char *muscle) {
    xmlNode *node = find_named(root, muscle, "GeometryPath"), *last = NULL;
    static const char *const way[] = {"GeometryPath", "PathPointSet", "objects"};
    for (int32_t i = 0; i < 3 && node != NULL; i++) {
        node = child_of(node, way[i]);
    }
    for (xmlNode *point = node == NULL ? NULL : node->children; point != NULL;
         point = point->next) {
        last =
            point->type == XML_ELEMENT_NODE && child_of(point, "location") != NULL ? point : last;
    }
    return last;
}

/* Numbers of an element's text, at most n; -1: something else stands there. */
static int32_t read_numbers(const xmlNode *node, double *values, int32_t n) {
    xmlChar *text = node == NULL ? NULL : xmlNodeGetContent(node);
    char *at = (char *)text, *end = at;
    int32_t found = 0;
    while (at != NULL && found < n) {
        const double value = strtod(at, &end);
        if (end == at) {
            break;
        }
        values[found++] = value;
        at = end;
    }
    const int32_t clean = at != NULL && strspn(at, " \t\r\n") == strlen(at);
    xmlFree(text);
    return clean ? found : -1;
}

static mhe_status set_insertion(const mhi_calibration *c, xmlNode *root, int32_t m,
                                mhe_error *err) {
    const mhe_path *path = &c->model->paths[m];
    if (mhi_calibration_find(c, MHI_OF_INSERTION, m, 0) == NULL) {
        return MHE_OK;
    }
    const double *was = path->points[path->n_points - 1].location;
    xmlNode *node = last_point(root, c->model->muscles[m].name);
    double now[3], in_file[3];
    if (node == NULL || read_numbers(child_of(node, "location"), in_file, 3) != 3) {
        return mhe_fail(err, MHE_E_INPUT,
                        "%s: the last path point of '%s' is not found to be "
                        "written",
                        c->run->model_file.file, c->model->muscles[m].name);
    }
    for (int32_t axis = 0; axis < 3; axis++) {
        if (fabs(in_file[axis] - was[axis]) > 1e-9) {
            return mhe_fail(err, MHE_E_UNSUPPORTED,
                            "%s: the last path point of '%s' stands in a frame of its own, and "
                            "cannot be written",
                            c->run->model_file.file, c->model->muscles[m].name);
        }
        now[axis] = was[axis] + mhi_calibration_find(c, MHI_OF_INSERTION, m, axis)->value;
    }
    set_location(node, now);
    return MHE_OK;
}

/* Multiplies the numbers of an element. */
static void scale_numbers(xmlNode *owner, const char *tag, double factor) {
    xmlNode *node = child_of(owner, tag);
    double values[9];
    const int32_t n = read_numbers(node, values, 9);
    mhi_text text = {0};
    for (int32_t i = 0; i < n; i++) {
        mhi_text_add(&text, "%s%.10g", i == 0 ? "" : " ", factor * values[i]);
    }
    if (n > 0 && !text.failed) {
        xmlNodeSetContent(node, (const xmlChar *)text.data);
    }
    mhi_text_free(&text);
}

static mhe_status set_body(const mhi_calibration *c, xmlNode *root, int32_t b, mhe_error *err) {
    static const char *const tags[] = {"mass",       "inertia",    "inertia_xx", "inertia_yy",
                                       "inertia_zz", "inertia_xy", "inertia_xz", "inertia_yz"};
    if (mhi_calibration_find(c, MHI_OF_MASS, b, -1) == NULL) {
        return MHE_OK;
    }
    xmlNode *node = find_named(root, c->model->bodies[b].name, "mass");
    if (node == NULL) {
        return mhe_fail(err, MHE_E_INPUT, "%s: body '%s' is not found to be written",
                        c->run->model_file.file, c->model->bodies[b].name);
    }
    for (size_t i = 0; i < sizeof tags / sizeof tags[0]; i++) {
        scale_numbers(node, tags[i], mhi_calibration_of(c, MHI_OF_MASS, b));
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
    double at[3];
    for (int32_t axis = 0; axis < 3; axis++) {
        at[axis] = marker->location[axis] + mhi_calibration_find(c, MHI_OF_MARKER, k, axis)->value;
    }
    set_location(node, at);
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
        status = status == MHE_OK ? set_insertion(c, xmlDocGetRootElement(doc), m, err) : status;
    }
    for (int32_t b = 0; b < c->model->n_bodies && status == MHE_OK; b++) {
        status = set_body(c, xmlDocGetRootElement(doc), b, err);
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

/* Gains, shape factors and delay of a channel's muscles. */
static mhe_status set_channel(const mhi_calibration *c, mhi_emg_channel *channel, mhi_arena *arena,
                              mhe_error *err) {
    const int32_t n = channel->muscles.n;
    double delay = 0, *gains = one_each(n, 1, arena), *shape = one_each(n, 0, arena);
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
            delay += mhi_calibration_of(c, MHI_OF_DELAY, m) / n; /* a channel has one */
        }
    }
    if (delay != 0) {
        channel->delay =
            fmax(0, (channel->delay >= 0 ? channel->delay : fmax(0, c->run->emg.delay)) + delay);
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
    if (c->persons_solver != NULL) {
        run.solver = *c->persons_solver;
    }
    if (run.data.emg == NULL) {
        for (int32_t i = 0; i < c->plan.n_recordings && run.data.emg == NULL; i++) {
            run.data.markers = c->plan.recordings[i].markers;
            run.data.emg = c->plan.recordings[i].emg;
        }
    }
    int32_t of_emg = 0;
    for (int32_t i = 0; i < c->n; i++) {
        of_emg |= c->list[i].kind == MHI_OF_GAIN || c->list[i].kind == MHI_OF_SHAPE ||
                  c->list[i].kind == MHI_OF_DELAY;
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

/* SPDX-License-Identifier: Apache-2.0 */
/* setup.c: reads a Scale setup of OpenSim (<ScaleTool>). */
#include "base/text.h"
#include "io/slurp.h"
#include "scale/scale_private.h"

#include <libxml/parser.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

mhe_status mhi_document_fail(const mhi_document *d, int32_t line, mhe_error *err,
                             const char *format, ...) {
    char text[400];
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return mhe_fail(err, MHE_E_INPUT, "%s:%d: %s", d->path, (int)(line > 0 ? line : 1), text);
}

static void quiet(void *data, xmlError *problem) {
    (void)data, (void)problem;
}

mhe_status mhi_document_open(mhi_document *d, const char *path, mhe_error *err) {
    char *text = NULL;
    size_t length = 0;
    *d = (mhi_document){.path = path};
    mhe_status status = mhi_slurp(path, &text, &length, err);
    if (status != MHE_OK) {
        return status;
    }
    mhi_build_start(&d->o.b, path, err);
    const xmlStructuredErrorFunc handler = xmlStructuredError;
    void *data = xmlStructuredErrorContext;
    xmlSetStructuredErrorFunc(NULL, quiet);
    d->doc = length > INT32_MAX ? NULL
                                : xmlReadMemory(text, (int)length, NULL, NULL,
                                                XML_PARSE_NONET | XML_PARSE_BIG_LINES);
    const xmlError *why = xmlGetLastError();
    const int32_t line = d->doc == NULL && why != NULL ? why->line : 1;
    xmlSetStructuredErrorFunc(data, handler);
    free(text);
    d->root = d->doc == NULL ? NULL : xmlDocGetRootElement(d->doc);
    if (d->root == NULL || d->doc->intSubset != NULL || !mhi_xml_is(d->root, "OpenSimDocument")) {
        return mhi_document_fail(d, line, err,
                                 d->root == NULL ? "not XML"
                                                 : "not a file of OpenSim: the outermost "
                                                   "element is not <OpenSimDocument>");
    }
    return MHE_OK;
}

void mhi_document_close(mhi_document *d) {
    if (d->doc != NULL) {
        xmlFreeDoc(d->doc);
    }
    mhi_arena_free(&d->o.b.arena);
    *d = (mhi_document){0};
}

/* Path of a file beside the setup; NULL: none is named ("Unassigned" is OpenSim's word for it). */
static const char *file_of(mhi_scale_setup *s, xmlNode *part, const char *key) {
    const char *name = mhi_xml_word(&s->file.o, part, key);
    return name == NULL || strcmp(name, "Unassigned") == 0 ? NULL
           : name[0] == '/'                                ? mhi_arena_text(&s->arena, name)
                            : mhi_arena_format(&s->arena, "%s/%s", s->folder, name);
}

static int32_t count(xmlNode *first) {
    int32_t n = 0;
    for (xmlNode *node = first; node != NULL; node = mhi_xml_next(node)) {
        n++;
    }
    return n;
}

static int32_t applies(mhi_scale_setup *s, xmlNode *node) {
    return mhi_xml_stated_flag(&s->file.o, node, "apply") != 0;
}

static mhe_status read_pair(mhi_scale_setup *s, xmlNode *node, mhi_marker_pair *pair,
                            mhe_error *err) {
    const char *text = mhi_xml_word(&s->file.o, node, "markers");
    const size_t first = text == NULL ? 0 : strcspn(text, " \t\r\n");
    const char *second = text == NULL ? "" : text + first + strspn(text + first, " \t\r\n");
    pair->line = mhi_xml_line(node);
    if (*second == '\0' || strpbrk(second, " \t\r\n") != NULL) {
        return mhi_document_fail(&s->file, pair->line, err,
                                 "<markers> of a MarkerPair takes two names");
    }
    pair->names[0] = mhi_arena_text_n(&s->arena, text, first);
    pair->names[1] = mhi_arena_text(&s->arena, second);
    return MHE_OK;
}

static mhe_status read_measurement(mhi_scale_setup *s, xmlNode *node, mhi_measurement *m,
                                   mhe_error *err) {
    xmlNode *pairs = mhi_xml_objects(node, "MarkerPairSet");
    xmlNode *bodies = mhi_xml_objects(node, "BodyScaleSet");
    *m = (mhi_measurement){.name = mhi_arena_text(&s->arena, mhi_xml_name(&s->file.o, node)),
                           .line = mhi_xml_line(node)};
    m->pairs = MHI_TAKE(&s->arena, mhi_marker_pair, count(pairs));
    m->bodies = MHI_TAKE(&s->arena, const char *, count(bodies));
    m->axes = MHI_TAKE(&s->arena, uint8_t, count(bodies));
    if (m->name == NULL || m->pairs == NULL || m->bodies == NULL || m->axes == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = MHE_OK;
    for (; pairs != NULL && status == MHE_OK; pairs = mhi_xml_next(pairs)) {
        status = read_pair(s, pairs, &m->pairs[m->n_pairs++], err);
    }
    for (; bodies != NULL; bodies = mhi_xml_next(bodies)) {
        const char *axes = mhi_xml_word(&s->file.o, bodies, "axes");
        uint8_t *to = &m->axes[m->n_bodies];
        for (; axes != NULL && *axes != '\0'; axes++) {
            *to |= (uint8_t)(*axes == 'X' ? 1 : *axes == 'Y' ? 2 : *axes == 'Z' ? 4 : 0);
        }
        m->bodies[m->n_bodies++] = mhi_arena_text(&s->arena, mhi_xml_name(&s->file.o, bodies));
    }
    if (status == MHE_OK && m->n_pairs == 0) {
        status = mhi_document_fail(&s->file, m->line, err, "measurement '%s' has no marker pairs",
                                   m->name);
    }
    return status;
}

static mhe_status read_measurements(mhi_scale_setup *s, xmlNode *scaler, mhe_error *err) {
    xmlNode *node = mhi_xml_objects(scaler, "MeasurementSet");
    mhe_status status = MHE_OK;
    s->measurements = MHI_TAKE(&s->arena, mhi_measurement, count(node));
    for (; node != NULL && status == MHE_OK && s->measurements != NULL; node = mhi_xml_next(node)) {
        if (applies(s, node)) {
            status = read_measurement(s, node, &s->measurements[s->n_measurements++], err);
        }
    }
    return status;
}

static mhe_status read_manual(mhi_scale_setup *s, xmlNode *scaler, mhe_error *err) {
    xmlNode *node = mhi_xml_objects(scaler, "ScaleSet");
    s->manual = MHI_TAKE(&s->arena, mhi_manual_scale, count(node));
    for (; node != NULL && s->manual != NULL; node = mhi_xml_next(node)) {
        mhi_manual_scale *m = &s->manual[s->n_manual];
        if (!applies(s, node)) {
            continue;
        }
        const char *body = mhi_xml_word(&s->file.o, node, "segment");
        m->line = mhi_xml_line(node);
        m->body = mhi_arena_text(&s->arena, body == NULL ? "" : body);
        if (!mhi_xml_numbers(&s->file.o, node, "scales", m->factors, 3) ||
            !(m->factors[0] > 0 && m->factors[1] > 0 && m->factors[2] > 0)) {
            return mhi_document_fail(&s->file, m->line, err,
                                     "<scales> of segment '%s' takes three numbers above 0",
                                     m->body);
        }
        s->n_manual++;
    }
    return MHE_OK;
}

static mhe_status read_order(mhi_scale_setup *s, xmlNode *scaler, mhe_error *err) {
    static const char *const known[] = {"measurements", "manualScale"};
    const char *text = mhi_xml_word(&s->file.o, scaler, "scaling_order");
    int32_t n = 0;
    while (text != NULL && *text != '\0') {
        const size_t length = strcspn(text, " \t\r\n");
        const char *found = NULL;
        for (int32_t i = 0; i < 2; i++) {
            found = strlen(known[i]) == length && strncmp(known[i], text, length) == 0 ? known[i]
                                                                                       : found;
        }
        if (found == NULL || n == 2) {
            return mhi_document_fail(&s->file, mhi_xml_line(scaler), err,
                                     "<scaling_order> takes measurements, manualScale or both, not "
                                     "'%.*s'",
                                     (int)length, text);
        }
        s->order[n++] = found;
        text += length + strspn(text + length, " \t\r\n");
    }
    return MHE_OK;
}

static mhe_status read_scaler(mhi_scale_setup *s, xmlNode *scaler, mhe_error *err) {
    s->scales = scaler != NULL && applies(s, scaler);
    if (!s->scales) {
        return MHE_OK;
    }
    s->preserve = mhi_xml_flag(&s->file.o, scaler, "preserve_mass_distribution");
    s->trial = file_of(s, scaler, "marker_file");
    (void)mhi_xml_range(&s->file.o, scaler, "time_range", s->range);
    mhe_status status = read_order(s, scaler, err);
    if (status == MHE_OK) {
        status = read_measurements(s, scaler, err);
    }
    if (status == MHE_OK) {
        status = read_manual(s, scaler, err);
    }
    for (int32_t i = 0; i < 2 && status == MHE_OK; i++) {
        if (s->order[i] != NULL && strcmp(s->order[i], "measurements") == 0 && s->trial == NULL) {
            status = mhi_document_fail(&s->file, mhi_xml_line(scaler), err,
                                       "<marker_file> of the ModelScaler is missing");
        }
    }
    return status;
}

static mhe_status read_placer(mhi_scale_setup *s, xmlNode *placer, mhe_error *err) {
    s->places = placer != NULL && applies(s, placer);
    if (!s->places) {
        return MHE_OK;
    }
    s->static_trial = file_of(s, placer, "marker_file");
    (void)mhi_xml_range(&s->file.o, placer, "time_range", s->static_range);
    if (s->static_trial == NULL) {
        return mhi_document_fail(&s->file, mhi_xml_line(placer), err,
                                 "<marker_file> of the MarkerPlacer is missing");
    }
    return mhi_ik_tasks_read(s->file.path, &s->arena, &s->tasks, &s->n_tasks, err);
}

mhe_status mhi_scale_setup_read(mhi_scale_setup *s, const char *path, mhe_error *err) {
    *s = (mhi_scale_setup){
        .mass = NAN, .range = {-INFINITY, INFINITY}, .static_range = {-INFINITY, INFINITY}};
    mhe_status status = mhi_document_open(&s->file, path, err);
    xmlNode *tool = status == MHE_OK ? mhi_xml_child(s->file.root, "ScaleTool") : NULL;
    if (status == MHE_OK && tool == NULL) {
        status = mhi_document_fail(&s->file, 1, err, "no Scale setup: there is no <ScaleTool>");
    }
    if (status != MHE_OK) {
        return status;
    }
    const char *slash = strrchr(path, '/');
    s->folder = slash == NULL ? "." : mhi_arena_text_n(&s->arena, path, (size_t)(slash - path) + 1);
    s->name = mhi_xml_name(&s->file.o, tool);
    xmlNode *maker = mhi_xml_child(tool, "GenericModelMaker");
    if (maker != NULL) {
        s->model = file_of(s, maker, "model_file");
        s->marker_set = file_of(s, maker, "marker_set_file");
    }
    if (s->model == NULL) {
        return mhi_document_fail(&s->file, mhi_xml_line(tool), err,
                                 "<GenericModelMaker> names no <model_file>");
    }
    (void)mhi_xml_numbers(&s->file.o, tool, "mass", &s->mass, 1);
    status = read_scaler(s, mhi_xml_child(tool, "ModelScaler"), err);
    if (status == MHE_OK) {
        status = read_placer(s, mhi_xml_child(tool, "MarkerPlacer"), err);
    }
    if (status == MHE_OK && !s->scales && !s->places) {
        status = mhi_document_fail(&s->file, mhi_xml_line(tool), err,
                                   "nothing to do: neither <ModelScaler> nor <MarkerPlacer> "
                                   "applies");
    }
    return status == MHE_OK && s->file.o.b.status != MHE_OK ? s->file.o.b.status
           : status == MHE_OK && s->arena.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                                 : status;
}

void mhi_scale_setup_close(mhi_scale_setup *s) {
    mhi_document_close(&s->file);
    mhi_arena_free(&s->arena);
}

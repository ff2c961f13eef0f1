/* SPDX-License-Identifier: Apache-2.0 */
/* scale.c: from a setup to the model of a person. */
#include "base/number.h"
#include "base/text.h"
#include "io/model_file.h"
#include "scale/scale_private.h"

#include <mhe/inspect.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

static mhe_status fail_memory(mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

/* Version of the file's layout, 30000 and so on. */
static int32_t version_of(mhi_document *d) {
    return (int32_t)strtol(mhi_xml_attribute(&d->o, d->root, "Version"), NULL, 10);
}

/* As a file of 4.0 says where a marker is. */
static void modernise(mhi_document *d, xmlNode *marker) {
    xmlNode *body = mhi_xml_child(marker, "body"),
            *picture = mhi_xml_child(marker, "VisibleObject");
    if (body != NULL) {
        const char *name = mhi_xml_text(&d->o, body);
        const char *path = strcmp(name, "ground") == 0
                               ? "/ground"
                               : mhi_arena_format(&d->o.b.arena, "/bodyset/%s", name);
        xmlNodeSetName(body, (const xmlChar *)"socket_parent_frame");
        xmlNodeSetContent(body, (const xmlChar *)(path == NULL ? "" : path));
    }
    if (picture != NULL) {
        xmlUnlinkNode(picture);
        xmlFreeNode(picture);
    }
}

static xmlNode *child_made(xmlNode *parent, const char *name) {
    xmlNode *node = mhi_xml_child(parent, name);
    return node != NULL ? node : xmlNewChild(parent, NULL, (const xmlChar *)name, NULL);
}

/* Markers of the set replace those of their names in the model; others are added. */
static mhe_status take_markers(mhi_scaled *m, mhe_error *err) {
    mhi_document set = {0};
    const mhi_scale_setup *s = m->setup;
    if (s->marker_set == NULL) {
        return MHE_OK;
    }
    mhe_status status = mhi_document_open(&set, s->marker_set, err);
    xmlNode *objects = child_made(child_made(m->file.o.model, "MarkerSet"), "objects");
    xmlNode *first = status == MHE_OK ? mhi_xml_objects(set.root, "MarkerSet") : NULL;
    if (status == MHE_OK && first == NULL) {
        status = mhi_document_fail(&set, 1, err, "no <MarkerSet> with markers");
    }
    for (xmlNode *n = first; n != NULL && status == MHE_OK; n = mhi_xml_next(n)) {
        xmlNode *old = mhi_xml_first(objects), *copy = xmlDocCopyNode(n, m->file.doc, 1);
        const char *name = mhi_xml_name(&set.o, n);
        while (old != NULL && strcmp(mhi_xml_name(&m->file.o, old), name) != 0) {
            old = mhi_xml_next(old);
        }
        if (copy == NULL || xmlAddChild(objects, copy) == NULL) {
            status = fail_memory(err);
        } else if (old != NULL) {
            xmlUnlinkNode(old);
            xmlFreeNode(old);
        }
        if (status == MHE_OK && version_of(&m->file) >= 40000) {
            modernise(&m->file, copy);
        }
    }
    mhi_document_close(&set);
    return status;
}

static mhe_status list_bodies(mhi_scaled *m, mhe_error *err) {
    xmlNode *const first = mhi_xml_objects(m->file.o.model, "BodySet");
    int32_t n = 0;
    for (xmlNode *node = first; node != NULL; node = mhi_xml_next(node)) {
        n++;
    }
    m->bodies = MHI_TAKE(&m->arena, const char *, n);
    m->factors = MHI_TAKE(&m->arena, double, 3 * n);
    if (m->bodies == NULL || m->factors == NULL) {
        return fail_memory(err);
    }
    for (xmlNode *node = first; node != NULL; node = mhi_xml_next(node)) {
        m->bodies[m->n_bodies++] = mhi_xml_name(&m->file.o, node);
    }
    for (int32_t i = 0; i < 3 * n; i++) {
        m->factors[i] = 1;
    }
    return MHE_OK;
}

static mhe_status open_file(mhi_scaled *m, mhe_error *err) {
    mhe_status status = mhi_document_open(&m->file, m->setup->model, err);
    if (status == MHE_OK) {
        m->file.o.model = mhi_xml_child(m->file.root, "Model");
        status = m->file.o.model == NULL
                     ? mhi_document_fail(&m->file, 1, err, "no model: there is no <Model>")
                     : take_markers(m, err);
    }
    if (status == MHE_OK) {
        mhi_osim_frames(&m->file.o);
        mhi_osim_bodies(&m->file.o); /* what sockets resolve to */
        status = m->file.o.b.status;
    }
    return status == MHE_OK ? list_bodies(m, err) : status;
}

/* The file as it is now, opened for questions. */
static mhe_status open_now(mhi_scaled *m, mhi_inspected *open, mhe_error *err) {
    xmlChar *text = NULL;
    int length = 0;
    xmlDocDumpMemory(m->file.doc, &text, &length);
    const mhe_status status =
        text == NULL ? fail_memory(err)
                     : mhi_inspected_parse(open, m->host, m->file.path, (const char *)text,
                                           (size_t)length, MHE_PATHS_EXACT, err);
    xmlFree(text);
    return status;
}

/* Lengths of all paths at the default pose; the model is closed again unless `keep`. */
static mhe_status lengths_of(mhi_scaled *m, mhi_inspected *open, double **lengths, mhe_error *err) {
    mhe_status status = open_now(m, open, err);
    if (status == MHE_OK) {
        *lengths = MHI_TAKE(&m->arena, double, open->all->n_paths);
        status = *lengths == NULL ? fail_memory(err)
                                  : mhi_scale_look(open, NULL, NULL, *lengths, NULL, err);
    }
    return status;
}

static mhe_status scale_all(mhi_scaled *m, mhe_error *err) {
    mhi_inspected before = {0}, after = {0};
    double *was = NULL, *is = NULL;
    mhe_status status = lengths_of(m, &before, &was, err);
    if (status == MHE_OK) {
        status = mhi_scale_factors(m, &before, err);
    }
    if (status == MHE_OK) {
        status = mhi_scale_change(m, err);
    }
    if (status == MHE_OK) {
        status = lengths_of(m, &after, &is, err);
    }
    if (status == MHE_OK) {
        status = mhi_scale_muscles(m, after.all, was, is, err);
    }
    mhi_inspected_close(&before);
    mhi_inspected_close(&after);
    return status;
}

static void tell(const mhi_scaled *m, mhi_text *report) {
    mhi_text_add(report, "body                               x          y          z\n");
    for (int32_t i = 0; i < m->n_bodies; i++) {
        const double *by = m->factors + 3 * i;
        mhi_text_add(report, "%-28s %10.6f %10.6f %10.6f%s\n", m->bodies[i], by[0], by[1], by[2],
                     by[0] == 1 && by[1] == 1 && by[2] == 1 ? "  (as it was)" : "");
    }
    mhi_text_add(report, "mass %.3f kg, was %.3f kg\n", m->mass_after, m->mass_before);
}

static mhe_status place_all(mhi_scaled *m, mhi_text *report, mhe_error *err) {
    mhi_inspected open = {0};
    mhe_status status = open_now(m, &open, err);
    if (status == MHE_OK) {
        status = mhi_scale_place(m, &open, report, err);
    }
    mhi_inspected_close(&open);
    return status;
}

static mhe_status save(mhi_scaled *m, const char *out, mhe_error *err) {
    return xmlSaveFormatFileEnc(out, m->file.doc, "UTF-8", 1) < 0
               ? mhe_fail(err, MHE_E_IO, "%s: cannot be written", out)
               : MHE_OK;
}

mhe_status mhe_model_scale(const mhe_host *host, const char *setup, const char *out, char **text,
                           mhe_error *err) {
    mhi_scale_setup s;
    mhi_text report = {0};
    *text = NULL;
    if (setup == NULL || out == NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT, "mhe_model_scale: a path is missing");
    }
    mhi_c_locale saved = mhi_c_locale_begin();
    mhe_status status = mhi_scale_setup_read(&s, setup, err);
    mhi_scaled m = {.host = mhi_host_or_silent(host), .setup = &s};
    if (status == MHE_OK) {
        status = open_file(&m, err);
    }
    if (status == MHE_OK && s.scales) {
        status = scale_all(&m, err);
        tell(&m, &report);
    }
    if (status == MHE_OK && s.places) {
        status = place_all(&m, &report, err);
    }
    if (status == MHE_OK && report.failed) {
        status = fail_memory(err);
    }
    if (status == MHE_OK) {
        status = save(&m, out, err);
    }
    mhi_document_close(&m.file);
    mhi_arena_free(&m.arena);
    mhi_scale_setup_close(&s);
    mhi_c_locale_end(saved);
    if (status == MHE_OK) {
        *text = report.data;
    } else {
        mhi_text_free(&report);
    }
    return status;
}

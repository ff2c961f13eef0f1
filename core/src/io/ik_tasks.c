/* SPDX-License-Identifier: Apache-2.0 */
#include "io/ik_tasks.h"

#include "io/osim.h"
#include "io/slurp.h"

#include <libxml/parser.h>
#include <stdlib.h>
#include <string.h>

typedef struct reader {
    mhi_osim o; /* for the values of elements; its arena ends with the reading */
    const char *path;
    mhi_arena *out;
    mhi_ik_task *tasks;
    int32_t n;
    mhe_error *err;
} reader;

static xmlNode *find_set(xmlNode *node) {
    xmlNode *found = node != NULL && mhi_xml_is(node, "IKTaskSet") ? node : NULL;
    for (xmlNode *child = mhi_xml_first(node); child != NULL && found == NULL;
         child = mhi_xml_next(child)) {
        found = find_set(child);
    }
    return found;
}

/* What a coordinate is to be close to; OpenSim's words, of which `default_value` goes without. */
static int32_t kind_of(const char *text) {
    return text == NULL || strcmp(text, "default_value") == 0 ? MHI_IK_DEFAULT
           : strcmp(text, "manual_value") == 0                ? MHI_IK_VALUE
                                                              : MHI_IK_FILE;
}

static mhe_status read_task(reader *r, xmlNode *node) {
    mhi_ik_task *task = &r->tasks[r->n];
    const int32_t of_marker = mhi_xml_is(node, "IKMarkerTask");
    *task = (mhi_ik_task){.name = mhi_arena_text(r->out, mhi_xml_name(&r->o, node)),
                          .kind = of_marker ? MHI_IK_MARKER
                                            : kind_of(mhi_xml_word(&r->o, node, "value_type"))};
    (void)mhi_xml_numbers(&r->o, node, "weight", &task->weight, 1); /* absent: 0, as in OpenSim */
    (void)mhi_xml_numbers(&r->o, node, "value", &task->value, 1);
    if (task->weight < 0) {
        return mhe_fail(r->err, MHE_E_INPUT, "%s:%d: the weight of '%s' is negative, %g", r->path,
                        (int)mhi_xml_line(node), task->name, task->weight);
    }
    if (mhi_xml_stated_flag(&r->o, node, "apply") == 0) {
        task->weight = 0;
    }
    r->n++;
    return task->name == NULL        ? mhe_fail(r->err, MHE_E_MEMORY, "out of memory")
           : r->o.b.status != MHE_OK ? r->o.b.status
                                     : MHE_OK;
}

static mhe_status read_set(reader *r, xmlNode *root) {
    xmlNode *set = find_set(root), *first = mhi_xml_first(mhi_xml_child(set, "objects"));
    int32_t n = 0;
    for (xmlNode *node = first; node != NULL; node = mhi_xml_next(node)) {
        n++;
    }
    if (n == 0) {
        return mhe_fail(r->err, MHE_E_INPUT, "%s:%d: no <IKTaskSet> with tasks", r->path,
                        root != NULL ? (int)mhi_xml_line(root) : 1);
    }
    r->tasks = MHI_TAKE(r->out, mhi_ik_task, n);
    mhe_status status = r->tasks == NULL ? mhe_fail(r->err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    for (xmlNode *node = first; node != NULL && status == MHE_OK; node = mhi_xml_next(node)) {
        if (mhi_xml_is(node, "IKMarkerTask") || mhi_xml_is(node, "IKCoordinateTask")) {
            status = read_task(r, node);
        }
    }
    return status;
}

mhe_status mhi_ik_tasks_read(const char *path, mhi_arena *arena, mhi_ik_task **tasks, int32_t *n,
                             mhe_error *err) {
    char *text = NULL;
    size_t length = 0;
    mhe_error unused = {0};
    reader r = {.path = path, .out = arena, .err = err != NULL ? err : &unused};
    mhe_status status = mhi_slurp(path, &text, &length, r.err);
    if (status != MHE_OK) {
        return status;
    }
    mhi_build_start(&r.o.b, path, r.err);
    xmlDoc *document =
        length > INT32_MAX
            ? NULL
            : xmlReadMemory(text, (int)length, NULL, NULL,
                            XML_PARSE_NONET | XML_PARSE_NOERROR | XML_PARSE_NOWARNING);
    if (document == NULL) {
        const xmlError *why = xmlGetLastError();
        status = mhe_fail(r.err, MHE_E_INPUT, "%s:%d: not XML", path, why != NULL ? why->line : 1);
    } else {
        status = read_set(&r, xmlDocGetRootElement(document));
        xmlFreeDoc(document);
    }
    mhi_arena_free(&r.o.b.arena);
    free(text);
    *tasks = r.tasks;
    *n = r.n;
    return status;
}

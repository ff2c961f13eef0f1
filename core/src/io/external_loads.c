/* SPDX-License-Identifier: Apache-2.0 */
#include "io/external_loads.h"

#include "base/text.h"
#include "io/osim.h"
#include "io/slurp.h"
#include "io/table.h"

#include <libxml/parser.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PARTS 3 /* force, point, torque */

/* First: its address is that of the whole. */
typedef struct owned_loads {
    mhe_external_loads face;
    mhi_arena arena;
} owned_loads;

typedef struct reader {
    mhi_osim o; /* for the values of elements; its arena ends with the reading */
    const char *path;
    const mhe_description *d;
    owned_loads *out;
    mhi_table *table;
    mhe_load *loads;
    const char **names;
    int32_t *columns; /* [n_loads x 9] of the table; -1: not stated, 0 */
    int32_t n;
    mhe_error *err;
} reader;

static mhe_status no_memory(const reader *r) {
    return mhe_fail(r->err, MHE_E_MEMORY, "out of memory");
}

/* Text of a child element; "" where it is absent or says so. */
static const char *word(reader *r, xmlNode *object, const char *name) {
    const char *text = mhi_xml_text(&r->o, mhi_xml_child(object, name));
    return strcmp(text, "Unassigned") == 0 || strcmp(text, "unassigned") == 0 ? "" : text;
}

static mhe_status find_body(reader *r, xmlNode *force, const char *key, int32_t *body) {
    const char *name = word(r, force, key), *slash = strrchr(name, '/');
    xmlNode *node = mhi_xml_child(force, key);
    name = slash != NULL ? slash + 1 : name;
    *body = -1;
    if (name[0] == '\0' || strcmp(name, "ground") == 0) {
        return MHE_OK;
    }
    const char **names = MHI_TAKE(&r->o.b.arena, const char *, r->d->n_bodies);
    if (names == NULL) {
        return no_memory(r);
    }
    for (int32_t i = 0; i < r->d->n_bodies; i++) {
        names[i] = r->d->bodies[i].name;
        if (strcmp(names[i], name) == 0) {
            *body = i;
            return MHE_OK;
        }
    }
    char hint[256];
    return mhe_fail(r->err, MHE_E_INPUT, "%s:%d: %s: the model has no body '%s'%s", r->path,
                    (int)mhi_xml_line(node), key, name,
                    mhi_suggest(hint, sizeof hint, name, names, r->d->n_bodies));
}

/* The three columns "<identifier>x", y, z, or else the three that begin with it. */
static mhe_status find_columns(reader *r, xmlNode *force, const char *key, int32_t *columns) {
    const char *identifier = word(r, force, key);
    const size_t length = strlen(identifier);
    int32_t exact = 0, n = 0, beginning[3];
    for (int32_t k = 0; k < 3; k++) {
        columns[k] = -1;
    }
    if (length == 0) {
        return MHE_OK;
    }
    for (int32_t i = 0; i < r->table->n_columns; i++) {
        const char *label = r->table->labels[i], *rest = label + length;
        if (strncmp(label, identifier, length) != 0) {
            continue;
        }
        if (n < 3) {
            beginning[n] = i;
        }
        n++;
        if (rest[0] >= 'x' && rest[0] <= 'z' && rest[1] == '\0') {
            columns[rest[0] - 'x'] = i;
            exact++;
        }
    }
    if (exact != 3 && n == 3) {
        memcpy(columns, beginning, sizeof beginning);
        return MHE_OK;
    }
    for (int32_t k = 0; k < 3; k++) {
        if (columns[k] < 0) {
            return mhe_fail(r->err, MHE_E_INPUT, "%s:%d: %s: %s has no column '%s%c'", r->path,
                            (int)mhi_xml_line(mhi_xml_child(force, key)), key, r->table->path,
                            identifier, (int)("xyz"[k]));
        }
    }
    return MHE_OK;
}

static int32_t is_off(reader *r, xmlNode *force) {
    const char *disabled = word(r, force, "isDisabled"), *applies = word(r, force, "appliesForce");
    return strcmp(disabled, "true") == 0 || strcmp(applies, "false") == 0;
}

static mhe_status read_force(reader *r, xmlNode *force) {
    static const char *const identifiers[PARTS] = {"force_identifier", "point_identifier",
                                                   "torque_identifier"};
    mhe_load *load = &r->loads[r->n];
    int32_t *columns = r->columns + 9 * r->n;
    mhe_status status = find_body(r, force, "applied_to_body", &load->body);
    if (status == MHE_OK && load->body < 0) {
        return mhe_fail(r->err, MHE_E_INPUT, "%s:%d: applied_to_body: a body is needed, not ground",
                        r->path, (int)mhi_xml_line(force));
    }
    if (status == MHE_OK) {
        status = find_body(r, force, "force_expressed_in_body", &load->axes);
    }
    if (status == MHE_OK) {
        status = find_body(r, force, "point_expressed_in_body", &load->origin);
    }
    for (int32_t k = 0; k < PARTS && status == MHE_OK; k++) {
        status = find_columns(r, force, identifiers[k], columns + 3 * k);
    }
    if (status == MHE_OK && columns[0] < 0 && columns[6] < 0) {
        return mhe_fail(r->err, MHE_E_INPUT,
                        "%s:%d: neither force_identifier nor torque_identifier is stated", r->path,
                        (int)mhi_xml_line(force));
    }
    if (columns[3] < 0) { /* no point: the body's origin */
        load->origin = load->body;
    }
    const char *name = mhi_xml_name(&r->o, force);
    r->names[r->n] = mhi_arena_text(&r->out->arena, name[0] != '\0' ? name : "load");
    r->n++;
    return status == MHE_OK && r->names[r->n - 1] == NULL ? no_memory(r) : status;
}

/* The table that <datafile> or the first <data_source_name> names, beside the .xml. */
static mhe_status read_table(reader *r, xmlNode *loads, xmlNode *first) {
    const char *name = word(r, loads, "datafile");
    if (name[0] == '\0' && first != NULL) {
        name = word(r, first, "data_source_name");
    }
    if (name[0] == '\0') {
        return mhe_fail(r->err, MHE_E_INPUT, "%s:%d: no <datafile> with the loads' columns",
                        r->path, (int)mhi_xml_line(loads));
    }
    const char *slash = strrchr(r->path, '/');
    const int folder = name[0] == '/' || slash == NULL ? 0 : (int)(slash - r->path + 1);
    const char *path = mhi_arena_format(&r->o.b.arena, "%.*s%s", folder, r->path, name);
    return path == NULL ? no_memory(r) : mhi_sto_read(path, &r->table, r->err);
}

static mhe_status take_values(reader *r) {
    const mhi_table *t = r->table;
    double *time = MHI_TAKE(&r->out->arena, double, t->n_rows);
    double *values = MHI_TAKE(&r->out->arena, double, (ptrdiff_t)t->n_rows * 9 * r->n);
    if (time == NULL || values == NULL) {
        return no_memory(r);
    }
    for (int32_t k = 0; k < t->n_rows; k++) {
        time[k] = t->time[k];
        for (int32_t i = 0; i < 9 * r->n; i++) {
            const int32_t column = r->columns[i];
            const double value = column < 0 ? 0 : t->values[(ptrdiff_t)k * t->n_columns + column];
            values[(ptrdiff_t)k * 9 * r->n + i] = value;
            if (!isfinite(value)) {
                return mhe_fail(r->err, MHE_E_INPUT, "%s:%d: column '%s' has no value at %g s",
                                t->path, (int)(t->line + k), t->labels[column], t->time[k]);
            }
        }
    }
    r->out->face = (mhe_external_loads){.size = sizeof r->out->face,
                                        .n_loads = r->n,
                                        .n_rows = t->n_rows,
                                        .names = r->names,
                                        .loads = r->loads,
                                        .time = time,
                                        .values = values};
    return MHE_OK;
}

static mhe_status read_loads(reader *r, xmlNode *loads) {
    xmlNode *objects = mhi_xml_child(loads, "objects"), *first = mhi_xml_first(objects);
    int32_t n = 0;
    for (xmlNode *node = first; node != NULL; node = mhi_xml_next(node)) {
        n++;
    }
    r->loads = MHI_TAKE(&r->out->arena, mhe_load, n);
    r->names = MHI_TAKE(&r->out->arena, const char *, n);
    r->columns = MHI_TAKE(&r->o.b.arena, int32_t, 9 * n);
    if (!r->loads || !r->names || !r->columns) {
        return no_memory(r);
    }
    mhe_status status = read_table(r, loads, first);
    for (xmlNode *node = first; node != NULL && status == MHE_OK; node = mhi_xml_next(node)) {
        if (mhi_xml_is(node, "ExternalForce") && !is_off(r, node)) {
            status = read_force(r, node);
        }
    }
    if (status == MHE_OK && r->n == 0) {
        return mhe_fail(r->err, MHE_E_INPUT, "%s:%d: no <ExternalForce> that is on", r->path,
                        (int)mhi_xml_line(loads));
    }
    return status == MHE_OK ? take_values(r) : status;
}

static mhe_status read_text(reader *r, const char *text, size_t length) {
    if (length > INT32_MAX) {
        return mhe_fail(r->err, MHE_E_INPUT, "%s: too large", r->path);
    }
    xmlDoc *document = xmlReadMemory(text, (int)length, NULL, NULL,
                                     XML_PARSE_NONET | XML_PARSE_NOERROR | XML_PARSE_NOWARNING);
    if (document == NULL) {
        const xmlError *why = xmlGetLastError();
        return mhe_fail(r->err, MHE_E_INPUT, "%s:%d: not XML", r->path,
                        why != NULL ? why->line : 1);
    }
    xmlNode *root = xmlDocGetRootElement(document);
    xmlNode *loads = root != NULL && mhi_xml_is(root, "ExternalLoads")
                         ? root
                         : mhi_xml_child(root, "ExternalLoads");
    const mhe_status status = loads == NULL
                                  ? mhe_fail(r->err, MHE_E_INPUT, "%s:%d: no <ExternalLoads>",
                                             r->path, root != NULL ? (int)mhi_xml_line(root) : 1)
                                  : read_loads(r, loads);
    xmlFreeDoc(document);
    return status;
}

static void free_loads(const mhe_external_loads *loads) {
    if (loads != NULL) {
        owned_loads *owned = (owned_loads *)(uintptr_t)loads;
        mhi_arena_free(&owned->arena);
        free(owned);
    }
}

static mhe_status read_file(const char *path, const mhe_description *description,
                            const mhe_external_loads **loads, mhe_error *err) {
    char *text = NULL;
    size_t length = 0;
    mhe_error unused = {0};
    *loads = NULL;
    reader r = {.path = path, .d = description, .err = err != NULL ? err : &unused};
    mhe_status status = mhi_slurp(path, &text, &length, r.err);
    if (status != MHE_OK) {
        return status;
    }
    mhi_build_start(&r.o.b, path, r.err);
    r.out = calloc(1, sizeof *r.out);
    status = r.out == NULL ? no_memory(&r) : read_text(&r, text, length);
    mhi_table_free(r.table);
    mhi_arena_free(&r.o.b.arena);
    free(text);
    if (status != MHE_OK) {
        free_loads(&r.out->face);
        return status;
    }
    *loads = &r.out->face;
    return MHE_OK;
}

const mhe_external_loads_service mhi_external_loads = {
    .size = sizeof mhi_external_loads, .read = read_file, .free = free_loads};

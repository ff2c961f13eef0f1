/* SPDX-License-Identifier: Apache-2.0 */
/* xdf_header.c: what an .xdf file says of a stream, in XML. */
#include "base/number.h"
#include "io/xdf_private.h"

#include <libxml/parser.h>
#include <libxml/tree.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define MOST_CHANNELS 4096
#define MOST_STREAMS 1024

static xmlNode *child(const xmlNode *parent, const char *name) {
    xmlNode *node = parent == NULL ? NULL : parent->children;
    while (node != NULL && xmlStrcmp(node->name, (const xmlChar *)name) != 0) {
        node = node->next;
    }
    return node;
}

/* Text of a child, "" where there is none; NULL: no memory. */
static char *text_of(const xmlNode *parent, const char *name) {
    const xmlNode *node = child(parent, name);
    xmlChar *content = node == NULL ? NULL : xmlNodeGetContent(node);
    char *text = strdup(content == NULL ? "" : (const char *)content);
    xmlFree(content);
    for (char *c = text; c != NULL && *c != '\0'; c++) {
        if ((unsigned char)*c < ' ') {
            *c = ' ';
        }
    }
    return text;
}

static double number_of(const xmlNode *parent, const char *name) {
    char *text = text_of(parent, name);
    double value = NAN;
    if (text != NULL) {
        const mhi_c_locale locale = mhi_c_locale_begin();
        const mhi_cell cell = {text, strlen(text)};
        if (!mhi_number(cell, &value)) {
            value = NAN;
        }
        mhi_c_locale_end(locale);
    }
    free(text);
    return value;
}

static int32_t format_of(const char *text) {
    static const char *const names[] = {"float32", "double64", "int8",  "int16",
                                        "int32",   "int64",    "string"};
    for (int32_t i = 0; i <= MHI_XDF_STRING; i++) {
        if (strcasecmp(text, names[i]) == 0) {
            return i;
        }
    }
    return -1;
}

static mhe_status read_channels(mhi_xdf_stream *s, const xmlNode *info, mhe_error *err) {
    const xmlNode *list = child(child(info, "desc"), "channels");
    const xmlNode *node = list == NULL ? NULL : list->children;
    s->channels = calloc((size_t)s->n_channels + 1, sizeof *s->channels);
    if (s->channels == NULL) {
        return mhi_xdf_no_memory(err);
    }
    for (int32_t i = 0; i < s->n_channels; i++) {
        while (node != NULL && xmlStrcmp(node->name, (const xmlChar *)"channel") != 0) {
            node = node->next;
        }
        mhi_xdf_channel *c = &s->channels[i];
        *c = (mhi_xdf_channel){text_of(node, "label"), text_of(node, "unit"), text_of(node, "type"),
                               text_of(node, "marker"), number_of(node, "named") == 1};
        if (c->label == NULL || c->unit == NULL || c->type == NULL || c->marker == NULL) {
            return mhi_xdf_no_memory(err);
        }
        node = node == NULL ? NULL : node->next;
    }
    return MHE_OK;
}

static mhe_status read_info(const mhi_xdf_reader *r, mhi_xdf_stream *s, const xmlNode *info) {
    char *format = text_of(info, "channel_format");
    const double count = number_of(info, "channel_count");
    s->name = text_of(info, "name");
    s->type = text_of(info, "type");
    s->source_id = text_of(info, "source_id");
    s->format = format == NULL ? -1 : format_of(format);
    free(format);
    if (s->name == NULL || s->type == NULL || s->source_id == NULL) {
        return mhi_xdf_no_memory(r->err);
    }
    if (s->format < 0) {
        return mhi_xdf_wrong(r, "a stream header without a known channel_format");
    }
    if (!(count >= 0 && count <= MOST_CHANNELS) || count != floor(count)) {
        return mhi_xdf_wrong(r, "a stream header without a sensible channel_count");
    }
    s->n_channels = (int32_t)count;
    s->rate = number_of(info, "nominal_srate");
    s->rate = s->rate > 0 && s->rate < 1e7 ? s->rate : 0;
    return read_channels(s, info, r->err);
}

mhe_status mhi_xdf_header(const mhi_xdf_reader *r, mhi_xdf_cursor c) {
    uint64_t id;
    mhi_xdf *xdf = r->xdf;
    if (!mhi_xdf_integer(&c, 4, &id) || mhi_xdf_left(&c) > INT32_MAX) {
        return mhi_xdf_wrong(r, "a stream header is cut short");
    }
    if (mhi_xdf_find(xdf, id) != NULL || xdf->n_streams == MOST_STREAMS) {
        return mhi_xdf_wrong(
            r, "a stream's header is there twice, or there are over a thousand streams");
    }
    mhi_xdf_stream *grown = realloc(xdf->streams, sizeof *grown * (size_t)(xdf->n_streams + 1));
    if (grown == NULL) {
        return mhi_xdf_no_memory(r->err);
    }
    xdf->streams = grown;
    mhi_xdf_stream *s = &grown[xdf->n_streams++];
    *s = (mhi_xdf_stream){.id = (uint32_t)id};
    xmlDoc *doc = xmlReadMemory((const char *)c.at, (int)mhi_xdf_left(&c), "stream header", NULL,
                                XML_PARSE_NONET | XML_PARSE_NOERROR | XML_PARSE_NOWARNING);
    const xmlNode *info = doc == NULL ? NULL : xmlDocGetRootElement(doc);
    const mhe_status status =
        info == NULL ? mhi_xdf_wrong(r, "a stream header is no valid XML") : read_info(r, s, info);
    xmlFreeDoc(doc);
    return status;
}

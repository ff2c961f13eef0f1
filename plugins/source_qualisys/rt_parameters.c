/* SPDX-License-Identifier: Apache-2.0 */
/* rt_parameters.c: the XML that describes markers and analog devices. */
#include "rt.h"

#include <ctype.h>
#include <libxml/parser.h>
#include <libxml/tree.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOST 4096 /* markers, devices, channels */

static xmlNode *next_named(xmlNode *node, const char *name) {
    while (node != NULL && xmlStrcasecmp(node->name, (const xmlChar *)name) != 0) {
        node = node->next;
    }
    return node;
}

static xmlNode *child(const xmlNode *parent, const char *name) {
    return parent == NULL ? NULL : next_named(parent->children, name);
}

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

/* Digits with a point, whatever the locale: rates are written so. */
static double number_of(const xmlNode *parent, const char *name) {
    char *text = text_of(parent, name);
    double value = 0, place = 1;
    int seen_point = 0;
    for (const char *c = text; c != NULL && (isdigit((unsigned char)*c) || *c == '.'); c++) {
        if (*c == '.') {
            seen_point = 1;
        } else if (seen_point) {
            place *= 0.1;
            value += place * (*c - '0');
        } else {
            value = 10 * value + (*c - '0');
        }
    }
    free(text);
    return value < 1e9 ? value : 0;
}

static int32_t count_named(const xmlNode *parent, const char *name) {
    int32_t n = 0;
    for (xmlNode *node = child(parent, name); node != NULL && n < MOST;
         node = next_named(node->next, name)) {
        n++;
    }
    return n;
}

static mhe_status read_markers(const xmlNode *root, rt_parameters *out) {
    const xmlNode *section = child(root, "The_3D");
    char *axis = text_of(section, "AxisUpwards");
    if (axis != NULL && axis[0] != '\0') { /* "+Z", "Z", "-Y" */
        const char *letter = strpbrk(axis, "XYZxyz");
        out->up =
            letter == NULL ? -1 : (int32_t)(strchr("xyz", tolower((unsigned char)*letter)) - "xyz");
    }
    free(axis);
    const int32_t n = count_named(section, "Label");
    out->markers = calloc((size_t)n + 1, sizeof *out->markers);
    if (out->markers == NULL) {
        return MHE_E_MEMORY;
    }
    for (xmlNode *label = child(section, "Label"); label != NULL && out->n_markers < n;
         label = next_named(label->next, "Label")) {
        out->markers[out->n_markers] = text_of(label, "Name");
        if (out->markers[out->n_markers++] == NULL) {
            return MHE_E_MEMORY;
        }
    }
    return MHE_OK;
}

static mhe_status read_device(const xmlNode *node, rt_analog_device *d) {
    const int32_t listed = count_named(node, "Channel");
    const double said = number_of(node, "Channels");
    d->id = (int32_t)number_of(node, "Device_ID");
    d->rate = number_of(node, "Frequency");
    d->name = text_of(node, "Device_Name");
    const int32_t n = listed > 0 ? listed : said <= MOST ? (int32_t)said : 0;
    d->labels = calloc((size_t)n + 1, sizeof *d->labels);
    d->units = calloc((size_t)n + 1, sizeof *d->units);
    if (d->name == NULL || d->labels == NULL || d->units == NULL) {
        return MHE_E_MEMORY;
    }
    const xmlNode *channel = child(node, "Channel");
    for (int32_t i = 0; i < n; i++) {
        char *label = text_of(channel, "Label");
        if (label != NULL && label[0] == '\0') {
            free(label);
            label = malloc(32);
            if (label != NULL) {
                (void)snprintf(label, 32, "channel_%d", (int)i + 1);
            }
        }
        d->labels[i] = label;
        d->units[i] = text_of(channel, "Unit");
        d->n_channels = i + 1;
        if (d->labels[i] == NULL || d->units[i] == NULL) {
            return MHE_E_MEMORY;
        }
        channel = channel == NULL ? NULL : next_named(channel->next, "Channel");
    }
    return MHE_OK;
}

static mhe_status read_devices(const xmlNode *root, rt_parameters *out) {
    const xmlNode *section = child(root, "Analog");
    const int32_t n = count_named(section, "Device");
    out->devices = calloc((size_t)n + 1, sizeof *out->devices);
    mhe_status status = out->devices == NULL ? MHE_E_MEMORY : MHE_OK;
    for (xmlNode *node = child(section, "Device");
         node != NULL && out->n_devices < n && status == MHE_OK;
         node = next_named(node->next, "Device")) {
        status = read_device(node, &out->devices[out->n_devices++]);
    }
    return status;
}

mhe_status rt_parse_parameters(const char *xml, size_t length, rt_parameters *out, mhe_error *err) {
    *out = (rt_parameters){.up = -1};
    while (length > 0 && xml[length - 1] == '\0') {
        length--; /* texts end with one */
    }
    xmlDoc *doc = length > INT32_MAX
                      ? NULL
                      : xmlReadMemory(xml, (int)length, "parameters", NULL,
                                      XML_PARSE_NONET | XML_PARSE_NOERROR | XML_PARSE_NOWARNING);
    const xmlNode *root = doc == NULL ? NULL : xmlDocGetRootElement(doc);
    if (root == NULL) {
        xmlFreeDoc(doc);
        return mhe_fail(err, MHE_E_INPUT, "the server's parameters are no valid XML");
    }
    out->frequency = number_of(child(root, "General"), "Frequency");
    mhe_status status = read_markers(root, out);
    if (status == MHE_OK) {
        status = read_devices(root, out);
    }
    xmlFreeDoc(doc);
    if (status != MHE_OK) {
        rt_free_parameters(out);
        return mhe_fail(err, status, "out of memory");
    }
    return MHE_OK;
}

void rt_free_parameters(rt_parameters *p) {
    for (int32_t i = 0; i < p->n_markers; i++) {
        free(p->markers[i]);
    }
    for (int32_t i = 0; i < p->n_devices; i++) {
        rt_analog_device *d = &p->devices[i];
        for (int32_t k = 0; k < d->n_channels; k++) {
            free(d->labels[k]);
            free(d->units[k]);
        }
        free(d->labels);
        free(d->units);
        free(d->name);
    }
    free(p->markers);
    free(p->devices);
    *p = (rt_parameters){.up = -1};
}

/* SPDX-License-Identifier: Apache-2.0 */
/* function.c: functions of the model file, multiplied. */
#include "scale/scale_private.h"

#include <stdio.h>
#include <string.h>

xmlNode *mhi_scale_find_function(mhi_document *d, xmlNode *holder) {
    static const char *const others[] = {"coordinates", "coordinate", "axis",
                                         "function",    "location",   "scale"};
    xmlNode *found = mhi_xml_first(mhi_xml_child(holder, "function"));
    for (xmlNode *n = mhi_xml_first(holder); n != NULL && found == NULL; n = mhi_xml_next(n)) {
        found = mhi_xml_one_of(n, others, sizeof others / sizeof *others) ? NULL : n;
    }
    (void)d;
    return found;
}

/* Multiplies the number that a MultiplierFunction has. */
static int32_t multiply_again(mhi_document *d, xmlNode *function, double factor) {
    double scale = 1;
    xmlNode *node = mhi_xml_child(function, "scale");
    (void)mhi_xml_numbers(&d->o, function, "scale", &scale, 1);
    scale *= factor;
    if (node == NULL) {
        node = xmlNewChild(function, NULL, (const xmlChar *)"scale", NULL);
    }
    if (node != NULL) {
        mhi_scale_write(node, &scale, 1);
    }
    return node != NULL;
}

int32_t mhi_scale_function(mhi_document *d, xmlNode *function, double factor) {
    if (mhi_xml_is(function, "MultiplierFunction")) {
        return multiply_again(d, function, factor);
    }
    xmlNode *outer = xmlNewNode(NULL, (const xmlChar *)"MultiplierFunction");
    xmlNode *within =
        outer == NULL ? NULL : xmlNewChild(outer, NULL, (const xmlChar *)"function", NULL);
    xmlNode *scale =
        within == NULL ? NULL : xmlNewChild(outer, NULL, (const xmlChar *)"scale", NULL);
    if (scale == NULL) {
        xmlFreeNode(outer);
        return 0;
    }
    mhi_scale_write(scale, &factor, 1);
    /* In the place of a property the name says which: it stays outside. */
    xmlChar *name = xmlGetProp(function, (const xmlChar *)"name");
    if (name != NULL) {
        (void)xmlNewProp(outer, (const xmlChar *)"name", name);
        (void)xmlUnsetProp(function, (const xmlChar *)"name");
        xmlFree(name);
    }
    (void)xmlReplaceNode(function, outer);
    (void)xmlAddChild(within, function);
    return 1;
}

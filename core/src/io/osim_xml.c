/* SPDX-License-Identifier: Apache-2.0 */
#include "base/number.h"
#include "io/osim.h"

#include <ctype.h>
#include <math.h>
#include <string.h>

static xmlNode *element(xmlNode *node) {
    while (node != NULL && node->type != XML_ELEMENT_NODE) {
        node = node->next;
    }
    return node;
}

xmlNode *mhi_xml_first(xmlNode *parent) {
    return parent == NULL ? NULL : element(parent->children);
}

xmlNode *mhi_xml_next(xmlNode *node) {
    return element(node->next);
}

int32_t mhi_xml_is(const xmlNode *node, const char *name) {
    return strcmp((const char *)node->name, name) == 0;
}

xmlNode *mhi_xml_child(xmlNode *parent, const char *name) {
    xmlNode *node = mhi_xml_first(parent);
    while (node != NULL && !mhi_xml_is(node, name)) {
        node = mhi_xml_next(node);
    }
    return node;
}

int32_t mhi_xml_line(const xmlNode *node) {
    return (int32_t)xmlGetLineNo(node);
}

xmlNode *mhi_xml_property(xmlNode *object, const char *name) {
    xmlNode *found = mhi_xml_child(object, name);
    for (xmlNode *around = object->parent; found == NULL && around != NULL;
         around = around->parent) {
        if (around->type == XML_ELEMENT_NODE && !mhi_xml_is(around, "defaults")) {
            xmlNode *defaults = mhi_xml_child(around, "defaults");
            found = mhi_xml_child(mhi_xml_child(defaults, (const char *)object->name), name);
        }
    }
    return found;
}

/* Value of an attribute; "" where it is absent. */
const char *mhi_xml_attribute(mhi_osim *o, const xmlNode *node, const char *name) {
    for (const xmlAttr *a = node->properties; a != NULL; a = a->next) {
        if (strcmp((const char *)a->name, name) == 0 && a->children != NULL &&
            a->children->type == XML_TEXT_NODE) {
            const char *copy = mhi_arena_text(&o->b.arena, (const char *)a->children->content);
            return copy != NULL ? copy : "";
        }
    }
    return "";
}

const char *mhi_xml_name(mhi_osim *o, const xmlNode *node) {
    return mhi_xml_attribute(o, node, "name");
}

const char *mhi_xml_text(mhi_osim *o, const xmlNode *node) {
    /* the first non-blank piece: comments may stand around a value, never inside it */
    for (const xmlNode *c = node != NULL ? node->children : NULL; c != NULL; c = c->next) {
        if ((c->type != XML_TEXT_NODE && c->type != XML_CDATA_SECTION_NODE) || c->content == NULL) {
            continue;
        }
        const char *text = (const char *)c->content;
        while (isspace((unsigned char)*text)) {
            text++;
        }
        size_t length = strlen(text);
        while (length > 0 && isspace((unsigned char)text[length - 1])) {
            length--;
        }
        if (length > 0) {
            const char *copy = mhi_arena_text_n(&o->b.arena, text, length);
            return copy != NULL ? copy : "";
        }
    }
    return "";
}

const char *mhi_xml_word(mhi_osim *o, xmlNode *object, const char *name) {
    const char *text = mhi_xml_text(o, mhi_xml_property(object, name));
    return *text != '\0' ? text : NULL;
}

double *mhi_xml_all_numbers(mhi_osim *o, const xmlNode *node, int32_t *count) {
    const char *text = mhi_xml_text(o, node);
    *count = 0;
    double *numbers = MHI_TAKE(&o->b.arena, double, strlen(text) / 2 + 1);
    while (numbers != NULL && *text != '\0') {
        mhi_cell cell = {text, strcspn(text, " \t\r\n,()")};
        if (cell.length == 0) {
            text++;
            continue;
        }
        if (!mhi_number(cell, &numbers[*count])) {
            mhi_build_fail(&o->b, mhi_xml_line(node), "<%s>: '%.*s' is no finite number",
                           (const char *)node->name, (int)cell.length, cell.text);
            *count = 0;
            return NULL;
        }
        (*count)++;
        text += cell.length;
    }
    return numbers;
}

int32_t mhi_xml_numbers(mhi_osim *o, xmlNode *object, const char *name, double *out, int32_t n) {
    xmlNode *node = mhi_xml_property(object, name);
    int32_t count = 0;
    if (node == NULL || *mhi_xml_text(o, node) == '\0') {
        return 0;
    }
    const double *numbers = mhi_xml_all_numbers(o, node, &count);
    if (numbers == NULL || count != n) {
        mhi_build_fail(&o->b, mhi_xml_line(node), "<%s> holds %d numbers; it takes %d", name,
                       (int)count, (int)n);
        return 0;
    }
    memcpy(out, numbers, sizeof *out * (size_t)n);
    return 1;
}

/* A bound: a number or an infinity. */
static int32_t read_bound(const char *text, size_t length, double *out) {
    char word[16];
    const char *plain = *text == '+' || *text == '-' ? text + 1 : text;
    size_t rest = length - (size_t)(plain - text);
    if (rest < sizeof word) {
        memcpy(word, plain, rest);
        word[rest] = '\0';
        if (mhi_same_word(word, "inf") || mhi_same_word(word, "infinity")) {
            *out = *text == '-' ? -INFINITY : INFINITY;
            return 1;
        }
    }
    return mhi_number((mhi_cell){text, length}, out);
}

static int32_t read_bounds(mhi_osim *o, xmlNode *object, const char *name, double *out,
                           int32_t wanted) {
    xmlNode *node = mhi_xml_property(object, name);
    const char *text = mhi_xml_text(o, node);
    double bounds[2];
    int32_t n = 0, ok = 1;
    if (*text == '\0') {
        return 0;
    }
    while (*text != '\0' && ok) {
        size_t length = strcspn(text, " \t\r\n,()");
        ok = length == 0 || (n < wanted && read_bound(text, length, &bounds[n]));
        n += length > 0;
        text += length > 0 ? length : 1;
    }
    if (!ok || n != wanted) {
        mhi_build_fail(&o->b, mhi_xml_line(node), "<%s> takes %d number%s, not '%s'", name,
                       (int)wanted, wanted == 1 ? "" : "s", mhi_xml_text(o, node));
        return 0;
    }
    memcpy(out, bounds, sizeof *out * (size_t)wanted);
    return 1;
}

int32_t mhi_xml_range(mhi_osim *o, xmlNode *object, const char *name, double out[2]) {
    return read_bounds(o, object, name, out, 2);
}

int32_t mhi_xml_bound(mhi_osim *o, xmlNode *object, const char *name, double *out) {
    return read_bounds(o, object, name, out, 1);
}

int32_t mhi_xml_stated_flag(mhi_osim *o, xmlNode *object, const char *name) {
    const char *text = mhi_xml_word(o, object, name);
    if (text == NULL) {
        return -1;
    }
    const int32_t yes = mhi_same_word(text, "true") || strcmp(text, "1") == 0;
    if (!yes && !mhi_same_word(text, "false") && strcmp(text, "0") != 0) {
        mhi_build_fail(&o->b, mhi_xml_line(mhi_xml_property(object, name)),
                       "<%s> can be true or false, not '%s'", name, text);
    }
    return yes;
}

int32_t mhi_xml_flag(mhi_osim *o, xmlNode *object, const char *name) {
    return mhi_xml_stated_flag(o, object, name) == 1;
}

int32_t mhi_xml_enabled(mhi_osim *o, xmlNode *object) {
    return !mhi_xml_flag(o, object, "isDisabled") &&
           mhi_xml_stated_flag(o, object, "appliesForce") != 0 &&
           mhi_xml_stated_flag(o, object, "isEnforced") != 0 &&
           mhi_xml_stated_flag(o, object, "enabled") != 0;
}

int32_t mhi_xml_one_of(const xmlNode *node, const char *const *names, size_t n) {
    for (size_t i = 0; i < n; i++) {
        if (mhi_xml_is(node, names[i])) {
            return 1;
        }
    }
    return 0;
}

int32_t mhi_xml_ends(const xmlNode *node, const char *ending) {
    const char *name = (const char *)node->name;
    const size_t n = strlen(name), k = strlen(ending);
    return n >= k && strcmp(name + n - k, ending) == 0;
}

static xmlNode *place_of(const mhi_osim *o, const char *set, int32_t place) {
    return place == 0   ? mhi_xml_objects(o->model, set)
           : place == 1 ? mhi_xml_first(mhi_xml_child(o->model, "components"))
                        : mhi_xml_objects(o->model, "ComponentSet");
}

/* To the first element of the next place that has one. */
static xmlNode *next_place(mhi_osim_walk *walk) {
    while (walk->node == NULL && walk->place < 2) {
        walk->place++;
        walk->node = place_of(walk->o, walk->set, walk->place);
        walk->owner = walk->place == 1 ? "" : "/componentset";
    }
    return walk->node;
}

mhi_osim_walk mhi_osim_begin(mhi_osim *o, const char *set) {
    static const char *const owners[][2] = {{"BodySet", "/bodyset"},
                                            {"JointSet", "/jointset"},
                                            {"ConstraintSet", "/constraintset"},
                                            {"ForceSet", "/forceset"}};
    mhi_osim_walk walk = {.o = o, .set = set, .owner = "", .node = place_of(o, set, 0)};
    for (size_t i = 0; i < sizeof owners / sizeof *owners; i++) {
        if (strcmp(owners[i][0], set) == 0) {
            walk.owner = owners[i][1];
        }
    }
    (void)next_place(&walk);
    return walk;
}

xmlNode *mhi_osim_next(mhi_osim_walk *walk) {
    walk->node = mhi_xml_next(walk->node);
    return next_place(walk);
}

xmlNode *mhi_xml_objects(xmlNode *parent, const char *set) {
    return mhi_xml_first(mhi_xml_child(mhi_xml_child(parent, set), "objects"));
}

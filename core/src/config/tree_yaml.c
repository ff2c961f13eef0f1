/* SPDX-License-Identifier: Apache-2.0 */
/* tree_yaml.c: libyaml's document becomes a tree of nodes.
 *
 * Aliases are expanded, so that each node has one parent and --set changes one place. That makes
 * the number of nodes the thing to limit: a short file can stand for an endless tree. */
#include "config/tree_yaml.h"

#include "io/decode.h"

#include <stdlib.h>
#include <string.h>
#include <yaml.h>

#define MAX_NODES 10000

struct loader {
    const char *name;
    int32_t numbered;
    mhi_arena *arena;
    yaml_document_t document;
    int32_t n_nodes;
    mhe_error *err;
};

MHE_PRINTF(3, 4)
static mhe_status fail(const struct loader *loader, size_t line, const char *format, ...) {
    char text[512];
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text, sizeof text, format, args);
    va_end(args);
    if (!loader->numbered) {
        return mhi_fail_at(loader->err, MHE_E_INPUT, NULL, NULL, "%s: %s", loader->name, text);
    }
    return mhi_fail_at(loader->err, MHE_E_INPUT, NULL, NULL, "%s:%zu: %s", loader->name, line,
                       text);
}

static mhe_status no_memory(const struct loader *loader) {
    return mhe_fail(loader->err, MHE_E_MEMORY, "%s: out of memory", loader->name);
}

static mhe_status too_deep(const struct loader *loader, size_t line) {
    return fail(loader, line, "nested deeper than %d levels, or an alias inside its own anchor",
                MHI_TREE_DEPTH);
}

static mhe_status too_many(const struct loader *loader, size_t line) {
    return fail(loader, line, "more than %d values, aliases expanded", MAX_NODES);
}

static size_t line_of(const yaml_node_t *node) {
    return node->start_mark.line + 1;
}

static mhe_status check_scalar(const struct loader *loader, const yaml_node_t *source) {
    const char *text = (const char *)source->data.scalar.value;
    if (strlen(text) != source->data.scalar.length) {
        return fail(loader, line_of(source), "a text holds a NUL character");
    }
    return MHE_OK;
}

static mhe_status check_key(const struct loader *loader, const yaml_node_t *key,
                            const mhi_node *mapping) {
    if (key->type != YAML_SCALAR_NODE) {
        return fail(loader, line_of(key), "a key must be a plain text, not a list or mapping");
    }
    mhe_status status = check_scalar(loader, key);
    if (status != MHE_OK) {
        return status;
    }
    const char *text = (const char *)key->data.scalar.value;
    if (strlen(text) > MHI_TREE_KEY) {
        return fail(loader, line_of(key), "a key is longer than %d bytes", MHI_TREE_KEY);
    }
    if (strcmp(text, "<<") == 0 && key->data.scalar.style == YAML_PLAIN_SCALAR_STYLE) {
        return fail(loader, line_of(key), "merge keys ('<<') are not supported");
    }
    const mhi_node *first = mhi_node_find(mapping, text);
    if (first != NULL && loader->numbered) {
        return fail(loader, line_of(key), "the key '%s' occurs twice (first in line %d)", text,
                    (int)first->line);
    }
    return first == NULL ? MHE_OK : fail(loader, 0, "the key '%s' occurs twice", text);
}

static mhe_status convert(struct loader *loader, int id, int depth, mhi_node **out);

static mhe_status convert_pairs(struct loader *loader, const yaml_node_t *source, int depth,
                                mhi_node *mapping) {
    mhi_node **link = &mapping->first;
    for (const yaml_node_pair_t *pair = source->data.mapping.pairs.start;
         pair < source->data.mapping.pairs.top; pair++) {
        const yaml_node_t *key = yaml_document_get_node(&loader->document, pair->key);
        mhe_status status = check_key(loader, key, mapping);
        mhi_node *child = NULL;
        if (status == MHE_OK) {
            status = convert(loader, pair->value, depth + 1, &child);
        }
        if (status != MHE_OK) {
            return status;
        }
        child->key = mhi_arena_text(loader->arena, (const char *)key->data.scalar.value);
        if (child->key == NULL) {
            return no_memory(loader);
        }
        /* A value is found where its key stands, even if it starts some lines below. */
        child->line = loader->numbered ? (int32_t)line_of(key) : 0;
        *link = child;
        link = &child->next;
    }
    return MHE_OK;
}

static mhe_status convert_items(struct loader *loader, const yaml_node_t *source, int depth,
                                mhi_node *sequence) {
    mhi_node **link = &sequence->first;
    for (const yaml_node_item_t *item = source->data.sequence.items.start;
         item < source->data.sequence.items.top; item++) {
        mhe_status status = convert(loader, *item, depth + 1, link);
        if (status != MHE_OK) {
            return status;
        }
        link = &(*link)->next;
    }
    return MHE_OK;
}

static mhe_status convert_scalar(struct loader *loader, const yaml_node_t *source, mhi_node *node) {
    mhe_status status = check_scalar(loader, source);
    if (status != MHE_OK) {
        return status;
    }
    node->quoted = source->data.scalar.style != YAML_PLAIN_SCALAR_STYLE;
    node->text = mhi_arena_text(loader->arena, (const char *)source->data.scalar.value);
    return node->text == NULL ? no_memory(loader) : MHE_OK;
}

static mhe_status convert(struct loader *loader, int id, int depth, mhi_node **out) {
    const yaml_node_t *source = yaml_document_get_node(&loader->document, id);
    if (depth > MHI_TREE_DEPTH) {
        return too_deep(loader, line_of(source));
    }
    if (++loader->n_nodes > MAX_NODES) {
        return too_many(loader, line_of(source));
    }
    const char *standard = source->type == YAML_SCALAR_NODE     ? YAML_DEFAULT_SCALAR_TAG
                           : source->type == YAML_SEQUENCE_NODE ? YAML_DEFAULT_SEQUENCE_TAG
                                                                : YAML_DEFAULT_MAPPING_TAG;
    if (source->tag != NULL && strcmp((const char *)source->tag, standard) != 0) {
        return fail(loader, line_of(source), "the tag '%.80s' is not supported",
                    (const char *)source->tag);
    }
    mhi_node *node = MHI_TAKE(loader->arena, mhi_node, 1);
    if (node == NULL) {
        return no_memory(loader);
    }
    node->line = loader->numbered ? (int32_t)line_of(source) : 0;
    *out = node;
    switch (source->type) {
    case YAML_SEQUENCE_NODE:
        node->kind = MHI_SEQUENCE;
        return convert_items(loader, source, depth, node);
    case YAML_MAPPING_NODE:
        node->kind = MHI_MAPPING;
        return convert_pairs(loader, source, depth, node);
    default:
        node->kind = MHI_SCALAR;
        return convert_scalar(loader, source, node);
    }
}

/* The commonest cause of a scanner error gets a name. */
static int tab_indents_line(const char *text, size_t length, size_t line) {
    size_t at = 0;
    for (; line > 1 && at < length; at++) {
        line -= text[at] == '\n';
    }
    while (at < length && text[at] == ' ') {
        at++;
    }
    return at < length && text[at] == '\t';
}

static mhe_status parser_error(const struct loader *loader, const yaml_parser_t *parser,
                               const char *text, size_t length) {
    if (parser->error == YAML_MEMORY_ERROR || parser->problem == NULL) {
        return no_memory(loader); /* the one error that libyaml does not always name */
    }
    const char *problem = parser->problem;
    size_t line = parser->problem_mark.line + 1;
    if (parser->error == YAML_READER_ERROR) { /* knows the byte, not the line */
        line = 1;
        for (size_t i = 0; i < parser->problem_offset && i < length; i++) {
            line += text[i] == '\n';
        }
        return fail(loader, line, "not YAML in UTF-8: %s", problem);
    }
    if (tab_indents_line(text, length, line)) {
        return fail(loader, line, "not valid YAML: a tab in the indentation; use blanks");
    }
    if (parser->context == NULL) {
        return fail(loader, line, "not valid YAML: %s", problem);
    }
    size_t from = parser->context_mark.line + 1;
    if (from == line || !loader->numbered) {
        return fail(loader, line, "not valid YAML: %s: %s", parser->context, problem);
    }
    return fail(loader, line, "not valid YAML: %s that starts in line %zu: %s", parser->context,
                from, problem);
}

static mhe_status start_parser(const struct loader *loader, yaml_parser_t *parser, const char *text,
                               size_t length) {
    if (!yaml_parser_initialize(parser)) {
        return no_memory(loader);
    }
    yaml_parser_set_encoding(parser, YAML_UTF8_ENCODING);
    yaml_parser_set_input_string(parser, (const unsigned char *)text, length);
    return MHE_OK;
}

/* A pass over the events alone. libyaml's own loader takes a minute for a megabyte of '['. */
static mhe_status check_size(const struct loader *loader, const char *text, size_t length) {
    yaml_parser_t parser;
    mhe_status status = start_parser(loader, &parser, text, length);
    if (status != MHE_OK) {
        return status;
    }
    int depth = 0, n = 0, more = 1;
    while (more && status == MHE_OK) {
        yaml_event_t event;
        if (!yaml_parser_parse(&parser, &event)) {
            status = parser_error(loader, &parser, text, length);
            break;
        }
        int start =
            event.type == YAML_SEQUENCE_START_EVENT || event.type == YAML_MAPPING_START_EVENT;
        int end = event.type == YAML_SEQUENCE_END_EVENT || event.type == YAML_MAPPING_END_EVENT;
        depth += start - end;
        n += start || event.type == YAML_SCALAR_EVENT;
        more = event.type != YAML_STREAM_END_EVENT;
        if (depth > MHI_TREE_DEPTH) {
            status = too_deep(loader, event.start_mark.line + 1);
        } else if (n > 2 * MAX_NODES) { /* keys are scalars here */
            status = too_many(loader, event.start_mark.line + 1);
        }
        yaml_event_delete(&event);
    }
    yaml_parser_delete(&parser);
    return status;
}

/* There is one document; what follows it is checked and refused. */
static mhe_status check_end(const struct loader *loader, yaml_parser_t *parser, const char *text,
                            size_t length) {
    yaml_document_t rest;
    if (!yaml_parser_load(parser, &rest)) {
        return parser_error(loader, parser, text, length);
    }
    const yaml_node_t *more = yaml_document_get_root_node(&rest);
    mhe_status status =
        more == NULL ? MHE_OK : fail(loader, line_of(more), "a second YAML document starts here");
    yaml_document_delete(&rest);
    return status;
}

static mhe_status parse(const char *name, const char *text, size_t length, int32_t numbered,
                        mhi_arena *arena, mhi_node **root, mhe_error *err) {
    struct loader loader = {.name = name, .numbered = numbered, .arena = arena, .err = err};
    yaml_parser_t parser;
    *root = NULL;
    mhe_status status = check_size(&loader, text, length);
    if (status == MHE_OK) {
        status = start_parser(&loader, &parser, text, length);
    }
    if (status != MHE_OK) {
        return status;
    }
    if (!yaml_parser_load(&parser, &loader.document)) {
        status = parser_error(&loader, &parser, text, length);
    } else {
        if (yaml_document_get_root_node(&loader.document) != NULL) {
            status = convert(&loader, 1, 1, root);
            if (status == MHE_OK) {
                status = check_end(&loader, &parser, text, length);
            }
        }
        yaml_document_delete(&loader.document);
    }
    yaml_parser_delete(&parser);
    return status;
}

mhe_status mhi_yaml_parse(const char *name, const char *text, size_t length, int32_t numbered,
                          mhi_arena *arena, mhi_node **root, mhe_error *err) {
    mhi_decoded d;
    *root = NULL;
    if (!numbered) { /* a command line is in the encoding of the files that it names */
        return parse(name, text, length, numbered, arena, root, err);
    }
    mhe_status status = mhi_decode(name, text, length, &d, err);
    if (status == MHE_OK) {
        status = parse(name, d.text, d.length, numbered, arena, root, err);
        free(d.owned);
    }
    return status;
}

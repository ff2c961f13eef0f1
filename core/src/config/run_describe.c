/* SPDX-License-Identifier: Apache-2.0 */
/* run_describe.c: every key of the config file, from the tables that read it. */
#include "config/defaults.h"
#include "config/run.h"
#include "plugin/describe_options.h"

#include <string.h>

/* "horizon", or what the top level is called. */
static const char *title(const mhi_section *section) {
    return section->name[0] == '\0' ? "(top level)" : section->name;
}

/* The section's options, with the plugin that stands for it where none is named. */
static const mhe_option *with_default(const mhi_section *s, mhi_arena *arena) {
    const char *id = NULL;
    if (s->iface == NULL || s->offset == 0 || mhi_default_plugin(s->name, arena, &id, NULL) ||
        id == NULL) {
        return s->options;
    }
    mhe_option *copy = MHI_TAKE(arena, mhe_option, s->n_options);
    if (copy == NULL) {
        return s->options;
    }
    memcpy(copy, s->options, sizeof *copy * (size_t)s->n_options);
    copy[0].text_default = id; /* every such table starts with `plugin` */
    return copy;
}

static void describe_json(const mhi_section *sections, int32_t n, mhi_arena *arena, mhi_text *out) {
    cJSON *root = cJSON_CreateObject();
    for (int32_t i = 0; i < n; i++) {
        cJSON *one = cJSON_AddObjectToObject(root, sections[i].name);
        cJSON_AddStringToObject(one, "help", sections[i].help);
        cJSON_AddItemToObject(
            one, "options",
            mhi_options_json(with_default(&sections[i], arena), sections[i].n_options));
    }
    mhi_print_json(root, out);
}

void mhi_run_describe(int32_t format, mhi_text *out) {
    int32_t n = 0;
    mhi_arena arena = {0};
    const mhi_section *sections = mhi_run_sections(&n);
    if (format == MHI_FORMAT_JSON) {
        describe_json(sections, n, &arena, out);
        mhi_arena_free(&arena);
        return;
    }
    for (int32_t i = 0; i < n; i++) {
        const mhi_section *s = &sections[i];
        const char *more = s->iface != NULL ? " The plugin's own keys stand beside these." : "";
        if (format == MHI_FORMAT_MARKDOWN) {
            mhi_text_add(out, "%s**`%s`** %s%s\n\n", i == 0 ? "" : "\n", title(s), s->help, more);
            mhi_options_markdown(with_default(s, &arena), s->n_options, out);
        } else {
            mhi_text_add(out, "%s%s: %s%s\n", i == 0 ? "" : "\n", title(s), s->help, more);
            mhi_options_text(with_default(s, &arena), s->n_options, out);
        }
    }
    mhi_arena_free(&arena);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* run_describe.c: every key of the config file, from the tables that read it. */
#include "config/run.h"
#include "plugin/describe_options.h"

/* "horizon", or what the top level is called. */
static const char *title(const mhi_section *section) {
    return section->name[0] == '\0' ? "(top level)" : section->name;
}

static void describe_json(const mhi_section *sections, int32_t n, mhi_text *out) {
    cJSON *root = cJSON_CreateObject();
    for (int32_t i = 0; i < n; i++) {
        cJSON *one = cJSON_AddObjectToObject(root, sections[i].name);
        cJSON_AddStringToObject(one, "help", sections[i].help);
        cJSON_AddItemToObject(one, "options",
                              mhi_options_json(sections[i].options, sections[i].n_options));
    }
    mhi_print_json(root, out);
}

void mhi_run_describe(int32_t format, mhi_text *out) {
    int32_t n = 0;
    const mhi_section *sections = mhi_run_sections(&n);
    if (format == MHI_FORMAT_JSON) {
        describe_json(sections, n, out);
        return;
    }
    for (int32_t i = 0; i < n; i++) {
        const mhi_section *s = &sections[i];
        const char *more = s->iface != NULL ? " The plugin's own keys stand beside these." : "";
        if (format == MHI_FORMAT_MARKDOWN) {
            mhi_text_add(out, "%s**`%s`** %s%s\n\n", i == 0 ? "" : "\n", title(s), s->help, more);
            mhi_options_markdown(s->options, s->n_options, out);
        } else {
            mhi_text_add(out, "%s%s: %s%s\n", i == 0 ? "" : "\n", title(s), s->help, more);
            mhi_options_text(s->options, s->n_options, out);
        }
    }
}

/* SPDX-License-Identifier: Apache-2.0 */
/* run_write.c: the resolved configuration as YAML. */
#include "config/options.h"
#include "config/run.h"
#include "config/run_sections.h"

#include <mhe/force.h>
#include <mhe/model.h>
#include <string.h>

static void write_use(const mhi_run *run, const mhi_section *section, const mhi_use *use,
                      int32_t indent, mhi_text *out) {
    const mhi_use_section own = {.plugin = use->plugin->id,
                                 .file = run->model_file.file,
                                 .unsupported = run->model_file.unsupported,
                                 .locked = run->model_file.locked,
                                 .locked_at = run->model_file.locked_at,
                                 .motion = run->model_file.motion,
                                 .weight = use->weight,
                                 .sigma = use->sigma,
                                 .huber = use->huber,
                                 .delay = use->delay};
    mhi_options_write(section->options, section->n_options, &own, indent, out);
    mhi_options_write(use->plugin->options, (int32_t)use->plugin->option_count, use->config, indent,
                      out);
}

static void write_list(const mhi_run *run, const mhi_section *section, mhi_text *out) {
    const mhi_use_list list = mhi_run_list(run, section);
    for (int32_t i = 0; i < list.n; i++) {
        size_t start = out->length;
        write_use(run, section, &list.uses[i], 4, out);
        if (!out->failed) {
            out->data[start + 2] = '-'; /* "    plugin: ..." starts a list entry */
        }
    }
}

void mhi_run_write_model(const mhi_run *run, int32_t indent, mhi_text *out) {
    int32_t n = 0;
    const mhi_section *s = mhi_run_sections(&n);
    for (const mhi_section *end = s + n; s < end; s++) {
        if (s->iface != NULL && strcmp(s->iface, MHE_MODEL_IFACE) == 0) {
            write_use(run, s, &run->model, indent, out);
        }
    }
}

void mhi_run_write(const mhi_run *run, mhi_text *out) {
    int32_t n = 0;
    const mhi_section *s = mhi_run_sections(&n);
    mhi_text_add(out, "# Every key of this run with its value.\n");
    for (const mhi_section *end = s + n; s < end; s++) {
        if (s->name[0] == '\0') {
            const mhi_top_section top = {run->formulation, run->plugin_path};
            mhi_options_write(s->options, s->n_options, &top, 0, out);
            continue;
        }
        const void *part = (const unsigned char *)run + s->offset;
        if (strcmp(s->name, "emg.channels") == 0) {
            mhi_run_write_channels(run, out);
            continue;
        }
        if (strchr(s->name, '.') != NULL) { /* within the section before */
            mhi_text_add(out, "  %s:\n", strchr(s->name, '.') + 1);
            mhi_options_write(s->options, s->n_options, part, 4, out);
            continue;
        }
        if (s->list && mhi_run_list(run, s).n == 0) {
            if (strcmp(s->iface, MHE_FORCE_IFACE) == 0) { /* left out would mean the default */
                mhi_text_add(out, "%s: []\n", s->name);
            }
            continue;
        }
        mhi_text_add(out, "%s:\n", s->name);
        if (s->iface == NULL) {
            mhi_options_write(s->options, s->n_options, part, 2, out);
        } else if (s->list) {
            write_list(run, s, out);
        } else {
            write_use(run, s, part, 2, out);
        }
    }
}

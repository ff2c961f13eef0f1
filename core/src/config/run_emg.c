/* SPDX-License-Identifier: Apache-2.0 */
/* run_emg.c: the electrodes of the emg section. */
#include "config/options.h"
#include "config/run_sections.h"

#include <string.h>

#define LIST "emg.channels"

static mhe_status check_channel(const mhi_run *run, int32_t i, mhe_error *err) {
    const mhi_emg_channel *c = &run->emg.channels[i];
    if (c->muscles.n == 0) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, c->node,
                           LIST ": channel '%s' names no muscle", c->name);
    }
    if (c->gains.n != 0 && c->gains.n != c->muscles.n) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, c->node,
                           LIST ": channel '%s' has %d gains for %d muscles", c->name,
                           (int)c->gains.n, (int)c->muscles.n);
    }
    if (c->shape.n > 1 && c->shape.n != c->muscles.n) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, c->node,
                           LIST ": channel '%s' has %d shape factors for %d muscles", c->name,
                           (int)c->shape.n, (int)c->muscles.n);
    }
    if (c->delay < 0 && c->delay != -1) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, c->node,
                           LIST ": channel '%s': 'delay' is %g s; EMG comes before the activation, "
                                "so at least 0 (or -1: that of the section)",
                           c->name, c->delay);
    }
    for (int32_t k = 0; k < i; k++) {
        if (strcmp(run->emg.channels[k].name, c->name) == 0) {
            return mhi_fail_at(err, MHE_E_CONFIG, run->tree, c->node,
                               LIST ": channel '%s' is there twice; one entry lists all of its "
                                    "muscles",
                               c->name);
        }
    }
    return MHE_OK;
}

static mhe_status check_section(const mhi_run *run, const mhi_node *section, mhe_error *err) {
    const mhi_emg_section *e = &run->emg;
    if (e->process && e->band_order > 0 && e->band_low >= e->band_high) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, section,
                           "emg: 'band_low' is %g Hz, which is not below 'band_high', %g Hz",
                           e->band_low, e->band_high);
    }
    if (e->delay < 0 && e->delay != -1) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, section,
                           "emg: 'delay' is %g s; EMG comes before the activation, so at least 0 "
                           "(or -1: what is usual)",
                           e->delay);
    }
    const mhi_node *sources = mhi_node_find(mhi_tree_root(run->tree), "sources");
    if (run->data.emg == NULL && (sources == NULL || sources->first == NULL)) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, section,
                           "emg: there are channels, but data.emg names no file");
    }
    return MHE_OK;
}

mhe_status mhi_run_read_channels(mhi_run *run, mhe_error *err) {
    const mhi_node *section = mhi_node_find(mhi_tree_root(run->tree), "emg");
    const mhi_node *list = section == NULL ? NULL : mhi_node_find(section, "channels");
    if (section == NULL || mhi_node_is_null(section) || section->first == NULL) {
        return MHE_OK;
    }
    if (list == NULL && section->first->next == NULL && mhi_node_find(section, "sample") != NULL) {
        return MHE_OK; /* it concerns columns of muscles, too */
    }
    if (list == NULL) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, section,
                           "emg: 'channels' is missing, the list of electrodes: "
                           "[{name: COLUMN, muscles: [MUSCLE, ...], mvc: NUMBER}, ...]");
    }
    if (list->kind != MHI_SEQUENCE && !mhi_node_is_null(list)) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, list,
                           LIST ": must be a list: [{name: COLUMN, muscles: [MUSCLE, ...]}, ...]");
    }
    int32_t n_options = 0;
    const mhe_option *options = mhi_run_section(LIST, &n_options);
    mhi_emg_section *e = &run->emg;
    e->channels = MHI_TAKE(&run->arena, mhi_emg_channel, mhi_node_count(list));
    if (e->channels == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = MHE_OK;
    for (const mhi_node *node = list->first; node != NULL && status == MHE_OK; node = node->next) {
        mhi_emg_channel *channel = &e->channels[e->n_channels];
        status = mhi_options_fill(options, n_options, run->tree, node, NULL, 0, LIST, run->dir,
                                  &run->arena, channel, err);
        channel->node = node;
        if (status == MHE_OK) {
            status = check_channel(run, e->n_channels++, err);
        }
    }
    return status == MHE_OK && e->n_channels > 0 ? check_section(run, section, err) : status;
}

void mhi_run_write_channels(const mhi_run *run, mhi_text *out) {
    int32_t n_options = 0;
    const mhe_option *options = mhi_run_section(LIST, &n_options);
    mhi_text_add(out, "  channels:%s\n", run->emg.n_channels == 0 ? " []" : "");
    for (int32_t i = 0; i < run->emg.n_channels; i++) {
        const size_t start = out->length;
        mhi_options_write(options, n_options, &run->emg.channels[i], 6, out);
        if (!out->failed) {
            out->data[start + 4] = '-'; /* "      name: ..." starts a list entry */
        }
    }
}

/* SPDX-License-Identifier: Apache-2.0 */
/* run_reader.h: what the files that read a configuration share. */
#ifndef MHI_RUN_READER_H
#define MHI_RUN_READER_H

#include "config/run.h"

/* What of the file is read; other sections belong to another program. */
enum { MHI_SCOPE_ALL, MHI_SCOPE_MODEL, MHI_SCOPE_STEPS };

typedef struct mhi_reader {
    mhi_run *run;
    mhi_registry *registry;
    mhe_error *err;
    int32_t scope; /* MHI_SCOPE_* */
} mhi_reader;

mhe_status mhi_reader_no_memory(const mhi_reader *r);
/* Of a name "data.transform", the mapping within that section; NULL: it is not there. */
mhi_node *mhi_reader_section(const mhi_run *run, const char *name);

/* run_plugins.c: all sections that name a plugin, or the one with this interface; and costs, where
 * `owner` stands for the list in messages if that is missing (NULL). */
mhe_status mhi_read_plugin_sections(const mhi_reader *r, const char *iface);
/* What reads the external loads of `file`; `key`: where the tree names it. */
mhe_status mhi_read_loads(const mhi_reader *r, const char *file, const mhi_node *key, mhi_use *use);
mhe_status mhi_read_costs(const mhi_reader *r, const mhi_node *owner, const mhi_node *list,
                          mhi_use **uses, int32_t *n_uses);

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* registry.h: which plugins there are. */
#ifndef MHI_REGISTRY_H
#define MHI_REGISTRY_H

#include "base/text.h"

#include <mhe/plugin.h>

typedef struct mhi_registry mhi_registry;

/* `host`, or one that drops all messages where it is NULL. [any] */
const mhe_host *mhi_host_or_silent(const mhe_host *host);

/* An empty registry that already knows its standard folders: MHE_PLUGIN_PATH (':' between folders;
 * not looked at by programs with raised privileges), the installed <libdir>/mhe/plugins/abi0 as
 * seen from libmhe.so (place.h), for what lies in the build tree its plugin folder. They are
 * scanned at the first look-up; what everybody may write to is refused. `host` is lent for life.
 * [cold] */
mhe_status mhi_registry_create(const mhe_host *host, mhi_registry **registry, mhe_error *err);
void mhi_registry_free(mhi_registry *registry); /* libraries stay loaded until exit */

/* A plugin is code that runs as soon as its folder is searched, so folders that a config file names
 * are searched only where the user says so; 0 at first. */
void mhi_registry_trust_files(mhi_registry *registry, int32_t trusted);
int32_t mhi_registry_trusts_files(const mhi_registry *registry);

/* Adds a folder to be searched before the standard ones. May be called again; a folder twice is
 * once. MHE_E_CONFIG: absent, or everybody may write to it. */
mhe_status mhi_registry_add_folder(mhi_registry *registry, const char *folder, mhe_error *err);

/* An empty registry that already knows its standard folders: MHE_PLUGIN_PATH (':' between folders;
 * not looked at by programs with raised privileges), the installed <libdir>/mhe/plugins/abi0 as
 * seen from libmhe.so (place.h), for what lies in the build tree its plugin folder. They are
 * scanned at the first look-up; what everybody may write to is refused. `host` is lent for life.
 * [cold] */
mhe_status mhi_registry_find(mhi_registry *registry, const char *id, const char *iface,
                             const mhe_plugin **plugin, mhe_error *err);

/* All plugins, sorted by id. */
int32_t mhi_registry_count(mhi_registry *registry);
const mhe_plugin *mhi_registry_at(mhi_registry *registry, int32_t i);
const char *mhi_registry_file(mhi_registry *registry, int32_t i); /* shared object it came from */

/* Refused files, and ids that another file had before: "path: reason". */
int32_t mhi_registry_refused_count(mhi_registry *registry);
const char *mhi_registry_refused(mhi_registry *registry, int32_t i);

#define MHI_FORMAT_TEXT 0
#define MHI_FORMAT_JSON 1
#define MHI_FORMAT_MARKDOWN 2
/* What --list-plugins and --describe print. */
void mhi_registry_list(mhi_registry *registry, int32_t format, mhi_text *out);
mhe_status mhi_registry_describe(mhi_registry *registry, const char *id, int32_t format,
                                 mhi_text *out, mhe_error *err);

#endif

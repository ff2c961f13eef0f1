/* SPDX-License-Identifier: Apache-2.0 */
/* plugin.h: what a shared object exports.
 *
 * A plugin library exports one function, mhe_plugin_entry, written by
 * MHE_PLUGIN_LIBRARY(&my_plugin, ...). It links nothing of the framework. Life of an instance: load
 * -> check -> create(problem, config) -> layout -> many evaluations -> destroy; a changed problem
 * means a new instance.
 *
 * Thread tags used in all headers:
 *   [cold]  never two calls at once on one instance
 *   [hot]   `self` is const and shared by threads; writes only to outputs, contexts and scratch
 *           that belong to one thread; does not allocate, lock, print or touch files
 *   [any]   safe anywhere, any time
 */
#ifndef MHE_PLUGIN_H
#define MHE_PLUGIN_H

#include <mhe/host.h>
#include <mhe/option.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The library underneath allocates during [hot] calls (Simbody); such a plugin is measured instead
 * of refused. */
#define MHE_FLAG_HOT_ALLOCATES 1u
/* A cost that compares controls, which are constant over the interval behind their node, with the
 * mean EMG of that interval; without it, with the EMG at the node. `emg.sample` overrules it. */
#define MHE_FLAG_MEAN_TARGETS 2u

typedef struct mhe_plugin {
    uint32_t size;  /* sizeof(mhe_plugin) when the plugin was compiled */
    uint32_t flags; /* MHE_FLAG_* */
    const char *id; /* "mhe.cost.effort"; third parties use their own domain: "org.lab.cost.x" */
    const char *version;   /* "1.2.3" */
    const char *summary;   /* one sentence */
    const char *reference; /* DOI or citation of the method; NULL if none */
    const char *iface;     /* MHE_COST_IFACE ...: kind of plugin and revision of `ops` */
    const void *ops;       /* const mhe_cost_ops * for that iface ... */
    uint32_t config_size;  /* bytes of the config struct; 0 without options */
    uint32_t option_size;  /* sizeof(mhe_option) when compiled */
    uint32_t option_count;
    const mhe_option *options;
    const void *(*extension)(const char *id); /* optional interfaces by id, [any]; NULL if none */
} mhe_plugin;

typedef struct mhe_library {
    uint32_t magic; /* these first four fields never change meaning or place */
    uint16_t abi_major, abi_minor;
    uint32_t size; /* sizeof(mhe_library) when the plugin was compiled */
    uint32_t plugin_count;
    const mhe_plugin *const *plugins; /* pointers, so that a descriptor can grow */
} mhe_library;

/* The one symbol of a plugin library. Returns a constant table that lives as long as the library is
 * loaded. [any] */
typedef const mhe_library *(*mhe_plugin_entry_function)(void);
#define MHE_PLUGIN_ENTRY "mhe_plugin_entry"

/* Fields of an mhe_plugin for a config struct and its option table. */
#define MHE_PLUGIN_OPTIONS(T, table)                                                 \
    .config_size = (uint32_t)sizeof(T), .option_size = (uint32_t)sizeof(mhe_option), \
    .option_count = (uint32_t)(sizeof(table) / sizeof((table)[0])), .options = (table)

#define MHE_PLUGIN_LIBRARY(...)                                                         \
    static const mhe_plugin *const mhe_plugin_list[] = {__VA_ARGS__};                   \
    static const mhe_library mhe_plugin_library = {                                     \
        .magic = MHE_MAGIC,                                                             \
        .abi_major = MHE_ABI_MAJOR,                                                     \
        .abi_minor = MHE_ABI_MINOR,                                                     \
        .size = (uint32_t)sizeof(mhe_library),                                          \
        .plugin_count = (uint32_t)(sizeof mhe_plugin_list / sizeof mhe_plugin_list[0]), \
        .plugins = mhe_plugin_list};                                                    \
    MHE_EXPORT const mhe_library *mhe_plugin_entry(void);                               \
    const mhe_library *mhe_plugin_entry(void) {                                         \
        return &mhe_plugin_library;                                                     \
    }

#ifdef __cplusplus
}
#endif
#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* config.h: what a run is made of, from a YAML file or from memory.
 *
 *     mhe_config *config;
 *     mhe_config_read("arm.yaml", NULL, 0, 0, NULL, &config, &err);
 *     mhe_estimator_create(config, &estimator, &err);
 *     mhe_recording_open(config, &recording, &err);
 *     ...
 *     mhe_config_close(config);
 *
 * A config is read and checked once and lent to all that is made from it; it must live longer than
 * they do. `mhe-run --describe config` prints every key.
 *
 * Threads: calls on one config, and the making of objects from it, belong to one thread at a time;
 * what was made is independent. */
#ifndef MHE_CONFIG_H
#define MHE_CONFIG_H

#include <mhe/abi.h>
#include <mhe/host.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct mhe_config mhe_config;

/* The file's own plugin_path is followed. A plugin is code that runs as soon as its folder is
 * searched, so without this flag only folders that `set` or MHE_PLUGIN_PATH names are searched. */
#define MHE_CONFIG_TRUST 1u

/* Reads a file with `set` [n_set] assignments "path.to.key=value" applied after it (NULL, 0: none).
 * `flags`: 0 or MHE_CONFIG_*. `host` (NULL: messages are dropped) is lent for the config's life and
 * gets the messages of all that is made from it. MHE_E_CONFIG, MHE_E_INPUT, MHE_E_PLUGIN: err->text
 * is one line, "file:line: what". [cold] */
MHE_API mhe_status mhe_config_read(const char *path, const char *const *set, int32_t n_set,
                                   uint32_t flags, const mhe_host *host, mhe_config **config,
                                   mhe_error *err);

/* The same of a text [length] in memory (UTF-8, need not end in NUL; it is copied). `name` stands
 * for the file in messages, and its last part without extension is the run's name; relative paths
 * in the text start at `folder` (NULL: the working directory). [cold] */
MHE_API mhe_status mhe_config_parse(const char *name, const char *text, uint64_t length,
                                    const char *folder, const char *const *set, int32_t n_set,
                                    uint32_t flags, const mhe_host *host, mhe_config **config,
                                    mhe_error *err);

MHE_API void mhe_config_close(mhe_config *config); /* NULL is fine. [cold] */

/* The run's name: the file's without folder and extension. NULL for NULL. [any] */
MHE_API const char *mhe_config_name(const mhe_config *config);

/* Plugin i of those that it uses, each once: its id and the file that its code lies in, which live
 * as long as the config. 0: there are no more. [any] */
MHE_API int32_t mhe_config_plugin(const mhe_config *config, int32_t i, const char **id,
                                  const char **file);

/* Element i of the model file that was left out because it is not supported, "file:line: what",
 * once an estimator or a recording was made; NULL: there are no more. [any] */
MHE_API const char *mhe_config_dropped(const mhe_config *config, int32_t i);

/* The whole configuration with every key of every section and plugin that is used, defaults
 * filled in: YAML that reads back the same. `*text` is the caller's: mhe_free(). [cold] */
MHE_API mhe_status mhe_config_write(mhe_config *config, char **text, mhe_error *err);

/* One value of it as text, as YAML would write it on one line: "horizon.window", "costs.0.weight",
 * "output.formats". Paths are absolute; what has no value is "". `*text` is the caller's:
 * mhe_free(). MHE_E_CONFIG: no such key. [cold] */
MHE_API mhe_status mhe_config_get(mhe_config *config, const char *key, char **text, mhe_error *err);

/* The same as a number; true is 1, false 0. MHE_E_CONFIG: no such key, or it is none. [cold] */
MHE_API mhe_status mhe_config_get_real(mhe_config *config, const char *key, double *value,
                                       mhe_error *err);

#ifdef __cplusplus
}
#endif
#endif

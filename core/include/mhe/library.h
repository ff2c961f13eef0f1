/* SPDX-License-Identifier: Apache-2.0 */
/* library.h: what libmhe.so says of itself and of the plugins that it finds.
 *
 * Plugins lie in <libdir>/mhe/plugins/abi0 as seen from where libmhe.so itself lies; folders in the
 * environment variable MHE_PLUGIN_PATH (':' between them) come before it, those of a config's
 * `plugin_path` before both. No variable is needed. */
#ifndef MHE_LIBRARY_H
#define MHE_LIBRARY_H

#include <mhe/abi.h>
#include <mhe/host.h>

#ifdef __cplusplus
extern "C" {
#endif

/* "0.2.0": of the library that runs, where version.h says what was compiled against. [any] */
MHE_API const char *mhe_version(void);

/* What a status means, in a few words; of an unknown one "an unknown status". [any] */
MHE_API const char *mhe_status_text(mhe_status status);

/* Gives back a text that a function of this library made for its caller. NULL is fine. [any] */
MHE_API void mhe_free(char *text);

#define MHE_FORMAT_TEXT 0
#define MHE_FORMAT_JSON 1
#define MHE_FORMAT_MARKDOWN 2

/* All plugins with their ids and summaries, and the files that were refused and why, in one of the
 * formats but markdown. `*text` is the caller's: mhe_free(). `host` may be NULL. [cold] */
MHE_API mhe_status mhe_plugins_list(const mhe_host *host, int32_t format, char **text,
                                    mhe_error *err);

/* One plugin with its options; `id` "config": the keys of a configuration. MHE_E_PLUGIN: there is
 * none of this id; err->text names the nearest, and each folder that was searched. `*text` is the
 * caller's: mhe_free(). [cold] */
MHE_API mhe_status mhe_plugins_describe(const mhe_host *host, const char *id, int32_t format,
                                        char **text, mhe_error *err);

#ifdef __cplusplus
}
#endif
#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* console.h: what the programs share: messages on stderr, exit status, printing, commands and
 * words of the command line. */
#ifndef CONSOLE_H
#define CONSOLE_H

#include "base/text.h"

#include <mhe/host.h>

/* A host whose warnings and errors go to stderr as "<program>: warning: ...". `program` is lent. */
mhe_host console_host(const char *program);

/* The end of main(): stdout is flushed, an error told, and the exit status given: 0 done; 2 the
 * command line, the configuration or an input file is wrong; 1 anything else. */
int console_end(const char *program, mhe_status status, mhe_error *err);

/* Prints and frees a text; MHE_E_IO where it can not be written. */
mhe_status console_print(mhi_text *text, mhe_error *err);

/* The word behind the option argv[*i], which becomes the current one. MHE_E_ARGUMENT: none. */
mhe_status console_value(int argc, char **argv, int *i, const char **value, mhe_error *err);

/* A word that is none of the options [n]: the one config file of the command line -> *config.
 * MHE_E_ARGUMENT: it begins with '-' (the nearest option is told), or there is a file already. */
mhe_status console_config(const char *word, const char *const *options, int32_t n,
                          const char **config, mhe_error *err);

/* For programs of commands: `*chosen` is the one of `names` [n] that `word` is, -1 where it is
 * --version or --help, which are answered. MHE_E_ARGUMENT: none of these; `word` may be NULL. */
mhe_status console_command(const char *program, const char *help, const char *const *names,
                           int32_t n, const char *word, int32_t *chosen, mhe_error *err);

#endif

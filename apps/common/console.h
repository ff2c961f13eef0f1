/* SPDX-License-Identifier: Apache-2.0 */
/* console.h: what the programs share: messages on stderr, exit status, printing,
 * the command line's words. */
#ifndef CONSOLE_H
#define CONSOLE_H

#include "base/text.h"

#include <mhe/host.h>

/* A host whose warnings and errors go to stderr as "<program>: warning: ...". `program` is lent. */
mhe_host console_host(const char *program);

/* 0 done; 2 the command line, the configuration or an input file is wrong; 1 anything else. */
int console_exit_status(mhe_status status);

/* Prints and frees a text; MHE_E_IO where it can not be written. */
mhe_status console_print(mhi_text *text, mhe_error *err);

/* The word behind the option argv[*i], which becomes the current one. MHE_E_ARGUMENT: none. */
mhe_status console_value(int argc, char **argv, int *i, const char **value, mhe_error *err);

#endif

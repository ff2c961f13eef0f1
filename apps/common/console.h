/* SPDX-License-Identifier: Apache-2.0 */
/* console.h: what the programs share: messages on stderr, exit status, printing. */
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

#endif

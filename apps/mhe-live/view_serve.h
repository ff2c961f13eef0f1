/* SPDX-License-Identifier: Apache-2.0 */
/* view_serve.h: one page for browsers of this machine. */
#ifndef VIEW_SERVE_H
#define VIEW_SERVE_H

#include <mhe/abi.h>
#include <signal.h>

/* Serves the page [size] on a free port of loopback until `*stop`; `ready` is told the address.
 * Only programs that ask for 127.0.0.1 or localhost get it: a foreign site whose name points here
 * does not. MHE_E_IO: no port. [cold] */
mhe_status view_serve(const char *page, size_t size, void (*ready)(const char *address),
                      const volatile sig_atomic_t *stop, mhe_error *err);

#endif

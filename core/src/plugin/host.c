/* SPDX-License-Identifier: Apache-2.0 */
/* host.c: the host of an application that brings none. */
#include "plugin/registry.h"

static void silent(const mhe_host *host, int32_t level, const char *text) {
    (void)host, (void)level, (void)text;
}

static const void *no_service(const mhe_host *host, const char *id) {
    (void)host, (void)id;
    return NULL;
}

const mhe_host *mhi_host_or_silent(const mhe_host *host) {
    static const mhe_host quiet = {.size = sizeof quiet, .log = silent, .service = no_service};
    return host == NULL ? &quiet : host;
}

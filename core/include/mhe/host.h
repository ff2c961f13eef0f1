/* SPDX-License-Identifier: Apache-2.0 */
/* host.h: what the core offers to plugins. */
#ifndef MHE_HOST_H
#define MHE_HOST_H

#include <mhe/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

#define MHE_LOG_ERROR 0
#define MHE_LOG_WARNING 1
#define MHE_LOG_INFO 2
#define MHE_LOG_DEBUG 3

/* Given to every create(); lives until after the last destroy(). */
typedef struct mhe_host mhe_host;
struct mhe_host {
    uint32_t size; /* bytes of this struct in the core */
    void *data;    /* the core's own */

    /* Hands one line without newline to the application, which decides whether to show it. Never
     * NULL. [any], but not from [hot] functions: the application may write to a file. */
    void (*log)(const mhe_host *host, int32_t level, const char *text);

    /* A further service by id ("mhe.pool/1"), or NULL where this core has none. [any] */
    const void *(*service)(const mhe_host *host, const char *id);
};

#ifdef __cplusplus
}
#endif
#endif

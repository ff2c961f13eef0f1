/* SPDX-License-Identifier: Apache-2.0 */
/* catalogue.c: what plugins there are. */
#include "base/need.h"
#include "library/config.h"

#include <mhe/library.h>
#include <stdlib.h>
#include <string.h>

void mhe_free(char *text) {
    free(text);
}

mhe_status mhe_plugins_list(const mhe_host *host, int32_t format, char **text, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"text", text});
    mhi_registry *registry = NULL;
    mhi_text out = {0};
    if (status == MHE_OK) {
        *text = NULL;
        status = mhi_registry_create(mhi_host_or_silent(host), &registry, err);
    }
    if (status == MHE_OK) {
        mhi_registry_list(registry, format, &out);
        status = mhi_text_give(&out, text, err);
    }
    mhi_registry_free(registry);
    return status;
}

mhe_status mhe_plugins_describe(const mhe_host *host, const char *id, int32_t format, char **text,
                                mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"id", id}, {"text", text});
    mhi_registry *registry = NULL;
    mhi_text out = {0};
    if (status != MHE_OK) {
        return status;
    }
    *text = NULL;
    if (strcmp(id, "config") == 0) {
        mhi_run_describe(format, &out);
        return mhi_text_give(&out, text, err);
    }
    status = mhi_registry_create(mhi_host_or_silent(host), &registry, err);
    if (status == MHE_OK) {
        status = mhi_registry_describe(registry, id, format, &out, err);
    }
    if (status == MHE_OK) {
        status = mhi_text_give(&out, text, err);
    }
    mhi_text_free(&out);
    mhi_registry_free(registry);
    return status;
}

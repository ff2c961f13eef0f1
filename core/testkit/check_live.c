/* SPDX-License-Identifier: Apache-2.0 */
/* check_live.c: sources and sinks speak with the world outside; here only what needs none of it. */
#include "kit.h"

#include <mhe/sink.h>
#include <mhe/source.h>
#include <string.h>

/* A plugin may refuse to be created without what it needs, in words. */
static int created(mhi_kit *kit, mhe_status status, const mhe_error *err, void *self) {
    if (status != MHE_OK && err->text[0] == '\0') {
        mhi_kit_fail(kit, "a refusal says why", "create() gave %d without a text", (int)status);
        return 0;
    }
    if (status != MHE_OK) {
        mhi_kit_skip(kit, "create with default options", "%s", err->text);
        return 0;
    }
    if (self == NULL) {
        mhi_kit_fail(kit, "create with default options", "no instance, and no error");
        return 0;
    }
    mhi_kit_pass(kit, "create with default options");
    return 1;
}

void mhi_check_source(mhi_kit *kit) {
    const mhe_source_ops *ops = kit->plugin->ops;
    void *self = NULL;
    mhe_error err = {0};
    const mhe_status status = ops->create(&kit->host, kit->config, &self, &err);
    if (!created(kit, status, &err, self)) {
        return;
    }
    mhe_stream_info info = {.size = sizeof info};
    err.text[0] = '\0';
    if (ops->stream(self, -1, &info, &err) == MHE_OK || err.text[0] == '\0') {
        mhi_kit_fail(kit, "a stream that is not there is refused in words", "it was not");
    } else {
        mhi_kit_pass(kit, "a stream that is not there is refused in words");
    }
    ops->destroy(self);
    mhi_kit_pass(kit, "destroy before open");
}

void mhi_check_sink(mhi_kit *kit) {
    const mhe_sink_ops *ops = kit->plugin->ops;
    void *self = NULL;
    mhe_error err = {0};
    const mhe_status status = ops->create(&kit->host, kit->config, &self, &err);
    if (created(kit, status, &err, self)) {
        ops->destroy(self);
        mhi_kit_pass(kit, "destroy before open");
    }
}

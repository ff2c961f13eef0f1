/* SPDX-License-Identifier: Apache-2.0 */
#include "report.h"

#include "view.h"

#include <mhe/outbox.h>

mhe_status report_write(const char *dir, mhe_config *config, const char *summary,
                        const char *reference, mhe_error *err) {
    const view_setup setup = {.dir = dir,
                              .title = mhe_config_name(config),
                              .summary = summary,
                              .reference = reference,
                              .config = config};
    mhi_text page = {0};
    mhe_outbox *outbox = NULL;
    mhe_status status = view_compose(&setup, &page, err);
    if (status == MHE_OK) {
        status = mhe_outbox_open(dir, &outbox, err);
    }
    if (status == MHE_OK) {
        status = mhe_outbox_text(outbox, "report.html", page.data, err);
    }
    if (status == MHE_OK) {
        status = mhe_outbox_commit(outbox, err);
    }
    mhe_outbox_close(outbox);
    mhi_text_free(&page);
    return status;
}

/* SPDX-License-Identifier: Apache-2.0 */
/* open.c: an estimator from a config file, for applications that embed it. */
#include "estimator/estimator_private.h"

mhe_status mhe_estimator_open(const char *config, const char *const *set, int32_t n_set,
                              const mhe_host *host, mhe_estimator **estimator, mhe_error *err) {
    host = mhi_host_or_silent(host);
    mhi_registry *registry = NULL;
    mhi_run *run = NULL;
    *estimator = NULL;
    mhe_status status = mhi_registry_create(host, &registry, err);
    if (status == MHE_OK) {
        status = mhi_run_read(config, set, n_set, registry, &run, err);
    }
    if (status == MHE_OK) {
        status = mhi_estimator_create(run, host, estimator, err);
    }
    if (status != MHE_OK) {
        mhi_run_free(run);
        mhi_registry_free(registry);
        return status;
    }
    (*estimator)->registry = registry;
    (*estimator)->owned_run = run;
    return MHE_OK;
}

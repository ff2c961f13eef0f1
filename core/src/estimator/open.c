/* SPDX-License-Identifier: Apache-2.0 */
/* open.c: an estimator for applications that embed it, from a config or from its file at once. */
#include "base/need.h"
#include "estimator/estimator_private.h"
#include "library/config.h"

mhe_status mhe_estimator_create(mhe_config *config, mhe_estimator **estimator, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"config", config}, {"estimator", estimator});
    const mhe_description *model = NULL;
    if (status == MHE_OK) {
        *estimator = NULL;
        status = mhi_config_model(config, &model, err);
    }
    return status == MHE_OK
               ? mhi_estimator_create_on(config->run, model, config->host, estimator, err)
               : status;
}

mhe_status mhe_estimator_open(const char *config, const char *const *set, int32_t n_set,
                              const mhe_host *host, mhe_estimator **estimator, mhe_error *err) {
    mhe_config *own = NULL;
    mhe_status status = MHI_NEED(err, {"config", config}, {"estimator", estimator});
    if (status == MHE_OK) {
        *estimator = NULL;
        status = mhe_config_read(config, set, n_set, host, &own, err);
    }
    if (status == MHE_OK) {
        status = mhe_estimator_create(own, estimator, err);
    }
    if (status != MHE_OK) {
        mhe_config_close(own);
        return status;
    }
    (*estimator)->config = own;
    return MHE_OK;
}

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
    if (status == MHE_OK) {
        status = mhi_estimator_create_on(config->run, model, config->host, estimator, err);
    }
    if (status == MHE_OK) {
        mhi_estimator_set_stop(*estimator, &(*estimator)->stopped);
    }
    return status;
}

mhe_status mhe_estimator_open(const char *config, const char *const *set, int32_t n_set,
                              const mhe_host *host, mhe_estimator **estimator, mhe_error *err) {
    mhe_config *own = NULL;
    mhe_status status = MHI_NEED(err, {"config", config}, {"estimator", estimator});
    if (status == MHE_OK) {
        *estimator = NULL;
        status = mhe_config_read(config, set, n_set, 0, host, &own, err);
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

mhe_status mhe_estimator_set_start(mhe_estimator *e, const double *q, const double *qdot,
                                   mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"estimator", e});
    if (status == MHE_OK) {
        mhi_estimator_set_start(e, q, qdot);
    }
    return status;
}

mhe_status mhe_estimator_set_node(mhe_estimator *e, int32_t node, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"estimator", e});
    if (status == MHE_OK && (node < 0 || node > e->window.n)) {
        status = mhe_fail(err, MHE_E_ARGUMENT, "%s: %d is no node of the window, 0 .. %d", __func__,
                          (int)node, (int)e->window.n);
    }
    if (status == MHE_OK) {
        mhi_estimator_set_node(e, node);
    }
    return status;
}

mhe_status mhe_estimator_set_deadline(mhe_estimator *e, double seconds, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"estimator", e});
    if (status == MHE_OK && !(seconds >= 0)) {
        status = mhe_fail(err, MHE_E_ARGUMENT, "%s: %g s is no deadline", __func__, seconds);
    }
    if (status == MHE_OK) {
        mhi_estimator_set_deadline(e, seconds);
    }
    return status;
}

void mhe_estimator_stop(mhe_estimator *e, int32_t stop) {
    if (e != NULL) {
        e->stopped = stop != 0;
    }
}

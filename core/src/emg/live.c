/* SPDX-License-Identifier: Apache-2.0 */
/* live.c: electrodes from a config file, for applications that embed the estimator. */
#include "base/need.h"
#include "emg/electrodes.h"
#include "library/config.h"

#include <mhe/emg.h>
#include <stdlib.h>
#include <string.h>

struct mhe_emg {
    mhe_config *config;
    mhi_electrodes *electrodes;
    int32_t n_muscles;
    double *values; /* [n_muscles] */
};

static mhe_status check(const mhi_run *run, mhe_error *err) {
    const mhi_node *section = mhi_node_find(mhi_tree_root(run->tree), "emg");
    if (run->emg.n_channels == 0) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, section,
                           "emg: there are no channels: which electrode is which muscle?");
    }
    if (run->emg.process && run->emg.zero_phase) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, section,
                           "emg: 'zero_phase' looks ahead; that is for recordings alone");
    }
    return MHE_OK;
}

mhe_status mhi_electrodes_open_live(const mhi_run *run, const mhe_description *model,
                                    const char *const *columns, int32_t n_columns, double rate,
                                    mhi_electrodes **electrodes, mhe_error *err) {
    mhe_status status = check(run, err);
    for (int32_t i = 0; i < n_columns && status == MHE_OK; i++) {
        status = columns[i] != NULL
                     ? MHE_OK
                     : mhe_fail(err, MHE_E_ARGUMENT, "raw EMG: column %d has no name", (int)i);
    }
    if (status == MHE_OK && !(rate > 0 && rate < 1e9)) {
        status = mhe_fail(err, MHE_E_ARGUMENT, "raw EMG: %g Hz is no rate", rate);
    }
    if (status != MHE_OK) {
        return status;
    }
    double *mvc = calloc((size_t)run->emg.n_channels, sizeof *mvc);
    status = mvc == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                         : mhi_electrodes_mvc(run, model, mvc, NULL, err);
    if (status == MHE_OK) {
        status = mhi_electrodes_open(run, model, run->path, columns, n_columns, rate, mvc,
                                     electrodes, err);
    }
    free(mvc);
    return status;
}

mhe_status mhe_emg_open(const char *config, const char *const *set, int32_t n_set,
                        const char *const *columns, int32_t n_columns, double rate,
                        const mhe_host *host, mhe_emg **emg, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"config", config}, {"columns", columns}, {"emg", emg});
    if (status != MHE_OK) {
        return status;
    }
    *emg = NULL;
    mhe_emg *e = calloc(1, sizeof *e);
    const mhe_description *model = NULL;
    if (e == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    status = mhe_config_read(config, set, n_set, 0, host, &e->config, err);
    if (status == MHE_OK) {
        status = check(e->config->run, err); /* before the model: it takes longer */
    }
    if (status == MHE_OK) {
        status = mhi_config_model(e->config, &model, err);
    }
    if (status == MHE_OK) {
        e->n_muscles = model->n_muscles;
        e->values = calloc((size_t)model->n_muscles + 1, sizeof *e->values);
        status = e->values == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    }
    if (status == MHE_OK) {
        status = mhi_electrodes_open_live(e->config->run, model, columns, n_columns, rate,
                                          &e->electrodes, err);
    }
    if (status != MHE_OK) {
        mhe_emg_close(e);
        return status;
    }
    *emg = e;
    return MHE_OK;
}

void mhe_emg_close(mhe_emg *e) {
    if (e != NULL) {
        mhi_electrodes_close(e->electrodes);
        mhe_config_close(e->config);
        free(e->values);
        free(e);
    }
}

mhe_status mhe_emg_push(mhe_emg *e, double time, const double *raw, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"emg", e}, {"raw", raw});
    if (status == MHE_OK) {
        mhi_electrodes_push(e->electrodes, time, raw);
    }
    return status;
}

mhe_status mhe_emg_at(mhe_emg *e, double time, double *values, int32_t n, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"emg", e}, {"values", values});
    if (status == MHE_OK && n < 0) {
        status = mhe_fail(err, MHE_E_ARGUMENT, "%s: room for %d values", __func__, (int)n);
    }
    if (status == MHE_OK) {
        mhi_electrodes_at(e->electrodes, time, e->values);
        memcpy(values, e->values, sizeof *values * (size_t)(n < e->n_muscles ? n : e->n_muscles));
    }
    return status;
}

double mhe_emg_lag(const mhe_emg *e) {
    return e == NULL ? 0 : mhi_electrodes_lag(e->electrodes);
}

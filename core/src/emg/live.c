/* SPDX-License-Identifier: Apache-2.0 */
/* live.c: electrodes from a config file, for applications that embed the estimator. */
#include "emg/electrodes.h"
#include "io/model_file.h"

#include <mhe/emg.h>
#include <stdlib.h>

struct mhe_emg {
    mhi_registry *registry;
    mhi_run *run;
    mhe_description *model;
    mhi_electrodes *electrodes;
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

mhe_status mhe_emg_open(const char *config, const char *const *set, int32_t n_set,
                        const char *const *columns, int32_t n_columns, double rate,
                        const mhe_host *host, mhe_emg **emg, mhe_error *err) {
    *emg = NULL;
    mhe_emg *e = calloc(1, sizeof *e);
    double *mvc = NULL;
    if (e == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = mhi_registry_create(mhi_host_or_silent(host), &e->registry, err);
    if (status == MHE_OK) {
        status = mhi_run_read(config, set, n_set, e->registry, &e->run, err);
    }
    if (status == MHE_OK) {
        status = check(e->run, err);
    }
    if (status == MHE_OK) {
        status = mhi_model_read(e->run->model_file.file, &e->model, err);
    }
    if (status == MHE_OK) {
        mvc = calloc((size_t)e->run->emg.n_channels, sizeof *mvc);
        status = mvc == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                             : mhi_electrodes_mvc(e->run, e->model, mvc, err);
    }
    if (status == MHE_OK) {
        status = mhi_electrodes_open(e->run, e->model, config, columns, n_columns, rate, mvc,
                                     &e->electrodes, err);
    }
    if (status == MHE_OK) {
        mhi_electrodes_tell(e->electrodes, e->run, config, mhi_host_or_silent(host));
    }
    free(mvc);
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
        mhi_description_free(e->model);
        mhi_run_free(e->run);
        mhi_registry_free(e->registry);
        free(e);
    }
}

void mhe_emg_push(mhe_emg *e, double time, const double *raw) {
    mhi_electrodes_push(e->electrodes, time, raw);
}

void mhe_emg_at(const mhe_emg *e, double time, double *values) {
    mhi_electrodes_at(e->electrodes, time, values);
}

double mhe_emg_lag(const mhe_emg *e) {
    return mhi_electrodes_lag(e->electrodes);
}

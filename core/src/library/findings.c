/* SPDX-License-Identifier: Apache-2.0 */
/* findings.c: the diagnosis of a run and its errors against the truth, as one public object. */
#include "base/need.h"
#include "believe/believe.h"
#include "believe/diagnosis.h"
#include "estimator/create.h"
#include "estimator/errors.h"
#include "estimator/unmet.h"
#include "library/config.h"
#include "library/recording.h"

#include <mhe/findings.h>
#include <stdlib.h>

struct mhe_findings {
    const mhe_estimator *estimator;
    mhe_estimator_info info;
    mhi_findings *list; /* the recording's, which began it */
    mhi_diagnosis *diagnosis;
    mhi_errors *errors; /* NULL: there is no reference */
};

/* What the recording and the model say of each other; warnings of it, too. */
static mhe_status believe(const mhe_config *config, const mhi_system *system, mhi_recording *data,
                          mhe_error *err) {
    const int32_t told = data->findings.n;
    mhe_status status = mhi_believe_model(config->run, system, data, &data->findings, err);
    if (status == MHE_OK) {
        status = mhi_believe_fit(config->run, system, data, &data->findings, err);
    }
    if (status == MHE_OK) {
        mhi_believe_reference(config->run, system, data, &data->findings);
    }
    mhi_findings_tell(&data->findings, told, config->host);
    return status;
}

mhe_status mhe_findings_open(mhe_config *config, mhe_estimator *estimator,
                             const mhe_recording *recording, mhe_findings **findings,
                             mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"config", config}, {"estimator", estimator},
                                 {"recording", recording}, {"findings", findings});
    if (status != MHE_OK) {
        return status;
    }
    *findings = NULL;
    mhe_findings *f = calloc(1, sizeof *f);
    if (f == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    const mhi_system *system = mhi_estimator_system(estimator);
    f->estimator = estimator;
    f->info.size = sizeof f->info;
    f->list = &recording->data->findings;
    status = mhe_estimator_describe(estimator, &f->info);
    if (status == MHE_OK) {
        status = believe(config, system, recording->data, err);
    }
    if (status == MHE_OK) {
        status = mhi_diagnosis_create(&f->info, config->run, recording->data, system, &f->diagnosis,
                                      err);
    }
    if (status == MHE_OK && recording->info.has_reference) {
        status = mhi_errors_create(system, recording->data, &f->errors, err);
    }
    if (status != MHE_OK) {
        mhe_findings_close(f);
        return status;
    }
    *findings = f;
    return MHE_OK;
}

void mhe_findings_close(mhe_findings *f) {
    if (f != NULL) {
        mhi_errors_free(f->errors);
        mhi_diagnosis_free(f->diagnosis);
        free(f);
    }
}

mhe_status mhe_findings_add(mhe_findings *f, const mhe_estimate *estimate, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"findings", f}, {"estimate", estimate});
    mhe_estimate e;
    if (status == MHE_OK) {
        status = mhi_take(__func__, &e, sizeof e, estimate, err);
    }
    if (status == MHE_OK && (e.q == NULL || e.force == NULL || e.markers == NULL)) {
        status = mhe_fail(err, MHE_E_ARGUMENT, "%s: the estimate was not filled", __func__);
    }
    if (status != MHE_OK) {
        return status;
    }
    e.size = sizeof e;
    mhi_diagnosis_add(f->diagnosis, &e);
    return f->errors != NULL ? mhi_errors_add(f->errors, &e, err) : MHE_OK;
}

const double *mhe_findings_distances(const mhe_findings *f) {
    return f == NULL ? NULL : mhi_diagnosis_distances(f->diagnosis);
}

const double *mhe_findings_emg(const mhe_findings *f) {
    return f == NULL ? NULL : mhi_diagnosis_emg(f->diagnosis);
}

mhe_status mhe_findings_rmse(const mhe_findings *f, int32_t skip_first, int32_t skip_last,
                             mhe_rmse *rmse, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"findings", f}, {"rmse", rmse});
    if (status == MHE_OK && f->errors == NULL) {
        status = mhe_fail(err, MHE_E_INPUT, "the recording has no reference");
    }
    if (status != MHE_OK) {
        return status;
    }
    mhi_rmse r;
    mhi_errors_rmse(f->errors, skip_first, skip_last, &r);
    const mhe_rmse own = {.size = sizeof own,
                          .q = r.q,
                          .qdot = r.qdot,
                          .activation = r.activation,
                          .excitation = r.excitation,
                          .force = r.force,
                          .marker = r.marker};
    return mhi_give(__func__, rmse, &own, err);
}

mhe_status mhe_findings_judge(mhe_findings *f, int32_t *weight, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"findings", f}, {"weight", weight});
    if (status == MHE_OK) {
        mhi_diagnosis_judge(f->diagnosis, mhi_estimator_unmet(f->estimator), f->list);
        *weight = mhi_findings_weight(f->list);
    }
    return status;
}

mhe_status mhe_findings_at(const mhe_findings *f, int32_t i, mhe_finding *finding, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"findings", f}, {"finding", finding});
    if (status == MHE_OK && (i < 0 || i >= f->list->n)) {
        status = mhe_fail(err, MHE_E_ARGUMENT, "%s: there is no finding %d", __func__, (int)i);
    }
    if (status != MHE_OK) {
        return status;
    }
    const mhi_finding *is = &f->list->all[i];
    const mhe_finding own = {.size = sizeof own,
                             .weight = is->weight,
                             .text = is->text,
                             .remedy = mhi_finding_remedy(is)};
    return mhi_give(__func__, finding, &own, err);
}

static mhe_status give_tracking(const char *function, const mhe_findings *f, int32_t is_muscle,
                                int32_t i, mhe_tracking *tracking, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"findings", f}, {"tracking", tracking});
    if (status == MHE_OK && (i < 0 || i >= (is_muscle ? f->info.n_muscles : f->info.n_markers))) {
        status = mhe_fail(err, MHE_E_ARGUMENT, "%s: there is no number %d", function, (int)i);
    }
    if (status != MHE_OK) {
        return status;
    }
    const mhi_channel_tally t =
        is_muscle ? mhi_diagnosis_muscle(f->diagnosis, i) : mhi_diagnosis_marker(f->diagnosis, i);
    const mhe_tracking own = {
        .size = sizeof own, .present = t.present, .left_out = t.left_out, .rms = t.rms};
    return mhi_give(function, tracking, &own, err);
}

mhe_status mhe_findings_marker(const mhe_findings *f, int32_t i, mhe_tracking *tracking,
                               mhe_error *err) {
    return give_tracking(__func__, f, 0, i, tracking, err);
}

mhe_status mhe_findings_muscle(const mhe_findings *f, int32_t i, mhe_tracking *tracking,
                               mhe_error *err) {
    return give_tracking(__func__, f, 1, i, tracking, err);
}

mhe_status mhe_findings_write(const mhe_findings *f, char **text, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"findings", f}, {"text", text});
    if (status != MHE_OK) {
        return status;
    }
    mhi_text out = {0};
    *text = NULL;
    mhi_diagnosis_lines(f->diagnosis, &out);
    return mhi_text_give(&out, text, err);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* A whole recording, as mhe-run estimates it. */
#include "gateway.h"

#include <mhe/findings.h>
#include <stdlib.h>
#include <string.h>

#define RUN_ROWS 10 /* quantities that are kept of every estimate */

typedef struct run {
    mhe_config *config;
    mhe_estimator *estimator;
    mhe_recording *recording;
    mhe_findings *findings;
    mhe_estimator_info info;
    mhe_recording_info data;
    int32_t n, weight;
    double *rows[RUN_ROWS]; /* what `run_names` says, estimate after estimate */
    char *text;
    mhe_rmse rmse;
} run;

static const char *const run_names[RUN_ROWS] = {"time",       "q",      "qdot",   "activation",
                                                "excitation", "force",  "moment", "residual",
                                                "markers",    "quality"};
static const char *const quality_names[] = {"status",     "iterations", "kkt_residual",
                                            "solve_time", "marker_rms", "emg_rms"};
#define RUN_QUALITY ((int32_t)(sizeof quality_names / sizeof quality_names[0]))

static int32_t run_width(const run *r, int k) {
    const int32_t n_m = r->info.n_muscles, n_q = r->info.n_q;
    const int32_t widths[RUN_ROWS] = {1,
                                      n_q,
                                      n_q,
                                      n_m,
                                      r->info.formulation == 0 ? n_m : 0,
                                      n_m,
                                      n_q,
                                      r->info.n_residual_torques,
                                      3 * r->info.n_markers,
                                      RUN_QUALITY};
    return widths[k];
}

static void run_close(run *r) {
    for (int k = 0; k < RUN_ROWS; k++) {
        free(r->rows[k]);
    }
    mhe_free(r->text);
    mhe_findings_close(r->findings);
    mhe_recording_close(r->recording);
    mhe_estimator_close(r->estimator);
    mhe_config_close(r->config);
}

static mhe_status run_open(run *r, int nrhs, const mxArray *prhs[], mhe_error *err) {
    mhe_truth truth = {.size = sizeof truth};
    memset(r, 0, sizeof *r);
    r->info.size = sizeof r->info;
    r->data.size = sizeof r->data;
    mhe_status status = gateway_config_of(nrhs, prhs, &r->config, err);
    status = status == MHE_OK ? mhe_estimator_create(r->config, &r->estimator, err) : status;
    status = status == MHE_OK ? mhe_estimator_describe(r->estimator, &r->info) : status;
    status = status == MHE_OK ? mhe_recording_open(r->config, &r->recording, err) : status;
    status = status == MHE_OK ? mhe_recording_describe(r->recording, &r->data, err) : status;
    if (status == MHE_OK && r->data.n_frames > 0) {
        status = mhe_estimator_covers(r->estimator, r->data.time[0],
                                      r->data.time[r->data.n_frames - 1], 0, err);
    }
    if (status == MHE_OK && r->data.has_reference) { /* it knows how the run begins */
        status = mhe_recording_truth(r->recording, 0, &truth, err);
        status = status == MHE_OK ? mhe_estimator_set_start(r->estimator, truth.q, truth.qdot, err)
                                  : status;
    }
    if (status == MHE_OK) {
        status = mhe_findings_open(r->config, r->estimator, r->recording, &r->findings, err);
    }
    for (int k = 0; k < RUN_ROWS && status == MHE_OK; k++) {
        r->rows[k] =
            malloc(sizeof(double) * ((size_t)run_width(r, k) * (size_t)r->data.n_frames + 1));
        status = r->rows[k] == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    }
    return status;
}

static void run_keep(run *r, const mhe_estimate *e) {
    const double quality[] = {e->status,     e->iterations, e->kkt_residual,
                              e->solve_time, e->marker_rms, e->emg_rms};
    const double *const values[RUN_ROWS] = {&e->time,      e->q,     e->qdot,   e->activation,
                                            e->excitation, e->force, e->moment, e->residual,
                                            e->markers,    quality};
    for (int k = 0; k < RUN_ROWS; k++) {
        const size_t width = (size_t)run_width(r, k);
        if (width > 0) {
            memcpy(r->rows[k] + width * (size_t)r->n, values[k], sizeof(double) * width);
        }
    }
    r->n++;
}

static mhe_status run_all(run *r, mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t k = 0; k < r->data.n_frames && status == MHE_OK; k++) {
        mhe_frame frame = {.size = sizeof frame};
        mhe_estimate estimate = {.size = sizeof estimate};
        int32_t ready = 0;
        status = mhe_recording_frame(r->recording, k, &frame, err);
        status = status == MHE_OK ? mhe_estimator_push(r->estimator, &frame, &estimate, &ready, err)
                                  : status;
        if (status == MHE_OK && ready) {
            status = mhe_findings_add(r->findings, &estimate, err);
            run_keep(r, &estimate);
        }
    }
    if (status == MHE_OK && r->n == 0) {
        status = mhe_fail(err, MHE_E_INPUT, "no frame has a marker or an angle to begin from");
    }
    status = status == MHE_OK ? mhe_findings_judge(r->findings, &r->weight, err) : status;
    status = status == MHE_OK ? mhe_findings_write(r->findings, &r->text, err) : status;
    r->rmse.size = sizeof r->rmse;
    if (status == MHE_OK && r->data.has_reference) {
        double first = 0, last = 0;
        (void)mhe_config_get_real(r->config, "output.skip_first", &first, NULL);
        (void)mhe_config_get_real(r->config, "output.skip_last", &last, NULL);
        status = mhe_findings_rmse(r->findings, (int32_t)first, (int32_t)last, &r->rmse, err);
    }
    return status;
}

/* What a run's findings say: verdict, findings with weight, text and remedy. */
static void add_findings(mxArray *out, const run *r) {
    static const char *const verdicts[] = {"yes", "doubtful", "no"};
    static const char *const weights[] = {"note", "doubtful", "useless"};
    static const char *fields[] = {"weight", "text", "remedy"};
    mhe_finding finding = {.size = sizeof finding};
    mwSize n = 0;
    while (mhe_findings_at(r->findings, (int32_t)n, &finding, NULL) == MHE_OK) {
        n++;
    }
    mxArray *found = mxCreateStructMatrix(n, 1, 3, fields);
    for (mwIndex i = 0; i < n; i++) {
        (void)mhe_findings_at(r->findings, (int32_t)i, &finding, NULL);
        const char *remedy = finding.remedy == NULL ? "" : finding.remedy;
        mxSetFieldByNumber(found, i, 0, mxCreateString(weights[finding.weight]));
        mxSetFieldByNumber(found, i, 1, mxCreateString(finding.text));
        mxSetFieldByNumber(found, i, 2, mxCreateString(remedy));
    }
    gateway_add(out, "verdict", mxCreateString(verdicts[r->weight]));
    gateway_add(out, "findings", found);
}

static mxArray *run_out(run *r) {
    mhe_error err = {0};
    char *config = NULL;
    mxArray *out = gateway_struct();
    for (int k = 0; k < RUN_ROWS; k++) {
        gateway_add(out, run_names[k], gateway_matrix_out(r->rows[k], r->n, run_width(r, k)));
    }
    gateway_add_names(out, &r->info);
    gateway_add(out, "quality_names", gateway_names_out(quality_names, RUN_QUALITY));
    add_findings(out, r);
    gateway_add(out, "text", mxCreateString(r->text));
    gateway_add(out, "name", mxCreateString(mhe_config_name(r->config)));
    gateway_add(out, "dropped", gateway_dropped_out(r->config));
    if (mhe_config_write(r->config, &config, &err) == MHE_OK) {
        gateway_add(out, "config", gateway_text_out(MHE_OK, config, &err));
    }
    mxArray *rmse = gateway_struct();
    if (r->data.has_reference) {
        gateway_add_number(rmse, "q", r->rmse.q);
        gateway_add_number(rmse, "qdot", r->rmse.qdot);
        gateway_add_number(rmse, "activation", r->rmse.activation);
        gateway_add_number(rmse, "excitation", r->rmse.excitation);
        gateway_add_number(rmse, "force", r->rmse.force);
        gateway_add_number(rmse, "marker", r->rmse.marker);
    }
    gateway_add(out, "rmse", rmse);
    return out;
}

mxArray *gateway_run_recording(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    run r;
    mhe_status status = run_open(&r, nrhs, prhs, &err);
    status = status == MHE_OK ? run_all(&r, &err) : status;
    mxArray *out = status == MHE_OK ? run_out(&r) : NULL;
    run_close(&r);
    if (status != MHE_OK) {
        gateway_refuse(status, &err);
    }
    return out;
}

mxArray *gateway_check_config(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    run r;
    mhe_status status = run_open(&r, nrhs, prhs, &err);
    status = status == MHE_OK ? mhe_findings_judge(r.findings, &r.weight, &err) : status;
    mxArray *out = status == MHE_OK ? gateway_struct() : NULL;
    if (out != NULL) {
        add_findings(out, &r);
    }
    run_close(&r);
    if (status != MHE_OK) {
        gateway_refuse(status, &err);
    }
    return out;
}

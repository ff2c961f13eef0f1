/* SPDX-License-Identifier: Apache-2.0 */
/* The estimator, frame by frame. */
#include "gateway.h"

#include <string.h>

#define GATEWAY_MAX 256 /* estimators at once */

typedef struct opened {
    uint64_t id; /* 0: free */
    mhe_config *config;
    mhe_estimator *estimator;
    mhe_estimator_info info;
    mhe_estimate estimate; /* of the last push; its arrays are the estimator's */
    int32_t ready, n_emg_columns;
} opened;

static opened table[GATEWAY_MAX];
static const char *const phases[] = {"empty", "filling", "beginning", "settling", "running"};

static void close_one(opened *o) {
    mhe_estimator_close(o->estimator);
    mhe_config_close(o->config);
    memset(o, 0, sizeof *o);
}

void gateway_close_estimators(void) {
    for (int i = 0; i < GATEWAY_MAX; i++) {
        if (table[i].id != 0) {
            close_one(&table[i]);
        }
    }
}

static opened *opened_of(int nrhs, const mxArray *prhs[]) {
    const uint64_t id = gateway_handle_of(gateway_argument(nrhs, prhs, 1));
    for (int i = 0; i < GATEWAY_MAX && id != 0; i++) {
        if (table[i].id == id) {
            return &table[i];
        }
    }
    mexErrMsgIdAndTxt("myohorizon:closed", "the estimator is closed");
    return NULL;
}

static mxArray *done(mhe_status status, const mhe_error *err) {
    if (status != MHE_OK) {
        gateway_refuse(status, err);
    }
    return NULL;
}

mxArray *gateway_open(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    opened *o = NULL;
    for (int i = 0; i < GATEWAY_MAX && o == NULL; i++) {
        o = table[i].id == 0 ? &table[i] : NULL;
    }
    if (o == NULL) {
        mexErrMsgIdAndTxt("myohorizon:argument", "%d estimators are open; close some", GATEWAY_MAX);
        return NULL;
    }
    mhe_status status = gateway_config_of(nrhs, prhs, &o->config, &err);
    status = status == MHE_OK ? mhe_estimator_create(o->config, &o->estimator, &err) : status;
    if (status != MHE_OK) {
        close_one(o);
        gateway_refuse(status, &err);
    }
    o->id = gateway_new_handle();
    o->info.size = sizeof o->info;
    (void)mhe_estimator_describe(o->estimator, &o->info);
    mexLock(); /* while it is open the gateway stays loaded */
    return gateway_handle_out(o->id);
}

mxArray *gateway_close(int nrhs, const mxArray *prhs[]) {
    close_one(opened_of(nrhs, prhs));
    mexUnlock();
    return NULL;
}

/* ---- frames ---- */

static mxArray *estimate_out(const mhe_estimator_info *info, const mhe_estimate *e) {
    static const char *const statuses[] = {"ok", "iteration_limit", "deadline", "predicted",
                                           "restarted"};
    const int32_t n_q = info->n_q, n_m = info->n_muscles;
    mxArray *out = gateway_struct();
    gateway_add_number(out, "time", e->time);
    gateway_add(out, "status", mxCreateString(statuses[e->status]));
    gateway_add(out, "phase", mxCreateString(phases[e->phase]));
    gateway_add_number(out, "iterations", e->iterations);
    gateway_add_number(out, "kkt_residual", e->kkt_residual);
    gateway_add_number(out, "solve_time", e->solve_time);
    gateway_add_number(out, "latency", e->latency);
    gateway_add_number(out, "marker_rms", e->marker_rms);
    gateway_add_number(out, "emg_rms", e->emg_rms);
    gateway_add(out, "q", gateway_vector_out(e->q, n_q));
    gateway_add(out, "qdot", gateway_vector_out(e->qdot, n_q));
    gateway_add(out, "activation", gateway_vector_out(e->activation, n_m));
    gateway_add(out, "excitation", gateway_vector_out(e->excitation, n_m));
    gateway_add(out, "force", gateway_vector_out(e->force, n_m));
    gateway_add(out, "moment", gateway_vector_out(e->moment, n_q));
    gateway_add(out, "residual", gateway_vector_out(e->residual, info->n_residual_torques));
    gateway_add(out, "markers", gateway_matrix_out(e->markers, info->n_markers, 3));
    if (e->reactions != NULL) {
        gateway_add(out, "reactions", gateway_matrix_out(e->reactions, info->n_joints, 6));
    }
    if (info->uncertainty) {
        gateway_add(out, "q_sd", gateway_vector_out(e->q_sd, n_q));
        gateway_add(out, "activation_sd", gateway_vector_out(e->activation_sd, n_m));
        gateway_add(out, "force_sd", gateway_vector_out(e->force_sd, n_m));
        gateway_add(out, "moment_sd", gateway_vector_out(e->moment_sd, n_q));
    }
    return out;
}

/* Columns there, rows here; NULL for NULL. */
static double *rows_of(const double *matrix, int32_t rows, int32_t columns) {
    double *out = NULL;
    if (matrix != NULL) {
        out = mxMalloc(sizeof *out * (size_t)rows * (size_t)columns);
        for (int32_t i = 0; i < rows; i++) {
            for (int32_t k = 0; k < columns; k++) {
                out[i * columns + k] = matrix[k * rows + i];
            }
        }
    }
    return out;
}

mxArray *gateway_push(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    opened *o = opened_of(nrhs, prhs);
    const mhe_estimator_info *info = &o->info;
    mhe_frame frame = {.size = sizeof frame,
                       .time = gateway_number_of(gateway_argument(nrhs, prhs, 2), "t")};
    double *markers =
        rows_of(gateway_matrix_of(gateway_argument(nrhs, prhs, 3), "markers", info->n_markers, 3),
                info->n_markers, 3);
    frame.markers = markers;
    frame.emg = gateway_matrix_of(gateway_argument(nrhs, prhs, 4), "emg", info->n_muscles, 1);
    frame.angles = gateway_matrix_of(gateway_argument(nrhs, prhs, 5), "angles", info->n_q, 1);
    o->ready = 0;
    o->estimate = (mhe_estimate){.size = sizeof o->estimate};
    const mhe_status status =
        mhe_estimator_push(o->estimator, &frame, &o->estimate, &o->ready, &err);
    mxFree(markers);
    if (status != MHE_OK) {
        o->ready = 0;
        gateway_refuse(status, &err);
    }
    return o->ready ? estimate_out(info, &o->estimate) : mxCreateDoubleMatrix(0, 0, mxREAL);
}

mxArray *gateway_prepare(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    return done(mhe_estimator_prepare(opened_of(nrhs, prhs)->estimator, &err), &err);
}

mxArray *gateway_measure(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    opened *o = opened_of(nrhs, prhs);
    const char *name = gateway_text_of(gateway_argument(nrhs, prhs, 2), "channel");
    const double t = gateway_number_of(gateway_argument(nrhs, prhs, 3), "t");
    const int32_t channel = mhe_estimator_find_channel(o->estimator, name);
    if (channel < 0) {
        mexErrMsgIdAndTxt("myohorizon:argument", "there is no channel '%s'", name);
    }
    const mhe_channel *row = mhe_channel_at(&o->info, channel);
    /* a label a row, as everywhere */
    const double *values =
        gateway_matrix_of(gateway_argument(nrhs, prhs, 4), name, row->n_labels, row->per_label);
    if (values == NULL) {
        mexErrMsgIdAndTxt("myohorizon:argument", "%s: values are needed", name);
    }
    return done(mhe_estimator_measure(o->estimator, channel, t,
                                      rows_of(values, row->n_labels, row->per_label), &err),
                &err);
}

mxArray *gateway_open_emg(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    int32_t n = 0;
    opened *o = opened_of(nrhs, prhs);
    const char **columns = gateway_texts_of(gateway_argument(nrhs, prhs, 2), "columns", &n);
    const double rate = gateway_number_of(gateway_argument(nrhs, prhs, 3), "rate");
    (void)done(mhe_estimator_open_emg(o->estimator, columns, n, rate, &err), &err);
    o->n_emg_columns = n;
    return NULL;
}

mxArray *gateway_push_emg(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    opened *o = opened_of(nrhs, prhs);
    const mxArray *times = gateway_argument(nrhs, prhs, 2);
    const int32_t n = times == NULL ? 0 : (int32_t)mxGetNumberOfElements(times);
    if (o->n_emg_columns == 0) {
        mexErrMsgIdAndTxt("myohorizon:argument",
                          "raw EMG has no columns yet: open_emg(columns, rate) comes first");
    }
    const double *t = gateway_matrix_of(times, "t", n, 1);
    const double *raw =
        rows_of(gateway_matrix_of(gateway_argument(nrhs, prhs, 3), "raw", n, o->n_emg_columns), n,
                o->n_emg_columns);
    if (t != NULL && raw == NULL) {
        mexErrMsgIdAndTxt("myohorizon:argument", "raw: samples are needed");
    }
    mhe_status status = MHE_OK;
    for (int32_t k = 0; k < n && status == MHE_OK; k++) {
        status = mhe_estimator_push_emg(o->estimator, t[k], raw + k * o->n_emg_columns, &err);
    }
    return done(status, &err);
}

static mxArray *why_out(const int32_t *why, int32_t n) {
    static const char *const words[] = {"used", "missing", "far", "saturated", "unread"};
    mxArray *out = mxCreateCellMatrix(1, (mwSize)n);
    for (int32_t i = 0; i < n; i++) {
        mxSetCell(out, (mwIndex)i, mxCreateString(words[why[i]]));
    }
    return out;
}

mxArray *gateway_tracked(int nrhs, const mxArray *prhs[]) {
    const opened *o = opened_of(nrhs, prhs);
    mxArray *out = gateway_struct();
    for (int32_t i = 0; o->ready && i < o->estimate.n_tracked; i++) {
        const mhe_tracked *t = (const void *)((const char *)o->estimate.tracked +
                                              (size_t)i * o->estimate.tracked_size);
        const mhe_channel *row = mhe_channel_at(&o->info, t->channel);
        mxArray *one = gateway_struct();
        gateway_add(one, "measured", gateway_vector_out(t->measured, row->width));
        gateway_add(one, "target", gateway_vector_out(t->target, row->width));
        gateway_add(one, "weight", gateway_vector_out(t->weight, row->width));
        gateway_add(one, "estimated", gateway_vector_out(t->estimated, row->width));
        gateway_add(one, "why", why_out(t->why, row->width));
        gateway_add(one, "columns", gateway_names_out(row->columns, row->width));
        gateway_add_number(one, "n_measured", t->n_measured);
        gateway_add_number(one, "n_left_out", t->n_left_out);
        gateway_add_number(one, "rms", t->rms);
        gateway_add(out, row->name, one);
    }
    return out;
}

/* ---- before the first frame ---- */

mxArray *gateway_set_start(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    opened *o = opened_of(nrhs, prhs);
    const double *q = gateway_matrix_of(gateway_argument(nrhs, prhs, 2), "q", o->info.n_q, 1);
    const double *qdot = gateway_matrix_of(gateway_argument(nrhs, prhs, 3), "qdot", o->info.n_q, 1);
    return done(mhe_estimator_set_start(o->estimator, q, qdot, &err), &err);
}

mxArray *gateway_set_node(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    opened *o = opened_of(nrhs, prhs);
    const int32_t node = gateway_count_of(gateway_argument(nrhs, prhs, 2), "node");
    return done(mhe_estimator_set_node(o->estimator, node, &err), &err);
}

mxArray *gateway_set_deadline(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    opened *o = opened_of(nrhs, prhs);
    const double seconds = gateway_number_of(gateway_argument(nrhs, prhs, 2), "seconds");
    return done(mhe_estimator_set_deadline(o->estimator, seconds, &err), &err);
}

/* ---- what it is ---- */

static mxArray *channels_out(const mhe_estimator_info *info) {
    mxArray *out = gateway_struct();
    for (int32_t i = 0; i < info->n_channels; i++) {
        const mhe_channel *row = mhe_channel_at(info, i);
        mxArray *one = gateway_struct();
        gateway_add(one, "columns", gateway_names_out(row->columns, row->width));
        gateway_add(one, "units", gateway_names_out(row->units, row->width));
        gateway_add(one, "signal", mxCreateString(row->signal == NULL ? "" : row->signal));
        gateway_add_number(one, "delay", row->delay);
        gateway_add_number(one, "gap", row->gap);
        gateway_add(out, row->name, one);
    }
    return out;
}

mxArray *gateway_info(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    opened *o = opened_of(nrhs, prhs);
    char *config = NULL;
    mxArray *out = gateway_struct();
    (void)mhe_estimator_describe(o->estimator, &o->info);
    gateway_add_names(out, &o->info);
    gateway_add_number(out, "window", o->info.window);
    gateway_add_number(out, "ratio", o->info.ratio);
    gateway_add_number(out, "interval", o->info.interval);
    gateway_add_number(out, "node", o->info.node);
    gateway_add_number(out, "delay", o->info.delay);
    gateway_add(out, "phase", mxCreateString(phases[o->info.phase]));
    gateway_add_number(out, "emg_lag", mhe_estimator_emg_lag(o->estimator));
    gateway_add(out, "channels", channels_out(&o->info));
    gateway_add(out, "dropped", gateway_dropped_out(o->config));
    gateway_add(out, "config",
                gateway_text_out(mhe_config_write(o->config, &config, &err), config, &err));
    return out;
}

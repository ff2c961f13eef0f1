/* SPDX-License-Identifier: Apache-2.0 */
/* mhe_gateway: libmhe.so for MATLAB and Octave, one function with a word in front; the classes of
 * +myohorizon call it and are what users see.
 *
 *     h = mhe_gateway("open", config, {"key=value", ...})   estimator; h is a uint64 number
 *     e = mhe_gateway("push", h, t, markers, emg, angles)   [] or a struct
 *     mhe_gateway("prepare" | "close", h)
 *     i = mhe_gateway("info", h)                            names, window, ...
 *     r = mhe_gateway("run", config, sets)                  a whole recording, struct of matrices
 *     s = mhe_gateway("model_info", file)                   JSON
 *     s = mhe_gateway("model_evaluate", file, json)         JSON
 *     t = mhe_gateway("read", "markers" | "signals", file)  struct time, values, labels
 *     s = mhe_gateway("version")
 *
 * Handles are numbers of a table, so that a stale or made-up one is an error and no crash. */
#include "gateway.h"

#include <mhe/estimator.h>
#include <mhe/inspect.h>
#include <mhe/table.h>
#include <string.h>

#define GATEWAY_MAX 256 /* estimators at once */

typedef struct opened {
    uint64_t id; /* 0: free */
    mhe_config *config;
    mhe_estimator *estimator;
    mhe_estimator_info info;
} opened;

static opened table[GATEWAY_MAX];
static uint64_t last_id;

static void close_one(opened *o) {
    mhe_estimator_close(o->estimator);
    mhe_config_close(o->config);
    memset(o, 0, sizeof *o);
}

static void close_all(void) {
    for (int i = 0; i < GATEWAY_MAX; i++) {
        if (table[i].id != 0) {
            close_one(&table[i]);
        }
    }
}

static opened *opened_of(const mxArray *value) {
    if (value != NULL && mxIsClass(value, "uint64") && mxGetNumberOfElements(value) == 1) {
        const uint64_t id = *(const uint64_t *)mxGetData(value);
        for (int i = 0; i < GATEWAY_MAX && id != 0; i++) {
            if (table[i].id == id) {
                return &table[i];
            }
        }
    }
    mexErrMsgIdAndTxt("myohorizon:closed", "the estimator is closed");
    return NULL;
}

/* ---- the estimator ---- */

static mxArray *open_estimator(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    int32_t n = 0;
    opened *o = NULL;
    char *path = gateway_text_of(gateway_argument(nrhs, prhs, 1), "config");
    const char **sets = gateway_sets_of(gateway_argument(nrhs, prhs, 2), &n);
    for (int i = 0; i < GATEWAY_MAX && o == NULL; i++) {
        o = table[i].id == 0 ? &table[i] : NULL;
    }
    if (o == NULL) {
        mexErrMsgIdAndTxt("myohorizon:argument", "%d estimators are open; close some", GATEWAY_MAX);
        return NULL;
    }
    mhe_status status = mhe_config_read(path, sets, n, 0, &gateway_host, &o->config, &err);
    status = status == MHE_OK ? mhe_estimator_create(o->config, &o->estimator, &err) : status;
    if (status != MHE_OK) {
        close_one(o);
        gateway_refuse(status, &err);
    }
    o->id = ++last_id;
    o->info.size = sizeof o->info;
    (void)mhe_estimator_describe(o->estimator, &o->info);
    mexLock(); /* while it is open the gateway stays loaded */
    mxArray *out = mxCreateNumericMatrix(1, 1, mxUINT64_CLASS, mxREAL);
    *(uint64_t *)mxGetData(out) = o->id;
    return out;
}

static void close_estimator(int nrhs, const mxArray *prhs[]) {
    close_one(opened_of(gateway_argument(nrhs, prhs, 1)));
    mexUnlock();
}

static mxArray *info_out(const opened *o) {
    mxArray *out = mxCreateStructMatrix(1, 1, 0, NULL);
    mhe_estimator_info info = {.size = sizeof info};
    (void)mhe_estimator_describe(o->estimator, &info);
    gateway_add(out, "coordinate_names", gateway_names_out(info.coordinate_names, info.n_q));
    gateway_add(out, "muscle_names", gateway_names_out(info.muscle_names, info.n_muscles));
    gateway_add(out, "marker_names", gateway_names_out(info.marker_names, info.n_markers));
    gateway_add_number(out, "window", info.window);
    gateway_add_number(out, "ratio", info.ratio);
    gateway_add_number(out, "interval", info.interval);
    gateway_add_number(out, "node", info.node);
    gateway_add_number(out, "delay", info.delay);
    gateway_add_number(out, "phase", info.phase);
    return out;
}

static mxArray *estimate_out(const mhe_estimator_info *info, const mhe_estimate *e) {
    mxArray *out = mxCreateStructMatrix(1, 1, 0, NULL);
    gateway_add_number(out, "time", e->time);
    gateway_add_number(out, "status", e->status);
    gateway_add_number(out, "iterations", e->iterations);
    gateway_add_number(out, "kkt_residual", e->kkt_residual);
    gateway_add_number(out, "solve_time", e->solve_time);
    gateway_add_number(out, "latency", e->latency);
    gateway_add_number(out, "marker_rms", e->marker_rms);
    gateway_add_number(out, "emg_rms", e->emg_rms);
    gateway_add(out, "q", gateway_vector_out(e->q, info->n_q));
    gateway_add(out, "qdot", gateway_vector_out(e->qdot, info->n_q));
    gateway_add(out, "activation", gateway_vector_out(e->activation, info->n_muscles));
    gateway_add(out, "excitation", gateway_vector_out(e->excitation, info->n_muscles));
    gateway_add(out, "force", gateway_vector_out(e->force, info->n_muscles));
    gateway_add(out, "moment", gateway_vector_out(e->moment, info->n_q));
    gateway_add(out, "residual", gateway_vector_out(e->residual, info->n_residual_torques));
    gateway_add(out, "markers", gateway_matrix_out(e->markers, info->n_markers, 3));
    gateway_add(out, "force_sd",
                gateway_vector_out(e->force_sd, info->n_muscles)); /* with output.uncertainty */
    return out;
}

static mxArray *push(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    opened *o = opened_of(gateway_argument(nrhs, prhs, 1));
    const int32_t n = o->info.n_markers;
    int32_t ready = 0;
    mhe_frame frame = {.size = sizeof frame,
                       .time = gateway_number_of(gateway_argument(nrhs, prhs, 2), "t")};
    mhe_estimate estimate = {.size = sizeof estimate};
    const double *markers = gateway_matrix_of(gateway_argument(nrhs, prhs, 3), "markers", n, 3);
    double *rows = NULL;
    frame.emg = gateway_matrix_of(gateway_argument(nrhs, prhs, 4), "emg", o->info.n_muscles, 1);
    frame.angles = gateway_matrix_of(gateway_argument(nrhs, prhs, 5), "angles", o->info.n_q, 1);
    if (markers != NULL) { /* columns there, rows here */
        rows = mxMalloc(sizeof *rows * 3 * (size_t)n);
        for (int32_t i = 0; i < n; i++) {
            for (int32_t k = 0; k < 3; k++) {
                rows[3 * i + k] = markers[k * n + i];
            }
        }
        frame.markers = rows;
    }
    const mhe_status status = mhe_estimator_push(o->estimator, &frame, &estimate, &ready, &err);
    mxFree(rows);
    if (status != MHE_OK) {
        gateway_refuse(status, &err);
    }
    return ready ? estimate_out(&o->info, &estimate) : mxCreateDoubleMatrix(0, 0, mxREAL);
}

static void prepare(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    const mhe_status status =
        mhe_estimator_prepare(opened_of(gateway_argument(nrhs, prhs, 1))->estimator, &err);
    if (status != MHE_OK) {
        gateway_refuse(status, &err);
    }
}

/* ---- models, files ---- */

static mxArray *model_info(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    char *text = NULL, *file = gateway_text_of(gateway_argument(nrhs, prhs, 1), "file");
    const mhe_status status = mhe_model_info(&gateway_host, file, MHE_FORMAT_JSON, &text, &err);
    return gateway_text_out(status, text, &err);
}

static mxArray *model_evaluate(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    char *text = NULL, *file = gateway_text_of(gateway_argument(nrhs, prhs, 1), "file");
    char *poses = gateway_text_of(gateway_argument(nrhs, prhs, 2), "poses");
    const mhe_status status = mhe_model_evaluate(&gateway_host, file, "poses", poses, strlen(poses),
                                                 MHE_PATHS_EXACT, &text, &err);
    return gateway_text_out(status, text, &err);
}

static mxArray *read_table(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    mhe_table *file = NULL;
    mhe_table_info info = {.size = sizeof info};
    char *kind = gateway_text_of(gateway_argument(nrhs, prhs, 1), "kind");
    char *path = gateway_text_of(gateway_argument(nrhs, prhs, 2), "file");
    mhe_status status = strcmp(kind, "markers") == 0 ? mhe_table_read_markers(path, &file, &err)
                                                     : mhe_table_read_signals(path, &file, &err);
    status = status == MHE_OK ? mhe_table_describe(file, &info, &err) : status;
    mxArray *out = status == MHE_OK ? mxCreateStructMatrix(1, 1, 0, NULL) : NULL;
    if (out != NULL) {
        gateway_add(out, "time", gateway_vector_out(info.time, info.n_rows));
        gateway_add(out, "values", gateway_matrix_out(info.values, info.n_rows, info.n_columns));
        gateway_add(out, "labels", gateway_names_out(info.labels, info.n_labels));
        gateway_add_number(out, "rate", info.rate);
        gateway_add_number(out, "in_degrees", info.in_degrees);
        gateway_add(out, "warnings", gateway_names_out(info.warnings, info.n_warnings));
    }
    mhe_table_close(file);
    if (status != MHE_OK) {
        gateway_refuse(status, &err);
    }
    return out;
}

void mexFunction(int nlhs, mxArray *plhs[], int nrhs, const mxArray *prhs[]) {
    static int registered;
    (void)nlhs;
    if (!registered) {
        (void)mexAtExit(close_all);
        registered = 1;
    }
    char *word = gateway_text_of(gateway_argument(nrhs, prhs, 0), "the first argument");
    if (strcmp(word, "push") == 0) {
        plhs[0] = push(nrhs, prhs);
    } else if (strcmp(word, "prepare") == 0) {
        prepare(nrhs, prhs);
    } else if (strcmp(word, "open") == 0) {
        plhs[0] = open_estimator(nrhs, prhs);
    } else if (strcmp(word, "close") == 0) {
        close_estimator(nrhs, prhs);
    } else if (strcmp(word, "info") == 0) {
        plhs[0] = info_out(opened_of(gateway_argument(nrhs, prhs, 1)));
    } else if (strcmp(word, "run") == 0) {
        plhs[0] = gateway_run_recording(nrhs, prhs);
    } else if (strcmp(word, "model_info") == 0) {
        plhs[0] = model_info(nrhs, prhs);
    } else if (strcmp(word, "model_evaluate") == 0) {
        plhs[0] = model_evaluate(nrhs, prhs);
    } else if (strcmp(word, "read") == 0) {
        plhs[0] = read_table(nrhs, prhs);
    } else if (strcmp(word, "version") == 0) {
        plhs[0] = mxCreateString(mhe_version());
    } else {
        mexErrMsgIdAndTxt("myohorizon:argument", "mhe_gateway knows no '%s'", word);
    }
}

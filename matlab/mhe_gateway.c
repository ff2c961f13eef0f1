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
#include "mex.h"

#include <mhe/estimator.h>
#include <mhe/findings.h>
#include <mhe/inspect.h>
#include <mhe/library.h>
#include <mhe/table.h>
#include <stdlib.h>
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

static void log_line(const mhe_host *host, int32_t level, const char *text) {
    (void)host;
    if (level <= MHE_LOG_WARNING) {
        mexPrintf("myohorizon: %s\n", text);
    }
}

static const void *no_service(const mhe_host *host, const char *id) {
    (void)host, (void)id;
    return NULL;
}

static const mhe_host host = {.size = sizeof host, .log = log_line, .service = no_service};

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

/* Does not come back. The identifier is that of the status. */
static void refuse(mhe_status status, const mhe_error *err) {
    const char *id = status == MHE_E_ARGUMENT      ? "myohorizon:argument"
                     : status == MHE_E_CONFIG      ? "myohorizon:config"
                     : status == MHE_E_INPUT       ? "myohorizon:input"
                     : status == MHE_E_PLUGIN      ? "myohorizon:plugin"
                     : status == MHE_E_UNSUPPORTED ? "myohorizon:unsupported"
                     : status == MHE_E_MEMORY      ? "myohorizon:memory"
                                                   : "myohorizon:error";
    mexErrMsgIdAndTxt(id, "%s", err->text[0] != '\0' ? err->text : mhe_status_text(status));
}

/* ---- what comes in ---- */

/* mxFree() it. */
static char *text_of(const mxArray *value, const char *name) {
    char *text = value != NULL && mxIsChar(value) ? mxArrayToString(value) : NULL;
    if (text == NULL) {
        mexErrMsgIdAndTxt("myohorizon:argument", "%s: a text is needed", name);
    }
    return text;
}

static const mxArray *argument(int nrhs, const mxArray *prhs[], int i) {
    return i < nrhs ? prhs[i] : NULL;
}

static double number_of(const mxArray *value, const char *name) {
    if (value == NULL || !mxIsDouble(value) || mxIsComplex(value) ||
        mxGetNumberOfElements(value) != 1) {
        mexErrMsgIdAndTxt("myohorizon:argument", "%s: a number is needed", name);
    }
    return mxGetScalar(value);
}

/* Numbers of a matrix [rows x columns]; NULL for []. */
static const double *matrix_of(const mxArray *value, const char *name, int32_t rows,
                               int32_t columns) {
    if (value == NULL || mxIsEmpty(value)) {
        return NULL;
    }
    if (!mxIsDouble(value) || mxIsComplex(value) || mxIsSparse(value)) {
        mexErrMsgIdAndTxt("myohorizon:argument", "%s: a full matrix of real doubles is needed",
                          name);
    }
    const int vector =
        columns == 1 && mxGetM(value) == 1 && mxGetNumberOfElements(value) == (size_t)rows;
    if (mxGetNumberOfDimensions(value) != 2 ||
        (!vector && (mxGetM(value) != (size_t)rows || mxGetN(value) != (size_t)columns))) {
        mexErrMsgIdAndTxt("myohorizon:argument",
                          "%s: the size is %d x %d; this model takes %d x %d", name,
                          (int)mxGetM(value), (int)mxGetN(value), (int)rows, (int)columns);
    }
    return mxGetPr(value);
}

/* The assignments of a cell array of texts; the interpreter frees them. */
static const char **sets_of(const mxArray *value, int32_t *n) {
    *n = 0;
    if (value == NULL || mxIsEmpty(value)) {
        return NULL;
    }
    if (!mxIsCell(value)) {
        mexErrMsgIdAndTxt("myohorizon:argument", "assignments: a cell array of texts is needed");
    }
    *n = (int32_t)mxGetNumberOfElements(value);
    const char **sets = mxMalloc(sizeof *sets * (size_t)*n);
    for (int32_t i = 0; i < *n; i++) {
        sets[i] = text_of(mxGetCell(value, (mwIndex)i), "assignments");
    }
    return sets;
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

/* ---- what goes out ---- */

static mxArray *vector_out(const double *values, int32_t n) {
    mxArray *out = mxCreateDoubleMatrix((mwSize)(values == NULL ? 0 : n), 1, mxREAL);
    if (values != NULL) {
        memcpy(mxGetPr(out), values, sizeof *values * (size_t)n);
    }
    return out;
}

/* Row-major [rows x columns] as a matrix. */
static mxArray *matrix_out(const double *values, int32_t rows, int32_t columns) {
    mxArray *out = mxCreateDoubleMatrix((mwSize)rows, (mwSize)columns, mxREAL);
    double *to = mxGetPr(out);
    for (int32_t i = 0; i < rows; i++) {
        for (int32_t j = 0; j < columns; j++) {
            to[(size_t)j * (size_t)rows + (size_t)i] =
                values[(size_t)i * (size_t)columns + (size_t)j];
        }
    }
    return out;
}

static mxArray *names_out(const char *const *names, int32_t n) {
    mxArray *out = mxCreateCellMatrix(1, (mwSize)n);
    for (int32_t i = 0; i < n; i++) {
        mxSetCell(out, (mwIndex)i, mxCreateString(names[i]));
    }
    return out;
}

static void add(mxArray *out, const char *name, mxArray *value) {
    const int field = mxAddField(out, name);
    if (field >= 0) {
        mxSetFieldByNumber(out, 0, field, value);
    }
}

static void add_number(mxArray *out, const char *name, double value) {
    add(out, name, mxCreateDoubleScalar(value));
}

/* A text that the library made, handed over to the interpreter. */
static mxArray *text_out(mhe_status status, char *text, const mhe_error *err) {
    if (status != MHE_OK) {
        refuse(status, err);
    }
    mxArray *out = mxCreateString(text);
    mhe_free(text);
    return out;
}

/* ---- the estimator ---- */

static mxArray *open_estimator(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    int32_t n = 0;
    opened *o = NULL;
    char *path = text_of(argument(nrhs, prhs, 1), "config");
    const char **sets = sets_of(argument(nrhs, prhs, 2), &n);
    for (int i = 0; i < GATEWAY_MAX && o == NULL; i++) {
        o = table[i].id == 0 ? &table[i] : NULL;
    }
    if (o == NULL) {
        mexErrMsgIdAndTxt("myohorizon:argument", "%d estimators are open; close some", GATEWAY_MAX);
        return NULL;
    }
    mhe_status status = mhe_config_read(path, sets, n, 0, &host, &o->config, &err);
    status = status == MHE_OK ? mhe_estimator_create(o->config, &o->estimator, &err) : status;
    if (status != MHE_OK) {
        close_one(o);
        refuse(status, &err);
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
    close_one(opened_of(argument(nrhs, prhs, 1)));
    mexUnlock();
}

static mxArray *info_out(const opened *o) {
    mxArray *out = mxCreateStructMatrix(1, 1, 0, NULL);
    mhe_estimator_info info = {.size = sizeof info};
    (void)mhe_estimator_describe(o->estimator, &info);
    add(out, "coordinate_names", names_out(info.coordinate_names, info.n_q));
    add(out, "muscle_names", names_out(info.muscle_names, info.n_muscles));
    add(out, "marker_names", names_out(info.marker_names, info.n_markers));
    add_number(out, "window", info.window);
    add_number(out, "ratio", info.ratio);
    add_number(out, "interval", info.interval);
    add_number(out, "node", info.node);
    add_number(out, "delay", info.delay);
    add_number(out, "phase", info.phase);
    return out;
}

static mxArray *estimate_out(const mhe_estimator_info *info, const mhe_estimate *e) {
    mxArray *out = mxCreateStructMatrix(1, 1, 0, NULL);
    add_number(out, "time", e->time);
    add_number(out, "status", e->status);
    add_number(out, "iterations", e->iterations);
    add_number(out, "kkt_residual", e->kkt_residual);
    add_number(out, "solve_time", e->solve_time);
    add_number(out, "latency", e->latency);
    add_number(out, "marker_rms", e->marker_rms);
    add_number(out, "emg_rms", e->emg_rms);
    add(out, "q", vector_out(e->q, info->n_q));
    add(out, "qdot", vector_out(e->qdot, info->n_q));
    add(out, "activation", vector_out(e->activation, info->n_muscles));
    add(out, "excitation", vector_out(e->excitation, info->n_muscles));
    add(out, "force", vector_out(e->force, info->n_muscles));
    add(out, "moment", vector_out(e->moment, info->n_q));
    add(out, "residual", vector_out(e->residual, info->n_residual_torques));
    add(out, "markers", matrix_out(e->markers, info->n_markers, 3));
    add(out, "force_sd", vector_out(e->force_sd, info->n_muscles)); /* with output.uncertainty */
    return out;
}

static mxArray *push(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    opened *o = opened_of(argument(nrhs, prhs, 1));
    const int32_t n = o->info.n_markers;
    int32_t ready = 0;
    mhe_frame frame = {.size = sizeof frame, .time = number_of(argument(nrhs, prhs, 2), "t")};
    mhe_estimate estimate = {.size = sizeof estimate};
    const double *markers = matrix_of(argument(nrhs, prhs, 3), "markers", n, 3);
    double *rows = NULL;
    frame.emg = matrix_of(argument(nrhs, prhs, 4), "emg", o->info.n_muscles, 1);
    frame.angles = matrix_of(argument(nrhs, prhs, 5), "angles", o->info.n_q, 1);
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
        refuse(status, &err);
    }
    return ready ? estimate_out(&o->info, &estimate) : mxCreateDoubleMatrix(0, 0, mxREAL);
}

static void prepare(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    const mhe_status status =
        mhe_estimator_prepare(opened_of(argument(nrhs, prhs, 1))->estimator, &err);
    if (status != MHE_OK) {
        refuse(status, &err);
    }
}

/* ---- a whole recording ---- */

typedef struct run {
    mhe_config *config;
    mhe_estimator *estimator;
    mhe_recording *recording;
    mhe_findings *findings;
    mhe_estimator_info info;
    mhe_recording_info data;
    int32_t n, weight;
    double *rows[8]; /* time, then what `widths` says, estimate after estimate */
    char *text;
    mhe_rmse rmse;
} run;

static const char *const run_names[8] = {"time",       "q",     "qdot",   "activation",
                                         "excitation", "force", "moment", "markers"};

static int32_t run_width(const run *r, int k) {
    const int32_t n_m = r->info.n_muscles, n_q = r->info.n_q;
    const int32_t widths[8] = {
        1, n_q, n_q, n_m, r->info.formulation == 0 ? n_m : 0, n_m, n_q, 3 * r->info.n_markers};
    return widths[k];
}

static void run_close(run *r) {
    for (int k = 0; k < 8; k++) {
        free(r->rows[k]);
    }
    mhe_free(r->text);
    mhe_findings_close(r->findings);
    mhe_recording_close(r->recording);
    mhe_estimator_close(r->estimator);
    mhe_config_close(r->config);
}

static mhe_status run_open(run *r, const char *path, const char **sets, int32_t n, mhe_error *err) {
    mhe_truth truth = {.size = sizeof truth};
    r->info.size = sizeof r->info;
    r->data.size = sizeof r->data;
    mhe_status status = mhe_config_read(path, sets, n, 0, &host, &r->config, err);
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
    for (int k = 0; k < 8 && status == MHE_OK; k++) {
        r->rows[k] =
            malloc(sizeof(double) * ((size_t)run_width(r, k) * (size_t)r->data.n_frames + 1));
        status = r->rows[k] == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    }
    return status;
}

static void run_keep(run *r, const mhe_estimate *e) {
    const double *const values[8] = {&e->time,      e->q,     e->qdot,   e->activation,
                                     e->excitation, e->force, e->moment, e->markers};
    for (int k = 0; k < 8; k++) {
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

static mxArray *run_out(const run *r) {
    static const char *const verdicts[] = {"yes", "doubtful", "no"};
    mxArray *out = mxCreateStructMatrix(1, 1, 0, NULL);
    for (int k = 0; k < 8; k++) {
        add(out, run_names[k], matrix_out(r->rows[k], r->n, run_width(r, k)));
    }
    add(out, "coordinate_names", names_out(r->info.coordinate_names, r->info.n_q));
    add(out, "muscle_names", names_out(r->info.muscle_names, r->info.n_muscles));
    add(out, "marker_names", names_out(r->info.marker_names, r->info.n_markers));
    add(out, "verdict", mxCreateString(verdicts[r->weight]));
    add(out, "text", mxCreateString(r->text));
    if (r->data.has_reference) {
        mxArray *rmse = mxCreateStructMatrix(1, 1, 0, NULL);
        add_number(rmse, "q", r->rmse.q);
        add_number(rmse, "qdot", r->rmse.qdot);
        add_number(rmse, "activation", r->rmse.activation);
        add_number(rmse, "force", r->rmse.force);
        add_number(rmse, "marker", r->rmse.marker);
        add(out, "rmse", rmse);
    }
    return out;
}

static mxArray *run_recording(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    int32_t n = 0;
    char *path = text_of(argument(nrhs, prhs, 1), "config");
    const char **sets = sets_of(argument(nrhs, prhs, 2), &n);
    run r;
    memset(&r, 0, sizeof r);
    mhe_status status = run_open(&r, path, sets, n, &err);
    status = status == MHE_OK ? run_all(&r, &err) : status;
    mxArray *out = status == MHE_OK ? run_out(&r) : NULL;
    run_close(&r);
    if (status != MHE_OK) {
        refuse(status, &err);
    }
    return out;
}

/* ---- models, files ---- */

static mxArray *model_info(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    char *text = NULL, *file = text_of(argument(nrhs, prhs, 1), "file");
    const mhe_status status = mhe_model_info(&host, file, MHE_FORMAT_JSON, &text, &err);
    return text_out(status, text, &err);
}

static mxArray *model_evaluate(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    char *text = NULL, *file = text_of(argument(nrhs, prhs, 1), "file");
    char *poses = text_of(argument(nrhs, prhs, 2), "poses");
    const mhe_status status = mhe_model_evaluate(&host, file, "poses", poses, strlen(poses),
                                                 MHE_PATHS_EXACT, &text, &err);
    return text_out(status, text, &err);
}

static mxArray *read_table(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    mhe_table *file = NULL;
    mhe_table_info info = {.size = sizeof info};
    char *kind = text_of(argument(nrhs, prhs, 1), "kind");
    char *path = text_of(argument(nrhs, prhs, 2), "file");
    mhe_status status = strcmp(kind, "markers") == 0 ? mhe_table_read_markers(path, &file, &err)
                                                     : mhe_table_read_signals(path, &file, &err);
    status = status == MHE_OK ? mhe_table_describe(file, &info, &err) : status;
    mxArray *out = status == MHE_OK ? mxCreateStructMatrix(1, 1, 0, NULL) : NULL;
    if (out != NULL) {
        add(out, "time", vector_out(info.time, info.n_rows));
        add(out, "values", matrix_out(info.values, info.n_rows, info.n_columns));
        add(out, "labels", names_out(info.labels, info.n_labels));
        add_number(out, "rate", info.rate);
        add_number(out, "in_degrees", info.in_degrees);
        add(out, "warnings", names_out(info.warnings, info.n_warnings));
    }
    mhe_table_close(file);
    if (status != MHE_OK) {
        refuse(status, &err);
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
    char *word = text_of(argument(nrhs, prhs, 0), "the first argument");
    if (strcmp(word, "push") == 0) {
        plhs[0] = push(nrhs, prhs);
    } else if (strcmp(word, "prepare") == 0) {
        prepare(nrhs, prhs);
    } else if (strcmp(word, "open") == 0) {
        plhs[0] = open_estimator(nrhs, prhs);
    } else if (strcmp(word, "close") == 0) {
        close_estimator(nrhs, prhs);
    } else if (strcmp(word, "info") == 0) {
        plhs[0] = info_out(opened_of(argument(nrhs, prhs, 1)));
    } else if (strcmp(word, "run") == 0) {
        plhs[0] = run_recording(nrhs, prhs);
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

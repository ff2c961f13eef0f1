/* SPDX-License-Identifier: Apache-2.0 */
#include "gateway.h"

#include <stdlib.h>
#include <string.h>

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

const mhe_host gateway_host = {.size = sizeof gateway_host, .log = log_line, .service = no_service};

void gateway_refuse(mhe_status status, const mhe_error *err) {
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

char *gateway_text_of(const mxArray *value, const char *name) {
    char *text = value != NULL && mxIsChar(value) ? mxArrayToString(value) : NULL;
    if (text == NULL) {
        mexErrMsgIdAndTxt("myohorizon:argument", "%s: a text is needed", name);
    }
    return text;
}

char *gateway_optional_text_of(const mxArray *value, const char *name) {
    return value == NULL || mxIsEmpty(value) ? NULL : gateway_text_of(value, name);
}

const mxArray *gateway_argument(int nrhs, const mxArray *prhs[], int i) {
    return i < nrhs ? prhs[i] : NULL;
}

double gateway_number_of(const mxArray *value, const char *name) {
    if (value == NULL || !mxIsDouble(value) || mxIsComplex(value) ||
        mxGetNumberOfElements(value) != 1) {
        mexErrMsgIdAndTxt("myohorizon:argument", "%s: a number is needed", name);
    }
    return mxGetScalar(value);
}

int32_t gateway_count_of(const mxArray *value, const char *name) {
    const double number = gateway_number_of(value, name);
    if (!(number >= -2147483648.0 && number <= 2147483647.0) || number != (double)(int32_t)number) {
        mexErrMsgIdAndTxt("myohorizon:argument", "%s: a whole number is needed", name);
    }
    return (int32_t)number;
}

const double *gateway_matrix_of(const mxArray *value, const char *name, int32_t rows,
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

const char **gateway_texts_of(const mxArray *value, const char *name, int32_t *n) {
    *n = 0;
    if (value == NULL || mxIsEmpty(value)) {
        return NULL;
    }
    if (!mxIsCell(value)) {
        mexErrMsgIdAndTxt("myohorizon:argument", "%s: a cell array of texts is needed", name);
    }
    *n = (int32_t)mxGetNumberOfElements(value);
    const char **texts = mxMalloc(sizeof *texts * (size_t)*n);
    for (int32_t i = 0; i < *n; i++) {
        texts[i] = gateway_text_of(mxGetCell(value, (mwIndex)i), name);
    }
    return texts;
}

mhe_status gateway_config_of(int nrhs, const mxArray *prhs[], mhe_config **config, mhe_error *err) {
    int32_t n = 0;
    const char *text = gateway_text_of(gateway_argument(nrhs, prhs, 1), "config");
    const char **sets = gateway_texts_of(gateway_argument(nrhs, prhs, 2), "assignments", &n);
    const char *folder = gateway_optional_text_of(gateway_argument(nrhs, prhs, 3), "folder");
    const mxArray *trust = gateway_argument(nrhs, prhs, 4);
    const uint32_t flags =
        trust != NULL && mxIsLogicalScalar(trust) && *mxGetLogicals(trust) ? MHE_CONFIG_TRUST : 0;
    *config = NULL;
    if (strchr(text, '\n') != NULL) {
        return mhe_config_parse("config", text, strlen(text), folder, sets, n, flags, &gateway_host,
                                config, err);
    }
    if (folder != NULL) {
        mexErrMsgIdAndTxt("myohorizon:argument",
                          "folder is for a config given as a struct or a text; a file has its own");
    }
    return mhe_config_read(text, sets, n, flags, &gateway_host, config, err);
}

static uint64_t last_handle;

uint64_t gateway_new_handle(void) {
    return ++last_handle;
}

mxArray *gateway_handle_out(uint64_t id) {
    mxArray *out = mxCreateNumericMatrix(1, 1, mxUINT64_CLASS, mxREAL);
    *(uint64_t *)mxGetData(out) = id;
    return out;
}

uint64_t gateway_handle_of(const mxArray *value) {
    const int is_one =
        value != NULL && mxIsClass(value, "uint64") && mxGetNumberOfElements(value) == 1;
    return is_one ? *(const uint64_t *)mxGetData(value) : 0;
}

/* ---- what goes out ---- */

mxArray *gateway_struct(void) {
    return mxCreateStructMatrix(1, 1, 0, NULL);
}

mxArray *gateway_dropped_out(const mhe_config *config) {
    int32_t n = 0;
    while (mhe_config_dropped(config, n) != NULL) {
        n++;
    }
    mxArray *out = mxCreateCellMatrix(1, (mwSize)n);
    for (int32_t i = 0; i < n; i++) {
        mxSetCell(out, (mwIndex)i, mxCreateString(mhe_config_dropped(config, i)));
    }
    return out;
}

void gateway_add_names(mxArray *out, const mhe_estimator_info *info) {
    gateway_add(out, "coordinate_names", gateway_names_out(info->coordinate_names, info->n_q));
    gateway_add(out, "muscle_names", gateway_names_out(info->muscle_names, info->n_muscles));
    gateway_add(out, "marker_names", gateway_names_out(info->marker_names, info->n_markers));
}

mxArray *gateway_vector_out(const double *values, int32_t n) {
    mxArray *out = mxCreateDoubleMatrix((mwSize)(values == NULL ? 0 : n), 1, mxREAL);
    if (values != NULL) {
        memcpy(mxGetPr(out), values, sizeof *values * (size_t)n);
    }
    return out;
}

mxArray *gateway_matrix_out(const double *values, int32_t rows, int32_t columns) {
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

mxArray *gateway_names_out(const char *const *names, int32_t n) {
    mxArray *out = mxCreateCellMatrix(1, (mwSize)n);
    for (int32_t i = 0; i < n; i++) {
        mxSetCell(out, (mwIndex)i, mxCreateString(names[i]));
    }
    return out;
}

void gateway_add(mxArray *out, const char *name, mxArray *value) {
    const int field = mxAddField(out, name);
    if (field >= 0) {
        mxSetFieldByNumber(out, 0, field, value);
    }
}

void gateway_add_number(mxArray *out, const char *name, double value) {
    gateway_add(out, name, mxCreateDoubleScalar(value));
}

mxArray *gateway_text_out(mhe_status status, char *text, const mhe_error *err) {
    if (status != MHE_OK) {
        gateway_refuse(status, err);
    }
    mxArray *out = mxCreateString(text);
    mhe_free(text);
    return out;
}

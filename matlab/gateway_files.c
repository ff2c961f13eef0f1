/* SPDX-License-Identifier: Apache-2.0 */
/* Models, files with time series, the catalogue of plugins. */
#define _GNU_SOURCE /* dladdr, realpath */
#include "gateway.h"

#include <dlfcn.h>
#include <limits.h>
#include <mhe/inspect.h>
#include <mhe/table.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

mxArray *gateway_model_info(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    char *text = NULL, *file = gateway_text_of(gateway_argument(nrhs, prhs, 1), "file");
    const mhe_status status = mhe_model_info(&gateway_host, file, MHE_FORMAT_JSON, &text, &err);
    return gateway_text_out(status, text, &err);
}

mxArray *gateway_model_evaluate(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    char *text = NULL, *file = gateway_text_of(gateway_argument(nrhs, prhs, 1), "file");
    char *poses = gateway_text_of(gateway_argument(nrhs, prhs, 2), "poses");
    char *paths = gateway_text_of(gateway_argument(nrhs, prhs, 3), "paths");
    const int fitted = strcmp(paths, "fitted") == 0;
    if (!fitted && strcmp(paths, "exact") != 0) {
        mexErrMsgIdAndTxt("myohorizon:argument", "paths: 'exact' or 'fitted', not '%s'", paths);
    }
    const mhe_status status =
        mhe_model_evaluate(&gateway_host, file, "poses", poses, strlen(poses),
                           fitted ? MHE_PATHS_FITTED : MHE_PATHS_EXACT, &text, &err);
    return gateway_text_out(status, text, &err);
}

mxArray *gateway_read(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    mhe_table *file = NULL;
    mhe_table_info info = {.size = sizeof info};
    char *kind = gateway_text_of(gateway_argument(nrhs, prhs, 1), "kind");
    char *path = gateway_text_of(gateway_argument(nrhs, prhs, 2), "file");
    const int is_markers = strcmp(kind, "markers") == 0;
    mhe_status status = is_markers ? mhe_table_read_markers(path, &file, &err)
                                   : mhe_table_read_signals(path, &file, &err);
    status = status == MHE_OK ? mhe_table_describe(file, &info, &err) : status;
    mxArray *out = status == MHE_OK ? gateway_struct() : NULL;
    if (out != NULL) {
        gateway_add(out, "time", gateway_vector_out(info.time, info.n_rows));
        gateway_add(out, "values", gateway_matrix_out(info.values, info.n_rows, info.n_columns));
        gateway_add(out, "labels", gateway_names_out(info.labels, info.n_labels));
        gateway_add(out, "unit", mxCreateString(is_markers ? "m" : ""));
        gateway_add_number(out, "rate", info.rate);
        gateway_add(out, "in_degrees", mxCreateLogicalScalar(info.in_degrees != 0));
        gateway_add(out, "warnings", gateway_names_out(info.warnings, info.n_warnings));
    }
    mhe_table_close(file);
    if (status != MHE_OK) {
        gateway_refuse(status, &err);
    }
    return out;
}

mxArray *gateway_plugins(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    char *text = NULL;
    (void)nrhs, (void)prhs;
    const mhe_status status = mhe_plugins_list(&gateway_host, MHE_FORMAT_JSON, &text, &err);
    return gateway_text_out(status, text, &err);
}

mxArray *gateway_describe(int nrhs, const mxArray *prhs[]) {
    mhe_error err = {0};
    char *text = NULL, *id = gateway_text_of(gateway_argument(nrhs, prhs, 1), "id");
    const mhe_status status = mhe_plugins_describe(&gateway_host, id, MHE_FORMAT_JSON, &text, &err);
    return gateway_text_out(status, text, &err);
}

mxArray *gateway_version(int nrhs, const mxArray *prhs[]) {
    (void)nrhs, (void)prhs;
    return mxCreateString(mhe_version());
}

/* The folder with the programs that came with this library, seen from where that lies; '' where
 * they are those of the PATH. */
mxArray *gateway_programs(int nrhs, const mxArray *prhs[]) {
    static const char *const places[] = {"../bin", "../../bin", "../../../bin"};
    char library[PATH_MAX], folder[PATH_MAX];
    Dl_info info;
    (void)nrhs, (void)prhs;
    if (dladdr(mhe_version(), &info) != 0 && realpath(info.dli_fname, library) != NULL) {
        char *slash = strrchr(library, '/');
        for (size_t i = 0; slash != NULL && i < sizeof places / sizeof places[0]; i++) {
            const int n = snprintf(folder, sizeof folder, "%.*s/%s", (int)(slash - library),
                                   library, places[i]);
            char program[PATH_MAX + 8];
            (void)snprintf(program, sizeof program, "%s/mhe-run", folder);
            if (n < (int)sizeof folder && access(program, X_OK) == 0) {
                return mxCreateString(folder);
            }
        }
    }
    return mxCreateString("");
}

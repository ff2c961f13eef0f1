/* SPDX-License-Identifier: Apache-2.0 */
/* What the gateway's files share: arguments in, values out, errors. None of these functions comes
 * back where something is wrong: the interpreter unwinds, and frees what mx functions gave. */
#ifndef GATEWAY_H
#define GATEWAY_H

#include "mex.h"

#include <mhe/config.h>
#include <mhe/estimator.h>
#include <mhe/library.h>

extern const mhe_host gateway_host;

/* Does not come back. The identifier is that of the status. */
void gateway_refuse(mhe_status status, const mhe_error *err);
/* mxFree() it. */
char *gateway_text_of(const mxArray *value, const char *name);
/* The same; NULL where there is none or [] was given. */
char *gateway_optional_text_of(const mxArray *value, const char *name);
const mxArray *gateway_argument(int nrhs, const mxArray *prhs[], int i);
double gateway_number_of(const mxArray *value, const char *name);
/* A whole number that fits. */
int32_t gateway_count_of(const mxArray *value, const char *name);
/* Numbers of a matrix [rows x columns]; NULL for []. */
const double *gateway_matrix_of(const mxArray *value, const char *name, int32_t rows,
                                int32_t columns);
/* The texts of a cell array; the interpreter frees them. NULL for []. */
const char **gateway_texts_of(const mxArray *value, const char *name, int32_t *n);
/* What every function that takes a config has behind its word: (config, assignments, folder,
 * trust). A config of several lines is one itself, its paths start at the folder. Closed by the
 * caller. */
mhe_status gateway_config_of(int nrhs, const mxArray *prhs[], mhe_config **config, mhe_error *err);

mxArray *gateway_struct(void);
mxArray *gateway_vector_out(const double *values, int32_t n);
/* Row-major [rows x columns] as a matrix. */
mxArray *gateway_matrix_out(const double *values, int32_t rows, int32_t columns);
mxArray *gateway_names_out(const char *const *names, int32_t n);
/* What of the model file was left out. */
mxArray *gateway_dropped_out(const mhe_config *config);
void gateway_add(mxArray *out, const char *name, mxArray *value);
void gateway_add_number(mxArray *out, const char *name, double value);
/* A text that the library made, handed over to the interpreter. */
mxArray *gateway_text_out(mhe_status status, char *text, const mhe_error *err);
/* Names of what is estimated, into a struct. */
void gateway_add_names(mxArray *out, const mhe_estimator_info *info);

/* Handles are numbers, each given once, so that a stale or made-up one is an error and no crash. */
uint64_t gateway_new_handle(void);
mxArray *gateway_handle_out(uint64_t id);
/* 0: no handle. */
uint64_t gateway_handle_of(const mxArray *value);

/* What a word does: its arguments are those behind the word at 0. NULL: nothing to hand back. */
typedef mxArray *gateway_function(int nrhs, const mxArray *prhs[]);

/* gateway_estimator.c */
gateway_function gateway_open, gateway_close, gateway_push, gateway_prepare, gateway_info,
    gateway_measure, gateway_open_emg, gateway_push_emg, gateway_tracked, gateway_set_start,
    gateway_set_node, gateway_set_deadline;
void gateway_close_estimators(void);
/* gateway_run.c: a struct of matrices; what --check finds. */
gateway_function gateway_run_recording, gateway_check_config;
/* gateway_files.c */
gateway_function gateway_model_info, gateway_model_evaluate, gateway_read, gateway_plugins,
    gateway_describe, gateway_version, gateway_programs;
/* gateway_live.c */
gateway_function gateway_live_open, gateway_live_run, gateway_live_command, gateway_live_state,
    gateway_live_summary, gateway_live_close;
void gateway_close_lives(void);

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* What the gateway's files share: arguments in, values out, errors. None of these functions comes
 * back where something is wrong: the interpreter unwinds, and frees what mx functions gave. */
#ifndef GATEWAY_H
#define GATEWAY_H

#include "mex.h"

#include <mhe/library.h>

extern const mhe_host gateway_host;

/* Does not come back. The identifier is that of the status. */
void gateway_refuse(mhe_status status, const mhe_error *err);
/* mxFree() it. */
char *gateway_text_of(const mxArray *value, const char *name);
const mxArray *gateway_argument(int nrhs, const mxArray *prhs[], int i);
double gateway_number_of(const mxArray *value, const char *name);
/* Numbers of a matrix [rows x columns]; NULL for []. */
const double *gateway_matrix_of(const mxArray *value, const char *name, int32_t rows,
                                int32_t columns);
/* The assignments of a cell array of texts; the interpreter frees them. */
const char **gateway_sets_of(const mxArray *value, int32_t *n);
mxArray *gateway_vector_out(const double *values, int32_t n);
/* Row-major [rows x columns] as a matrix. */
mxArray *gateway_matrix_out(const double *values, int32_t rows, int32_t columns);
mxArray *gateway_names_out(const char *const *names, int32_t n);
void gateway_add(mxArray *out, const char *name, mxArray *value);
void gateway_add_number(mxArray *out, const char *name, double value);
/* A text that the library made, handed over to the interpreter. */
mxArray *gateway_text_out(mhe_status status, char *text, const mhe_error *err);

/* ("run", config, sets): a struct of matrices. */
mxArray *gateway_run_recording(int nrhs, const mxArray *prhs[]);

#endif

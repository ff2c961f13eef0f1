/* SPDX-License-Identifier: Apache-2.0 */
/* compat.h: what SUNDIALS 6 and 7 do not have in common. */
#ifndef INTEGRATOR_SUNDIALS_COMPAT_H
#define INTEGRATOR_SUNDIALS_COMPAT_H

#include <cvodes/cvodes.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_config.h>
#include <sundials/sundials_types.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

_Static_assert(sizeof(sunrealtype) == sizeof(double), "SUNDIALS must be built for double");

struct flow_context;

/* Gives `text` to flow_note; in flow.c. */
void flow_note(struct flow_context *c, const char *text);

#if SUNDIALS_VERSION_MAJOR >= 7
#define FLOW_TRUE SUNTRUE
static inline int flow_sundials_create(SUNContext *out) {
    return SUNContext_Create(SUN_COMM_NULL, out);
}
static inline void flow_on_error(int line, const char *function, const char *file, const char *text,
                                 SUNErrCode code, void *data, SUNContext sundials) {
    (void)line, (void)function, (void)file, (void)code, (void)sundials;
    flow_note(data, text);
}
/* Takes the messages away from the terminal. */
static inline int flow_catch_messages(SUNContext sundials, void *cvode, struct flow_context *c) {
    (void)cvode;
    SUNContext_ClearErrHandlers(sundials);
    return SUNContext_PushErrHandler(sundials, flow_on_error, c);
}
#else
#define FLOW_TRUE 1
static inline int flow_sundials_create(SUNContext *out) {
    return SUNContext_Create(NULL, out);
}
static inline void flow_on_error(int code, const char *module, const char *function, char *text,
                                 void *data) {
    (void)code, (void)module, (void)function;
    flow_note(data, text);
}
static inline int flow_catch_messages(SUNContext sundials, void *cvode, struct flow_context *c) {
    (void)sundials;
    return CVodeSetErrHandlerFn(cvode, flow_on_error, c);
}
#endif

#endif

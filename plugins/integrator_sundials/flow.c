/* SPDX-License-Identifier: Apache-2.0 */
/* flow.c: instances, contexts, and the step over a shooting interval. */
#include "flow.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void flow_note(struct flow_context *c, const char *text) {
    if (c->status == MHE_OK) {
        (void)mhe_fail(&c->error, MHE_E_NUMERIC, "CVODES: %s", text);
    }
}

static mhe_status flow_create(const mhe_host *host, const mhe_system *system, const void *config,
                              void **self, mhe_error *err) {
    (void)host;
    struct flow *flow = calloc(1, sizeof *flow);
    if (flow == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory for an integrator");
    }
    flow->system = system;
    flow->config = *(const struct flow_config *)config;
    *self = flow;
    return MHE_OK;
}

static void flow_destroy(void *self) {
    free(self);
}

static void flow_context_destroy(void *context) {
    struct flow_context *c = context;
    if (c == NULL) {
        return;
    }
    CVodeFree(&c->cvode);
    if (c->solver != NULL) {
        SUNLinSolFree(c->solver);
    }
    if (c->matrix != NULL) {
        SUNMatDestroy(c->matrix);
    }
    if (c->sens != NULL) {
        N_VDestroyVectorArray(c->sens, c->n_sens);
    }
    if (c->x != NULL) {
        N_VDestroy(c->x);
    }
    if (c->sundials != NULL) {
        SUNContext_Free(&c->sundials);
    }
    free(c->memory);
    free(c);
}

/* Arrays of our own. */
static mhe_status flow_context_arrays(struct flow_context *c, mhe_error *err) {
    const mhe_system *system = c->flow->system;
    size_t n_q = (size_t)system->n_q, n_m = (size_t)system->n_m, n_z = (size_t)system->n_z;
    size_t n_p = (size_t)system->n_p, n_sens = (size_t)c->n_sens, total = 0;
    const struct {
        double **array;
        size_t n;
    } arrays[] = {{&c->vdot, n_q},
                  {&c->f_q, n_q * n_q},
                  {&c->f_v, n_q * n_q},
                  {&c->f_a, n_q * (size_t)system->n_a},
                  {&c->f_r, n_q * (size_t)system->n_r},
                  {&c->f_z, n_q * n_z},
                  {&c->f_p, n_q * n_p},
                  {&c->zdot, n_z},
                  {&c->z_q, n_z * n_q},
                  {&c->z_v, n_z * n_q},
                  {&c->z_a, n_z},
                  {&c->z_c, n_z},
                  {&c->z_z, n_z * (size_t)system->n_k},
                  {&c->z_p, n_z * n_p},
                  {&c->rate, n_m},
                  {&c->rate_e, n_m},
                  {&c->rate_a, n_m},
                  {&c->tolerance, n_sens}};
    for (size_t i = 0; i < sizeof arrays / sizeof arrays[0]; i++) {
        total += arrays[i].n;
    }
    c->memory = calloc(total, sizeof *c->memory);
    if (c->memory == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory for an integrator");
    }
    double *next = c->memory;
    for (size_t i = 0; i < sizeof arrays / sizeof arrays[0]; i++) {
        *arrays[i].array = next;
        next += arrays[i].n;
    }
    for (size_t i = 0; i < n_sens; i++) {
        c->tolerance[i] = c->flow->config.atol;
    }
    return MHE_OK;
}

/* The objects of SUNDIALS. */
static mhe_status flow_context_vectors(struct flow_context *c, mhe_error *err) {
    int32_t n_x = c->flow->system->n_x;
    int method = c->flow->config.method == FLOW_ADAMS ? CV_ADAMS : CV_BDF;
    if (flow_sundials_create(&c->sundials) == 0) {
        c->x = N_VNew_Serial(n_x, c->sundials);
        c->matrix = SUNDenseMatrix(n_x, n_x, c->sundials);
        c->cvode = CVodeCreate(method, c->sundials);
    }
    if (c->x != NULL && c->matrix != NULL) {
        N_VConst(0, c->x);
        c->solver = SUNLinSol_Dense(c->x, c->matrix, c->sundials);
        c->sens = N_VCloneVectorArray(c->n_sens, c->x);
    }
    return c->cvode != NULL && c->solver != NULL && c->sens != NULL
               ? MHE_OK
               : mhe_fail(err, MHE_E_MEMORY, "CVODES could not be set up for %d states", n_x);
}

static mhe_status flow_context_options(struct flow_context *c, mhe_error *err) {
    const struct flow_config *config = &c->flow->config;
    for (int32_t i = 0; i < c->n_sens; i++) {
        N_VConst(0, c->sens[i]);
    }
    if (flow_catch_messages(c->sundials, c->cvode, c) == 0 &&
        CVodeInit(c->cvode, flow_rate, 0, c->x) == 0 && CVodeSetUserData(c->cvode, c) == 0 &&
        CVodeSStolerances(c->cvode, config->rtol, config->atol) == 0 &&
        CVodeSetMaxNumSteps(c->cvode, config->max_steps) == 0 &&
        CVodeSetLinearSolver(c->cvode, c->solver, c->matrix) == 0 &&
        CVodeSetJacFn(c->cvode, flow_jacobian) == 0 &&
        CVodeSensInit(c->cvode, c->n_sens, CV_STAGGERED, flow_sens_rate, c->sens) == 0 &&
        CVodeSensSStolerances(c->cvode, config->rtol, c->tolerance) == 0 &&
        CVodeSetSensErrCon(c->cvode, FLOW_TRUE) == 0) {
        return MHE_OK;
    }
    return mhe_fail(err, MHE_E_INTERNAL, "CVODES refused its set-up: %s", c->error.text);
}

static mhe_status flow_context_create(const void *self, void *system_context, void **context,
                                      mhe_error *err) {
    const struct flow *flow = self;
    struct flow_context *c = calloc(1, sizeof *c);
    if (c == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory for an integrator");
    }
    c->flow = flow;
    c->system_context = system_context;
    c->n_sens = flow->system->n_x + flow->system->n_u + flow->system->n_p;
    mhe_status status = flow_context_arrays(c, err);
    if (status == MHE_OK) {
        status = flow_context_vectors(c, err);
    }
    if (status == MHE_OK) {
        status = flow_context_options(c, err);
    }
    if (status != MHE_OK) {
        flow_context_destroy(c);
        return status;
    }
    *context = c;
    return MHE_OK;
}

/* Puts CVODES at the start of an interval of length dt. */
static int flow_begin(struct flow_context *c, const double *x, double dt, int32_t sensitivities) {
    int32_t n_x = c->flow->system->n_x;
    memcpy(N_VGetArrayPointer(c->x), x, sizeof(double) * (size_t)n_x);
    int flag = CVodeReInit(c->cvode, 0, c->x);
    if (flag == CV_SUCCESS) {
        flag = CVodeSetStopTime(c->cvode, dt);
    }
    if (flag != CV_SUCCESS || !sensitivities) {
        return flag != CV_SUCCESS ? flag : CVodeSensToggleOff(c->cvode);
    }
    for (int32_t i = 0; i < c->n_sens; i++) {
        N_VConst(0, c->sens[i]);
        if (i < n_x) {
            N_VGetArrayPointer(c->sens[i])[i] = 1;
        }
    }
    return CVodeSensReInit(c->cvode, CV_STAGGERED, c->sens);
}

/* What CVODES' failure means to a solver: a shorter step may help, or nothing does. */
static mhe_status flow_failure(const struct flow_context *c, int flag, mhe_error *err) {
    mhe_status status = MHE_RETRY;
    if (c->status < 0) {
        status = c->status;
    } else if (flag == CV_MEM_FAIL) {
        status = MHE_E_MEMORY;
    } else if (flag == CV_MEM_NULL || flag == CV_NO_MALLOC || flag == CV_ILL_INPUT) {
        status = MHE_E_INTERNAL;
    }
    return mhe_fail(err, status, "%s", c->error.text);
}

/* The sensitivities as A, B and, where it is wanted, P. */
static void flow_derivatives(const struct flow_context *c, const mhe_step_derivatives *out) {
    const mhe_system *system = c->flow->system;
    const int32_t n_x = system->n_x, n_u = system->n_u, n_p = system->n_p;
    for (int32_t k = 0; k < c->n_sens; k++) {
        const double *column = N_VGetArrayPointer(c->sens[k]);
        for (int32_t i = 0; i < n_x; i++) {
            if (k < n_x) {
                out->A[i * n_x + k] = column[i];
            } else if (k < n_x + n_u) {
                out->B[i * n_u + k - n_x] = column[i];
            } else if (out->P != NULL) {
                out->P[i * n_p + k - n_x - n_u] = column[i];
            }
        }
    }
}

static mhe_status flow_step(void *context, const double *x, const double *u, const double *w,
                            double dt, double *memory, double *x_next,
                            const mhe_step_derivatives *out, mhe_error *err) {
    struct flow_context *c = context;
    (void)memory;
    const int32_t n_x = c->flow->system->n_x, derivatives = out != NULL && out->A != NULL;
    sunrealtype reached = 0;
    c->u = u;
    c->w = w;
    c->status = MHE_OK;
    c->error.text[0] = '\0';
    int flag = flow_begin(c, x, dt, derivatives);
    if (flag == CV_SUCCESS) {
        flag = CVode(c->cvode, dt, c->x, &reached, CV_NORMAL);
    }
    if (flag >= 0 && derivatives) {
        flag = CVodeGetSens(c->cvode, &reached, c->sens);
    }
    if (flag < 0) {
        return flow_failure(c, flag, err);
    }
    memcpy(x_next, N_VGetArrayPointer(c->x), sizeof(double) * (size_t)n_x);
    if (derivatives) {
        flow_derivatives(c, out);
    }
    return MHE_OK;
}

const mhe_integrator_ops flow_ops = {.size = sizeof flow_ops,
                                     .create = flow_create,
                                     .destroy = flow_destroy,
                                     .context_create = flow_context_create,
                                     .context_destroy = flow_context_destroy,
                                     .step = flow_step};

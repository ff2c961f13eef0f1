/* SPDX-License-Identifier: Apache-2.0 */
/* flow.h: the flow of an mhe_system by CVODES with forward sensitivities. */
#ifndef INTEGRATOR_SUNDIALS_FLOW_H
#define INTEGRATOR_SUNDIALS_FLOW_H

#include "compat.h"

#include <mhe/integrator.h>

#define FLOW_BDF 0
#define FLOW_ADAMS 1

/* Filled by the core from the option table in plugin.c. */
struct flow_config {
    int32_t method; /* FLOW_BDF, FLOW_ADAMS */
    double rtol, atol;
    int32_t max_steps;
};

struct flow {
    const mhe_system *system;
    struct flow_config config;
};

/* One thread's memory. Parameters of the sensitivities: the n_x initial states, then the n_u
 * controls, then the system's n_p parameters. */
struct flow_context {
    const struct flow *flow;
    void *system_context;
    const double *u, *w; /* [n_u], [n_w] of the step in work */
    mhe_status status;   /* worst that the system has answered in it */
    mhe_error error;     /* and what it, or else CVODES, had to say */

    double *memory;                            /* all arrays below */
    double *vdot;                              /* [n_q] */
    double *f_q, *f_v, *f_a, *f_r, *f_z, *f_p; /* derivatives of the accelerations */
    double *z_q, *z_v, *z_a, *z_c, *z_z, *z_p; /* of the rates of z */
    double *zdot;                              /* [n_z] */
    double *rate, *rate_e, *rate_a;            /* [n_m] activation rates */
    double *tolerance;                         /* [n_sens] absolute, of the sensitivities */

    SUNContext sundials;
    void *cvode;
    N_Vector x;
    N_Vector *sens; /* [n_sens] */
    int32_t n_sens; /* n_x + n_u + n_p */
    SUNMatrix matrix;
    SUNLinearSolver solver;
};

/* Right-hand side, its Jacobian and the right-hand sides of the sensitivities; `data` is the
 * context. [hot] */
int flow_rate(sunrealtype t, N_Vector x, N_Vector xdot, void *data);
int flow_jacobian(sunrealtype t, N_Vector x, N_Vector xdot, SUNMatrix J, void *data, N_Vector a,
                  N_Vector b, N_Vector c);
int flow_sens_rate(int n, sunrealtype t, N_Vector x, N_Vector xdot, N_Vector *sens,
                   N_Vector *sens_dot, void *data, N_Vector a, N_Vector b);

/* Notes a line of CVODES unless the system itself has said what went wrong. */
void flow_note(struct flow_context *c, const char *text);

extern const mhe_integrator_ops flow_ops;

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* ipopt_solver.h: shared by the files of this plugin. */
#ifndef IPOPT_SOLVER_H
#define IPOPT_SOLVER_H

#include "compat.h"
#include "nlp.h"

struct ipopt_config { /* filled from the option table of solver_ipopt.c */
    double tolerance;
    int32_t max_iterations;
    double acceptable_tolerance;
    int32_t acceptable_iterations;
    int32_t mu_strategy; /* position in "auto|adaptive|monotone" */
    double mu_init_warm;
    double objective_scale;
    int32_t adapt_curvature;
    const char *linear_solver;
    int32_t print_level;
    mhe_text_map options;
};

/* Factor on the Gauss-Newton Hessian. It leaves out the curvature of the dynamics; where that is
 * strong, full steps overshoot or creep along one direction, and the ratio of two successive steps
 * tells the right factor for that direction. */
typedef struct ipopt_curvature {
    int32_t n;
    double factor;
    double factor_before;      /* of the step before the last */
    double length;             /* of the last step, 1: in full; 0: none yet */
    double length_before;      /* of the step before it */
    double *point, *direction; /* [n] the last iterate and `factor` times the direction that led to
                                  it; NULL: not adapted */
} ipopt_curvature;

typedef struct ipopt_solver {
    const mhe_host *host;
    const struct ipopt_config *config;
    nlp nlp;
    IpoptProblem ipopt; /* for the bounds of the last solve; NULL before the first */
    double scale;       /* of the objective; 0 before the first solve */
    /* As Ipopt orders them: the iterate, its multipliers; then memory for whatever; [n_all] each.
     */
    double *v, *z_lower, *z_upper, *lambda, *work;

    ipopt_curvature curvature;
    const mhe_solve_control *control; /* of the running solve */
    int32_t stopped;                  /* MHE_SOLVE_DEADLINE or _INTERRUPTED once asked to; else 0 */
    int32_t iterations;
    double begun;        /* s of CLOCK_MONOTONIC, of the first iteration */
    double kkt_residual; /* scaled primal and dual infeasibility of the last iterate */
    double constant_gap; /* largest of the equations in which nothing is free, at the result */
} ipopt_solver;

/* callbacks.c: an Ipopt problem for the current bounds of p, or NULL; user data is the
 * ipopt_solver. All arrays are overwritten: those of variables [n], of g [m]. */
IpoptProblem ipopt_problem(const nlp *p, double *lower, double *upper, double *g_lower,
                           double *g_upper);

/* curvature.c: forgets the last solve. */
void curvature_begin(ipopt_curvature *c, int32_t n);
/* Sets the factor for the step from point v [n]. */
void curvature_adapt(ipopt_curvature *c, const double *v);

/* settings.c: makes Ipopt silent and hands it all options that stay the same between solves.
 * MHE_E_CONFIG names an option that Ipopt does not take. */
mhe_status ipopt_configure(IpoptProblem ipopt, const struct ipopt_config *config, double scale,
                           mhe_error *err);
/* Would ipopt_configure() take these? [cold] */
mhe_status ipopt_check(const struct ipopt_config *config, mhe_error *err);
/* Start from given multipliers, or not. */
void ipopt_warm_start(IpoptProblem ipopt, const struct ipopt_config *config, int32_t warm);

#endif

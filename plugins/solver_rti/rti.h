/* SPDX-License-Identifier: Apache-2.0 */
/* rti.h: sequential quadratic programming on the stage problem; shared by the files of this
 * plugin.
 *
 * An iteration linearises all stages at w = (u_0, x_0, u_1, ..., x_N), solves the quadratic program
 * in the step (Gauss-Newton Hessian, bounds) and moves. With one iteration a window this is the
 * real-time iteration (Diehl, Bock and Schloeder 2005, doi:10.1137/S0363012902400713). */
#ifndef RTI_H
#define RTI_H

#include "qp.h"

enum { RTI_SPEED, RTI_BALANCED, RTI_ROBUST };

struct rti_config { /* filled from the option table of plugin.c */
    int32_t preset;
    double tolerance;
    int32_t max_iterations;
    int32_t max_qp_iterations;
    double regularisation;
    double objective_scale;
};

/* The problem at one iterate. */
typedef struct rti_point {
    double *w;        /* [size_z] */
    qp_stage *stages; /* [N+1]; objective scaled; b = F_k(x_k, u_k) - x_{k+1} */
    double cost;      /* scaled */
    double damping;   /* what the diagonals of the Hessians hold on top */
} rti_point;

/* Largest violations of the optimality conditions, scaled. */
typedef struct rti_residuals {
    double stationarity, gap, complementarity;
} rti_residuals;

typedef struct rti_solver {
    const mhe_host *host;
    const struct rti_config *config;
    const mhe_stage_problem *problem;
    qp_shape shape;
    qp qp;
    rti_point here, trial;
    double *lower, *upper;                          /* [size_z] of w */
    double *lambda, *z_lower, *z_upper;             /* at `here` */
    double *slope, *gaps;                           /* scratch [size_z], [size_x] */
    double *xx, *ux, *uu, *A, *B, *grad_u, *x_next; /* one stage as evaluate() writes it */
    double scale;                                   /* of the objective; 0 before the first solve */
    double penalty; /* of the gaps in the merit function; this solve's */
    double damping; /* Levenberg's, of the next step */
    int32_t warm;   /* the multipliers are worth a start */
    double gap_sum; /* at `here` */
    rti_residuals residuals;
    double seconds;     /* spent in evaluate() */
    mhe_status failure; /* negative status of evaluate() */
    mhe_error *err;     /* the caller's, for its text */
    void *memory;
} rti_solver;

/* linear.c: evaluates all stages at point->w, with derivatives or values alone (cost and b). 0: the
 * point has no value, or evaluate() failed (solver->failure). */
int32_t rti_evaluate(rti_solver *s, rti_point *point, int32_t derivatives);
/* One over the geometric mean of the controls' positive curvatures (of the states' where there are
 * none): the scale of the objective, as in solver_ipopt. */
double rti_scale_of(const rti_solver *s, const rti_point *point);
void rti_rescale(rti_solver *s, rti_point *point, double factor);
/* Puts Levenberg's term damping/2 |step|^2 on the Hessians in the place of the present one. */
void rti_set_damping(rti_solver *s, rti_point *point, double damping);
double rti_gap_sum(const rti_solver *s, const rti_point *point);
/* Residuals at `here`; leaves the slope of the Lagrangian without bounds in s->slope. */
void rti_measure(rti_solver *s);

/* step.c: one iteration from `here`, whose derivatives are known. `last`: the new point is
 * wanted with values alone. */
#define RTI_MOVED 0
#define RTI_STUCK 1      /* no step helps */
#define RTI_INFEASIBLE 2 /* ... towards the bounds and the dynamics both */
#define RTI_SMALL 3      /* moved, by less than the tolerance */
int32_t rti_step_full(rti_solver *s, int32_t last);
int32_t rti_step_globalised(rti_solver *s);

/* sqp.c */
mhe_status rti_create(const mhe_host *host, const mhe_stage_problem *problem, const void *config,
                      void **self, mhe_error *err);
void rti_destroy(void *self);
mhe_status rti_solve(void *self, const mhe_solve_control *control, mhe_solution *solution,
                     mhe_solve_info *info, mhe_error *err);

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* rti.h: sequential quadratic programming on the stage problem; shared by the files of this
 * plugin.
 *
 * An iteration linearises all stages at w = (u_0, x_0, u_1, ..., x_N), solves the quadratic program
 * in the step (Gauss-Newton Hessian, bounds) and moves. With one iteration a window this is the
 * real-time iteration (Diehl, Bock and Schloeder 2005, doi:10.1137/S0363012902400713). */
#ifndef RTI_H
#define RTI_H

#include "pool.h"
#include "qp.h"

enum { RTI_SPEED, RTI_BALANCED, RTI_ROBUST };

struct rti_config { /* filled from the option table of plugin.c */
    int32_t preset;
    double tolerance;
    int32_t max_iterations;
    int32_t max_qp_iterations;
    double regularisation;
    double objective_scale;
    double settled;
    double spin;
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

/* One stage as evaluate() writes it, and why it did not; one thread's. */
typedef struct rti_worker {
    double *xx, *ux, *uu, *A, *B, *grad_x, *grad_u, *x_next;
    double *px, *pu, *pp, *P, *grad_p;
    mhe_error error;
    int32_t error_stage;
} rti_worker;

/* The step that ends a real-time iteration: nothing but the first gap is evaluated behind it. */
typedef struct rti_leap {
    int32_t taken;
    int32_t solved;   /* the program was, to its tolerance */
    double length;    /* part of its step */
    double left;      /* largest gap at the result, by the linearisation */
    double front;     /* its longest component among those of u_0 (see step.c) and x_1 */
    double first_gap; /* largest |x_1 - F_0| at the result */
    double cost;      /* scaled, of the quadratic model at the result */
} rti_leap;

/* What a program came to. */
typedef struct rti_program_result {
    double *w, *lambda, *z_lower, *z_upper; /* as in qp */
    double stationarity, feasibility, complementarity, open;
} rti_program_result;

typedef struct rti_solver {
    const mhe_host *host;
    const struct rti_config *config;
    const mhe_stage_problem *problem;
    qp_shape shape;
    qp qp;
    rti_point here, trial;
    int32_t prepared;                   /* `here` holds its dynamics, from prepare() */
    double *lower, *upper;              /* [size_z] of w */
    double *lambda, *z_lower, *z_upper; /* at `here` */
    double *slope, *gaps;               /* scratch [size_z], [size_x] */
    rti_program_result first;           /* of a program whose step is looked at twice */
    rti_program_result last;     /* of the iteration before (between.c), without its residuals, */
    double *last_from;           /* [size_z] the iterate it starts from, */
    double last_damping;         /* of it */
    int32_t last_is_known;       /* in this solve */
    int32_t missed_kinks;        /* in it */
    double *before;              /* [size_z] the iterate before last_from */
    int32_t on_kink;             /* the last step went along one */
    int32_t stays;               /* the solution is at a kink, the iterate there already */
    double *result;              /* [size_z] w of the last solve */
    int32_t has_result;          /* it gave one; 2: its covariances are known */
    double *spread;              /* [N+1][n_x x ld_x] covariances of x, of the scaled cost */
    double *gain, *rest, *joint; /* scratch [n_u x ld_x], [n_u x ld_z], [n_z x ld_z] */
    rti_pool *pool;
    rti_worker *workers;              /* [n_workers of the problem] */
    double *stage_cost;               /* [N+1] of the last evaluation, not scaled */
    mhe_status *stage_status;         /* [N+1] */
    double scale;                     /* of the objective; 0 before the first solve */
    double *weight;                   /* [size_x] of each gap in the merit of this solve */
    double penalty;                   /* the largest of them */
    double damping;                   /* Levenberg's, of the next step */
    double held;                      /* the same where there is no slope left (search.c) */
    int32_t on_level;                 /* iterates in a row without one */
    int32_t warm;                     /* the multipliers are worth a start */
    int32_t real_time;                /* this solve goes by full steps */
    double gap_sum;                   /* at `here` */
    rti_residuals residuals;          /* at the last linearisation */
    double least_excess;              /* of the points of this solve, see rti_excess() */
    rti_leap leap;                    /* of the last step, if a real-time iteration ended with it */
    double deadline;                  /* this solve's; infinity: none */
    const mhe_solve_control *control; /* this solve's, or NULL */
    double iteration_time;            /* s, of this solve's last iteration */
    double full_time, leap_time;      /* s, of the last real-time ones of each kind, of any solve */
    double seconds;                   /* spent in evaluate() */
    mhe_status failure;               /* negative status of evaluate() */
    mhe_error *err;                   /* the caller's, for its text */
    void *memory;
} rti_solver;

/* linear.c: evaluates stages at point->w; what of them is wanted: */
#define RTI_DYNAMICS 1    /* b; with derivatives F too */
#define RTI_COSTS 2       /* cost; with derivatives H and g too */
#define RTI_DERIVATIVES 4 /* of those wanted */
#define RTI_ALL 7
/* 0: the point has no value, or evaluate() failed (solver->failure). What is asked for alone is bit
 * by bit what it is together with other parts, if evaluate() keeps to that, and so it is with any
 * number of threads. */
int32_t rti_evaluate(rti_solver *s, rti_point *point, int32_t wanted);
/* Largest |x_1 - F_0(x_0, u_0)| at w; infinite without a value there. */
double rti_first_gap(rti_solver *s, const double *w);
/* One over the geometric mean of the controls' positive curvatures (of the states' where there are
 * none): the scale of the objective, as in solver_ipopt. */
double rti_scale_of(const rti_solver *s, const rti_point *point);
void rti_rescale(rti_solver *s, rti_point *point, double factor);
/* Puts Levenberg's term damping/2 |step|^2 on the Hessians in the place of the present one. */
void rti_set_damping(rti_solver *s, rti_point *point, double damping);
double rti_gap_sum(const rti_solver *s, const rti_point *point);
/* The same, each gap times its s->weight. */
double rti_weighted_gaps(const rti_solver *s, const rti_point *point);
/* Residuals at a point with these multipliers; overwrites s->slope. */
rti_residuals rti_residuals_of(rti_solver *s, const rti_point *point, const double *lambda,
                               const double *z_lower, const double *z_upper);
/* Their one number, to be compared with the tolerance: gaps and complementarity are held ten times
 * tighter than the slope of the Lagrangian, as by solver_ipopt. */
double rti_excess(const rti_residuals *r);
/* Measures `here`. */
void rti_measure(rti_solver *s);

/* step.c: one iteration from `here`, whose derivatives are known. */
#define RTI_MOVED 0
#define RTI_STUCK 1      /* no step helps */
#define RTI_INFEASIBLE 2 /* ... towards the bounds and the dynamics both */
#define RTI_LATE 3       /* the deadline passed before a step was found */
#define RTI_CUT 4        /* it passed within the program, whose iterate was the last step */
int32_t rti_step_full(rti_solver *s);
/* The last step of a real-time iteration: `here` moves, its stages stay those of the linearisation;
 * fills s->leap. */
int32_t rti_leap_on(rti_solver *s);
/* Its parts: the quadratic program at `here` -> s->qp.w, a step; QP_*. `from_last`: its start is
 * the last program's result. */
int32_t rti_program(rti_solver *s, int32_t from_last);
#define RTI_HALVINGS 8                         /* of a step, at most */
void rti_reach(rti_solver *s, double length);  /* trial.w = here.w + length * step, in the bounds */
void rti_accept(rti_solver *s, double length); /* the trial point becomes `here` */
void rti_accept_multipliers(rti_solver *s, double length);
#define RTI_PENALTY 1.5 /* of the gaps in an exact merit, times the largest multiplier */
double rti_largest_multiplier(const rti_solver *s);
int32_t rti_cut_short(rti_solver *s);    /* from a program that is not to be stepped on further */
int32_t rti_is_over(const void *solver); /* deadline or work; asked before each iteration, too */

/* search.c: the same by a step that must help. `cut`: it may end as RTI_CUT. */
int32_t rti_step_globalised(rti_solver *s, int32_t cut);

/* between.c: the program's result gives way to a mean with the last one, where they go to and fro,
 * and RTI_KINK is what lies between; 0: they do not. The result itself is put aside in `first`,
 * residuals apart; `share` of the last one in the mean. last_from is then this iterate,
 * `before` the one before. */
#define RTI_KINK 2
int32_t rti_between(rti_solver *s, double *share);

/* kink.c: `here` moves to the kink between it and `before`; its linearisation is then the mean of
 * both sides and the program solved. 0: no kink was found, and `here` is no point. */
int32_t rti_step_along_kink(rti_solver *s, double share);
double rti_edge(const rti_solver *s); /* between both sides, in any variable (rad, rad/s, 1) */
/* Is there one between `here` and the end of the program's step, as `before`? */
int32_t rti_finds_kink(rti_solver *s, double *share);

/* create.c */
mhe_status rti_accepts(const mhe_stage_problem *problem, const void *config, mhe_error *err);
mhe_status rti_create(const mhe_host *host, const mhe_stage_problem *problem, const void *config,
                      void **self, mhe_error *err);
void rti_destroy(void *self);
double rti_now(void); /* s of CLOCK_MONOTONIC */

/* covariance.c */
mhe_status rti_covariance(void *self, const mhe_covariance *out, mhe_error *err);

/* step.c: the work that this solve may do is done; `steps` interior-point steps since this was last
 * asked. */
int32_t rti_is_spent(rti_solver *s);
int32_t rti_is_late(const rti_solver *s, double seconds); /* the deadline is nearer than that */
/* Before an evaluation: a replay then knows of each whether the clock broke it off. */
void rti_tick(const rti_solver *s);

/* sqp.c */
mhe_status rti_prepare(void *self, const mhe_solution *start, mhe_error *err);
mhe_status rti_solve(void *self, const mhe_solve_control *control, mhe_solution *solution,
                     mhe_solve_info *info, mhe_error *err);

#endif

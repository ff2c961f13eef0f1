/* SPDX-License-Identifier: Apache-2.0 */
/* solver.h: interface of solver plugins (kind "solver").
 *
 * A solver sees a stage-structured least-squares problem and knows no muscles:
 *
 *     minimise    sum_{k=0}^{N-1} l_k(x_k, u_k) + l_N(x_N)
 *     subject to  x_{k+1} = F_k(x_k, u_k)
 *                 x_lower_k <= x_k <= x_upper_k,   u_lower_k <= u_k <= u_upper_k
 *
 * F_k and l_k may depend on global parameters p [n_p], constant over the nodes, with bounds of
 * their own; where n_p > 0 they are variables too. A solver without them says so (accepts()).
 *
 * Each l_k is half a weighted sum of squares. A variable is fixed where its bounds are equal (the
 * first state of a moving horizon). Lagrangian and signs, with w all x and u:
 *
 *     L = sum_k l_k + sum_k lambda_k^T (x_{k+1} - F_k(x_k, u_k))
 *         - z_lower^T (w - lower) - z_upper^T (upper - w),   z >= 0
 */
#ifndef MHE_SOLVER_H
#define MHE_SOLVER_H

#include <mhe/plugin.h>

#ifdef __cplusplus
extern "C" {
#endif

#define MHE_SOLVER_IFACE "mhe.solver/2"

/* What evaluate() is to compute at node k; NULL: not wanted. Matrices row-major. At the last node u
 * is NULL and the entries for u and the dynamics are not touched. */
typedef struct mhe_stage_values {
    uint32_t size;
    double *cost;    /* [1] l_k */
    double *grad_x;  /* [n_x] */
    double *grad_u;  /* [n_u] */
    double *hess_xx; /* Gauss-Newton, [n_x x n_x] */
    double *hess_ux; /* [n_u x n_x] */
    double *hess_uu; /* [n_u x n_u] */
    double *x_next;  /* [n_x] F_k(x_k, u_k) */
    double *A;       /* dF/dx [n_x x n_x]; A and B both or neither, and only with x_next */
    double *B;       /* dF/du [n_x x n_u] */
    double *P;       /* dF/dp [n_x x n_p]; only with A and B */
    double *grad_p;  /* [n_p] */
    double *hess_px; /* [n_p x n_x] */
    double *hess_pu; /* [n_p x n_u] */
    double *hess_pp; /* [n_p x n_p] */
    /* 1: hess_xx, hess_ux and hess_uu hold 0 already outside of their patterns, and an evaluation
     * may pass over those entries. */
    int32_t hess_clear;
} mhe_stage_values;

/* Told where B = D + C V^T at every node: D has at most one entry a column, n_directions is the
 * number of columns of C (controls that reach the state through few directions: many muscles, few
 * joints). A solver may use it and may ignore it. */
typedef struct mhe_low_rank {
    uint32_t size;
    int32_t n_directions;
} mhe_low_rank;

typedef struct mhe_stage_problem mhe_stage_problem;
struct mhe_stage_problem {
    uint32_t size;
    int32_t n_intervals; /* N >= 1 */
    int32_t n_x, n_u;
    int32_t n_workers; /* evaluate() may run at the same time for workers 0 .. n_workers-1, each of
                        * them at another node */
    /* Bounds [(N+1) x n_x] and [N x n_u], +-infinity allowed; read anew at every solve. */
    const double *x_lower, *x_upper, *u_lower, *u_upper;
    /* Structure: 1 where an entry can be non-zero at any node. A [n_x x n_x], B [n_x x n_u],
     * Gauss-Newton Hessian [n_x x n_x], [n_u x n_x], [n_u x n_u]; the same at all nodes. */
    const uint8_t *A_pattern, *B_pattern, *xx_pattern, *ux_pattern, *uu_pattern;
    void *data; /* the core's own */
    /* Values at node k (0..N) for (x [n_x], u [n_u], NULL at N). What was computed at this node
     * before may move x_next, A, B within the integrator's tolerance. MHE_RETRY: no value here,
     * shorten the step. [hot] */
    mhe_status (*evaluate)(const mhe_stage_problem *problem, int32_t worker, int32_t k,
                           const double *x, const double *u, const mhe_stage_values *out,
                           mhe_error *err);
    int32_t n_p;                     /* global parameters */
    const double *p_lower, *p_upper; /* [n_p] */
    /* Sets the parameters [n_p] of all later evaluations. Not while evaluations run. NULL where n_p
     * = 0. [cold] */
    mhe_status (*set_parameters)(const mhe_stage_problem *problem, const double *p, mhe_error *err);
    const mhe_low_rank *low_rank; /* NULL: nothing is known of B beyond its pattern */
};

/* Iterate, in: start, out: result. All arrays the caller's. */
typedef struct mhe_solution {
    uint32_t size;
    int32_t has_multipliers;     /* in: lambda and z below are a start too; out: 1 */
    double *x;                   /* [(N+1) x n_x] */
    double *u;                   /* [N x n_u] */
    double *lambda;              /* [N x n_x], of x_{k+1} - F_k = 0 */
    double *zx_lower, *zx_upper; /* [(N+1) x n_x], >= 0 */
    double *zu_lower, *zu_upper; /* [N x n_u], >= 0 */
    double *p;                   /* [n_p] */
    double *zp_lower, *zp_upper; /* [n_p], >= 0 */
} mhe_solution;

/* Blocks of the covariance of the solution, (Gauss-Newton Hessian)^-1 on the equality constraints
 * and on what is not at a bound, at the last solve()'s result. NULL: not wanted. */
typedef struct mhe_covariance {
    uint32_t size;
    int32_t node; /* 0 .. N */
    double *xx;   /* [n_x x n_x] of x_node */
    double *ux;   /* [n_u x n_x]; node < N */
    double *uu;   /* [n_u x n_u] */
    double *pp;   /* [n_p x n_p] */
    double *px;   /* [n_p x n_x] */
    double *pu;   /* [n_p x n_u] */
} mhe_covariance;

#define MHE_SOLVE_CONVERGED 0
#define MHE_SOLVE_ITERATION_LIMIT 1
#define MHE_SOLVE_INFEASIBLE 2
#define MHE_SOLVE_FAILED 3 /* no progress, non-finite values; the iterate is the last good one */
#define MHE_SOLVE_DEADLINE 4
#define MHE_SOLVE_INTERRUPTED 5

/* Limits of one solve. */
typedef struct mhe_solve_control {
    uint32_t size;
    double deadline; /* s of CLOCK_MONOTONIC at which to stop with the best iterate; 0: none.
                      * Where this is looked at between iterations, the last one should not begin
                      * if it would end later by the time that those before took. */
    void *data;      /* for progress */
    /* Called after each iteration; non-zero stops with MHE_SOLVE_INTERRUPTED. May be NULL. */
    int32_t (*progress)(void *data, int32_t iteration, double objective, double kkt_residual);
    void *budget; /* for spent */
    /* Not 0: the work that this solve may do is done; the solver then stops as at a deadline. To be
     * asked wherever the deadline is looked at, with the linear systems over all stages that were
     * solved since it was last asked: each solution counts 1, factors of such a system what they
     * take beside it (4 to 6). evaluate() counts for itself. Not while evaluate() runs. May be
     * NULL. */
    int32_t (*spent)(void *budget, int32_t solutions);
    /* Not 0: the deadline is nearer than `seconds`. Where it is given, it is asked instead of the
     * clock (a replay answers what was answered once, whatever the clock says), on the thread that
     * called solve() and not while evaluate() runs. May be NULL. */
    int32_t (*late)(void *budget, double seconds);
    /* Not 0: one iteration, from a start that may be far, however the solver would go on: there is
     * no time for more, and the next solve continues from its result. */
    int32_t one_step;
} mhe_solve_control;

typedef struct mhe_solve_info {
    uint32_t size;
    int32_t outcome; /* MHE_SOLVE_*: a result, not an error */
    int32_t iterations;
    double objective;
    double kkt_residual;    /* largest violation of the optimality conditions, in its own scaling */
    double primal_residual; /* largest |x_{k+1} - F_k| */
    double evaluation_time; /* s spent in evaluate() */
    int32_t programs;       /* quadratic programs solved; 0 where the solver has none */
    int32_t fallbacks;      /* those of them that its fast method gave up and the safe one solved */
} mhe_solve_info;

typedef struct mhe_solver_ops {
    uint32_t size;
    /* `problem` lives until after destroy(); its sizes and patterns do not change. [cold] */
    mhe_status (*create)(const mhe_host *host, const mhe_stage_problem *problem, const void *config,
                         void **self, mhe_error *err);
    void (*destroy)(void *self); /* [cold] */
    /* Negative status only where nothing could be computed at all; a poor result is told by
     * info->outcome. `control` may be NULL. [cold] */
    mhe_status (*solve)(void *self, const mhe_solve_control *control, mhe_solution *solution,
                        mhe_solve_info *info, mhe_error *err);
    /* May be NULL. Does ahead what the next solve() needs and no measurement changes: x_next, A and
     * B of every interval at `start` (x and u; nothing else is read). A solve() that then starts
     * from the same x and u, bit by bit, goes on from there, any other evaluates anew; the result
     * is the same. So the time from a measurement to its estimate holds costs and steps only. A
     * point without values is no error: solve() will meet it. [hot] */
    mhe_status (*prepare)(void *self, const mhe_solution *start, mhe_error *err);
    /* May be NULL: it takes problems without parameters only. Why it cannot solve this kind of
     * problem, asked before create(): a sentence in err and a negative status. [cold] */
    mhe_status (*accepts)(const mhe_stage_problem *problem, const void *config, mhe_error *err);
    /* May be NULL: none can be had. Fills the blocks asked for. MHE_E_NUMERIC: the Hessian is
     * singular there. [cold] */
    mhe_status (*covariance)(void *self, const mhe_covariance *out, mhe_error *err);
} mhe_solver_ops;

#ifdef __cplusplus
}
#endif
#endif

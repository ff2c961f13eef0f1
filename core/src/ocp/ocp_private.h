/* SPDX-License-Identifier: Apache-2.0 */
/* ocp_private.h: the problem's parts, shared by its evaluation (ocp.c) and its making
 * (ocp_build.c). */
#ifndef MHI_OCP_PRIVATE_H
#define MHI_OCP_PRIVATE_H

#include "model/joint_force.h"
#include "ocp/junction.h"
#include "ocp/ocp.h"

/* Memory of one thread. */
typedef struct mhi_ocp_worker {
    mhi_system_context *system;
    void *integrator;
    mhi_term_workspace *terms;  /* [n_terms] */
    double *y, *jacobian;       /* of all signals */
    double *gradient, *hessian; /* [n_z], [n_z x n_z]; z = [x; u; m], see signals.h */
    double *A, *B;              /* of the system alone */
    mhi_joint_force_context *joints[MHI_MAX_REACTIONS]; /* of the problem's */
    double *P;            /* [n_x x n_p of the system], where parameters are estimated */
    double *room;         /* of mhi_parameters_measure */
    mhi_by_parameter *by; /* [n_y] */
    mhi_term_by_p by_p;   /* its sums */
    int32_t linearised;   /* y and jacobian are those of the node and point in work */
} mhi_ocp_worker;

struct mhi_ocp {
    mhe_stage_problem face;
    mhe_problem problem;
    mhe_low_rank low_rank; /* face.low_rank, where it holds */
    mhi_signals signals;
    const mhi_system *system;
    const mhe_integrator_ops *integrator;
    void *integrator_self;
    mhi_term *terms;
    int32_t n_terms, n_terms_created, n_workers_created;
    mhi_joint_force *joints[MHI_MAX_REACTIONS]; /* that costs ask for, as the signals' rows */
    mhe_error no_signal;                        /* why a signal was refused last; empty: never */
    uint32_t wanted;                            /* signals any term reads */
    uint32_t carried;                           /* those of the node before */
    int32_t n_x;    /* of the system; face.n_x = n_x + signals.n_carried */
    int32_t begins; /* 1: what is carried into node 0 is not known */
    double interval;
    const atomic_int *stop; /* NULL: never */
    mhi_work work;
    double *x_lower, *x_upper, *u_lower, *u_upper;
    double *targets; /* [(N+1) x n_y] */
    double *spread;  /* [n_y] of the targets */
    double *times;   /* [N+1] */
    double *inputs;  /* [(N+1) x n_w] */
    int32_t n_w;
    int32_t *reach; /* [n_z] first column that a row of the Hessian's lower triangle can have */
    double *prior_centre, *prior_weight; /* [n_x] */
    const double **prior_at;             /* [N+1] centres at other nodes; NULL: none has one */
    const char *const *entry_names[MHI_N_SIGNALS];
    double *memory;                    /* [N x memory_size] a ring, see interval_memory() */
    int32_t memory_size, first_memory; /* of the integrator, one interval; place of interval 0 */
    mhi_ocp_worker *workers;
    mhi_system *estimated; /* that of the parameters; NULL: none are estimated */
    mhi_parameters parameters;
    mhi_junction junction; /* place NULL: one motion */
    double node_weight;    /* c_k; 0: by time */
    mhi_arena arena;
};

/* The functions that the solver and the costs call. */
const char *const *mhi_ocp_entry_names(const mhe_problem *problem, int32_t signal);
int32_t mhi_ocp_find_signal(const mhe_problem *problem, const char *name, int32_t *n_y,
                            const char **unit);
mhe_status mhi_ocp_evaluate(const mhe_stage_problem *problem, int32_t worker, int32_t k,
                            const double *x, const double *u, const mhe_stage_values *out,
                            mhe_error *err);

mhe_status mhi_ocp_set_parameters(const mhe_stage_problem *problem, const double *p,
                                  mhe_error *err);

/* ocp_calibration.c: what is estimated; MHE_E_CONFIG: a cost that has no place there. */
mhe_status mhi_ocp_set_calibration(mhi_ocp *ocp, const mhi_ocp_setup *setup, mhe_error *err);
/* The signals in `wanted` as they are measured, with their derivatives by parameters. */
mhe_status mhi_ocp_measure_estimated(const mhi_ocp *ocp, mhi_ocp_worker *w, int32_t k,
                                     uint32_t wanted, const double *x, const double *u,
                                     int32_t derivatives, mhe_error *err);
/* A worker's, for the parameters. */
mhe_status mhi_ocp_take_parameter_room(mhi_ocp *ocp, mhi_ocp_worker *w, mhe_error *err);

/* joint_signals.c. Row of the signal `name`, MHI_REACTION and a joint: it is there from now on; -1:
 * refused, for what ocp->no_signal says. */
int32_t mhi_ocp_open_joint(mhi_ocp *ocp, const char *name);
mhe_status mhi_ocp_enter_joints(const mhi_ocp *ocp, mhi_ocp_worker *w, mhe_error *err);
void mhi_ocp_leave_joints(mhi_ocp_worker *w);
void mhi_ocp_close_joints(mhi_ocp *ocp);
/* All signals in `wanted` at node k, into the worker's y and, with derivatives, its jacobian. */
mhe_status mhi_ocp_measure(const mhi_ocp *ocp, mhi_ocp_worker *w, int32_t k, uint32_t wanted,
                           const double *x, const double *u, int32_t derivatives, mhe_error *err);

/* carry.c. Gradient and Hessian as the solver wants them; values of the node before at node k from
 * its state, NaN where there is none; x_next, A and B of an interval with all that is carried. */
void mhi_ocp_spread_carried(const mhi_ocp *ocp, const mhi_ocp_worker *w,
                            const mhe_stage_values *out);
void mhi_ocp_read_carried(const mhi_ocp *ocp, int32_t k, const double *x, double *y);
mhe_status mhi_ocp_step(const mhi_ocp *ocp, mhi_ocp_worker *w, int32_t k, double *memory,
                        const double *x, const double *u, const mhe_stage_values *out,
                        mhe_error *err);
/* What of x_next is carried, behind the system's own. */
mhe_status mhi_ocp_carry_on(const mhi_ocp *ocp, mhi_ocp_worker *w, int32_t k, const double *x,
                            const double *u, double *x_next, mhe_error *err);
/* Inputs of interval k [n_w]; NULL: there are none. */
double *mhi_ocp_inputs_at(const mhi_ocp *ocp, int32_t k);

/* stage_cost.c: cost and derivatives of node k; of a node at which a junction begins or goes on.
 * [hot] */
mhe_status mhi_ocp_cost(const mhi_ocp *ocp, mhi_ocp_worker *worker, int32_t k, const double *x,
                        const double *u, const mhe_stage_values *out, mhe_error *err);
mhe_status mhi_ocp_junction_cost(const mhi_ocp *ocp, mhi_ocp_worker *worker, int32_t k,
                                 const double *x, const double *u, const mhe_stage_values *out,
                                 mhe_error *err);

static inline int32_t mhi_ocp_wants_derivatives(const mhe_stage_values *out) {
    return out->grad_x != NULL || out->grad_u != NULL || out->hess_xx != NULL ||
           out->hess_ux != NULL || out->hess_uu != NULL || out->grad_p != NULL ||
           out->hess_px != NULL || out->hess_pu != NULL || out->hess_pp != NULL;
}

#endif

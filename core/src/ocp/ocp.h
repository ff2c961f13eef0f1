/* SPDX-License-Identifier: Apache-2.0 */
/* ocp.h: direct multiple shooting: system + integrator + costs over N intervals, as the stage
 * problem solvers see.
 *
 *     minimise   sum_k c_k sum_terms weight / sigma^2 * 1/2 |r(y(x_k, u_k))|^2    c_k = interval
 * length (s), last node 1 subject to x_{k+1} = F(x_k, u_k; interval length), bounds
 *
 * The window of the estimator is one of these whose targets and bounds move; a whole motion is one
 * with many intervals. */
#ifndef MHI_OCP_H
#define MHI_OCP_H

#include "ocp/parameters.h"
#include "ocp/term.h"

#include <mhe/integrator.h>
#include <mhe/solver.h>
#include <stdatomic.h>

typedef struct mhi_ocp_setup {
    const mhe_host *host;
    const mhi_system *system;
    const mhe_plugin *integrator;
    const void *integrator_config;
    const mhi_term_setup *terms;
    int32_t n_terms;
    const mhi_tasks *tasks; /* what single markers count; NULL: all 1. Lent */
    int32_t n_intervals;
    double interval;   /* s */
    int32_t n_workers; /* threads that may evaluate at the same time, >= 1 */
    /* For calibration; NULL and 0 else. What is estimated, and the system again, which they change;
     * no term may then read joint reactions or the node before. Which interval of a junction
     * (junction.h) each interval is [n_intervals], -1: of a motion. c_k of all nodes, as
     * samples of noise count; 0: as above. */
    const mhi_parameters_setup *parameters;
    mhi_system *estimated;
    const int32_t *junctions;
    double node_weight;
} mhi_ocp_setup;

typedef struct mhi_ocp mhi_ocp;

mhe_status mhi_ocp_create(const mhi_ocp_setup *setup, mhi_ocp **ocp, mhe_error *err);
void mhi_ocp_free(mhi_ocp *ocp);

const mhe_stage_problem *mhi_ocp_face(const mhi_ocp *ocp); /* what a solver sees */
const mhe_problem *mhi_ocp_problem(const mhi_ocp *ocp);    /* what a cost sees */
const mhi_signals *mhi_ocp_signals(const mhi_ocp *ocp);
const mhi_system *mhi_ocp_system(const mhi_ocp *ocp);

/* The signal that the muscles' controls are: MHI_SIGNAL_EXCITATION or MHI_SIGNAL_ACTIVATION. */
int32_t mhi_ocp_control(const mhi_ocp *ocp);
int32_t mhi_ocp_reads(const mhi_ocp *ocp, int32_t signal); /* 1: a term reads the signal */

/* What the solver's state begins with is the system's; where costs read the node before, what they
 * read follows, divided by a usual size, [face.n_x - n_x] entries that the owner need not know. */
int32_t mhi_ocp_n_x(const mhi_ocp *ocp);
/* 1 (as at the start): nothing is known of a node before node 0; what is carried into it is fixed
 * at 0 and costs see NaN. 0: x_0 holds what was carried, as after a shift. Sets those bounds. */
void mhi_ocp_set_begins(mhi_ocp *ocp, int32_t begins);
/* Fills in what x [(N+1) x face.n_x] carries from its states and u. MHE_RETRY: no value there. */
mhe_status mhi_ocp_carry(mhi_ocp *ocp, double *x, const double *u, mhe_error *err);

/* Arrays that the owner of the problem may write between solves, at node k. */
double *mhi_ocp_x_lower(mhi_ocp *ocp, int32_t k); /* [n_x] */
double *mhi_ocp_x_upper(mhi_ocp *ocp, int32_t k);
double *mhi_ocp_u_lower(mhi_ocp *ocp, int32_t k); /* [n_u] */
double *mhi_ocp_u_upper(mhi_ocp *ocp, int32_t k);
/* Target of a signal (MHI_SIGNAL_*) at node k: [n_y of the signal], NaN where none is known (as at
 * the start); NULL where the problem has no such signal. */
double *mhi_ocp_target(mhi_ocp *ocp, int32_t signal, int32_t k);
/* Standard deviation of a signal's targets over all that was measured [n_y of the signal], NaN (as
 * at the start): not known; told to costs. NULL where the problem has no such signal. */
double *mhi_ocp_target_spread(mhi_ocp *ocp, int32_t signal);
/* Bounds of the parameters for the next solve [n], within those of the setup. */
void mhi_ocp_set_parameter_bounds(mhi_ocp *ocp, const double *lower, const double *upper);
/* The parameters as they were set last; NULL where none are estimated. */
const mhi_parameters *mhi_ocp_parameters(const mhi_ocp *ocp);
/* Inputs of the system at node k [n_w], for what comes with the frames; those from files follow the
 * time. NaN at the start. */
double *mhi_ocp_input(mhi_ocp *ocp, int32_t k);
/* The window moves on by one interval: what the integrator keeps of interval k + 1 becomes that of
 * k, the last one's that of the new one too. */
void mhi_ocp_shift(mhi_ocp *ocp);
/* What the integrator keeps of earlier calls is gone: the next values do not depend on them. */
void mhi_ocp_forget(mhi_ocp *ocp);
void mhi_ocp_set_interval(mhi_ocp *ocp, double interval);    /* s, of all intervals */
void mhi_ocp_set_time(mhi_ocp *ocp, int32_t k, double time); /* s, told to costs */
/* While *stop is not 0 no stage is evaluated (MHE_E_INTERRUPTED), so that a solve ends at once.
 * Lent; NULL (as at the start): never. */
void mhi_ocp_set_stop(mhi_ocp *ocp, const atomic_int *stop);

/* The account that all evaluations and predictions take from; without bound at the start. */
mhi_work *mhi_ocp_work(mhi_ocp *ocp);

/* Adds 1/2 sum_i weight_i (x_i - centre_i)^2 to node 0; both [n_x], copied. All weights 0 (as at
 * the start): none. */
void mhi_ocp_set_prior(mhi_ocp *ocp, const double *centre, const double *weight);

/* The same at another node k, the first of a motion, with a centre of its own [n_x] and these
 * weights; `centre` lent. */
void mhi_ocp_set_prior_at(mhi_ocp *ocp, int32_t k, const double *centre, const double *weight);

/* x_next = F(x, u) over interval k by worker 0. */
mhe_status mhi_ocp_predict(mhi_ocp *ocp, int32_t k, const double *x, const double *u,
                           double *x_next, mhe_error *err);
/* The same over the last interval, which is to be linearised at x and u next: the integrator's
 * memory keeps what it finds, and where it has one that next call has little left to do. */
mhe_status mhi_ocp_extend(mhi_ocp *ocp, int32_t k, const double *x, const double *u, double *x_next,
                          mhe_error *err);
/* The same of interval k with A [n_x x n_x] and B [n_x x n_u], of the system alone. */
mhe_status mhi_ocp_linearise(mhi_ocp *ocp, int32_t k, const double *x, const double *u,
                             double *x_next, double *A, double *B, mhe_error *err);
/* What a solver's evaluate() gives at node k, by worker 0, without a trace: nothing is kept for
 * later calls, and no work is counted. */
mhe_status mhi_ocp_expand(mhi_ocp *ocp, int32_t k, const double *x, const double *u,
                          const mhe_stage_values *out, mhe_error *err);
/* The system context of worker 0, for kinematics outside a solve. */
mhi_system_context *mhi_ocp_context(mhi_ocp *ocp);

#endif

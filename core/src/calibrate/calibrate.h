/* SPDX-License-Identifier: Apache-2.0 */
/* calibrate.h: parameters of a person from whole recordings.
 *
 * One least-squares problem in the motions' states and controls and in the parameters: multiple
 * shooting over all recordings, one behind the other (ocp/junction.h), EMG and markers as
 * measurements with the noise that the costs of the config say, and what is known of the parameters
 * beforehand. The solver's recursion over the stages is bordered by the parameters' columns. */
#ifndef MHI_CALIBRATE_H
#define MHI_CALIBRATE_H

#include "calibrate/plan.h"
#include "estimator/recording.h"
#include "ocp/ocp.h"

/* One number that is estimated. */
typedef struct mhi_estimated {
    char name[160];  /* "optimal_fiber_length of BRA" */
    int32_t kind;    /* MHI_OF_* */
    int32_t subject; /* number of the (first) muscle, marker or body */
    int32_t axis;    /* of an offset, 0 .. 2; else -1 */
    int32_t entry;   /* of the plan */
    double unit;     /* what a parameter of the problem counts in */
    double mean, prior_sd, lower, upper;
    double value, sd; /* found */
    int32_t informed; /* 0: the data say nothing about it; at_bound 1: it stands at a bound */
    int32_t at_bound;
} mhi_estimated;

/* A recording as nodes of the problem. */
typedef struct mhi_motion {
    mhi_recording *recording;
    const mhi_plan_recording *plan;
    mhi_run run;     /* the config's with this recording's files */
    int32_t force;   /* of the system: its external loads; -1: it has none */
    int32_t n_nodes; /* every ratio-th frame */
    int32_t first;   /* node in the problem; -1: held out */
} mhi_motion;

typedef struct mhi_calibration {
    const mhi_run *run, *start;
    const mhi_use *persons_solver; /* for the config that is left behind; NULL: the run's. Lent */
    mhi_plan plan;
    const mhe_host *host;
    mhe_description *model; /* as it is in the file */
    mhi_motion *motions;    /* [plan.n_recordings] */
    mhi_estimated *list;    /* [n] */
    int32_t n;
    int32_t asked[MHI_OF_KINDS];    /* 1: are among them */
    int32_t *list_of[MHI_OF_KINDS]; /* numbers of muscles, markers, bodies; -1: none. Of offsets
                                     * the first of three, insertions' [n_m x 3] */
    double *covariance;             /* [n x n] of the list */
    double *guess_x, *guess_u;
    int32_t n_intervals;
    int32_t *place; /* [n_intervals] of a junction */
    mhi_parameters_setup setup;
    mhe_solve_info info;
    int32_t (*progress)(void *data, int32_t iteration, double objective, double kkt);
    void *data;
    double seconds; /* of the processor, for the solve */
    mhi_arena arena;
} mhi_calibration;

/* Reads everything; `run`, `start` and `host` lent. `start`: the same config with costs that find a
 * motion with a model that is wrong. MHE_E_CONFIG, MHE_E_INPUT: one line. [cold] */
mhe_status mhi_calibration_open(mhi_run *run, const mhi_run *start, mhi_registry *registry,
                                const mhe_host *host, mhi_calibration *calibration, mhe_error *err);
void mhi_calibration_close(mhi_calibration *calibration);
/* Finds the parameters and how well they are known. [cold] */
mhe_status mhi_calibration_solve(mhi_calibration *calibration, mhe_error *err);

/* search.c: from a start s to the solution, c->info says how it ended. */
mhe_status mhi_calibration_search(mhi_calibration *c, mhi_ocp *ocp, const mhe_solver_ops *solver,
                                  void *self, mhe_solution *s, mhe_error *err);

int32_t mhi_calibration_is_lost(const mhe_solve_info *info); /* 1: it has no result of its own */

/* choose.c: the plan's entries as numbers, and which number of the model each belongs to. */
mhe_status mhi_calibration_choose(mhi_calibration *c, mhe_error *err);
/* Number of a muscle (body) now; where it is not estimated: 1 of a factor, else 0. */
double mhi_calibration_of(const mhi_calibration *c, int32_t kind, int32_t muscle);
const mhi_estimated *mhi_calibration_find(const mhi_calibration *c, int32_t kind, int32_t subject,
                                          int32_t axis);
/* persons.c. Recordings that are there twice are told. */
void mhi_calibration_tell_copies(const mhi_calibration *c);
/* MHE_E_INPUT: markers of one body differ in their distance from recording to recording. */
mhe_status mhi_calibration_check_person(const mhi_calibration *c, mhe_error *err);
/* doubts.c: tells the host what is odd about plan and recordings: markers and EMG that are never
 * there, priors wider than their bounds. MHE_E_INPUT: EMG that says nothing. */
mhe_status mhi_calibration_doubt(const mhi_calibration *c, mhe_error *err);
/* motion.c: recordings and the motion that the estimator finds in them with the model as it is. */
mhe_status mhi_motion_read(mhi_calibration *c, int32_t i, mhe_error *err);
mhe_status mhi_motion_guess(mhi_calibration *c, int32_t i, int32_t n_x, int32_t n_u, double *x,
                            double *u, mhe_error *err);
/* loads.c: the forces of the config, and then one for the loads of each recording that has some;
 * taken from the arena. What acts at every node. */
mhe_status mhi_motion_forces(mhi_calibration *c, mhi_force_setup **forces, int32_t *n,
                             mhe_error *err);
mhe_status mhi_motion_loads(const mhi_calibration *c, const mhi_system *system, mhi_ocp *ocp,
                            mhe_error *err);
/* EMG that the controls of node k are compared with, as it was `delay` (s) before: a smooth
 * function of the delay. NaN: missing. */
double mhi_motion_emg_before(const mhi_calibration *c, const mhi_motion *motion, int32_t k,
                             int32_t muscle, double delay, double *slope);
void mhi_motion_targets(const mhi_calibration *c, int32_t i, mhi_ocp *ocp);

#endif

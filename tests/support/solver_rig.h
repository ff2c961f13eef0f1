/* SPDX-License-Identifier: Apache-2.0 */
/* solver_rig.h: a solver plugin, loaded as a run loads it, on a toy. */
#ifndef SOLVER_RIG_H
#define SOLVER_RIG_H

#include "toy.h"

typedef struct rig {
    toy *t;
    const mhe_solver_ops *ops;
    void *solver; /* NULL where create failed */
    mhe_solution at;
    mhe_solve_info info;
    mhe_error error;
    double *memory;
} rig;

/* Creates "mhe.solver.ipopt" (or RIG_SOLVER) with the options of a YAML mapping ("{tolerance:
 * 1e-8}") on t; gives the status of create(). */
mhe_status rig_open(rig *r, toy *t, const char *yaml);
void rig_close(rig *r);
/* A pendulum and a solver on it, which must be created. */
void rig_open_pendulum(rig *r, toy *t, int n_intervals, const char *yaml);
void rig_close_both(rig *r, toy *t);

/* Zero iterate without multipliers. */
void rig_reset(rig *r);
/* Solves from r->at; gives the status. */
mhe_status rig_solve(rig *r, const mhe_solve_control *control);
/* Next window: the iterate moves one node to the left, its last entries are duplicated, and the
 * first state is fixed. */
void rig_shift(rig *r);

/* Largest violations of the optimality conditions at r->at, with the signs of solver.h. */
typedef struct rig_kkt {
    double stationarity; /* |gradient of the Lagrangian| / (1 + |gradient of the cost|) */
    double primal;       /* |x_{k+1} - F_k| and bounds */
    double dual;         /* negative multipliers of bounds */
    double complementarity;
} rig_kkt;
rig_kkt rig_check(const rig *r);

#endif

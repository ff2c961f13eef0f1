/* SPDX-License-Identifier: Apache-2.0 */
/* term.h: one cost plugin in a problem: signals in, weighted sum of squares with gradient and
 * Gauss-Newton Hessian out. */
#ifndef MHI_TERM_H
#define MHI_TERM_H

#include "base/arena.h"
#include "ocp/parameters.h"
#include "ocp/signals.h"
#include "ocp/tasks.h"

#include <mhe/cost.h>

/* A plugin with its config and the options common to all costs. */
typedef struct mhi_term_setup {
    const mhe_plugin *plugin;
    const void *config;
    double weight; /* [1] */
    double sigma;  /* unit of r: r counts as r / sigma */
    double huber;  /* [sigma] from here on linear; 0: never */
} mhi_term_setup;

typedef struct mhi_term {
    const mhe_cost_ops *ops;
    const char *id;
    const void *self;
    void *created; /* what destroy() takes; NULL where the plugin has no create */
    double factor; /* weight / sigma^2 */
    double limit;  /* unit of r: beyond it the loss is linear; infinite: nowhere */
    mhe_cost_layout layout;
    int32_t n_signals;
    int32_t signals[MHE_COST_MAX_SIGNALS]; /* rows of the table of signals */
    int32_t ny;
    int32_t *y_index;       /* [ny] place in the vector of all signals */
    int32_t *y_target;      /* [ny] place of its target in the vector of targets */
    int32_t *y_signal;      /* [ny] which row of the table */
    int32_t *y_at;          /* [ny] MHE_AT_* */
    int32_t elsewhere;      /* an entry is of another node than the one in work */
    int32_t differenced;    /* no jacobian(): central differences */
    const mhi_tasks *tasks; /* it compares markers one by one, and these say what each counts */
    double *root;           /* [ny] of the factors, where there are tasks */
} mhi_term;

/* Memory of one thread for one term. */
typedef struct mhi_term_workspace {
    double *y, *y_ref;   /* [ny] */
    double *y_spread;    /* [ny] */
    double *r, *r_shift; /* [n_res] */
    double *share;       /* [n_res] sqrt of a row's weight in the robust loss */
    double *jacobian;    /* [ny] or [n_res x ny] */
    double *row;         /* [n_z] */
    void *scratch;
} mhi_term_workspace;

/* What a cost says of the parameters, where there are some: the signals' own dependence on them
 * [n_y] and where the sums go. */
typedef struct mhi_term_by_p {
    const mhi_by_parameter *by;
    int32_t n_p;
    double *row;      /* [n_p] scratch */
    double *gradient; /* [n_p] */
    double *pz;       /* [n_p x n_z] */
    double *pp;       /* [n_p x n_p], lower triangle */
} mhi_term_by_p;

/* Where a term adds its share; derivatives all or none NULL. Row-major; z is what signals.h says,
 * at the last node without u where nothing is carried. */
typedef struct mhi_term_sum {
    double cost;
    double *gradient;    /* [n_z] */
    double *hessian;     /* [n_z x n_z], lower triangle only */
    mhi_term_by_p *by_p; /* NULL: nothing is estimated */
} mhi_term_sum;

/* Creates the plugin's instance and lays it out. `problem` and `signals` must outlive the term.
 * [cold] */
mhe_status mhi_term_create(const mhe_host *host, const mhi_term_setup *setup,
                           const mhe_problem *problem, mhi_signals *signals, const mhi_tasks *tasks,
                           mhi_arena *arena, mhi_term *term, mhe_error *err);
void mhi_term_destroy(mhi_term *term);
mhe_status mhi_term_workspace_create(const mhi_term *term, int32_t n_z, mhi_arena *arena,
                                     mhi_term_workspace *workspace, mhe_error *err);

/* Bit set of the signals it reads, of this node or the one before. */
uint32_t mhi_term_reads(const mhi_term *term);
/* Marks in pattern [n_z x n_z] what its Gauss-Newton Hessian can fill; `columns` [n_z] is scratch.
 */
void mhi_term_pattern(const mhi_term *term, const mhi_signals *signals, int32_t n_z,
                      uint8_t *columns, uint8_t *pattern);

/* Adds scale * factor * loss and derivatives at one node. The loss is 1/2 |r|^2, beyond `limit`
 * Huber's: limit (|r| - limit/2) (Huber 1964, doi:10.1214/aoms/1177703732), where |r| is a marker's
 * distance (three rows) or one row. Its gradient is exact; its Gauss-Newton Hessian is that of the
 * squares with weight limit / |r|, without the part along r that would make it smaller:
 * iteratively reweighted least squares, positive semidefinite. `y` are all
 * signals, those of the node before behind them; `target` those of this node, `before` of the one
 * before (NULL: there is none), `spread` of all nodes, `jacobian` as from mhi_signals_evaluate.
 * Rows that are NaN because data or signals are missing drop out. [hot] */
mhe_status mhi_term_add(const mhi_term *term, mhi_term_workspace *workspace,
                        const mhi_signals *signals, const mhe_stage *node, const double *y,
                        const double *target, const double *before, const double *spread,
                        const double *jacobian, double scale, int32_t n_z, mhi_term_sum *sum,
                        mhe_error *err);

#endif

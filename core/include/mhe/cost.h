/* SPDX-License-Identifier: Apache-2.0 */
/* cost.h: interface of cost plugins (kind "cost").
 *
 * A cost reads named signals y of the model at one node and returns residuals r(y) and dr/dy. The
 * core owns the chain rule from signals to states and controls, the sum over nodes and the options
 * common to all costs:
 *
 *     objective = sum over nodes k of  c_k * weight / sigma^2 * 1/2 |r_k|^2
 *     c_k = interval length (s), at the last node 1
 *
 * Signals, with size and unit; a problem that lacks one has no signal of that name:
 *   markers          [3 n_markers]  m, positions in ground
 *   q, qdot          [n_q]          rad, rad/s (m, m/s of sliders)
 *   activation       [n_muscles]    1
 *   excitation       [n_muscles]    1; excitation-driven only
 *   muscle_force     [n_muscles]    N, along the tendon
 *   joint_moment     [n_q]          N m (N), by the muscles: -L_q^T F
 *   residual_torque  [n_q]          N m (N); only where switched on
 *   actuator         [n_actuators]  1, in parts of the optimal force; only where switched on
 *   loop_gap, loop_rate  three or six a loop of the model; m, m/s (of welds also 1, rad/s). Where
 *                    there are any the problem has terms of its own that bring them to 0
 *   joint_reaction/JOINT  [3]       N, force of a joint on the body that it carries, in the axes of
 *                    the body that it sits on; JOINT: its name or that of the body it carries. Of
 *                    four joints at most, made when find_signal() is asked for them
 *
 * Missing data: a missing sample is NaN in `y_ref`; a signal that has no value at a node (controls
 * at the last node) is NaN in `y`. A residual must let NaN through; the core then drops its row and
 * its Jacobian's. A cost that has another residual for a missing target, one that does not need it,
 * says so by layout->fills_missing. */
#ifndef MHE_COST_H
#define MHE_COST_H

#include <mhe/layout.h>
#include <mhe/plugin.h>

#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

#define MHE_COST_IFACE "mhe.cost/2"
#define MHE_COST_MAX_SIGNALS 16

/* Which node's value of a signal a cost reads. */
#define MHE_AT_NODE 0 /* that of the node itself */
#define MHE_AT_PREVIOUS                                                        \
    1 /* that of the node before: for rates and smoothness. NaN where there is \
       * none (the first node of a run) or the signal had no value there. The  \
       * core carries it along as appended state, only where a cost asks */
#define MHE_AT_FIRST                                                             \
    2 /* at the window's first node only, else NaN: for priors on the state that \
       * the window begins with */

#define MHE_FORMULATION_EXCITATION 0 /* muscle controls are excitations; activations are states */
#define MHE_FORMULATION_ACTIVATION 1 /* muscle controls are activations */

/* What a cost may ask about the problem while it is set up. Lives until after destroy(). */
typedef struct mhe_problem mhe_problem;
struct mhe_problem {
    uint32_t size;
    int32_t formulation; /* MHE_FORMULATION_* */
    int32_t n_q, n_muscles, n_markers;
    int32_t n_residual_torques; /* 0 or n_q */
    int32_t n_intervals;
    double interval; /* s; before the first frames a guess: see mhe_stage.time instead */
    const char *const *coordinate_names;
    const char *const *muscle_names;
    const char *const *marker_names;
    void *data; /* the core's own */
    /* Number of a signal (>= 0), its size and unit (both may be NULL); -1 if this problem has none
     * of that name. [any]
     */
    int32_t (*find_signal)(const mhe_problem *problem, const char *name, int32_t *n_y,
                           const char **unit);
    /* Names of a signal's entries [n_y] (coordinates, muscles, "STER.x"); NULL: no such signal.
     * [any] */
    const char *const *(*entry_names)(const mhe_problem *problem, int32_t signal);
    const mhe_layout *layout; /* states, controls, inputs, parameters of the system */
};

/* Shape of J: dense [n_res x ny], row-major; or, where n_res = ny and r_i depends on y_i alone, its
 * diagonal [ny]. */
#define MHE_JACOBIAN_DENSE 0
#define MHE_JACOBIAN_DIAGONAL 1

/* Filled by layout(); zeroed before. */
typedef struct mhe_cost_layout {
    uint32_t size;
    int32_t signal;    /* the one signal read, where n_signals is left 0 */
    int32_t n_signals; /* several: y is their concatenation in this order; repeats are fine */
    int32_t signals[MHE_COST_MAX_SIGNALS];
    int32_t at[MHE_COST_MAX_SIGNALS]; /* MHE_AT_*, of each of them */
    int32_t n_res;                    /* number of residuals */
    int32_t jacobian;                 /* MHE_JACOBIAN_* */
    uint32_t scratch_bytes;           /* wanted in stage->scratch */
    const char *res_unit;             /* unit of r, "1" if mixed */
    int32_t fills_missing;            /* 1: r can be finite where y_ref is NaN */
} mhe_cost_layout;

/* One node as a cost sees it. All arrays are lent for the call. */
typedef struct mhe_stage {
    uint32_t size;
    int32_t node, n_intervals; /* 0 .. n_intervals; the last node has no controls */
    int32_t ny;
    double time;         /* s */
    const double *y;     /* [ny] */
    const double *y_ref; /* [ny], NaN where no target is known; of MHE_AT_PREVIOUS: the target that
                          * the node before had */
    void *scratch;       /* [scratch_bytes], 64-byte aligned, this thread's own */
    const double *y_spread; /* [ny] of EMG and of measured joint velocities the standard deviation
                             * of an entry's targets since the start, with what it may be while
                             * little was seen (0.1, with data.rates 0.05, of which e^-t is left
                             * after t half seconds); of markers how far all were from the estimates
                             * (RMS of a coordinate, m), with data.rates or data.marker_offset from
                             * the postures nearest to them; NaN: not known. May be NULL */
} mhe_stage;

/* Is an entry the one of that name, or one of its axes ("STER.x" of "STER")? [any] */
static inline int32_t mhe_entry_is(const char *entry, const char *name) {
    const size_t length = strlen(name);
    return strncmp(entry, name, length) == 0 && (entry[length] == '\0' || entry[length] == '.');
}

/* Entries of a signal that an option `key` names: chosen [n_y] 1 or 0; an empty list names all.
 * MHE_E_CONFIG: there is no such signal, or no such entry: the text says which there are. [cold] */
static inline mhe_status mhe_choose_entries(const mhe_problem *problem, const char *signal,
                                            const char *key, const mhe_text_list *list,
                                            uint8_t *chosen, mhe_error *err) {
    int32_t n = 0;
    const int32_t number = problem->find_signal(problem, signal, &n, NULL);
    if (number < 0) {
        return mhe_fail(err, MHE_E_CONFIG, "the problem has no signal '%s'", signal);
    }
    const char *const *entries = problem->entry_names(problem, number);
    for (int32_t i = 0; i < n; i++) {
        chosen[i] = list->n == 0;
    }
    for (int32_t k = 0; k < list->n; k++) {
        int32_t found = 0;
        for (int32_t i = 0; i < n; i++) {
            if (mhe_entry_is(entries[i], list->values[k])) {
                chosen[i] = 1;
                found = 1;
            }
        }
        if (!found) {
            char has[512] = "";
            for (int32_t i = 0; i < n; i++) { /* as many as fit */
                const size_t used = strlen(has);
                (void)snprintf(has + used, sizeof has - used, "%s%s", i > 0 ? ", " : "",
                               entries[i]);
            }
            return mhe_fail(err, MHE_E_CONFIG, "%s: '%s' has no entry '%s' (it has %s)", key,
                            signal, list->values[k], has);
        }
    }
    return MHE_OK;
}

typedef struct mhe_cost_ops { /* required: layout, residual */
    uint32_t size;
    /* NULL: `self` is the config itself. [cold] */
    mhe_status (*create)(const mhe_host *host, const mhe_problem *problem, const void *config,
                         void **self, mhe_error *err);
    void (*destroy)(void *self); /* NULL where create is. [cold] */
    mhe_status (*layout)(const void *self, const mhe_problem *problem, mhe_cost_layout *out,
                         mhe_error *err); /* [cold] */
    /* r [n_res]. MHE_RETRY: no value at this point. [hot] */
    mhe_status (*residual)(const void *self, const mhe_stage *stage, double *r, mhe_error *err);
    /* dr/dy in the shape that layout() chose, zeroed by the core before the call. NULL: the core
     * takes central differences and says so in the log. [hot] */
    mhe_status (*jacobian)(const void *self, const mhe_stage *stage, double *J, mhe_error *err);
} mhe_cost_ops;

/* Service of the application's host (mhe_host.service) for the plugin mhe.cost.callback: costs that
 * the program brings itself, for trying out; Python's come this way. */
#define MHE_OWN_COSTS_SERVICE "mhe.own-costs/1"

typedef struct mhe_own_costs mhe_own_costs;
struct mhe_own_costs {
    uint32_t size;
    void *data; /* the application's own */
    /* The cost of that name and what is handed to its functions as `self`; NULL: there is none.
     * create and destroy are not called, layout, residual and jacobian are needed; all of it lives
     * longer than the config. [cold] */
    const mhe_cost_ops *(*find)(const mhe_own_costs *costs, const char *name, void **self);
};

#ifdef __cplusplus
}
#endif
#endif

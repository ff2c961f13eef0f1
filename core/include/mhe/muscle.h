/* SPDX-License-Identifier: Apache-2.0 */
/* muscle.h: interface of muscle plugins (kind "muscle").
 *
 * A muscle model sees excitations, its own states, and musculotendon lengths and velocities of all
 * n_m muscles. It knows no skeleton, and muscles do not see each other, so that every derivative is
 * a number per muscle. One of a muscle's states is its activation; a rigid tendon needs no other.
 *
 * All muscles have the same n_s states; a muscle that lacks one (a rigid tendon among elastic ones)
 * says so, its entries are then never read nor used. Arrays are state by state: entry k of muscle i
 * stands at [k n_m + i].
 *
 * Activation-driven, the activation becomes the control: the state's value is given, and again as
 * the excitation; its rate is not used, the other states stay states. */
#ifndef MHE_MUSCLE_H
#define MHE_MUSCLE_H

#include <mhe/description.h>
#include <mhe/plugin.h>

#ifdef __cplusplus
extern "C" {
#endif

#define MHE_MUSCLE_IFACE "mhe.muscle/2"
#define MHE_MUSCLE_MAX_STATES 8

/* Filled by layout(); zeroed before. Strings and arrays live as long as the instance. */
typedef struct mhe_muscle_layout {
    uint32_t size;
    int32_t n_states;         /* n_s, 1 .. MHE_MUSCLE_MAX_STATES */
    int32_t activation;       /* which of them is the activation, 0 .. n_s - 1 */
    const char *const *names; /* [n_s]; the activation's is "activation" */
    const char *const *units; /* [n_s] */
    const double *lower;      /* [n_s x n_m] bounds of the states, +-infinity: none */
    const double *upper;      /* [n_s x n_m] */
    const uint8_t *present;   /* [n_s x n_m] 0: this muscle has no such state; NULL: all have */
    const uint8_t *diagonal;  /* [n_s] 1: its rate depends on excitation and itself alone;
                               * integrators  and solvers gain by it. NULL: none */
    int32_t n_parameters;     /* n_p, see parameter_names */
    const char *const *parameter_names; /* [n_p] by which derivatives can be had, each one number a
                                         * muscle: "max_isometric_force", "optimal_fiber_length",
                                         * "tendon_slack_length" (names of mhe_muscle's fields) */
} mhe_muscle_layout;

/* Where to evaluate. Lent for the call. */
typedef struct mhe_muscle_point {
    uint32_t size;
    const double *excitation; /* [n_m]; NULL where no rate that needs it is wanted */
    const double *state;      /* [n_s x n_m] */
    const double *length;     /* musculotendon length [n_m], m */
    const double *velocity;   /* musculotendon lengthening velocity [n_m], m/s */
} mhe_muscle_point;

/* What is wanted; NULL: not. At a kink of a curve the derivative is that of the active side. */
typedef struct mhe_muscle_values {
    uint32_t size;
    double *force;   /* along the tendon [n_m], N, positive = pull */
    double *force_s; /* by the states [n_s x n_m] */
    double *force_l; /* by the length [n_m], N/m */
    double *force_w; /* by the velocity [n_m], N s/m */
    double *rate;    /* of the states [n_s x n_m], 1/s times their unit */
    double *rate_e;  /* by the excitation [n_s x n_m] */
    double *rate_s;  /* [n_s x n_s x n_m]: rate k by state j at [(k n_s + j) n_m + i] */
    double *rate_l;  /* [n_s x n_m] */
    double *rate_w;  /* [n_s x n_m] */
    double *force_p; /* by the parameters [n_p x n_m] */
    double *rate_p;  /* [n_p x n_s x n_m] */
    /* For reports. */
    double *fiber_length;   /* [n_m], m */
    double *fiber_velocity; /* [n_m], m/s, lengthening */
    double *pennation;      /* [n_m], rad */
    double *active;         /* active force along the fibre [n_m], N */
    double *passive;        /* passive force along the fibre, with damping [n_m], N */
} mhe_muscle_values;

typedef struct mhe_muscle_ops {
    uint32_t size;
    /* `muscles` [n_muscles] lives until after destroy(). [cold] */
    mhe_status (*create)(const mhe_host *host, const mhe_muscle *muscles, int32_t n_muscles,
                         const void *config, void **self, mhe_error *err);
    void (*destroy)(void *self);                                                    /* [cold] */
    mhe_status (*layout)(const void *self, mhe_muscle_layout *out, mhe_error *err); /* [cold] */
    /* Forces, rates, derivatives at a point. Not clamped: bounds are the solver's; where a curve
     * ends, its end's value or a smooth continuation holds. MHE_RETRY: no value here. [hot] */
    mhe_status (*evaluate)(const void *self, const mhe_muscle_point *at,
                           const mhe_muscle_values *out, mhe_error *err);
    /* Rates of the diagonal state k alone [n_m], at excitation e and value s, with rate_e, rate_s
     * [n_m, may be NULL]. Needed where layout() names a diagonal state; the same bits as
     * evaluate(). [hot] */
    mhe_status (*diagonal_rate)(const void *self, int32_t k, const double *e, const double *s,
                                double *rate, double *rate_e, double *rate_s, mhe_error *err);
    /* States to start from [n_s x n_m]: in equilibrium with activation [n_m] at the lengths and
     * velocities given. Every present entry is set, the activation's too. NULL where there is no
     * state but the activation. [cold] */
    mhe_status (*equilibrium)(const void *self, const double *activation, const double *length,
                              const double *velocity, double *state, mhe_error *err);
} mhe_muscle_ops;

#ifdef __cplusplus
}
#endif
#endif

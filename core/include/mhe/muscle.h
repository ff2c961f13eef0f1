/* SPDX-License-Identifier: Apache-2.0 */
/* muscle.h: interface of muscle plugins (kind "muscle").
 *
 * A muscle model sees lengths, velocities, activations and excitations of all n_m muscles, one
 * entry each; muscles do not see each other, so every derivative is one number per muscle. Tendons
 * are rigid. It knows no skeleton. */
#ifndef MHE_MUSCLE_H
#define MHE_MUSCLE_H

#include <mhe/description.h>
#include <mhe/plugin.h>

#ifdef __cplusplus
extern "C" {
#endif

#define MHE_MUSCLE_IFACE "mhe.muscle/1"

/* Each [n_m]; derivatives may be NULL. At a kink of a curve the derivative is that of the active
 * side. */
typedef struct mhe_muscle_force {
    uint32_t size;
    double *force;   /* along the tendon, N, positive = pull */
    double *force_a; /* dF/d activation, N */
    double *force_l; /* dF/d musculotendon length, N/m */
    double *force_w; /* dF/d musculotendon velocity, N s/m */
} mhe_muscle_force;

typedef struct mhe_muscle_ops {
    uint32_t size;
    /* `muscles` [n_muscles] lives until after destroy(). [cold] */
    mhe_status (*create)(const mhe_host *host, const mhe_muscle *muscles, int32_t n_muscles,
                         const void *config, void **self, mhe_error *err);
    void (*destroy)(void *self); /* [cold] */
    /* Forces at activation a [1], musculotendon length l [m] and lengthening velocity w [m/s], each
     * [n_m]. [hot] */
    mhe_status (*force)(const void *self, const double *a, const double *l, const double *w,
                        const mhe_muscle_force *out, mhe_error *err);
    /* Activation dynamics: rate [n_m, 1/s] = da/dt at excitation e and activation a, and its
     * derivatives rate_e, rate_a [n_m, may be NULL]. Not clamped: bounds are the solver's. [hot] */
    mhe_status (*activation_rate)(const void *self, const double *e, const double *a, double *rate,
                                  double *rate_e, double *rate_a, mhe_error *err);
} mhe_muscle_ops;

#ifdef __cplusplus
}
#endif
#endif

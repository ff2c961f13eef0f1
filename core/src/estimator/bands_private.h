/* SPDX-License-Identifier: Apache-2.0 */
/* bands_private.h: the parts of the bands: how large causes are (bands_cause.c), how they spread
 * (bands.c). */
#ifndef MHI_BANDS_PRIVATE_H
#define MHI_BANDS_PRIVATE_H

#include "estimator/bands.h"
#include "estimator/estimator_private.h"
#include "estimator/gain.h"

#define TWO_SIDED 1.96 /* standard deviations that hold 95 % */
/* Deviations of a length at which its effect is looked at: passive forces grow so fast that what
 * one makes says little of where 95 % end. */
#define MHI_FAR TWO_SIDED
#define SURE 2.33                     /* and 98 % */
#define ONE_SIDED (1.645 / TWO_SIDED) /* what leaves 5 % on one side, beside that */
/* Fibres that are longer beside their optimal length, and shorter; by the tendon alone, too. */
#define MHI_N_VARIANTS 4

/* How large the noise of EMG is beside what the config says, by its residuals: sums that forget. */
typedef struct mhi_emg_level {
    double seen;    /* squares of residuals */
    double noise;   /* what noise of level 1 would make of them */
    double others;  /* what the other causes make of them */
    double level;   /* of the noise, a factor */
    int32_t frames; /* so far */
} mhi_emg_level;

/* Joint moments by activations [n_q x n_m], q and v [n_q x n_q]. */
typedef struct mhi_bands_moments {
    double *by_a, *by_q, *by_v;
} mhi_bands_moments;

struct mhi_bands {
    mhi_bands_moments moments[2]; /* where the known answers were found; of the sweep in work */
    const mhi_uncertainty_section *config;
    mhi_gain gain;
    mhi_variant *variants[MHI_N_VARIANTS]; /* NULL: that number is known */
    int32_t n_x, n_u, n_q, n_m;
    int32_t begun;          /* `error` is that of this window */
    double *error;          /* [n_x x columns] of node 0 */
    double *next;           /* the same, of the next window's */
    double *size;           /* [columns] of each cause, in units of the gain's */
    double *free;           /* [n_m] share of what a control answers beside its bounds */
    double *noise_share;    /* [n_m] of noise in the square of an EMG cause */
    double *far, *near;     /* [fixed] how much further than `size` a cause reaches where
                             * it is alone, and less on the other side, shares. Far is a
                             * truth above what is at hand; negative: one below it */
    double *below, *above;  /* [n_m] the most that an activation may be off below and above
                             * its estimate, by its EMG and its bounds */
    double *room;           /* [n_m] to the bound that is further off */
    double *at;             /* [n_x x columns] error of the output's node */
    double *controls;       /* [n_u x columns] of node 0; then of the output's node */
    double *row;            /* [columns] */
    double *marker_q;       /* [3 n_k x n_q] */
    double *unknown;        /* [n_q x n_q] of learnt offsets; scratch */
    double *marker, *force; /* [3 n_k], [n_m] scratch */
    double *more, *less;    /* [n_m] the most that forces are above and below; scratch */
    double *force_error;    /* [n_m x columns] */
    double *q, *activation, *force_sd, *moment;
    double *value, *slope; /* scratch of a node's expansion: [n_x], [n_x + n_u] */
    mhi_emg_level emg;
    mhi_arena arena;
};

/* The linearised node that the next sweep starts from. 0: it has no value there. */
int32_t mhi_bands_expand(mhe_estimator *e, mhi_bands *b);
/* Sizes of the causes at node k, where the muscles are as `muscles` says. */
void mhi_bands_size(mhe_estimator *e, mhi_bands *b, int32_t k, const double *activation,
                    const mhi_muscle_state *muscles);
/* Learns how far controls are free of their bounds, from node 0, whose controls' errors are
 * b->controls. A normal deviate that is cut off where its mean is has half the mean square that it
 * had: so, by statistical linearisation, the square of its answer is the probability that it is
 * between its bounds. One that is held would be, without its bound, as far beyond as its multiplier
 * says. */
void mhi_bands_free_controls(mhe_estimator *e, mhi_bands *b);
/* Learns the level of EMG's noise from node 0, whose controls' errors are b->controls. */
void mhi_bands_learn(mhe_estimator *e, mhi_bands *b);

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* plan.h: the section `calibrate` of a config: what is estimated of a person from which recordings.
 *
 *     calibrate:
 *       recordings:                       # beside that of the data section
 *         - {markers: slow.trc, emg: slow.sto}
 *         - {markers: other.trc, emg: other.sto, hold_out: true}
 *       parameters:
 *         - {name: max_isometric_force, sd: 0.3}
 *         - {name: optimal_fiber_length, sd: 0.05, muscles: [BicepsLong, BicepsShort], together:
 * true}
 *         - {name: emg_gain, sd: 0.2}
 *         - {name: marker_offset, sd: 0.01} */
#ifndef MHI_CALIBRATE_PLAN_H
#define MHI_CALIBRATE_PLAN_H

#include "config/run.h"

/* Kinds of parameters, in the order of their names. */
#define MHI_OF_STRENGTH 0
#define MHI_OF_OPTIMAL 1
#define MHI_OF_SLACK 2
#define MHI_OF_GAIN 3
#define MHI_OF_SHAPE 4
#define MHI_OF_MARKER 5
#define MHI_OF_INSERTION 6
#define MHI_OF_DELAY 7
#define MHI_OF_MASS 8
#define MHI_OF_KINDS 9
extern const char *const mhi_plan_names[MHI_OF_KINDS];

typedef struct mhi_plan_recording {
    const char *markers, *emg, *angles, *reference, *external_loads;
    double emg_offset;
    int32_t hold_out;
    mhi_use loads;        /* what reads external_loads; plugin NULL: none act */
    const mhi_node *node; /* NULL: that of the data section */
} mhi_plan_recording;

/* One entry of the list; what is not given (NaN) has the default of its kind. */
typedef struct mhi_plan_entry {
    int32_t kind; /* MHI_OF_* */
    double mean, sd, lower, upper;
    mhe_text_list muscles, markers, bodies; /* n = 0: all */
    int32_t together;                       /* one number for all of them */
    const mhi_node *node;
} mhi_plan_entry;

typedef struct mhi_plan {
    mhi_plan_recording *recordings; /* the data section's first */
    int32_t n_recordings;
    mhi_plan_entry *entries;
    int32_t n_entries;
    const char *scale; /* a Scale setup; NULL: none */
    double body_mass;  /* kg; NaN: not known */
    double noise_time; /* s that the noise of measurements is alike */
    int32_t solver;    /* 0: mhe.solver.rti, 1: mhe.solver.ipopt */
    int32_t max_iterations;
    double tolerance; /* of the objective, relative */
} mhi_plan;

/* Of the tree that `run` was read from; lists live in its arena. MHE_E_CONFIG: one line. [cold] */
mhe_status mhi_plan_read(mhi_run *run, mhi_registry *registry, mhi_plan *plan, mhe_error *err);
/* A recording's files in the place of the run's. */
void mhi_plan_take(const mhi_plan_recording *recording, mhi_run *run);
/* Every key, for people. */
void mhi_plan_describe(mhi_text *out);

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* inlet.h: what the samples of one stream are for the estimator. */
#ifndef MHI_INLET_H
#define MHI_INLET_H

#include "config/run.h"
#include "emg/electrodes.h"
#include "live/intake.h"
#include "live/stamp.h"

#include <mhe/estimator.h>

typedef struct mhi_inlet {
    int32_t source, stream;
    int32_t kind; /* MHE_STREAM_* */
    char *name;
    double rate;
    int32_t n_channels;
    int32_t channel; /* of the estimator; -1: it is for nothing */
    int32_t width;   /* of that channel */
    int32_t *column; /* [width] of the stream; -1: none. Electrodes: not used */
    double *factor;  /* [width] to SI units */
    double *row;     /* [width] the sample in work */
    int32_t n_found, n_labels;
    int32_t is_raw;             /* EMG of electrodes */
    mhi_electrodes *electrodes; /* where is_raw; its own */
    mhi_stamp stamp;
    double delay;      /* s, of the source */
    double newest;     /* s of CLOCK_MONOTONIC, its newest sample; -inf: none */
    int64_t n_samples; /* that came while the run ran */
    int64_t n_zero;
    double began;             /* s, first of them */
    int32_t watched;          /* it was judged (watch.h) */
    int32_t lost;             /* the source says that it sends nothing */
    char **missing, **unused; /* labels, for whoever looks; NULL-terminated */
} mhi_inlet;

/* What inlets of a run have in common; lent. */
typedef struct mhi_inlet_setup {
    const mhe_host *host;
    const mhi_run *run;
    const mhe_description *model;
    const mhe_estimator_info *info;
} mhi_inlet_setup;

/* Finds the stream's labels in the model: those of the config's data.labels first, then any
 * spelling that readers of files take. A stream of which nothing is of the model is told to the
 * host and is for nothing (channel -1). MHE_E_INPUT, MHE_E_CONFIG: electrodes. [cold] */
mhe_status mhi_inlet_open(const mhi_inlet_setup *setup, const mhi_stream *about, int32_t source,
                          int32_t stream, double delay, mhi_inlet *inlet, mhe_error *err);
void mhi_inlet_close(mhi_inlet *inlet);

/* What channel i of a stream is called where its labels are looked for in the model: without its
 * axis, as data.subject and data.labels have it unless it was given its name while it ran. Returns
 * 1: the subject's, -1: another's, 0: nobody's. */
int32_t mhi_inlet_name(const mhi_run *run, const mhi_stream *about, int32_t i, char *out,
                       size_t room);

/* The sample's values in the order and units of its channel, markers in the model's frame
 * (data.transform), in inlet->row; NaN where there are none. Not of electrodes. [hot] */
void mhi_inlet_take(mhi_inlet *inlet, const mhi_run *run, const double *values);

#endif

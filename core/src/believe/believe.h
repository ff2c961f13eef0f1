/* SPDX-License-Identifier: Apache-2.0 */
/* believe.h: what a recording and a model say of each other, before anything is estimated.
 *
 * One room for every application. Each check answers with findings (findings.h): a note, or a
 * reason to doubt what will be estimated, with the remedy; what cannot be right at all is an error
 * with the remedy. The thresholds stand beside their checks; docs/believability.md tells what they
 * catch. */
#ifndef MHI_BELIEVE_H
#define MHI_BELIEVE_H

#include "believe/findings.h"
#include "config/run.h"
#include "estimator/recording.h"
#include "model/system.h"

#define MHI_HARDLY_MOVES 0.06 /* rad: a motion that is smaller in every joint is none */

/* Where measured angles came from, for messages. */
typedef struct mhi_angles_source {
    const char *path;
    int32_t line;       /* of the first row; 0: it has no lines */
    int32_t in_degrees; /* the header says so */
} mhi_angles_source;

/* believe_angles.c: measured angles, rad, against the ranges of the coordinates: degrees read as
 * radians and the converse, values that no range holds. MHE_E_INPUT: degrees. [cold] */
mhe_status mhi_believe_angles(const mhe_description *model, const mhi_recording *recording,
                              const mhi_angles_source *source, mhi_findings *findings,
                              mhe_error *err);
/* believe_emg.c: EMG of muscles on the frames: percent, raw, scaled to its own peak, dead or flat
 * channels, EMG for part of the frames, a cost that tracks EMG without any. MHE_E_INPUT: percent,
 * raw. [cold] */
mhe_status mhi_believe_emg(const mhi_run *run, const mhe_description *model,
                           const mhi_recording *recording, mhi_findings *findings, mhe_error *err);
/* believe_markers.c: markers that are missing throughout, or stand still while others move. [cold]
 */
void mhi_believe_markers(const mhi_run *run, const mhe_description *model,
                         const mhi_recording *recording, mhi_findings *findings);
/* believe_loads.c: data.external_loads against gravity, the model's weight and the markers: other
 * axes, a wrong sign or unit, points far off the body, a plate whose zero is none. MHE_E_INPUT: the
 * files. [cold] */
mhe_status mhi_believe_loads(const mhi_run *run, const mhe_description *model,
                             const mhi_recording *recording, mhi_findings *findings,
                             mhe_error *err);
/* believe_fit.c: the markers against the model: one turn, shift, mirror or scale of all of them,
 * which data.transform can undo, is searched for before single ones are blamed. MHE_E_*: the
 * model's. [cold] */
mhe_status mhi_believe_fit(const mhi_run *run, const mhi_system *system,
                           const mhi_recording *recording, mhi_findings *findings, mhe_error *err);
/* believe_model.c: muscles and bodies that no person has; their fibres at the postures that the
 * recording shows. [cold] */
mhe_status mhi_believe_model(const mhi_run *run, const mhi_system *system,
                             const mhi_recording *recording, mhi_findings *findings,
                             mhe_error *err);
/* believe_reference.c: are the reference's forces those of this model's muscles? It says nothing of
 * the estimate. [cold] */
void mhi_believe_reference(const mhi_run *run, const mhi_system *system,
                           const mhi_recording *recording, mhi_findings *findings);

#endif

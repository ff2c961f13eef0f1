/* SPDX-License-Identifier: Apache-2.0 */
/* findings.h: what a recording and a model say of each other before a run, and what became of the
 * run: is it usable, how far are its estimates from the truth where that is known, what deserves a
 * look.
 *
 *     mhe_findings_open(config, estimator, recording, &findings, &err);
 *     for each estimate:  mhe_findings_add(findings, &estimate, &err);
 *     mhe_findings_judge(findings, &weight, &err);
 *     for (i = 0; mhe_findings_at(findings, i, &finding, &err) == MHE_OK; i++) { ... }
 *     mhe_findings_close(findings);
 *
 * Threads: findings belong to one thread at a time. */
#ifndef MHE_FINDINGS_H
#define MHE_FINDINGS_H

#include <mhe/recording.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct mhe_findings mhe_findings;

#define MHE_FINDING_NOTE 0     /* to be known; results are as good as without it */
#define MHE_FINDING_DOUBTFUL 1 /* angles or forces may be wrong by more than they should */
#define MHE_FINDING_USELESS 2  /* they are wrong */

/* One finding; texts live as long as the findings. */
typedef struct mhe_finding {
    uint32_t size;
    int32_t weight;     /* MHE_FINDING_* */
    const char *text;   /* one line, with file:line where there is one */
    const char *remedy; /* what helps; "": nothing is known */
} mhe_finding;

/* How a marker, or a muscle's EMG, was tracked in the estimates added so far. */
typedef struct mhe_tracking {
    uint32_t size;
    int32_t present;  /* estimates for which it was measured */
    int32_t left_out; /* of these: not believed */
    double rms;       /* m of a marker; of a muscle, of 1 */
} mhe_tracking;

/* Root mean square over time of the difference to the reference, then the mean over channels; NaN
 * where nothing could be compared. */
typedef struct mhe_rmse {
    uint32_t size;
    double q;          /* rad (m) */
    double qdot;       /* rad/s (m/s) */
    double activation; /* of 1 */
    double excitation; /* of 1 */
    double force;      /* N */
    double marker;     /* m */
} mhe_rmse;

/* Of the estimates that `estimator` makes of `recording`; all three are lent, and so is what they
 * were made from. Muscle forces and markers that the reference does not hold are computed by the
 * model from its states. Recording and model are held against each other here: what is doubtful
 * becomes a finding and goes to the config's host as a warning. MHE_E_INPUT: what cannot be right.
 * [cold] */
MHE_API mhe_status mhe_findings_open(mhe_config *config, mhe_estimator *estimator,
                                     const mhe_recording *recording, mhe_findings **findings,
                                     mhe_error *err);
MHE_API void mhe_findings_close(mhe_findings *findings); /* NULL is fine. [cold] */

/* Compares an estimate with what was measured, and with the truth, at its time. Estimates come in
 * the order of their times. [cold] */
MHE_API mhe_status mhe_findings_add(mhe_findings *findings, const mhe_estimate *estimate,
                                    mhe_error *err);

/* Of the last estimate added: distances of measured and estimated markers [n_markers], m; EMG that
 * its controls were to follow [n_muscles]. NaN: not measured. The findings' own, until the next
 * call. [any] */
MHE_API const double *mhe_findings_distances(const mhe_findings *findings);
MHE_API const double *mhe_findings_emg(const mhe_findings *findings);

/* Over all estimates but the first `skip_first` and the last `skip_last`; fills `rmse` up to its
 * size. MHE_E_INPUT: the recording has no reference. [cold] */
MHE_API mhe_status mhe_findings_rmse(const mhe_findings *findings, int32_t skip_first,
                                     int32_t skip_last, mhe_rmse *rmse, mhe_error *err);

/* Once, after the last estimate: adds what the estimates themselves make doubtful. `*weight` is the
 * largest of all findings: NOTE: usable, DOUBTFUL, USELESS: not usable. [cold] */
MHE_API mhe_status mhe_findings_judge(mhe_findings *findings, int32_t *weight, mhe_error *err);
/* Finding i, up to the size of `finding`, in the order in which they were found. MHE_E_ARGUMENT:
 * there is none. [cold] */
MHE_API mhe_status mhe_findings_at(const mhe_findings *findings, int32_t i, mhe_finding *finding,
                                   mhe_error *err);
/* Of marker i, of muscle i, up to the size of `tracking`. MHE_E_ARGUMENT: there is none. [cold] */
MHE_API mhe_status mhe_findings_marker(const mhe_findings *findings, int32_t i,
                                       mhe_tracking *tracking, mhe_error *err);
MHE_API mhe_status mhe_findings_muscle(const mhe_findings *findings, int32_t i,
                                       mhe_tracking *tracking, mhe_error *err);

/* What the estimates came to, a line each, the most important first: markers far off, labels that
 * look exchanged, muscles at their bounds or far from their EMG, large residual torques; "try: "
 * begins what may help. Of labels exchanged in the whole recording it asks the model, which takes
 * milliseconds a suspect marker. `*text` is the caller's: mhe_free() (library.h). [cold] */
MHE_API mhe_status mhe_findings_write(const mhe_findings *findings, char **text, mhe_error *err);

#ifdef __cplusplus
}
#endif
#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* create.h: an estimator on a run description that the caller keeps, and its parts, for the
 * programs. */
#ifndef MHI_CREATE_H
#define MHI_CREATE_H

#include "config/run.h"
#include "ocp/ocp.h"

#include <mhe/estimator.h>
#include <mhe/source.h>

/* The description that a run's model section asks for; what the reader skipped goes to `host`. Also
 * after a failure the caller gives back what is in `*description` with mhi_description_free. [cold]
 */
mhe_status mhi_estimator_read_model(const mhi_run *run, const mhe_host *host,
                                    mhe_description **description, mhe_error *err);

/* `run` and `host` must outlive it. [cold] */
mhe_status mhi_estimator_create(const mhi_run *run, const mhe_host *host, mhe_estimator **estimator,
                                mhe_error *err);
/* The same on a description that was read before, for many estimators on one model; it is lent. */
mhe_status mhi_estimator_create_on(const mhi_run *run, const mhe_description *description,
                                   const mhe_host *host, mhe_estimator **estimator, mhe_error *err);
/* Puts the line of the config before the refusal of a plugin, which err->part names; -> status. */
mhe_status mhi_estimator_locate(const mhi_run *run, mhe_status status, mhe_error *err);
const mhi_system *mhi_estimator_system(const mhe_estimator *estimator);
mhi_ocp *mhi_estimator_ocp(mhe_estimator *estimator);
/* First state from outside the config (a reference), before the first push: q, qdot [n_q], NaN (or
 * NULL) where it is not known. What the config itself gives is kept. */
void mhi_estimator_set_start(mhe_estimator *estimator, const double *q, const double *qdot);
/* The state the next window starts from, instead of what the last solution expects: x [n_x]. After
 * a push that was `ready`, before mhe_estimator_prepare. */
void mhi_estimator_set_state(mhe_estimator *estimator, const double *x);
/* Instead of what the config says: realtime.deadline_ms, here in s, 0: none; data.marker_outlier,
 * m, 0: markers are wishes, and kept however far they are. */
void mhi_estimator_set_node(mhe_estimator *estimator, int32_t node); /* output.node */
void mhi_estimator_set_deadline(mhe_estimator *estimator, double seconds);
void mhi_estimator_set_outlier(mhe_estimator *estimator, double distance);
/* EMG counts as varying by what was seen of it, also at the start: of a recording whose electrodes
 * are known to work. */
void mhi_estimator_set_seen(mhe_estimator *estimator);
/* The next push obeys `grant` (and mhe_estimator_prepare before it), whatever the clock says; NULL:
 * as ever. What the last push was granted. */
void mhi_estimator_grant(mhe_estimator *estimator, const mhe_grant *grant);
void mhi_estimator_granted(const mhe_estimator *estimator, mhe_grant *grant);
/* While *stop is not 0 every push that would solve ends at once without an estimate, one in work
 * too: MHE_E_INTERRUPTED. Lent; may be set by a signal handler. */
void mhi_estimator_set_stop(mhe_estimator *estimator, const atomic_int *stop);
/* After a push that was `ready`: node k of that window, 1 .. N, as an estimate: time, states,
 * controls and what follows from them. The last node has the controls that lead to it. */
mhe_status mhi_estimator_node(mhe_estimator *estimator, int32_t k, mhe_estimate *estimate,
                              mhe_error *err);

#endif

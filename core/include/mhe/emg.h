/* SPDX-License-Identifier: Apache-2.0 */
/* emg.h: raw EMG of electrodes as the EMG of muscles that a frame holds, live, for programs that
 * want the EMG itself. Who only estimates gives the samples to the estimator
 * (mhe_estimator_push_emg).
 *
 *     mhe_emg *emg;
 *     mhe_emg_open("arm.yaml", NULL, 0, columns, n_columns, 2000, NULL, &emg, &err);
 *     for each sample:  mhe_emg_push(emg, time, raw, &err);
 *     for each frame:   mhe_emg_at(emg, frame.time, values, n_muscles, &err); frame.emg = values;
 *     mhe_emg_close(emg);
 *
 * Filters, normalisation, gains and muscles are those of the config's section `emg`. mhe-run takes
 * recordings the same way: the same samples give the same bits.
 *
 * Threads: an mhe_emg belongs to one thread at a time. */
#ifndef MHE_EMG_H
#define MHE_EMG_H

#include <mhe/abi.h>
#include <mhe/host.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct mhe_emg mhe_emg;

/* For samples of `columns` [n_columns], among which the config's channels must be, at `rate` (Hz).
 * `set` [n_set] and `host` as for mhe_estimator_open. MHE_E_CONFIG, MHE_E_INPUT, MHE_E_PLUGIN:
 * err->text says what; also where the config has no emg.channels, or asks for zero_phase. [cold] */
MHE_API mhe_status mhe_emg_open(const char *config, const char *const *set, int32_t n_set,
                                const char *const *columns, int32_t n_columns, double rate,
                                const mhe_host *host, mhe_emg **emg, mhe_error *err);
MHE_API void mhe_emg_close(mhe_emg *emg); /* NULL is fine. [cold] */

/* The next sample: raw [n_columns], in the columns' units, NaN where missing; time in s. A time
 * that does not increase is passed over; a step over samples is a gap. Allocates nothing. [cold] */
MHE_API mhe_status mhe_emg_push(mhe_emg *emg, double time, const double *raw, mhe_error *err);

/* Normalised EMG of a frame, of the model's muscles in their order, the first n of them where there
 * are more: the newest there is at or before its time.
 * NaN: a muscle without an electrode, a gap, filters that still fill. Allocates nothing. [cold] */
MHE_API mhe_status mhe_emg_at(mhe_emg *emg, double time, double *values, int32_t n, mhe_error *err);

/* s by which the values come late: the filters' group delay less the electromechanical delay. [any]
 */
MHE_API double mhe_emg_lag(const mhe_emg *emg);

#ifdef __cplusplus
}
#endif
#endif

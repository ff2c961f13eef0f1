/* SPDX-License-Identifier: Apache-2.0 */
/* live.h: from streams to estimates and on to whoever wants them, as they come.
 *
 *     mhe_live_open(config, &setup, &live, &err);   // sections sources: and sinks: of the config
 *     mhe_live_run(live, 0, &err);                  // until it is stopped, or its sources end
 *     mhe_live_summary(live, &json, &err);
 *     mhe_live_close(live);
 *
 * One time base: CLOCK_MONOTONIC of this machine. A sample's time is its stamp, moved onto it by
 * the clock offset that its source measures (else by when samples arrive), freed of jitter, less
 * the source's constant `delay`. Each sample of the markers (else of the joint angles) is a frame.
 * All others belong to the node of their own time, also when they come late: as long as it is in
 * the window. Times of estimates count from the first frame.
 *
 * A recording (.xdf) holds everything that came, in the order in which it was taken, and what each
 * frame was granted; the same frames are estimated from it again, to the bit (source_recording).
 *
 * Threads: open, run, summary and close by one thread; stop from anywhere, also a signal handler.
 * Each source and each sink has a thread of its own; estimates are made on the thread of run. */
#ifndef MHE_LIVE_H
#define MHE_LIVE_H

#include <mhe/config.h>
#include <mhe/estimator.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct mhe_live mhe_live;

typedef struct mhe_live_setup {
    uint32_t size;
    const char *folder; /* where recordings and MVC files go; NULL: the working directory */
    const char *record; /* .xdf to record from the start; must not exist; NULL: none */
    double wait;        /* s to wait for all streams; 0: for ever */
} mhe_live_setup;

/* Creates the estimator, and starts sources and sinks. The config must outlive it. MHE_E_CONFIG: no
 * section `sources`; what a plugin refuses, with file:line. MHE_E_IO: a sink's port or file. [cold]
 */
MHE_API mhe_status mhe_live_open(mhe_config *config, const mhe_live_setup *setup, mhe_live **live,
                                 mhe_error *err);
MHE_API void mhe_live_close(mhe_live *live); /* NULL is fine. [cold] */

/* Waits for the streams and estimates until mhe_live_stop, the end of all sources, or `seconds` of
 * estimates (0: no end). MHE_E_INPUT: nothing in what came is of the model; MHE_E_IO: the streams
 * did not come in setup.wait, err->text lists what is missing, or a recording cannot be written.
 * [cold] */
MHE_API mhe_status mhe_live_run(mhe_live *live, double seconds, mhe_error *err);
/* Ends the run soon. NULL is fine. [any], also from a signal handler */
MHE_API void mhe_live_stop(mhe_live *live);

/* Asks for something by a line: "record-start", "record-stop", "mvc-start ELECTRODE", "mvc-stop",
 * "label CAME=MODEL" (what a stream calls CAME is the model's MODEL; a stream that has a MODEL of
 * its own has it as CAME from then on), "stop". It is done between two frames; what comes of it is
 * told to the host. MHE_E_ARGUMENT: no such line; MHE_RETRY: too many at once. [any] */
MHE_API mhe_status mhe_live_command(mhe_live *live, const char *line, mhe_error *err);
/* The run's state as one line of JSON, as sinks have it; to be freed by mhe_free. [any] */
MHE_API mhe_status mhe_live_state(mhe_live *live, char **json, mhe_error *err);

/* What came of it, as JSON: streams (found, rates, lost, gaps), frames and how they ended,
 * latencies from a sample's stamp to the sinks (p50, p95, p99, max, ms), sinks (given, lost). To be
 * freed by mhe_free. [cold] */
MHE_API mhe_status mhe_live_summary(mhe_live *live, char **json, mhe_error *err);

#ifdef __cplusplus
}
#endif
#endif

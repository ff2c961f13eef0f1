/* SPDX-License-Identifier: Apache-2.0 */
/* sink.h: interface of sink plugins (kind "sink"): where estimates go, live.
 *
 * Each sink has a thread of its own, which waits for estimates in a ring of the core's. A sink that
 * is slower than the estimator loses estimates, the oldest first, and is told how many; the
 * estimator's time never depends on it. Life of an instance:
 *
 *     create -> open -> take ... take, poll ... -> close -> destroy
 *
 * Threads: one thread, the sink's own, calls take and poll; open has returned before it begins,
 * close is called when it has ended, both by the thread that begins and ends the run. wake: any,
 * between open and close.
 */
#ifndef MHE_SINK_H
#define MHE_SINK_H

#include <mhe/estimator.h>
#include <mhe/plugin.h>

#ifdef __cplusplus
extern "C" {
#endif

#define MHE_SINK_IFACE "mhe.sink/1"

/* A named row of numbers of an estimate: name "force", labels the muscles. */
typedef struct mhe_sink_signal {
    const char *name, *unit;
    int32_t n;                 /* numbers */
    const char *const *labels; /* [n] */
} mhe_sink_signal;

/* What all estimates of a run have in common; lives until after close(). */
typedef struct mhe_sink_run {
    uint32_t size;
    const mhe_estimator_info *info;
    const char *title;  /* the config's name */
    const char *folder; /* where the run's results go; NULL: nowhere */
    int32_t n_signals;
    uint32_t signal_size;           /* stride of `signals` */
    const mhe_sink_signal *signals; /* q, qdot, activation, excitation, force, moment,
                                     * residual_torque, markers, and as measured: emg,
                                     * markers_measured; to be drawn: skeleton (pairs of points,
                                     * from body to body), paths (of muscles, NaN behind their
                                     * last point) */
} mhe_sink_run;

typedef struct mhe_sink_sample {
    uint32_t size;
    int64_t number; /* of the estimate, from 0; jumps where some were lost */
    int64_t lost;   /* of this sink so far */
    double time;    /* s of the run's time base, of the node it is of */
    double stamp;   /* s of CLOCK_MONOTONIC, the same moment */
    int32_t status; /* MHE_FRAME_* */
    int32_t iterations;
    double solve_time;           /* s */
    const double *const *values; /* [n_signals] each [n], NaN where there is none */
} mhe_sink_sample;

/* What a sink may ask of the run (buttons of a page). Handed to open(); [any]. */
#define MHE_CONTROL_STOP 0         /* end the run */
#define MHE_CONTROL_RECORD_START 1 /* begin a recording of what comes in */
#define MHE_CONTROL_RECORD_STOP 2
#define MHE_CONTROL_MVC_START 3 /* `text`: electrode whose maximum is now looked for */
#define MHE_CONTROL_MVC_STOP 4
#define MHE_CONTROL_LABEL 5 /* `text`: "CAME=MODEL": what the stream calls CAME is MODEL */
/* Their names, in this order: of a page's messages and of mhe_live_command. */
#define MHE_CONTROL_NAMES \
    { "stop", "record-start", "record-stop", "mvc-start", "mvc-stop", "label" }
typedef struct mhe_sink_control {
    uint32_t size;
    void *data;
    /* MHE_OK, or why not in err. */
    mhe_status (*request)(void *data, int32_t request, const char *text, mhe_error *err);
    /* One line of JSON with the state of the run (phase, streams, missing labels, latency,
     * recording, MVC), at most `size` bytes with its NUL. Returns the bytes it takes. */
    int32_t (*state)(void *data, char *json, int32_t size);
} mhe_sink_control;

typedef struct mhe_sink_ops {
    uint32_t size;
    mhe_status (*create)(const mhe_host *host, const void *config, void **self, mhe_error *err);
    void (*destroy)(void *self); /* [cold] */
    /* MHE_E_IO: the port is in use, the folder cannot be written ... [cold] */
    mhe_status (*open)(void *self, const mhe_sink_run *run, const mhe_sink_control *control,
                       mhe_error *err);
    /* The next estimate; may block, estimates are lost meanwhile. [cold] */
    mhe_status (*take)(void *self, const mhe_sink_sample *sample, mhe_error *err);
    /* Other work (sockets), called whenever there is no estimate, for `seconds` at most. NULL:
     * none. [cold] */
    mhe_status (*poll)(void *self, double seconds, mhe_error *err);
    mhe_status (*close)(void *self, mhe_error *err); /* what is buffered goes out. [cold] */
    /* There is an estimate: a poll that waits comes back at once, or the next one does. NULL:
     * polls are made short instead. [any], waits for nobody */
    void (*wake)(void *self);
} mhe_sink_ops;

#ifdef __cplusplus
}
#endif
#endif

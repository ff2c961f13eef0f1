/* SPDX-License-Identifier: Apache-2.0 */
/* estimator.h: the C API that an application embeds.
 *
 *     mhe_estimator *e;  mhe_error err;
 *     mhe_estimator_open("arm.yaml", NULL, 0, NULL, &e, &err);
 *     mhe_frame frame = {.size = sizeof frame};
 *     mhe_estimate estimate = {.size = sizeof estimate};
 *     while (measure(&frame)) {
 *         mhe_estimator_push(e, &frame, &estimate, &ready, &err);
 *         if (ready) { show(estimate.force); }
 *         mhe_estimator_prepare(e, &err);
 *     }
 *     mhe_estimator_close(e);
 *
 * Moving horizon estimation (Bailly et al. 2021, doi:10.3389/fbioe.2021.642742, Algorithm 1): the
 * window holds the newest N+1 frames; each new frame drops the oldest, fixes the first state to the
 * previous solution's second, and solves again from the shifted solution. The estimate is that of
 * the node that `output.node` names: the first is best known and N intervals late, the last is of
 * the frame just pushed.
 *
 * An estimate comes whatever happens, marked by its status. Frames may be missing, NaN, or wrong:
 * a frame that is late by less than a window leaves nodes without measurements; markers far from
 * where they are expected are left out (`data.marker_outlier`), and so is EMG most of which stays
 * at the ends of its range (`data.emg_saturation`); after more than a window without a frame, or
 * when the clock was set back by more than a window, the window fills anew as at the start. Where
 * three frames in a row do not fit what was expected, or a whole window of solves failed, the
 * window begins again from its measurements (MHE_FRAME_RESTARTED). With `realtime.deadline_ms`
 * every solve ends in time with what it has; the long first solve of a window that begins is then
 * spread over the frames that follow. Without it a frame may take ten times what frames usually
 * take, counted, not by the clock; the first window has a limit of its own.
 *
 * A config file may come from anywhere, and a plugin is code: a `plugin_path` in the file is
 * refused. An application that trusts a folder names it itself, by `set` or in MHE_PLUGIN_PATH.
 *
 * What is measured are channels, rows of a table (mhe_estimator_info.channels): each has a name, a
 * width, units, labels, and the signal of the model that its values are the target of. A
 * measurement comes with a frame, or alone with a time of its own (mhe_estimator_measure): it then
 * belongs to the node of that time while that is in the window, be it late or early. So packets of
 * EMG may come tens of milliseconds after their frames and none is lost.
 *
 * Structs begin with their size, which the caller sets to sizeof: nothing is read or written beyond
 * it, so that programs built with an older header go on. Arrays of structs have a stride. A NULL
 * where a pointer is needed, or a size too small to hold anything, is MHE_E_ARGUMENT.
 *
 * Threads: one estimator belongs to one thread at a time; several estimators are independent. After
 * fork() the child has none of the solver's threads: its copy goes on with the child's own thread
 * and can be closed there, where no call was in work when the parent forked. */
#ifndef MHE_ESTIMATOR_H
#define MHE_ESTIMATOR_H

#include <mhe/config.h>
#include <mhe/layout.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct mhe_estimator mhe_estimator;

/* ---- channels ---- */

#define MHE_CHANNEL_TARGET 0 /* costs compare a signal of the model with it */
#define MHE_CHANNEL_INPUT 1  /* the dynamics read it: input block of the same name */

/* What a channel whose samples come on their own is worth at a node between two of them, or after
 * the newest. Samples further apart (HOLD, NEAREST: away) than the channel's `gap` leave nodes
 * without. A sample within half a microsecond of a node is taken as it is. */
#define MHE_GAP_HOLD 0    /* the newest sample at or before the node */
#define MHE_GAP_LINEAR 1  /* linear between the samples beside it */
#define MHE_GAP_NEAREST 2 /* the sample nearest to it */
#define MHE_GAP_MEAN 3    /* mean of the samples from the node on, before the next; else HOLD */

/* One row of the table. Strings and arrays live as long as the estimator. */
typedef struct mhe_channel {
    uint32_t size;
    int32_t kind;       /* MHE_CHANNEL_* */
    const char *name;   /* "markers", "emg", "angles" */
    const char *signal; /* of the model (mhe/cost.h) that it is the target of; NULL: an input */
    int32_t width;      /* numbers in a measurement: n_labels x per_label */
    int32_t n_labels, per_label;
    const char *const *labels;  /* [n_labels] of markers, muscles, coordinates */
    const char *const *columns; /* [width], "WRIST.x" where there are several a label */
    const char *const *units;   /* [width] */
    int32_t gap_rule;           /* MHE_GAP_*; MEAN: frames between two nodes count, too */
    double gap;                 /* s; 0 before the interval is known */
    double delay;               /* s by which a node's value is older than the node: data.emg_delay
                                 * frames; 0 before the interval is known */
    double sigma;               /* standard deviation, in its unit; 0: the costs alone weigh it */
} mhe_channel;

/* What became of a channel's measurements so far. */
typedef struct mhe_channel_counts {
    uint32_t size;
    int64_t n_with_frames; /* frames that came with it */
    int64_t n_alone;       /* samples of mhe_estimator_measure that were in time */
    int64_t n_dropped;     /* samples before the window's nodes: too late */
    int64_t n_late_nodes;  /* nodes that were in a solve without it and got it afterwards */
    int64_t n_nodes;       /* nodes that have left the window */
    int64_t n_empty;       /* of these without any value of it */
} mhe_channel_counts;

/* How an entry of a channel is tracked at a node. */
#define MHE_TRACK_USED 0
#define MHE_TRACK_MISSING 1   /* it was not measured */
#define MHE_TRACK_FAR 2       /* a marker too far from where it is expected: data.marker_outlier */
#define MHE_TRACK_SATURATED 3 /* EMG at the ends of its range: data.emg_saturation */
#define MHE_TRACK_UNREAD 4    /* no cost reads the signal */

/* A channel at the node that an estimate is of. */
typedef struct mhe_tracked {
    uint32_t size;
    int32_t channel;         /* its place in the table */
    int32_t n_measured;      /* entries */
    int32_t n_left_out;      /* of these not believed */
    const double *measured;  /* [width], NaN: missing */
    const double *target;    /* [width] what the costs were given; NaN: nothing */
    const double *weight;    /* [width] factor on what the costs weigh: 1 tracked, 0 left out */
    const int32_t *why;      /* [width] MHE_TRACK_* */
    const double *estimated; /* [width] the signal in the estimate */
    double rms;              /* of estimated - measured: a label's distance where it has several
                              * entries; NaN: nothing was measured */
} mhe_tracked;

/* ---- estimator ---- */

/* How far the window is. */
#define MHE_PHASE_EMPTY 0     /* no frame since the start, or since the stream broke off */
#define MHE_PHASE_FILLING 1   /* fewer frames than nodes */
#define MHE_PHASE_BEGINNING 2 /* full, but nothing yet to begin from: no posture was measured */
#define MHE_PHASE_SETTLING 3  /* solved with its first state free */
#define MHE_PHASE_RUNNING 4   /* the first state is known and fixed */

/* Sizes and names, constant over the estimator's life. Names live as long as it. */
typedef struct mhe_estimator_info {
    uint32_t size;
    int32_t formulation; /* 0: excitation-driven, 1: activation-driven */
    int32_t n_q, n_muscles, n_markers, n_residual_torques;
    int32_t window;  /* intervals N */
    int32_t ratio;   /* every ratio-th frame is used */
    double interval; /* s between nodes; known from the first full window on */
    const char *const *coordinate_names;
    const char *const *muscle_names;
    const char *const *marker_names;
    const char *solver; /* plugin ids */
    const char *config_name;
    int32_t node; /* of the estimates: 0 the window's oldest frame, `window` the newest */
    double delay; /* s from that node to the newest frame: (window - node) * interval */
    int32_t n_channels;
    uint32_t channel_size;          /* stride of `channels` */
    const mhe_channel *channels;    /* delay and gap follow the interval */
    int32_t phase;                  /* MHE_PHASE_*, at the moment */
    const mhe_layout *layout;       /* of states, controls, inputs, parameters */
    int32_t n_joints;               /* that reactions are given of; 0: output.reactions is none */
    const char *const *joint_names; /* [n_joints] "hip_r_on_femur_r_in_femur_r": the joint, the
                                     * body it carries, whose axes */
    int32_t uncertainty;            /* 1: estimates have standard deviations (q_sd ...) */
} mhe_estimator_info;

/* Row i of the table. [any] */
static inline const mhe_channel *mhe_channel_at(const mhe_estimator_info *info, int32_t i) {
    return (const mhe_channel *)(const void *)((const char *)info->channels +
                                               (size_t)i * info->channel_size);
}

/* One measurement. Missing values are NaN; a NULL array is all missing. Lent for the call. */
typedef struct mhe_frame {
    uint32_t size;
    double time;           /* s */
    const double *markers; /* [n_markers x 3], m, ground frame */
    const double *emg;     /* [n_muscles], normalised 0..1 */
    const double *angles;  /* [n_q], measured coordinates, rad (m): target of the signal `q` */
    /* Or by channel: entry i is the measurement [width] of row i of the table. Goes before the
     * three fields above, which are short for the rows "markers", "emg", "angles". */
    int32_t n_channels;
    const double *const *channels; /* [n_channels]; may be NULL */
} mhe_frame;

/* How a frame's estimate came about. */
#define MHE_FRAME_OK 0              /* the solve converged */
#define MHE_FRAME_ITERATION_LIMIT 1 /* the best iterate after max_iterations, or a frame's work */
#define MHE_FRAME_DEADLINE 2        /* the best iterate at the deadline */
#define MHE_FRAME_PREDICTED 3       /* no usable solve: the model's prediction */
#define MHE_FRAME_RESTARTED 4       /* first solve after the window began again */

/* Arrays are the estimator's own and valid until its next call; never NaN. */
typedef struct mhe_estimate {
    uint32_t size;
    int32_t status; /* MHE_FRAME_* */
    double time;    /* s, of the frame it belongs to, the chosen node's */
    int32_t iterations;
    double kkt_residual;
    double solve_time;  /* s, of push and prepare */
    double marker_rms;  /* m, distance of estimated and measured markers; NaN without markers */
    double emg_rms;     /* difference of muscle control and EMG; NaN without EMG */
    const double *q;    /* [n_q], rad (m) */
    const double *qdot; /* [n_q], rad/s (m/s) */
    const double *activation; /* [n_muscles]; activation-driven, as residual torques: held over
                               * intervals, here the mean of the two that meet at this time */
    const double *excitation; /* [n_muscles], at the last node of the interval that leads to it;
                               * activation-driven: NULL */
    const double *force;      /* muscle forces [n_muscles], N */
    const double *moment;     /* joint moments by the muscles [n_q], N m */
    const double *residual;   /* residual joint torques [n_residual_torques], N m */
    const double *markers;    /* [n_markers x 3], m */
    double latency;           /* s from the call of push to the estimate */
    double evaluation_time;   /* s of it spent on costs, dynamics and their derivatives */
    int32_t phase;            /* MHE_PHASE_*: settling or running */
    int32_t n_tracked;
    uint32_t tracked_size;       /* stride of `tracked` */
    const mhe_tracked *tracked;  /* [n_tracked] what of each channel this node tracked. Of a control
                                  * at the last node, which has none: what the one before it did */
    const mhe_layout *layout;    /* names and places of what follows: every block of the system */
    const double *states;        /* [layout->n_x] */
    const double *controls;      /* [layout->n_u]; at the last node those that lead to it */
    const double *inputs;        /* [layout->n_w] of forces, at this time; NULL: there are none */
    const double *reactions;     /* [n_joints x 6] force, N, and moment, N m, on the child at the
                                  * joint's centre; NULL: output.reactions is none, or NaN: none
                                  * could be found */
    int32_t programs, fallbacks; /* quadratic programs of its solve, and those of them that the
                                  * solver's fast method gave up and the safe one solved */
    /* Standard deviations, where output.uncertainty asks for them, else NULL: what the config's
     * section `uncertainty` says of measurements and model, carried through the estimator to first
     * order. NaN where they could not be found. */
    const double *q_sd;          /* [n_q], rad (m) */
    const double *activation_sd; /* [n_muscles] */
    const double *force_sd;      /* [n_muscles], N */
    const double *moment_sd;     /* [n_q], N m */
} mhe_estimate;

/* Values of a block of an estimate [block->count]; NULL: it is no state or control. [any] */
static inline const double *mhe_estimate_block(const mhe_estimate *estimate,
                                               const mhe_block *block) {
    return block->role == MHE_ROLE_STATE     ? estimate->states + block->first
           : block->role == MHE_ROLE_CONTROL ? estimate->controls + block->first
                                             : NULL;
}

/* What a channel tracked. [any] */
static inline const mhe_tracked *mhe_tracked_at(const mhe_estimate *estimate, int32_t i) {
    return (const mhe_tracked *)(const void *)((const char *)estimate->tracked +
                                               (size_t)i * estimate->tracked_size);
}

/* On a config (mhe/config.h), which is lent and must live longer; its host gets the messages.
 * Several estimators may be made of one. MHE_E_CONFIG, MHE_E_INPUT, MHE_E_PLUGIN: as below. [cold]
 */
MHE_API mhe_status mhe_estimator_create(mhe_config *config, mhe_estimator **estimator,
                                        mhe_error *err);

/* Opens a config file with `set` [n_set] assignments "path.to.key=value". `host` may be NULL
 * (messages are dropped). MHE_E_CONFIG, MHE_E_INPUT, MHE_E_PLUGIN: err->text says file:line and
 * what. [cold] */
MHE_API mhe_status mhe_estimator_open(const char *config, const char *const *set, int32_t n_set,
                                      const mhe_host *host, mhe_estimator **estimator,
                                      mhe_error *err);
MHE_API void mhe_estimator_close(mhe_estimator *estimator); /* NULL is fine. [cold] */

/* Before the first push, instead of what the config leaves open: the first state q, qdot [n_q], rad
 * (m) and per s; NaN, or NULL for all of them, where it is not known. [cold] */
MHE_API mhe_status mhe_estimator_set_start(mhe_estimator *estimator, const double *q,
                                           const double *qdot, mhe_error *err);
/* Instead of what the config says: the node whose estimates are given, 0 .. window (output.node);
 * the time from a frame to its estimate in s, 0: no limit (realtime.deadline_ms). MHE_E_ARGUMENT:
 * no such node; negative or NaN. [cold] */
MHE_API mhe_status mhe_estimator_set_node(mhe_estimator *estimator, int32_t node, mhe_error *err);
MHE_API mhe_status mhe_estimator_set_deadline(mhe_estimator *estimator, double seconds,
                                              mhe_error *err);
/* While `stop` is not 0 every push that would solve ends at once without an estimate, and so does
 * the one in work: MHE_E_INTERRUPTED. From any thread, and from a signal handler; NULL is fine.
 * [any] */
MHE_API void mhe_estimator_stop(mhe_estimator *estimator, int32_t stop);

/* Fills `info` up to its size. [cold] */
MHE_API mhe_status mhe_estimator_describe(const mhe_estimator *estimator, mhe_estimator_info *info);
/* Whether the inputs of all forces are known from `first` to `last` (s): those in files as far as
 * they go, others where `measured` says that they will come with the frames. MHE_E_INPUT: one is
 * not, "file:line: what". [cold] */
MHE_API mhe_status mhe_estimator_covers(const mhe_estimator *estimator, double first, double last,
                                        int32_t measured, mhe_error *err);
/* How far each marker is from its place in its segment as far as it is learnt by now
 * (data.marker_offset): offsets [n_markers x 3] in the axes of the marker's body, m. Returns 1; 0
 * where none are learnt, and offsets stay as they are. [cold] */
MHE_API int32_t mhe_estimator_marker_offsets(const mhe_estimator *estimator, double *offsets);
/* Row of the table with this name; -1: there is none. [any] */
MHE_API int32_t mhe_estimator_find_channel(const mhe_estimator *estimator, const char *name);
/* Fills `counts` of a channel up to its size. [cold] */
MHE_API mhe_status mhe_estimator_counts(const mhe_estimator *estimator, int32_t channel,
                                        mhe_channel_counts *counts);

/* A measurement `values` [width] of one channel at its own time: earlier than the newest frame, or
 * later. It goes to the nodes that its time and the channel's gap rule say, as long as they are in
 * the window, and counts from the next solve on; what a frame itself brought stays. A time that
 * came before is replaced. What is too late for the window is dropped and counted, which is no
 * error. MHE_E_ARGUMENT: no such channel, a time that is not finite. MHE_E_MEMORY: the first sample
 * of a channel takes memory, none after it does. [cold] */
MHE_API mhe_status mhe_estimator_measure(mhe_estimator *estimator, int32_t channel, double time,
                                         const double *values, mhe_error *err);

/* Raw EMG of electrodes, which the section `emg` of the config makes into that of the muscles: with
 * it an application has this one object. For samples of `columns` [n_columns], among which the
 * config's channels must be, at `rate` (Hz); before the first push. Frames then bring no EMG of
 * their own. MHE_E_CONFIG, MHE_E_INPUT: err->text says what; also where there are no emg.channels,
 * or they ask for zero_phase. [cold] */
MHE_API mhe_status mhe_estimator_open_emg(mhe_estimator *estimator, const char *const *columns,
                                          int32_t n_columns, double rate, mhe_error *err);
/* The next sample: raw [n_columns], in the columns' units, NaN where missing; time in s. It may
 * come before the frames of its time or after them, in packets too: a frame's EMG counts from the
 * first solve on that follows the last sample it needs, as long as its node is in the window. A
 * time that does not increase is passed over; a step over samples is a gap. The same samples give
 * the same EMG as those of a recording, to the bit. [cold] */
MHE_API mhe_status mhe_estimator_push_emg(mhe_estimator *estimator, double time, const double *raw,
                                          mhe_error *err);
/* s by which that EMG comes late: the filters' group delay less the electromechanical delay. [any]
 */
MHE_API double mhe_estimator_emg_lag(const mhe_estimator *estimator);

/* Does what can be done before the next frame comes: shifts the window, linearises it where the
 * solver can. May be called after each push; push does itself what was not done. [cold] */
MHE_API mhe_status mhe_estimator_prepare(mhe_estimator *estimator, mhe_error *err);

/* Takes the next frame (time must increase). `*ready` is 1 when `estimate` was filled: from the
 * window's first fill on, at every ratio-th frame; where frames have markers or angles, not before
 * one is measured or the start is known. A bad frame or a failed solve is told by
 * estimate->status. `estimate` is filled up to its size. MHE_E_ARGUMENT: time does not increase (or
 * only less than a window back: then the frame is out of order); the frame is not taken.
 * MHE_E_INPUT: no marker of the first window is within a metre of the model, or the frames are half
 * a second or more apart (times in ms?); the window moves on and the next frame is tried. Anything
 * else is a bug. [cold] */
MHE_API mhe_status mhe_estimator_push(mhe_estimator *estimator, const mhe_frame *frame,
                                      mhe_estimate *estimate, int32_t *ready, mhe_error *err);

#ifdef __cplusplus
}
#endif
#endif

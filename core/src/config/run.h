/* SPDX-License-Identifier: Apache-2.0 */
/* run.h: the typed description of a run, read from one YAML file. */
#ifndef MHI_RUN_H
#define MHI_RUN_H

#include "base/arena.h"
#include "base/text.h"
#include "config/tree.h"
#include "plugin/registry.h"

#include <mhe/cost.h>
#include <mhe/option.h>

/* A plugin as the config uses it. `config` is filled and checked. */
typedef struct mhi_use {
    const mhe_plugin *plugin;
    const void *config;          /* plugin->config_size bytes */
    const mhi_node *node;        /* for messages */
    double weight, sigma, huber; /* costs only: common options */
    double delay;                /* sources only: s by which what they send is late */
} mhi_use;

/* Plugins of a section that is a list. */
typedef struct mhi_use_list {
    mhi_use *uses;
    int32_t n;
} mhi_use_list;

#define MHI_UNSUPPORTED_STOP 0
#define MHI_UNSUPPORTED_WARN 1

/* Sections of the file, each filled from an option table of its own (run_sections.c). Paths are
 * absolute or NULL. */
typedef struct mhi_model_section {
    const char *file;
    int32_t unsupported;    /* MHI_UNSUPPORTED_* */
    mhe_text_list locked;   /* coordinates that stay at the file's value */
    mhe_text_map locked_at; /* coordinates that stay at this value, rad or m */
    const char *motion;     /* .sto .mot: a motion like the one to come */
} mhi_model_section;

/* The key of data.marker_weights that names a file; one text alone is its value. */
#define MHI_MARKER_TASK_FILE "file"

typedef struct mhi_data_section {
    const char *markers, *emg, *reference; /* .trc; .sto .mot; .sto */
    const char *external_loads;            /* .xml */
    const char *angles;                    /* .sto .mot */
    double emg_offset;                     /* s, added to the EMG file's times */
    int32_t emg_delay;      /* frames by which the tracked EMG lags: activation-driven default 2,
                             * excitation-driven and with electrodes 0 (-1 in the file = by default) */
    double marker_outlier;  /* m; 0: none */
    int32_t emg_saturation; /* frames; 0: any EMG is believed */
    mhe_text_map labels;    /* name in the file: name in the model */
    mhe_text_map marker_weights; /* marker or pattern: weight; MHI_MARKER_TASK_FILE: a path */
    int32_t rates;               /* 1: the markers tell joint velocities, too */
    double marker_offset;        /* m, sd of offsets that are learnt; 0: none are */
    const char *subject;         /* whose labels ("NAME:MARKER") are read; NULL: there is one */
} mhi_data_section;

/* From the laboratory's frame to the model's: point -> scale turn point + shift. */
typedef struct mhi_transform_section {
    mhe_text_list rotate; /* "x-90"; [x, -90]; [ax, ay, az, degrees]; n = 0: not turned */
    mhe_real_list shift;  /* m; n = 0: none */
    double scale;
    double turn[9]; /* what `rotate` means, row-major */
} mhi_transform_section;

/* What a node's controls are compared with. */
#define MHI_EMG_SAMPLE_BY_COST 0
#define MHI_EMG_SAMPLE_NODE 1
#define MHI_EMG_SAMPLE_MEAN 2

#define MHI_EMG_LOW_PASS 0
#define MHI_EMG_AVERAGE 1
#define MHI_EMG_RMS 2
#define MHI_EMG_NO_ENVELOPE 3

#define MHI_EMG_NO_SIDE 0
#define MHI_EMG_LEFT 1
#define MHI_EMG_RIGHT 2

/* One electrode: a column of data.emg, and the muscles it stands for. */
typedef struct mhi_emg_channel {
    const char *name;
    mhe_text_list muscles;
    mhe_real_list gains; /* one a muscle; n = 0: all 1 */
    double gain;
    mhe_real_list shape; /* of each of these muscles, or one; n = 0: linear */
    double delay;        /* s; -1: that of the section */
    double mvc;          /* envelope at maximal voluntary contraction; 0: from mvc_file, else 1 */
    const mhi_node *node;
} mhi_emg_channel;

/* From electrodes to muscles; without channels the columns of data.emg are muscles, and this
 * section does nothing. */
typedef struct mhi_emg_section {
    int32_t sample;  /* MHI_EMG_SAMPLE_*; by the costs, resolved when read */
    int32_t process; /* 0: the columns are envelopes */
    int32_t band_order;
    double band_low, band_high; /* Hz */
    int32_t envelope;           /* MHI_EMG_* */
    int32_t low_pass_order;
    double low_pass; /* Hz */
    double window;   /* s, of average and rms */
    int32_t zero_phase;
    double delay; /* s; -1: by formulation, resolved when read */
    double max;   /* largest value handed on */
    double rate;  /* Hz, of the frames where there are no markers */
    const char *mvc_file;
    int32_t side; /* MHI_EMG_*, of muscles that channels name without one */
    mhi_emg_channel *channels;
    int32_t n_channels;
} mhi_emg_section;

typedef struct mhi_initial_section {
    mhe_real_list q, qdot; /* n = 0: from the reference, else free within bounds */
    double tolerance;      /* half width of the bounds of the first state, rad, rad/s */
} mhi_initial_section;

typedef struct mhi_horizon_section {
    int32_t window; /* intervals, N */
    int32_t ratio;  /* every ratio-th frame is used */
} mhi_horizon_section;

typedef struct mhi_bounds_section {
    int32_t residual_torques;            /* 0: none; 1: one per coordinate */
    int32_t actuators;                   /* 1: those of the model are controls */
    double residual_torque_max;          /* N m */
    mhe_text_list residual_torque_at;    /* coordinates that have one; n = 0: all */
    mhe_text_map residual_torque_limits; /* coordinate: largest magnitude, N m */
    double velocity_max;                 /* rad/s */
    double activation_min, activation_max, excitation_min, excitation_max;
} mhi_bounds_section;

typedef struct mhi_realtime_section {
    double deadline_ms; /* 0: none */
    int32_t threads;
    int32_t priority;    /* SCHED_FIFO of a live run's solver; 0: none */
    int32_t lock_memory; /* of a live run */
    double most_behind;  /* s that a frame of a live run may wait; 0: for ever */
} mhi_realtime_section;

typedef struct mhi_output_section {
    const char *node_name; /* as written; "auto" is left to the program */
    int32_t node;          /* what it means: 0 .. window; "auto": 0 */
    int32_t picture;     /* draw estimated against reference with gnuplot, where it is installed */
    int32_t reactions;   /* MHI_IN_* of model/joints.h */
    int32_t uncertainty; /* 1: standard deviations of the estimates are given */
    mhe_text_list formats;         /* of "sto", "csv", "mat"; .sto is written in any case */
    int32_t skip_first, skip_last; /* estimates left out of the errors in summary.json */
} mhi_output_section;

/* Standard deviations of what the estimates rest on, for output.uncertainty. */
typedef struct mhi_uncertainty_section {
    double marker_noise, marker_offset;    /* m */
    double emg_noise, emg_gain, emg_floor; /* of the channel's variation; of the value; 1 */
    int32_t emg_measured;                  /* 1: emg_noise is scaled by what residuals show */
    double control;                        /* without EMG, 1 */
    double max_isometric_force;            /* a part of it, as the next two */
    double optimal_fiber_length, tendon_slack_length;
    double path_length; /* m */
} mhi_uncertainty_section;

typedef struct mhi_run {
    const char *path; /* of the config file */
    const char *dir;  /* its folder */
    const char *name; /* its base name without extension */
    mhi_use model, muscle, integrator, solver;
    mhi_use *costs;
    int32_t n_costs;
    mhi_use_list forces;         /* those of the list, or those by default */
    mhi_use external_loads;      /* data.external_loads; plugin NULL: none */
    mhi_use_list sources, sinks; /* of live runs */
    int32_t formulation;         /* MHE_FORMULATION_* */
    mhe_text_list plugin_path;   /* absolute folders */
    mhi_model_section model_file;
    mhi_data_section data;
    mhi_transform_section transform; /* data.transform */
    mhi_emg_section emg;
    mhi_initial_section initial;
    mhi_horizon_section horizon;
    mhi_bounds_section bounds;
    mhi_realtime_section realtime;
    mhi_output_section output;
    mhi_uncertainty_section uncertainty;
    mhi_tree *tree;
    mhi_arena arena; /* all of the above */
} mhi_run;

/* A section of the file, for reading and for documentation. */
typedef struct mhi_section {
    const char *name;  /* "" is the top level of the file */
    const char *help;  /* one sentence */
    const char *iface; /* of the plugin that the section names (its options are keys too); NULL */
    const mhe_option *options;
    int32_t n_options;
    uint32_t offset; /* in mhi_run: the section's struct or, with iface, its mhi_use; with `list`
                      * its mhi_use_list; 0 for "" and costs */
    int32_t list;    /* 1: a list of plugins; 2: one that may not be empty */
} mhi_section;

/* xyz of the recording's frame, a point or a direction (of a force, which is not scaled), in the
 * model's: data.transform. [any] */
void mhi_run_transform(const mhi_run *run, int32_t is_point, double xyz[3]);

/* All sections in the order in which they are written. "costs" is a list of such sections, and
 * "a.b" stands for such a list `b` within section `a`. [any] */
const mhi_section *mhi_run_sections(int32_t *n);
/* Option table of a section; NULL if there is none of that name. [any] */
const mhe_option *mhi_run_section(const char *section, int32_t *n);

/* All sections and their keys in a format of registry.h. */
void mhi_run_describe(int32_t format, mhi_text *out);

/* A configuration in memory. */
typedef struct mhi_run_text {
    const char *text; /* [length] */
    size_t length;
    const char *folder; /* that relative paths start from; NULL: the working directory */
} mhi_run_text;

/* Reads and checks a config with `set` [n_set] assignments applied. Finds every plugin it names in
 * `registry` (plugin_path is searched first, if given; one of the file itself is refused unless the
 * registry trusts files). MHE_E_CONFIG, MHE_E_INPUT,
 * MHE_E_PLUGIN: one line, "file:line: ...". Files of the data section are not opened. [cold] */
mhe_status mhi_run_read(const char *path, const char *const *set, int32_t n_set,
                        mhi_registry *registry, mhi_run **run, mhe_error *err);
/* The same of a text that is called `name`; of the file `name` where `text` is NULL. [cold] */
mhe_status mhi_run_parse(const mhi_run_text *text, const char *name, const char *const *set,
                         int32_t n_set, mhi_registry *registry, mhi_run **run, mhe_error *err);
/* The same of a file with sections of another program's: path, name, tree and the model section are
 * filled, the rest is zero and its keys are not looked at. [cold] */
mhe_status mhi_run_read_model(const char *path, const char *const *set, int32_t n_set,
                              mhi_registry *registry, mhi_run **run, mhe_error *err);
/* The same of a file whose costs stand in a list `steps` that is left to the caller (run_steps.h).
 * [cold] */
mhe_status mhi_run_read_base(const char *path, const char *const *set, int32_t n_set,
                             mhi_registry *registry, mhi_run **run, mhe_error *err);
/* The list `costs` in a mapping of the run's tree; the uses live as long as the run. [cold] */
mhe_status mhi_run_read_costs(mhi_run *run, mhi_registry *registry, const mhi_node *owner,
                              mhi_use **costs, int32_t *n, mhe_error *err);
/* What reads the external loads of `file`, in the laboratory's frame (data.transform), as
 * data.external_loads; `key`: where the run's tree names it. [cold] */
mhe_status mhi_run_read_loads(mhi_run *run, mhi_registry *registry, const char *file,
                              const mhi_node *key, mhi_use *use, mhe_error *err);
/* A failure that says of a file that it cannot be opened gets the line that names it in front,
 * where a value of the run's tree does. Returns `status`. */
mhe_status mhi_run_locate_file(const mhi_run *run, mhe_status status, mhe_error *err);
void mhi_run_free(mhi_run *run);

/* "plugin: ...", its own keys and the section's of the model section, behind `indent` blanks. */
void mhi_run_write_model(const mhi_run *run, int32_t indent, mhi_text *out);

/* The resolved configuration: every key of every section and plugin with its value, YAML that reads
 * back the same. */
void mhi_run_write(const mhi_run *run, mhi_text *out);

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* run_sections.c: every key that the core itself understands, with default and range. */
#include "config/run_sections.h"

#include "base/pi.h"

#include <float.h>
#include <math.h>
#include <mhe/force.h>
#include <mhe/integrator.h>
#include <mhe/model.h>
#include <mhe/muscle.h>
#include <mhe/sink.h>
#include <mhe/solver.h>
#include <mhe/source.h>
#include <string.h>

static const mhe_option top_options[] = {
    MHE_OPT_ENUM(mhi_top_section, formulation, "excitation", "excitation|activation",
                 "What the muscles are driven by: excitations (activations are states) or "
                 "activations directly."),
    MHE_OPT_TEXTS(
        mhi_top_section, plugin_path, 0,
        "Folders searched for plugins before the standard ones; in a file only with --trust."),
};

static const mhe_option model_options[] = {
    MHE_OPT_TEXT(mhi_use_section, plugin, 0, NULL, "Plugin of the skeleton."),
    MHE_OPT_PATH(mhi_use_section, file, MHE_OPT_REQUIRED, "Model file, .osim or .bioMod."),
    MHE_OPT_ENUM(mhi_use_section, unsupported, "stop", "stop|warn",
                 "What to do when the model file holds something that cannot be represented."),
    MHE_OPT_TEXTS(mhi_use_section, locked, 0,
                  "Coordinates that do not move: they stay at the file's value and are no part of "
                  "the estimate."),
    MHE_OPT_MAP(mhi_use_section, locked_at, 0,
                "Coordinates that stay at a value of their own, {NAME: rad or m}."),
    MHE_OPT_PATH(mhi_use_section, motion, 0,
                 "Joint angles of a motion like the one to come (.sto, .mot; an earlier estimate): "
                 "fitted paths are fitted to its range, with a margin. data.angles unless given."),
};

static const mhe_option muscle_options[] = {
    MHE_OPT_TEXT(mhi_use_section, plugin, 0, NULL, "Plugin of the muscles."),
};

static const mhe_option force_options[] = {
    MHE_OPT_TEXT(mhi_use_section, plugin, 0, NULL, "Plugin of the force."),
};

static const mhe_option data_options[] = {
    MHE_OPT_PATH(mhi_data_section, markers, 0, "Measured markers, .trc or .c3d."),
    MHE_OPT_PATH(mhi_data_section, emg, 0,
                 "EMG, .sto, .mot or .c3d (analog): normalised, a column a muscle; or raw, a "
                 "column an electrode, "
                 "with emg.channels."),
    MHE_OPT_PATH(mhi_data_section, angles, 0,
                 "Measured joint angles, .sto or .mot, a column a coordinate: what the signal q is "
                 "to be close to where a cost compares it, beside markers or in their place."),
    MHE_OPT_PATH(mhi_data_section, external_loads, 0,
                 "Forces and torques that act on bodies, OpenSim's ExternalLoads (.xml with its "
                 ".mot or .sto): short for a force that reads it."),
    MHE_OPT_PATH(mhi_data_section, reference, 0,
                 "Known motion to start from and to compare with, .sto."),
    MHE_OPT_REAL(mhi_data_section, emg_offset, 0, -1e6, 1e6, "s",
                 "Added to the times of the EMG file, to meet those of the markers."),
    MHE_OPT_INT(mhi_data_section, emg_delay, -1, -1, 1000, "samples",
                "Samples by which the tracked EMG lags behind; -1: 0 when excitation-driven or "
                "with emg.channels, 2 when activation-driven."),
    MHE_OPT_REAL(mhi_data_section, marker_outlier, 0.2, 0, DBL_MAX, "m",
                 "A marker that is further from where the model expects it, beside how far markers "
                 "are anyway, is left out; 0: none."),
    MHE_OPT_INT(mhi_data_section, emg_saturation, 3, 0, 1000, "samples",
                "After so many frames in a row with the whole EMG at its rails (every channel 0 or "
                "at least 1, or most at least 1), these samples are missing; 0: never."),
    MHE_OPT_MAP(mhi_data_section, labels, 0,
                "Columns that the files call otherwise than the model, {NAME IN FILE: NAME IN "
                "MODEL}."),
    MHE_OPT_MAP(mhi_data_section, marker_weights, 0,
                "Factor of a marker's squared error where costs compare markers one by one, "
                "{MARKER or PATTERN*: WEIGHT}, 0 leaves it out; or the path of OpenSim's inverse "
                "kinematics tasks (.xml), whose coordinate tasks count too; or both, {file: PATH, "
                "MARKER: WEIGHT}."),
    MHE_OPT_BOOL(mhi_data_section, rates, 0,
                 "Joint velocities by inverse kinematics (or the measured angles) from frame to "
                 "frame, which the signal qdot is to be close to where a cost follows it: they "
                 "keep light segments from swinging between the frames."),
    MHE_OPT_REAL(
        mhi_data_section, marker_offset, 0, 0, 1, "m",
        "How far markers may be from their places in their segments (standard deviation of "
        "a coordinate): what stays the same while the limbs turn is learnt as the "
        "recording runs and taken off the markers; 0: nothing is."),
    MHE_OPT_TEXT(mhi_data_section, subject, 0, NULL,
                 "Whose columns are read where a file holds several people (NAME:MARKER)."),
};

static const mhe_option transform_options[] = {
    MHE_OPT_TEXTS(mhi_transform_section, rotate, 0,
                  "Turn about an axis by degrees (of markers, and of external loads in ground): "
                  "x-90, or [AXIS, DEGREES], where the axis is x, y, z "
                  "or [a, b, c]."),
    MHE_OPT_REALS(mhi_transform_section, shift, 0, -DBL_MAX, DBL_MAX, "m",
                  "Added afterwards, in the model's frame."),
    MHE_OPT_REAL(mhi_transform_section, scale, 1, -1e6, 1e6, "1",
                 "Factor of all positions; below 0 they are mirrored through the origin."),
};

static const mhe_option emg_options[] = {
    MHE_OPT_ENUM(mhi_emg_section, sample, "cost", "cost|node|mean",
                 "EMG that a node's controls are compared with: at the node, or the mean until the "
                 "next node; cost: as the costs want it."),
    MHE_OPT_BOOL(mhi_emg_section, process, 1,
                 "Band-pass, rectify and smooth; false: the columns are envelopes."),
    MHE_OPT_INT(mhi_emg_section, band_order, 2, 0, 8, "1",
                "Order of the Butterworth band-pass (two poles each, as in scipy and MATLAB); 0: "
                "none."),
    MHE_OPT_REAL(mhi_emg_section, band_low, 20, 1e-3, 1e6, "Hz", "Its lower corner."),
    MHE_OPT_REAL(mhi_emg_section, band_high, 450, 1e-3, 1e6, "Hz", "Its upper corner."),
    MHE_OPT_ENUM(mhi_emg_section, envelope, "lowpass", "lowpass|average|rms|none",
                 "How the rectified signal is smoothed: Butterworth low-pass, moving average, "
                 "moving RMS, or not at all."),
    MHE_OPT_INT(mhi_emg_section, low_pass_order, 2, 1, 8, "1", "Order of the low-pass."),
    MHE_OPT_REAL(mhi_emg_section, low_pass, 6, 1e-3, 1e6, "Hz", "Corner of the low-pass."),
    MHE_OPT_REAL(mhi_emg_section, window, 0.1, 1e-4, 60, "s", "Length of average and RMS."),
    MHE_OPT_BOOL(mhi_emg_section, zero_phase, 0,
                 "Filter forwards and backwards, without delay; for recordings only, since it "
                 "looks ahead."),
    MHE_OPT_REAL(mhi_emg_section, delay, -1, -1, 1, "s",
                 "Electromechanical delay from EMG to activation, of which the filters' own delay "
                 "makes up a part; -1: 0 when excitation-driven, 0.02 when activation-driven."),
    MHE_OPT_REAL(mhi_emg_section, max, 1, 1e-3, DBL_MAX, "1", "Values above are cut to it."),
    MHE_OPT_REAL(mhi_emg_section, rate, 100, 1e-3, 1e5, "Hz",
                 "Rate of the frames where there are no markers."),
    MHE_OPT_PATH(mhi_emg_section, mvc_file, 0,
                 "EMG of maximal contractions with the same columns: the envelope's maximum is the "
                 "MVC; or a single row of MVC values."),
    MHE_OPT_ENUM(mhi_emg_section, side, "none", "none|left|right",
                 "Side of muscles that channels name without one: soleus is soleus_r, r_soleus or "
                 "soleus_right."),
};

static const mhe_option channel_options[] = {
    MHE_OPT_TEXT(mhi_emg_channel, name, MHE_OPT_REQUIRED, NULL, "Column of data.emg."),
    MHE_OPT_TEXTS(mhi_emg_channel, muscles, MHE_OPT_REQUIRED,
                  "Muscles it stands for, or patterns: glmax*_r."),
    MHE_OPT_REALS(mhi_emg_channel, gains, 0, 0, 1e6, "1",
                  "Factor of each of these muscles; none: all 1."),
    MHE_OPT_REAL(mhi_emg_channel, gain, 1, 0, 1e6, "1", "Factor of the whole channel."),
    MHE_OPT_REALS(
        mhi_emg_channel, shape, 0, -3, 0, "1",
        "Shape factor A: excitation (exp(A e) - 1) / (exp(A) - 1) of the EMG e (Lloyd and "
        "Besier 2003, doi:10.1016/S0021-9290(03)00010-1), one or one a muscle; none, or "
        "0: linear."),
    MHE_OPT_REAL(mhi_emg_channel, delay, -1, -1, 1, "s",
                 "Electromechanical delay of this channel; -1: that of the section."),
    MHE_OPT_REAL(mhi_emg_channel, mvc, 0, 0, DBL_MAX, "unit of the column",
                 "Envelope at maximal voluntary contraction; 0: from mvc_file, else 1."),
};

static const mhe_option initial_options[] = {
    MHE_OPT_REALS(mhi_initial_section, q, 0, -DBL_MAX, DBL_MAX, "rad or m",
                  "Coordinates at the start; none: from the reference, else found from the "
                  "markers."),
    MHE_OPT_REALS(mhi_initial_section, qdot, 0, -DBL_MAX, DBL_MAX, "rad/s or m/s",
                  "Velocities at the start; none: from the reference, else free."),
    MHE_OPT_REAL(mhi_initial_section, tolerance, 0.1, 0, 100, "rad, rad/s",
                 "Half width of the bounds around a known start."),
};

static const mhe_option horizon_options[] = {
    MHE_OPT_INT(mhi_horizon_section, window, 7, 2, 1000, "1", "Intervals in the window."),
    MHE_OPT_INT(mhi_horizon_section, ratio, 1, 1, INT32_MAX, "1",
                "Every ratio-th frame of the data is used."),
};

static const mhe_option bounds_options[] = {
    MHE_OPT_BOOL(mhi_bounds_section, residual_torques, 0, "Add a free torque at every coordinate."),
    MHE_OPT_BOOL(mhi_bounds_section, actuators, 0,
                 "Drive the model file's actuators: controls in parts of their optimal force, "
                 "within its min_control and max_control."),
    MHE_OPT_REAL(mhi_bounds_section, residual_torque_max, 100, 0, INFINITY, "N m",
                 "Largest magnitude of a residual torque."),
    MHE_OPT_TEXTS(mhi_bounds_section, residual_torque_at, 0,
                  "Coordinates that have a residual torque; none: all."),
    MHE_OPT_MAP(mhi_bounds_section, residual_torque_limits, 0,
                "Largest magnitude at single coordinates, {NAME: N m}, in the place of "
                "residual_torque_max."),
    MHE_OPT_REAL(mhi_bounds_section, velocity_max, 10 * MHI_PI, 1e-6, INFINITY, "rad/s",
                 "Largest magnitude of a coordinate's velocity."),
    MHE_OPT_REAL(mhi_bounds_section, activation_min, 0, 0, 1, "1", "Least activation."),
    MHE_OPT_REAL(mhi_bounds_section, activation_max, 1, 0, 1, "1", "Largest activation."),
    MHE_OPT_REAL(mhi_bounds_section, excitation_min, 0, 0, 1, "1", "Least excitation."),
    MHE_OPT_REAL(mhi_bounds_section, excitation_max, 1, 0, 1, "1", "Largest excitation."),
};

static const mhe_option integrator_options[] = {
    MHE_OPT_TEXT(mhi_use_section, plugin, 0, NULL, "Plugin of the integrator."),
};

static const mhe_option cost_options[] = {
    MHE_OPT_TEXT(mhi_use_section, plugin, MHE_OPT_REQUIRED, NULL, "Plugin of this cost."),
    MHE_OPT_REAL(mhi_use_section, weight, 1, 0, DBL_MAX, "1", "Factor of the whole cost."),
    MHE_OPT_REAL(mhi_use_section, sigma, 1, 1e-12, DBL_MAX, "unit of the residual",
                 "Residual that counts as one; the cost is divided by its square."),
    MHE_OPT_REAL(mhi_use_section, huber, 0, 0, DBL_MAX, "sigma",
                 "Residual (of a marker: its distance) from which on the cost grows linearly "
                 "instead of squared, so that outliers pull less; 0: never."),
};

static const mhe_option solver_options[] = {
    MHE_OPT_TEXT(mhi_use_section, plugin, 0, NULL, "Plugin of the solver."),
};

static const mhe_option realtime_options[] = {
    MHE_OPT_REAL(mhi_realtime_section, deadline_ms, 0, 0, 1e6, "ms",
                 "Time from a frame to its estimate, after which a solve ends with what it has; 0: "
                 "not the time, but the work is limited, to ten times what frames usually take; "
                 "with mhe-run --realtime three quarters of the time between frames."),
    MHE_OPT_INT(mhi_realtime_section, threads, 1, 1, 256, "1",
                "Threads that evaluate a window's intervals, where the solver can use them."),
    MHE_OPT_INT(
        mhi_realtime_section, priority, 0, 0, 99, "1",
        "With mhe-live: real-time priority (SCHED_FIFO) of the thread that makes estimates; "
        "taken only where the machine has a second core, so that no sender starves; 0: "
        "none."),
    MHE_OPT_BOOL(mhi_realtime_section, lock_memory, 0,
                 "With mhe-live: keep the program's memory from being moved out (mlockall)."),
    MHE_OPT_REAL(mhi_realtime_section, most_behind, 0.5, 0, 1e6, "s",
                 "With mhe-live: a frame that has waited longer is passed over, so that on a "
                 "machine that does not keep up estimates stay of now; 0: none is, however late."),
};

static const mhe_option output_options[] = {
    {.key = "node",
     .help = "Whose estimates are given: first (the oldest frame of the window), last, or the "
             "number of a node; auto: first, with mhe-run --realtime last.",
     .text_default = "auto",
     .type = MHE_TYPE_TEXT,
     .offset = MHE_OPT_OFFSET(mhi_output_section, node_name, const char *)},
    MHE_OPT_BOOL(mhi_output_section, picture, 1,
                 "Draw estimated against reference, where gnuplot is installed."),
    MHE_OPT_TEXTS(mhi_output_section, formats, 0,
                  "Formats of the results beside .sto: csv, mat (MATLAB, all in results.mat)."),
    MHE_OPT_ENUM(mhi_output_section, reactions, "none", "none|child|parent|ground",
                 "What joints transmit, force and moment on the child at the joint's centre, in "
                 "the axes of the child, of the parent or of ground (reactions.sto)."),
    MHE_OPT_BOOL(mhi_output_section, uncertainty, 0,
                 "Give standard deviations of angles, activations, forces and moments "
                 "(uncertainty.sto): what the section uncertainty says of measurements and model, "
                 "carried through the estimator. Rigid tendons only."),
    MHE_OPT_INT(mhi_output_section, skip_first, 5, 0, INT32_MAX, "estimates",
                "Estimates at the start that the errors in summary.json leave out."),
    MHE_OPT_INT(mhi_output_section, skip_last, 0, 0, INT32_MAX, "estimates",
                "Estimates at the end that the errors in summary.json leave out."),
};

/* Of a generic model that was scaled and not calibrated. */
static const mhe_option uncertainty_options[] = {
    MHE_OPT_REAL(mhi_uncertainty_section, marker_noise, 0.001, 0, 1, "m",
                 "Of a marker's coordinate, from frame to frame."),
    MHE_OPT_REAL(mhi_uncertainty_section, marker_offset, 0.005, 0, 1, "m",
                 "Of a marker's place in its segment, each coordinate, for the whole recording."),
    MHE_OPT_REAL(mhi_uncertainty_section, emg_noise, 0.5, 0, 10, "1",
                 "Of slow errors of EMG, as a share of how much its channel varies."),
    MHE_OPT_BOOL(mhi_uncertainty_section, emg_measured, 1,
                 "Scale emg_noise by what the differences of EMG and muscle control show, once "
                 "there are some."),
    MHE_OPT_REAL(mhi_uncertainty_section, emg_gain, 0.2, 0, 10, "1",
                 "Of a channel's gain (electrode, maximal contraction), as a share."),
    MHE_OPT_REAL(mhi_uncertainty_section, emg_floor, 0.005, 0, 1, "1",
                 "Of EMG in any case, as a share of maximal contraction."),
    MHE_OPT_REAL(mhi_uncertainty_section, control, 0.2, 0, 1, "1",
                 "Of the control of a muscle without EMG about what the costs draw it to."),
    MHE_OPT_REAL(mhi_uncertainty_section, max_isometric_force, 0.3, 0, 10, "1",
                 "Of a muscle's maximal force, as a share."),
    MHE_OPT_REAL(mhi_uncertainty_section, optimal_fiber_length, 0.05, 0, 0.5, "1",
                 "Of its optimal fibre length, as a share."),
    MHE_OPT_REAL(mhi_uncertainty_section, tendon_slack_length, 0.03, 0, 0.5, "1",
                 "Of its tendon's slack length, as a share."),
    MHE_OPT_REAL(mhi_uncertainty_section, path_length, 0.003, 0, 1, "m",
                 "Of the length of its path (insertions)."),
};

static const mhe_option source_options[] = {
    MHE_OPT_TEXT(mhi_use_section, plugin, MHE_OPT_REQUIRED, NULL, "Id of the plugin."),
    MHE_OPT_REAL(
        mhi_use_section, delay, 0, -10, 10, "s",
        "By which its data come late beyond what its stamps say: a constant of the device, "
        "taken off its times."),
};

static const mhe_option sink_options[] = {
    MHE_OPT_TEXT(mhi_use_section, plugin, MHE_OPT_REQUIRED, NULL, "Id of the plugin."),
};

#define ENTRIES(table) table, (int32_t)(sizeof(table) / sizeof((table)[0]))
#define SECTION(name, help, iface, table, offset) \
    { name, help, iface, ENTRIES(table), offset, 0 }
#define LIST(name, help, iface, table, offset, kind) \
    { name, help, iface, ENTRIES(table), offset, kind }
#define AT(field) ((uint32_t)offsetof(mhi_run, field))

static const mhi_section sections[] = {
    SECTION("", "Top level of the file.", NULL, top_options, 0),
    SECTION("model", "Skeleton, muscle paths and markers.", MHE_MODEL_IFACE, model_options,
            AT(model)),
    SECTION("muscle", "Forces and activation dynamics of the muscles.", MHE_MUSCLE_IFACE,
            muscle_options, AT(muscle)),
    LIST("forces",
         "A list: what acts beside muscles; left out, what the model file states of coordinate "
         "limits, springs and ligaments; []: nothing.",
         MHE_FORCE_IFACE, force_options, AT(forces), 1),
    SECTION("data", "Measured motion.", NULL, data_options, AT(data)),
    SECTION(
        "data.transform",
        "From the frame of the recording's markers to the model's: first turned and scaled, then "
        "shifted.",
        NULL, transform_options, AT(transform)),
    SECTION("emg", "From electrodes to muscles; to be given with channels, but for sample.", NULL,
            emg_options, AT(emg)),
    SECTION("emg.channels", "A list: the electrodes. Muscles that none of them names have no EMG.",
            NULL, channel_options, 0),
    SECTION("initial", "Start of the motion.", NULL, initial_options, AT(initial)),
    SECTION("horizon", "The moving window.", NULL, horizon_options, AT(horizon)),
    SECTION("bounds", "Bounds of states and controls.", NULL, bounds_options, AT(bounds)),
    SECTION("integrator", "How the state is carried over an interval.", MHE_INTEGRATOR_IFACE,
            integrator_options, AT(integrator)),
    LIST("costs", "A list: what the estimate is to be close to.", MHE_COST_IFACE, cost_options, 0,
         2),
    SECTION("solver", "How a window is solved.", MHE_SOLVER_IFACE, solver_options, AT(solver)),
    SECTION("realtime", "Limits of live use.", NULL, realtime_options, AT(realtime)),
    SECTION("output", "What is made of the results.", NULL, output_options, AT(output)),
    SECTION("uncertainty",
            "Standard deviations of what estimates rest on, for output.uncertainty; by default "
            "those of a model that was scaled and not calibrated.",
            NULL, uncertainty_options, AT(uncertainty)),
    LIST("sources", "A list: where live data come from (mhe-live).", MHE_SOURCE_IFACE,
         source_options, AT(sources), 1),
    LIST("sinks", "A list: where live estimates go (mhe-live).", MHE_SINK_IFACE, sink_options,
         AT(sinks), 1),
};

mhi_use_list mhi_run_list(const mhi_run *run, const mhi_section *section) {
    if (section->offset == 0) {
        return (mhi_use_list){run->costs, run->n_costs};
    }
    return *(const mhi_use_list *)(const void *)((const char *)run + section->offset);
}

const mhi_section *mhi_run_sections(int32_t *n) {
    *n = (int32_t)(sizeof sections / sizeof sections[0]);
    return sections;
}

const mhe_option *mhi_run_section(const char *section, int32_t *n) {
    for (size_t i = 0; i < sizeof sections / sizeof sections[0]; i++) {
        if (strcmp(sections[i].name, section) == 0) {
            *n = sections[i].n_options;
            return sections[i].options;
        }
    }
    *n = 0;
    return NULL;
}

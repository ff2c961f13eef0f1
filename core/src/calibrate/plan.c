/* SPDX-License-Identifier: Apache-2.0 */
#include "calibrate/plan.h"

#include "config/options.h"
#include "plugin/describe_options.h"

#include <math.h>
#include <string.h>

const char *const mhi_plan_names[MHI_OF_KINDS] = {
    "max_isometric_force", "optimal_fiber_length", "tendon_slack_length", "emg_gain",
    "emg_shape",           "marker_offset",        "insertion",           "emg_delay",
    "segment_mass"};

/* What is known of people beforehand, where the config does not say: factors of the model's
 * numbers; gain and shape of EMG; m; s. */
static const struct {
    double mean, sd, lower, upper;
} usual[MHI_OF_KINDS] = {{1, 0.3, 0.2, 3},        {1, 0.1, 0.7, 1.4},   {1, 0.05, 0.8, 1.25},
                         {1, 0.3, 0.2, 4},        {-1, 0.6, -3, 0},     {0, 0.01, -0.05, 0.05},
                         {0, 0.003, -0.02, 0.02}, {0.02, 0.02, 0, 0.2}, {1, 0.1, 0.3, 3}};

static const mhe_option plan_options[] = {
    MHE_OPT_PATH(
        mhi_plan, scale, 0,
        "Scale setup (.xml) of OpenSim, done first: its model is scaled to the static trial "
        "and takes the place of model.file."),
    MHE_OPT_REAL(mhi_plan, body_mass, NAN, 1e-3, 1e4, "kg",
                 "What the person weighs: segment_mass expects the model's masses times the same "
                 "factor, so that they weigh so much together."),
    MHE_OPT_REAL(mhi_plan, noise_time, 0.3, 1e-3, 60, "s",
                 "Time over which the noise of a measurement is alike: nodes closer together count "
                 "as less than one measurement each."),
    MHE_OPT_ENUM(mhi_plan, solver, "rti", "rti|ipopt", "Which solver."),
    MHE_OPT_INT(mhi_plan, max_iterations, 60, 1, 10000, "1", "Its iterations at most."),
    MHE_OPT_REAL(mhi_plan, tolerance, 1e-4, 1e-16, 1, "1",
                 "It ends where two iterations change the objective by less than this part."),
};

static const mhe_option recording_options[] = {
    MHE_OPT_PATH(mhi_plan_recording, markers, 0, "Markers, as data.markers."),
    MHE_OPT_PATH(mhi_plan_recording, emg, 0, "EMG, as data.emg."),
    MHE_OPT_PATH(mhi_plan_recording, angles, 0, "Joint angles, as data.angles."),
    MHE_OPT_PATH(mhi_plan_recording, reference, 0, "The truth, where it is known."),
    MHE_OPT_PATH(mhi_plan_recording, external_loads, 0,
                 "Loads that act in it (ground, a weight in the hand), as data.external_loads."),
    MHE_OPT_REAL(mhi_plan_recording, emg_offset, 0, -1e9, 1e9, "s", "As data.emg_offset."),
    MHE_OPT_BOOL(mhi_plan_recording, hold_out, 0,
                 "Nothing is learned from it: it shows what the calibration is worth."),
};

static const mhe_option entry_options[] = {
    MHE_OPT_ENUM(
        mhi_plan_entry, kind, "max_isometric_force",
        "max_isometric_force|optimal_fiber_length|tendon_slack_length|emg_gain|emg_shape|"
        "marker_offset|insertion|emg_delay|segment_mass",
        "What is estimated: a factor of the model's number; gain and shape factor of the EMG; "
        "where a marker, or the last point of a muscle's path, sits in its body, beside the "
        "model's place; by how much the EMG is earlier than what it excites, beside what the "
        "config says; a factor of a body's mass and inertia."),
    MHE_OPT_REAL(mhi_plan_entry, mean, NAN, -1e6, 1e6, "1, m or s",
                 "What is expected beforehand; by kind."),
    MHE_OPT_REAL(mhi_plan_entry, sd, NAN, 1e-6, 1e6, "1, m or s",
                 "Standard deviation of that; by kind."),
    MHE_OPT_REAL(mhi_plan_entry, lower, NAN, -1e6, 1e6, "1, m or s", "Least value; by kind."),
    MHE_OPT_REAL(mhi_plan_entry, upper, NAN, -1e6, 1e6, "1, m or s", "Largest value; by kind."),
    MHE_OPT_TEXTS(mhi_plan_entry, muscles, 0, "Whose; none: all muscles."),
    MHE_OPT_TEXTS(mhi_plan_entry, markers, 0, "Of marker_offset: which; none: all markers."),
    MHE_OPT_TEXTS(mhi_plan_entry, bodies, 0, "Of segment_mass: which; none: all that have a mass."),
    MHE_OPT_BOOL(mhi_plan_entry, together, 0, "One number for all of these muscles or bodies."),
};

#define N(table) ((int32_t)(sizeof(table) / sizeof((table)[0])))

/* What no person's number is beyond, and how to write it: percent, N, mm and ms are not. */
static mhe_status check_unit(const mhi_run *run, const mhi_plan_entry *e, mhe_error *err) {
    static const struct {
        double most;
        const char *unit;
    } of[MHI_OF_KINDS] = {
        [MHI_OF_STRENGTH] = {20, "a factor of the model's number: 1.2 is 20 % more"},
        [MHI_OF_OPTIMAL] = {20, "a factor of the model's number: 1.2 is 20 % more"},
        [MHI_OF_SLACK] = {20, "a factor of the model's number: 1.2 is 20 % more"},
        [MHI_OF_GAIN] = {1e3, "a factor: 1.2 is 20 % more"},
        [MHI_OF_SHAPE] = {20, "a number about -3 .. 0"},
        [MHI_OF_MARKER] = {1, "in m: 10 mm are 0.01"},
        [MHI_OF_INSERTION] = {1, "in m: 10 mm are 0.01"},
        [MHI_OF_DELAY] = {2, "in s: 50 ms are 0.05"},
        [MHI_OF_MASS] = {20, "a factor of the model's number: 1.2 is 20 % more"}};
    const struct {
        const char *key;
        double value;
    } given[] = {{"mean", e->mean}, {"lower", e->lower}, {"upper", e->upper}};
    for (int32_t i = 0; i < N(given); i++) {
        if (fabs(given[i].value) > of[e->kind].most) {
            return mhi_fail_at(err, MHE_E_CONFIG, run->tree, e->node,
                               "calibrate.parameters: %s: '%s' is %g; it is %s",
                               mhi_plan_names[e->kind], given[i].key, given[i].value,
                               of[e->kind].unit);
        }
    }
    return MHE_OK;
}

static mhe_status check_entry(const mhi_run *run, mhi_plan_entry *e, mhe_error *err) {
    const char *name = mhi_plan_names[e->kind];
    if (e->kind != MHI_OF_MASS) { /* which the body's mass may say */
        e->mean = isnan(e->mean) ? usual[e->kind].mean : e->mean;
    }
    e->sd = isnan(e->sd) ? usual[e->kind].sd : e->sd;
    e->lower = isnan(e->lower) ? usual[e->kind].lower : e->lower;
    e->upper = isnan(e->upper) ? usual[e->kind].upper : e->upper;
    const mhe_status status = check_unit(run, e, err);
    if (status != MHE_OK) {
        return status;
    }
    if (e->lower >= e->upper) {
        return mhi_fail_at(
            err, MHE_E_CONFIG, run->tree, e->node,
            "calibrate.parameters: %s: 'lower' is %g, which is not below 'upper', %g", name,
            e->lower, e->upper);
    }
    if (e->mean < e->lower || e->mean > e->upper) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, e->node,
                           "calibrate.parameters: %s: 'mean' is %g, which is not within %g .. %g",
                           name, e->mean, e->lower, e->upper);
    }
    if ((e->kind <= MHI_OF_GAIN || e->kind == MHI_OF_MASS) && e->lower <= 0) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, e->node,
                           "calibrate.parameters: %s: 'lower' is %g; a factor is above 0", name,
                           e->lower);
    }
    const int32_t of_markers = e->kind == MHI_OF_MARKER, of_bodies = e->kind == MHI_OF_MASS;
    const char *none = !of_markers && e->markers.n > 0                              ? "markers"
                       : !of_bodies && e->bodies.n > 0                              ? "bodies"
                       : (of_markers || of_bodies) && e->muscles.n > 0              ? "muscles"
                       : (of_markers || e->kind == MHI_OF_INSERTION) && e->together ? "together"
                                                                                    : NULL;
    return none == NULL ? MHE_OK
                        : mhi_fail_at(err, MHE_E_CONFIG, run->tree, e->node,
                                      "calibrate.parameters: %s has no '%s'", name, none);
}

/* The key `name` of an entry is its kind. */
static mhe_status read_entries(mhi_run *run, const mhi_node *list, mhi_plan *plan, mhe_error *err) {
    if (list == NULL || list->kind != MHI_SEQUENCE || list->first == NULL) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, list,
                           "calibrate.parameters: a list is needed: [{name: max_isometric_force}, "
                           "...]");
    }
    mhe_option options[N(entry_options)];
    memcpy(options, entry_options, sizeof options);
    options[0].key = "name";
    plan->entries = MHI_TAKE(&run->arena, mhi_plan_entry, mhi_node_count(list));
    mhe_status status =
        plan->entries == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    for (mhi_node *node = list->first; node != NULL && status == MHE_OK; node = node->next) {
        mhi_plan_entry *e = &plan->entries[plan->n_entries];
        status = mhi_node_expand(run->tree, node, "name", err);
        if (status == MHE_OK && mhi_node_find(node, "name") == NULL) {
            status = mhi_fail_at(err, MHE_E_CONFIG, run->tree, node,
                                 "calibrate.parameters: 'name' is missing");
        }
        if (status == MHE_OK) {
            status = mhi_options_fill(options, N(options), run->tree, node, NULL, 0,
                                      "calibrate.parameters", run->dir, &run->arena, e, err);
        }
        e->node = node;
        status = status == MHE_OK ? check_entry(run, e, err) : status;
        plan->n_entries++;
    }
    return status;
}

static mhe_status read_recordings(mhi_run *run, mhi_registry *registry, const mhi_node *list,
                                  mhi_plan *plan, mhe_error *err) {
    const mhi_data_section *data = &run->data;
    const int32_t own = data->markers != NULL || data->angles != NULL;
    if (data->emg != NULL && !own) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree,
                           mhi_node_find(mhi_tree_root(run->tree), "data"),
                           "data: emg without 'markers' or 'angles': there is no motion to learn "
                           "from");
    }
    if (list != NULL && list->kind != MHI_SEQUENCE) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, list,
                           "calibrate.recordings: must be a list: [{markers: FILE, emg: FILE}, "
                           "...]");
    }
    plan->recordings =
        MHI_TAKE(&run->arena, mhi_plan_recording, 1 + (list == NULL ? 0 : mhi_node_count(list)));
    if (plan->recordings == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    if (own) {
        plan->recordings[plan->n_recordings++] =
            (mhi_plan_recording){.markers = data->markers,
                                 .emg = data->emg,
                                 .angles = data->angles,
                                 .reference = data->reference,
                                 .external_loads = data->external_loads,
                                 .emg_offset = data->emg_offset,
                                 .loads = run->external_loads};
    }
    mhe_status status = MHE_OK;
    for (mhi_node *node = list == NULL ? NULL : list->first; node != NULL && status == MHE_OK;
         node = node->next) {
        mhi_plan_recording *r = &plan->recordings[plan->n_recordings++];
        status = mhi_options_fill(recording_options, N(recording_options), run->tree, node, NULL, 0,
                                  "calibrate.recordings", run->dir, &run->arena, r, err);
        r->node = node;
        if (status == MHE_OK && r->markers == NULL && r->angles == NULL) {
            status = mhi_fail_at(err, MHE_E_CONFIG, run->tree, node,
                                 "calibrate.recordings: neither 'markers' nor 'angles' is given: "
                                 "there is no motion to learn from");
        }
        if (status == MHE_OK && r->external_loads != NULL) {
            status = mhi_run_read_loads(run, registry, r->external_loads,
                                        mhi_node_find(node, "external_loads"), &r->loads, err);
        }
    }
    int32_t n = 0;
    for (int32_t i = 0; i < plan->n_recordings; i++) {
        n += !plan->recordings[i].hold_out;
    }
    return status == MHE_OK && n == 0
               ? mhi_fail_at(err, MHE_E_CONFIG, run->tree, list,
                             "calibrate: there is no recording to learn from: data.markers and "
                             "data.emg, or calibrate.recordings")
               : status;
}

void mhi_plan_take(const mhi_plan_recording *recording, mhi_run *run) {
    run->data.markers = recording->markers;
    run->data.emg = recording->emg;
    run->data.angles = recording->angles;
    run->data.reference = recording->reference;
    run->data.external_loads = recording->external_loads;
    run->data.emg_offset = recording->emg_offset;
    run->external_loads = recording->loads;
}

mhe_status mhi_plan_read(mhi_run *run, mhi_registry *registry, mhi_plan *plan, mhe_error *err) {
    static const char *const lists[] = {"recordings", "parameters"};
    const mhi_node *section = mhi_node_find(mhi_tree_root(run->tree), "calibrate");
    *plan = (mhi_plan){0};
    if (section == NULL || section->kind != MHI_MAPPING) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, section,
                           "the section 'calibrate' is missing: calibrate: {parameters: "
                           "[max_isometric_force, ...]}");
    }
    mhe_status status = mhi_options_fill(plan_options, N(plan_options), run->tree, section, lists,
                                         2, "calibrate", run->dir, &run->arena, plan, err);
    if (status == MHE_OK) {
        status = read_recordings(run, registry, mhi_node_find(section, "recordings"), plan, err);
    }
    return status == MHE_OK ? read_entries(run, mhi_node_find(section, "parameters"), plan, err)
                            : status;
}

void mhi_plan_describe(mhi_text *out) {
    mhe_option options[N(entry_options)];
    memcpy(options, entry_options, sizeof options);
    options[0].key = "name";
    mhi_text_add(out, "calibrate: What mhe-calibrate does.\n");
    mhi_options_text(plan_options, N(plan_options), out);
    mhi_text_add(out, "\ncalibrate.recordings: A list, beside the data section's own.\n");
    mhi_options_text(recording_options, N(recording_options), out);
    mhi_text_add(out, "\ncalibrate.parameters: A list: what is estimated.\n");
    mhi_options_text(options, N(options), out);
}

/* SPDX-License-Identifier: Apache-2.0 */
#include "summary.h"

#include "base/pi.h"
#include "base/text.h"
#include "measure.h"

#include <cJSON.h>
#include <math.h>
#include <mhe/library.h>
#include <stdlib.h>
#include <string.h>

/* Of the sorted solve times, ms. */
static double percentile(const summary *s, double fraction) {
    return measure_percentile(s->tally.solve_ms, s->tally.n_solves, fraction);
}

/* cJSON writes NaN as null, which is what "not known" is in JSON. */
static void add_number(cJSON *object, const char *key, double value) {
    cJSON_AddNumberToObject(object, key, value);
}

static void add_rmse(cJSON *root, const mhe_rmse *rmse) {
    const double degrees = MHI_DEGREES;
    cJSON *o = cJSON_AddObjectToObject(root, "rmse");
    add_number(o, "q_deg", degrees * rmse->q);
    add_number(o, "qdot_rad_s", rmse->qdot);
    add_number(o, "activation", rmse->activation);
    add_number(o, "excitation", rmse->excitation);
    add_number(o, "force_n", rmse->force);
    add_number(o, "marker_mm", 1e3 * rmse->marker);
}

static void add_times(cJSON *root, const summary *s) {
    cJSON *rate = cJSON_AddObjectToObject(root, "rate_hz");
    add_number(rate, "mean", 1e3 / tally_mean_ms(&s->tally));
    cJSON *ms = cJSON_AddObjectToObject(root, "solve_ms");
    add_number(ms, "mean", tally_mean_ms(&s->tally));
    add_number(ms, "p50", percentile(s, 0.5));
    add_number(ms, "p95", percentile(s, 0.95));
    add_number(ms, "p99", percentile(s, 0.99));
    add_number(ms, "max", percentile(s, 1));
}

/* ms from a frame to its estimate: by the clock as it was, else what the solve took. */
static double latency(const summary *s, double fraction) {
    return s->live == NULL
               ? percentile(s, fraction)
               : 1e3 * measure_percentile(s->live->latency, s->live->n_latency, fraction);
}

/* Where raw EMG was processed: what that takes. The latency is that from the electrode to the
 * estimate: filters, window, and the way from the newest frame to the estimate. */
static void add_emg(cJSON *root, const summary *s) {
    const mhe_recording_info *emg = &s->recording;
    cJSON *o = cJSON_AddObjectToObject(root, "emg");
    add_number(o, "channels", emg->emg_channels);
    add_number(o, "rate_hz", emg->emg_rate);
    add_number(o, "offset_ms", 1e3 * emg->emg_offset);
    add_number(o, "filter_delay_ms", 1e3 * emg->emg_filter_delay);
    add_number(o, "lag_ms", 1e3 * emg->emg_lag);
    const double before = 1e3 * (s->info.delay + emg->emg_filter_delay);
    cJSON *latencies = cJSON_AddObjectToObject(o, "latency_ms");
    add_number(latencies, "p50", before + latency(s, 0.5));
    add_number(latencies, "p99", before + latency(s, 0.99));
}

static void add_spread(cJSON *parent, const char *key, const double *sorted_s, int32_t n) {
    cJSON *o = cJSON_AddObjectToObject(parent, key);
    add_number(o, "p50", 1e3 * measure_percentile(sorted_s, n, 0.5));
    add_number(o, "p95", 1e3 * measure_percentile(sorted_s, n, 0.95));
    add_number(o, "p99", 1e3 * measure_percentile(sorted_s, n, 0.99));
    add_number(o, "p99.9", 1e3 * measure_percentile(sorted_s, n, 0.999));
    add_number(o, "max", 1e3 * measure_percentile(sorted_s, n, 1));
}

static void add_realtime(cJSON *root, const summary *s) {
    const live *l = s->live;
    cJSON *o = cJSON_AddObjectToObject(root, "realtime");
    add_number(o, "deadline_ms", 1e3 * l->deadline);
    cJSON_AddStringToObject(o, "priority", l->has_priority ? "real-time" : "ordinary");
    add_number(o, "rate_hz", s->tally.n_solves / s->elapsed);
    add_number(o, "missed_frames", l->n_missed);
    add_spread(o, "latency_ms", l->latency, l->n_latency);
    add_spread(o, "jitter_ms", l->jitter, l->n_jitter);
}

/* Whose code made the results. */
static void add_plugins(cJSON *root, const mhe_config *config) {
    cJSON *o = cJSON_AddObjectToObject(root, "plugins");
    const char *id = NULL, *file = NULL;
    for (int32_t i = 0; mhe_config_plugin(config, i, &id, &file); i++) {
        cJSON_AddStringToObject(o, id, file);
    }
}

static const char *weight_name(int32_t weight) {
    return weight == MHE_FINDING_NOTE       ? "note"
           : weight == MHE_FINDING_DOUBTFUL ? "doubtful"
                                            : "not usable";
}

static const char *usable(int32_t weight) {
    return weight == MHE_FINDING_NOTE ? "yes" : weight == MHE_FINDING_DOUBTFUL ? "doubtful" : "no";
}

static void add_verdict(cJSON *root, const summary *s) {
    cJSON *verdict = cJSON_AddObjectToObject(root, "verdict");
    cJSON_AddStringToObject(verdict, "usable", usable(s->weight));
    cJSON *list = cJSON_AddArrayToObject(verdict, "findings");
    mhe_finding f = {.size = sizeof f};
    for (int32_t i = 0; mhe_findings_at(s->findings, i, &f, NULL) == MHE_OK; i++) {
        cJSON *one = cJSON_CreateObject();
        cJSON_AddStringToObject(one, "weight", weight_name(f.weight));
        cJSON_AddStringToObject(one, "what", f.text);
        cJSON_AddStringToObject(one, "remedy", f.remedy);
        cJSON_AddItemToArray(list, one);
    }
    cJSON *dropped = cJSON_AddArrayToObject(root, "dropped");
    const char *what = NULL;
    for (int32_t i = 0; (what = mhe_config_dropped(s->config, i)) != NULL; i++) {
        cJSON_AddItemToArray(dropped, cJSON_CreateString(what));
    }
}

/* Shares of the estimates; rms in m or, of muscles, as a share of the MVC. */
static void add_channel(cJSON *channels, const char *prefix, const char *name, double present,
                        double rms, double left_out) {
    mhi_text key = {0};
    mhi_text_add(&key, "%s%s",
                 cJSON_GetObjectItemCaseSensitive(channels, name) == NULL ? "" : prefix, name);
    cJSON *one = cJSON_AddObjectToObject(channels, key.data == NULL ? name : key.data);
    add_number(one, "present", present);
    add_number(one, "rms", rms);
    add_number(one, "left_out", left_out);
    mhi_text_free(&key);
}

/* Markers and EMG as wholes, then each by its name. */
static void add_channels(cJSON *root, const summary *s) {
    cJSON *channels = cJSON_AddObjectToObject(root, "channels");
    const mhe_estimator_info *f = &s->info;
    for (int32_t kind = 0; kind < 2; kind++) {
        const int32_t n = kind == 0 ? f->n_markers : f->n_muscles;
        const double n_estimates = s->tally.n_solves;
        double squares = 0, present = 0, left_out = 0;
        for (int32_t pass = 0; pass < 2; pass++) {
            for (int32_t i = 0; i < n; i++) {
                mhe_tracking t = {.size = sizeof t};
                (void)(kind == 0 ? mhe_findings_marker : mhe_findings_muscle)(s->findings, i, &t,
                                                                              NULL);
                if (pass == 0) {
                    squares += t.present > 0 ? t.present * t.rms * t.rms : 0;
                    present += t.present;
                    left_out += t.left_out;
                } else {
                    add_channel(channels, kind == 0 ? "marker " : "emg ",
                                kind == 0 ? f->marker_names[i] : f->muscle_names[i],
                                t.present / n_estimates, t.rms, t.left_out / n_estimates);
                }
            }
            if (pass == 0 && n > 0) {
                add_channel(channels, "", kind == 0 ? "markers" : "emg", present / n / n_estimates,
                            present > 0 ? sqrt(squares / present) : NAN,
                            left_out / n / n_estimates);
            }
        }
    }
}

/* Largest reactions by joint, and residual forces beside the largest load. */
static void add_peaks(cJSON *root, const summary *s) {
    const peaks *p = &s->peaks;
    cJSON *list = p->n_joints > 0 ? cJSON_AddObjectToObject(root, "reactions") : NULL;
    for (int32_t i = 0; i < p->n_joints; i++) {
        cJSON *one = cJSON_AddObjectToObject(list, s->info.joint_names[i]);
        add_number(one, "force_max", p->force[i]);
        add_number(one, "time", p->time[i]);
        add_number(one, "moment_max", p->moment[i]);
    }
    list = p->n_residuals > 0 ? cJSON_AddObjectToObject(root, "residuals") : NULL;
    for (int32_t i = 0; i < p->n_residuals; i++) {
        cJSON *one = cJSON_AddObjectToObject(list, s->info.coordinate_names[i]);
        add_number(one, "max", p->residual[i]);
        add_number(one, "rms", sqrt(p->squares[i] / p->n_estimates));
        if (p->load > 0) {
            add_number(one, "share_of_load", p->residual[i] / p->load);
        }
    }
    if (p->load > 0) {
        add_number(root, "load_max", p->load);
    }
}

mhe_status summary_take_offsets(summary *s, const mhe_estimator *estimator, mhe_error *err) {
    double *offsets = malloc(sizeof *offsets * (3 * (size_t)s->info.n_markers + 1));
    if (offsets == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    free(s->marker_offsets);
    s->marker_offsets = offsets;
    if (!mhe_estimator_marker_offsets(estimator, offsets)) {
        s->marker_offsets = NULL;
        free(offsets);
    }
    return MHE_OK;
}

static double length(const double *v) {
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* How far markers are from their places in their segments, mm along the axes of their bodies. */
static void add_marker_offsets(cJSON *root, const summary *s) {
    cJSON *all = s->marker_offsets != NULL ? cJSON_AddObjectToObject(root, "marker_offsets") : NULL;
    for (int32_t i = 0; i < s->info.n_markers && all != NULL; i++) {
        double mm[3];
        for (int32_t j = 0; j < 3; j++) {
            mm[j] = 1e3 * s->marker_offsets[3 * i + j];
        }
        cJSON_AddItemToObject(all, s->info.marker_names[i], cJSON_CreateDoubleArray(mm, 3));
    }
}

static void offsets_line(const summary *s, mhi_text *out) {
    const int32_t n = s->info.n_markers;
    double squares = 0;
    int32_t most = 0;
    for (int32_t i = 0; i < n; i++) {
        squares += pow(length(s->marker_offsets + 3 * i), 2);
        most = length(s->marker_offsets + 3 * i) > length(s->marker_offsets + 3 * most) ? i : most;
    }
    const double *v = s->marker_offsets + 3 * most;
    mhi_text_add(out,
                 "markers are %.1f mm from their places (RMS, learnt); farthest %s: %.1f mm (%.1f, "
                 "%.1f, %.1f along the axes of its body); all in summary.json\n",
                 1e3 * sqrt(squares / n), s->info.marker_names[most], 1e3 * length(v), 1e3 * v[0],
                 1e3 * v[1], 1e3 * v[2]);
}

mhe_status summary_json(summary *s, const char *path, mhi_text *out, mhe_error *err) {
    tally_sort(&s->tally);
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "version", mhe_version());
    cJSON_AddStringToObject(root, "config", path);
    cJSON *model = cJSON_AddObjectToObject(root, "model");
    add_number(model, "nq", s->info.n_q);
    add_number(model, "nmuscles", s->info.n_muscles);
    add_number(model, "nmarkers", s->info.n_markers);
    add_plugins(root, s->config);
    cJSON_AddStringToObject(root, "formulation",
                            s->info.formulation == 0 ? "excitation" : "activation");
    add_number(root, "n_window", s->info.window);
    add_number(root, "ratio", s->info.ratio);
    cJSON_AddStringToObject(root, "solver", s->info.solver);
    add_number(root, "frames", s->n_pushed);
    add_number(root, "solves", s->tally.n_solves);
    add_number(root, "converged", tally_converged(&s->tally));
    add_times(root, s);
    cJSON *iterations = cJSON_AddObjectToObject(root, "iterations");
    add_number(iterations, "mean", tally_iterations(&s->tally));
    add_number(iterations, "max", s->tally.iterations_max);
    cJSON *programs = cJSON_AddObjectToObject(root, "quadratic_programs");
    add_number(programs, "solved", (double)s->tally.programs);
    add_number(programs, "fallbacks", (double)s->tally.fallbacks);
    add_number(root, "deadline_misses", s->tally.n_deadline);
    add_number(root, "peak_rss_mb", tally_peak_rss_mb());
    add_number(root, "node", s->info.node);
    add_number(root, "delay_s", s->info.delay);
    if (s->live != NULL) {
        add_realtime(root, s);
    }
    if (s->recording.emg_channels > 0) {
        add_emg(root, s);
    }
    if (s->has_rmse) {
        add_rmse(root, &s->rmse);
    }
    add_peaks(root, s);
    add_marker_offsets(root, s);
    add_verdict(root, s);
    add_channels(root, s);
    char *text = cJSON_Print(root);
    cJSON_Delete(root);
    if (text == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhi_text_add(out, "%s\n", text);
    cJSON_free(text);
    return MHE_OK;
}

void summary_verdict(const summary *s, mhi_text *out) {
    mhe_finding f = {.size = sizeof f};
    mhi_text_add(out, "usable: %s\n", usable(s->weight));
    for (int32_t level = MHE_FINDING_USELESS; level >= MHE_FINDING_NOTE; level--) {
        for (int32_t i = 0; mhe_findings_at(s->findings, i, &f, NULL) == MHE_OK; i++) {
            if (f.weight == level) {
                mhi_text_add(out, "  %s: %s\n", weight_name(level), f.text);
                if (*f.remedy != '\0') {
                    mhi_text_add(out, "    try: %s\n", f.remedy);
                }
            }
        }
    }
    int32_t n = 0;
    while (mhe_config_dropped(s->config, n) != NULL) {
        n++;
    }
    if (n > 0) {
        mhi_text_add(out, "left out of the model: %d element%s (summary.json: dropped), first %s\n",
                     n, n == 1 ? "" : "s", mhe_config_dropped(s->config, 0));
    }
}

void summary_lines(const summary *s, mhi_text *out) {
    if (s->recording.emg_channels > 0) {
        mhi_text_add(out, "%s\n", s->recording.alignment);
    }
    mhi_text_add(out, "%d frames, %d solves, %.2f %% converged\n", s->n_pushed, s->tally.n_solves,
                 s->tally.n_solves == 0 ? 0.0 : 100.0 * s->tally.n_converged / s->tally.n_solves);
    if (s->tally.n_solves > 0) {
        mhi_text_add(out, "rate %.1f Hz mean; solve %.2f ms median, %.2f ms p99, %.2f ms max\n",
                     1e3 / tally_mean_ms(&s->tally), percentile(s, 0.5), percentile(s, 0.99),
                     percentile(s, 1));
    }
    if (s->recording.emg_channels > 0 && s->tally.n_solves > 0) {
        const double before = 1e3 * (s->info.delay + s->recording.emg_filter_delay);
        mhi_text_add(
            out,
            "from electrode to estimate: filters %.3g ms, window %.3g ms, then %.2f ms median, "
            "%.2f ms p99; together %.4g ms (p99)\n",
            1e3 * s->recording.emg_filter_delay, 1e3 * s->info.delay, latency(s, 0.5),
            latency(s, 0.99), before + latency(s, 0.99));
    }
    if (s->live != NULL) {
        live_lines(s->live, s->tally.n_solves / s->elapsed, out);
    }
    const struct {
        const char *what, *unit;
        double value;
    } errors[] = {{"joint angles", "deg", MHI_DEGREES * s->rmse.q},
                  {"muscle forces", "N", s->rmse.force},
                  {"markers", "mm", 1e3 * s->rmse.marker}};
    const char *lead = "error against the reference (RMSE): ";
    for (size_t i = 0; i < sizeof errors / sizeof errors[0] && s->has_rmse; i++) {
        if (!isnan(errors[i].value)) {
            mhi_text_add(out, "%s%s %.4g %s", lead, errors[i].what, errors[i].value,
                         errors[i].unit);
            lead = ", ";
        }
    }
    mhi_text_add(out, strcmp(lead, ", ") == 0 ? "\n" : "");
    if (s->marker_offsets != NULL) {
        offsets_line(s, out);
    }
}

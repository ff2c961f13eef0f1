/* SPDX-License-Identifier: Apache-2.0 */
#include "report.h"

#include "base/pi.h"

#include <cJSON.h>
#include <math.h>
#include <mhe/version.h>
#include <string.h>

/* ---- terminal ---- */

static int width_of_names(const variants *v) {
    size_t width = strlen("feedback by frame, ms");
    for (int32_t i = 0; i < v->n; i++) {
        const size_t length = strlen(v->list[i].name);
        width = length > width ? length : width;
    }
    return (int)width;
}

static void add_ratio(const bench_ratio *r, int several, mhi_text *out) {
    if (several) {
        mhi_text_add(out, " %7.3f %7.3f %7.3f", r->least, r->median, r->most);
    }
}

static void add_layers(const bench *b, mhi_text *out) {
    const int several = b->setup->variants->n_groups > 1;
    mhi_text_add(out, "%-36s %9s %9s %9s %9s%s\n", "layer (us a call)", "p50", "p95", "p99", "max",
                 several ? "   x min   x med   x max  variant" : "");
    for (int32_t i = 0; i < b->n_layers; i++) {
        const bench_layer *l = &b->layers[i];
        const bench_spread *s = &l->spread;
        char name[64] = "";
        if (l->layer == LAYER_LINEARISATION) {
            (void)snprintf(name, sizeof name, ", N = %d", l->rig->info.window);
        }
        mhi_text_add(out, "%s%-*s %9.2f %9.2f %9.2f %9.2f", layer_names[l->layer],
                     36 - (int)strlen(layer_names[l->layer]), name, 1e6 * s->p50, 1e6 * s->p95,
                     1e6 * s->p99, 1e6 * s->most);
        add_ratio(&l->ratio, several, out);
        mhi_text_add(out, several ? "  %s\n" : "\n", l->rig->variant->group_name);
    }
}

static void add_runs(const bench *b, mhi_text *out) {
    const variants *v = b->setup->variants;
    const int width = width_of_names(v), several = v->n > 1;
    mhi_text_add(out, "\n%-*s %8s %8s %8s %8s %8s %8s %7s%s%s\n", width, "whole frames", "rate Hz",
                 "p50 ms", "p95", "p99", "max", "first", "conv %",
                 several ? "   x min   x med   x max" : "",
                 b->runs[0].rig.has_rmse ? "   q deg   force N" : "");
    for (int32_t i = 0; i < v->n; i++) {
        const bench_run *run = &b->runs[i];
        const bench_spread *s = &run->parts[PART_FRAME].spread;
        const rig *r = &run->rig;
        mhi_text_add(out, "%-*s %8.1f %8.3f %8.3f %8.3f %8.3f %8.3f %7.2f", width, v->list[i].name,
                     run->rate, 1e3 * s->p50, 1e3 * s->p95, 1e3 * s->p99, 1e3 * s->most,
                     1e3 * run->first, 100.0 * r->n_converged / r->n_estimates);
        add_ratio(&run->ratio, several, out);
        if (r->has_rmse) {
            mhi_text_add(out, " %8.4f %8.3f", 180 / MHI_PI * r->rmse.q, r->rmse.force);
        }
        mhi_text_add(out, "\n");
    }
}

/* Where a frame's time goes, and how late its estimate is. */
static void add_parts(const bench *b, mhi_text *out) {
    const variants *v = b->setup->variants;
    const int width = width_of_names(v);
    mhi_text_add(out, "\n%-*s %11s %12s %8s %8s %8s %8s %12s %8s\n", width, "of it, ms",
                 "prepare p50", "feedback p50", "p95", "p99", "p99.9", "max", "evaluate p50",
                 "rest p50");
    for (int32_t i = 0; i < v->n; i++) {
        const bench_part *of = b->runs[i].parts;
        const bench_spread *f = &of[PART_FEEDBACK].spread;
        mhi_text_add(out, "%-*s %11.3f %12.3f %8.3f %8.3f %8.3f %8.3f %12.3f %8.3f\n", width,
                     v->list[i].name, 1e3 * of[PART_PREPARE].spread.p50, 1e3 * f->p50, 1e3 * f->p95,
                     1e3 * f->p99, 1e3 * f->p999, 1e3 * f->most,
                     1e3 * of[PART_EVALUATION].spread.p50, 1e3 * of[PART_REST].spread.p50);
    }
}

/* The slowest frames by the clock and by their own work. */
static void add_tails(const bench *b, mhi_text *out) {
    const variants *v = b->setup->variants;
    const int width = width_of_names(v);
    mhi_text_add(out, "\n%-*s %13s %8s %8s %8s %8s %13s\n", width, "feedback by frame, ms",
                 "one run, x", "p50", "p99", "p99.9", "max", "p99.9, x");
    for (int32_t i = 0; i < v->n; i++) {
        const bench_part *of = &b->runs[i].parts[PART_FEEDBACK];
        const bench_spread *f = &of->by_frame;
        mhi_text_add(out, "%-*s %13.2f %8.3f %8.3f %8.3f %8.3f %13.2f\n", width, v->list[i].name,
                     of->tail, 1e3 * f->p50, 1e3 * f->p99, 1e3 * f->p999, 1e3 * f->most,
                     f->p999 / f->p50);
    }
    mhi_text_add(out,
                 "one run, x: p99.9 over p50 of a run's feedback, median of the runs. Then "
                 "each frame counts with its median of the %d runs: what the program takes, "
                 "without what the machine adds.\n",
                 b->setup->repeats);
}

void report_table(const bench *b, mhi_text *out) {
    const rig *r = &b->runs[0].rig;
    mhi_text_add(out, "%s: %d coordinates, %d muscles, %d markers; %d %s of each variant\n\n",
                 r->info.config_name, r->info.n_q, r->info.n_muscles, r->info.n_markers,
                 b->setup->repeats, b->setup->repeats == 1 ? "run" : "runs, in alternation,");
    if (b->n_layers > 0) {
        add_layers(b, out);
    }
    add_runs(b, out);
    add_parts(b, out);
    if (b->setup->repeats > 1) {
        add_tails(b, out);
    }
    mhi_text_add(
        out,
        "\nx: times the first variant, measured side by side. first: the first estimate of a "
        "run, which the other columns leave out. prepare: before the frame is there; feedback: "
        "from the frame to its estimate, of that evaluate: costs, dynamics and derivatives, rest: "
        "quadratic programs and all else. All in %.0f s.\n",
        b->elapsed);
}

/* ---- bench.json ---- */

/* cJSON writes NaN as null, which is what "not known" is in JSON. */
static void add_number(cJSON *object, const char *key, double value) {
    cJSON_AddNumberToObject(object, key, value);
}

static cJSON *json_spread(cJSON *object, const char *key, const bench_spread *s, double scale) {
    cJSON *o = cJSON_AddObjectToObject(object, key);
    add_number(o, "p50", scale * s->p50);
    add_number(o, "p95", scale * s->p95);
    add_number(o, "p99", scale * s->p99);
    add_number(o, "p99.9", scale * s->p999);
    add_number(o, "max", scale * s->most);
    return o;
}

static void json_ratio(cJSON *object, const bench_ratio *r) {
    cJSON *o = cJSON_AddObjectToObject(object, "ratio_to_first");
    add_number(o, "min", r->least);
    add_number(o, "median", r->median);
    add_number(o, "max", r->most);
}

static void json_setting(cJSON *object, const rig *r) {
    cJSON_AddStringToObject(object, "formulation",
                            r->info.formulation == 0 ? "excitation" : "activation");
    cJSON_AddStringToObject(object, "solver", r->info.solver);
    add_number(object, "n_window", r->info.window);
    add_number(object, "ratio", r->info.ratio);
}

static void json_layer(cJSON *list, const bench_layer *l) {
    cJSON *o = cJSON_CreateObject();
    cJSON_AddItemToArray(list, o);
    cJSON_AddStringToObject(o, "layer", layer_keys[l->layer]);
    cJSON_AddStringToObject(o, "variant", l->rig->variant->group_name);
    json_setting(o, l->rig);
    add_number(o, "samples", l->n);
    add_number(o, "calls_per_sample", l->calls);
    (void)json_spread(o, "us", &l->spread, 1e6);
    json_ratio(o, &l->ratio);
}

static void json_run(cJSON *list, const bench_run *run) {
    const rig *r = &run->rig;
    cJSON *o = cJSON_CreateObject();
    cJSON_AddItemToArray(list, o);
    cJSON_AddStringToObject(o, "variant", r->variant->name);
    json_setting(o, r);
    add_number(o, "estimates", r->n_estimates);
    add_number(o, "converged", (double)r->n_converged / r->n_estimates);
    cJSON *iterations = cJSON_AddObjectToObject(o, "iterations");
    add_number(iterations, "mean", r->iterations_sum / r->n_estimates);
    add_number(iterations, "max", r->iterations_max);
    add_number(o, "rate_hz", run->rate);
    static const char *const keys[N_PARTS] = {[PART_FRAME] = "frame_ms",
                                              [PART_PREPARE] = "prepare_ms",
                                              [PART_FEEDBACK] = "feedback_ms",
                                              [PART_EVALUATION] = "feedback_evaluation_ms",
                                              [PART_REST] = "feedback_rest_ms"};
    for (int32_t part = 0; part < N_PARTS; part++) {
        const bench_part *of = &run->parts[part];
        cJSON *times = json_spread(o, keys[part], &of->spread, 1e3);
        add_number(times, "p99.9_over_p50_of_a_run", of->tail);
        (void)json_spread(times, "by_frame", &of->by_frame, 1e3);
    }
    add_number(o, "first_frame_ms", 1e3 * run->first);
    json_ratio(o, &run->ratio);
    if (r->has_rmse) {
        cJSON *rmse = cJSON_AddObjectToObject(o, "rmse");
        add_number(rmse, "q_deg", 180 / MHI_PI * r->rmse.q);
        add_number(rmse, "force_n", r->rmse.force);
        add_number(rmse, "marker_mm", 1e3 * r->rmse.marker);
    }
}

mhe_status report_json(const bench *b, const char *config, mhi_text *out, mhe_error *err) {
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "version", MHE_VERSION);
    cJSON_AddStringToObject(root, "config", config);
    cJSON *model = cJSON_AddObjectToObject(root, "model");
    add_number(model, "nq", b->runs[0].rig.info.n_q);
    add_number(model, "nmuscles", b->runs[0].rig.info.n_muscles);
    add_number(model, "nmarkers", b->runs[0].rig.info.n_markers);
    add_number(root, "repeats", b->setup->repeats);
    add_number(root, "elapsed_s", b->elapsed);
    cJSON *layer_list = cJSON_AddArrayToObject(root, "layers");
    for (int32_t i = 0; i < b->n_layers; i++) {
        json_layer(layer_list, &b->layers[i]);
    }
    cJSON *run_list = cJSON_AddArrayToObject(root, "runs");
    for (int32_t i = 0; i < b->setup->variants->n; i++) {
        json_run(run_list, &b->runs[i]);
    }
    char *text = cJSON_Print(root);
    cJSON_Delete(root);
    if (text == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhi_text_add(out, "%s\n", text);
    cJSON_free(text);
    return MHE_OK;
}

/* ---- frames.csv ---- */

void report_frames(const bench *b, mhi_text *out) {
    mhi_text_add(out, "variant,run,estimate,prepare_ms,feedback_ms,feedback_evaluation_ms\n");
    for (int32_t i = 0; i < b->setup->variants->n; i++) {
        const bench_run *run = &b->runs[i];
        for (int32_t j = 0; j < run->n; j++) {
            mhi_text_add(
                out, "%d,%d,%d,%.6f,%.6f,%.6f\n", (int)(i + 1), (int)(j / run->n_frames + 1),
                (int)(j % run->n_frames + 2), 1e3 * run->parts[PART_PREPARE].all[j],
                1e3 * run->parts[PART_FEEDBACK].all[j], 1e3 * run->parts[PART_EVALUATION].all[j]);
        }
    }
}

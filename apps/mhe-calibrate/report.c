/* SPDX-License-Identifier: Apache-2.0 */
#include "report.h"

#include "base/pi.h"

#include <cjson/cJSON.h>
#include <math.h>

const char *report_outcome(const mhi_calibration *c) {
    static const char *const outcomes[] = {"converged",   "iteration limit", "infeasible",
                                           "no progress", "deadline",        "interrupted"};
    return outcomes[c->info.outcome];
}

const char *report_verdict(const mhi_estimated *e) {
    return e->at_bound    ? "at bound"
           : isnan(e->sd) ? "no deviation"
           : e->informed  ? "informed"
                          : "not informed";
}

static void find_in(const mhi_estimated *e, mhi_text *out) {
    const double off = (e->value - e->mean) / e->prior_sd;
    if (e->at_bound) {
        mhi_text_add(out, "%s stands at its bound, %.4g\n", e->name, e->value);
    }
    if (fabs(off) > 3) {
        mhi_text_add(out,
                     "%s: the data contradict what was expected, %.4g, by %.1f standard "
                     "deviations\n",
                     e->name, e->mean, fabs(off));
    }
    if (!e->informed) {
        mhi_text_add(out, "%s: not informed by these recordings, what was expected is kept\n",
                     e->name);
    }
}

#define ABOVE_MVC 1.05 /* what a sample may reach by noise alone */

/* Least and most of a muscle's EMG over the recordings, or over those that are learned from. */
static void emg_range(const mhi_calibration *c, int32_t m, int32_t learned, double *least,
                      double *most) {
    const int32_t n_m = c->model->n_muscles;
    *least = INFINITY;
    *most = -INFINITY;
    for (int32_t i = 0; i < c->plan.n_recordings; i++) {
        const mhi_recording *r = c->motions[i].recording;
        const int32_t counts = r->emg != NULL && !(learned && c->plan.recordings[i].hold_out);
        for (int32_t k = 0; counts && k < r->n_frames; k++) {
            *least = fmin(*least, r->emg[(ptrdiff_t)k * n_m + m]);
            *most = fmax(*most, r->emg[(ptrdiff_t)k * n_m + m]);
        }
    }
}

/* EMG beyond the maximum that it was divided by, and EMG that never changes. */
static void find_in_emg(const mhi_calibration *c, mhi_text *out) {
    for (int32_t m = 0; m < c->model->n_muscles; m++) {
        const char *name = c->model->muscles[m].name;
        const mhi_estimated *gain = mhi_calibration_find(c, MHI_OF_GAIN, m, -1);
        double least, most;
        emg_range(c, m, 0, &least, &most);
        if (most > ABOVE_MVC && gain == NULL) {
            mhi_text_add(out,
                         "EMG of %s reaches %.2f times its MVC, which was no maximum: without an "
                         "emg_gain for it, forces are too large\n",
                         name, most);
        } else if (most > ABOVE_MVC) {
            mhi_text_add(out,
                         "EMG of %s reaches %.2f times its MVC, which was no maximum: its emg_gain "
                         "became %.2f\n",
                         name, most, gain->value);
        }
        emg_range(c, m, 1, &least, &most);
        if (least == most) {
            mhi_text_add(out,
                         "EMG of %s is %.3g in every sample that was learned from: was the "
                         "electrode off? Leave it out, forces follow it\n",
                         name, most);
        }
    }
}

#define BADLY 0.005 /* m */
#define WORSE 4.0

/* Markers that fit far worse in one recording than in another, with the same person's numbers. */
static void find_in_recording(const report_content *r, const report_recording *one, mhi_text *out) {
    const report_recording *best = &r->recordings[0];
    for (int32_t i = 1; i < r->n_recordings; i++) {
        best = r->recordings[i].after.marker < best->after.marker ? &r->recordings[i] : best;
    }
    if (one->held_out && one->after.marker > 1.2 * one->before.marker) {
        mhi_text_add(out,
                     "%s, held out: markers fit worse than before (%.3g mm, %.3g mm): what was "
                     "learned does not carry over\n",
                     one->name, 1e3 * one->after.marker, 1e3 * one->before.marker);
    }
    if (one->after.marker > BADLY && one->after.marker > WORSE * best->after.marker) {
        mhi_text_add(out,
                     "%s: markers stay %.3g mm off, in %s %.3g mm: another person, other units, or "
                     "markers that were set anew?\n",
                     one->name, 1e3 * one->after.marker, best->name, 1e3 * best->after.marker);
    }
}

void report_findings(report_content *r) {
    const mhi_calibration *c = r->c;
    if (mhi_calibration_is_lost(&c->info)) {
        mhi_text_add(&r->findings,
                     "the search was lost after %d iterations (%s): what stands here is how far it "
                     "came. Do the costs say less noise than there is (residual_torque, EMG that "
                     "is late or of another person)?\n",
                     (int)c->info.iterations, report_outcome(c));
    } else if (c->info.outcome != MHE_SOLVE_CONVERGED) {
        mhi_text_add(&r->findings,
                     "the solve did not converge (%s after %d iterations): more "
                     "calibrate.max_iterations may help\n",
                     report_outcome(c), (int)c->info.iterations);
    }
    find_in_emg(c, &r->findings);
    for (int32_t i = 0; i < c->n; i++) {
        find_in(&c->list[i], &r->findings);
    }
    for (int32_t i = 0; i < r->n_recordings; i++) {
        find_in_recording(r, &r->recordings[i], &r->findings);
    }
}

void report_table(const report_content *r, mhi_text *out) {
    mhi_text_add(out, "parameter,before,after,sd,prior_sd,lower,upper,verdict\n");
    for (int32_t i = 0; i < r->c->n; i++) {
        const mhi_estimated *e = &r->c->list[i];
        mhi_text_add(out, "\"%s\",%.6g,%.6g,%.4g,%.4g,%.6g,%.6g,%s\n", e->name, e->mean, e->value,
                     e->sd, e->prior_sd, e->lower, e->upper, report_verdict(e));
    }
}

static void add_number(cJSON *to, const char *key, double value) {
    if (isfinite(value)) {
        cJSON_AddNumberToObject(to, key, value);
    } else {
        cJSON_AddNullToObject(to, key);
    }
}

static void add_errors(cJSON *to, const char *key, const held_out *h) {
    cJSON *one = cJSON_AddObjectToObject(to, key);
    add_number(one, "marker_rms_mm", 1e3 * h->marker);
    add_number(one, "emg_rms", h->emg);
    add_number(one, "q_deg", h->q * 180 / MHI_PI);
    add_number(one, "force_n", h->force);
    add_number(one, "activation", h->activation);
}

static void add_parameter(cJSON *list, const mhi_estimated *e) {
    cJSON *one = cJSON_CreateObject();
    cJSON_AddItemToArray(list, one);
    cJSON_AddStringToObject(one, "name", e->name);
    cJSON_AddStringToObject(one, "kind", mhi_plan_names[e->kind]);
    add_number(one, "before", e->mean);
    add_number(one, "after", e->value);
    add_number(one, "sd", e->sd);
    add_number(one, "prior_sd", e->prior_sd);
    cJSON_AddStringToObject(one, "verdict", report_verdict(e));
}

void report_json(const report_content *r, mhi_text *out) {
    const mhi_calibration *c = r->c;
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "outcome", report_outcome(c));
    cJSON_AddNumberToObject(root, "iterations", c->info.iterations);
    add_number(root, "objective", c->info.objective);
    add_number(root, "processor_seconds", c->seconds);
    cJSON_AddNumberToObject(root, "nodes", c->n_intervals + 1);
    cJSON *list = cJSON_AddArrayToObject(root, "parameters");
    for (int32_t i = 0; i < c->n; i++) {
        add_parameter(list, &c->list[i]);
    }
    cJSON *recordings = cJSON_AddArrayToObject(root, "recordings");
    for (int32_t i = 0; i < r->n_recordings; i++) {
        cJSON *one = cJSON_CreateObject();
        cJSON_AddItemToArray(recordings, one);
        cJSON_AddStringToObject(one, "name", r->recordings[i].name);
        cJSON_AddBoolToObject(one, "held_out", r->recordings[i].held_out);
        add_errors(one, "before", &r->recordings[i].before);
        add_errors(one, "after", &r->recordings[i].after);
    }
    char *text = cJSON_Print(root);
    mhi_text_add(out, "%s\n", text == NULL ? "{}" : text);
    cJSON_free(text);
    cJSON_Delete(root);
}

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
    return e->at_bound ? "at bound" : e->informed ? "informed" : "not informed";
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

void report_findings(report_content *r) {
    const mhi_calibration *c = r->c;
    if (c->info.outcome != MHE_SOLVE_CONVERGED) {
        mhi_text_add(&r->findings,
                     "the solve did not converge (%s after %d iterations): more "
                     "calibrate.max_iterations may help\n",
                     report_outcome(c), (int)c->info.iterations);
    }
    for (int32_t i = 0; i < c->n; i++) {
        find_in(&c->list[i], &r->findings);
    }
    for (int32_t i = 0; i < r->n_recordings; i++) {
        const report_recording *one = &r->recordings[i];
        if (one->held_out && one->after.marker > 1.2 * one->before.marker) {
            mhi_text_add(&r->findings,
                         "%s, held out: markers fit worse than before (%.3g mm, %.3g mm): what was "
                         "learned does not carry over\n",
                         one->name, 1e3 * one->after.marker, 1e3 * one->before.marker);
        }
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

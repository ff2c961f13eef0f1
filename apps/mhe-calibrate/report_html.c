/* SPDX-License-Identifier: Apache-2.0 */
/* report_html.c: the page. */
#include "report.h"

#include "base/pi.h"
#include "escape.h"

#include <math.h>

static void cell(mhi_text *out, double value, const char *unit) {
    if (isnan(value)) {
        mhi_text_add(out, "<td class=n>-</td>");
    } else {
        mhi_text_add(out, "<td class=n>%.3g%s</td>", value, unit);
    }
}

static void pair(mhi_text *out, double before, double after, const char *unit) {
    cell(out, before, unit);
    cell(out, after, unit);
}

static void recordings_html(const report_content *r, mhi_text *out) {
    const double degrees = 180 / MHI_PI;
    mhi_text_add(out,
                 "<h2>Recordings</h2>\n<table><tr><th>recording</th><th></th><th colspan=2>markers "
                 "(RMS)</th><th colspan=2>EMG (RMS)</th><th colspan=2>joint angles</th><th "
                 "colspan=2>forces</th></tr>\n<tr><th></th><th></th>");
    for (int32_t i = 0; i < 4; i++) {
        mhi_text_add(out, "<th>before</th><th>after</th>");
    }
    mhi_text_add(out, "</tr>\n");
    for (int32_t i = 0; i < r->n_recordings; i++) {
        const report_recording *one = &r->recordings[i];
        const held_out *b = &one->before, *a = &one->after;
        mhi_text_add(out, "<tr><td>");
        add_escaped(out, one->name);
        mhi_text_add(out, "</td><td>%s</td>", one->held_out ? "held out" : "learned from");
        pair(out, 1e3 * b->marker, 1e3 * a->marker, " mm");
        pair(out, b->emg, a->emg, "");
        pair(out, degrees * b->q, degrees * a->q, "&deg;");
        pair(out, b->force, a->force, " N");
        mhi_text_add(out, "</tr>\n");
    }
    mhi_text_add(out, "</table>\n<p>Joint angles and forces only where the truth is known "
                      "(<code>reference</code>).</p>\n");
}

#define WIDTH 220.0

/* What was expected and what was found as bands over the bounds. */
static void band(mhi_text *out, const mhi_estimated *e) {
    const double scale = WIDTH / (e->upper - e->lower);
    const double x = (e->value - e->lower) * scale, m = (e->mean - e->lower) * scale;
    const double sd = isnan(e->sd) ? 0 : e->sd * scale, prior = e->prior_sd * scale;
    const double p0 = fmax(0, m - prior), p1 = fmin(WIDTH, m + prior);
    const double a0 = fmax(0, x - 1.96 * sd), a1 = fmin(WIDTH, x + 1.96 * sd);
    mhi_text_add(
        out,
        "<td><svg width=220 height=14><rect x=0 y=6 width=220 height=2 fill='#ddd'/><rect x=%.1f "
        "y=4 width=%.1f height=6 fill='#cbd5e1'/><rect x=%.1f y=2 width=%.1f height=10 fill='%s' "
        "opacity=0.55 /><circle cx=%.1f cy=7 r=3.5 fill='#0f172a'/></svg></td>",
        p0, p1 - p0, a0, fmax(1, a1 - a0), e->informed ? "#2563eb" : "#d97706", x);
}

static void parameters_html(const report_content *r, mhi_text *out) {
    mhi_text_add(out, "<h2>Parameters</h2>\n<p>Grey: one standard deviation of what was expected; "
                      "blue: 95 %% of what was found; orange: the recordings say nothing about it. "
                      "Muscle numbers, gains and masses are factors, insertions and offsets are in "
                      "metres, delays in seconds.</p>\n"
                      "<table><tr><th>parameter</th><th>before</th><th>after</th><th>standard "
                      "deviation</th><th></th><th></th></tr>\n");
    for (int32_t i = 0; i < r->c->n; i++) {
        const mhi_estimated *e = &r->c->list[i];
        mhi_text_add(out, "<tr><td>");
        add_escaped(out, e->name);
        mhi_text_add(out, "</td><td class=n>%.4g</td><td class=n>%.4g</td><td class=n>", e->mean,
                     e->value);
        if (!isnan(e->sd)) {
            mhi_text_add(out, "%.2g", e->sd);
        }
        mhi_text_add(out, "</td>");
        band(out, e);
        mhi_text_add(out, "<td class='%s'>%s</td></tr>\n", e->informed ? "" : "warn",
                     report_verdict(e));
    }
    mhi_text_add(out, "</table>\n");
}

#define FEW 8 /* findings that stand open */

static void findings_html(const report_content *r, mhi_text *out) {
    int32_t lines = 0;
    for (const char *c = r->findings.data; c != NULL && *c != '\0'; c++) {
        lines += *c == '\n';
    }
    if (r->findings.length == 0) {
        return;
    }
    mhi_text_add(out, "<h2>Findings</h2>\n");
    if (lines > FEW) { /* the parameters' table shows most of them */
        mhi_text_add(out, "<details><summary>%d findings</summary>\n", (int)lines);
    }
    mhi_text_add(out, "<ul>\n");
    for (const char *line = r->findings.data; *line != '\0';) {
        size_t n = 0;
        while (line[n] != '\n' && line[n] != '\0') {
            n++;
        }
        mhi_text_add(out, "<li>");
        add_escaped_part(out, line, n);
        mhi_text_add(out, "</li>\n");
        line += n + (line[n] == '\n');
    }
    mhi_text_add(out, lines > FEW ? "</ul>\n</details>\n" : "</ul>\n");
}

void report_html(const report_content *r, mhi_text *out) {
    const mhi_calibration *c = r->c;
    int32_t n_informed = 0;
    for (int32_t i = 0; i < c->n; i++) {
        n_informed += c->list[i].informed;
    }
    mhi_text_add(
        out, "<!doctype html>\n<html lang=en><meta charset=utf-8><title>Calibration</title>\n"
             "<style>body{font:15px/1.5 system-ui,sans-serif;max-width:1000px;margin:2em "
             "auto;padding:0 1em;color:#0f172a}table{border-collapse:collapse}td,th{padding:2px "
             "10px;border-bottom:1px solid #e2e8f0;text-align:left}td.n{text-align:right;"
             "font-variant-numeric:tabular-nums}.warn{color:#b45309}h1{margin-bottom:0}"
             "</style>\n<h1>Calibration</h1>\n<p>");
    add_escaped(out, c->run->name);
    mhi_text_add(
        out,
        ": %d parameters from %d nodes; %s after %d iterations, %.1f s of the processor. %d of the "
        "parameters are informed by the recordings.</p>\n",
        (int)c->n, (int)c->n_intervals + 1, report_outcome(c), (int)c->info.iterations, c->seconds,
        (int)n_informed);
    recordings_html(r, out);
    findings_html(r, out);
    parameters_html(r, out);
    mhi_text_add(out, "</html>\n");
}

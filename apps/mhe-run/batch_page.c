/* SPDX-License-Identifier: Apache-2.0 */
/* batch_page.c: a session as one table and one page, from what each trial left in its folder. */
#include "batch.h"

#include "base/text.h"
#include "escape.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <mhe/outbox.h>
#include <stdlib.h>
#include <string.h>

/* A number of summary.json: "verdict.usable" by its path. */
typedef struct column {
    const char *title, *path, *unit;
} column;

static const column columns[] = {
    {"estimates", "solves", "1"},         {"converged", "converged", "1"},
    {"solve_ms", "solve_ms.p50", "ms"},   {"marker_rms_mm", "channels.markers.rms", "mm"},
    {"emg_rms", "channels.emg.rms", "1"}, {"rmse_q_deg", "rmse.q_deg", "deg"},
    {"rmse_force_n", "rmse.force_n", "N"}};
#define N_COLUMNS ((int32_t)(sizeof columns / sizeof columns[0]))

typedef struct summary_row {
    batch_end end;
    int32_t ended; /* 0: not yet */
    cJSON *json;   /* NULL: no results */
} summary_row;

static const cJSON *at_path(const cJSON *json, const char *path) {
    char part[64];
    while (json != NULL && *path != '\0') {
        const size_t n = strcspn(path, ".");
        (void)snprintf(part, sizeof part, "%.*s", (int)n, path);
        json = cJSON_GetObjectItemCaseSensitive(json, part);
        path += n + (path[n] == '.');
    }
    return json;
}

static const char *text_at(const cJSON *json, const char *path) {
    const cJSON *item = at_path(json, path);
    return cJSON_IsString(item) ? item->valuestring : "";
}

/* The first of the findings that weigh most, or what the run said last. */
static const char *reason_of(const summary_row *row) {
    const cJSON *finding = cJSON_GetArrayItem(at_path(row->json, "verdict.findings"), 0);
    return !row->ended            ? "not run yet"
           : row->end.status != 0 ? row->end.message
           : finding != NULL      ? text_at(finding, "text")
                                  : "";
}

static const char *usable_of(const summary_row *row) {
    return !row->ended            ? "missing"
           : row->json == NULL    ? "failed"
           : row->end.status != 0 ? "failed"
                                  : text_at(row->json, "verdict.usable");
}

static void add_number(const summary_row *row, int32_t i, mhi_text *out) {
    const cJSON *item = at_path(row->json, columns[i].path);
    if (cJSON_IsNumber(item)) {
        const double scale = strcmp(columns[i].title, "marker_rms_mm") == 0 ? 1e3 : 1;
        mhi_text_add(out, "%.6g", scale * item->valuedouble);
    }
}

static void read_row(const batch *b, const batch_trial *t, summary_row *row) {
    char path[4200];
    row->ended = batch_end_read(b, t, &row->end) && row->end.digest == t->digest;
    (void)snprintf(path, sizeof path, "%s/%s/summary.json", b->dir, t->name);
    FILE *file = row->ended && row->end.status == 0 ? fopen(path, "r") : NULL;
    mhi_text text = {0};
    char part[4096];
    while (file != NULL && fgets(part, sizeof part, file) != NULL) {
        mhi_text_add(&text, "%s", part);
    }
    if (file != NULL) {
        (void)fclose(file);
    }
    row->json = text.data == NULL || text.failed ? NULL : cJSON_Parse(text.data);
    mhi_text_free(&text);
}

/* ---- batch.csv ---- */

static void add_cell(mhi_text *out, const char *text) {
    mhi_text_add(out, "\"");
    for (const char *c = text; *c != '\0'; c++) {
        mhi_text_add(out, *c == '"' ? "\"\"" : "%c", *c);
    }
    mhi_text_add(out, "\"");
}

static void compose_table(const batch *b, const summary_row *rows, mhi_text *out) {
    mhi_text_add(out, "trial,usable,exit_status");
    for (int32_t k = 0; k < N_COLUMNS; k++) {
        mhi_text_add(out, ",%s", columns[k].title);
    }
    mhi_text_add(out, ",reason\n");
    for (int32_t i = 0; i < b->n; i++) {
        add_cell(out, b->trials[i].name);
        mhi_text_add(out, ",%s,", usable_of(&rows[i]));
        if (rows[i].ended) {
            mhi_text_add(out, "%d", (int)rows[i].end.status);
        }
        for (int32_t k = 0; k < N_COLUMNS; k++) {
            mhi_text_add(out, ",");
            add_number(&rows[i], k, out);
        }
        mhi_text_add(out, ",");
        add_cell(out, reason_of(&rows[i]));
        mhi_text_add(out, "\n");
    }
}

/* ---- batch.html ---- */

static const char head[] =
    "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" "
    "content=\"width=device-width\">\n<style>body{font:15px/1.4 sans-serif;margin:1.5em auto;"
    "max-width:75em;padding:0 1em}div{overflow-x:auto}table{border-collapse:collapse}th,td{"
    "padding:.25em .7em;border-bottom:1px solid #ccc;text-align:right;white-space:nowrap}th:first-"
    "child,td:first-child,th:last-child,td:last-child{text-align:left}td:last-child{white-space:"
    "normal;min-width:18em}.yes{color:#176117}.doubtful{color:#8a5a00}.no,.failed{color:#a01515}."
    "missing{color:#666}</style>\n";

static int32_t count_of(const batch *b, const summary_row *rows, const char *usable) {
    int32_t n = 0;
    for (int32_t i = 0; i < b->n; i++) {
        n += strcmp(usable_of(&rows[i]), usable) == 0;
    }
    return n;
}

static void add_row(const batch_trial *t, const summary_row *row, mhi_text *out) {
    const char *usable = usable_of(row);
    mhi_text_add(out, "<tr><td>");
    if (row->json != NULL) {
        mhi_text_add(out, "<a href=\"");
        add_escaped_path(out, t->name);
        mhi_text_add(out, "/report.html\">");
    }
    add_escaped(out, t->name);
    mhi_text_add(out, "%s</td><td class=\"%s\">%s</td>", row->json != NULL ? "</a>" : "", usable,
                 usable);
    for (int32_t k = 0; k < N_COLUMNS; k++) {
        mhi_text_add(out, "<td>");
        add_number(row, k, out);
        mhi_text_add(out, "</td>");
    }
    mhi_text_add(out, "<td>");
    add_escaped(out, reason_of(row));
    mhi_text_add(out, "</td></tr>\n");
}

static void compose_page(const batch *b, const summary_row *rows, mhi_text *out) {
    static const char *const kinds[] = {"yes", "doubtful", "no", "failed", "missing"};
    mhi_text_add(out, "%s<title>", head);
    add_escaped(out, b->list);
    mhi_text_add(out, "</title>\n<h1>");
    add_escaped(out, b->list);
    mhi_text_add(out, "</h1>\n<p>%d trials. Usable:", (int)b->n);
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        const int32_t n = count_of(b, rows, kinds[i]);
        if (n > 0) {
            mhi_text_add(out, " <b class=\"%s\">%s %d</b>", kinds[i], kinds[i], (int)n);
        }
    }
    mhi_text_add(out, ".</p>\n<div><table>\n<tr><th>trial</th><th>usable</th>");
    for (int32_t k = 0; k < N_COLUMNS; k++) {
        mhi_text_add(out, "<th>%s</th>", columns[k].title);
    }
    mhi_text_add(out, "<th>why</th></tr>\n");
    for (int32_t i = 0; i < b->n; i++) {
        add_row(&b->trials[i], &rows[i], out);
    }
    mhi_text_add(out, "</table></div>\n<p>The same numbers: <a href=\"batch.csv\">batch.csv</a>. "
                      "Errors (rmse) only where the truth is known.</p>\n</html>\n");
}

static mhe_status write_both(const batch *b, const summary_row *rows, mhe_error *err) {
    mhi_text table = {0}, page = {0};
    mhe_outbox *outbox = NULL;
    compose_table(b, rows, &table);
    compose_page(b, rows, &page);
    mhe_status status = table.failed || page.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                                    : mhe_outbox_open(b->dir, &outbox, err);
    status = status == MHE_OK ? mhe_outbox_text(outbox, "batch.csv", table.data, err) : status;
    status = status == MHE_OK ? mhe_outbox_text(outbox, "batch.html", page.data, err) : status;
    status = status == MHE_OK ? mhe_outbox_commit(outbox, err) : status;
    mhe_outbox_close(outbox);
    mhi_text_free(&table);
    mhi_text_free(&page);
    return status;
}

mhe_status batch_write(const batch *b, int32_t *n_failed, mhe_error *err) {
    summary_row *rows = calloc((size_t)b->n, sizeof *rows);
    *n_failed = 0;
    if (rows == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < b->n; i++) {
        read_row(b, &b->trials[i], &rows[i]);
        *n_failed += strcmp(usable_of(&rows[i]), "failed") == 0;
    }
    mhe_status status = write_both(b, rows, err);
    if (status == MHE_OK) {
        (void)printf("%d trials: %d usable, %d doubtful, %d not usable, %d failed, %d missing\n",
                     (int)b->n, (int)count_of(b, rows, "yes"), (int)count_of(b, rows, "doubtful"),
                     (int)count_of(b, rows, "no"), (int)*n_failed,
                     (int)count_of(b, rows, "missing"));
        (void)printf("results in %s; open %s/batch.html\n", b->dir, b->dir);
    }
    for (int32_t i = 0; i < b->n; i++) {
        cJSON_Delete(rows[i].json);
    }
    free(rows);
    return status;
}

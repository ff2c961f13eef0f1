/* SPDX-License-Identifier: Apache-2.0 */
#include "view.h"

#include "escape.h"
#include "page.h"
#include "view_panels.h"

#include <cJSON.h>
#include <stdlib.h>
#include <string.h>

/* ---- the folder ---- */

static mhe_status read_markers(const char *dir, rows *r) {
    char path[4096];
    *r = (rows){.is = {.size = sizeof r->is}};
    const int n = snprintf(path, sizeof path, "%s/markers.trc", dir);
    const mhe_status status = n < 0 || (size_t)n >= sizeof path
                                  ? MHE_E_ARGUMENT
                                  : mhe_table_read_markers(path, &r->table, NULL);
    return status == MHE_OK ? mhe_table_describe(r->table, &r->is, NULL) : status;
}

/* Without muscles or markers a table has no columns and cannot be read: it is left out. */
static mhe_status read_folder(const view_setup *s, view_tables *t, mhe_error *err) {
    mhe_error why = {0};
    *t = (view_tables){.q_prefix = "q_", .a_prefix = "a_"};
    mhe_status status = rows_read_in(s->dir, "estimates.sto", &t->table[VIEW_Q], err);
    if (status == MHE_OK) {
        (void)rows_read_in(s->dir, "estimates.sto", &t->table[VIEW_ACTIVATION], NULL);
        (void)rows_read_in(s->dir, "forces.sto", &t->table[VIEW_FORCE], NULL);
        (void)rows_read_in(s->dir, "marker_residuals.sto", &t->table[VIEW_DISTANCE], NULL);
        (void)rows_read_in(s->dir, "emg.sto", &t->table[VIEW_EMG], NULL);
        (void)rows_read_in(s->dir, "quality.sto", &t->table[VIEW_QUALITY], NULL);
        (void)rows_read_in(s->dir, "uncertainty.sto", &t->table[VIEW_SD], NULL);
        (void)read_markers(s->dir, &t->table[VIEW_MARKERS]);
    } else if (rows_read_in(s->dir, "live_q.sto", &t->table[VIEW_Q], &why) == MHE_OK) {
        status = MHE_OK; /* what mhe.sink.files wrote */
        t->q_prefix = t->a_prefix = "";
        (void)rows_read_in(s->dir, "live_activation.sto", &t->table[VIEW_ACTIVATION], NULL);
        (void)rows_read_in(s->dir, "live_force.sto", &t->table[VIEW_FORCE], NULL);
        (void)rows_read_in(s->dir, "live_emg.sto", &t->table[VIEW_EMG], NULL);
    }
    if (status == MHE_OK && t->table[VIEW_Q].is.n_rows < 1) {
        status = mhe_fail(err, MHE_E_INPUT, "%s: there are no estimates in it", s->dir);
    }
    if (status == MHE_OK && s->reference != NULL) {
        (void)rows_read(s->reference, &t->table[VIEW_TRUTH], NULL);
    }
    return status;
}

/* ---- what came of it ---- */

static char *file_text(const char *dir, const char *name) {
    char path[4096];
    const int length = snprintf(path, sizeof path, "%s/%s", dir, name);
    FILE *file = length > 0 && (size_t)length < sizeof path ? fopen(path, "rb") : NULL;
    char *text = file == NULL ? NULL : malloc(1 << 20);
    if (text != NULL) {
        text[fread(text, 1, (1 << 20) - 1, file)] = '\0';
    }
    if (file != NULL) {
        (void)fclose(file);
    }
    return text;
}

static void add_value(mhi_text *out, const char *name, const cJSON *value, const char *unit) {
    if (cJSON_IsNumber(value)) {
        mhi_text_add(out, "%s: %.4g%s\n", name, value->valuedouble, unit);
    }
}

/* The verdict and the first figures of summary.json; nothing where there is none. */
static void add_summary(mhi_text *out, const char *dir) {
    char *text = file_text(dir, "summary.json");
    cJSON *root = text == NULL ? NULL : cJSON_Parse(text);
    const cJSON *verdict = cJSON_GetObjectItem(root, "verdict"), *finding;
    const cJSON *usable = cJSON_GetObjectItem(verdict, "usable");
    if (cJSON_IsString(usable)) {
        mhi_text_add(out, "usable: %s\n", usable->valuestring);
    }
    cJSON_ArrayForEach(finding, cJSON_GetObjectItem(verdict, "findings")) {
        const cJSON *what =
            cJSON_IsString(finding) ? finding : cJSON_GetObjectItem(finding, "text");
        if (cJSON_IsString(what)) {
            mhi_text_add(out, "- %s\n", what->valuestring);
        }
    }
    const cJSON *rmse = cJSON_GetObjectItem(root, "rmse");
    add_value(out, "estimates", cJSON_GetObjectItem(root, "solves"), "");
    add_value(out, "converged", cJSON_GetObjectItem(root, "converged"), " of 1");
    add_value(out, "error of joint angles (RMSE)", cJSON_GetObjectItem(rmse, "q_deg"), " deg");
    add_value(out, "error of muscle forces (RMSE)", cJSON_GetObjectItem(rmse, "force_n"), " N");
    cJSON_Delete(root);
    free(text);
}

/* ---- the page ---- */

static const char *folder_name(const char *dir) {
    const char *last = strrchr(dir, '/');
    return last == NULL || last[1] == '\0' ? dir : last + 1;
}

static mhe_status add_results(const view_setup *s, const view_tables *t, mhe_figure *figure,
                              mhi_text *out, mhe_error *err) {
    mhi_text summary = {0};
    mhi_text_add(out, "{\"title\":");
    add_escaped_json(out, s->title == NULL ? folder_name(s->dir) : s->title);
    mhi_text_add(out, ",\"summary\":");
    if (s->summary == NULL) {
        add_summary(&summary, s->dir);
    }
    add_escaped_json(out, s->summary != NULL     ? s->summary
                          : summary.data != NULL ? summary.data
                                                 : "");
    mhi_text_free(&summary);
    mhi_text_add(out, ",");
    view_add_panels(out, t);
    mhi_text_add(out, ",");
    const mhe_status status = view_add_moments(out, t, figure, err);
    mhi_text_add(out, "}");
    return status;
}

mhe_status view_compose(const view_setup *s, mhi_text *out, mhe_error *err) {
    const char *mark = strstr(mhe_page, MHE_PAGE_RECORDED);
    const char *null = mark == NULL ? NULL : strstr(mark, "null");
    view_tables tables;
    mhe_figure *figure = NULL;
    mhe_status status = read_folder(s, &tables, err);
    if (status == MHE_OK && s->config != NULL) {
        (void)mhe_figure_open(s->config, &figure, NULL); /* else there is none on the page */
    }
    if (status == MHE_OK && null == NULL) {
        status = mhe_fail(err, MHE_E_UNSUPPORTED, "the page has no place for results");
    }
    if (status == MHE_OK) {
        mhi_text_add(out, "%.*s", (int)(null - mhe_page), mhe_page);
        status = add_results(s, &tables, figure, out, err);
        mhi_text_add(out, "%s", null + strlen("null"));
    }
    if (status == MHE_OK && out->failed) {
        status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_figure_close(figure);
    for (int32_t i = 0; i < VIEW_TABLES; i++) {
        rows_close(&tables.table[i]);
    }
    return status;
}

/* SPDX-License-Identifier: Apache-2.0 */
/* view_moments.c: the run as frames: posture, muscles, markers at a moment. */
#include "escape.h"
#include "view_panels.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOMENTS 300 /* at most */
#define NUMBERS 4e5 /* of all moments together: a page of some two megabytes */
#define SIGNALS 7

/* A signal of a frame: columns of a table, or of the figure. */
typedef struct signal {
    const char *name, *unit, *prefix;
    const rows *table;         /* NULL: of the figure */
    int32_t n;                 /* numbers */
    const char *const *labels; /* [n], or of markers [n / 3]; with the prefix */
} signal;

static const rows *with_rows(const view_tables *t, int32_t i, int32_t n_rows) {
    const rows *r = &t->table[i];
    return r->table != NULL && r->is.n_rows == n_rows ? r : NULL;
}

/* Columns of the table that begin with the prefix; they follow each other in our tables. */
static int32_t count(const rows *r, const char *prefix, int32_t *first) {
    int32_t n = 0;
    for (int32_t i = 0; r != NULL && i < r->is.n_labels; i++) {
        if (strncmp(r->is.labels[i], prefix, strlen(prefix)) == 0) {
            *first = n == 0 ? i : *first;
            n++;
        }
    }
    return n;
}

static void add_labels(mhi_text *out, const signal *s) {
    const int32_t per_label = strcmp(s->name, "markers") == 0 ? 3 : 1;
    mhi_text_add(out, "{\"name\":\"%s\",\"unit\":\"%s\",\"labels\":[", s->name, s->unit);
    for (int32_t i = 0; i < s->n; i++) {
        const char *label = s->labels[i / per_label] + strlen(s->prefix);
        mhi_text_add(out, "%s", i > 0 ? "," : "");
        if (per_label == 3) {
            char axis[300];
            (void)snprintf(axis, sizeof axis, "%.290s.%c", label, "xyz"[i % 3]);
            add_escaped_json(out, axis);
        } else {
            add_escaped_json(out, label);
        }
    }
    mhi_text_add(out, "]}");
}

/* Column of each of the figure's coordinates; 0: one is missing, and there is no posture. */
static int find_posture(const mhe_figure_info *f, const signal *q, int32_t *column) {
    for (int32_t i = 0; i < f->n_coordinates; i++) {
        column[i] = -1;
        for (int32_t k = 0; k < q->n; k++) {
            if (strcmp(q->labels[k] + strlen(q->prefix), f->coordinates[i]) == 0) {
                column[i] = k;
            }
        }
        if (column[i] < 0) {
            return 0;
        }
    }
    return 1;
}

typedef struct moments {
    signal signals[SIGNALS];
    int32_t first[SIGNALS]; /* column of the first number in its table */
    int32_t n_values, n, step;
    mhe_figure *figure;
    mhe_figure_info info;
    int32_t *column; /* [n_coordinates] of the posture */
    double *q, *bones, *paths;
    float *values; /* [n x n_values] */
} moments;

static void lay_signals(moments *m, const view_tables *t) {
    const rows *q = &t->table[VIEW_Q];
    const int32_t n_rows = q->is.n_rows;
    const signal all[SIGNALS] = {
        {"q", "rad (m)", t->q_prefix, q, 0, NULL},
        {"activation", "1", t->a_prefix, with_rows(t, VIEW_ACTIVATION, n_rows), 0, NULL},
        {"force", "N", "", with_rows(t, VIEW_FORCE, n_rows), 0, NULL},
        {"emg", "1", "", with_rows(t, VIEW_EMG, n_rows), 0, NULL},
        {"markers", "m", "", with_rows(t, VIEW_MARKERS, n_rows), 0, NULL},
        {"skeleton", "m", "", NULL, m->info.n_bones, m->info.bones},
        {"paths", "m", "", NULL, m->info.n_paths, m->info.paths}};
    memcpy(m->signals, all, sizeof all);
    for (int32_t i = 0; i < SIGNALS; i++) {
        signal *s = &m->signals[i];
        if (s->table != NULL) {
            const int32_t n = count(s->table, s->prefix, &m->first[i]);
            const int32_t per_label = i == 4 ? 3 : 1;
            s->n = per_label * n;
            s->labels = s->table->is.labels + m->first[i];
        }
        m->n_values += s->n;
    }
    const double most = fmin(MOMENTS, fmax(2, NUMBERS / (m->n_values + 1)));
    m->step = (int32_t)ceil(n_rows / most);
    m->n = (n_rows + m->step - 1) / m->step;
}

static void draw(moments *m, int32_t row, float *at) {
    const signal *s = m->signals;
    mhe_error err = {0};
    for (int32_t i = 0; i < m->info.n_coordinates; i++) {
        m->q[i] = s->table->is
                      .values[(ptrdiff_t)row * s->table->is.n_columns + m->first[0] + m->column[i]];
    }
    if (mhe_figure_draw(m->figure, m->q, m->bones, m->paths, &err) == MHE_OK) {
        for (int32_t i = 0; i < m->info.n_bones; i++) {
            at[i] = (float)m->bones[i];
        }
        for (int32_t i = 0; i < m->info.n_paths; i++) {
            at[m->info.n_bones + i] = (float)m->paths[i];
        }
    }
}

static void fill(moments *m) {
    for (int32_t k = 0; k < m->n; k++) {
        const int32_t row = k * m->step;
        float *at = m->values + (ptrdiff_t)k * m->n_values;
        for (int32_t i = 0; i < SIGNALS; i++) {
            const signal *s = &m->signals[i];
            for (int32_t c = 0; c < s->n && s->table != NULL; c++) {
                const ptrdiff_t place =
                    (ptrdiff_t)row * s->table->is.n_columns + m->first[i] * (i == 4 ? 3 : 1) + c;
                at[c] = (float)s->table->is.values[place];
            }
            if (i == 5 && m->figure != NULL) {
                draw(m, row, at);
            }
            at += s->n;
        }
    }
}

static void write(mhi_text *out, const moments *m, const view_tables *t) {
    const rows *q = &t->table[VIEW_Q], *quality = with_rows(t, VIEW_QUALITY, q->is.n_rows);
    const int32_t status = quality == NULL ? -1 : mhe_table_find(quality->table, "status");
    mhi_text_add(out, "\"up\":%d,\"time\":[", m->figure == NULL ? 1 : (int)m->info.up);
    for (int32_t k = 0; k < m->n; k++) {
        mhi_text_add(out, "%s%.9g", k > 0 ? "," : "", q->is.time[k * m->step]);
    }
    mhi_text_add(out, "],\"status\":[");
    for (int32_t k = 0; k < m->n; k++) {
        const ptrdiff_t row = (ptrdiff_t)k * m->step;
        const double is = status < 0 ? 0 : quality->is.values[row * quality->is.n_columns + status];
        mhi_text_add(out, "%s%d", k > 0 ? "," : "", is >= 0 && is < 8 ? (int)is : 0);
    }
    mhi_text_add(out, "],\"signals\":[");
    for (int32_t i = 0; i < SIGNALS; i++) {
        mhi_text_add(out, "%s", i > 0 ? "," : "");
        add_labels(out, &m->signals[i]);
    }
    mhi_text_add(out, "],\"values\":");
    view_numbers(out, m->values, (size_t)m->n * (size_t)m->n_values);
}

mhe_status view_add_moments(mhi_text *out, const view_tables *t, mhe_figure *figure,
                            mhe_error *err) {
    moments m = {.info = {.size = sizeof m.info}, .figure = figure};
    if (figure != NULL && mhe_figure_describe(figure, &m.info, err) != MHE_OK) {
        return MHE_E_ARGUMENT;
    }
    m.column = calloc((size_t)m.info.n_coordinates + 1, sizeof *m.column);
    m.q = calloc((size_t)m.info.n_coordinates + 1, sizeof *m.q);
    m.bones = calloc((size_t)m.info.n_bones + 1, sizeof *m.bones);
    m.paths = calloc((size_t)m.info.n_paths + 1, sizeof *m.paths);
    lay_signals(&m, t);
    if (m.column != NULL && figure != NULL && !find_posture(&m.info, m.signals, m.column)) {
        m.figure = NULL; /* the numbers of its signals stay 0: nothing is drawn of them */
        m.n_values -= m.signals[5].n + m.signals[6].n;
        m.signals[5].n = m.signals[6].n = 0;
    }
    m.values = calloc((size_t)m.n * (size_t)m.n_values + 1, sizeof *m.values);
    const int whole =
        m.column != NULL && m.q != NULL && m.bones != NULL && m.paths != NULL && m.values != NULL;
    if (whole) {
        fill(&m);
        write(out, &m, t);
    }
    free(m.column);
    free(m.q);
    free(m.bones);
    free(m.paths);
    free(m.values);
    return whole ? MHE_OK : mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

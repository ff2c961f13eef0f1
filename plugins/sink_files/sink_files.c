/* SPDX-License-Identifier: Apache-2.0 */
/* sink_files.c: estimates as tables (.sto), row by row as they come. A file is a whole table at any
 * moment but for its number of rows, which is written when it is closed. */
#include <mhe/sink.h>

#include <errno.h>
#include <fcntl.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define MOST_FILES 16
#define ROWS_WIDTH 10 /* digits kept free for the number of rows */

struct files_config { /* filled by the core from the option table */
    mhe_text_list signals;
    int32_t digits;
};

typedef struct table {
    FILE *file;
    int32_t signal, n;
    long rows_at; /* where the number of rows stands */
} table;

typedef struct files {
    struct files_config config;
    int32_t n_tables;
    table tables[MOST_FILES];
    int64_t n_rows;
    locale_t plain;
} files;

static void files_destroy(void *self) {
    files *s = self;
    for (int32_t i = 0; i < s->n_tables; i++) {
        if (s->tables[i].file != NULL) {
            (void)fclose(s->tables[i].file);
        }
    }
    if (s->plain != (locale_t)0) {
        freelocale(s->plain);
    }
    free(s);
}

static mhe_status files_create(const mhe_host *host, const void *config, void **self,
                               mhe_error *err) {
    (void)host;
    files *s = calloc(1, sizeof *s);
    if (s == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    s->config = *(const struct files_config *)config;
    s->plain = newlocale(LC_NUMERIC_MASK, "C", (locale_t)0);
    *self = s;
    return MHE_OK;
}

static const mhe_sink_signal *signal_at(const mhe_sink_run *run, int32_t i) {
    return (const mhe_sink_signal *)(const void *)((const char *)run->signals +
                                                   (size_t)i * run->signal_size);
}

/* A file of an earlier run is replaced, a link is not followed. */
static mhe_status begin_table(files *s, const mhe_sink_run *run, int32_t signal, mhe_error *err) {
    char path[1200];
    const mhe_sink_signal *about = signal_at(run, signal);
    (void)snprintf(path, sizeof path, "%.1000s/live_%s.sto",
                   run->folder == NULL ? "." : run->folder, about->name);
    const int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0666);
    FILE *file = fd < 0 ? NULL : fdopen(fd, "w");
    if (file == NULL) {
        return mhe_fail(err, MHE_E_IO, "%s: cannot be written: %s", path, strerror(errno));
    }
    table *t = &s->tables[s->n_tables++];
    *t = (table){file, signal, about->n, 0};
    (void)fprintf(file, "%s\nversion=1\nnRows=", about->name);
    t->rows_at = ftell(file);
    (void)fprintf(file, "%-*d\nnColumns=%d\ninDegrees=no\nendheader\ntime", ROWS_WIDTH, 0,
                  (int)about->n + 1);
    for (int32_t i = 0; i < about->n; i++) {
        (void)fprintf(file, "\t%s", about->labels[i]);
    }
    (void)fputc('\n', file);
    return MHE_OK;
}

static mhe_status files_open(void *self, const mhe_sink_run *run, const mhe_sink_control *control,
                             mhe_error *err) {
    static const char *const usual[] = {"q", "activation", "force"};
    files *s = self;
    (void)control;
    if (s->config.signals.n == 0) {
        s->config.signals = (mhe_text_list){usual, 3};
    }
    mhe_status status = MHE_OK;
    for (int32_t k = 0; k < s->config.signals.n && status == MHE_OK; k++) {
        const char *name = s->config.signals.values[k];
        int32_t i = 0;
        while (i < run->n_signals && strcmp(signal_at(run, i)->name, name) != 0) {
            i++;
        }
        if (i == run->n_signals || s->n_tables == MOST_FILES) {
            return mhe_fail(err, MHE_E_CONFIG, "signals: a run has no '%s'", name);
        }
        status = signal_at(run, i)->n > 0 ? begin_table(s, run, i, err) : MHE_OK;
    }
    return status;
}

static mhe_status files_take(void *self, const mhe_sink_sample *sample, mhe_error *err) {
    files *s = self;
    const int digits = s->config.digits;
    const locale_t before = s->plain == (locale_t)0 ? (locale_t)0 : uselocale(s->plain);
    int bad = 0;
    s->n_rows++;
    for (int32_t k = 0; k < s->n_tables; k++) {
        const table *t = &s->tables[k];
        const double *values = sample->values[t->signal];
        (void)fprintf(t->file, "%.*g", digits, sample->time);
        for (int32_t i = 0; i < t->n; i++) {
            if (isnan(values[i])) {
                (void)fputs("\tNaN", t->file);
            } else {
                (void)fprintf(t->file, "\t%.*g", digits, values[i]);
            }
        }
        bad |= fputc('\n', t->file) == EOF;
    }
    if (before != (locale_t)0) {
        (void)uselocale(before);
    }
    return bad ? mhe_fail(err, MHE_E_IO, "a file cannot be written: %s", strerror(errno)) : MHE_OK;
}

static mhe_status files_close(void *self, mhe_error *err) {
    files *s = self;
    mhe_status status = MHE_OK;
    for (int32_t k = 0; k < s->n_tables; k++) {
        table *t = &s->tables[k];
        if (fseek(t->file, t->rows_at, SEEK_SET) != 0 ||
            fprintf(t->file, "%-*lld", ROWS_WIDTH, (long long)s->n_rows) < 0 ||
            fclose(t->file) != 0) {
            status = mhe_fail(err, MHE_E_IO, "a file cannot be written: %s", strerror(errno));
        }
        t->file = NULL;
    }
    s->n_tables = 0;
    return status;
}

static const mhe_sink_ops files_ops = {.size = sizeof files_ops,
                                       .create = files_create,
                                       .destroy = files_destroy,
                                       .open = files_open,
                                       .take = files_take,
                                       .close = files_close};

static const mhe_option files_options[] = {
    MHE_OPT_TEXTS(struct files_config, signals, 0,
                  "A file live_NAME.sto for each; without: q, activation, force."),
    MHE_OPT_INT(struct files_config, digits, 9, 3, 17, "1",
                "Significant digits; with 17 nothing is lost."),
};

static const mhe_plugin files_plugin = {.size = sizeof files_plugin,
                                        .id = "mhe.sink.files",
                                        .version = "0.2.0",
                                        .summary = "Estimates as .sto tables, as they come.",
                                        .iface = MHE_SINK_IFACE,
                                        .ops = &files_ops,
                                        MHE_PLUGIN_OPTIONS(struct files_config, files_options)};

MHE_PLUGIN_LIBRARY(&files_plugin)

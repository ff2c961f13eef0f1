/* SPDX-License-Identifier: Apache-2.0 */
#include "rows.h"

#include "base/digest.h"
#include "io/slurp.h"
#include "measure.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define DIGITS 16
#define SUFFIX ".rows"

/* ---- reading ---- */

static mhe_status no_memory(mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

typedef struct shard_file {
    const char *path;
    char *text; /* NUL-terminated */
    size_t length;
} shard_file;

/* 1 where the line [length, without its end] fits its digest. */
static int32_t is_whole(const char *line, size_t length) {
    char digest[DIGITS + 1];
    if (length < DIGITS + 2 || line[DIGITS] != '\t') {
        return 0;
    }
    (void)snprintf(digest, sizeof digest, "%016" PRIx64,
                   mhi_digest(line + DIGITS + 1, length - DIGITS - 1));
    return memcmp(line, digest, DIGITS) == 0;
}

/* The text up to the next tab, which becomes its end. */
static char *next_field(char **rest) {
    char *field = *rest, *tab = field == NULL ? NULL : strchr(field, '\t');
    *rest = tab == NULL ? NULL : tab + 1;
    if (tab != NULL) {
        *tab = '\0';
    }
    return field;
}

static int32_t number_of(const char *text) {
    return text == NULL ? -1 : (int32_t)strtol(text, NULL, 10);
}

static mhe_status add_row(rows *r, row added, mhe_error *err) {
    if (r->n == r->capacity) {
        const int32_t capacity = r->capacity == 0 ? 256 : 2 * r->capacity;
        row *grown = realloc(r->list, sizeof *grown * (size_t)capacity);
        if (grown == NULL) {
            return no_memory(err);
        }
        r->list = grown;
        r->capacity = capacity;
    }
    r->list[r->n++] = added;
    return MHE_OK;
}

static mhe_status take_line(const study *s, rows *r, const char *path, int32_t number,
                            const char *line, size_t length, mhe_error *err) {
    char *rest = mhi_arena_text_n(&r->arena, line + DIGITS + 1, length - DIGITS - 1);
    if (rest == NULL) {
        return no_memory(err);
    }
    row added = {.file = path, .line = number};
    added.task.condition = number_of(next_field(&rest));
    added.task.trial = number_of(next_field(&rest));
    added.cells = next_field(&rest);
    added.timing = next_field(&rest);
    added.reason = next_field(&rest);
    const task t = added.task;
    if (added.reason == NULL || t.condition < 0 || t.condition >= s->n_conditions || t.trial < 0 ||
        t.trial >= s->conditions[t.condition].trials) {
        return mhe_fail(err, MHE_E_INPUT, "%s:%d: this is no trial of the study", path, number);
    }
    return add_row(r, added, err);
}

/* All lines of a file; *end: behind its last whole one. */
static mhe_status take_lines(const study *s, rows *r, const shard_file *file, size_t *end,
                             mhe_error *err) {
    const char *stop = file->text + file->length;
    int32_t number = 1;
    mhe_status status = MHE_OK;
    *end = 0;
    for (const char *line = file->text; line < stop && status == MHE_OK; number++) {
        const char *newline = memchr(line, '\n', (size_t)(stop - line));
        const size_t length = (size_t)((newline == NULL ? stop : newline) - line);
        if (newline != NULL && is_whole(line, length)) {
            status = take_line(s, r, file->path, number, line, length, err);
            *end = (size_t)(newline + 1 - file->text);
        } else if (newline != NULL && memchr(line, '\0', length) == NULL) {
            status = mhe_fail(err, MHE_E_INPUT,
                              "%s:%d: damaged: the line does not fit its checksum; remove it, and "
                              "the trial is run again",
                              file->path, number);
        }
        line += length + 1;
    }
    return status;
}

static mhe_status cut(const shard_file *file, size_t end, mhe_error *err) {
    if (end == file->length) {
        return MHE_OK;
    }
    const int fd = open(file->path, O_WRONLY | O_CLOEXEC);
    const int failed = fd < 0 || ftruncate(fd, (off_t)end) != 0 || fsync(fd) != 0;
    const int reason = errno;
    if (fd >= 0) {
        (void)close(fd);
    }
    return failed ? mhe_fail(err, MHE_E_IO, "%s: %s", file->path, strerror(reason)) : MHE_OK;
}

static mhe_status read_file(const study *s, rows *r, const char *path, int32_t own,
                            mhe_error *err) {
    shard_file file = {.path = path};
    size_t end = 0;
    mhe_status status = mhi_slurp(path, &file.text, &file.length, err);
    if (status == MHE_OK) {
        status = take_lines(s, r, &file, &end, err);
    }
    if (status == MHE_OK && own) {
        status = cut(&file, end, err);
    }
    free(file.text);
    return status;
}

static int by_task(const void *a, const void *b) {
    const row *x = a, *y = b;
    if (x->task.condition != y->task.condition) {
        return x->task.condition < y->task.condition ? -1 : 1;
    }
    if (x->task.trial != y->task.trial) {
        return x->task.trial < y->task.trial ? -1 : 1;
    }
    const int order = strcmp(x->file, y->file);
    return order != 0 ? order : (x->line > y->line) - (x->line < y->line);
}

static void sort(rows *r) {
    int32_t n = 0;
    if (r->n > 1) {
        qsort(r->list, (size_t)r->n, sizeof *r->list, by_task);
    }
    for (int32_t i = 0; i < r->n; i++) {
        const row *before = n > 0 ? &r->list[n - 1] : NULL;
        const task t = r->list[i].task;
        if (before != NULL && before->task.condition == t.condition &&
            before->task.trial == t.trial) {
            r->n_differing += strcmp(before->cells, r->list[i].cells) != 0;
        } else {
            r->list[n++] = r->list[i];
        }
    }
    r->n = n;
}

static int ends_with(const char *text, const char *end) {
    const size_t n = strlen(text), m = strlen(end);
    return n > m && strcmp(text + n - m, end) == 0;
}

mhe_status rows_read(const study *s, const char *dir, const char *own, rows *r, mhe_error *err) {
    *r = (rows){0};
    const char *folder = mhi_arena_format(&r->arena, "%s/rows", dir);
    DIR *list = folder == NULL ? NULL : opendir(folder);
    mhe_status status = folder == NULL ? no_memory(err) : MHE_OK;
    if (list == NULL) {
        return status; /* nothing was run yet */
    }
    for (struct dirent *entry = readdir(list); entry != NULL && status == MHE_OK;
         entry = readdir(list)) {
        if (!ends_with(entry->d_name, SUFFIX)) {
            continue;
        }
        const char *path = mhi_arena_format(&r->arena, "%s/%s", folder, entry->d_name);
        const size_t n = own == NULL ? 0 : strlen(own);
        const int32_t is_own =
            own != NULL && strncmp(entry->d_name, own, n) == 0 && entry->d_name[n] == '-';
        status = path == NULL ? no_memory(err) : read_file(s, r, path, is_own, err);
    }
    (void)closedir(list);
    sort(r);
    return status;
}

void rows_free(rows *r) {
    free(r->list);
    mhi_arena_free(&r->arena);
    *r = (rows){0};
}

/* ---- writing ---- */

static mhe_status write_failed(const row_writer *w, mhe_error *err) {
    return mhe_fail(err, MHE_E_IO, "%s: cannot be written: %s", w->path, strerror(errno));
}

/* A worker that was killed may have left half a line, which the next one must not go on with. */
static int cut_half_line(int fd) {
    char end[1 << 16];
    struct stat info;
    if (fstat(fd, &info) != 0) {
        return -1;
    }
    const off_t from = info.st_size > (off_t)sizeof end ? info.st_size - (off_t)sizeof end : 0;
    const ssize_t n = pread(fd, end, sizeof end, from);
    ssize_t whole = n;
    while (whole > 0 && end[whole - 1] != '\n') {
        whole--;
    }
    return n < 0 ? -1 : whole == n ? 0 : ftruncate(fd, from + whole);
}

mhe_status rows_open(const char *dir, const char *own, int32_t worker, row_writer *w,
                     mhe_error *err) {
    *w = (row_writer){.fd = -1, .synced = measure_seconds()};
    (void)snprintf(w->path, sizeof w->path, "%s/rows/%s-%d" SUFFIX, dir, own, (int)worker);
    w->fd = open(w->path, O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC, 0666);
    return w->fd < 0 || cut_half_line(w->fd) != 0 ? write_failed(w, err) : MHE_OK;
}

/* The reason is one line without tabs. */
static void add_reason(mhi_text *line, const char *reason) {
    for (const char *c = reason; *c != '\0'; c++) {
        mhi_text_add(line, "%c", (unsigned char)*c < ' ' ? ' ' : *c);
    }
}

mhe_status rows_append(row_writer *w, const row *r, mhe_error *err) {
    mhi_text line = {0};
    mhi_text_add(&line, "%*s\t%d\t%d\t%s\t%s\t", DIGITS, "", (int)r->task.condition,
                 (int)r->task.trial, r->cells, r->timing);
    add_reason(&line, r->reason);
    if (line.failed) {
        mhi_text_free(&line);
        return no_memory(err);
    }
    char digest[DIGITS + 1];
    (void)snprintf(digest, sizeof digest, "%016" PRIx64,
                   mhi_digest(line.data + DIGITS + 1, line.length - DIGITS - 1));
    memcpy(line.data, digest, DIGITS);
    mhi_text_add(&line, "\n");
    const ssize_t written = line.failed ? -1 : write(w->fd, line.data, line.length);
    const int whole = written == (ssize_t)line.length;
    mhi_text_free(&line);
    if (!whole) {
        return write_failed(w, err);
    }
    if (measure_seconds() - w->synced > 1) {
        w->synced = measure_seconds();
        return fdatasync(w->fd) != 0 ? write_failed(w, err) : MHE_OK;
    }
    return MHE_OK;
}

mhe_status rows_close(row_writer *w, mhe_error *err) {
    if (w->fd < 0) {
        return MHE_OK;
    }
    const int failed = fsync(w->fd) != 0;
    mhe_status status = failed ? write_failed(w, err) : MHE_OK;
    (void)close(w->fd);
    w->fd = -1;
    return status;
}

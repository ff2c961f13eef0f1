/* SPDX-License-Identifier: Apache-2.0 */
/* batch_list.c: the trials of a session: a table with a row a trial, or what lies in a folder. */
#define _XOPEN_SOURCE 700 /* realpath */
#include "batch.h"

#include "base/text.h"

#include <dirent.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define COLUMNS_MAX 200
#define FILE_MAX ((size_t)1 << 26)
#define NAME_LENGTH 200

static mhe_status no_memory(mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

static mhe_status read_file(const char *path, mhi_arena *arena, char **text, mhe_error *err) {
    FILE *file = fopen(path, "rb");
    size_t n = 0;
    char *room = file == NULL ? NULL : malloc(FILE_MAX + 1);
    *text = NULL;
    if (file == NULL) {
        return mhe_fail(err, MHE_E_INPUT, "%s: cannot be opened: %s", path, strerror(errno));
    }
    if (room != NULL) {
        n = fread(room, 1, FILE_MAX + 1, file);
        *text = n > FILE_MAX ? NULL : mhi_arena_text_n(arena, room, n);
    }
    const int failed = ferror(file);
    (void)fclose(file);
    free(room);
    if (failed) {
        return mhe_fail(err, MHE_E_INPUT, "%s: %s", path, strerror(errno));
    }
    if (n > FILE_MAX || (*text != NULL && strlen(*text) != n)) {
        return mhe_fail(err, MHE_E_INPUT, "%s: this is no table of trials", path);
    }
    return *text == NULL ? no_memory(err) : MHE_OK;
}

static mhe_status check_name(const char *list, int32_t line, const char *name, mhe_error *err) {
    if (name[0] == '\0' || name[0] == '.' || strlen(name) > NAME_LENGTH ||
        name[strcspn(name, "/\\\n\r\t")] != '\0') {
        return mhe_fail(err, MHE_E_INPUT,
                        "%s:%d: '%.60s' cannot be a trial's name, which is its folder's, too", list,
                        line, name);
    }
    return MHE_OK;
}

/* Keys whose values are files: those of a list lie as seen from the list. */
static int is_path(const char *key) {
    static const char *const keys[] = {"config",         "model.file",   "data.markers",
                                       "data.emg",       "data.angles",  "data.external_loads",
                                       "data.reference", "emg.mvc_file", "realtime.mvc_file"};
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++) {
        if (strcmp(keys[i], key) == 0) {
            return 1;
        }
    }
    return 0;
}

static const char *in_folder(batch *b, const char *folder, const char *name) {
    return name[0] == '/' ? mhi_arena_text(&b->arena, name)
                          : mhi_arena_format(&b->arena, "%s/%s", folder, name);
}

/* The folder that a file lies in, absolute. */
static mhe_status folder_of(batch *b, const char *path, const char **folder, mhe_error *err) {
    char *whole = realpath(path, NULL);
    if (whole == NULL) {
        return mhe_fail(err, MHE_E_INPUT, "%s: %s", path, strerror(errno));
    }
    char *slash = strrchr(whole, '/');
    *folder = mhi_arena_text_n(&b->arena, whole, slash == whole ? 1 : (size_t)(slash - whole));
    free(whole);
    return *folder == NULL ? no_memory(err) : MHE_OK;
}

/* Room for one more trial, with the command line's assignments and `n_more` of its own. */
static mhe_status add_trial(const arguments *a, batch *b, int32_t capacity, int32_t n_more,
                            const char ***more, batch_trial **added, mhe_error *err) {
    if (b->n == capacity) {
        return mhe_fail(err, MHE_E_INTERNAL, "%s: more trials than were counted", b->list);
    }
    batch_trial *t = &b->trials[b->n++];
    const char **set = MHI_TAKE(&b->arena, const char *, a->set.n + n_more);
    if (set == NULL) {
        return no_memory(err);
    }
    for (int32_t i = 0; i < a->set.n; i++) {
        set[i] = a->set.values[i];
    }
    t->config = a->config;
    t->set = set;
    t->n_set = a->set.n;
    *more = set;
    *added = t;
    return MHE_OK;
}

/* ---- a list ---- */

/* The next cell of a line, without its quotes; *at is behind its separator, NULL at the end. */
static char *next_cell(char **at, char separator) {
    char *from = *at, *to = from, *cell = from;
    if (*from == '"') {
        for (from++; *from != '\0' && !(from[0] == '"' && from[1] != '"');) {
            from += from[0] == '"';
            *to++ = *from++;
        }
        from += *from == '"';
    }
    while (*from != '\0' && *from != separator) {
        *to++ = *from++;
    }
    *at = *from == '\0' ? NULL : from + 1;
    *to = '\0';
    while (to > cell && (to[-1] == ' ' || to[-1] == '\r')) {
        *--to = '\0';
    }
    while (*cell == ' ') {
        cell++;
    }
    return cell;
}

static int32_t cells_of(char *line, char separator, char *cells[COLUMNS_MAX]) {
    int32_t n = 0;
    for (char *at = line; at != NULL && n < COLUMNS_MAX;) {
        cells[n++] = next_cell(&at, separator);
    }
    return n;
}

typedef struct list_file {
    const char *folder;
    char separator;
    char *keys[COLUMNS_MAX];
    int32_t n_keys, name; /* column of the names */
    int32_t capacity;
} list_file;

static mhe_status take_header(batch *b, list_file *f, char *line, int32_t number, mhe_error *err) {
    f->separator = strchr(line, '\t') != NULL ? '\t' : strchr(line, ';') != NULL ? ';' : ',';
    f->n_keys = cells_of(line, f->separator, f->keys);
    f->name = -1;
    for (int32_t i = 0; i < f->n_keys; i++) {
        if (strcmp(f->keys[i], "name") == 0) {
            f->name = i;
        }
        for (int32_t k = 0; k < i; k++) {
            if (strcmp(f->keys[i], f->keys[k]) == 0) {
                return mhe_fail(err, MHE_E_INPUT, "%s:%d: two columns are called '%s'", b->list,
                                number, f->keys[i]);
            }
        }
    }
    return f->name >= 0 ? MHE_OK
                        : mhe_fail(err, MHE_E_INPUT,
                                   "%s:%d: the first line names the columns: name, and keys of "
                                   "the config such as data.markers",
                                   b->list, number);
}

static mhe_status take_row(const arguments *a, batch *b, const list_file *f, char *line,
                           int32_t number, mhe_error *err) {
    char *cells[COLUMNS_MAX];
    const char **set = NULL;
    batch_trial *t = NULL;
    const int32_t n = cells_of(line, f->separator, cells);
    if (n != f->n_keys) {
        return mhe_fail(err, MHE_E_INPUT, "%s:%d: %d cells, where the first line has %d", b->list,
                        number, n, f->n_keys);
    }
    mhe_status status = check_name(b->list, number, cells[f->name], err);
    status = status == MHE_OK ? add_trial(a, b, f->capacity, n, &set, &t, err) : status;
    if (status != MHE_OK) {
        return status;
    }
    t->name = mhi_arena_text(&b->arena, cells[f->name]);
    t->line = number;
    for (int32_t i = 0; i < n; i++) {
        if (i == f->name || cells[i][0] == '\0') {
            continue;
        }
        const char *value = is_path(f->keys[i]) ? in_folder(b, f->folder, cells[i]) : cells[i];
        if (strcmp(f->keys[i], "config") == 0) {
            t->config = value;
        } else {
            set[t->n_set++] = mhi_arena_format(&b->arena, "%s=%s", f->keys[i], value);
        }
    }
    return b->arena.failed ? no_memory(err) : MHE_OK;
}

static mhe_status read_list(const arguments *a, batch *b, mhe_error *err) {
    list_file f = {.n_keys = 0};
    char *text = NULL;
    mhe_status status = read_file(b->list, &b->arena, &text, err);
    status = status == MHE_OK ? folder_of(b, b->list, &f.folder, err) : status;
    if (status != MHE_OK) {
        return status;
    }
    for (const char *c = text; *c != '\0'; c++) {
        f.capacity += *c == '\n';
    }
    f.capacity++;
    b->trials = MHI_TAKE(&b->arena, batch_trial, f.capacity);
    if (b->trials == NULL) {
        return no_memory(err);
    }
    char *line = strncmp(text, "\xef\xbb\xbf", 3) == 0 ? text + 3 : text;
    for (int32_t number = 1; *line != '\0' && status == MHE_OK; number++) {
        const size_t length = strcspn(line, "\n");
        char *next = line + length + (line[length] == '\n');
        line[length] = '\0';
        if (line[strspn(line, " \t\r,;")] == '\0' || line[0] == '#') {
            /* nothing, or a remark */
        } else if (f.n_keys == 0) {
            status = take_header(b, &f, line, number, err);
        } else {
            status = take_row(a, b, &f, line, number, err);
        }
        line = next;
    }
    return status;
}

/* ---- a folder ---- */

static int by_name(const void *a, const void *b) {
    return strcmp(((const batch_trial *)a)->name, ((const batch_trial *)b)->name);
}

static const char *ending(const char *name) {
    const char *dot = strrchr(name, '.');
    return dot == NULL || dot == name ? "" : dot + 1;
}

/* A recording of both, or markers with the EMG of the same name beside them. */
static mhe_status add_recording(const arguments *a, batch *b, int32_t capacity, const char *folder,
                                const char *name, mhe_error *err) {
    static const char *const tables[] = {"sto", "mot", "csv"};
    const char **set = NULL, *kind = ending(name);
    batch_trial *t = NULL;
    mhe_status status = add_trial(a, b, capacity, 2, &set, &t, err);
    if (status != MHE_OK) {
        return status;
    }
    t->name = mhi_arena_text_n(&b->arena, name, strlen(name) - strlen(kind) - 1);
    set[t->n_set++] = mhi_arena_format(&b->arena, "data.markers=%s/%s", folder, name);
    for (size_t i = 0; i < sizeof tables / sizeof tables[0] && strcmp(kind, "trc") == 0; i++) {
        const char *emg = mhi_arena_format(&b->arena, "%s/%s.%s", folder, t->name, tables[i]);
        struct stat is;
        if (emg != NULL && stat(emg, &is) == 0 && S_ISREG(is.st_mode)) {
            set[t->n_set++] = mhi_arena_format(&b->arena, "data.emg=%s", emg);
            break;
        }
    }
    if (strcmp(kind, "trc") != 0 && a->emg_too) {
        set[t->n_set++] = mhi_arena_format(&b->arena, "data.emg=%s/%s", folder, name);
    }
    return b->arena.failed ? no_memory(err) : MHE_OK;
}

static mhe_status add_file(const arguments *a, batch *b, int32_t capacity, const char *folder,
                           const char *name, mhe_error *err) {
    const char **set = NULL, *kind = ending(name);
    batch_trial *t = NULL;
    if (a->config != NULL) {
        return strcmp(kind, "trc") == 0 || strcmp(kind, "c3d") == 0 || strcmp(kind, "xdf") == 0
                   ? add_recording(a, b, capacity, folder, name, err)
                   : MHE_OK;
    }
    if (strcmp(kind, "yaml") != 0 && strcmp(kind, "yml") != 0) {
        return MHE_OK;
    }
    mhe_status status = add_trial(a, b, capacity, 0, &set, &t, err);
    if (status == MHE_OK) {
        t->name = mhi_arena_text_n(&b->arena, name, strlen(name) - strlen(kind) - 1);
        t->config = in_folder(b, folder, name);
    }
    return status == MHE_OK && b->arena.failed ? no_memory(err) : status;
}

static mhe_status read_folder(const arguments *a, batch *b, mhe_error *err) {
    DIR *dir = opendir(b->list);
    char *folder = realpath(b->list, NULL);
    const struct dirent *entry;
    int32_t capacity = 0;
    mhe_status status = dir == NULL || folder == NULL
                            ? mhe_fail(err, MHE_E_INPUT, "%s: %s", b->list, strerror(errno))
                            : MHE_OK;
    while (status == MHE_OK && readdir(dir) != NULL) {
        capacity++;
    }
    b->trials = MHI_TAKE(&b->arena, batch_trial, capacity);
    if (status == MHE_OK) {
        rewinddir(dir);
        status = b->trials == NULL ? no_memory(err) : MHE_OK;
    }
    while (status == MHE_OK && (entry = readdir(dir)) != NULL) {
        if (entry->d_name[0] != '.') {
            status = add_file(a, b, capacity, folder, entry->d_name, err);
        }
    }
    if (dir != NULL) {
        (void)closedir(dir);
    }
    free(folder);
    if (status == MHE_OK) {
        qsort(b->trials, (size_t)b->n, sizeof *b->trials, by_name);
    }
    return status;
}

/* ---- both ---- */

static mhe_status check_all(const batch *b, mhe_error *err) {
    for (int32_t i = 0; i < b->n; i++) {
        if (b->trials[i].config == NULL) {
            return mhe_fail(err, MHE_E_INPUT,
                            "%s:%d: '%s' has no config: mhe-run CONFIG.yaml --batch, or a column "
                            "'config'",
                            b->list, b->trials[i].line, b->trials[i].name);
        }
        for (int32_t k = 0; k < i; k++) {
            if (strcmp(b->trials[i].name, b->trials[k].name) == 0) {
                return mhe_fail(err, MHE_E_INPUT, "%s:%d: there are two trials '%s'", b->list,
                                b->trials[i].line, b->trials[i].name);
            }
        }
    }
    return b->n > 0 ? MHE_OK
                    : mhe_fail(err, MHE_E_INPUT,
                               "%s: no trials: a table with a line a trial; or a folder of "
                               "recordings (.c3d, .trc, .xdf) with a config on the command line, "
                               "or of configs (.yaml)",
                               b->list);
}

mhe_status batch_read(const arguments *a, batch *b, mhe_error *err) {
    struct stat is;
    b->list = a->batch;
    if (stat(b->list, &is) != 0) {
        return mhe_fail(err, MHE_E_INPUT, "%s: %s", b->list, strerror(errno));
    }
    mhe_status status = S_ISDIR(is.st_mode) ? read_folder(a, b, err) : read_list(a, b, err);
    return status == MHE_OK ? check_all(b, err) : status;
}

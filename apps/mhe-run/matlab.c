/* SPDX-License-Identifier: Apache-2.0 */
#include "matlab.h"

#include "base/arena.h"

#include <errno.h>
#include <matio.h>
#include <stdlib.h>
#include <string.h>

struct matlab_table {
    const char *name;
    const char **labels;
    int32_t n_columns;
    size_t n_rows, capacity;
    double *values; /* [n_rows x (1 + n_columns)], time first */
    matlab_table *next;
};

struct matlab {
    matlab_table *first, **last;
    mhi_arena arena;
};

static void free_matlab(matlab *m) {
    for (matlab_table *t = m->first; t != NULL; t = t->next) {
        free(t->values);
    }
    mhi_arena_free(&m->arena);
    free(m);
}

static void release(void *data) {
    free_matlab(data);
}

/* n columns from `first` on, column by column as MATLAB has them. */
static matvar_t *matrix(const matlab_table *t, int32_t first, int32_t n) {
    size_t size[2] = {t->n_rows, (size_t)n};
    double *data = malloc(sizeof *data * (t->n_rows * (size_t)n + 1));
    if (data == NULL) {
        return NULL;
    }
    for (size_t k = 0; k < t->n_rows; k++) {
        for (int32_t i = 0; i < n; i++) {
            data[(size_t)i * t->n_rows + k] =
                t->values[k * (size_t)(t->n_columns + 1) + (size_t)(first + i)];
        }
    }
    matvar_t *made = Mat_VarCreate(NULL, MAT_C_DOUBLE, MAT_T_DOUBLE, 2, size, data, 0);
    free(data);
    return made;
}

static matvar_t *cell_of_labels(const matlab_table *t) {
    size_t size[2] = {1, (size_t)t->n_columns};
    matvar_t *cell = Mat_VarCreate(NULL, MAT_C_CELL, MAT_T_CELL, 2, size, NULL, 0);
    for (int32_t i = 0; i < t->n_columns && cell != NULL; i++) {
        size_t length[2] = {1, strlen(t->labels[i])};
        union {
            const char *lent;
            void *copied;
        } text = {.lent = t->labels[i]}; /* matio makes a copy */
        matvar_t *label = Mat_VarCreate(NULL, MAT_C_CHAR, MAT_T_UTF8, 2, length, text.copied, 0);
        if (label == NULL) {
            Mat_VarFree(cell);
            return NULL;
        }
        Mat_VarSetCell(cell, i, label);
    }
    return cell;
}

static int write_table(mat_t *mat, const matlab_table *t) {
    static const char *names[] = {"time", "data", "labels"};
    size_t size[2] = {1, 1};
    matvar_t *fields[3] = {matrix(t, 0, 1), matrix(t, 1, t->n_columns), cell_of_labels(t)};
    matvar_t *made = Mat_VarCreateStruct(t->name, 2, size, names, 3);
    const int missing = made == NULL || fields[0] == NULL || fields[1] == NULL || fields[2] == NULL;
    for (int32_t i = 0; i < 3; i++) {
        if (missing) {
            Mat_VarFree(fields[i]);
        } else {
            Mat_VarSetStructFieldByName(made, names[i], 0, fields[i]);
        }
    }
    const int failed = missing || Mat_VarWrite(mat, made, MAT_COMPRESSION_ZLIB) != 0;
    Mat_VarFree(made);
    return failed;
}

static mhe_status write_all(void *data, const char *path, mhe_error *err) {
    const matlab *m = data;
    mat_t *mat = Mat_CreateVer(path, NULL, MAT_FT_MAT5);
    int failed = mat == NULL;
    for (const matlab_table *t = m->first; t != NULL && !failed; t = t->next) {
        failed = write_table(mat, t);
    }
    failed = (mat != NULL && Mat_Close(mat) != 0) || failed;
    return failed ? mhe_fail(err, MHE_E_IO, "cannot be written: %s",
                             strerror(errno != 0 ? errno : EIO))
                  : MHE_OK;
}

mhe_status matlab_open(mhe_outbox *outbox, const char *name, matlab **file, mhe_error *err) {
    *file = NULL;
    matlab *m = calloc(1, sizeof *m);
    if (m == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", name);
    }
    mhe_status status = mhe_outbox_later(outbox, name, write_all, release, m, err);
    if (status != MHE_OK) {
        free_matlab(m);
        return status;
    }
    m->last = &m->first;
    *file = m;
    return MHE_OK;
}

mhe_status matlab_add(matlab *m, const char *name, const char *const *labels, int32_t n_columns,
                      matlab_table **table, mhe_error *err) {
    matlab_table *t = MHI_TAKE(&m->arena, matlab_table, 1);
    const char **copies = MHI_TAKE(&m->arena, const char *, n_columns);
    *table = NULL;
    int failed = t == NULL || copies == NULL;
    for (int32_t i = 0; i < n_columns && !failed; i++) {
        copies[i] = mhi_arena_text(&m->arena, labels[i]);
        failed = copies[i] == NULL;
    }
    const char *own_name = mhi_arena_text(&m->arena, name);
    if (failed || own_name == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    *t = (matlab_table){.name = own_name, .labels = copies, .n_columns = n_columns};
    *m->last = t;
    m->last = &t->next;
    *table = t;
    return MHE_OK;
}

mhe_status matlab_row(matlab_table *t, double time, const double *values, mhe_error *err) {
    const size_t width = (size_t)t->n_columns + 1;
    if (t->n_rows == t->capacity) {
        const size_t capacity = t->capacity == 0 ? 1024 : 2 * t->capacity;
        double *grown = realloc(t->values, sizeof *grown * capacity * width);
        if (grown == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
        t->values = grown;
        t->capacity = capacity;
    }
    double *row = t->values + t->n_rows++ * width;
    row[0] = time;
    memcpy(row + 1, values, sizeof(double) * (size_t)t->n_columns);
    return MHE_OK;
}

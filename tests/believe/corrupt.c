/* SPDX-License-Identifier: Apache-2.0 */
/* corrupt: a clean recording with one systematic error, as laboratories make them.
 *   corrupt --list
 *   corrupt KIND MARKERS EMG OUT_DIR      writes OUT_DIR/markers.trc and OUT_DIR/emg.sto */
#include "corrupt.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

double corrupt_uniform(recording *r) { /* splitmix64 */
    r->seed += 0x9e3779b97f4a7c15U;
    uint64_t z = r->seed;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

double corrupt_normal(recording *r) {
    return sqrt(-2 * log(corrupt_uniform(r) + 1e-300)) * cos(2 * acos(-1) * corrupt_uniform(r));
}

double *corrupt_cell(mhi_table *t, int32_t row, int32_t column) {
    return t->values + (ptrdiff_t)row * t->n_columns + column;
}

/* ---- files ---- */

static FILE *open_in(const char *folder, const char *name) {
    char path[4096];
    (void)snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "w");
    if (file == NULL) {
        (void)fprintf(stderr, "%s: cannot be written\n", path);
        exit(1);
    }
    return file;
}

static void put(FILE *file, double value, double factor) {
    if (isnan(value)) {
        (void)fputc('\t', file);
    } else {
        (void)fprintf(file, "\t%.9g", factor * value);
    }
}

static void write_markers(const recording *r, const char *folder) {
    const mhi_table *t = r->markers;
    FILE *file = open_in(folder, "markers.trc");
    (void)fprintf(file,
                  "PathFileType\t4\t(X/Y/Z)\tmarkers.trc\nDataRate\tNumFrames\tNumMarkers\tUnits\n"
                  "%.9g\t%d\t%d\t%s\nFrame#\tTime",
                  t->rate, (int)t->n_rows, (int)t->n_labels, r->unit);
    for (int32_t i = 0; i < t->n_labels; i++) {
        (void)fprintf(file, "\t%s\t\t", t->labels[i]);
    }
    (void)fprintf(file, "\n\t\tX1\tY1\tZ1\n\n");
    for (int32_t k = 0; k < t->n_rows; k++) {
        (void)fprintf(file, "%d\t%.9g", (int)k + 1, t->time[k]);
        for (int32_t i = 0; i < t->n_columns; i++) {
            put(file, t->values[(ptrdiff_t)k * t->n_columns + i], 1000);
        }
        (void)fputc('\n', file);
    }
    (void)fclose(file);
}

static void write_emg(const recording *r, const char *folder) {
    const mhi_table *t = r->emg;
    FILE *file = open_in(folder, "emg.sto");
    (void)fprintf(file, "emg\nversion=1\nnRows=%d\nnColumns=%d\ninDegrees=no\nendheader\ntime",
                  (int)t->n_rows, (int)t->n_columns + 1);
    for (int32_t i = 0; i < t->n_labels; i++) {
        (void)fprintf(file, "\t%s", t->labels[i]);
    }
    for (int32_t k = 0; k < t->n_rows; k++) {
        (void)fprintf(file, "\n%.9g", t->time[k]);
        for (int32_t i = 0; i < t->n_columns; i++) {
            (void)fprintf(file, "\t%.9g", t->values[(ptrdiff_t)k * t->n_columns + i]);
        }
    }
    (void)fputc('\n', file);
    (void)fclose(file);
}

static void clean(recording *r) {
    (void)r;
}

static const corruption none = {"clean", "as it is", clean};
#define N_KINDS (1 + corrupt_n_markers + corrupt_n_emg)

static const corruption *kind_at(size_t i) {
    return i == 0                   ? &none
           : i <= corrupt_n_markers ? &corrupt_markers[i - 1]
                                    : &corrupt_emg[i - 1 - corrupt_n_markers];
}

int main(int argc, char **argv) {
    if (argc == 2 && strcmp(argv[1], "--list") == 0) {
        for (size_t i = 0; i < N_KINDS; i++) {
            (void)printf("%s|%s\n", kind_at(i)->name, kind_at(i)->what);
        }
        return 0;
    }
    size_t kind = 0;
    while (argc == 5 && kind < N_KINDS && strcmp(kind_at(kind)->name, argv[1]) != 0) {
        kind++;
    }
    if (argc != 5 || kind == N_KINDS) {
        (void)fprintf(stderr, "corrupt --list | corrupt KIND MARKERS EMG OUT_DIR\n");
        return 2;
    }
    recording r = {.unit = "mm", .seed = 1};
    mhe_error err = {0};
    if (mhi_markers_read(argv[2], &r.markers, &err) != MHE_OK ||
        mhi_signals_read(argv[3], &r.emg, &err) != MHE_OK) {
        (void)fprintf(stderr, "%s\n", err.text);
        return 1;
    }
    kind_at(kind)->apply(&r);
    write_markers(&r, argv[4]);
    write_emg(&r, argv[4]);
    mhi_table_free(r.markers);
    mhi_table_free(r.emg);
    return 0;
}

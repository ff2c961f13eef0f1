/* SPDX-License-Identifier: Apache-2.0 */
/* scale_private.h: a Scale setup of OpenSim, and the model file while it is changed.
 *
 * setup.c reads the setup, factors.c finds each body's factors from markers, change.c and
 * function.c apply them to the elements of the model file, place.c moves its markers to those of a
 * static pose. Everything of the model file that is not scaled stays as it is. */
#ifndef MHI_SCALE_PRIVATE_H
#define MHI_SCALE_PRIVATE_H

#include "inspect/inspected.h"
#include "io/ik_tasks.h"
#include "io/osim.h"
#include "io/table.h"

/* An XML file. */
typedef struct mhi_document {
    mhi_osim o; /* for its elements; messages name the file */
    const char *path;
    xmlDoc *doc;
    xmlNode *root;
} mhi_document;

/* Two markers whose distance says how long something is. */
typedef struct mhi_marker_pair {
    const char *names[2];
    int32_t line;
} mhi_marker_pair;

typedef struct mhi_measurement {
    const char *name;
    mhi_marker_pair *pairs;
    int32_t n_pairs, line;
    const char **bodies; /* [n_bodies] */
    uint8_t *axes;       /* [n_bodies] bits: 1 x, 2 y, 4 z */
    int32_t n_bodies;
} mhi_measurement;

/* Factors that the setup states itself. */
typedef struct mhi_manual_scale {
    const char *body;
    double factors[3];
    int32_t line;
} mhi_manual_scale;

typedef struct mhi_scale_setup {
    mhi_document file;
    const char *folder, *name;
    const char *model, *marker_set; /* paths; marker_set NULL: the model's own */
    double mass;                    /* kg; NAN: not stated */
    int32_t scales, places;         /* whether the two parts are to be done */
    const char *order[2];           /* "measurements", "manualScale"; NULL: no more */
    mhi_measurement *measurements;
    mhi_manual_scale *manual;
    int32_t n_measurements, n_manual, preserve;
    const char *trial, *static_trial; /* .trc */
    double range[2], static_range[2]; /* s */
    mhi_ik_task *tasks;
    int32_t n_tasks;
    mhi_arena arena;
} mhi_scale_setup;

/* The model while it is scaled. */
typedef struct mhi_scaled {
    const mhe_host *host;
    const mhi_scale_setup *setup;
    mhi_document file;
    int32_t n_bodies;
    const char **bodies; /* those of the file, by name */
    double *factors;     /* [n_bodies x 3] */
    double mass_before, mass_after;
    mhi_arena arena;
} mhi_scaled;

mhe_status mhi_document_open(mhi_document *d, const char *path, mhe_error *err);
void mhi_document_close(mhi_document *d);
MHE_PRINTF(4, 5)
mhe_status mhi_document_fail(const mhi_document *d, int32_t line, mhe_error *err,
                             const char *format, ...);

/* setup.c [cold] */
mhe_status mhi_scale_setup_read(mhi_scale_setup *s, const char *path, mhe_error *err);
void mhi_scale_setup_close(mhi_scale_setup *s);

/* factors.c: `open` is the model as it is, in its default pose. */
mhe_status mhi_scale_factors(mhi_scaled *m, mhi_inspected *open, mhe_error *err);
/* Positions [n_markers x 3], lengths of paths [n_paths] and bodies [n_bodies x 12] at q (NULL: the
 * default pose); what is NULL is not wanted. */
mhe_status mhi_scale_look(mhi_inspected *open, const double *q, double *markers, double *lengths,
                          double *bodies, mhe_error *err);
/* Means of a trial's markers over a range of time. */
mhe_status mhi_scale_mean(const mhi_scale_setup *s, const mhi_table *trial, const double range[2],
                          const char *whose, double *mean, mhe_error *err);
int32_t mhi_scale_body(const mhi_scaled *m, const char *name); /* -1: none */

/* change.c: the file's elements by the factors; then the muscles' lengths by those of their paths.
 */
mhe_status mhi_scale_change(mhi_scaled *m, mhe_error *err);
mhe_status mhi_scale_muscles(mhi_scaled *m, const mhe_description *d, const double *before,
                             const double *after, mhe_error *err);
/* Replaces the numbers of an element. */
void mhi_scale_write(xmlNode *node, const double *values, int32_t n);

/* function.c: multiplies what a function element says. 0: out of memory. */
int32_t mhi_scale_function(mhi_document *d, xmlNode *function, double factor);
/* The function element within a holder (a TransformAxis, an x_location); NULL: none. */
xmlNode *mhi_scale_find_function(mhi_document *d, xmlNode *holder);

/* place.c: the static pose and the markers' new places, written into the file. */
mhe_status mhi_scale_place(mhi_scaled *m, mhi_inspected *open, mhi_text *report, mhe_error *err);

#endif

/* SPDX-License-Identifier: Apache-2.0 */
/* fit.h: polynomials in place of paths (model.paths: fitted).
 *
 * Each path's length becomes a sparse polynomial of the coordinates it crosses, fitted to lengths
 * and gradients over their ranges as in van den Bogert, Geijtenbeek, Even-Zohar, Steenbrink &
 * Hardin (2013), doi:10.1007/s11517-013-1076-z; its terms are chosen one by one, each the one that
 * explains most of what is left (orthogonal matching pursuit), until other poses than those of the
 * fit say that the tolerance is met. Errors are told of a third set. */
#ifndef SIMBODY_FIT_H
#define SIMBODY_FIT_H

#include "model.h"

/* What became of one path. Lengths in m, moment arms in m/rad (1). */
typedef struct path_fit {
    int32_t fitted; /* else it stays as it is, for `why` */
    int32_t n, n_terms;
    int32_t *coordinate;
    double *centre, *scale, *coef;
    uint8_t *exponent;
    double length_rms, length_worst, arm_rms, arm_worst;
    double jump; /* largest of its conditional points, smoothed */
    char why[64];
} path_fit;

typedef struct path_fits {
    int32_t n;
    path_fit *fits;        /* [n_paths] */
    mhe_polynomial *terms; /* of the fitted ones */
    mhe_path *paths;       /* the description's, with polynomials for points */
    mhe_description description;
} path_fits;

/* Fits the paths of an exact instance `model`, or reads them from the cache. Tells each path's
 * errors. `range`: share of the coordinates' ranges, about their defaults. MHE_E_MEMORY, or what
 * the model says. [cold] */
mhe_status fits_create(const mhe_host *host, const mhe_description *description, void *model,
                       double tolerance, double range, path_fits **out, mhe_error *err);
void fits_free(path_fits *fits);

/* Where coordinate i is fitted: a margin about the motion that the description knows of, else over
 * the share of its range about its default, and a margin. */
void fit_range(const mhe_description *description, int32_t i, double share, double *lower,
               double *upper);

/* ---- fit_cache.c ---- */

/* A number for all that lengths depend on. */
uint64_t fits_digest(const mhe_description *description, double tolerance, double range);
/* 0: read, or written. `fits` has its arrays by n. */
int fits_read(uint64_t digest, int32_t n_coordinates, path_fits *fits);
int fits_write(uint64_t digest, const path_fits *fits);
/* Room for n terms of path i's polynomial; 0: there. */
int fit_allocate(path_fit *fit, int32_t n, int32_t n_terms);
void fit_clear(path_fit *fit);

#endif

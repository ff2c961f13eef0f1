/* SPDX-License-Identifier: Apache-2.0 */
/* fit.c: fits of all paths of a model, from the cache or made, told, and put into a description. */
#include "fit_private.h"

#include <mhe/host.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TOLD_JUMP 2e-3 /* m: a larger one is a warning */
#define MOST_NAMED 6

int fit_allocate(path_fit *fit, int32_t n, int32_t n_terms) {
    size_t a = (size_t)n + 1, b = (size_t)n_terms + 1;
    fit->n = n;
    fit->n_terms = n_terms;
    fit->coordinate = calloc(a, sizeof *fit->coordinate);
    fit->centre = calloc(a, sizeof *fit->centre);
    fit->scale = calloc(a, sizeof *fit->scale);
    fit->coef = calloc(b, sizeof *fit->coef);
    fit->exponent = calloc(a * b, sizeof *fit->exponent);
    return fit->coordinate != NULL && fit->centre != NULL && fit->scale != NULL &&
                   fit->coef != NULL && fit->exponent != NULL
               ? 0
               : -1;
}

/* One line: how many of the paths are polynomials, and which miss the tolerance. */
static void tell_exact(const mhe_host *host, const mhe_description *d, const path_fits *fits,
                       int32_t n_fitted) {
    char text[320];
    int32_t n = 0;
    int at =
        snprintf(text, sizeof text, "%d of %d paths are polynomials", (int)n_fitted, (int)fits->n);
    for (int32_t i = 0; i < fits->n; i++) {
        if (fits->fits[i].fitted || fits->fits[i].why[0] == '\0') {
            continue;
        }
        n++;
        if (n > MOST_NAMED || at >= (int)sizeof text - 64) {
            (void)snprintf(text + at, sizeof text - (size_t)at, ", ...");
            break;
        }
        at += snprintf(text + at, sizeof text - (size_t)at, "%s%.40s",
                       n == 1 ? "; what misses paths_tolerance over the range stays exact: " : ", ",
                       d->paths[i].name);
    }
    host->log(host, n > 0 ? MHE_LOG_WARNING : MHE_LOG_INFO, text);
}

static void tell(const mhe_host *host, const mhe_description *d, const path_fits *fits) {
    int32_t n = 0;
    char text[320];
    for (int32_t i = 0; i < fits->n && host != NULL; i++) {
        const path_fit *fit = &fits->fits[i];
        n += fit->fitted;
        if (fit->fitted) {
            (void)snprintf(text, sizeof text,
                           "path '%s': %d terms in %d coordinates, off by %.2f mm RMS (%.2f at "
                           "worst), moment arms by %.2f mm RMS (%.2f)",
                           d->paths[i].name, (int)fit->n_terms, (int)fit->n, 1e3 * fit->length_rms,
                           1e3 * fit->length_worst, 1e3 * fit->arm_rms, 1e3 * fit->arm_worst);
            host->log(host, MHE_LOG_DEBUG, text);
        } else if (fit->why[0] != '\0') {
            (void)snprintf(text, sizeof text, "path '%s' stays exact: %s", d->paths[i].name,
                           fit->why);
            host->log(host, MHE_LOG_INFO, text);
        }
        if (fit->fitted && fit->jump > TOLD_JUMP) {
            (void)snprintf(text, sizeof text,
                           "path '%s': its conditional points jump by %.1f mm; fitted, it has no "
                           "jump",
                           d->paths[i].name, 1e3 * fit->jump);
            host->log(host, MHE_LOG_WARNING, text);
        }
    }
    if (host != NULL) {
        tell_exact(host, d, fits, n);
    }
}

/* The description with polynomials where paths were fitted. */
static int fits_describe(const mhe_description *d, path_fits *fits) {
    size_t n = (size_t)fits->n + 1;
    fits->terms = calloc(n, sizeof *fits->terms);
    fits->paths = calloc(n, sizeof *fits->paths);
    if (fits->terms == NULL || fits->paths == NULL) {
        return -1;
    }
    fits->description = *d;
    fits->description.paths = fits->paths;
    for (int32_t i = 0; i < fits->n; i++) {
        const path_fit *fit = &fits->fits[i];
        fits->paths[i] = d->paths[i];
        if (fit->fitted) {
            fits->terms[i] =
                (mhe_polynomial){fit->n,       fit->coordinate, fit->centre,  fit->scale,
                                 fit->n_terms, fit->coef,       fit->exponent};
            fits->paths[i].n_points = fits->paths[i].n_wraps = 0;
            fits->paths[i].length = &fits->terms[i];
        }
    }
    return 0;
}

static mhe_status fits_make(const mhe_description *d, void *model, double tolerance, double range,
                            path_fits *fits, mhe_error *err) {
    samples s;
    mhe_status status = samples_make(d, model, range, &s, err);
    for (int32_t i = 0; i < fits->n && status == MHE_OK; i++) {
        if (fit_path(model, &s, i, tolerance, &fits->fits[i]) != 0) {
            status = mhe_fail(err, MHE_E_MEMORY, "no memory to fit paths");
        }
    }
    if (status == MHE_OK) {
        status = samples_jumps(d, &s, model, fits, err);
    }
    samples_free(&s);
    return status;
}

/* Terms by their exponents, the first ones first: sums within sums then share most (polynomial.c).
 */
static void sort_terms(path_fit *fit) {
    const size_t n = (size_t)fit->n;
    for (int32_t i = 1; i < fit->n_terms; i++) {
        uint8_t *here = fit->exponent + (size_t)i * n;
        for (int32_t k = i; k > 0 && memcmp(here - n, here, n) > 0; k--, here -= n) {
            const double coef = fit->coef[k];
            fit->coef[k] = fit->coef[k - 1];
            fit->coef[k - 1] = coef;
            for (size_t j = 0; j < n; j++) {
                const uint8_t e = here[j];
                here[j] = here[(ptrdiff_t)j - (ptrdiff_t)n];
                here[(ptrdiff_t)j - (ptrdiff_t)n] = e;
            }
        }
    }
}

mhe_status fits_create(const mhe_host *host, const mhe_description *d, void *model,
                       double tolerance, double range, path_fits **out, mhe_error *err) {
    path_fits *fits = calloc(1, sizeof *fits);
    uint64_t digest = fits_digest(d, tolerance, range);
    mhe_status status = MHE_OK;
    *out = fits;
    if (fits == NULL || (fits->fits = calloc((size_t)d->n_paths + 1, sizeof *fits->fits)) == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory to fit paths");
    }
    fits->n = d->n_paths;
    if (fits_read(digest, d->n_coordinates, fits) != 0) {
        status = fits_make(d, model, tolerance, range, fits, err);
        if (status == MHE_OK) {
            (void)fits_write(digest, fits); /* next time it takes as long again, no more */
        }
    }
    for (int32_t i = 0; i < fits->n && status == MHE_OK; i++) {
        sort_terms(&fits->fits[i]);
    }
    if (status == MHE_OK && fits_describe(d, fits) != 0) {
        status = mhe_fail(err, MHE_E_MEMORY, "no memory to fit paths");
    }
    if (status == MHE_OK) {
        tell(host, d, fits);
    }
    return status;
}

void fit_clear(path_fit *fit) {
    free(fit->coordinate);
    free(fit->centre);
    free(fit->scale);
    free(fit->coef);
    free(fit->exponent);
    memset(fit, 0, sizeof *fit);
}

void fits_free(path_fits *fits) {
    if (fits == NULL) {
        return;
    }
    for (int32_t i = 0; i < fits->n && fits->fits != NULL; i++) {
        fit_clear(&fits->fits[i]);
    }
    free(fits->fits);
    free(fits->terms);
    free(fits->paths);
    free(fits);
}

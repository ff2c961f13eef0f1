/* SPDX-License-Identifier: Apache-2.0 */
/* fit_cache.c: fitted paths in the user's cache folder, $XDG_CACHE_HOME/mhe or ~/.cache/mhe. A file
 * is named by the digest of all that lengths depend on, and is of this machine only. */
#define _GNU_SOURCE /* secure_getenv */
#include "fit.h"

#include "route.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define MAGIC 0x32746966656d6800u /* "mhefit2", backwards */
#define MOST 4096                 /* of any count in a file */
/* to be raised with every change of lengths or fits: older files are not read */
#define LENGTHS 6

/* ---- digest ---- */

static void mix(uint64_t *digest, const void *data, size_t n) {
    const unsigned char *bytes = data;
    for (size_t i = 0; i < n; i++) {
        *digest = (*digest ^ bytes[i]) * 1099511628211u;
    }
}

static void mix_count(uint64_t *digest, int32_t value) {
    mix(digest, &value, sizeof value);
}

static void mix_doubles(uint64_t *digest, const double *values, int32_t n) {
    mix(digest, values, sizeof *values * (size_t)n);
}

static void mix_function(uint64_t *digest, const mhe_function *f) {
    mix_count(digest, f->n_pieces);
    mix_count(digest, f->n_coef);
    mix_doubles(digest, f->origin, f->n_pieces);
    mix_doubles(digest, f->coef, f->n_pieces * f->n_coef);
}

static void mix_body(uint64_t *digest, const mhe_body *b) {
    mix_count(digest, b->parent);
    mix_count(digest, b->n_motions);
    mix_doubles(digest, b->joint_r, 9);
    mix_doubles(digest, b->joint_p, 3);
    mix_doubles(digest, b->body_r, 9);
    mix_doubles(digest, b->body_p, 3);
    for (int32_t k = 0; k < b->n_motions; k++) {
        mix_count(digest, b->motions[k].kind);
        mix_count(digest, b->motions[k].coordinate);
        mix_doubles(digest, b->motions[k].axis, 3);
        mix_function(digest, &b->motions[k].function);
    }
}

static void mix_point(uint64_t *digest, const mhe_path_point *p) {
    mix_count(digest, p->kind);
    mix_count(digest, p->body);
    mix_doubles(digest, p->location, 3);
    for (int i = 0; i < 3 && p->kind == MHE_POINT_MOVING; i++) {
        mix_count(digest, p->coordinate[i]);
        if (p->coordinate[i] >= 0) {
            mix_function(digest, &p->function[i]);
        }
    }
    if (p->kind == MHE_POINT_CONDITIONAL) {
        mix_count(digest, p->coordinate[0]);
        mix_doubles(digest, &p->lower, 1);
        mix_doubles(digest, &p->upper, 1);
    }
}

static void mix_path(uint64_t *digest, const mhe_path *p) {
    mix_count(digest, p->n_points);
    mix_count(digest, p->n_wraps);
    for (int32_t k = 0; k < p->n_points; k++) {
        mix_point(digest, &p->points[k]);
    }
    for (int32_t k = 0; k < p->n_wraps; k++) {
        mix_count(digest, p->wraps[k].obstacle);
        mix_count(digest, p->wraps[k].first);
        mix_count(digest, p->wraps[k].last);
    }
    if (p->length != NULL) {
        const mhe_polynomial *l = p->length;
        mix(digest, l->coordinate, sizeof *l->coordinate * (size_t)l->n);
        mix_doubles(digest, l->centre, l->n);
        mix_doubles(digest, l->scale, l->n);
        mix_doubles(digest, l->coef, l->n_terms);
        mix(digest, l->exponent, (size_t)l->n * (size_t)l->n_terms);
    }
}

uint64_t fits_digest(const mhe_description *d, double tolerance, double range) {
    uint64_t digest = 1469598103934665603u;
    mix_count(&digest, LENGTHS);
    mix_doubles(&digest, &tolerance, 1);
    mix_doubles(&digest, &range, 1);
    mix_count(&digest, d->n_coordinates);
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        double over[2];
        fit_range(d, i, range, &over[0], &over[1]);
        mix_doubles(&digest, over, 2);
        mix_doubles(&digest, &d->coordinates[i].value, 1);
        mix_count(&digest, d->coordinates[i].rotational);
    }
    for (int32_t i = 0; i < d->n_dependents; i++) {
        mix_count(&digest, d->dependents[i].independent);
        mix_function(&digest, &d->dependents[i].function);
    }
    for (int32_t i = 0; i < d->n_bodies; i++) {
        mix_body(&digest, &d->bodies[i]);
    }
    for (int32_t i = 0; i < d->n_obstacles; i++) {
        const mhe_obstacle *o = &d->obstacles[i];
        const int32_t whole[] = {o->kind, o->body, o->side_axis, o->side_sign};
        mix(&digest, whole, sizeof whole);
        mix_doubles(&digest, o->r, 9);
        mix_doubles(&digest, o->p, 3);
        mix_doubles(&digest, o->size, 3);
    }
    mix_count(&digest, d->n_paths);
    for (int32_t i = 0; i < d->n_paths; i++) {
        mix_path(&digest, &d->paths[i]);
    }
    return digest;
}

/* ---- files ---- */

/* Name of the file; `make`: and its folder. 0: there is one. */
static int cache_name(uint64_t digest, int make, char *out, size_t size) {
    const char *base = secure_getenv("XDG_CACHE_HOME"), *home = secure_getenv("HOME");
    char folder[768];
    int n = -1;
    if (base != NULL && base[0] == '/') {
        n = snprintf(folder, sizeof folder, "%s", base);
    } else if (home != NULL && home[0] == '/') {
        n = snprintf(folder, sizeof folder, "%s/.cache", home);
    }
    if (n < 0 || (size_t)n + 8 > sizeof folder) {
        return -1;
    }
    if (make) {
        (void)mkdir(folder, 0700);
    }
    (void)strcat(folder, "/mhe");
    if (make) {
        (void)mkdir(folder, 0700);
    }
    n = snprintf(out, size, "%s/paths-%016llx.fit", folder, (unsigned long long)digest);
    return n > 0 && (size_t)n < size ? 0 : -1;
}

static int get(FILE *in, void *data, size_t size, size_t n) {
    return n == 0 || fread(data, size, n, in) == n ? 0 : -1;
}

static int put(FILE *out, const void *data, size_t size, size_t n) {
    return n == 0 || fwrite(data, size, n, out) == n ? 0 : -1;
}

/* The numbers of one path that are always there. */
typedef struct fit_record {
    int32_t fitted, n, n_terms, unused;
    double length_rms, length_worst, arm_rms, arm_worst, jump;
    char why[64];
} fit_record;

/* A fit that a damaged file cannot make dangerous. */
static int fit_is_sound(const path_fit *fit, int32_t n_coordinates) {
    int sound = 1;
    for (int32_t i = 0; i < fit->n; i++) {
        sound = sound && fit->coordinate[i] >= 0 && fit->coordinate[i] < n_coordinates &&
                isfinite(fit->centre[i]) && isfinite(fit->scale[i]) && fit->scale[i] > 0;
    }
    for (int32_t t = 0; t < fit->n_terms; t++) {
        int32_t factors = 0;
        for (int32_t i = 0; i < fit->n; i++) {
            factors += fit->exponent[t * fit->n + i] > 0;
            sound = sound && fit->exponent[t * fit->n + i] < POLYNOMIAL_POWERS;
        }
        sound = sound && isfinite(fit->coef[t]) && factors <= POLYNOMIAL_FACTORS;
    }
    return sound;
}

static int fit_get(FILE *in, path_fit *fit) {
    fit_record r;
    if (get(in, &r, sizeof r, 1) != 0 || r.n < 0 || r.n > MOST || r.n_terms < 0 ||
        r.n_terms > MOST) {
        return -1;
    }
    r.why[sizeof r.why - 1] = '\0';
    fit->fitted = r.fitted != 0;
    fit->length_rms = r.length_rms;
    fit->length_worst = r.length_worst;
    fit->arm_rms = r.arm_rms;
    fit->arm_worst = r.arm_worst;
    fit->jump = r.jump;
    memcpy(fit->why, r.why, sizeof fit->why);
    size_t n = (size_t)r.n, m = (size_t)r.n_terms;
    return fit_allocate(fit, r.n, r.n_terms) != 0 ||
                   get(in, fit->coordinate, sizeof *fit->coordinate, n) != 0 ||
                   get(in, fit->centre, sizeof *fit->centre, n) != 0 ||
                   get(in, fit->scale, sizeof *fit->scale, n) != 0 ||
                   get(in, fit->coef, sizeof *fit->coef, m) != 0 ||
                   get(in, fit->exponent, 1, n * m) != 0
               ? -1
               : 0;
}

static int fit_put(FILE *out, const path_fit *fit) {
    fit_record r = {.fitted = fit->fitted,
                    .n = fit->n,
                    .n_terms = fit->n_terms,
                    .length_rms = fit->length_rms,
                    .length_worst = fit->length_worst,
                    .arm_rms = fit->arm_rms,
                    .arm_worst = fit->arm_worst,
                    .jump = fit->jump};
    size_t n = (size_t)fit->n, m = (size_t)fit->n_terms;
    memcpy(r.why, fit->why, sizeof r.why);
    return put(out, &r, sizeof r, 1) != 0 ||
                   put(out, fit->coordinate, sizeof *fit->coordinate, n) != 0 ||
                   put(out, fit->centre, sizeof *fit->centre, n) != 0 ||
                   put(out, fit->scale, sizeof *fit->scale, n) != 0 ||
                   put(out, fit->coef, sizeof *fit->coef, m) != 0 ||
                   put(out, fit->exponent, 1, n * m) != 0
               ? -1
               : 0;
}

int fits_read(uint64_t digest, int32_t n_coordinates, path_fits *fits) {
    char name[1024];
    uint64_t head[3] = {0};
    if (cache_name(digest, 0, name, sizeof name) != 0) {
        return -1;
    }
    FILE *in = fopen(name, "rb");
    if (in == NULL) {
        return -1;
    }
    int status = get(in, head, sizeof *head, 3) != 0 || head[0] != MAGIC || head[1] != digest ||
                         head[2] != (uint64_t)fits->n
                     ? -1
                     : 0;
    for (int32_t i = 0; i < fits->n && status == 0; i++) {
        status = fit_get(in, &fits->fits[i]);
        if (status == 0 && !fit_is_sound(&fits->fits[i], n_coordinates)) {
            status = -1;
        }
    }
    (void)fclose(in);
    for (int32_t i = 0; i < fits->n && status != 0; i++) {
        fit_clear(&fits->fits[i]);
    }
    return status;
}

int fits_write(uint64_t digest, const path_fits *fits) {
    char name[1024], draft[1064];
    const uint64_t head[3] = {MAGIC, digest, (uint64_t)fits->n};
    if (cache_name(digest, 1, name, sizeof name) != 0) {
        return -1;
    }
    (void)snprintf(draft, sizeof draft, "%s.%ld", name, (long)getpid());
    FILE *out = fopen(draft, "wb");
    if (out == NULL) {
        return -1;
    }
    int status = put(out, head, sizeof *head, 3);
    for (int32_t i = 0; i < fits->n && status == 0; i++) {
        status = fit_put(out, &fits->fits[i]);
    }
    if (fclose(out) != 0 || status != 0 || rename(draft, name) != 0) {
        (void)remove(draft);
        return -1;
    }
    return 0;
}

/* SPDX-License-Identifier: Apache-2.0 */
/* vector.h: small vector algebra. Matrices are row-major [3 x 3]. Spatial vectors are
 * [angular, linear] in ground axes at the ground origin: motions [omega, velocity of the body point
 * at the origin], forces [moment about the origin, force]. */
#ifndef SIMBODY_VECTOR_H
#define SIMBODY_VECTOR_H

#include <math.h>

static inline double dot3(const double *a, const double *b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void cross3(const double *a, const double *b, double *out) {
    double x = a[1] * b[2] - a[2] * b[1];
    double y = a[2] * b[0] - a[0] * b[2];
    double z = a[0] * b[1] - a[1] * b[0];
    out[0] = x;
    out[1] = y;
    out[2] = z;
}

/* out = r x */
static inline void rotate3(const double *r, const double *x, double *out) {
    double a = dot3(r, x), b = dot3(r + 3, x), c = dot3(r + 6, x);
    out[0] = a;
    out[1] = b;
    out[2] = c;
}

/* out = p + r x */
static inline void place3(const double *r, const double *p, const double *x, double *out) {
    double a = p[0] + dot3(r, x), b = p[1] + dot3(r + 3, x), c = p[2] + dot3(r + 6, x);
    out[0] = a;
    out[1] = b;
    out[2] = c;
}

/* out = a b; `out` is neither */
static inline void multiply3(const double *a, const double *b, double *out) {
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            out[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
        }
    }
}

/* out = r m r^T, for symmetric m; `out` is neither */
static inline void congruence3(const double *r, const double *m, double *out) {
    double rm[9];
    multiply3(r, m, rm);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            out[3 * i + j] = dot3(rm + 3 * i, r + 3 * j);
        }
    }
}

static inline void add3(double *a, double scale, const double *b) {
    for (int i = 0; i < 3; i++) {
        a[i] += scale * b[i];
    }
}

/* m += scale a b^T */
static inline void add_outer3(double *m, double scale, const double *a, const double *b) {
    for (int i = 0; i < 3; i++) {
        add3(m + 3 * i, scale * a[i], b);
    }
}

/* out += mass (|d|^2 1 - d d^T): what `mass` at `d` adds to an inertia */
static inline void add_point_inertia(double mass, const double *d, double *out) {
    double square = dot3(d, d);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            out[3 * i + j] += mass * ((i == j ? square : 0.0) - d[i] * d[j]);
        }
    }
}

static inline double trace3(const double *m) {
    return m[0] + m[4] + m[8];
}

/* Largest entry of r r^T - 1; NaN when r has one. */
static inline double off_orthogonal3(const double *r) {
    double worst = 0;
    for (int i = 0; i < 3; i++) {
        for (int j = i; j < 3; j++) {
            double off = fabs(dot3(r + 3 * i, r + 3 * j) - (i == j));
            if (isnan(off)) {
                return off;
            }
            worst = fmax(worst, off);
        }
    }
    return worst;
}

static inline double dot6(const double *a, const double *b) {
    return dot3(a, b) + dot3(a + 3, b + 3);
}

static inline void add6(double *a, double scale, const double *b) {
    for (int i = 0; i < 6; i++) {
        a[i] += scale * b[i];
    }
}

/* Rate of motion vector b when carried along by motion a: a x b. `out` may be neither. */
static inline void cross_motion(const double *a, const double *b, double *out) {
    double other[3];
    cross3(a, b, out);
    cross3(a, b + 3, out + 3);
    cross3(a + 3, b, other);
    for (int i = 0; i < 3; i++) {
        out[3 + i] += other[i];
    }
}

/* Rate of force vector f when carried along by motion a: a x* f. `out` is neither. */
static inline void cross_force(const double *a, const double *f, double *out) {
    double other[3];
    cross3(a, f, out);
    cross3(a + 3, f + 3, other);
    cross3(a, f + 3, out + 3);
    for (int i = 0; i < 3; i++) {
        out[i] += other[i];
    }
}

#endif

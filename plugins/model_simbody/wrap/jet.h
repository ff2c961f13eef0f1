/* SPDX-License-Identifier: Apache-2.0 */
/* jet.h: values with first and second derivatives by up to six variables: both ends of a string, or
 * lengths that one goes over into. `out` may be an argument. */
#ifndef SIMBODY_JET_H
#define SIMBODY_JET_H

#define JET_N 6

typedef struct jet {
    double value, slope[JET_N], curve[JET_N][JET_N];
} jet;

/* f(x), of which value and derivatives at x->value are known. */
void jet_apply(const jet *x, double value, double first, double second, jet *out);
/* a + scale b */
void jet_add(const jet *a, double scale, const jet *b, jet *out);
void jet_multiply(const jet *a, const jet *b, jet *out);
void jet_divide(const jet *a, const jet *b, jet *out);
void jet_root(const jet *a, jet *out);
/* The polynomial that rises from 0 to 1, with two vanishing derivatives at both; of x cut to them.
 */
void jet_rise(const jet *x, jet *out);
/* Coordinate i (0 .. 5) of the ends p and s. */
void jet_coordinate(const double *p, const double *s, int i, jet *out);

#endif

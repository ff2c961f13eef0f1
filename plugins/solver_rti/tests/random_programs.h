/* SPDX-License-Identifier: Apache-2.0 */
/* random_programs.h: staged quadratic programs by chance, of families. */
#ifndef RANDOM_PROGRAMS_H
#define RANDOM_PROGRAMS_H

#include "qp.h"

/* How a family of programs is made. */
typedef struct recipe {
    const char *name;
    int n_programs;
    int max_x, max_u, max_N;
    double spread;      /* curvatures are 10^-spread .. 10^spread */
    double flat;        /* part of the curvatures that are 0 */
    double growth;      /* largest row sum of |A| */
    double bounded;     /* part of the variables with bounds */
    double tight;       /* ... whose bound goes through the known feasible point */
    double first_free;  /* part of the programs without a fixed first state */
    double pinned;      /* part of the later states and controls with equal bounds; where costs are
                         * separable, of first states */
    double activations; /* part of the programs with simple rows */
    int separable;      /* costs of controls and simple states are squares of each alone */
} recipe;

typedef struct program {
    mhe_stage_problem problem;
    uint8_t *pattern;
    int32_t *control_of;
    qp_shape shape;
    qp_stage *stages;
    double *memory, *feasible;
    int n_tied; /* first states, whose costs may hold products */
    qp qp;
    void *qp_memory;
} program;

/* What comes by chance from here on depends on `seed` alone. */
void random_begin(uint64_t seed);
double random_uniform(double lower, double upper);

/* `p` with a feasible point, placed and with its bounds read; given back with program_drop. */
void program_make(program *p, const recipe *r);
void program_drop(program *p);
double program_entry(const program *p, int k, int i, int j); /* of [B A] of stage k */

#endif

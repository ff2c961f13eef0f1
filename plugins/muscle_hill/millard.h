/* SPDX-License-Identifier: Apache-2.0 */
/* millard.h: the four curves of Millard et al. (2013), doi:10.1115/1.4023390, of one muscle. */
#ifndef MUSCLE_HILL_MILLARD_H
#define MUSCLE_HILL_MILLARD_H

#include "bezier.h"

#include <mhe/description.h>

struct hill_millard {
    struct hill_chain active;   /* by n */
    struct hill_chain velocity; /* by s */
    struct hill_chain passive;  /* by n */
    struct hill_chain tendon;   /* by tendon length over slack length */
    double shortest;            /* n below which there is no active force */
};

/* The curves a description states, defaults of OpenSim where it states nothing. MHE_E_INPUT where
 * they make no curve; `name` and `line` are the muscle's. */
mhe_status hill_millard_make(const mhe_millard_curves *stated, const char *name, int32_t line,
                             struct hill_millard *out, mhe_error *err);

#endif

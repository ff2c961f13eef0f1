/* SPDX-License-Identifier: Apache-2.0 */
/* hold.h: strings over a cylinder that only the side asked for holds (hold.c). */
#ifndef SIMBODY_HOLD_H
#define SIMBODY_HOLD_H

#include "jet.h"
#include "wrap.h"

#define FADE_HOLD 0.25 /* k */

/* Bits of `holds`, 0 where nothing fades so. */
#define HOLD_ANY 1
#define HOLD_P 2 /* that end moves, seen from the obstacle */
#define HOLD_S 4

/* Whether less than the whole excess of such a string between p and s counts. */
int hold_fades(const wrap_surface *surface, const double *p, const double *s, int holds,
               double excess);

/* How much of it. */
void hold_jet(const wrap_surface *surface, const double *p, const double *s, int holds,
              const jet *excess, jet *share);

#endif

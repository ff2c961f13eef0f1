/* SPDX-License-Identifier: Apache-2.0 */
/* side.h: which way round a cylinder a string goes that has to pass on one side.
 *
 * OpenSim's rule: the tangent points that lie on that side decide, those of p first. One that
 * crosses over would turn the string about at once. Here, where both ways are nearly as long, each
 * counts by a weight that goes from 0 to 1 while the point is near the border, and the length is
 * the mean of those both ways round: within SIDE_BAND (1 - S(|L+ - L-| / (pi r))) of the border, as
 * a share of the radius r, S as in fade.h. */
#ifndef SIMBODY_SIDE_H
#define SIMBODY_SIDE_H

#include "jet.h"
#include "wrap.h"

#define SIDE_BAND 0.1

/* 1: on the way of growing angles, 0: of falling ones; *between: that a tangent point is near the
 * border, so that both may count. Ends are outside. */
double side_rising(const wrap_surface *surface, const double *p, const double *s, int *between);

/* Share of the way of growing angles, 0 .. 1, with derivatives by the ends; of the lengths both
 * ways. */
void side_rising_jet(const wrap_surface *surface, const double *p, const double *s,
                     const jet *rising, const jet *falling, jet *share);

#endif

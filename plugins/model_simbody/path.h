/* SPDX-License-Identifier: Apache-2.0 */
/* path.h: markers and musculotendon lengths with their derivatives by the coordinates. */
#ifndef SIMBODY_PATH_H
#define SIMBODY_PATH_H

#include "tree.h"

/* Where the links are, and how their joints depend on the coordinates. */
typedef struct path_pose {
    const double *r, *p;  /* placement of the links: [n_joints x 9], [n_joints x 3] */
    const double *slopes; /* [n_joints x 4]: value and three derivatives of each joint's function */
} path_pose;

/* Segments between the same two links are evaluated side by side. */
#define PATH_LANES 4
typedef double path_lanes
    __attribute__((vector_size(PATH_LANES * sizeof(double)), aligned(sizeof(double))));

typedef struct path_bundle {
    int32_t count; /* 1 .. PATH_LANES; the other lanes repeat the first */
    int32_t muscle[PATH_LANES];
    const tree_segment *segment; /* the first: joints are the same for all */
    int32_t link_to, link_from;
    path_lanes to[3], from[3]; /* the ends in their links' frames */
} path_bundle;

/* One joint's part in a bundle. */
typedef struct path_step {
    int32_t coordinate, side;
    path_lanes arm[3];  /* change of the vector along the segment per unit of the coordinate */
    path_lanes bend[3]; /* slope u x z of a pin: turns the steps outside it; 0 of a slider */
    path_lanes turn[3]; /* the part of `arm` across the segment, divided by the length */
} path_step;

/* The tree's segments in bundles, *n of them, to be freed by free(); NULL: no memory. [cold] */
path_bundle *path_bundles(const tree *tree, int32_t *n);

/* position [n_markers x 3] and position_q [3 n_markers x n_q]; NULL: not wanted. */
void path_markers(const tree *tree, const path_pose *pose, double *position, double *position_q);

/* length [n_muscles]; adds to length_q [n_muscles x n_q] and length_qq [n_muscles x n_q x n_q];
 * NULL: not wanted. A segment whose ends coincide has no direction and counts as length 0 with
 * derivatives 0. `steps` is scratch of tree->max_chain. */
void path_lengths(const tree *tree, const path_bundle *bundles, int32_t n_bundles,
                  const path_pose *pose, path_step *steps, double *length, double *length_q,
                  double *length_qq);

#endif

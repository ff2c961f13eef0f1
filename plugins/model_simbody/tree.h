/* SPDX-License-Identifier: Apache-2.0 */
/* tree.h: a description reduced to what moves: links joined by pins and sliders of one freedom.
 *
 * Link i is what joint i moves; -1 is ground. Parents come first. Bodies without free motion
 * between them are one link; joints in sequence have massless links between them. */
#ifndef SIMBODY_TREE_H
#define SIMBODY_TREE_H

#include <mhe/description.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A pin (MHE_MOTION_ROTATION) about z or a slider (MHE_MOTION_TRANSLATION) along x of its frame. */
typedef struct tree_joint {
    int32_t parent; /* link that carries the joint */
    int32_t kind;
    int32_t number;               /* its value is function(coordinate of that number) */
    int32_t coordinate;           /* the free one that it is a function of */
    const mhe_function *function; /* the description's */
    int32_t affine;               /* of the number itself: two coefficients in one piece */
    double r[9], p[3];            /* joint frame in the parent link */
    double mass, com[3];          /* of the moved link, in its own frame */
    double inertia[9];            /* about its centre of mass */
    double points[9];             /* sum m d d^T, its bodies at d from there; part of inertia */
} tree_joint;

/* Where a frame is fixed: to which link (-1: ground), and how. */
typedef struct tree_place {
    int32_t link;
    double r[9], p[3];
} tree_place;

typedef struct tree_point {
    int32_t link;
    double at[3]; /* in the link's frame; ground: in ground */
} tree_point;

/* A straight piece of a muscle path between points of two links. Its length changes with the joints
 * between the links and no others: `n_to` of them carry point `to`, then `n_from` carry point
 * `from`, each row from the common ancestor outwards. */
typedef struct tree_segment {
    int32_t muscle;
    int32_t from, to; /* points */
    int32_t n_to, n_from;
    const int32_t *joints; /* [n_to + n_from] */
} tree_segment;

typedef struct tree {
    int32_t n_q, n_joints, n_bodies, n_markers, n_points, n_segments;
    int32_t n_muscles; /* paths: the muscles' and all others */
    double gravity[3];
    int32_t rounded; /* a joint's frame is a rotation to the digits of a file only */
    int32_t direct;  /* joint i moves as coordinate i does, all of them */
    tree_joint *joints;
    tree_place *bodies;   /* [n_bodies] */
    tree_point *markers;  /* [n_markers] */
    tree_point *points;   /* of the paths */
    double *fixed_length; /* [n_muscles]: of the path's pieces within one link, m */
    tree_segment *segments;
    int32_t max_chain; /* most joints of one segment */
    int32_t *chains;   /* memory of tree_segment.joints */
} tree;

/* Reduces `description`, which must outlive the tree. MHE_E_INPUT: the description is not
 * consistent; MHE_E_MEMORY. [cold] */
mhe_status tree_create(const mhe_description *description, tree **out, mhe_error *err);
void tree_free(tree *tree);

/* What tree_create() checks: references, shapes and numbers of the description before it is
 * reduced; the joints after. MHE_E_INPUT names the part. [cold] */
mhe_status tree_check_description(const mhe_description *description, mhe_error *err);
mhe_status check_dependents(const mhe_description *description, mhe_error *err);
mhe_status check_paths(const mhe_description *description, mhe_error *err);
mhe_status tree_check_joints(const tree *tree, const mhe_description *description, mhe_error *err);
/* 0: nothing beyond the coordinate's joints has mass; the mass matrix is singular. */
int32_t tree_moves_mass(const tree *tree, int32_t coordinate);

#ifdef __cplusplus
}
#endif
#endif

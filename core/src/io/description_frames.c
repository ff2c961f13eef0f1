/* SPDX-License-Identifier: Apache-2.0 */
/* description_frames.c: every frame of a description is a rotation, right-handed. */
#include "io/description_builder.h"

#include <math.h>
#include <string.h>

static double determinant(const double r[9]) {
    return r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) +
           r[2] * (r[3] * r[7] - r[4] * r[6]);
}

/* Model files print rotations with a few digits; more than this is no rounding. */
#define ROTATION_TOLERANCE 1e-3

void mhi_build_check_rotation(mhi_builder *b, const mhi_body_draft *draft, const double r[9]) {
    double worst = 0;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            double dot = r[i] * r[j] + r[3 + i] * r[3 + j] + r[6 + i] * r[6 + j];
            worst = fmax(worst, fabs(dot - (i == j)));
        }
    }
    if (!(worst < ROTATION_TOLERANCE)) {
        mhi_build_fail(b, draft->line,
                       "the frame of body '%s' is not a rotation (R'R is off by %.2g)",
                       draft->body.name, worst);
    }
}

/* r, p := S^before (r, p) S^after, with S = diag(1, 1, -1). */
static void flip_frame(double r[9], double p[3], int32_t before, int32_t after) {
    for (int i = 0; i < 3; i++) {
        r[6 + i] = before ? -r[6 + i] : r[6 + i];
    }
    p[2] = before ? -p[2] : p[2];
    for (int i = 0; i < 3; i++) {
        r[3 * i + 2] = after ? -r[3 * i + 2] : r[3 * i + 2];
    }
}

/* S X S of every motion: a rotation's axis is a pseudovector. */
static void flip_motions(mhi_builder *b, mhe_body *body) {
    mhe_motion *motions = MHI_TAKE(&b->arena, mhe_motion, body->n_motions);
    if (motions == NULL) {
        b->status = mhe_fail(b->err, MHE_E_MEMORY, "out of memory");
        return;
    }
    for (int32_t i = 0; i < body->n_motions; i++) {
        motions[i] = body->motions[i];
        const double sign = motions[i].kind == MHE_MOTION_ROTATION ? -1 : 1;
        motions[i].axis[0] *= sign;
        motions[i].axis[1] *= sign;
        motions[i].axis[2] *= -sign;
    }
    body->motions = motions;
}

static void flip_mass(mhe_body *body) {
    static const int odd[] = {2, 5, 6, 7}; /* xz, yz and their mirror images */
    body->com[2] = -body->com[2];
    for (size_t i = 0; i < sizeof odd / sizeof *odd; i++) {
        body->inertia[odd[i]] = -body->inertia[odd[i]];
    }
}

/* X = J M B with J = (joint_r, joint_p), B = (body_r, body_p) becomes S^before X S^after as
 * (S^before J S^within) (S^within M S^within) (S^within B S^after), each factor right-handed. */
void mhi_build_right_handed(mhi_builder *b, mhe_body *bodies, int32_t n, const int32_t *line,
                            int32_t *mirrored) {
    for (int32_t i = 0; i < n && b->status == MHE_OK; i++) {
        mhe_body *body = &bodies[i];
        const int32_t before = body->parent >= 0 ? mirrored[body->parent] : 0;
        const int32_t joint = determinant(body->joint_r) < 0;
        const int32_t within = before ^ joint, after = within ^ (determinant(body->body_r) < 0);
        mirrored[i] = after;
        flip_frame(body->joint_r, body->joint_p, before, within);
        flip_frame(body->body_r, body->body_p, within, after);
        if (within && body->n_motions > 0) {
            flip_motions(b, body);
        }
        if (after) {
            flip_mass(body);
            mhi_build_warn(b, line[i],
                           "the frame of body '%s' is left-handed: its z axis is flipped",
                           body->name);
        }
    }
}

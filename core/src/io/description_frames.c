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

/* joint := S^before (joint body) S^after, body := 1, with S = diag(1, 1, -1). */
static void flip_frame(mhe_body *body, int32_t before, int32_t after) {
    mhi_transform joint, moved;
    const mhi_transform identity = mhi_transform_identity();
    memcpy(joint.r, body->joint_r, sizeof joint.r);
    memcpy(joint.p, body->joint_p, sizeof joint.p);
    memcpy(moved.r, body->body_r, sizeof moved.r);
    memcpy(moved.p, body->body_p, sizeof moved.p);
    joint = mhi_transform_times(&joint, &moved);
    for (int i = 0; i < 3; i++) {
        joint.r[6 + i] = before ? -joint.r[6 + i] : joint.r[6 + i];
    }
    joint.p[2] = before ? -joint.p[2] : joint.p[2];
    for (int i = 0; i < 3; i++) {
        joint.r[3 * i + 2] = after ? -joint.r[3 * i + 2] : joint.r[3 * i + 2];
    }
    memcpy(body->joint_r, joint.r, sizeof joint.r);
    memcpy(body->joint_p, joint.p, sizeof joint.p);
    memcpy(body->body_r, identity.r, sizeof identity.r);
    memcpy(body->body_p, identity.p, sizeof identity.p);
}

static void flip_mass(mhe_body *body) {
    static const int odd[] = {2, 5, 6, 7}; /* xz, yz and their mirror images */
    body->com[2] = -body->com[2];
    for (size_t i = 0; i < sizeof odd / sizeof *odd; i++) {
        body->inertia[odd[i]] = -body->inertia[odd[i]];
    }
}

void mhi_build_right_handed(mhi_builder *b, mhe_body *bodies, int32_t n, int32_t *mirrored) {
    for (int32_t i = 0; i < n; i++) {
        mhe_body *body = &bodies[i];
        int32_t before = body->parent >= 0 ? mirrored[body->parent] : 0;
        int32_t joint = determinant(body->joint_r) < 0, moved = determinant(body->body_r) < 0;
        mirrored[i] = before ^ joint ^ moved;
        if (!before && !joint && !moved) {
            continue;
        }
        if (body->n_motions > 0) {
            mhi_build_fail(b, 0, "body '%s' moves in a left-handed frame", body->name);
            return;
        }
        flip_frame(body, before, mirrored[i]);
        if (mirrored[i]) {
            flip_mass(body);
            mhi_build_warn(b, 0, "the frame of body '%s' is left-handed: its z axis is flipped",
                           body->name);
        }
    }
}

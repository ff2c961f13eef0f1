/* SPDX-License-Identifier: Apache-2.0 */
/* believe_rig.h: a model and two seconds of sound data, which tests make wrong in one way. */
#ifndef TEST_BELIEVE_RIG_H
#define TEST_BELIEVE_RIG_H

#include "believe/believe.h"
#include "support.h"

#define FRAMES 200
#define MUSCLES 4
#define MARKERS 3

extern const mhe_description believe_model;

typedef struct rig {
    double time[FRAMES], emg[FRAMES * MUSCLES], angles[FRAMES * 2], markers[FRAMES * 3 * MARKERS];
    mhi_recording recording;
    mhi_run run;
    mhi_findings findings;
    mhe_error err;
} rig;

rig *new_rig(void);
void free_rig(rig *r);

/* One finding of this weight with these words. */
void expect(const rig *r, int32_t weight, const char *text);

#endif

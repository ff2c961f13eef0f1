/* SPDX-License-Identifier: Apache-2.0 */
/* rig.h: the shipped arm on an invented motion, to be recorded with noise. */
#ifndef TEST_NOISE_RIG_H
#define TEST_NOISE_RIG_H

#include "noise/noise.h"
#include "use.h"

#define RIG_FRAMES 801
#define RIG_RATE 100.0

typedef struct noise_rig {
    mhe_description *model;
    const mhe_plugin *plugin; /* NULL: not built */
    const void *config;
    mhi_recording *truth; /* q(t), qdot(t), e(t) of rig_q and rig_e */
    mhe_error err;
} noise_rig;

/* Skips the test where the model plugin was not built. */
void rig_open(noise_rig *rig);
void rig_close(noise_rig *rig);

/* The motion: joint angle i, and its rate, and excitation i in [0, 0.6], at a time. */
double rig_q(int32_t i, double time);
double rig_qdot(int32_t i, double time);
double rig_e(int32_t i, double time);

/* Records, and fails the test where that fails. */
void rig_markers(noise_rig *rig, const mhi_noise *noise, mhi_record *out);
void rig_emg(noise_rig *rig, const mhi_noise *noise, mhi_record *out);

/* A map of one entry, in memory of the caller. */
mhe_text_map rig_map(const char *const *key, const char *const *value);

/* |estimate - expected| <= 5 standard errors: by chance one in 1.7 million. */
void assert_within_5(double estimate, double expected, double standard_error, const char *what);

#endif

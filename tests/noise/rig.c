/* SPDX-License-Identifier: Apache-2.0 */
#include "rig.h"

#include "io/model_file.h"

#include <math.h>
#include <stdlib.h>

double rig_q(int32_t i, double time) {
    return 0.2 * i - 0.3 + 0.5 * sin((2 + 0.3 * i) * time + i);
}

double rig_qdot(int32_t i, double time) {
    return 0.5 * (2 + 0.3 * i) * cos((2 + 0.3 * i) * time + i);
}

double rig_e(int32_t i, double time) {
    return 0.3 + 0.2 * sin((3 + 0.1 * i) * time) + 0.1 * cos(7 * time + i);
}

static mhi_recording *new_truth(int32_t n_q, int32_t n_m) {
    mhi_recording *r = calloc(1, sizeof *r);
    assert_non_null(r);
    const size_t q_size = sizeof(double) * (size_t)(RIG_FRAMES * n_q);
    const size_t e_size = sizeof(double) * (size_t)(RIG_FRAMES * n_m);
    r->n_frames = RIG_FRAMES;
    r->rate = RIG_RATE;
    r->time = malloc(sizeof(double) * RIG_FRAMES);
    r->reference = (mhi_reference){
        .present = 1, .q = malloc(q_size), .qdot = malloc(q_size), .excitation = malloc(e_size)};
    assert_non_null(r->time);
    assert_non_null(r->reference.q);
    assert_non_null(r->reference.qdot);
    assert_non_null(r->reference.excitation);
    for (int32_t k = 0; k < RIG_FRAMES; k++) {
        r->time[k] = 0.25 + k / RIG_RATE;
        for (int32_t i = 0; i < n_q; i++) {
            r->reference.q[k * n_q + i] = rig_q(i, r->time[k]);
            r->reference.qdot[k * n_q + i] = rig_qdot(i, r->time[k]);
        }
        for (int32_t i = 0; i < n_m; i++) {
            r->reference.excitation[k * n_m + i] = rig_e(i, r->time[k]);
        }
    }
    return r;
}

void rig_open(noise_rig *rig) {
    *rig = (noise_rig){.plugin = test_plugin("mhe.model.simbody", MHE_MODEL_IFACE)};
    if (rig->plugin == NULL) {
        skip();
    }
    rig->config = test_config(rig->plugin, "");
    if (mhi_model_read(MHE_TEST_SOURCE_DIR "/models/arm19/arm19.osim", &rig->model, &rig->err) !=
        MHE_OK) {
        fail_msg("%s", rig->err.text);
    }
    rig->truth = new_truth(rig->model->n_coordinates, rig->model->n_muscles);
}

void rig_close(noise_rig *rig) {
    mhi_recording_free(rig->truth);
    mhi_description_free(rig->model);
}

void rig_markers(noise_rig *rig, const mhi_noise *noise, mhi_record *out) {
    if (mhi_noise_markers(noise, rig->truth, rig->model, rig->plugin, rig->config, test_host(), out,
                          &rig->err) != MHE_OK) {
        fail_msg("%s", rig->err.text);
    }
}

void rig_emg(noise_rig *rig, const mhi_noise *noise, mhi_record *out) {
    if (mhi_noise_emg(noise, rig->truth, rig->model, out, &rig->err) != MHE_OK) {
        fail_msg("%s", rig->err.text);
    }
}

mhe_text_map rig_map(const char *const *key, const char *const *value) {
    return (mhe_text_map){.keys = key, .values = value, .n = 1};
}

void assert_within_5(double estimate, double expected, double standard_error, const char *what) {
    const double off = (estimate - expected) / standard_error;
    if (!(fabs(off) <= 5)) {
        fail_msg("%s: %g instead of %g, off by %.2f standard errors", what, estimate, expected,
                 off);
    }
}

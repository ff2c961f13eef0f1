/* SPDX-License-Identifier: Apache-2.0 */
/* stream: a program of your own around the estimator: frames in, muscle forces out, one line each.
 *
 *     stream CONFIG.yaml [KEY=VALUE]...
 *
 * The frames are those of the config's recording; an instrument would be read in the place of
 * mhe_recording_frame. */
#include <mhe/estimator.h>
#include <mhe/library.h>
#include <mhe/recording.h>

static mhe_status stream(mhe_recording *recording, mhe_estimator *estimator, mhe_error *err) {
    mhe_recording_info data = {.size = sizeof data};
    mhe_status status = mhe_recording_describe(recording, &data, err);
    for (int32_t k = 0; k < data.n_frames && status == MHE_OK; k++) {
        mhe_frame frame = {.size = sizeof frame};
        mhe_estimate estimate = {.size = sizeof estimate};
        int32_t ready = 0;
        status = mhe_recording_frame(recording, k, &frame, err);
        if (status == MHE_OK) {
            status = mhe_estimator_push(estimator, &frame, &estimate, &ready, err);
        }
        if (status == MHE_OK && ready) {
            printf("%.3f", estimate.time);
            for (int32_t i = 0; i < data.n_muscles; i++) {
                printf(" %.1f", estimate.force[i]);
            }
            printf("\n");
        }
        if (status == MHE_OK) { /* what can be done before the next frame is there */
            status = mhe_estimator_prepare(estimator, err);
        }
    }
    return status;
}

int main(int argc, char **argv) {
    mhe_config *config = NULL;
    mhe_recording *recording = NULL;
    mhe_estimator *estimator = NULL;
    mhe_error err = {0};
    if (argc < 2) {
        fprintf(stderr, "usage: stream CONFIG.yaml [KEY=VALUE]...\n");
        return 2;
    }
    mhe_status status =
        mhe_config_read(argv[1], (const char *const *)(argv + 2), argc - 2, 0, NULL, &config, &err);
    if (status == MHE_OK) {
        status = mhe_recording_open(config, &recording, &err);
    }
    if (status == MHE_OK) {
        status = mhe_estimator_create(config, &estimator, &err);
    }
    if (status == MHE_OK) {
        status = stream(recording, estimator, &err);
    }
    if (status != MHE_OK) {
        fprintf(stderr, "stream (mhe %s): %s\n", mhe_version(), err.text);
    }
    mhe_estimator_close(estimator);
    mhe_recording_close(recording);
    mhe_config_close(config);
    return status == MHE_OK ? 0 : 1;
}

/* SPDX-License-Identifier: Apache-2.0 */
#include "held_out.h"

#include "estimator/create.h"
#include "library/config.h"

#include <math.h>

/* A sum of squares that becomes an RMS. */
typedef struct mean {
    double sum, n;
} mean;

static void add(mean *m, double value) {
    if (!isnan(value)) {
        m->sum += value * value;
        m->n++;
    }
}

static double rms(const mean *m) {
    return m->n > 0 ? sqrt(m->sum / m->n) : NAN;
}

typedef struct means {
    mean marker, emg, q, force, activation;
    int32_t n;
} means;

static void add_truth(const mhi_recording *r, const mhe_estimator_info *info, const mhe_estimate *e,
                      int32_t k, means *m) {
    const int32_t n_q = info->n_q, n_m = info->n_muscles;
    for (int32_t i = 0; i < n_q; i++) {
        add(&m->q, e->q[i] - r->reference.q[(ptrdiff_t)k * n_q + i]);
    }
    for (int32_t i = 0; i < n_m; i++) {
        add(&m->force, e->force[i] - r->reference.force[(ptrdiff_t)k * n_m + i]);
        add(&m->activation, e->activation[i] - r->reference.activation[(ptrdiff_t)k * n_m + i]);
    }
}

static int32_t frame_at(const mhi_recording *r, double time) {
    int32_t k = 0;
    while (k + 1 < r->n_frames && fabs(r->time[k + 1] - time) <= fabs(r->time[k] - time)) {
        k++;
    }
    return k;
}

#define BEGINS 5 /* estimates at the start that do not count, as output.skip_first */

static mhe_status estimate_all(mhe_estimator *e, const mhi_recording *r, means *m, mhe_error *err) {
    mhe_estimator_info info = {.size = sizeof info};
    mhe_status status = mhe_estimator_describe(e, &info);
    for (int32_t k = 0; k < r->n_frames && status == MHE_OK; k++) {
        const mhe_frame frame = mhi_recording_frame(r, info.n_markers, info.n_muscles, k);
        mhe_estimate estimate = {.size = sizeof estimate};
        int32_t ready = 0;
        status = mhe_estimator_push(e, &frame, &estimate, &ready, err);
        if (status == MHE_OK && ready && m->n++ >= BEGINS) {
            add(&m->marker, estimate.marker_rms);
            add(&m->emg, estimate.emg_rms);
            if (r->reference.present) {
                add_truth(r, &info, &estimate, frame_at(r, estimate.time), m);
            }
        }
    }
    return status;
}

/* What a recording gives cause to say was said when it was read to be learned from. */
static void say_nothing(const mhe_host *host, int32_t level, const char *text) {
    (void)host, (void)level, (void)text;
}

mhe_status held_out_measure(const char *config, const char *const *set, int32_t n_set,
                            const mhi_plan_recording *recording, const mhe_host *host,
                            held_out *out, mhe_error *err) {
    mhe_config *read = NULL;
    mhi_recording *r = NULL;
    mhe_estimator *e = NULL;
    const mhe_description *model = NULL;
    means m = {0};
    mhe_host quiet = *host;
    quiet.log = say_nothing;
    mhe_status status = mhe_config_read(config, set, n_set, 0, &quiet, &read, err);
    if (status == MHE_OK) {
        mhi_plan_take(recording, read->run);
        status = mhi_config_model(read, &model, err);
    }
    if (status == MHE_OK) {
        status = mhi_recording_read(read->run, model, &quiet, &r, err);
    }
    if (status == MHE_OK) {
        status = mhi_estimator_create_on(read->run, model, &quiet, &e, err);
    }
    if (status == MHE_OK) {
        status = estimate_all(e, r, &m, err);
    }
    *out =
        (held_out){rms(&m.marker), rms(&m.emg), rms(&m.q), rms(&m.force), rms(&m.activation), m.n};
    mhe_estimator_close(e);
    mhi_recording_free(r);
    mhe_config_close(read);
    return status;
}

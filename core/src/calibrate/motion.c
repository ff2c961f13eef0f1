/* SPDX-License-Identifier: Apache-2.0 */
#include "calibrate/calibrate.h"
#include "estimator/create.h"

#include <math.h>
#include <string.h>

mhe_status mhi_motion_read(mhi_calibration *c, int32_t i, mhe_error *err) {
    mhi_motion *m = &c->motions[i];
    m->plan = &c->plan.recordings[i];
    m->run = *c->run;
    m->first = -1;
    m->force = -1;
    mhi_plan_take(m->plan, &m->run);
    mhe_status status = mhi_recording_read(&m->run, c->model, c->host, &m->recording, err);
    if (status == MHE_OK) {
        m->n_nodes = (m->recording->n_frames - 1) / c->run->horizon.ratio + 1;
    }
    return status;
}

/* Node of an estimate's time. */
static int32_t node_of(const mhi_motion *m, double time, int32_t ratio) {
    const double *t = m->recording->time;
    const double interval =
        ratio * (t[m->recording->n_frames - 1] - t[0]) / (m->recording->n_frames - 1);
    const double k = floor((time - t[0]) / interval + 0.5);
    return k < 0 ? 0 : k > m->n_nodes - 1 ? m->n_nodes - 1 : (int32_t)k;
}

static void keep(const mhi_motion *m, const mhe_estimate *e, int32_t ratio, int32_t n_states,
                 int32_t n_x, int32_t n_u, double *x, double *u) {
    const int32_t k = node_of(m, e->time, ratio);
    memcpy(x + (ptrdiff_t)k * n_x, e->states, sizeof *x * (size_t)n_states);
    if (k < m->n_nodes - 1) {
        memcpy(u + (ptrdiff_t)k * n_u, e->controls, sizeof *u * (size_t)n_u);
    }
}

mhe_status mhi_motion_guess(mhi_calibration *c, int32_t i, int32_t n_states, int32_t n_x,
                            int32_t n_u, double *x, double *u, mhe_error *err) {
    mhi_motion *m = &c->motions[i];
    mhe_estimator *e = NULL;
    int32_t found = 0;
    mhi_run run = *c->start;
    mhi_plan_take(m->plan, &run);
    mhe_status status = mhi_estimator_create_on(&run, c->model, c->host, &e, err);
    if (status == MHE_OK) { /* first activations are held where it finds them */
        mhi_estimator_set_seen(e);
    }
    for (int32_t k = 0; k < m->recording->n_frames && status == MHE_OK; k++) {
        const mhe_frame frame =
            mhi_recording_frame(m->recording, c->model->n_markers, c->model->n_muscles, k);
        mhe_estimate estimate = {.size = sizeof estimate};
        int32_t ready = 0;
        status = mhe_estimator_push(e, &frame, &estimate, &ready, err);
        if (status != MHE_OK || !ready) {
            continue;
        }
        for (int32_t j = 0; j <= c->run->horizon.window && status == MHE_OK; j++) {
            if (j > 0) { /* those behind it, which later frames overwrite */
                status = mhi_estimator_node(e, j, &estimate, err);
            }
            if (status == MHE_OK) {
                keep(m, &estimate, c->run->horizon.ratio, n_states, n_x, n_u, x, u);
            }
        }
        found++;
    }
    mhe_estimator_close(e);
    if (status == MHE_OK && found == 0) {
        status =
            mhe_fail(err, MHE_E_INPUT, "%s: no motion could be estimated from it to start with",
                     m->run.data.markers != NULL ? m->run.data.markers : m->run.data.emg);
    }
    return status;
}

/* EMG that the controls of node k are compared with. */
static void emg_target(const mhi_calibration *c, const mhi_motion *m, int32_t k, double *target) {
    const mhi_recording *r = m->recording;
    const int32_t ratio = c->run->horizon.ratio, n_m = c->model->n_muscles;
    const int32_t mean = c->run->emg.sample == MHI_EMG_SAMPLE_MEAN;
    const int32_t first = k * ratio - c->run->data.emg_delay;
    for (int32_t i = 0; i < n_m; i++) {
        double sum = 0;
        int32_t n = 0;
        for (int32_t f = first; f < first + (mean ? ratio : 1) && f < r->n_frames; f++) {
            const double value = r->emg[(ptrdiff_t)(f < 0 ? 0 : f) * n_m + i];
            n += !isnan(value);
            sum += isnan(value) ? 0 : value;
        }
        target[i] = n > 0 ? sum / n : NAN;
    }
}

/* EMG of a muscle between frames: Catmull and Rom's cubic through the four about it. */
static double emg_between(const mhi_recording *r, int32_t n_m, int32_t muscle, double frame,
                          double *slope) {
    const double floored = floor(frame), s = frame - floored;
    double e[4];
    for (int32_t i = 0; i < 4; i++) {
        const double at = fmin(fmax(floored + i - 1, 0), r->n_frames - 1);
        e[i] = r->emg[(ptrdiff_t)at * n_m + muscle];
    }
    const double c1 = 0.5 * (e[2] - e[0]), c2 = e[0] - 2.5 * e[1] + 2 * e[2] - 0.5 * e[3],
                 c3 = 0.5 * (e[3] - e[0]) + 1.5 * (e[1] - e[2]);
    *slope = c1 + s * (2 * c2 + 3 * s * c3);
    return e[1] + s * (c1 + s * (c2 + s * c3));
}

double mhi_motion_emg_before(const mhi_calibration *c, const mhi_motion *m, int32_t k,
                             int32_t muscle, double delay, double *slope) {
    const mhi_recording *r = m->recording;
    const int32_t ratio = c->run->horizon.ratio;
    const int32_t n = c->run->emg.sample == MHI_EMG_SAMPLE_MEAN ? ratio : 1;
    double sum = 0;
    *slope = 0;
    if (r->emg == NULL) {
        return NAN;
    }
    for (int32_t i = 0; i < n; i++) {
        double by = 0;
        sum += emg_between(r, c->model->n_muscles, muscle,
                           k * ratio - c->run->data.emg_delay + i - delay * r->rate, &by);
        *slope -= by * r->rate / n;
    }
    return sum / n;
}

static void copy(double *target, const double *values, int32_t frame, int32_t width) {
    if (target != NULL && values != NULL) {
        memcpy(target, values + (ptrdiff_t)frame * width, sizeof *target * (size_t)width);
    }
}

void mhi_motion_targets(const mhi_calibration *c, int32_t i, mhi_ocp *ocp) {
    const mhi_motion *m = &c->motions[i];
    const mhi_recording *r = m->recording;
    for (int32_t k = 0; k < m->n_nodes; k++) {
        const int32_t node = m->first + k, frame = k * c->run->horizon.ratio;
        double *emg = mhi_ocp_target(ocp, mhi_ocp_control(ocp), node);
        mhi_ocp_set_time(ocp, node, r->time[frame]);
        copy(mhi_ocp_target(ocp, MHI_SIGNAL_MARKERS, node), r->markers, frame,
             3 * c->model->n_markers);
        copy(mhi_ocp_target(ocp, MHI_SIGNAL_Q, node), r->angles, frame, r->n_q);
        if (emg != NULL && r->emg != NULL && k < m->n_nodes - 1) {
            emg_target(c, m, k, emg);
        }
    }
}

/* SPDX-License-Identifier: Apache-2.0 */
/* loads.c: loads from outside, each in its own recording alone.
 *
 * All recordings are one problem on one system, so that the system has the loads of every recording
 * as a force of its own, whose inputs are 0 at the nodes of all others. */
#include "calibrate/calibrate.h"

#include <math.h>
#include <string.h>

mhe_status mhi_motion_forces(mhi_calibration *c, mhi_force_setup **forces, int32_t *n,
                             mhe_error *err) {
    const mhi_use_list *common = &c->run->forces;
    mhi_force_setup *list = MHI_TAKE(&c->arena, mhi_force_setup, common->n + c->plan.n_recordings);
    if (list == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    *n = 0;
    for (; *n < common->n; (*n)++) {
        list[*n] = (mhi_force_setup){common->uses[*n].plugin, common->uses[*n].config, NULL};
    }
    for (int32_t i = 0; i < c->plan.n_recordings; i++) {
        const mhi_use *loads = &c->plan.recordings[i].loads;
        if (loads->plugin != NULL) {
            const char *name = mhi_arena_format(&c->arena, "external_loads_%d", (int)i);
            c->motions[i].force = *n;
            list[(*n)++] = (mhi_force_setup){loads->plugin, loads->config, name};
        }
    }
    *forces = list;
    return c->arena.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
}

#define SLACK 2e-3 /* s: times are printed with so many digits */

/* Held-out ones, too: that they are short is told before the search, not behind it. */
static mhe_status check_times(const mhi_motion *m, const mhi_system *system, mhe_error *err) {
    const mhi_recording *r = m->recording;
    const double begin = r->time[0], end = r->time[r->n_frames - 1];
    double first = begin, last = end;
    const mhe_status status = mhi_system_known(system, m->force, &first, &last, err);
    return status == MHE_OK && (first > begin + SLACK || last < end - SLACK)
               ? mhe_fail(err, MHE_E_INPUT,
                          "%s: loads are known from %g to %g s, the motion of %s is from %g to %g "
                          "s",
                          m->plan->external_loads, first, last,
                          m->plan->markers != NULL ? m->plan->markers : m->plan->emg, begin, end)
               : status;
}

/* The node's time has set the inputs of all forces; those of other recordings do not act. */
static void silence_others(const mhi_calibration *c, const mhi_system *system, int32_t motion,
                           double *w) {
    for (int32_t i = 0; i < c->plan.n_recordings; i++) {
        int32_t first, n;
        mhi_system_inputs_of(system, c->motions[i].force, &first, &n);
        if (i != motion) {
            memset(w + first, 0, sizeof *w * (size_t)n);
        }
    }
}

/* Whose interval begins with node k; -1: it leads to the next motion, and nothing moves there. */
static int32_t motion_at(const mhi_calibration *c, int32_t k) {
    for (int32_t i = 0; i < c->plan.n_recordings; i++) {
        const mhi_motion *m = &c->motions[i];
        if (m->first >= 0 && k >= m->first && k < m->first + m->n_nodes - 1) {
            return i;
        }
    }
    return -1;
}

mhe_status mhi_motion_loads(const mhi_calibration *c, const mhi_system *system, mhi_ocp *ocp,
                            mhe_error *err) {
    const int32_t n_w = mhi_system_face(system)->n_w;
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < c->plan.n_recordings && status == MHE_OK; i++) {
        status = check_times(&c->motions[i], system, err);
    }
    for (int32_t k = 0; k <= c->n_intervals && n_w > 0 && status == MHE_OK; k++) {
        double *w = mhi_ocp_input(ocp, k);
        const int32_t motion = motion_at(c, k);
        if (motion < 0) {
            memset(w, 0, sizeof *w * (size_t)n_w);
        } else {
            silence_others(c, system, motion, w);
        }
        for (int32_t i = 0; i < n_w && status == MHE_OK; i++) {
            if (isnan(w[i])) {
                status = mhe_fail(err, MHE_E_INPUT,
                                  "%s: what acts from outside is not known at all of its times",
                                  c->motions[motion].run.data.markers);
            }
        }
    }
    return status;
}

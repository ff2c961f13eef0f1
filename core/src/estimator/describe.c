/* SPDX-License-Identifier: Apache-2.0 */
/* describe.c: what the estimator tells of itself. */
#include "base/need.h"
#include "estimator/estimator_private.h"

#include <string.h>

mhe_status mhe_estimator_describe(const mhe_estimator *e, mhe_estimator_info *info) {
    if (MHI_NEED(NULL, {"estimator", e}, {"info", info}) != MHE_OK) {
        return MHE_E_ARGUMENT;
    }
    const mhe_problem *p = mhi_ocp_problem(e->ocp);
    const mhe_estimator_info ours = {.size = sizeof ours,
                                     .formulation = p->formulation,
                                     .n_q = e->n_q,
                                     .n_muscles = e->n_m,
                                     .n_markers = e->n_k,
                                     .n_residual_torques = p->n_residual_torques,
                                     .window = e->window.n,
                                     .ratio = e->run->horizon.ratio,
                                     .interval = p->interval,
                                     .coordinate_names = p->coordinate_names,
                                     .muscle_names = p->muscle_names,
                                     .marker_names = p->marker_names,
                                     .solver = e->run->solver.plugin->id,
                                     .config_name = e->run->name,
                                     .node = e->node,
                                     .delay = (e->window.n - e->node) * p->interval,
                                     .n_channels = e->channels.n,
                                     .channel_size = sizeof(mhe_channel),
                                     .channels = e->channels.faces,
                                     .phase = e->phase,
                                     .layout = p->layout,
                                     .n_joints =
                                         e->reactions != NULL ? e->description->n_bodies : 0,
                                     .joint_names = e->joint_names,
                                     .uncertainty = e->bands != NULL};
    return mhi_give(__func__, info, &ours, NULL);
}

int32_t mhe_estimator_find_channel(const mhe_estimator *e, const char *name) {
    for (int32_t i = 0; e != NULL && name != NULL && i < e->channels.n; i++) {
        if (strcmp(e->channels.rows[i].face.name, name) == 0) {
            return i;
        }
    }
    return -1;
}

mhe_status mhe_estimator_counts(const mhe_estimator *e, int32_t channel,
                                mhe_channel_counts *counts) {
    if (MHI_NEED(NULL, {"estimator", e}, {"counts", counts}) != MHE_OK || channel < 0 ||
        channel >= e->channels.n) {
        return MHE_E_ARGUMENT;
    }
    return mhi_give(__func__, counts, &e->channels.rows[channel].counts, NULL);
}

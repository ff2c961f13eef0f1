/* SPDX-License-Identifier: Apache-2.0 */
/* joint_signals.c: joint reactions among a problem's signals. They are made when a cost asks for
 * one by its joint's name, as most problems have none and each costs accelerations of a node. */
#include "ocp/ocp_private.h"

#include <stdlib.h>
#include <string.h>

/* Names of the entries, "<signal>.x" .. "<signal>.z"; NULL: out of memory. */
static const char **name_axes(mhi_ocp *ocp, const char *signal) {
    const char **names = MHI_TAKE(&ocp->arena, const char *, 3);
    for (int32_t k = 0; k < 3 && names != NULL; k++) {
        names[k] = mhi_arena_format(&ocp->arena, "%s.%c", signal, "xyz"[k]);
        names = names[k] == NULL ? NULL : names;
    }
    return names;
}

int32_t mhi_ocp_open_joint(mhi_ocp *ocp, const char *name) {
    mhi_joint_force *joint = NULL;
    mhe_error *why = &ocp->no_signal;
    mhe_status status =
        mhi_joint_force_create(ocp->system, name + strlen(MHI_REACTION), &joint, why);
    const char *own = mhi_arena_text(&ocp->arena, name);
    const char **axes = name_axes(ocp, name);
    if (status == MHE_OK && (own == NULL || axes == NULL)) {
        status = mhe_fail(why, MHE_E_MEMORY, "out of memory");
    }
    const int32_t row = status == MHE_OK ? mhi_signals_open_reaction(&ocp->signals, own) : -1;
    if (status == MHE_OK && row < 0) {
        status = mhe_fail(why, MHE_E_UNSUPPORTED, "signal '%s': costs may read %d joints", name,
                          MHI_MAX_REACTIONS);
    }
    if (status != MHE_OK) {
        mhi_joint_force_free(joint);
        return -1;
    }
    ocp->joints[row - MHI_SIGNAL_REACTION] = joint;
    ocp->entry_names[row] = axes;
    return row;
}

void mhi_ocp_close_joints(mhi_ocp *ocp) {
    for (int32_t i = 0; i < MHI_MAX_REACTIONS; i++) {
        mhi_joint_force_free(ocp->joints[i]);
    }
}

mhe_status mhi_ocp_enter_joints(const mhi_ocp *ocp, mhi_ocp_worker *w, mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < MHI_MAX_REACTIONS && status == MHE_OK; i++) {
        if (ocp->joints[i] != NULL) {
            status = mhi_joint_force_context_create(ocp->joints[i], &w->joints[i], err);
        }
    }
    return status;
}

void mhi_ocp_leave_joints(mhi_ocp_worker *w) {
    for (int32_t i = 0; i < MHI_MAX_REACTIONS; i++) {
        mhi_joint_force_context_free(w->joints[i]);
    }
}

mhe_status mhi_ocp_measure(const mhi_ocp *ocp, mhi_ocp_worker *w, int32_t k, uint32_t wanted,
                           const double *x, const double *u, int32_t derivatives, mhe_error *err) {
    const mhi_signals *signals = &ocp->signals;
    mhe_status status = mhi_signals_evaluate(signals, ocp->system, w->system, wanted, x, u, w->y,
                                             derivatives ? w->jacobian : NULL, err);
    for (int32_t i = MHI_SIGNAL_REACTION; i <= MHI_LAST_REACTION && status == MHE_OK; i++) {
        const mhi_signal *s = &signals->signal[i];
        if ((wanted >> i & 1) == 0 || (s->reads_u && u == NULL)) { /* NaN already */
            continue;
        }
        mhe_system_point at;
        mhi_system_point(ocp->system, x, u, mhi_ocp_inputs_at(ocp, k), &at);
        status = mhi_joint_force_evaluate(
            w->joints[i - MHI_SIGNAL_REACTION], w->system, &at, s->n_columns,
            signals->signal[MHI_SIGNAL_ACTIVATION].column, w->y + s->offset,
            derivatives ? w->jacobian + s->jacobian : NULL, err);
    }
    return status;
}

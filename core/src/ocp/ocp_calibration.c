/* SPDX-License-Identifier: Apache-2.0 */
/* ocp_calibration.c: a problem that estimates parameters, with motions in a row: what it cannot
 * have, and what it needs beside the others. */
#include "ocp/ocp_private.h"

/* A cost that calibration has no place for. */
static mhe_status refuse(const mhi_ocp *ocp, int32_t term, const char *why, mhe_error *err) {
    const mhe_status status =
        mhe_fail(err, MHE_E_CONFIG,
                 "costs.%d: %s reads %s. Leave it out here, and add it to the config that is left "
                 "behind",
                 term, ocp->terms[term].id, why);
    if (err != NULL) {
        err->part = MHE_PART_COST;
        err->entry = term;
    }
    return status;
}

static int32_t reads_before(const mhi_term *t) {
    int32_t before = 0;
    for (int32_t s = 0; s < t->n_signals; s++) {
        before |= t->layout.at[s] == MHE_AT_PREVIOUS;
    }
    return before;
}

mhe_status mhi_ocp_set_calibration(mhi_ocp *ocp, const mhi_ocp_setup *setup, mhe_error *err) {
    const uint32_t reactions = ((1u << MHI_MAX_REACTIONS) - 1) << MHI_SIGNAL_REACTION;
    mhe_status status = MHE_OK;
    ocp->node_weight = setup->node_weight;
    if (setup->parameters == NULL && setup->junctions == NULL) {
        return MHE_OK;
    }
    ocp->face.low_rank = NULL;
    for (int32_t i = 0; i < ocp->n_terms; i++) {
        if (reads_before(&ocp->terms[i])) {
            return refuse(ocp, i, "the node before: calibration has no place for that", err);
        }
    }
    ocp->prior_at = MHI_TAKE(&ocp->arena, const double *, setup->n_intervals + 1);
    if (ocp->prior_at == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    if (setup->junctions != NULL) {
        status =
            mhi_junction_create(setup->system, setup->junctions, &ocp->arena, &ocp->junction, err);
    }
    if (status != MHE_OK || setup->parameters == NULL) {
        return status;
    }
    for (int32_t i = 0; i < ocp->n_terms; i++) {
        if ((mhi_term_reads(&ocp->terms[i]) & reactions) != 0) {
            return refuse(ocp, i,
                          "joint reactions: calibration has no derivatives of those by parameters",
                          err);
        }
    }
    ocp->estimated = setup->estimated;
    status =
        mhi_parameters_create(setup->parameters, setup->system, &ocp->arena, &ocp->parameters, err);
    ocp->face.n_p = setup->parameters->n;
    ocp->face.p_lower = ocp->parameters.lower;
    ocp->face.p_upper = ocp->parameters.upper;
    ocp->face.set_parameters = mhi_ocp_set_parameters;
    return status;
}

mhe_status mhi_ocp_take_parameter_room(mhi_ocp *ocp, mhi_ocp_worker *w, mhe_error *err) {
    const int32_t n_p = ocp->face.n_p, n_z = ocp->n_x + ocp->face.n_u;
    w->P = MHI_TAKE(&ocp->arena, double, ocp->n_x *mhi_system_face(ocp->system)->n_p);
    w->room = MHI_TAKE(&ocp->arena, double, mhi_parameters_room(ocp->system, n_p));
    w->by = MHI_TAKE(&ocp->arena, mhi_by_parameter, ocp->signals.n_y);
    w->by_p = (mhi_term_by_p){.by = w->by,
                              .n_p = n_p,
                              .row = MHI_TAKE(&ocp->arena, double, n_p),
                              .gradient = MHI_TAKE(&ocp->arena, double, n_p),
                              .pz = MHI_TAKE(&ocp->arena, double, n_p *n_z),
                              .pp = MHI_TAKE(&ocp->arena, double, n_p *n_p)};
    return !w->P || !w->room || !w->by || !w->by_p.row || !w->by_p.gradient || !w->by_p.pz ||
                   !w->by_p.pp
               ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
               : MHE_OK;
}

/* SPDX-License-Identifier: Apache-2.0 */
#include "ocp/ocp_private.h"

#include "base/values.h"

#include <stdlib.h>
#include <string.h>

int32_t mhi_ocp_find_signal(const mhe_problem *problem, const char *name, int32_t *n_y,
                            const char **unit) {
    const mhi_ocp *ocp = problem->data;
    for (int32_t i = 0; i < MHI_N_SIGNALS; i++) {
        const mhi_signal *s = &ocp->signals.signal[i];
        if (s->n_y > 0 && strcmp(s->name, name) == 0) {
            if (n_y != NULL) {
                *n_y = s->n_y;
            }
            if (unit != NULL) {
                *unit = s->unit;
            }
            return i;
        }
    }
    const size_t prefix = strlen(MHI_REACTION);
    const int32_t row =
        strncmp(name, MHI_REACTION, prefix) == 0 ? mhi_ocp_open_joint(problem->data, name) : -1;
    return row < 0 ? -1 : mhi_ocp_find_signal(problem, name, n_y, unit);
}

const char *const *mhi_ocp_entry_names(const mhe_problem *problem, int32_t signal) {
    const mhi_ocp *ocp = problem->data;
    return signal < 0 || signal >= MHI_N_SIGNALS || ocp->signals.signal[signal].n_y == 0
               ? NULL
               : ocp->entry_names[signal];
}

/* What the integrator keeps of interval k. */
static double *interval_memory(const mhi_ocp *ocp, int32_t k) {
    const int32_t place = (ocp->first_memory + k) % ocp->face.n_intervals;
    return ocp->memory_size == 0 ? NULL : ocp->memory + (ptrdiff_t)place * ocp->memory_size;
}

double *mhi_ocp_inputs_at(const mhi_ocp *ocp, int32_t k) {
    return ocp->n_w == 0 ? NULL : ocp->inputs + (ptrdiff_t)k * ocp->n_w;
}

double *mhi_ocp_input(mhi_ocp *ocp, int32_t k) {
    return mhi_ocp_inputs_at(ocp, k);
}

mhe_status mhi_ocp_evaluate(const mhe_stage_problem *problem, int32_t worker_index, int32_t k,
                            const double *x, const double *u, const mhe_stage_values *out,
                            mhe_error *err) {
    const mhi_ocp *ocp = problem->data;
    mhi_ocp_worker *w = &ocp->workers[worker_index];
    if (ocp->stop != NULL && atomic_load_explicit(ocp->stop, memory_order_relaxed)) {
        return mhe_fail(err, MHE_E_INTERRUPTED, "interrupted");
    }
    if (!mhi_all_finite(x, problem->n_x) || (u != NULL && !mhi_all_finite(u, problem->n_u))) {
        return mhe_fail(err, MHE_RETRY, "a state or control is not finite");
    }
    mhe_status status = MHE_OK;
    w->linearised = 0;
    const int32_t joins = u != NULL && ocp->junction.place != NULL && ocp->junction.place[k] >= 0;
    if (out->cost != NULL || mhi_ocp_wants_derivatives(out)) {
        status = (joins ? mhi_ocp_junction_cost : mhi_ocp_cost)(ocp, w, k, x, u, out, err);
    }
    if (status == MHE_OK && joins && out->x_next != NULL) {
        mhi_junction_step(&ocp->junction, ocp->junction.place[k], x, u, ocp->face.n_p, out);
    } else if (status == MHE_OK && u != NULL && out->x_next != NULL) {
        status = mhi_ocp_step(ocp, w, k, interval_memory(ocp, k), x, u, out, err);
    }
    mhi_system_context_settle(w->system);
    return status;
}

void mhi_ocp_free(mhi_ocp *ocp) {
    if (ocp == NULL) {
        return;
    }
    for (int32_t i = 0; i < ocp->n_workers_created; i++) {
        if (ocp->workers[i].integrator != NULL) {
            ocp->integrator->context_destroy(ocp->workers[i].integrator);
        }
        mhi_ocp_leave_joints(&ocp->workers[i]);
        mhi_system_context_free(ocp->workers[i].system);
    }
    if (ocp->integrator_self != NULL) {
        ocp->integrator->destroy(ocp->integrator_self);
    }
    for (int32_t i = 0; i < ocp->n_terms_created; i++) {
        mhi_term_destroy(&ocp->terms[i]);
    }
    mhi_ocp_close_joints(ocp);
    mhi_arena_free(&ocp->arena);
    free(ocp);
}

const mhe_stage_problem *mhi_ocp_face(const mhi_ocp *ocp) {
    return &ocp->face;
}

const mhe_problem *mhi_ocp_problem(const mhi_ocp *ocp) {
    return &ocp->problem;
}

const mhi_signals *mhi_ocp_signals(const mhi_ocp *ocp) {
    return &ocp->signals;
}

int32_t mhi_ocp_control(const mhi_ocp *ocp) {
    return ocp->problem.formulation == MHE_FORMULATION_EXCITATION ? MHI_SIGNAL_EXCITATION
                                                                  : MHI_SIGNAL_ACTIVATION;
}

int32_t mhi_ocp_reads(const mhi_ocp *ocp, int32_t signal) {
    return (ocp->wanted >> signal & 1) != 0;
}

const mhi_system *mhi_ocp_system(const mhi_ocp *ocp) {
    return ocp->system;
}

double *mhi_ocp_x_lower(mhi_ocp *ocp, int32_t k) {
    return ocp->x_lower + (ptrdiff_t)k * ocp->face.n_x;
}

double *mhi_ocp_x_upper(mhi_ocp *ocp, int32_t k) {
    return ocp->x_upper + (ptrdiff_t)k * ocp->face.n_x;
}

double *mhi_ocp_u_lower(mhi_ocp *ocp, int32_t k) {
    return ocp->u_lower + (ptrdiff_t)k * ocp->face.n_u;
}

double *mhi_ocp_u_upper(mhi_ocp *ocp, int32_t k) {
    return ocp->u_upper + (ptrdiff_t)k * ocp->face.n_u;
}

double *mhi_ocp_target(mhi_ocp *ocp, int32_t signal, int32_t k) {
    const mhi_signal *s = &ocp->signals.signal[signal];
    return s->n_y == 0 ? NULL : ocp->targets + (ptrdiff_t)k * ocp->signals.n_y + s->offset;
}

double *mhi_ocp_target_spread(mhi_ocp *ocp, int32_t signal) {
    const mhi_signal *s = &ocp->signals.signal[signal];
    return s->n_y == 0 ? NULL : ocp->spread + s->offset;
}

const mhi_parameters *mhi_ocp_parameters(const mhi_ocp *ocp) {
    return ocp->estimated == NULL ? NULL : &ocp->parameters;
}

void mhi_ocp_set_parameter_bounds(mhi_ocp *ocp, const double *lower, const double *upper) {
    const size_t bytes = sizeof(double) * (size_t)ocp->face.n_p;
    memcpy(ocp->parameters.lower, lower, bytes);
    memcpy(ocp->parameters.upper, upper, bytes);
}

mhe_status mhi_ocp_set_parameters(const mhe_stage_problem *problem, const double *p,
                                  mhe_error *err) {
    mhi_ocp *ocp = problem->data;
    return mhi_parameters_set(&ocp->parameters, ocp->estimated, p, err);
}

void mhi_ocp_set_interval(mhi_ocp *ocp, double interval) {
    ocp->interval = interval;
    ocp->problem.interval = interval;
}

void mhi_ocp_shift(mhi_ocp *ocp) {
    const int32_t last = ocp->face.n_intervals - 1;
    ocp->first_memory = (ocp->first_memory + 1) % ocp->face.n_intervals;
    if (ocp->n_w > 0) {
        memmove(ocp->inputs, ocp->inputs + ocp->n_w,
                sizeof(double) * (size_t)(ocp->face.n_intervals * ocp->n_w));
    }
    if (last > 0 && ocp->memory_size > 0) {
        memcpy(interval_memory(ocp, last), interval_memory(ocp, last - 1),
               sizeof(double) * (size_t)ocp->memory_size);
    }
}

void mhi_ocp_forget(mhi_ocp *ocp) {
    const ptrdiff_t n = (ptrdiff_t)ocp->face.n_intervals * ocp->memory_size;
    for (ptrdiff_t i = 0; i < n; i++) {
        ocp->memory[i] = 0;
    }
}

void mhi_ocp_set_prior(mhi_ocp *ocp, const double *centre, const double *weight) {
    memcpy(ocp->prior_centre, centre, sizeof(double) * (size_t)ocp->face.n_x);
    memcpy(ocp->prior_weight, weight, sizeof(double) * (size_t)ocp->face.n_x);
}

void mhi_ocp_set_prior_at(mhi_ocp *ocp, int32_t k, const double *centre, const double *weight) {
    if (k == 0 || ocp->prior_at == NULL) {
        mhi_ocp_set_prior(ocp, centre, weight);
    } else {
        ocp->prior_at[k] = centre;
        memcpy(ocp->prior_weight, weight, sizeof(double) * (size_t)ocp->n_x);
    }
}

void mhi_ocp_set_stop(mhi_ocp *ocp, const atomic_int *stop) {
    ocp->stop = stop;
}

/* From files: of the middle of the interval that begins at node k. The last node's are those with
 * which a prediction goes on. */
void mhi_ocp_set_time(mhi_ocp *ocp, int32_t k, double time) {
    ocp->times[k] = time;
    if (ocp->n_w > 0) {
        (void)mhi_system_inputs(ocp->system, time + 0.5 * ocp->interval, mhi_ocp_inputs_at(ocp, k),
                                NULL);
    }
}

mhe_status mhi_ocp_predict(mhi_ocp *ocp, int32_t k, const double *x, const double *u,
                           double *x_next, mhe_error *err) {
    const mhe_stage_values out = {.size = sizeof out, .x_next = x_next};
    ocp->workers[0].linearised = 0;
    const mhe_status status = mhi_ocp_step(ocp, &ocp->workers[0], k, NULL, x, u, &out, err);
    mhi_system_context_settle(ocp->workers[0].system);
    return status;
}

mhe_status mhi_ocp_extend(mhi_ocp *ocp, int32_t k, const double *x, const double *u, double *x_next,
                          mhe_error *err) {
    mhi_ocp_worker *w = &ocp->workers[0];
    if (ocp->memory_size == 0) {
        return mhi_ocp_predict(ocp, k, x, u, x_next, err);
    }
    mhe_status status = mhi_ocp_linearise(ocp, k, x, u, x_next, w->A, w->B, err);
    w->linearised = 0;
    return status == MHE_OK ? mhi_ocp_carry_on(ocp, w, k, x, u, x_next, err) : status;
}

int32_t mhi_ocp_n_x(const mhi_ocp *ocp) {
    return ocp->n_x;
}

mhe_status mhi_ocp_linearise(mhi_ocp *ocp, int32_t k, const double *x, const double *u,
                             double *x_next, double *A, double *B, mhe_error *err) {
    const mhe_step_derivatives d = {sizeof d, A, B, NULL};
    const mhe_status status =
        ocp->integrator->step(ocp->workers[0].integrator, x, u, mhi_ocp_inputs_at(ocp, k),
                              ocp->interval, interval_memory(ocp, k), x_next, &d, err);
    mhi_system_context_settle(ocp->workers[0].system);
    return status;
}

mhe_status mhi_ocp_expand(mhi_ocp *ocp, int32_t k, const double *x, const double *u,
                          const mhe_stage_values *out, mhe_error *err) {
    mhi_ocp_worker *w = &ocp->workers[0];
    mhi_system_context_settle(w->system);
    mhi_system_context_set_work(w->system, NULL);
    w->linearised = 0;
    mhe_status status = mhi_ocp_cost(ocp, w, k, x, u, out, err);
    if (status == MHE_OK) {
        status = mhi_ocp_step(ocp, w, k, NULL, x, u, out, err);
    }
    mhi_system_context_set_work(w->system, &ocp->work);
    return status;
}

mhi_work *mhi_ocp_work(mhi_ocp *ocp) {
    return &ocp->work;
}

mhi_system_context *mhi_ocp_context(mhi_ocp *ocp) {
    return ocp->workers[0].system;
}

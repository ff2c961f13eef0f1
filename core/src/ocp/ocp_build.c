/* SPDX-License-Identifier: Apache-2.0 */
/* ocp_build.c: makes the problem: sizes, structure, plugins' instances, memory of each thread. */
#include "ocp/loop_cost.h"
#include "ocp/ocp_private.h"
#include "plugin/instance.h"

#include <math.h>
#include <stdlib.h>

/* A diagonal entry moves with itself and its muscle's control; all others, which see positions,
 * with everything. */
static void dynamics_pattern(const mhe_system *f, int32_t n_x, uint8_t *A, uint8_t *B) {
    for (int32_t b = 0; b < f->layout->n_blocks; b++) {
        const mhe_block *block = mhe_layout_at(f->layout, b);
        const int diagonal = block->structure == MHE_STRUCTURE_DIAGONAL;
        for (int32_t k = 0; k < block->count && block->role == MHE_ROLE_STATE; k++) {
            const int32_t i = block->first + k;
            for (int32_t j = 0; j < f->n_x; j++) {
                A[i * n_x + j] = !diagonal || i == j;
            }
            for (int32_t j = 0; j < f->n_u; j++) {
                B[i * f->n_u + j] = !diagonal || block->owner[k] == j;
            }
        }
    }
}

/* Activation-driven with rigid tendons, all controls act on the skeleton alone: however many
 * muscles there are, B has no more than its states' rows. */
static void tell_low_rank(mhi_ocp *ocp, const mhe_system *f) {
    ocp->low_rank = (mhe_low_rank){.size = sizeof ocp->low_rank, .n_directions = f->first_d};
    const int32_t holds = f->n_d == 0 && f->n_z == 0 && ocp->signals.n_carried == 0;
    ocp->face.low_rank = holds && f->n_u > f->first_d ? &ocp->low_rank : NULL;
}

/* What is carried moves with all that its signal depends on. */
static void carried_pattern(const mhi_ocp *ocp, uint8_t *A, uint8_t *B) {
    const int32_t n_x = ocp->face.n_x, n_u = ocp->face.n_u;
    for (int32_t i = 0; i < MHI_N_SIGNALS; i++) {
        const mhi_signal *s = &ocp->signals.signal[i];
        const mhi_signal *m = &ocp->signals.signal[MHI_N_SIGNALS + i];
        for (int32_t j = 0; j < m->n_y; j++) {
            const int32_t row = m->column - n_u + j;
            const int32_t first = s->n_columns == 0 ? s->column + j : s->column;
            const int32_t end = first + (s->n_columns == 0 ? 1 : s->n_columns);
            for (int32_t c = first; c < end; c++) {
                *(c < ocp->n_x ? A + row * n_x + c : B + row * n_u + c - ocp->n_x) = 1;
            }
        }
    }
}

/* Place in the solver's [x; m; u] of column i of z = [x; u; m]. */
static int32_t solver_column(const mhi_ocp *ocp, int32_t i) {
    const int32_t n_x = ocp->n_x, n_u = ocp->face.n_u;
    return i < n_x ? i : i < n_x + n_u ? i + ocp->signals.n_carried : i - n_u;
}

static mhe_status set_patterns(mhi_ocp *ocp, const mhe_system *f, mhe_error *err) {
    const int32_t n_x = ocp->face.n_x, n_u = f->n_u, n_z = n_x + n_u;
    uint8_t *A = MHI_TAKE(&ocp->arena, uint8_t, n_x * n_x);
    uint8_t *B = MHI_TAKE(&ocp->arena, uint8_t, n_x * n_u);
    uint8_t *xx = MHI_TAKE(&ocp->arena, uint8_t, n_x * n_x);
    uint8_t *ux = MHI_TAKE(&ocp->arena, uint8_t, n_u * n_x);
    uint8_t *uu = MHI_TAKE(&ocp->arena, uint8_t, n_u * n_u);
    uint8_t *zz = MHI_TAKE(&ocp->arena, uint8_t, n_z * n_z);
    uint8_t *columns = MHI_TAKE(&ocp->arena, uint8_t, n_z);
    ocp->reach = MHI_TAKE(&ocp->arena, int32_t, n_z);
    if (!A || !B || !xx || !ux || !uu || !zz || !columns || !ocp->reach) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    dynamics_pattern(f, n_x, A, B);
    carried_pattern(ocp, A, B);
    for (int32_t i = 0; i < n_u && ocp->junction.place != NULL; i++) {
        zz[(ocp->n_x + i) * n_z + ocp->n_x + i] = 1;
    }
    for (int32_t i = 0; i < ocp->n_x; i++) {
        zz[i * n_z + i] = 1; /* the prior */
    }
    for (int32_t i = 0; i < ocp->n_terms; i++) {
        mhi_term_pattern(&ocp->terms[i], &ocp->signals, n_z, columns, zz);
    }
    for (int32_t a = 0; a < n_z; a++) {
        while (ocp->reach[a] < a && !zz[a * n_z + ocp->reach[a]]) {
            ocp->reach[a]++;
        }
        for (int32_t b = 0; b < n_z; b++) {
            const uint8_t set = zz[a * n_z + b];
            const int32_t i = solver_column(ocp, a), j = solver_column(ocp, b);
            if (i < n_x && j < n_x) {
                xx[i * n_x + j] = set;
            } else if (i >= n_x && j < n_x) {
                ux[(i - n_x) * n_x + j] = set;
            } else if (i >= n_x) {
                uu[(i - n_x) * n_u + (j - n_x)] = set;
            }
        }
    }
    ocp->face.A_pattern = A;
    ocp->face.B_pattern = B;
    ocp->face.xx_pattern = xx;
    ocp->face.ux_pattern = ux;
    ocp->face.uu_pattern = uu;
    return MHE_OK;
}

static double *filled(mhi_arena *arena, ptrdiff_t n, double value) {
    double *array = MHI_TAKE(arena, double, n);
    for (ptrdiff_t i = 0; i < n && array != NULL; i++) {
        array[i] = value;
    }
    return array;
}

static mhe_status create_worker(mhi_ocp *ocp, mhi_ocp_worker *w, mhe_error *err) {
    const int32_t n_z = ocp->face.n_x + ocp->face.n_u;
    w->terms = MHI_TAKE(&ocp->arena, mhi_term_workspace, ocp->n_terms);
    w->y = MHI_TAKE(&ocp->arena, double, ocp->signals.n_y + ocp->signals.n_carried);
    w->A = MHI_TAKE(&ocp->arena, double, ocp->n_x * ocp->n_x);
    w->B = MHI_TAKE(&ocp->arena, double, ocp->n_x * ocp->face.n_u);
    w->jacobian = MHI_TAKE(&ocp->arena, double, ocp->signals.n_jacobian);
    w->gradient = MHI_TAKE(&ocp->arena, double, n_z);
    w->hessian = MHI_TAKE(&ocp->arena, double, n_z *n_z);
    if (!w->terms || !w->y || !w->A || !w->B || !w->jacobian || !w->gradient || !w->hessian) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = mhi_system_context_create(ocp->system, &w->system, err);
    if (status == MHE_OK) {
        mhi_system_context_set_work(w->system, &ocp->work);
    }
    if (status == MHE_OK) {
        status =
            ocp->integrator->context_create(ocp->integrator_self, w->system, &w->integrator, err);
    }
    if (status == MHE_OK) {
        status = mhi_ocp_enter_joints(ocp, w, err);
    }
    if (status == MHE_OK && ocp->estimated != NULL) {
        status = mhi_ocp_take_parameter_room(ocp, w, err);
    }
    for (int32_t i = 0; i < ocp->n_terms && status == MHE_OK; i++) {
        status = mhi_term_workspace_create(&ocp->terms[i], n_z, &ocp->arena, &w->terms[i], err);
    }
    return status;
}

static mhe_status name_list(mhi_arena *arena, int32_t n, const char *const **names, mhe_error *err,
                            const char *(*name)(const mhe_description *, int32_t),
                            const mhe_description *d) {
    const char **list = MHI_TAKE(arena, const char *, n);
    if (list == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < n; i++) {
        list[i] = name(d, i);
    }
    *names = list;
    return MHE_OK;
}

static const char *coordinate_name(const mhe_description *d, int32_t i) {
    return d->coordinates[i].name;
}

static const char *muscle_name(const mhe_description *d, int32_t i) {
    return d->muscles[i].name;
}

static const char *marker_name(const mhe_description *d, int32_t i) {
    return d->markers[i].name;
}

/* "AC.x" .. "AC.z" of a point, "AC.rx" .. "AC.rz" of a weld's turning too; NULL: out of memory. */
static const char **name_loops(mhi_ocp *ocp) {
    const mhe_description *d = mhi_system_description(ocp->system);
    const char **names = MHI_TAKE(&ocp->arena, const char *, mhe_loop_rows(d));
    for (int32_t i = 0, row = 0; i < d->n_loops; i++) {
        const int32_t rows = d->loops[i].kind == MHE_LOOP_WELD ? 6 : 3;
        for (int32_t k = 0; k < rows && names != NULL; k++, row++) {
            names[row] = mhi_arena_format(&ocp->arena, "%s.%s%c", d->loops[i].name,
                                          k < 3 ? "" : "r", "xyz"[k % 3]);
            names = names[row] == NULL ? NULL : names;
        }
    }
    return names;
}

/* Of every signal; a marker has three. */
static mhe_status name_entries(mhi_ocp *ocp, mhe_error *err) {
    const mhe_problem *p = &ocp->problem;
    const char **axes = MHI_TAKE(&ocp->arena, const char *, 3 * p->n_markers);
    for (int32_t i = 0; i < 3 * p->n_markers && axes != NULL; i++) {
        axes[i] = mhi_arena_format(&ocp->arena, "%s.%c", p->marker_names[i / 3], "xyz"[i % 3]);
        axes = axes[i] == NULL ? NULL : axes;
    }
    const char **loops = name_loops(ocp);
    const mhe_block *drive = mhe_layout_find(p->layout, MHE_ROLE_CONTROL, "actuator");
    for (int32_t i = 0; i < MHI_N_SIGNALS; i++) {
        const int32_t of_muscles = i == MHI_SIGNAL_ACTIVATION || i == MHI_SIGNAL_EXCITATION ||
                                   i == MHI_SIGNAL_MUSCLE_FORCE;
        const int32_t of_loops = i == MHI_SIGNAL_LOOP_GAP || i == MHI_SIGNAL_LOOP_RATE;
        ocp->entry_names[i] = i == MHI_SIGNAL_MARKERS ? axes
                              : of_muscles            ? p->muscle_names
                              : of_loops              ? loops
                              : i == MHI_SIGNAL_ACTUATOR
                                  ? (drive != NULL ? drive->entry_names : NULL)
                                  : p->coordinate_names;
    }
    return axes == NULL || loops == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
}

static mhe_status set_problem(mhi_ocp *ocp, const mhi_ocp_setup *setup, mhe_error *err) {
    const mhe_description *d = mhi_system_description(setup->system);
    mhe_problem *p = &ocp->problem;
    *p = (mhe_problem){.size = sizeof *p,
                       .formulation = mhi_system_formulation(setup->system),
                       .n_q = d->n_coordinates,
                       .n_muscles = d->n_muscles,
                       .n_markers = d->n_markers,
                       .n_residual_torques = ocp->signals.signal[MHI_SIGNAL_RESIDUAL_TORQUE].n_y,
                       .n_intervals = setup->n_intervals,
                       .interval = setup->interval,
                       .data = ocp,
                       .find_signal = mhi_ocp_find_signal,
                       .layout = mhi_system_face(setup->system)->layout,
                       .entry_names = mhi_ocp_entry_names};
    mhe_status status =
        name_list(&ocp->arena, p->n_q, &p->coordinate_names, err, coordinate_name, d);
    if (status == MHE_OK) {
        status = name_list(&ocp->arena, p->n_muscles, &p->muscle_names, err, muscle_name, d);
    }
    if (status == MHE_OK) {
        status = name_list(&ocp->arena, p->n_markers, &p->marker_names, err, marker_name, d);
    }
    return status == MHE_OK ? name_entries(ocp, err) : status;
}

static mhe_status take_arrays(mhi_ocp *ocp, mhe_error *err) {
    const ptrdiff_t n = ocp->face.n_intervals;
    ocp->x_lower = filled(&ocp->arena, (n + 1) * ocp->face.n_x, -INFINITY);
    ocp->x_upper = filled(&ocp->arena, (n + 1) * ocp->face.n_x, INFINITY);
    ocp->u_lower = filled(&ocp->arena, n * ocp->face.n_u, -INFINITY);
    ocp->u_upper = filled(&ocp->arena, n * ocp->face.n_u, INFINITY);
    ocp->targets = filled(&ocp->arena, (n + 1) * ocp->signals.n_y, NAN);
    ocp->spread = filled(&ocp->arena, ocp->signals.n_y, NAN);
    ocp->times = filled(&ocp->arena, n + 1, 0);
    ocp->inputs = filled(&ocp->arena, (n + 1) * ocp->n_w, NAN);
    ocp->prior_centre = filled(&ocp->arena, ocp->face.n_x, 0);
    ocp->prior_weight = filled(&ocp->arena, ocp->face.n_x, 0);
    for (int32_t k = 0; k <= n && ocp->times != NULL && ocp->inputs != NULL; k++) {
        mhi_ocp_set_time(ocp, k, k * ocp->interval);
    }
    ocp->face.x_lower = ocp->x_lower;
    ocp->face.x_upper = ocp->x_upper;
    ocp->face.u_lower = ocp->u_lower;
    ocp->face.u_upper = ocp->u_upper;
    ocp->workers = MHI_TAKE(&ocp->arena, mhi_ocp_worker, ocp->face.n_workers);
    if (!ocp->x_lower || !ocp->x_upper || !ocp->u_lower || !ocp->u_upper || !ocp->targets ||
        !ocp->spread || !ocp->times || !ocp->inputs || !ocp->prior_centre || !ocp->prior_weight ||
        !ocp->workers) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    return MHE_OK;
}

/* Needs the integrator's instance. */
static mhe_status take_memory(mhi_ocp *ocp, mhe_error *err) {
    if (ocp->integrator->memory_size != NULL) {
        ocp->memory_size = ocp->integrator->memory_size(ocp->integrator_self);
        ocp->memory =
            MHI_TAKE(&ocp->arena, double, (ptrdiff_t)ocp->face.n_intervals * ocp->memory_size);
    }
    return ocp->memory_size > 0 && ocp->memory == NULL
               ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
               : MHE_OK;
}

/* Term i, whose refusal begins with "costs.<i>: ". */
static mhe_status create_term(mhi_ocp *ocp, const mhi_ocp_setup *setup, int32_t i, mhe_error *err) {
    const int32_t own = i >= setup->n_terms; /* of the loops */
    const mhi_term_setup *term = own ? &mhi_loop_terms[i - setup->n_terms] : &setup->terms[i];
    mhe_status status = mhi_term_create(setup->host, term, &ocp->problem, &ocp->signals,
                                        setup->tasks, &ocp->arena, &ocp->terms[i], err);
    ocp->n_terms_created = i + 1;
    if (status != MHE_OK && err != NULL && !own) {
        const mhe_error why = ocp->no_signal.text[0] != '\0' ? ocp->no_signal : *err;
        err->part = MHE_PART_COST;
        err->entry = i;
        return mhe_fail(err, status, "costs.%d: %.700s", i, why.text);
    }
    return status;
}

static mhe_status build(mhi_ocp *ocp, const mhi_ocp_setup *setup, mhe_error *err) {
    mhi_work_begin(&ocp->work, 0, 0);
    const mhe_system *f = mhi_system_face(setup->system);
    mhi_signals_layout(setup->system, &ocp->signals);
    ocp->terms = MHI_TAKE(&ocp->arena, mhi_term, ocp->n_terms);
    mhe_status status = ocp->terms == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    if (status == MHE_OK) {
        status = set_problem(ocp, setup, err);
    }
    for (int32_t i = 0; i < ocp->n_terms && status == MHE_OK; i++) {
        status = create_term(ocp, setup, i, err);
        if (status == MHE_OK) {
            ocp->wanted |= mhi_term_reads(&ocp->terms[i]);
        }
    }
    for (int32_t i = 0; i < MHI_N_SIGNALS; i++) {
        ocp->carried |= ocp->signals.signal[MHI_N_SIGNALS + i].n_y > 0 ? 1u << i : 0;
    }
    ocp->face.n_x = f->n_x + ocp->signals.n_carried; /* as the terms ask */
    tell_low_rank(ocp, f);
    if (status == MHE_OK) {
        status = mhi_ocp_set_calibration(ocp, setup, err);
    }
    if (status == MHE_OK) {
        status = take_arrays(ocp, err);
    }
    if (status == MHE_OK) {
        status = set_patterns(ocp, f, err);
    }
    if (status == MHE_OK) {
        status = mhi_integrator_create(setup->integrator, setup->host, f, setup->integrator_config,
                                       &ocp->integrator_self, err);
    }
    if (status == MHE_OK) {
        status = take_memory(ocp, err);
    }
    if (status == MHE_OK) {
        mhi_ocp_set_begins(ocp, 1);
    }
    for (int32_t i = 0; i < ocp->face.n_workers && status == MHE_OK; i++) {
        ocp->n_workers_created = i + 1;
        status = create_worker(ocp, &ocp->workers[i], err);
    }
    return status;
}

mhe_status mhi_ocp_create(const mhi_ocp_setup *setup, mhi_ocp **result, mhe_error *err) {
    *result = NULL;
    mhi_ocp *ocp = calloc(1, sizeof *ocp);
    if (ocp == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    const mhe_system *f = mhi_system_face(setup->system);
    ocp->face = (mhe_stage_problem){.size = sizeof ocp->face,
                                    .n_intervals = setup->n_intervals,
                                    .n_x = f->n_x,
                                    .n_u = f->n_u,
                                    .n_workers = setup->n_workers,
                                    .data = ocp,
                                    .evaluate = mhi_ocp_evaluate};
    ocp->system = setup->system;
    ocp->n_x = f->n_x;
    ocp->n_w = f->n_w;
    ocp->integrator = setup->integrator->ops;
    ocp->n_terms = setup->n_terms + (mhi_system_loop_rows(setup->system) > 0 ? MHI_LOOP_TERMS : 0);
    ocp->interval = setup->interval;
    mhe_status status = build(ocp, setup, err);
    if (status != MHE_OK) {
        mhi_ocp_free(ocp);
        return status;
    }
    *result = ocp;
    return MHE_OK;
}

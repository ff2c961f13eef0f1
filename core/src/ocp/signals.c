/* SPDX-License-Identifier: Apache-2.0 */
#include "ocp/signals.h"

#include <math.h>
#include <string.h>

#define USUAL_FORCE 500.0 /* N */
#define USUAL_MOMENT 20.0 /* N m */
#define AXES 3

void mhi_signals_layout(const mhi_system *system, mhi_signals *signals) {
    const mhe_system *f = mhi_system_face(system);
    const int32_t n_k = mhi_system_description(system)->n_markers;
    const mhe_layout *l = f->layout;
    const mhe_block *activation = mhe_layout_find(l, MHE_ROLE_STATE, "activation");
    const mhe_block *residual = mhe_layout_find(l, MHE_ROLE_CONTROL, "residual_torque");
    const int32_t n_q = f->n_q, n_m = f->n_m, driven = activation != NULL; /* by excitations */
    const int32_t qdot = mhe_layout_find(l, MHE_ROLE_STATE, "qdot")->first;
    const int32_t all = driven ? f->n_x : f->n_x + n_m; /* what muscles see is contiguous in z */
    const int32_t n_r = residual != NULL ? residual->count : 0;
    const int32_t n_c = mhi_system_loop_rows(system);
    const mhe_block *drive = mhe_layout_find(l, MHE_ROLE_CONTROL, "actuator");
    const int32_t n_act = drive != NULL ? drive->count : 0;
    *signals = (mhi_signals){
        .signal = {
            [MHI_SIGNAL_MARKERS] = {"markers", "m", 3 * n_k, 0, 0, n_q, 0, 0, 1},
            [MHI_SIGNAL_Q] = {"q", "rad", n_q, 0, 0, 0, 0, 0, 1},
            [MHI_SIGNAL_QDOT] = {"qdot", "rad/s", n_q, 0, qdot, 0, 0, 0, 1},
            [MHI_SIGNAL_ACTIVATION] = {"activation", "1", n_m, 0,
                                       driven ? activation->first : f->n_x, 0, !driven, 0, 1},
            [MHI_SIGNAL_EXCITATION] = {"excitation", "1", driven ? n_m : 0, 0, f->n_x, 0, 1, 0, 1},
            [MHI_SIGNAL_MUSCLE_FORCE] = {"muscle_force", "N", n_m, 0, 0, all, !driven, 0, 1},
            [MHI_SIGNAL_JOINT_MOMENT] = {"joint_moment", "N m", n_q, 0, 0, all, !driven, 0, 1},
            [MHI_SIGNAL_RESIDUAL_TORQUE] = {"residual_torque", "N m", n_r, 0,
                                            f->n_x + (n_r > 0 ? residual->first : 0), 0, 1, 0, 1},
            [MHI_SIGNAL_LOOP_GAP] = {"loop_gap", "m", n_c, 0, 0, n_q, 0, 0, 1},
            [MHI_SIGNAL_ACTUATOR] = {"actuator", "1", n_act, 0,
                                     f->n_x + (n_act > 0 ? drive->first : 0), 0, 1, 0, 1},
            [MHI_SIGNAL_LOOP_RATE] = {"loop_rate", "m/s", n_c, 0, 0, f->first_d, 0, 0, 1},
        }};
    for (int32_t i = 0; i < MHI_N_SIGNALS; i++) {
        mhi_signal *s = &signals->signal[i];
        int32_t n_y = s->n_y;
        if (i >= MHI_SIGNAL_REACTION && i <= MHI_LAST_REACTION) {
            s->unit = "N";
            s->reads_u = !driven || f->n_r > 0; /* these move the whole body */
            s->n_columns = s->reads_u ? f->n_x + f->n_u : f->n_x;
            n_y = AXES;
        }
        s->offset = signals->n_y;
        s->scale = 1;
        s->jacobian = signals->n_jacobian;
        signals->n_y += n_y;
        signals->n_jacobian += n_y * s->n_columns;
    }
    signals->n_z = f->n_x + f->n_u;
}

int32_t mhi_signals_open_reaction(mhi_signals *signals, const char *name) {
    for (int32_t i = MHI_SIGNAL_REACTION; i <= MHI_LAST_REACTION; i++) {
        mhi_signal *s = &signals->signal[i];
        if (s->n_y > 0 && strcmp(s->name, name) != 0) {
            continue;
        }
        s->name = name;
        s->n_y = AXES;
        return i;
    }
    return -1;
}

int32_t mhi_signals_carry(mhi_signals *signals, int32_t i) {
    const mhi_signal *of = &signals->signal[i];
    mhi_signal *s = &signals->signal[MHI_N_SIGNALS + i];
    if (s->n_y == 0) {
        *s =
            (mhi_signal){.name = of->name,
                         .unit = of->unit,
                         .n_y = of->n_y,
                         .offset = signals->n_y + signals->n_carried,
                         .column = signals->n_z + signals->n_carried,
                         .scale = i == MHI_SIGNAL_MUSCLE_FORCE                         ? USUAL_FORCE
                                  : i >= MHI_SIGNAL_REACTION && i <= MHI_LAST_REACTION ? USUAL_FORCE
                                  : i == MHI_SIGNAL_JOINT_MOMENT    ? USUAL_MOMENT
                                  : i == MHI_SIGNAL_RESIDUAL_TORQUE ? USUAL_MOMENT
                                                                    : 1};
        signals->n_carried += s->n_y;
    }
    return MHI_N_SIGNALS + i;
}

static void fill_nan(double *y, int32_t n) {
    for (int32_t i = 0; i < n; i++) {
        y[i] = NAN;
    }
}

/* Derivatives of muscle m's force by its states, times `factor`, into their columns of a row; the
 * activations' are those from `a` on. */
static void add_states(const mhe_system *f, const mhi_muscle_state *s, int32_t m, double factor,
                       int32_t a, double *row) {
    if (f->n_a > 0) {
        row[a + m] = factor * s->force_a[m];
    }
    for (int32_t k = 0; k < f->n_k && f->z_of[m * f->n_k + k] >= 0; k++) {
        const int32_t i = f->z_of[m * f->n_k + k];
        row[f->n_x - f->n_z + i] = factor * s->force_z[i];
    }
}

/* dF/d[q v ..] = [F_q F_v diag(F_a) ..] and d moment/d[q v ..] = [moment_q moment_v -L_q^T
 * diag(F_a)
 * ..]; `width` columns, the activations' from `a` on. */
static void muscle_blocks(const mhe_system *f, const mhi_muscle_state *s, int32_t width, int32_t a,
                          double *force, double *moment) {
    const int32_t n_q = f->n_q, n_m = f->n_m;
    const size_t row = sizeof(double) * (size_t)n_q;
    if (force != NULL) {
        memset(force, 0, sizeof(double) * (size_t)(n_m * width));
        for (int32_t m = 0; m < n_m; m++) {
            memcpy(force + m * width, s->force_q + m * n_q, row);
            memcpy(force + m * width + n_q, s->force_v + m * n_q, row);
            add_states(f, s, m, 1, a, force + m * width);
        }
    }
    if (moment != NULL) {
        for (int32_t i = 0; i < n_q; i++) {
            memcpy(moment + i * width, s->moment_q + i * n_q, row);
            memcpy(moment + i * width + n_q, s->moment_v + i * n_q, row);
            for (int32_t m = 0; m < n_m; m++) {
                add_states(f, s, m, -s->length_q[m * n_q + i], a, moment + i * width);
            }
        }
    }
}

static mhe_status muscle_signals(const mhi_signals *signals, const mhi_system *system,
                                 mhi_system_context *context, uint32_t wanted, const double *x,
                                 const double *u, double *y, double *jacobian, mhe_error *err) {
    const mhi_signal *force = &signals->signal[MHI_SIGNAL_MUSCLE_FORCE];
    const mhi_signal *moment = &signals->signal[MHI_SIGNAL_JOINT_MOMENT];
    const int want_force = (wanted >> MHI_SIGNAL_MUSCLE_FORCE & 1) != 0;
    const int want_moment = (wanted >> MHI_SIGNAL_JOINT_MOMENT & 1) != 0;
    mhi_muscle_state state;
    mhe_system_point at;
    mhi_system_point(system, x, u, NULL, &at);
    mhe_status status = mhi_system_muscles(context, &at, jacobian != NULL, &state, err);
    if (status != MHE_OK) {
        return status;
    }
    if (want_force) {
        memcpy(y + force->offset, state.force, sizeof(double) * (size_t)force->n_y);
    }
    if (want_moment) {
        memcpy(y + moment->offset, state.moment, sizeof(double) * (size_t)moment->n_y);
    }
    if (jacobian != NULL) {
        muscle_blocks(mhi_system_face(system), &state, force->n_columns,
                      signals->signal[MHI_SIGNAL_ACTIVATION].column,
                      want_force ? jacobian + force->jacobian : NULL,
                      want_moment ? jacobian + moment->jacobian : NULL);
    }
    return MHE_OK;
}

static mhe_status loop_signals(const mhi_signals *signals, const mhi_system *system,
                               mhi_system_context *context, const double *x, double *y,
                               double *jacobian, mhe_error *err) {
    const mhi_signal *gap = &signals->signal[MHI_SIGNAL_LOOP_GAP];
    const mhi_signal *rate = &signals->signal[MHI_SIGNAL_LOOP_RATE];
    const int32_t n_q = mhi_system_face(system)->n_q, n_c = gap->n_y;
    mhi_loop_state at;
    mhe_status status = mhi_system_gaps(context, x, x + n_q, jacobian != NULL, &at, err);
    if (status != MHE_OK) {
        return status;
    }
    memcpy(y + gap->offset, at.gap, sizeof(double) * (size_t)n_c);
    memcpy(y + rate->offset, at.rate, sizeof(double) * (size_t)n_c);
    if (jacobian != NULL) {
        const size_t row = sizeof(double) * (size_t)n_q;
        memcpy(jacobian + gap->jacobian, at.gap_q, row * (size_t)n_c);
        for (int32_t i = 0; i < n_c; i++) {
            double *to = jacobian + rate->jacobian + 2 * i * n_q;
            memcpy(to, at.rate_q + i * n_q, row);
            memcpy(to + n_q, at.rate_v + i * n_q, row);
        }
    }
    return MHE_OK;
}

mhe_status mhi_signals_evaluate(const mhi_signals *signals, const mhi_system *system,
                                mhi_system_context *context, uint32_t wanted, const double *x,
                                const double *u, double *y, double *jacobian, mhe_error *err) {
    const mhe_system *f = mhi_system_face(system);
    for (int32_t i = 0; i < MHI_N_SIGNALS; i++) {
        const mhi_signal *s = &signals->signal[i];
        if ((wanted >> i & 1) == 0) {
            continue;
        }
        if (s->reads_u && u == NULL) {
            fill_nan(y + s->offset, s->n_y);
        } else if (s->n_columns == 0) {
            const double *from = s->column < f->n_x ? x + s->column : u + (s->column - f->n_x);
            memcpy(y + s->offset, from, sizeof(double) * (size_t)s->n_y);
        }
    }
    mhe_status status = MHE_OK;
    if (wanted >> MHI_SIGNAL_MARKERS & 1) {
        const mhi_signal *s = &signals->signal[MHI_SIGNAL_MARKERS];
        status = mhi_system_markers(context, x, y + s->offset,
                                    jacobian == NULL ? NULL : jacobian + s->jacobian, err);
    }
    const uint32_t of_loops = 1u << MHI_SIGNAL_LOOP_GAP | 1u << MHI_SIGNAL_LOOP_RATE;
    if (status == MHE_OK && (wanted & of_loops) != 0) {
        status = loop_signals(signals, system, context, x, y, jacobian, err);
    }
    const uint32_t of_muscles = 1u << MHI_SIGNAL_MUSCLE_FORCE | 1u << MHI_SIGNAL_JOINT_MOMENT;
    const int known = u != NULL || !signals->signal[MHI_SIGNAL_MUSCLE_FORCE].reads_u;
    if (status == MHE_OK && (wanted & of_muscles) != 0 && known) {
        status = muscle_signals(signals, system, context, wanted, x, u, y, jacobian, err);
    }
    return status;
}

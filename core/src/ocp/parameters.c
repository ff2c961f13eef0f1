/* SPDX-License-Identifier: Apache-2.0 */
#include "ocp/parameters.h"

#include "model/anatomy.h"

#include <math.h>
#include <string.h>

static const int32_t *copied(mhi_arena *arena, const int32_t *from, int32_t n) {
    int32_t *to = MHI_TAKE(arena, int32_t, n);
    for (int32_t i = 0; i < n && to != NULL; i++) {
        to[i] = from == NULL ? -1 : from[i];
    }
    return to;
}

mhe_status mhi_parameters_create(const mhi_parameters_setup *setup, const mhi_system *system,
                                 mhi_arena *arena, mhi_parameters *s, mhe_error *err) {
    const mhe_system *f = mhi_system_face(system);
    const mhe_description *d = mhi_system_description(system);
    mhi_parameter *list = MHI_TAKE(arena, mhi_parameter, setup->n);
    *s = (mhi_parameters){.setup = {.n = setup->n,
                                    .list = list,
                                    .of_system = copied(arena, setup->of_system, f->n_p),
                                    .gain = copied(arena, setup->gain, f->n_m),
                                    .shape = copied(arena, setup->shape, f->n_m),
                                    .marker = copied(arena, setup->marker, d->n_markers),
                                    .delay = copied(arena, setup->delay, f->n_m),
                                    .emg_before = setup->emg_before,
                                    .emg = setup->emg},
                          .control = mhi_system_formulation(system) == MHE_FORMULATION_EXCITATION
                                         ? MHI_SIGNAL_EXCITATION
                                         : MHI_SIGNAL_ACTIVATION,
                          .p = MHI_TAKE(arena, double, setup->n),
                          .model = MHI_TAKE(arena, double, f->n_p),
                          .system = MHI_TAKE(arena, double, f->n_p),
                          .lower = MHI_TAKE(arena, double, setup->n),
                          .upper = MHI_TAKE(arena, double, setup->n)};
    if (list == NULL || !s->setup.of_system || !s->setup.gain || !s->setup.shape ||
        !s->setup.marker || !s->setup.delay || !s->p || !s->model || !s->system || !s->lower ||
        !s->upper) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < setup->n; i++) {
        list[i] = setup->list[i];
        s->p[i] = list[i].start;
        s->lower[i] = list[i].lower;
        s->upper[i] = list[i].upper;
    }
    const mhe_block *moved = mhe_layout_find(f->layout, MHE_ROLE_PARAMETER, MHI_INSERTION);
    if (moved != NULL) {
        s->moved[0] = moved->first;
        s->moved[1] = moved->first + moved->count;
    }
    const mhe_block *masses = mhe_layout_find(f->layout, MHE_ROLE_PARAMETER, MHI_MASS);
    s->of_bodies = masses != NULL ? masses->first : f->n_p;
    mhi_system_parameters(system, s->model);
    return MHE_OK;
}

static int is_moved(const mhi_parameters *s, int32_t i) {
    return i >= s->moved[0] && i < s->moved[1];
}

mhe_status mhi_parameters_set(mhi_parameters *s, mhi_system *system, const double *p,
                              mhe_error *err) {
    const int32_t n = mhi_system_face(system)->n_p;
    if (s->set && memcmp(s->p, p, sizeof *p * (size_t)s->setup.n) == 0) {
        return MHE_OK;
    }
    for (int32_t i = 0; i < n; i++) {
        const int32_t of = s->setup.of_system[i];
        s->system[i] = of < 0           ? s->model[i]
                       : is_moved(s, i) ? s->model[i] + MHI_OFFSET_UNIT * p[of]
                                        : s->model[i] * p[of];
    }
    const mhe_status status = n > 0 ? mhi_system_set_parameters(system, s->system, err) : MHE_OK;
    if (status == MHE_OK) {
        memcpy(s->p, p, sizeof *p * (size_t)s->setup.n);
        s->set = 1;
    }
    return status == MHE_E_INPUT ? MHE_RETRY : status; /* muscles cannot be so: a shorter step */
}

/* h(u) and its derivatives by u and A. */
static double shaped(double u, double A, double *by_u, double *by_A) {
    if (fabs(A) < 1e-4) { /* to the second order */
        const double second = u * (1.0 / 6 + u * (-0.5 + u / 3));
        *by_u = 1 + A * (0.5 - u) + A * A * (1.0 / 6 - u + u * u);
        *by_A = 0.5 * u * (1 - u) + 2 * A * second;
        return u + 0.5 * A * u * (1 - u) + A * A * second;
    }
    const double e = expm1(A), inner = 1 + u * e, h = log1p(u * e) / A;
    *by_u = e / (A * inner);
    *by_A = (u * (e + 1) / inner - h) / A;
    return h;
}

static void add_by(mhi_by_parameter *by, int32_t at, double value) {
    if (at >= 0) {
        by->at[by->n] = at;
        by->by[by->n++] = value;
    }
}

/* The EMG of the other time: what it was then is what this time's differs from y by. */
static double measure_delay(const mhi_parameters *s, int32_t k, int32_t muscle,
                            mhi_by_parameter *by) {
    const int32_t at = s->setup.delay[muscle];
    double none, slope;
    if (at < 0) {
        return 0;
    }
    const double now = s->setup.emg_before(s->setup.emg, k, muscle, 0, &none);
    const double then =
        s->setup.emg_before(s->setup.emg, k, muscle, MHI_DELAY_UNIT * s->p[at], &slope);
    if (isnan(now) || isnan(then)) {
        return 0;
    }
    if (by != NULL) {
        add_by(by, at, -MHI_DELAY_UNIT * slope);
    }
    return now - then;
}

static void measure_emg(const mhi_parameters *s, const mhi_signal *control, int32_t k,
                        const double *targets, double *y, mhi_by_parameter *by) {
    for (int32_t i = 0; i < control->n_y; i++) {
        const int32_t gain = s->setup.gain[i], shape = s->setup.shape[i], j = control->offset + i;
        double by_u = 1, by_A = 0, value = y[j];
        const int32_t absent = targets != NULL && isnan(targets[j]);
        if (isnan(value) || absent) {
            continue;
        }
        const double shift = measure_delay(s, k, i, by == NULL ? NULL : &by[j]);
        y[j] = value + shift;
        if (gain < 0 && shape < 0) {
            continue;
        }
        if (shape >= 0) {
            value = shaped(value, s->p[shape], &by_u, &by_A);
        }
        const double g = gain < 0 ? 1 : s->p[gain];
        y[j] = value / g + shift;
        if (by != NULL) {
            by[j].slope = by_u / g;
            add_by(&by[j], gain, -value / (g * g));
            add_by(&by[j], shape, by_A / g);
        }
    }
}

static void cross(const double *a, const double *b, double *out) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* One marker at `y` moves by R offset; d(R offset)/dq = omega_q x (R offset). */
static void measure_marker(const double *offset, int32_t first, const double *body,
                           const double *body_q, int32_t n_q, double *y, double *jacobian,
                           mhi_by_parameter *by) {
    const double *R = body + 3;
    double moved[3];
    for (int32_t a = 0; a < 3; a++) {
        moved[a] = MHI_OFFSET_UNIT *
                   (R[3 * a] * offset[0] + R[3 * a + 1] * offset[1] + R[3 * a + 2] * offset[2]);
        y[a] += moved[a];
        for (int32_t c = 0; c < 3 && by != NULL; c++) {
            add_by(&by[a], first + c, MHI_OFFSET_UNIT * R[3 * a + c]);
        }
    }
    for (int32_t j = 0; j < n_q && jacobian != NULL; j++) {
        double omega[3], turned[3];
        for (int32_t a = 0; a < 3; a++) {
            omega[a] = body_q[a * n_q + j];
        }
        cross(omega, moved, turned);
        for (int32_t a = 0; a < 3; a++) {
            jacobian[a * n_q + j] += turned[a];
        }
    }
}

/* Bodies, their derivatives, rows of joint moments. */
int32_t mhi_parameters_room(const mhi_system *system, int32_t n) {
    const int32_t n_b = mhi_system_description(system)->n_bodies;
    const int32_t n_q = mhi_system_face(system)->n_q;
    return n_b * 12 + n_b * 6 * n_q + n_q * n;
}

static mhe_status measure_markers(const mhi_parameters *s, const mhi_signal *markers,
                                  const mhi_system *system, mhi_system_context *context,
                                  const double *x, double *room, double *y, double *jacobian,
                                  mhi_by_parameter *by, mhe_error *err) {
    const mhe_description *d = mhi_system_description(system);
    const int32_t n_q = mhi_system_face(system)->n_q;
    double *body = room, *body_q = room + 12 * d->n_bodies;
    int32_t any = 0;
    for (int32_t k = 0; k < d->n_markers; k++) {
        any |= s->setup.marker[k] >= 0 && d->markers[k].body >= 0;
    }
    mhe_status status =
        any ? mhi_system_bodies(context, x, body, jacobian == NULL ? NULL : body_q, err) : MHE_OK;
    for (int32_t k = 0; k < d->n_markers && any && status == MHE_OK; k++) {
        const int32_t first = s->setup.marker[k], b = d->markers[k].body;
        if (first >= 0 && b >= 0) {
            measure_marker(s->p + first, first, body + 12 * b, body_q + 6 * n_q * b, n_q,
                           y + markers->offset + 3 * k,
                           jacobian == NULL ? NULL : jacobian + markers->jacobian + 3 * k * n_q,
                           by == NULL ? NULL : by + markers->offset + 3 * k);
        }
    }
    return status;
}

/* What one of the parameter's own changes the system's number by. */
static double unit_of(const mhi_parameters *s, int32_t i) {
    return is_moved(s, i) ? MHI_OFFSET_UNIT : s->model[i];
}

/* Forces by the numbers of their own muscles, joint moments by those of all. */
static mhe_status measure_muscles(const mhi_parameters *s, const mhi_signals *signals,
                                  const mhi_system *system, mhi_system_context *context,
                                  uint32_t wanted, const double *x, const double *u, double *rows,
                                  mhi_by_parameter *by, mhe_error *err) {
    const mhe_system *f = mhi_system_face(system);
    const mhi_signal *force = &signals->signal[MHI_SIGNAL_MUSCLE_FORCE];
    const mhi_signal *moment = &signals->signal[MHI_SIGNAL_JOINT_MOMENT];
    const int32_t n = s->setup.n, of_moments = (wanted >> MHI_SIGNAL_JOINT_MOMENT & 1) != 0;
    mhi_muscle_state state;
    mhe_system_point at;
    mhi_system_point(system, x, u, NULL, &at);
    const mhe_status status = mhi_system_muscles(context, &at, 1, &state, err);
    for (int32_t i = 0; i < f->n_q && of_moments && status == MHE_OK; i++) {
        memset(rows + i * n, 0, sizeof *rows * (size_t)n);
        by[moment->offset + i].row = rows + i * n;
    }
    for (int32_t j = 0; j < s->of_bodies && status == MHE_OK; j++) {
        const int32_t of = s->setup.of_system[j];
        const int32_t m = is_moved(s, j) ? (j - s->moved[0]) / 3 : j % f->n_m;
        const double unit = of < 0 ? 0 : unit_of(s, j);
        if (wanted >> MHI_SIGNAL_MUSCLE_FORCE & 1) {
            add_by(&by[force->offset + m], of, unit * state.force_p[j]);
        }
        for (int32_t i = 0; i < f->n_q && of_moments && of >= 0; i++) {
            rows[i * n + of] += unit * state.moment_p[i * f->n_p + j];
        }
    }
    return status;
}

/* 1: muscles' forces are among what is wanted, and have a value. */
static int32_t reads_muscles(const mhi_signals *signals, uint32_t wanted, const double *u) {
    const uint32_t forces = 1u << MHI_SIGNAL_MUSCLE_FORCE | 1u << MHI_SIGNAL_JOINT_MOMENT;
    return (wanted & forces) != 0 &&
           (u != NULL || !signals->signal[MHI_SIGNAL_MUSCLE_FORCE].reads_u);
}

mhe_status mhi_parameters_measure(const mhi_parameters *s, const mhi_signals *signals,
                                  const mhi_system *system, mhi_system_context *context,
                                  uint32_t wanted, int32_t k, const double *x, const double *u,
                                  const double *targets, double *room, double *y, double *jacobian,
                                  mhi_by_parameter *by, mhe_error *err) {
    for (int32_t i = 0; i < signals->n_y && by != NULL; i++) {
        by[i] = (mhi_by_parameter){.slope = 1};
    }
    if (wanted >> s->control & 1) {
        measure_emg(s, &signals->signal[s->control], k, targets, y, by);
    }
    mhe_status status = MHE_OK;
    if (by != NULL && reads_muscles(signals, wanted, u)) {
        double *rows = room + mhi_parameters_room(system, 0);
        status = measure_muscles(s, signals, system, context, wanted, x, u, rows, by, err);
    }
    return status == MHE_OK && (wanted >> MHI_SIGNAL_MARKERS & 1) != 0
               ? measure_markers(s, &signals->signal[MHI_SIGNAL_MARKERS], system, context, x, room,
                                 y, jacobian, by, err)
               : status;
}

void mhi_parameters_fold(const mhi_parameters *s, int32_t n_x, int32_t n_p, const double *of_system,
                         double *P) {
    const int32_t n = s->setup.n;
    memset(P, 0, sizeof *P * (size_t)(n_x * n));
    for (int32_t i = 0; i < n_x; i++) {
        for (int32_t j = 0; j < n_p; j++) {
            const int32_t of = s->setup.of_system[j];
            if (of >= 0) {
                P[i * n + of] += of_system[i * n_p + j] * unit_of(s, j);
            }
        }
    }
}

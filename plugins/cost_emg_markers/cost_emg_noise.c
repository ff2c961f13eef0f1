/* SPDX-License-Identifier: Apache-2.0 */
/* cost_emg_noise: markers and EMG as measurements with noise, each residual in standard deviations.
 *
 * The maximum-likelihood form of tracking: r = (y - measured) / sigma. The noise of an envelope
 * grows with it (Clancy, Morin and Merletti 2002, doi:10.1016/S1050-6411(02)00033-5), so sigma is a
 * share of how much the channel varies or of the measured value and never less than a floor. Sigmas
 * come from measurements alone, so that r is linear in y. */
#include <mhe/cost.h>

#include <math.h>
#include <stdlib.h>

struct emg_noise_config { /* standard deviations */
    double markers, markers_misfit, markers_offset, emg_spread, emg_value, emg_floor;
    mhe_text_list tracked;
    double untracked, residual_torque, qdot, rates;
};

static const mhe_option emg_noise_options[] = {
    MHE_OPT_REAL(struct emg_noise_config, markers, 0.001, 1e-6, 1, "m",
                 "Least standard deviation of a marker's coordinate."),
    MHE_OPT_REAL(
        struct emg_noise_config, markers_misfit, 0.5, 0, 10, "1",
        "The same as a share of how far all markers were from the estimates so far (RMS of "
        "a coordinate); the larger counts."),
    MHE_OPT_REAL(
        struct emg_noise_config, markers_offset, 1.5, 0, 10, "1",
        "Where joint velocities are measured (data.rates), in the place of markers_misfit: a share "
        "of how far markers were from the postures nearest to them (RMS of a coordinate)."),
    MHE_OPT_REAL(
        struct emg_noise_config, emg_spread, 0.5, 0, 10, "1",
        "Standard deviation of EMG as a share of how much its channel varies (its standard "
        "deviation since the start)."),
    MHE_OPT_REAL(struct emg_noise_config, emg_value, 0.05, 0, 10, "1",
                 "The same as a share of the value; the largest of the three counts."),
    MHE_OPT_REAL(struct emg_noise_config, emg_floor, 0.005, 1e-6, 1, "1",
                 "The same as a share of maximal contraction."),
    MHE_OPT_TEXTS(struct emg_noise_config, tracked, 0, "Muscles with EMG; empty: all."),
    MHE_OPT_REAL(struct emg_noise_config, untracked, 0.3, 1e-6, 1e6, "1",
                 "Standard deviation about 0 of a control without EMG, or while it is missing."),
    MHE_OPT_REAL(struct emg_noise_config, residual_torque, 0.1, 1e-6, 1e6, "N m",
                 "Standard deviation of residual torques, where the problem has them."),
    MHE_OPT_REAL(struct emg_noise_config, qdot, 30, 1e-6, 1e6, "rad/s",
                 "Standard deviation about 0 of joint velocities."),
    MHE_OPT_REAL(struct emg_noise_config, rates, 0.1, 1e-6, 1e6, "rad/s",
                 "Standard deviation of joint velocities where they are measured (data.rates)."),
};

/* What a row of y is. */
enum { OF_MARKER, OF_EMG, OF_NO_EMG, OF_TORQUE, OF_SPEED };

struct emg_noise {
    const struct emg_noise_config *config;
    int32_t n_signals, signals[4], n, first_speed;
    int32_t *kind; /* [n] */
};

static void emg_noise_destroy(void *self) {
    struct emg_noise *t = self;
    if (t != NULL) {
        free(t->kind);
        free(t);
    }
}

/* Appends the rows of a signal, where the problem has it. */
static void emg_noise_add(struct emg_noise *t, const mhe_problem *problem, const char *signal,
                          int32_t kind) {
    int32_t n = 0;
    const int32_t number = problem->find_signal(problem, signal, &n, NULL);
    if (number >= 0) {
        t->signals[t->n_signals++] = number;
        for (int32_t i = 0; i < n; i++) {
            t->kind[t->n++] = kind;
        }
    }
}

static mhe_status emg_noise_create(const mhe_host *host, const mhe_problem *problem,
                                   const void *config, void **self, mhe_error *err) {
    const struct emg_noise_config *c = config;
    const char *control =
        problem->formulation == MHE_FORMULATION_EXCITATION ? "excitation" : "activation";
    const size_t n_m = (size_t)problem->n_muscles;
    const size_t n = 3 * (size_t)problem->n_markers + n_m + 2 * (size_t)problem->n_q + 1;
    (void)host;
    struct emg_noise *t = calloc(1, sizeof *t);
    uint8_t *has_emg = calloc(n_m + 1, 1);
    mhe_status status = MHE_OK;
    if (t == NULL || has_emg == NULL || (t->kind = calloc(n, sizeof *t->kind)) == NULL) {
        status = mhe_fail(err, MHE_E_MEMORY, "no memory for %zu residuals", n);
    }
    if (status == MHE_OK) {
        t->config = c;
        status = mhe_choose_entries(problem, control, "tracked", &c->tracked, has_emg, err);
    }
    if (status == MHE_OK) {
        emg_noise_add(t, problem, "markers", OF_MARKER);
        for (size_t i = 0; i < n_m; i++) {
            t->kind[(size_t)t->n + i] = has_emg[i] ? OF_EMG : OF_NO_EMG;
        }
    }
    if (status == MHE_OK) {
        t->signals[t->n_signals++] = problem->find_signal(problem, control, NULL, NULL);
        t->n += problem->n_muscles;
        emg_noise_add(t, problem, "residual_torque", OF_TORQUE);
        t->first_speed = t->n;
        emg_noise_add(t, problem, "qdot", OF_SPEED);
        *self = t;
    } else {
        emg_noise_destroy(t);
    }
    free(has_emg);
    return status;
}

static mhe_status emg_noise_layout(const void *self, const mhe_problem *problem,
                                   mhe_cost_layout *out, mhe_error *err) {
    const struct emg_noise *t = self;
    (void)problem, (void)err;
    out->n_signals = t->n_signals;
    memcpy(out->signals, t->signals, sizeof t->signals);
    out->n_res = t->n;
    out->jacobian = MHE_JACOBIAN_DIAGONAL;
    out->res_unit = "1";
    out->fills_missing = 1;
    return MHE_OK;
}

static double emg_noise_of(const struct emg_noise_config *c, double measured, double spread) {
    return fmax(fmax(c->emg_floor, c->emg_value * fabs(measured)), c->emg_spread * spread);
}

/* Of a marker's coordinate. What markers are off in their segments is the same at all nodes: the
 * window tells posture but once by it, however many nodes there are, while velocities are free of
 * it. So where velocities are measured, positions are held less. */
static double marker_sigma(const struct emg_noise *t, const mhe_stage *s, int32_t i) {
    const struct emg_noise_config *c = t->config;
    if (s->y_spread == NULL || isnan(s->y_spread[i])) {
        return c->markers;
    }
    const int32_t moves = t->first_speed < t->n && !isnan(s->y_spread[t->first_speed]);
    return fmax(c->markers, (moves ? c->markers_offset : c->markers_misfit) * s->y_spread[i]);
}

/* Sigma of a row; `*target` is what it is compared with. */
static double emg_noise_sigma(const struct emg_noise *t, const mhe_stage *s, int32_t i,
                              double *target) {
    const struct emg_noise_config *c = t->config;
    const double measured = s->y_ref[i];
    *target = 0;
    switch (t->kind[i]) {
    case OF_MARKER:
        *target = measured;
        return marker_sigma(t, s, i);
    case OF_EMG:
        if (!isnan(measured)) {
            *target = measured;
            return emg_noise_of(c, measured, s->y_spread == NULL ? NAN : s->y_spread[i]);
        }
        return c->untracked;
    case OF_NO_EMG:
        return c->untracked;
    case OF_TORQUE:
        return c->residual_torque;
    default:
        if (!isnan(measured)) {
            *target = measured;
            return c->rates;
        }
        return c->qdot;
    }
}

static mhe_status emg_noise_residual(const void *self, const mhe_stage *s, double *r,
                                     mhe_error *err) {
    const struct emg_noise *t = self;
    (void)err;
    for (int32_t i = 0; i < t->n; i++) { /* a missing marker is NaN and goes through */
        double target;
        const double sigma = emg_noise_sigma(t, s, i, &target);
        r[i] = (s->y[i] - target) / sigma;
    }
    return MHE_OK;
}

static mhe_status emg_noise_jacobian(const void *self, const mhe_stage *s, double *J,
                                     mhe_error *err) {
    const struct emg_noise *t = self;
    (void)err;
    for (int32_t i = 0; i < t->n; i++) { /* the diagonal */
        double target;
        J[i] = 1 / emg_noise_sigma(t, s, i, &target);
    }
    return MHE_OK;
}

static const mhe_cost_ops emg_noise_ops = {.size = sizeof emg_noise_ops,
                                           .create = emg_noise_create,
                                           .destroy = emg_noise_destroy,
                                           .layout = emg_noise_layout,
                                           .residual = emg_noise_residual,
                                           .jacobian = emg_noise_jacobian};

static const mhe_plugin emg_noise_plugin = {
    .size = sizeof emg_noise_plugin,
    .flags = MHE_FLAG_MEAN_TARGETS,
    .id = "mhe.cost.emg-markers",
    .version = "0.1.0",
    .summary = "Tracks markers and EMG as measurements with noise, in standard deviations.",
    .reference = "doi:10.1016/S1050-6411(02)00033-5",
    .iface = MHE_COST_IFACE,
    .ops = &emg_noise_ops,
    MHE_PLUGIN_OPTIONS(struct emg_noise_config, emg_noise_options)};

MHE_PLUGIN_LIBRARY(&emg_noise_plugin)

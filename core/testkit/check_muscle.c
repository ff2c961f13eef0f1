/* SPDX-License-Identifier: Apache-2.0 */
/* check_muscle.c: four made-up muscles at points away from the kinks of common curves. */
#include "check_muscle.h"

#include <math.h>
#include <string.h>

static mhe_muscle made_up(const char *name, int32_t type, double force, double fiber, double slack,
                          double pennation) {
    mhe_muscle m = mhe_muscle_unstated(name);
    m.type = type;
    m.max_isometric_force = force;
    m.optimal_fiber_length = fiber;
    m.tendon_slack_length = slack;
    m.pennation_angle = pennation;
    return m;
}

static int present(const muscle_case *c, int32_t at) {
    return c->layout.present == NULL || c->layout.present[at];
}

void mhi_muscle_blank(const muscle_case *c, double *values) {
    for (int32_t at = 0; values != NULL && at < c->n_s; at++) {
        values[at] = present(c, at) ? values[at] : 0;
    }
}

mhe_status mhi_muscle_evaluate(void *data, void *worker, void *scratch, const double *const *in,
                               double *const *out, mhe_error *err) {
    const muscle_case *c = data;
    const int32_t n = c->layout.n_states;
    (void)worker, (void)scratch;
    const mhe_muscle_point at = {sizeof at, in[EXCITATION], in[STATE], in[LENGTH], in[VELOCITY]};
    const mhe_muscle_values values = {.size = sizeof values,
                                      .force = out[FORCE],
                                      .force_s = out[FORCE_S],
                                      .force_l = out[FORCE_L],
                                      .force_w = out[FORCE_W],
                                      .rate = out[RATE],
                                      .rate_e = out[RATE_E],
                                      .rate_s = out[RATE_S],
                                      .rate_l = out[RATE_L],
                                      .rate_w = out[RATE_W]};
    const mhe_status status = c->ops->evaluate(c->self, &at, &values, err);
    double *const of_states[] = {out[FORCE_S], out[RATE], out[RATE_E], out[RATE_L], out[RATE_W]};
    for (size_t i = 0; i < sizeof of_states / sizeof of_states[0]; i++) {
        mhi_muscle_blank(c, of_states[i]);
    }
    for (int32_t k = 0; k < n * c->n_s && out[RATE_S] != NULL; k++) {
        const int32_t row = k / N_M / n, column = k / N_M % n, i = k % N_M;
        if (!present(c, row * N_M + i) || !present(c, column * N_M + i)) {
            out[RATE_S][k] = 0;
        }
    }
    return status;
}

/* ---- what layout() says ---- */

static const char *layout_fault(const muscle_case *c) {
    const mhe_muscle_layout *l = &c->layout;
    if (l->n_states < 1 || l->n_states > MHE_MUSCLE_MAX_STATES) {
        return "n_states is not 1 .. MHE_MUSCLE_MAX_STATES";
    }
    if (l->activation < 0 || l->activation >= l->n_states) {
        return "`activation` is none of the states";
    }
    if (l->names == NULL || l->units == NULL ||
        strcmp(l->names[l->activation], "activation") != 0) {
        return "a state has no name or unit, or the activation has another name";
    }
    for (int32_t i = 0; i < N_M; i++) {
        if (!present(c, l->activation * N_M + i)) {
            return "a muscle has no activation";
        }
    }
    for (int32_t k = 0; k < l->n_states * N_M; k++) {
        if (l->lower != NULL && l->upper != NULL && !(l->lower[k] <= l->upper[k])) {
            return "a lower bound is not below the upper";
        }
    }
    if (l->diagonal != NULL && l->diagonal[l->activation] && c->ops->diagonal_rate == NULL) {
        return "a state is diagonal, and diagonal_rate() is NULL";
    }
    return l->n_states > 1 && c->ops->equilibrium == NULL
               ? "more than one state, and equilibrium() is NULL"
               : NULL;
}

/* ---- derivatives ---- */

/* Muscles do not see each other: `values`, rows by rows x columns blocks of one number a muscle,
 * must be the whole Jacobian of out block o with respect to in block i. */
static void check_derivative(mhi_kit *kit, const muscle_case *c, const double *const *in,
                             const double *values, int32_t i, int32_t o, const char *check) {
    const int32_t rows = c->probe.out[o].n / N_M, columns = c->probe.in[i].n / N_M;
    double *jacobian = MHI_KIT_TAKE(kit, double, rows *columns *N_M *N_M);
    for (int32_t r = 0; r < rows; r++) {
        for (int32_t k = 0; k < columns; k++) {
            for (int32_t m = 0; m < N_M; m++) {
                jacobian[(r * N_M + m) * columns * N_M + k * N_M + m] =
                    values[(r * columns + k) * N_M + m];
            }
        }
    }
    mhi_probe_jacobian(kit, &c->probe, in, i, o, jacobian, check);
}

static void check_derivatives(mhi_kit *kit, const muscle_case *c, const double *const *in,
                              double *const *out) {
    check_derivative(kit, c, in, out[FORCE_S], STATE, FORCE, "force by states against differences");
    check_derivative(kit, c, in, out[FORCE_L], LENGTH, FORCE, "dF/dl against differences");
    check_derivative(kit, c, in, out[FORCE_W], VELOCITY, FORCE, "dF/dw against differences");
    check_derivative(kit, c, in, out[RATE_E], EXCITATION, RATE,
                     "rates by excitation against differences");
    check_derivative(kit, c, in, out[RATE_S], STATE, RATE, "rates by states against differences");
    check_derivative(kit, c, in, out[RATE_L], LENGTH, RATE, "rates by length against differences");
    check_derivative(kit, c, in, out[RATE_W], VELOCITY, RATE,
                     "rates by velocity against differences");
}

/* ---- single outputs ---- */

static void check_alone(mhi_kit *kit, const muscle_case *c, const double *const *in,
                        double *const *out) {
    double alone[N_M];
    const mhe_muscle_point no_rate = {sizeof no_rate, NULL, in[STATE], in[LENGTH], in[VELOCITY]};
    const mhe_muscle_values force_only = {.size = sizeof force_only, .force = alone};
    int same = c->ops->evaluate(c->self, &no_rate, &force_only, NULL) == MHE_OK;
    for (int k = 0; k < N_M; k++) {
        same &= fabs(alone[k] - out[FORCE][k]) <= 1e-12 * fabs(out[FORCE][k]);
    }
    if (same) {
        mhi_kit_pass(kit, "force without derivatives and excitation");
    } else {
        mhi_kit_fail(kit, "force without derivatives and excitation",
                     "fails, or differs from the one with them");
    }
}

/* diagonal_rate() has the bits of evaluate(), with derivatives and without. */
static void check_diagonal(mhi_kit *kit, const muscle_case *c, const double *const *in,
                           double *const *out) {
    const int32_t n = c->layout.n_states;
    for (int32_t k = 0; k < n && c->layout.diagonal != NULL; k++) {
        double rate[N_M], rate_e[N_M], rate_s[N_M], alone[N_M];
        if (!c->layout.diagonal[k]) {
            continue;
        }
        const double *s = in[STATE] + k * N_M;
        int same =
            c->ops->diagonal_rate(c->self, k, in[EXCITATION], s, rate, rate_e, rate_s, NULL) ==
                MHE_OK &&
            c->ops->diagonal_rate(c->self, k, in[EXCITATION], s, alone, NULL, NULL, NULL) == MHE_OK;
        for (int i = 0; i < N_M && same; i++) {
            const int32_t at = k * N_M + i;
            same &= !present(c, at) || (rate[i] == out[RATE][at] && alone[i] == rate[i] &&
                                        rate_e[i] == out[RATE_E][at] &&
                                        rate_s[i] == out[RATE_S][(k * n + k) * N_M + i]);
        }
        if (same) {
            mhi_kit_pass(kit, "diagonal_rate() as evaluate()");
        } else {
            mhi_kit_fail(kit, "diagonal_rate() as evaluate()", "state '%s': other bits",
                         c->layout.names[k]);
        }
    }
}

/* Standing still in equilibrium, no state moves. */
static void check_equilibrium(mhi_kit *kit, const muscle_case *c, const double *const *in) {
    static const double still[N_M] = {0, 0, 0, 0};
    const int32_t activation = c->layout.activation;
    double state[MAX_S], rate[MAX_S], worst = 0;
    const double *a = in[STATE] + activation * N_M;
    const double *const at[] = {a, state, in[LENGTH], still};
    double *const out[N_OUT] = {[RATE] = rate};
    if (c->ops->equilibrium == NULL) {
        return;
    }
    mhe_error err = {0};
    if (c->ops->equilibrium(c->self, a, in[LENGTH], still, state, &err) != MHE_OK ||
        mhi_muscle_evaluate((void *)c, NULL, NULL, at, out, &err) != MHE_OK) {
        mhi_kit_fail(kit, "equilibrium", "%s", err.text);
        return;
    }
    for (int32_t k = 0; k < c->n_s; k++) {
        worst = !present(c, k) || fabs(rate[k]) <= worst ? worst : fabs(rate[k]);
    }
    for (int i = 0; i < N_M; i++) {
        worst = state[activation * N_M + i] == a[i] ? worst : NAN;
    }
    (void)mhi_kit_limit(kit, "states stand still in equilibrium", worst, 1e-6);
}

/* ---- all of them ---- */

static const double strain[N_M] = {0.72, 0.91, 1.12, 1.27};  /* fibre length in optimal ones */
static const double speed[N_M] = {-0.31, -0.07, 0.06, 0.23}; /* m/s */
static const double level[N_M] = {0.03, 0.35, 0.6, 0.97};

/* Every muscle meets every length, speed and level; states beside the activation are near
 * equilibrium, those that a muscle lacks NaN; excitation is never activation. */
static mhe_status point_of_turn(const muscle_case *c, const mhe_muscle *muscles, int turn,
                                double *e, double *s, double *l, double *w, mhe_error *err) {
    double a[N_M];
    for (int k = 0; k < N_M; k++) {
        a[k] = level[(k + 2 * turn) % N_M];
        e[k] = level[(k + 2 * turn + 1 + turn % 3) % N_M];
        w[k] = speed[(k + 3 * turn + turn / 2) % N_M];
        l[k] = muscles[k].tendon_slack_length + strain[(k + turn) % N_M] *
                                                    muscles[k].optimal_fiber_length *
                                                    cos(muscles[k].pennation_angle);
    }
    mhe_status status = MHE_OK;
    if (c->ops->equilibrium != NULL) {
        status = c->ops->equilibrium(c->self, a, l, w, s, err);
    }
    for (int32_t k = 0; k < c->n_s; k++) {
        const int32_t i = k % N_M;
        if (k / N_M == c->layout.activation) {
            s[k] = a[i];
        } else {
            s[k] = present(c, k) ? s[k] * (1 + 0.004 * (i - 1.5)) : NAN;
        }
    }
    return status;
}

/* x [n] of (1 - h J) x = h rate, the step of an implicit Euler method; J and rate are those of one
 * muscle. */
static void implicit_step(double h, int32_t n, double (*J)[MHE_MUSCLE_MAX_STATES], double *x) {
    for (int32_t i = 0; i < n; i++) {
        x[i] *= h;
        for (int32_t j = 0; j < n; j++) {
            J[i][j] = (i == j) - h * J[i][j];
        }
    }
    for (int32_t k = 0; k < n; k++) { /* decaying states: the diagonal is the pivot */
        for (int32_t i = 0; i < n; i++) {
            const double factor = i == k ? 0 : J[i][k] / J[k][k];
            for (int32_t j = k; j < n && factor != 0; j++) {
                J[i][j] -= factor * J[k][j];
            }
            x[i] -= factor * x[k];
        }
    }
    for (int32_t k = 0; k < n; k++) {
        x[k] /= J[k][k];
    }
}

/* Held at its excitation, the activation comes nearer to it: it may do so through other states, so
 * all of them go on for half a second. */
static int approaches(muscle_case *c, const double *const *in, double *const *out, mhe_error *err) {
    const int32_t n = c->layout.n_states, a = c->layout.activation * N_M;
    double s[MAX_S];
    memcpy(s, in[STATE], sizeof *s * (size_t)c->n_s);
    const double *const at[] = {in[EXCITATION], s, in[LENGTH], in[VELOCITY]};
    for (int step = 0; step < 200; step++) {
        if (mhi_muscle_evaluate(c, NULL, NULL, at, out, err) != MHE_OK) {
            return 0;
        }
        for (int32_t i = 0; i < N_M; i++) {
            double J[MHE_MUSCLE_MAX_STATES][MHE_MUSCLE_MAX_STATES], x[MHE_MUSCLE_MAX_STATES];
            for (int32_t k = 0; k < n; k++) {
                x[k] = out[RATE][k * N_M + i];
                for (int32_t j = 0; j < n; j++) {
                    J[k][j] = out[RATE_S][(k * n + j) * N_M + i];
                }
            }
            implicit_step(0.0025, n, J, x);
            for (int32_t k = 0; k < n; k++) {
                s[k * N_M + i] += present(c, k * N_M + i) ? x[k] : 0;
            }
        }
    }
    int nearer = 1;
    for (int32_t i = 0; i < N_M; i++) {
        const double e = in[EXCITATION][i];
        nearer &= fabs(s[a + i] - e) < fabs(in[STATE][a + i] - e);
    }
    return nearer;
}

static void check_points(mhi_kit *kit, muscle_case *c, const mhe_muscle *muscles) {
    double e[N_M], s[MAX_S], l[N_M], w[N_M];
    const double *const in[] = {e, s, l, w};
    double *out[N_OUT];
    int toward = 1;
    for (int i = 0; i < N_OUT; i++) {
        out[i] = MHI_KIT_TAKE(kit, double, c->probe.out[i].n);
    }
    for (int turn = 0; turn < N_M; turn++) {
        mhe_error err = {0};
        mhe_status status = point_of_turn(c, muscles, turn, e, s, l, w, &err);
        if (status == MHE_OK) {
            status = mhi_muscle_evaluate(c, NULL, NULL, in, out, &err);
        }
        if (status != MHE_OK) {
            mhi_kit_fail(kit, "evaluate", "status %d: %s", (int)status, err.text);
            return;
        }
        if (turn == 0) {
            mhi_probe_check(kit, &c->probe, in);
        }
        check_derivatives(kit, c, in, out);
        check_diagonal(kit, c, in, out);
        check_equilibrium(kit, c, in);
        mhi_check_muscle_parameters(kit, c, muscles, in);
        if (turn == N_M - 1) {
            check_alone(kit, c, in, out);
        }
        toward &= approaches(c, in, out, &err); /* last: writes to out */
    }
    if (toward) {
        mhi_kit_pass(kit, "activation moves toward excitation");
    } else {
        mhi_kit_fail(kit, "activation moves toward excitation", "it moves away");
    }
}

static void make_probe(muscle_case *c) {
    const int32_t n_s = c->n_s;
    c->probe = (mhi_probe){.name = "evaluate",
                           .n_in = N_IN,
                           .n_out = N_OUT,
                           .in = {{.n = N_M}, {.n = n_s}, {.n = N_M}, {.n = N_M}},
                           .out = {[FORCE] = {.n = N_M},
                                   [FORCE_S] = {.n = n_s},
                                   [FORCE_L] = {.n = N_M},
                                   [FORCE_W] = {.n = N_M},
                                   [RATE] = {.n = n_s},
                                   [RATE_E] = {.n = n_s},
                                   [RATE_S] = {.n = n_s * c->layout.n_states},
                                   [RATE_L] = {.n = n_s},
                                   [RATE_W] = {.n = n_s}},
                           .data = c,
                           .call = mhi_muscle_evaluate};
}

void mhi_check_muscle(mhi_kit *kit) {
    const mhe_muscle muscles[N_M] = {
        made_up("unstated", MHE_MUSCLE_UNSTATED, 450.0, 0.11, 0.19, 0.0),
        made_up("hill", MHE_MUSCLE_HILL, 800.0, 0.13, 0.15, 0.2),
        made_up("thelen", MHE_MUSCLE_HILL_THELEN, 990.0, 0.085, 0.06, 0.0),
        made_up("degroote", MHE_MUSCLE_DEGROOTE2016, 620.0, 0.14, 0.14, 0.15)};
    muscle_case c = {.ops = kit->plugin->ops, .layout = {.size = sizeof c.layout}};
    mhe_error err = {0};
    mhe_status status = c.ops->create(&kit->host, muscles, N_M, kit->config, &c.self, &err);
    if (status == MHE_E_UNSUPPORTED) {
        mhi_kit_skip(kit, "evaluation", "refuses the made-up muscles: %s", err.text);
        return;
    }
    if (status != MHE_OK) {
        mhi_kit_fail(kit, "create", "status %d: %s", (int)status, err.text);
        return;
    }
    mhi_kit_pass(kit, "create");
    status = c.ops->layout(c.self, &c.layout, &err);
    const char *fault = status == MHE_OK ? layout_fault(&c) : err.text;
    if (fault != NULL) {
        mhi_kit_fail(kit, "layout", "%s", fault);
    } else {
        mhi_kit_pass(kit, "layout");
        c.n_s = c.layout.n_states * N_M;
        make_probe(&c);
        check_points(kit, &c, muscles);
    }
    c.ops->destroy(c.self);
}

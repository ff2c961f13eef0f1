/* SPDX-License-Identifier: Apache-2.0 */
/* check_cost.c: a cost on a made-up problem: both formulations, with and without residual torques.
 */
#include "kit.h"

#include <math.h>
#include <mhe/cost.h>
#include <string.h>

#define N_Q 3
#define N_MUSCLES 4
#define N_MARKERS 2
#define N_INTERVALS 6

typedef struct signal {
    const char *name, *unit;
    int32_t n;
    double lower, upper; /* of the made-up values */
    int32_t excitation_only, residual_torque;
} signal;

static const signal signals[] = {
    {"markers", "m", 3 * N_MARKERS, -0.5, 0.5, 0, 0},
    {"activation", "1", N_MUSCLES, 0.05, 0.95, 0, 0},
    {"excitation", "1", N_MUSCLES, 0.05, 0.95, 1, 0},
    {"q", "rad", N_Q, -1.0, 1.0, 0, 0},
    {"qdot", "rad/s", N_Q, -2.0, 2.0, 0, 0},
    {"muscle_force", "N", N_MUSCLES, 10.0, 500.0, 0, 0},
    {"joint_moment", "N m", N_Q, -20.0, 20.0, 0, 0},
    {"residual_torque", "N m", N_Q, -5.0, 5.0, 0, 1},
};
#define N_SIGNALS ((int32_t)(sizeof signals / sizeof signals[0]))

static int32_t find_signal(const mhe_problem *problem, const char *name, int32_t *n_y,
                           const char **unit) {
    for (int32_t i = 0; i < N_SIGNALS; i++) {
        const signal *s = &signals[i];
        if (strcmp(s->name, name) != 0 ||
            (s->excitation_only && problem->formulation != MHE_FORMULATION_EXCITATION) ||
            (s->residual_torque && problem->n_residual_torques == 0)) {
            continue;
        }
        if (n_y != NULL) {
            *n_y = s->n;
        }
        if (unit != NULL) {
            *unit = s->unit;
        }
        return i;
    }
    return -1;
}

static const char *const coordinates[N_Q] = {"shoulder_flexion", "elbow_flexion", "forearm"};
static const char *const muscles[N_MUSCLES] = {"BIClong", "BICshort", "TRIlong", "BRA"};
static const char *const markers[N_MARKERS] = {"EPICl", "WRIST"};

static const char *const axes[3 * N_MARKERS] = {"EPICl.x", "EPICl.y", "EPICl.z",
                                                "WRIST.x", "WRIST.y", "WRIST.z"};

static const char *const *entry_names(const mhe_problem *problem, int32_t k) {
    (void)problem;
    if (k < 0 || k >= N_SIGNALS) {
        return NULL;
    }
    return signals[k].n == 3 * N_MARKERS ? axes : signals[k].n == N_MUSCLES ? muscles : coordinates;
}

static mhe_problem make_problem(int32_t formulation, int32_t n_residual_torques) {
    return (mhe_problem){.size = sizeof(mhe_problem),
                         .formulation = formulation,
                         .n_q = N_Q,
                         .n_muscles = N_MUSCLES,
                         .n_markers = N_MARKERS,
                         .n_residual_torques = n_residual_torques,
                         .n_intervals = N_INTERVALS,
                         .interval = 0.03,
                         .coordinate_names = coordinates,
                         .muscle_names = muscles,
                         .marker_names = markers,
                         .find_signal = find_signal,
                         .entry_names = entry_names};
}

/* A cost set up on one problem, seen at one node. */
typedef struct cost_case {
    const char *title;
    const mhe_cost_ops *ops;
    void *self;
    mhe_cost_layout layout;
    mhe_stage stage;
    double *y, *y_ref;
    int32_t first; /* it reads the window's first node alone: elsewhere all may be missing */
} cost_case;

static mhe_status call_residual(void *data, void *worker, void *scratch, const double *const *in,
                                double *const *out, mhe_error *err) {
    const cost_case *c = data;
    (void)worker;
    mhe_stage stage = c->stage;
    stage.y = in[0];
    stage.y_ref = in[1];
    stage.scratch = scratch;
    return c->ops->residual(c->self, &stage, out[0], err);
}

static mhe_status call_jacobian(void *data, void *worker, void *scratch, const double *const *in,
                                double *const *out, mhe_error *err) {
    const cost_case *c = data;
    (void)worker;
    mhe_stage stage = c->stage;
    stage.y = in[0];
    stage.y_ref = in[1];
    stage.scratch = scratch;
    return c->ops->jacobian(c->self, &stage, out[0], err);
}

/* layout() says what fits the problem; sets ny and makes up y and y_ref. */
static int check_layout(mhi_kit *kit, cost_case *c) {
    const mhe_cost_layout *l = &c->layout;
    const char *check = "layout fits the problem";
    uint64_t seed = 7;
    const int32_t n = l->n_signals > 0 ? l->n_signals : 1;
    if (n > MHE_COST_MAX_SIGNALS || l->n_res < 0) {
        mhi_kit_fail(kit, check, "%d signals, %d residuals (%s)", (int)n, (int)l->n_res, c->title);
        return 0;
    }
    int32_t ny = 0;
    c->y = MHI_KIT_TAKE(kit, double, MHE_COST_MAX_SIGNALS * 3 * N_MUSCLES);
    c->y_ref = MHI_KIT_TAKE(kit, double, MHE_COST_MAX_SIGNALS * 3 * N_MUSCLES);
    for (int32_t i = 0; i < n; i++) {
        const int32_t k = l->n_signals > 0 ? l->signals[i] : l->signal;
        if (k < 0 || k >= N_SIGNALS) {
            mhi_kit_fail(kit, check, "there is no signal %d (%s)", (int)k, c->title);
            return 0;
        }
        if (l->at[i] < MHE_AT_NODE || l->at[i] > MHE_AT_FIRST) {
            mhi_kit_fail(kit, check, "%d is no MHE_AT_* (%s)", (int)l->at[i], c->title);
            return 0;
        }
        c->first |= l->at[i] == MHE_AT_FIRST;
        for (int32_t j = 0; j < signals[k].n; j++, ny++) {
            c->y[ny] = mhi_kit_random(&seed, signals[k].lower, signals[k].upper);
            c->y_ref[ny] = mhi_kit_random(&seed, signals[k].lower, signals[k].upper);
        }
    }
    if (l->jacobian != MHE_JACOBIAN_DENSE &&
        (l->jacobian != MHE_JACOBIAN_DIAGONAL || l->n_res != ny)) {
        mhi_kit_fail(kit, check, "shape %d of the Jacobian with %d residuals and %d signals (%s)",
                     (int)l->jacobian, (int)l->n_res, (int)ny, c->title);
        return 0;
    }
    c->stage = (mhe_stage){.size = sizeof(mhe_stage), .n_intervals = N_INTERVALS, .ny = ny};
    mhi_kit_pass(kit, check);
    return 1;
}

static void set_node(cost_case *c, int32_t node) {
    c->stage.node = node;
    c->stage.time = 0.03 * node;
}

/* The Jacobian as a dense matrix [n_res x ny]. */
static double *dense_jacobian(mhi_kit *kit, const cost_case *c, const mhi_probe *probe,
                              const double *const *in) {
    const int32_t ny = c->stage.ny;
    double *raw = MHI_KIT_TAKE(kit, double, probe->out[0].n);
    double *const out[] = {raw};
    if (probe->call(probe->data, NULL, mhi_kit_take(kit, probe->scratch_bytes), in, out, NULL) !=
        MHE_OK) {
        raw[0] = NAN;
    }
    if (c->layout.jacobian == MHE_JACOBIAN_DENSE) {
        return raw;
    }
    double *full = MHI_KIT_TAKE(kit, double, ny *ny);
    for (int32_t i = 0; i < ny; i++) {
        full[i * ny + i] = raw[i];
    }
    return full;
}

/* Makes `changed` (y or y_ref) NaN entry by entry: every residual that depends on the entry must
 * become NaN too, or a missing sample would count as a number. */
static void check_nan(mhi_kit *kit, const mhi_probe *probe, cost_case *c, double *changed,
                      const char *check) {
    const double *const in[] = {c->y, c->y_ref};
    double *here = MHI_KIT_TAKE(kit, double, c->layout.n_res);
    double *moved = MHI_KIT_TAKE(kit, double, c->layout.n_res);
    double *const out_here[] = {here}, *const out_moved[] = {moved};
    void *scratch = mhi_kit_take(kit, probe->scratch_bytes);
    mhe_status status = probe->call(c, NULL, scratch, in, out_here, NULL);
    for (int32_t k = 0; k < c->stage.ny; k++) {
        const double value = changed[k];
        changed[k] = value + 0.01;
        status |= probe->call(c, NULL, scratch, in, out_moved, NULL);
        for (int32_t i = 0; i < c->layout.n_res; i++) {
            here[i] = moved[i] != here[i] ? INFINITY : here[i]; /* depends on entry k */
        }
        changed[k] = NAN;
        status |= probe->call(c, NULL, scratch, in, out_moved, NULL);
        changed[k] = value;
        for (int32_t i = 0; i < c->layout.n_res; i++) {
            if (status == MHE_OK && isinf(here[i]) && isfinite(moved[i])) {
                mhi_kit_fail(kit, check, "residual %d is %g though it needs entry %d (%s)", (int)i,
                             moved[i], (int)k, c->title);
                return;
            }
        }
        status |= probe->call(c, NULL, scratch, in, out_here, NULL);
    }
    if (status != MHE_OK) {
        mhi_kit_fail(kit, check, "status %d (%s)", (int)status, c->title);
        return;
    }
    mhi_kit_pass(kit, check);
}

/* Leaves out each target without which all residuals are finite. */
static void drop_filled_targets(mhi_kit *kit, const mhi_probe *probe, cost_case *c) {
    const double *const in[] = {c->y, c->y_ref};
    double *r = MHI_KIT_TAKE(kit, double, c->layout.n_res);
    double *const out[] = {r};
    void *scratch = mhi_kit_take(kit, probe->scratch_bytes);
    for (int32_t k = 0; k < c->stage.ny; k++) {
        const double value = c->y_ref[k];
        c->y_ref[k] = NAN;
        int finite = probe->call(c, NULL, scratch, in, out, NULL) == MHE_OK;
        for (int32_t i = 0; i < c->layout.n_res; i++) {
            finite = finite && isfinite(r[i]);
        }
        c->y_ref[k] = finite ? NAN : value;
    }
}

static void check_case(mhi_kit *kit, cost_case *c) {
    const double *const in[] = {c->y, c->y_ref};
    const int32_t ny = c->stage.ny, n_res = c->layout.n_res;
    mhi_probe residual = {.name = mhi_arena_format(&kit->arena, "residual (%s)", c->title),
                          .n_in = 2,
                          .n_out = 1,
                          .in = {{.n = ny}, {.n = ny}},
                          .out = {{.n = n_res}},
                          .scratch_bytes = c->layout.scratch_bytes,
                          .data = c,
                          .call = call_residual};
    mhi_probe jacobian = residual;
    jacobian.name = mhi_arena_format(&kit->arena, "jacobian (%s)", c->title);
    jacobian.call = call_jacobian;
    jacobian.out[0] = (mhi_block){
        .n = c->layout.jacobian == MHE_JACOBIAN_DIAGONAL ? ny : n_res * ny, .zeroed = 1};
    set_node(c, c->first ? 0 : N_INTERVALS / 2);
    mhi_probe_check(kit, &residual, in);
    if (c->ops->jacobian != NULL) {
        mhi_probe_check(kit, &jacobian, in);
    }
    const int32_t last = c->first ? 0 : N_INTERVALS;
    for (int32_t node = 0; node <= last && c->ops->jacobian != NULL; node += N_INTERVALS / 2) {
        set_node(c, node);
        char *check = mhi_arena_format(&kit->arena, "jacobian against differences (%s, node %d)",
                                       c->title, (int)node);
        mhi_probe_jacobian(kit, &residual, in, 0, 0, dense_jacobian(kit, c, &jacobian, in), check);
    }
    set_node(c, 0);
    check_nan(kit, &residual, c, c->y, "NaN in y never gives a finite residual");
    if (!c->layout.fills_missing) {
        check_nan(kit, &residual, c, c->y_ref, "a missing target never gives a finite residual");
        return;
    }
    drop_filled_targets(kit, &residual, c);
    mhi_probe_check(kit, &residual, in);
    if (c->ops->jacobian != NULL) {
        mhi_probe_check(kit, &jacobian, in);
        mhi_probe_jacobian(kit, &residual, in, 0, 0, dense_jacobian(kit, c, &jacobian, in),
                           mhi_arena_format(&kit->arena,
                                            "jacobian against differences (%s, targets missing)",
                                            c->title));
    }
}

/* Sets the cost up on one problem. Returns whether it took the problem. */
static int check_problem(mhi_kit *kit, const char *title, int32_t formulation, int32_t n_torques) {
    const mhe_problem problem = make_problem(formulation, n_torques);
    cost_case c = {.title = title, .ops = kit->plugin->ops, .self = kit->config};
    mhe_error err = {0};
    mhe_status status = MHE_OK;
    int taken = 0;
    if (c.ops->create != NULL) {
        c.self = NULL;
        status = c.ops->create(&kit->host, &problem, kit->config, &c.self, &err);
    }
    if (status == MHE_OK) {
        c.layout.size = sizeof c.layout;
        status = c.ops->layout(c.self, &problem, &c.layout, &err);
        taken = status == MHE_OK;
        if (taken && check_layout(kit, &c)) {
            check_case(kit, &c);
        }
        if (c.ops->destroy != NULL) {
            c.ops->destroy(c.self);
        }
    }
    if (status == MHE_E_CONFIG || status == MHE_E_UNSUPPORTED) { /* its right, if it says so */
        mhi_kit_note(kit, "create and layout", "refuses the problem (%s): %s", title, err.text);
    } else if (status != MHE_OK) {
        mhi_kit_fail(kit, "create and layout", "status %d (%s): %s", (int)status, title, err.text);
    }
    return taken;
}

void mhi_check_cost(mhi_kit *kit) {
    const mhe_cost_ops *ops = kit->plugin->ops;
    int taken = check_problem(kit, "excitation-driven", MHE_FORMULATION_EXCITATION, 0);
    taken +=
        check_problem(kit, "excitation-driven, residual torques", MHE_FORMULATION_EXCITATION, N_Q);
    taken += check_problem(kit, "activation-driven", MHE_FORMULATION_ACTIVATION, 0);
    taken +=
        check_problem(kit, "activation-driven, residual torques", MHE_FORMULATION_ACTIVATION, N_Q);
    if (taken == 0) {
        mhi_kit_skip(kit, "evaluation", "with its defaults it takes none of the made-up problems");
    } else if (ops->jacobian == NULL) {
        mhi_kit_note(kit, "jacobian", "none: the core takes differences");
    }
}

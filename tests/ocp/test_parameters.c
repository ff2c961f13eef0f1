/* SPDX-License-Identifier: Apache-2.0 */
/* Everything that a calibration's problem says of its parameters against central differences, by
 * every kind of parameter; and motions in a row, which share nothing but these. */
#include "fixture.h"
#include "support.h"

#include "ocp/junction.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TOLERANCE 1e-6 /* what the project demands of every derivative */
#define N 8
#define N_M 19
#define N_K 8
#define MOST_P 256
#define MOST_B 32

static const char *const configs[] = {
    "model: {file: $ARM19}\nmuscle: {curves: degroote2016}\nbounds: {residual_torques: true}\n"
    "costs: [{plugin: mhe.cost.emg-markers, markers: 0.1, emg_spread: 0.5}]\n",
    "model: {file: $ARM19}\nmuscle: {curves: degroote2016}\nformulation: activation\n"
    "costs: [{plugin: mhe.cost.emg-markers-low, markers: 10, emg: 10}]\n",
    "model: {file: $ARM19}\nmuscle: {curves: degroote2016, tendon: elastic}\n"
    "costs: [{plugin: mhe.cost.emg-markers, markers: 0.1},\n"
    "  {plugin: mhe.cost.track, signal: markers, sigma: 0.1, huber: 1}]\n",
    "model: {file: $ARM19}\nmuscle: {curves: paper2021, passive_ramp: 0.3}\n"
    "costs: [{plugin: mhe.cost.emg-markers, markers: 0.1, emg_spread: 0.5}]\n",
    "model: {file: $ARM19}\nmuscle: {curves: degroote2016}\n"
    "costs: [{plugin: mhe.cost.track, signal: muscle_force, sigma: 100},\n"
    "  {plugin: mhe.cost.track, signal: joint_moment, sigma: 5, huber: 1},\n"
    "  {plugin: mhe.cost.emg-markers, markers: 0.1}]\n",
    "model: {file: $ARM19}\nmuscle: {curves: degroote2016, tendon: elastic}\nformulation: "
    "activation\n"
    "costs: [{plugin: mhe.cost.track, signal: muscle_force, sigma: 100},\n"
    "  {plugin: mhe.cost.track, signal: joint_moment, sigma: 5}]\n",
};

/* A cost whose residuals are of several signals each: products of neighbours in y. */
static mhe_status products_layout(const void *self, const mhe_problem *problem,
                                  mhe_cost_layout *out, mhe_error *err) {
    static const char *const names[] = {"excitation", "muscle_force", "joint_moment", "markers"};
    int32_t ny = 0;
    const char *unit;
    (void)self, (void)err;
    out->n_signals = 4;
    for (int32_t i = 0; i < 4; i++) {
        int32_t n = 0;
        out->signals[i] = problem->find_signal(problem, names[i], &n, &unit);
        assert_true(out->signals[i] >= 0);
        ny += n;
    }
    out->n_res = ny - 1;
    return MHE_OK;
}

/* Each signal in units of its size. */
static double size_of(int32_t i) {
    return i < N_M ? 1 : i < 2 * N_M ? 100 : i < 2 * N_M + 4 ? 5 : 0.1;
}

static mhe_status products_residual(const void *self, const mhe_stage *s, double *r,
                                    mhe_error *err) {
    (void)self, (void)err;
    for (int32_t i = 0; i + 1 < s->ny; i++) {
        const int32_t with = (i + 7) % s->ny;
        r[i] = s->y[i] / size_of(i) * s->y[with] / size_of(with);
    }
    return MHE_OK;
}

static mhe_status products_jacobian(const void *self, const mhe_stage *s, double *J,
                                    mhe_error *err) {
    (void)self, (void)err;
    for (int32_t i = 0; i + 1 < s->ny; i++) {
        const int32_t with = (i + 7) % s->ny;
        J[i * s->ny + i] += s->y[with] / size_of(with) / size_of(i);
        J[i * s->ny + with] += s->y[i] / size_of(i) / size_of(with);
    }
    return MHE_OK;
}

static const mhe_cost_ops products_ops = {.size = sizeof products_ops,
                                          .layout = products_layout,
                                          .residual = products_residual,
                                          .jacobian = products_jacobian};
static const mhe_plugin products = {.size = sizeof products,
                                    .id = "test.cost.products",
                                    .version = "1",
                                    .summary = "Products.",
                                    .reference = "",
                                    .iface = MHE_COST_IFACE,
                                    .ops = &products_ops};

typedef struct rig {
    test_fixture f;
    mhi_system *system;
    mhi_ocp *ocp;
    const mhe_stage_problem *problem;
    mhi_parameter list[MOST_P];
    int32_t of_system[6 * N_M + MOST_B], gain[N_M], shape[N_M], marker[N_K], delay[N_M], n_p;
    int32_t place[N];
    double p[MOST_P];
} rig;

static int32_t add(rig *r, double value) {
    r->list[r->n_p] = (mhi_parameter){value, value + 0.1, 0.3, -10, 10};
    r->p[r->n_p] = value;
    return r->n_p++;
}

/* An EMG that is smooth in time. */
static double emg_before(const void *data, int32_t k, int32_t muscle, double delay, double *slope) {
    const double phase = k + 0.4 * muscle - 20 * delay;
    (void)data;
    *slope = -0.2 * 20 * cos(phase);
    return 0.3 + 0.2 * sin(phase);
}

/* All kinds: most numbers of a muscle each its own, one shared by three muscles. */
static void choose(rig *r) {
    for (int32_t i = 0; i < 3 * N_M; i++) {
        r->of_system[i] = i % N_M == 4       ? -1
                          : i == 1 || i == 2 ? r->of_system[0]
                                             : add(r, 1 + 0.01 * (i % 5));
    }
    const mhe_description *d = mhi_system_description(r->f.system);
    for (int32_t i = 0; i < 3 * N_M; i++) { /* where muscles end */
        r->of_system[3 * N_M + i] = i / 3 % 3 == 1 ? add(r, 0.1 * (i % 5) - 0.2) : -1;
    }
    assert_true(d->n_bodies <= MOST_B);
    for (int32_t b = 0; b < d->n_bodies; b++) {
        r->of_system[6 * N_M + b] = d->bodies[b].mass > 0 ? add(r, 1 + 0.05 * (b % 4)) : -1;
    }
    for (int32_t i = 0; i < N_M; i++) {
        r->delay[i] = i % 4 == 1 ? add(r, 0.3 * i) : i == 2 ? r->delay[1] : -1;
        r->gain[i] = i % 3 == 0 ? add(r, 0.8 + 0.02 * i) : -1;
        r->shape[i] = i % 2 == 0 ? add(r, i == 4 ? 5e-5 : i == 6 ? 0 : -0.1 * i) : -1;
    }
    for (int32_t i = 0; i < N_K; i++) {
        r->marker[i] = i % 3 == 1 ? add(r, 0.5) : -1;
        for (int32_t a = 1; a < 3 && r->marker[i] >= 0; a++) {
            (void)add(r, -0.4 * a);
        }
    }
    assert_true(r->n_p <= MOST_P);
}

static void rig_open_with(rig *r, const char *config, const mhe_plugin *instead) {
    static const char *const names[] = {"max_isometric_force", "optimal_fiber_length",
                                        "tendon_slack_length", "insertion", "segment_mass"};
    memset(r, 0, sizeof *r);
    if (test_fixture_open(&r->f, config) != MHE_OK) {
        fail_msg("%s", r->f.err.text);
    }
    const mhi_run *run = r->f.run;
    const mhi_system_setup system = {.host = &r->f.host,
                                     .description = mhi_system_description(r->f.system),
                                     .model = run->model.plugin,
                                     .model_config = run->model.config,
                                     .muscle = run->muscle.plugin,
                                     .muscle_config = run->muscle.config,
                                     .formulation = run->formulation,
                                     .residual_torques = run->bounds.residual_torques,
                                     .parameters = names,
                                     .n_parameters = 5};
    assert_int_equal(mhi_system_create(&system, &r->system, &r->f.err), MHE_OK);
    choose(r);
    mhi_junction junction;
    mhi_arena arena = {0};
    assert_int_equal(mhi_junction_create(r->system, NULL, &arena, &junction, &r->f.err), MHE_OK);
    assert_true(junction.n >= 1 && junction.n < N - 3);
    for (int32_t k = 0; k < N; k++) {
        r->place[k] = k >= 2 && k < 2 + junction.n ? k - 2 : -1;
    }
    mhi_arena_free(&arena);
    mhi_term_setup terms[4];
    for (int32_t i = 0; i < run->n_costs; i++) {
        const mhi_use *c = &run->costs[i];
        terms[i] = (mhi_term_setup){c->plugin, c->config, c->weight, c->sigma, c->huber};
        if (instead != NULL) {
            terms[i] = (mhi_term_setup){instead, NULL, 1, 1, 0};
        }
    }
    const mhi_parameters_setup parameters = {.n = r->n_p,
                                             .list = r->list,
                                             .of_system = r->of_system,
                                             .gain = r->gain,
                                             .shape = r->shape,
                                             .marker = r->marker,
                                             .delay = r->delay,
                                             .emg_before = emg_before};
    const mhi_ocp_setup setup = {.host = &r->f.host,
                                 .system = r->system,
                                 .integrator = run->integrator.plugin,
                                 .integrator_config = run->integrator.config,
                                 .terms = terms,
                                 .n_terms = run->n_costs,
                                 .n_intervals = N,
                                 .interval = 0.02,
                                 .n_workers = 1,
                                 .parameters = &parameters,
                                 .estimated = r->system,
                                 .junctions = r->place,
                                 .node_weight = 0.3};
    if (mhi_ocp_create(&setup, &r->ocp, &r->f.err) != MHE_OK) {
        fail_msg("%s", r->f.err.text);
    }
    r->problem = mhi_ocp_face(r->ocp);
    assert_int_equal(r->problem->n_p, r->n_p);
}

static void rig_open(rig *r, const char *config) {
    rig_open_with(r, config, NULL);
}

static void rig_close(rig *r) {
    mhi_ocp_free(r->ocp);
    mhi_system_free(r->system);
    test_fixture_close(&r->f);
}

/* Posture, speeds, activations, fibres in equilibrium; controls. */
static void random_point(rig *r, uint64_t *seed, double *x, double *u) {
    const mhe_system *s = mhi_system_face(r->system);
    double activation[N_M];
    for (int32_t i = 0; i < s->n_x; i++) {
        x[i] = i < s->n_q       ? test_random(seed, -0.4, 0.4)
               : i < 2 * s->n_q ? test_random(seed, 0.5, 1.5)
                                : test_random(seed, 0.2, 0.8);
    }
    for (int32_t i = 0; i < s->n_u; i++) {
        u[i] = i < s->n_m ? test_random(seed, 0.1, 0.9) : test_random(seed, -2, 2);
    }
    for (int32_t i = 0; i < N_M; i++) {
        activation[i] = s->n_d > 0 ? x[2 * s->n_q + i] : u[i];
    }
    if (s->n_z > 0) {
        assert_int_equal(mhi_system_equilibrium(mhi_ocp_context(r->ocp), x, x + s->n_q, activation,
                                                x, &r->f.err),
                         MHE_OK);
    }
}

static void set_targets(rig *r, uint64_t *seed) {
    const mhi_signals *signals = mhi_ocp_signals(r->ocp);
    for (int32_t k = 0; k <= N; k++) {
        for (int32_t i = 0; i < MHI_N_SIGNALS; i++) {
            double *target = mhi_ocp_target(r->ocp, i, k);
            for (int32_t j = 0; j < signals->signal[i].n_y; j++) {
                target[j] = j % 7 == 5 ? NAN : test_random(seed, 0, 0.3);
            }
        }
    }
}

typedef struct point {
    rig *r;
    int32_t k, step; /* x_next, or cost */
    const double *x, *u;
} point;

static int value_at(void *data, const double *p, double *y) {
    const point *at = data;
    const mhe_stage_problem *problem = at->r->problem;
    const mhe_stage_values out = {
        .size = sizeof out, .cost = at->step ? NULL : y, .x_next = at->step ? y : NULL};
    mhe_status status = problem->set_parameters(problem, p, NULL);
    return status != MHE_OK ? status
                            : problem->evaluate(problem, 0, at->k, at->x, at->u, &out, NULL);
}

/* By x or u, the parameters held. */
static int grad_p_at(void *data, const double *z, double *y) {
    const point *at = data;
    const mhe_stage_problem *problem = at->r->problem;
    const mhe_stage_values out = {.size = sizeof out, .grad_p = y};
    return problem->evaluate(problem, 0, at->k, z, at->u == NULL ? NULL : z + problem->n_x, &out,
                             NULL);
}

static void check(rig *r, int32_t k, const double *x, const double *u) {
    const int32_t n_x = r->problem->n_x, n_u = r->problem->n_u, n_p = r->n_p;
    const size_t d = sizeof(double);
    double *P = calloc((size_t)(n_x * n_p), d), *next = calloc((size_t)n_x, d);
    double *A = calloc((size_t)(n_x * n_x), d), *B = calloc((size_t)(n_x * n_u), d);
    double *grad = calloc((size_t)n_p, d), *pp = calloc((size_t)(n_p * n_p), d);
    double *px = calloc((size_t)(n_p * n_x), d), *pu = calloc((size_t)(n_p * n_u), d);
    double p[MOST_P];
    memcpy(p, r->p, sizeof p);
    assert_int_equal(r->problem->set_parameters(r->problem, p, &r->f.err), MHE_OK);
    mhe_stage_values out = {.size = sizeof out, .grad_p = grad, .hess_pp = pp, .hess_px = px};
    if (u != NULL) {
        out.x_next = next, out.A = A, out.B = B, out.P = P, out.hess_pu = pu;
    }
    assert_int_equal(r->problem->evaluate(r->problem, 0, k, x, u, &out, &r->f.err), MHE_OK);
    point at = {r, k, 0, x, u};
    const double of_cost = test_jacobian_error(value_at, &at, p, n_p, 1, grad);
    double of_step = 0;
    if (u != NULL) {
        at.step = 1;
        of_step = test_jacobian_error(value_at, &at, p, n_p, n_x, P);
    }
    print_message("node %d: gradient %.2g, step %.2g\n", k, of_cost, of_step);
    assert_true(of_cost >= 0 && of_cost < TOLERANCE);
    assert_true(of_step >= 0 && of_step < TOLERANCE);
    if (u != NULL && r->place[k] < 0) {
        int32_t idle[2] = {0};
        for (int32_t i = 0; i < mhi_system_face(r->system)->n_p; i++) {
            double largest = r->of_system[i] < 0;
            for (int32_t j = 0; j < n_x && r->of_system[i] >= 0; j++) {
                largest = fmax(largest, fabs(P[j * n_p + r->of_system[i]]));
            }
            idle[i >= 6 * N_M] += !(largest > 1e-9);
        }
        assert_true(idle[0] <= 5);    /* a slack muscle's */
        assert_int_equal(idle[1], 5); /* bodies that are fixed to the ground */
    }
    for (int32_t i = 0; i < n_p; i++) {
        for (int32_t j = 0; j < i; j++) {
            assert_true(pp[i * n_p + j] == pp[j * n_p + i]);
        }
        assert_true(pp[i * n_p + i] >= 0);
    }
    double *all[] = {P, next, A, B, grad, pp, px, pu};
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        free(all[i]);
    }
}

static void derivatives_by_parameters(void **state) {
    (void)state;
    for (size_t i = 0; i < sizeof configs / sizeof configs[0]; i++) {
        uint64_t seed = 7;
        rig r;
        double x[128], u[64];
        rig_open(&r, configs[i]);
        set_targets(&r, &seed);
        static const int32_t nodes[] = {0, 2, N - 1, N}; /* 0 has the priors; 2 .. a junction */
        for (size_t j = 0; j < sizeof nodes / sizeof nodes[0]; j++) {
            const int32_t k = nodes[j];
            random_point(&r, &seed, x, u);
            check(&r, k, x, k < N ? u : NULL);
        }
        rig_close(&r);
    }
}

/* Costs that read several signals in one residual. */
static void several_signals_at_once(void **state) {
    uint64_t seed = 9;
    rig r;
    double x[128], u[64];
    (void)state;
    rig_open_with(&r, configs[3], &products);
    set_targets(&r, &seed);
    random_point(&r, &seed, x, u);
    check(&r, 0, x, u);
    check(&r, N - 1, x, u);
    rig_close(&r);
}

/* Where residuals vanish the Gauss-Newton blocks are the true derivatives of the gradient. */
static void check_mixed(const char *config) {
    uint64_t seed = 3;
    rig r;
    double z[160];
    rig_open(&r, config);
    const int32_t n_x = r.problem->n_x, n_u = r.problem->n_u, k = 1, n_p = r.n_p;
    random_point(&r, &seed, z, z + n_x);
    assert_int_equal(r.problem->set_parameters(r.problem, r.p, &r.f.err), MHE_OK);
    /* the targets are what the model says there */
    const mhi_signals *signals = mhi_ocp_signals(r.ocp);
    double *y = calloc((size_t)signals->n_y, sizeof *y), *room = calloc(4096, sizeof *room);
    const uint32_t wanted = 1u << MHI_SIGNAL_MARKERS | 1u << MHI_SIGNAL_EXCITATION |
                            1u << MHI_SIGNAL_MUSCLE_FORCE | 1u << MHI_SIGNAL_JOINT_MOMENT;
    assert_int_equal(mhi_signals_evaluate(signals, r.system, mhi_ocp_context(r.ocp), wanted, z,
                                          z + n_x, y, NULL, &r.f.err),
                     MHE_OK);
    assert_true(mhi_parameters_room(r.system, n_p) <= 4096);
    assert_int_equal(mhi_parameters_measure(mhi_ocp_parameters(r.ocp), signals, r.system,
                                            mhi_ocp_context(r.ocp), wanted, k, z, z + n_x, NULL,
                                            room, y, NULL, NULL, &r.f.err),
                     MHE_OK);
    for (int32_t s = 0; s <= MHI_SIGNAL_JOINT_MOMENT; s++) {
        double *target = mhi_ocp_target(r.ocp, s, k);
        for (int32_t i = 0; i < signals->signal[s].n_y && (wanted >> s & 1); i++) {
            target[i] = y[signals->signal[s].offset + i];
        }
    }
    double *px = calloc((size_t)(n_p * n_x), sizeof *px),
           *pu = calloc((size_t)(n_p * n_u), sizeof *pu);
    double *pz = calloc((size_t)(n_p * (n_x + n_u)), sizeof *pz);
    const mhe_stage_values out = {.size = sizeof out, .hess_px = px, .hess_pu = pu};
    assert_int_equal(r.problem->evaluate(r.problem, 0, k, z, z + n_x, &out, &r.f.err), MHE_OK);
    double largest = 0;
    for (int32_t i = 0; i < n_p; i++) {
        memcpy(pz + i * (n_x + n_u), px + i * n_x, sizeof *px * (size_t)n_x);
        memcpy(pz + i * (n_x + n_u) + n_x, pu + i * n_u, sizeof *pu * (size_t)n_u);
    }
    for (int32_t i = 0; i < n_p * (n_x + n_u); i++) {
        largest = fmax(largest, fabs(pz[i]));
    }
    assert_true(largest > 0.1);
    point at = {&r, k, 0, z, z + n_x};
    assert_true(test_jacobian_error(grad_p_at, &at, z, n_x + n_u, n_p, pz) < TOLERANCE);
    free(y), free(room), free(px), free(pu), free(pz);
    rig_close(&r);
}

static void mixed_derivatives(void **state) {
    (void)state;
    check_mixed(configs[0]);
    check_mixed(configs[4]);
}

/* What leads from one motion to the next: its first state is whatever the controls say, and of what
 * was before nothing is left. */
static void a_junction_forgets(void **state) {
    (void)state;
    uint64_t seed = 11;
    rig r;
    double x[128], other[128], u[8][64], first[128];
    rig_open(&r, configs[2]);
    const int32_t n_x = r.problem->n_x;
    double from[2][128];
    random_point(&r, &seed, x, u[0]);
    random_point(&r, &seed, other, u[0]);
    for (int32_t k = 0; k < 8; k++) {
        for (int32_t i = 0; i < r.problem->n_u; i++) {
            u[k][i] = test_random(&seed, -3, 3);
        }
    }
    for (int32_t which = 0; which < 2; which++) {
        memcpy(from[which], which ? other : x, sizeof from[0]);
        for (int32_t k = 2; k < N && r.place[k] >= 0; k++) {
            const mhe_stage_values out = {.size = sizeof out, .x_next = first};
            assert_int_equal(
                r.problem->evaluate(r.problem, 0, k, from[which], u[r.place[k]], &out, &r.f.err),
                MHE_OK);
            memcpy(from[which], first, sizeof *first * (size_t)n_x);
        }
    }
    for (int32_t i = 0; i < n_x; i++) {
        int32_t found = 0;
        assert_true(from[0][i] == from[1][i]);
        for (int32_t k = 0; k < 8 && !found; k++) {
            for (int32_t j = 0; j < r.problem->n_u && !found; j++) {
                found = u[k][j] == from[0][i];
            }
        }
        assert_true(found); /* each is some control: all states can be reached */
    }
    rig_close(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(derivatives_by_parameters), cmocka_unit_test(mixed_derivatives),
        cmocka_unit_test(several_signals_at_once), cmocka_unit_test(a_junction_forgets)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

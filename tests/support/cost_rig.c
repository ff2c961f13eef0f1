/* SPDX-License-Identifier: Apache-2.0 */
#include "cost_rig.h"

#include <math.h>
#include <string.h>

static const struct signal {
    const char *name;
    int32_t n;
} signals[] = {
    {"markers", 6},      {"activation", 3},   {"q", 2},          {"qdot", 2},
    {"muscle_force", 3}, {"joint_moment", 2}, {"excitation", 3}, {"residual_torque", 2},
};
enum { N_SIGNALS = sizeof signals / sizeof signals[0], EXCITATION = 6, RESIDUAL_TORQUE = 7 };

static int32_t find_signal(const mhe_problem *problem, const char *name, int32_t *n_y,
                           const char **unit) {
    for (int32_t i = 0; i < N_SIGNALS; i++) {
        if (strcmp(signals[i].name, name) != 0 ||
            (i == EXCITATION && problem->formulation != MHE_FORMULATION_EXCITATION) ||
            (i == RESIDUAL_TORQUE && problem->n_residual_torques == 0)) {
            continue;
        }
        if (n_y != NULL) {
            *n_y = signals[i].n;
        }
        if (unit != NULL) {
            *unit = "1";
        }
        return i;
    }
    return -1;
}

static const char *const *entry_names(const mhe_problem *problem, int32_t signal) {
    static const char *const axes[] = {"EPI.x", "EPI.y", "EPI.z", "WRIST.x", "WRIST.y", "WRIST.z"};
    return signals[signal].n == 6   ? axes
           : signals[signal].n == 3 ? problem->muscle_names
                                    : problem->coordinate_names;
}

mhe_status cost_rig_open(cost_rig *rig, const char *id, const char *yaml, int32_t formulation,
                         int32_t flags) {
    static const char *const coordinates[] = {"shoulder", "elbow"};
    static const char *const muscles[] = {"Biceps", "Triceps", "Deltoid"};
    static const char *const markers[] = {"EPI", "WRIST"};
    *rig = (cost_rig){.problem = {.size = sizeof rig->problem,
                                  .formulation = formulation,
                                  .n_q = 2,
                                  .n_muscles = 3,
                                  .n_markers = 2,
                                  .n_residual_torques = flags & COST_RIG_TORQUES ? 2 : 0,
                                  .n_intervals = 4,
                                  .interval = 0.03,
                                  .coordinate_names = coordinates,
                                  .muscle_names = muscles,
                                  .marker_names = markers,
                                  .find_signal = find_signal,
                                  .entry_names = entry_names},
                      .layout = {.size = sizeof rig->layout}};
    const mhe_plugin *plugin = test_plugin(id, MHE_COST_IFACE);
    if (plugin == NULL) {
        skip();
    }
    rig->ops = plugin->ops;
    mhe_status status = rig->ops->create(test_host(), &rig->problem, test_config(plugin, yaml),
                                         &rig->self, &rig->err);
    if (status != MHE_OK) {
        return status;
    }
    assert_int_equal(rig->ops->layout(rig->self, &rig->problem, &rig->layout, &rig->err), MHE_OK);
    assert_int_equal(rig->layout.jacobian, MHE_JACOBIAN_DIAGONAL);
    rig->stage =
        (mhe_stage){.size = sizeof rig->stage, .n_intervals = 4, .y = rig->y, .y_ref = rig->y_ref};
    uint64_t seed = 1;
    for (int i = 0; i < rig->layout.n_signals; i++) {
        rig->stage.ny += signals[rig->layout.signals[i]].n;
    }
    assert_int_equal(rig->stage.ny, rig->layout.n_res);
    for (int i = 0; i < rig->stage.ny; i++) {
        rig->y[i] = test_random(&seed, 0.1, 0.9);
        rig->y_ref[i] = test_random(&seed, 0.1, 0.9);
    }
    return MHE_OK;
}

void cost_rig_close(cost_rig *rig) {
    rig->ops->destroy(rig->self);
}

static int residual(void *data, const double *y, double *r) {
    cost_rig *rig = data;
    mhe_stage stage = rig->stage;
    stage.y = y;
    return rig->ops->residual(rig->self, &stage, r, &rig->err);
}

void cost_rig_evaluate(cost_rig *rig) {
    int n = rig->stage.ny;
    double dense[COST_RIG_ROWS * COST_RIG_ROWS] = {0};
    memset(rig->J, 0, sizeof rig->J);
    assert_int_equal(rig->ops->residual(rig->self, &rig->stage, rig->r, &rig->err), MHE_OK);
    assert_int_equal(rig->ops->jacobian(rig->self, &rig->stage, rig->J, &rig->err), MHE_OK);
    for (int i = 0; i < n; i++) {
        dense[i * n + i] = rig->J[i];
    }
    double error = test_jacobian_error(residual, rig, rig->y, n, n, dense);
    assert_true(error >= 0 && error < 1e-9); /* linear: rounding alone */
}

int cost_rig_at(const cost_rig *rig, const char *signal, int nth) {
    int at = 0;
    for (int i = 0; i < rig->layout.n_signals; i++) {
        const struct signal *s = &signals[rig->layout.signals[i]];
        if (strcmp(s->name, signal) == 0 && nth-- == 0) {
            return at;
        }
        at += s->n;
    }
    return -1;
}

void cost_rig_expect(const cost_rig *rig, const char *signal, int nth, double weight, int tracks) {
    int at = cost_rig_at(rig, signal, nth), n = 0;
    assert_true(at >= 0);
    find_signal(&rig->problem, signal, &n, NULL);
    for (int i = at; i < at + n; i++) {
        double expected = sqrt(weight) * (rig->y[i] - (tracks ? rig->y_ref[i] : 0));
        assert_true(fabs(rig->r[i] - expected) <= 1e-12 * sqrt(weight));
        assert_true(fabs(rig->J[i] - sqrt(weight)) <= 1e-12 * sqrt(weight));
    }
}

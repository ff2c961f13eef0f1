/* SPDX-License-Identifier: Apache-2.0 */
/* test_muscle.h: muscles of every kind for the tests of mhe.muscle.hill. */
#ifndef MUSCLE_HILL_TEST_MUSCLE_H
#define MUSCLE_HILL_TEST_MUSCLE_H

#include "use.h"

#include <math.h>
#include <mhe/muscle.h>

/* What a file says that states only what it must. */
static inline mhe_muscle test_muscle(int32_t type, double f_max, double l_opt, double l_slack,
                                     double pennation) {
    mhe_muscle m = mhe_muscle_unstated("sample");
    m.type = type;
    m.max_isometric_force = f_max;
    m.optimal_fiber_length = l_opt;
    m.tendon_slack_length = l_slack;
    m.pennation_angle = pennation;
    return m;
}

/* An instance of the plugin; `ops` is NULL where creation failed with `err`. */
struct test_hill {
    const mhe_muscle_ops *ops;
    void *self;
    mhe_error err;
};

static inline struct test_hill test_hill(const mhe_muscle *muscles, int32_t n, const char *yaml) {
    const mhe_plugin *plugin = test_plugin("mhe.muscle.hill", MHE_MUSCLE_IFACE);
    struct test_hill hill = {0};
    assert_non_null(plugin);
    const mhe_muscle_ops *ops = plugin->ops;
    if (ops->create(test_host(), muscles, n, test_config(plugin, yaml), &hill.self, &hill.err) ==
        MHE_OK) {
        hill.ops = ops;
    }
    return hill;
}

/* Forces of rigid tendons at activations a, lengths l and velocities w; what `values` asks for. */
static inline mhe_status test_hill_at(const struct test_hill *hill, const double *a,
                                      const double *l, const double *w,
                                      const mhe_muscle_values *values, mhe_error *err) {
    const mhe_muscle_point at = {.size = sizeof at, .state = a, .length = l, .velocity = w};
    return hill->ops->evaluate(hill->self, &at, values, err);
}

#endif

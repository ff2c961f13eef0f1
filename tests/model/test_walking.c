/* SPDX-License-Identifier: Apache-2.0 */
/* Joint moments of a recorded walk with its ground reaction, against OpenSim's inverse dynamics.
 *
 * The reference low-passes the coordinates (third-order Butterworth of 6 Hz, forwards and
 * backwards) and leaves the loads as they are. It is compared where the recording's ends, which are
 * padding, play no part. */
#include "use.h"

#include "emg/filter.h"
#include "io/external_loads.h"
#include "io/model_file.h"
#include "io/table.h"
#include "model/system.h"
#include "plugin/instance.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FROM 0.25
#define TO 2.25
#define LIMIT 0.01 /* of a moment's peak */
#define REACH 4    /* samples to each side that a derivative is made of */
#define MAX_Q 16
#define PI 3.14159265358979323846

static char path[3][1024];

/* f and its first two derivatives by h at sample k: central differences of eighth order. */
static void derivatives(const double *f, double h, double out[3]) {
    static const double first[] = {0, 4.0 / 5, -1.0 / 5, 4.0 / 105, -1.0 / 280};
    static const double second[] = {-205.0 / 72, 8.0 / 5, -1.0 / 5, 8.0 / 315, -1.0 / 560};
    out[0] = f[0];
    out[1] = 0;
    out[2] = second[0] * f[0];
    for (int j = 1; j <= REACH; j++) {
        out[1] += first[j] * (f[j] - f[-j]);
        out[2] += second[j] * (f[j] + f[-j]);
    }
    out[1] /= h;
    out[2] /= h * h;
}

/* The coordinates, smoothed, one after the other: [n_q x n_rows]. */
static double *smooth(const mhi_table *t, const mhe_description *d) {
    mhi_filter filter;
    const int32_t n = t->n_rows;
    double *q = calloc((size_t)(d->n_coordinates * n), sizeof *q);
    assert_non_null(q);
    assert_int_equal(mhi_filter_low_pass(3, 6, t->rate, &filter, NULL), MHE_OK);
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        const int32_t column = mhi_table_find(t, d->coordinates[i].name);
        assert_true(column >= 0);
        const double unit = t->in_degrees && d->coordinates[i].rotational ? PI / 180 : 1;
        for (int32_t k = 0; k < n; k++) {
            q[i * n + k] = unit * t->values[k * t->n_columns + column];
        }
        assert_int_equal(mhi_filter_both_ways(&filter, q + i * n, n, NULL), MHE_OK);
    }
    return q;
}

typedef struct walk {
    mhe_description *file;
    mhe_description bones; /* the same without its muscles */
    const mhe_plugin *model, *loads;
    void *model_self, *context, *loads_self;
    mhe_force_layout layout;
} walk;

static void open_walk(walk *w, const char *dynamics) {
    mhe_error err = {0};
    memset(w, 0, sizeof *w);
    w->model = test_plugin("mhe.model.simbody", MHE_MODEL_IFACE);
    w->loads = test_plugin("mhe.force.external-loads", MHE_FORCE_IFACE);
    if (w->model == NULL || w->loads == NULL) {
        skip();
    }
    if (mhi_model_read(path[0], &w->file, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    w->bones = *w->file;
    w->bones.n_muscles = w->bones.n_paths = 0;
    const mhe_model_ops *ops = w->model->ops;
    if (mhi_model_create(w->model, test_host(), &w->bones, test_config(w->model, dynamics),
                         &w->model_self, &err) != MHE_OK ||
        ops->context_create(w->model_self, &w->context, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
}

static void close_walk(walk *w) {
    const mhe_model_ops *ops = w->model->ops;
    ops->context_destroy(w->context);
    ops->destroy(w->model_self);
    mhi_description_free(w->file);
}

/* tau at a moment: what the motion takes, less what the loads give. */
static void moments(const walk *w, const mhe_external_loads *loads, double time, const double *q,
                    const double *v, const double *vdot, double *tau) {
    const mhe_model_ops *ops = w->model->ops;
    const mhe_kinematics nothing = {.size = sizeof nothing};
    double values[2 * 9], given[MAX_Q] = {0};
    mhe_error err = {0};
    int32_t row = 0;
    while (row + 2 < loads->n_rows && loads->time[row + 1] <= time) {
        row++;
    }
    const double part = (time - loads->time[row]) / (loads->time[row + 1] - loads->time[row]);
    assert_true(loads->n_loads == 2);
    for (int i = 0; i < 18; i++) {
        const double *a = loads->values + (ptrdiff_t)row * 18 + i;
        values[i] = a[0] + part * (a[18] - a[0]);
    }
    if (ops->kinematics(w->context, q, v, &nothing, &err) != MHE_OK ||
        ops->inverse_dynamics(w->context, vdot, tau, NULL, NULL, &err) != MHE_OK ||
        ops->loads(w->context, loads->loads, 2, values, given, NULL, NULL, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    for (int32_t i = 0; i < w->bones.n_coordinates; i++) {
        tau[i] -= given[i];
    }
}

static void compare(const char *dynamics) {
    walk w;
    mhe_error err = {0};
    mhi_table *ik = NULL, *id = NULL;
    const mhe_external_loads *loads = NULL;
    char data[1024];
    open_walk(&w, dynamics);
    const mhe_description *d = &w.bones;
    const int32_t n_q = d->n_coordinates;
    assert_true(n_q > 0 && n_q <= MAX_Q);
    assert_non_null(test_data_path(data, sizeof data, "walking/gait10dof/reference_ID.sto"));
    if (mhi_sto_read(path[1], &ik, &err) != MHE_OK || mhi_sto_read(data, &id, &err) != MHE_OK ||
        mhi_external_loads.read(path[2], d, &loads, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    double *smoothed = smooth(ik, d), worst[MAX_Q] = {0}, peak[MAX_Q] = {0};
    const int32_t n = ik->n_rows;
    int32_t compared = 0;
    for (int32_t k = REACH; k + REACH < n; k++) {
        double state[3][MAX_Q], tau[MAX_Q];
        for (int32_t i = 0; i < n_q; i++) {
            double of[3];
            derivatives(smoothed + i * n + k, 1 / ik->rate, of);
            for (int j = 0; j < 3; j++) {
                state[j][i] = of[j];
            }
        }
        moments(&w, loads, ik->time[k], state[0], state[1], state[2], tau);
        assert_true(fabs(id->time[k] - ik->time[k]) < 1e-5);
        for (int32_t i = 0; i < n_q && ik->time[k] >= FROM && ik->time[k] <= TO; i++) {
            char label[128];
            (void)snprintf(label, sizeof label, "%s_%s", d->coordinates[i].name,
                           d->coordinates[i].rotational ? "moment" : "force");
            int32_t column = 0;
            while (column < id->n_columns && strcmp(id->labels[column], label) != 0) {
                column++;
            }
            assert_true(column < id->n_columns);
            const double expected = id->values[k * id->n_columns + column];
            peak[i] = fmax(peak[i], fabs(expected));
            worst[i] = fmax(worst[i], fabs(tau[i] - expected));
            compared++;
        }
    }
    assert_true(compared >= 110 * n_q);
    for (int32_t i = 0; i < n_q; i++) {
        print_message("%-18s peak %7.2f, off by at most %.2f %%\n", d->coordinates[i].name, peak[i],
                      100 * worst[i] / peak[i]);
        assert_true(worst[i] <= LIMIT * peak[i]);
    }
    free(smoothed);
    mhi_external_loads.free(loads);
    mhi_table_free(ik);
    mhi_table_free(id);
    close_walk(&w);
}

static void moments_of_the_recursion(void **state) {
    (void)state;
    compare("");
}

static void moments_of_simbody(void **state) {
    (void)state;
    compare("dynamics: simbody");
}

int main(void) {
    static const char *const files[] = {"subject01.osim", "reference_IK.mot",
                                        "subject01_walk_grf.xml"};
    for (int i = 0; i < 3; i++) {
        char name[64];
        (void)snprintf(name, sizeof name, "walking/gait10dof/%s", files[i]);
        if (test_data_path(path[i], sizeof path[i], name) == NULL) {
            return TEST_SKIPPED;
        }
    }
    const struct CMUnitTest tests[] = {cmocka_unit_test(moments_of_the_recursion),
                                       cmocka_unit_test(moments_of_simbody)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

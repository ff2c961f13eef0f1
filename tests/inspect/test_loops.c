/* SPDX-License-Identifier: Apache-2.0 */
/* Loops at OpenSim's assembled poses: closed, kept closed by its speeds, and what they make of the
 * coordinates is its `coupling` (d(all speeds)/d(one speed), least squares over the constraints).
 */
#include "oracle.h"
#include "use.h"

#include "io/model_file.h"

#include <mhe/model.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ROWS 6

typedef struct rig {
    oracle o;
    mhe_description *d;
    const mhe_model_ops *ops;
    void *self, *context;
    int n, n_c;
} rig;

static void open_rig(rig *r, const char *name) {
    const mhe_plugin *model = test_plugin("mhe.model.simbody", MHE_MODEL_IFACE);
    char path[1024], file[512];
    mhe_error err = {0};
    (void)snprintf(file, sizeof file, "opensim/%s.osim", name);
    *r = (rig){0};
    if (model == NULL || !oracle_open(&r->o, name) ||
        test_data_path(path, sizeof path, file) == NULL) {
        skip();
    }
    if (mhi_model_read_unlocked(path, &r->d, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    assert_int_equal(r->d->n_unsupported, 0);
    r->ops = model->ops;
    r->n = r->d->n_coordinates;
    r->n_c = mhe_loop_rows(r->d);
    if (r->ops->create(test_host(), r->d, test_config(model, ""), &r->self, &err) != MHE_OK ||
        r->ops->context_create(r->self, &r->context, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
}

static void close_rig(rig *r) {
    r->ops->context_destroy(r->context);
    r->ops->destroy(r->self);
    mhi_description_free(r->d);
    oracle_close(&r->o);
}

/* gap, rate, and rows of rate_v at the oracle's pose */
static void evaluate(rig *r, const cJSON *pose, double *gap, double *rate, double *rows) {
    double q[MAX_C], v[MAX_C];
    const cJSON *all_q = cJSON_GetObjectItemCaseSensitive(pose, "q");
    const cJSON *all_v = cJSON_GetObjectItemCaseSensitive(pose, "qdot");
    all_v = all_v != NULL ? all_v : cJSON_GetObjectItemCaseSensitive(pose, "u");
    for (int i = 0; i < r->n; i++) {
        q[i] = oracle_value(all_q, r->d->coordinates[i].name);
        v[i] = oracle_value(all_v, r->d->coordinates[i].name);
    }
    const mhe_kinematics none = {.size = sizeof none};
    const mhe_loop_values out = {.size = sizeof out, .gap = gap, .rate = rate, .rate_v = rows};
    assert_int_equal(r->ops->kinematics(r->context, q, v, &none, NULL), MHE_OK);
    assert_int_equal(r->ops->loops(r->context, NULL, &out, NULL), MHE_OK);
}

static void poses_of_opensim_are_closed(void **state) {
    (void)state;
    static const char *const names[] = {"ThoracoscapularShoulderModel",
                                        "CoupledCoordinatesMPPsMomentArmTest"};
    for (int m = 0; m < 2; m++) {
        rig r;
        double worst[2] = {0, 0};
        const cJSON *pose = NULL;
        open_rig(&r, names[m]);
        assert_int_equal(r.n_c, m == 0 ? 3 : 6);
        cJSON_ArrayForEach(pose, r.o.poses) {
            double gap[ROWS], rate[ROWS], rows[ROWS * MAX_C];
            evaluate(&r, pose, gap, rate, rows);
            for (int i = 0; i < r.n_c; i++) {
                worst[0] = fmax(worst[0], fabs(gap[i]));
                worst[1] = fmax(worst[1], fabs(rate[i]));
            }
        }
        print_message("%s: gap %.1e m, rate %.1e m/s\n", names[m], worst[0], worst[1]);
        assert_true(worst[0] < 1e-9 && worst[1] < 1e-9);
        close_rig(&r);
    }
}

/* Largest |row . x| of the loop's rows. */
static double opens(const double *rows, int n_c, int n, const double *x) {
    double worst = 0;
    for (int i = 0; i < n_c; i++) {
        double sum = 0;
        for (int j = 0; j < n; j++) {
            sum += rows[i * n + j] * x[j];
        }
        worst = fmax(worst, fabs(sum));
    }
    return worst;
}

/* The weld leaves the knee one motion: every column of OpenSim's coupling is that motion. */
static void a_weld_couples_as_opensim_says(void **state) {
    (void)state;
    rig r;
    const cJSON *pose = NULL;
    int compared = 0;
    double worst = 0;
    open_rig(&r, "CoupledCoordinatesMPPsMomentArmTest");
    cJSON_ArrayForEach(pose, r.o.poses) {
        double gap[ROWS], rate[ROWS], rows[ROWS * MAX_C];
        const cJSON *coupling = cJSON_GetObjectItemCaseSensitive(pose, "coupling");
        evaluate(&r, pose, gap, rate, rows);
        for (int i = 0; i < r.n; i++) {
            double x[MAX_C], held[MAX_C] = {0}, size = 0;
            const cJSON *column =
                cJSON_GetObjectItemCaseSensitive(coupling, r.d->coordinates[i].name);
            if (column == NULL) {
                continue;
            }
            for (int j = 0; j < r.n; j++) {
                x[j] = oracle_value(column, r.d->coordinates[j].name);
                size = fmax(size, fabs(x[j]));
            }
            held[i] = 1;
            worst = fmax(worst, opens(rows, r.n_c, r.n, x) / size);
            assert_true(opens(rows, r.n_c, r.n, held) > 1e-3); /* alone it opens the weld */
            compared++;
        }
    }
    print_message("%d columns of coupling, opening by %.1e of their size\n", compared, worst);
    assert_true(compared >= 3 * 12);
    assert_true(worst < 1e-6);
    close_rig(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(poses_of_opensim_are_closed),
        cmocka_unit_test(a_weld_couples_as_opensim_says),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

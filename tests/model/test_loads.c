/* SPDX-License-Identifier: Apache-2.0 */
/* External loads on the arm: a weight in the hand is a mass in the hand, derivatives, what is
 * refused. */
#include "use.h"

#include "io/external_loads.h"
#include "io/model_file.h"
#include "model/system.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define MASS 1.5
#define HAND "hand"

static const char *const arm = MHE_TEST_SOURCE_DIR "/models/arm19/arm19.osim";
static const double place[3] = {0.02, -0.2, 0.015}; /* in the hand's frame */

static const char *write_file(const char *name, const char *text) {
    static char path[8][512];
    static int next;
    char *out = path[next++ % 8];
    (void)snprintf(out, 512, "%s/tests/loads_%s", MHE_TEST_BINARY_DIR, name);
    FILE *file = fopen(out, "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
    return out;
}

/* An ExternalLoads of one load; NULL: the usual. */
static const char *loads_xml(const char *body, const char *frame, const char *force,
                             const char *data) {
    char text[1024];
    (void)snprintf(text, sizeof text,
                   "<OpenSimDocument Version=\"40000\">\n<ExternalLoads name=\"l\">\n<objects>\n"
                   "<ExternalForce name=\"weight\">\n<applied_to_body>%s</applied_to_body>\n"
                   "<force_expressed_in_body>ground</force_expressed_in_body>\n"
                   "<point_expressed_in_body>%s</point_expressed_in_body>\n"
                   "<force_identifier>%s</force_identifier>\n"
                   "<point_identifier>p_</point_identifier>\n<torque_identifier/>\n"
                   "</ExternalForce>\n</objects>\n<datafile>%s</datafile>\n</ExternalLoads>\n"
                   "</OpenSimDocument>\n",
                   body, frame, force, data);
    return write_file("loads.xml", text);
}

/* Gravity's pull on the mass, constant, at its place in the hand; the force pulls along gravity. */
static void weight_file(const mhe_description *d) {
    char text[1024];
    (void)snprintf(text, sizeof text,
                   "loads\nversion=1\nnRows=2\nnColumns=7\ninDegrees=no\nendheader\n"
                   "time\tf_x\tf_y\tf_z\tp_x\tp_y\tp_z\n"
                   "0\t%.17g\t%.17g\t%.17g\t%g\t%g\t%g\n10\t%.17g\t%.17g\t%.17g\t%g\t%g\t%g\n",
                   MASS * d->gravity[0], MASS * d->gravity[1], MASS * d->gravity[2], place[0],
                   place[1], place[2], MASS * d->gravity[0], MASS * d->gravity[1],
                   MASS * d->gravity[2], place[0], place[1], place[2]);
    (void)write_file("loads.mot", text);
}

typedef struct rig {
    mhe_description *d;
    mhe_description heavy; /* with the mass in the hand */
    mhe_body bodies[32];
    mhi_system *system;
    mhi_system_context *context;
} rig;

/* The arm with the loads of a file. */
static mhi_system *open_system(const mhe_description *d, const char *yaml, mhe_error *err) {
    const mhe_plugin *model = test_plugin("mhe.model.simbody", MHE_MODEL_IFACE);
    const mhe_plugin *muscle = test_plugin("mhe.muscle.hill", MHE_MUSCLE_IFACE);
    const mhe_plugin *loads = test_plugin("mhe.force.external-loads", MHE_FORCE_IFACE);
    if (model == NULL || muscle == NULL || loads == NULL) {
        skip();
    }
    const mhi_force_setup force = {.plugin = loads, .config = test_config(loads, yaml)};
    const mhi_system_setup setup = {.host = test_host(),
                                    .description = d,
                                    .model = model,
                                    .model_config = test_config(model, ""),
                                    .muscle = muscle,
                                    .muscle_config = test_config(muscle, ""),
                                    .formulation = MHE_FORMULATION_EXCITATION,
                                    .forces = &force,
                                    .n_forces = 1};
    mhi_system *system = NULL;
    (void)mhi_system_create(&setup, &system, err);
    return system;
}

static const char *file_option(const char *path) {
    static char yaml[600];
    (void)snprintf(yaml, sizeof yaml, "{file: \"%s\"}", path);
    return yaml;
}

static void open_rig(rig *r) {
    mhe_error err = {0};
    memset(r, 0, sizeof *r);
    if (mhi_model_read(arm, &r->d, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    weight_file(r->d);
    r->system =
        open_system(r->d, file_option(loads_xml(HAND, HAND, "f_", "loads_loads.mot")), &err);
    if (r->system == NULL || mhi_system_context_create(r->system, &r->context, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
}

static void close_rig(rig *r) {
    mhi_system_context_free(r->context);
    mhi_system_free(r->system);
    mhi_description_free(r->d);
}

/* At rest a mass in the hand and its weight as a load ask the same torques. */
static void a_weight_is_a_mass_at_rest(void **state) {
    (void)state;
    rig r;
    open_rig(&r);
    const mhe_description *d = r.d;
    const int32_t n_q = d->n_coordinates;
    mhe_error err = {0};
    assert_true(d->n_bodies <= 32 && n_q == 4);
    memcpy(r.bodies, d->bodies, sizeof *d->bodies * (size_t)d->n_bodies);
    int32_t hand = 0;
    while (hand < d->n_bodies && strcmp(d->bodies[hand].name, HAND) != 0) {
        hand++;
    }
    assert_true(hand < d->n_bodies);
    mhe_body *b = &r.bodies[hand];
    const double total = b->mass + MASS;
    for (int i = 0; i < 3; i++) { /* a point beside the hand's own mass; its inertia plays no part
                                   * at rest */
        b->com[i] = (b->mass * b->com[i] + MASS * place[i]) / total;
    }
    b->mass = total;
    r.heavy = *d;
    r.heavy.bodies = r.bodies;
    const mhe_plugin *model = test_plugin("mhe.model.simbody", MHE_MODEL_IFACE);
    const mhe_model_ops *ops = model->ops;
    void *self[2], *context[2];
    const mhe_description *of[2] = {d, &r.heavy};
    for (int k = 0; k < 2; k++) {
        assert_int_equal(ops->create(test_host(), of[k], test_config(model, ""), &self[k], &err),
                         MHE_OK);
        assert_int_equal(ops->context_create(self[k], &context[k], &err), MHE_OK);
    }
    uint64_t seed = 3;
    double worst = 0, largest = 0;
    for (int trial = 0; trial < 20; trial++) {
        double q[4], v[4] = {0}, bias[2][4], w[9], load[4] = {0};
        for (int i = 0; i < 4; i++) {
            q[i] = test_random(&seed, -0.8, 0.8);
        }
        for (int k = 0; k < 2; k++) {
            const mhe_kinematics out = {.size = sizeof out, .bias = bias[k]};
            assert_int_equal(ops->kinematics(context[k], q, v, &out, &err), MHE_OK);
        }
        assert_int_equal(mhi_system_inputs(r.system, 3.2, w, &err), MHE_OK);
        const mhe_load as = {hand, -1, hand};
        assert_int_equal(ops->loads(context[0], &as, 1, w, load, NULL, NULL, &err), MHE_OK);
        for (int i = 0; i < 4; i++) { /* the load helps what the bias asks for */
            worst = fmax(worst, fabs(bias[1][i] - bias[0][i] + load[i]));
            largest = fmax(largest, fabs(load[i]));
        }
    }
    print_message("a weight against a mass: %.1e of %.1f N m\n", worst, largest);
    assert_true(largest > 1);
    assert_true(worst < 1e-10);
    for (int k = 0; k < 2; k++) {
        ops->context_destroy(context[k]);
        ops->destroy(self[k]);
    }
    close_rig(&r);
}

typedef struct point {
    rig *r;
    const double *a, *w;
} point;

/* vdot at z = [q v] */
static int acceleration(void *data, const double *z, double *vdot) {
    const point *p = data;
    const mhe_system *s = mhi_system_face(p->r->system);
    const mhe_system_point at = {.size = sizeof at, .q = z, .v = z + s->n_q, .a = p->a, .w = p->w};
    const mhe_acceleration out = {.size = sizeof out, .vdot = vdot};
    return s->acceleration(s, p->r->context, &at, &out, NULL);
}

static void accelerations_under_a_load_match_differences(void **state) {
    (void)state;
    rig r;
    open_rig(&r);
    const mhe_system *s = mhi_system_face(r.system);
    enum { Q = 4 };
    assert_int_equal(s->n_q, Q);
    assert_int_equal(s->n_w, 9);
    double z[2 * Q], a[64], w[9], vdot[Q], q[Q * Q], v[Q * Q], jacobian[Q * 2 * Q], bare[Q];
    uint64_t seed = 5;
    for (int trial = 0; trial < 5; trial++) {
        for (int i = 0; i < 2 * Q; i++) {
            z[i] = i < Q ? test_random(&seed, -0.5, 0.5) : test_random(&seed, 0.5, 3);
        }
        for (int32_t i = 0; i < s->n_m; i++) {
            a[i] = test_random(&seed, 0.1, 0.5);
        }
        for (int i = 0; i < 9; i++) {
            w[i] = test_random(&seed, -10, 10) * (i / 3 == 1 ? 0.03 : 1);
        }
        point p = {&r, a, w};
        const mhe_system_point at = {.size = sizeof at, .q = z, .v = z + Q, .a = a, .w = w};
        const mhe_acceleration out = {.size = sizeof out, .vdot = vdot, .vdot_q = q, .vdot_v = v};
        assert_int_equal(s->acceleration(s, r.context, &at, &out, NULL), MHE_OK);
        for (int i = 0; i < Q; i++) {
            memcpy(jacobian + i * 2 * Q, q + i * Q, sizeof(double) * Q);
            memcpy(jacobian + i * 2 * Q + Q, v + i * Q, sizeof(double) * Q);
        }
        const double error = test_jacobian_error(acceleration, &p, z, 2 * Q, Q, jacobian);
        assert_true(error >= 0 && error < 1e-7);
        memset(w, 0, sizeof w);
        assert_int_equal(acceleration(&p, z, bare), 0);
        assert_true(fabs(bare[0] - vdot[0]) > 1e-3); /* the load acts */
    }
    w[4] = NAN;
    point p = {&r, a, w};
    assert_int_equal(acceleration(&p, z, bare), MHE_RETRY);
    close_rig(&r);
}

static void what_is_refused(void **state) {
    (void)state;
    rig r;
    open_rig(&r);
    const char *one_row = "x\nnRows=1\nnColumns=6\nendheader\ntime\tf_x\tf_y\tf_z\tp_x\tp_y\tp_z\n"
                          "0\t1\t2\t3\t0\tnan\t0\n";
    (void)write_file("holes.mot", one_row);
    const struct {
        const char *body, *frame, *force, *data, *says;
    } cases[] = {
        {"r_hand", "ground", "f_", "loads_loads.mot",
         "loads.xml:5: applied_to_body: the model has no body 'r_hand'"},
        {HAND, "grund", "f_", "loads_loads.mot",
         "loads.xml:7: point_expressed_in_body: the model has no body 'grund'"},
        {"ground", "ground", "f_", "loads_loads.mot", "a body is needed, not ground"},
        {HAND, "ground", "force_", "loads_loads.mot",
         "loads.xml:8: force_identifier: " MHE_TEST_BINARY_DIR
         "/tests/loads_loads.mot has no column 'force_x'"},
        {HAND, "ground", "f_", "loads_absent.mot", "loads_absent.mot"},
        {HAND, "ground", "f_", "loads_holes.mot", "holes.mot:6: column 'p_y' has no value at 0 s"},
        {HAND, "ground", "f_", "", "no <datafile>"},
        {NULL, NULL, NULL, NULL, "broken.xml:3: not XML"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const mhe_external_loads *loads = NULL;
        mhe_error err = {0};
        const char *file =
            cases[i].body == NULL
                ? write_file("broken.xml", "<ExternalLoads>\n<objects>\n")
                : loads_xml(cases[i].body, cases[i].frame, cases[i].force, cases[i].data);
        assert_int_equal(mhi_external_loads.read(file, r.d, &loads, &err), MHE_E_INPUT);
        assert_null(loads);
        if (strstr(err.text, cases[i].says) == NULL) {
            fail_msg("'%s' does not say '%s'", err.text, cases[i].says);
        }
    }
    close_rig(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_weight_is_a_mass_at_rest),
        cmocka_unit_test(accelerations_under_a_load_match_differences),
        cmocka_unit_test(what_is_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* The force of a joint as a signal: is it what output.reactions says, are its derivatives exact
 * (loops, wrapped paths, elastic tendons, loads, ligaments), and is what cannot be known refused?
 */
#include "fixture.h"
#include "model/joint_force.h"
#include "model/joints.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TOLERANCE 1e-6
#define SHOULDER "opensim/ThoracoscapularShoulderModel.osim"
#define COSTS "costs: [{plugin: mhe.cost.track, value: [0]}]\n"

typedef struct rig {
    test_fixture f;
    mhi_joint_force *joint;
    mhi_joint_force_context *context;
    const mhe_system *face;
    int32_t width, activation;
    double w[32];
} rig;

static void open_rig(rig *r, const char *yaml, const char *joint) {
    if (test_fixture_open(&r->f, yaml) != MHE_OK ||
        mhi_joint_force_create(r->f.system, joint, &r->joint, &r->f.err) != MHE_OK ||
        mhi_joint_force_context_create(r->joint, &r->context, &r->f.err) != MHE_OK) {
        fail_msg("%s", r->f.err.text);
    }
    const mhi_signals *signals = mhi_ocp_signals(r->f.ocp);
    r->face = mhi_system_face(r->f.system);
    r->width = r->face->n_x + r->face->n_u;
    r->activation = signals->signal[MHI_SIGNAL_ACTIVATION].column;
    assert_true(r->face->n_w <= 32);
    assert_int_equal(mhi_system_inputs(r->f.system, 0.3, r->w, &r->f.err), MHE_OK);
}

static void close_rig(rig *r) {
    mhi_joint_force_context_free(r->context);
    mhi_joint_force_free(r->joint);
    test_fixture_close(&r->f);
}

static int value(void *data, const double *z, double *y) {
    rig *r = data;
    mhe_system_point at;
    mhi_system_point(r->f.system, z, z + r->face->n_x, r->w, &at);
    return mhi_joint_force_evaluate(r->context, mhi_ocp_context(r->f.ocp), &at, r->width,
                                    r->activation, y, NULL, NULL);
}

/* About the default posture, where paths and loops are whole. */
static void point_near(const rig *r, uint64_t *seed, double *z) {
    const mhe_system *s = r->face;
    const mhe_description *d = mhi_system_description(r->f.system);
    for (int32_t i = 0; i < s->n_x + s->n_u; i++) {
        const int torque = i >= s->n_x + s->n_m;
        z[i] = i < s->n_q       ? d->coordinates[i].value + test_random(seed, -0.05, 0.05)
               : i < 2 * s->n_q ? test_random(seed, -1, 1)
               : torque         ? test_random(seed, -5, 5)
                                : test_random(seed, 0.1, 0.9);
    }
    if (s->n_z > 0) { /* tendons that are in balance */
        double activation[64];
        assert_true(s->n_m <= 64);
        memcpy(activation, z + s->first_d, sizeof *z * (size_t)s->n_m);
        assert_int_equal(
            mhi_system_equilibrium(mhi_ocp_context(r->f.ocp), z, z + s->n_q, activation, z, NULL),
            MHE_OK);
    }
}

/* As output.reactions in the parent's axes; its setup from the fixture's. */
static void matches_reactions(rig *r, const char *joint, const double *z) {
    const mhe_description *d = mhi_system_description(r->f.system);
    const mhi_system_setup setup = {.host = &r->f.host,
                                    .description = d,
                                    .model = r->f.run->model.plugin,
                                    .model_config = r->f.run->model.config};
    mhi_reactions *all = NULL;
    int compared = 0;
    double force[3], *out = calloc((size_t)(6 * d->n_bodies), sizeof *out);
    mhe_system_point at;
    mhi_system_point(r->f.system, z, z + r->face->n_x, r->w, &at);
    assert_int_equal(mhi_reactions_create(&setup, r->f.system, &all, &r->f.err), MHE_OK);
    assert_int_equal(
        mhi_reactions_solve(all, mhi_ocp_context(r->f.ocp), &at, MHI_IN_PARENT, out, &r->f.err),
        MHE_OK);
    assert_int_equal(value(r, z, force), 0);
    for (int32_t i = 0; i < d->n_bodies; i++) {
        for (int32_t k = 0; k < 3 && (strcmp(d->bodies[i].name, joint) == 0 ||
                                      (d->joints != NULL && d->joints[i] != NULL &&
                                       strcmp(d->joints[i], joint) == 0));
             k++) {
            assert_true(fabs(out[6 * i + k] - force[k]) < 1e-8 * (1 + fabs(force[k])));
            compared++;
        }
    }
    assert_int_equal(compared, 3);
    mhi_reactions_free(all);
    free(out);
}

static void check(const char *yaml, const char *joint, int compare) {
    rig r = {0};
    uint64_t seed = 3;
    open_rig(&r, yaml, joint);
    double *z = calloc((size_t)r.width, sizeof *z),
           *by_z = calloc((size_t)(3 * r.width), sizeof *z);
    double force[3], worst = 0;
    for (int32_t trial = 0; trial < 3; trial++) {
        mhe_system_point at;
        point_near(&r, &seed, z);
        mhi_system_point(r.f.system, z, z + r.face->n_x, r.w, &at);
        assert_int_equal(mhi_joint_force_evaluate(r.context, mhi_ocp_context(r.f.ocp), &at, r.width,
                                                  r.activation, force, by_z, &r.f.err),
                         MHE_OK);
        const double error = test_jacobian_error(value, &r, z, r.width, 3, by_z);
        worst = error >= 0 && error < worst ? worst : error;
        assert_true(fabs(force[0]) + fabs(force[1]) + fabs(force[2]) > 1);
        if (compare && trial == 0) {
            matches_reactions(&r, joint, z);
        }
    }
    print_message("%s: worst %.1e\n", joint, worst);
    assert_true(worst < TOLERANCE);
    free(z);
    free(by_z);
    close_rig(&r);
}

static void of_the_arm(void **state) {
    (void)state;
    check("model: {file: $ARM19}\nmuscle: {curves: degroote2016}\nformulation: activation\n"
          "bounds: {residual_torques: true}\ndata: {external_loads: " MHE_TEST_SOURCE_DIR
          "/tests/ocp/hand_loads.xml}\n" COSTS,
          "Arm", 1);
    check("model: {file: $ARM19}\nmuscle: {curves: degroote2016, tendon: elastic}\n" COSTS,
          "LowerArm1", 1);
}

static void of_a_shoulder_with_a_loop(void **state) {
    (void)state;
    char path[1024], yaml[1536];
    if (test_data_path(path, sizeof path, SHOULDER) == NULL) {
        skip();
    }
    (void)snprintf(yaml, sizeof yaml,
                   "model: {file: %s}\nmuscle: {curves: degroote2016, passive: 0}\n"
                   "formulation: activation\nbounds: {residual_torques: true}\n" COSTS,
                   path);
    check(yaml, "GlenoHumeral", 1);
}

static void refuses(const char *yaml, const char *joint, const char *says) {
    test_fixture f;
    mhi_joint_force *j = NULL;
    if (test_fixture_open(&f, yaml) != MHE_OK) {
        fail_msg("%s", f.err.text);
    }
    assert_true(mhi_joint_force_create(f.system, joint, &j, &f.err) < 0);
    assert_null(j);
    assert_non_null(strstr(f.err.text, says));
    test_fixture_close(&f);
}

static void names_the_joints_there_are(void **state) {
    (void)state;
    refuses("model: {file: $ARM19}\n" COSTS, "Elbow", "no joint 'Elbow' (it has ");
}

static void refuses_a_joint_within_a_loop(void **state) {
    (void)state;
    char path[1024], yaml[1536];
    if (test_data_path(path, sizeof path, SHOULDER) == NULL) {
        skip();
    }
    (void)snprintf(yaml, sizeof yaml, "model: {file: %s}\n" COSTS, path);
    refuses(yaml, "scapulothoracic", "loop 'AC' acts across it");
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(of_the_arm),
                                       cmocka_unit_test(of_a_shoulder_with_a_loop),
                                       cmocka_unit_test(names_the_joints_there_are),
                                       cmocka_unit_test(refuses_a_joint_within_a_loop)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

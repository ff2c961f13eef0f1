/* SPDX-License-Identifier: Apache-2.0 */
/* output.reactions: what joints transmit along an estimated motion, in all axes; and of a posture
 * that is held, the weight of what hangs on each joint. */
#include "estimator/recording.h"
#include "fixture.h"
#include "model/joints.h"
#include "support.h"

#include <math.h>
#include <string.h>

#define N_K 8
#define N_M 19
#define N_Q 4
#define N_FRAMES 24
#define BODIES 32
#define MODELS MHE_TEST_SOURCE_DIR "/models/arm19/"
#define CONFIG                                                                             \
    "model: {file: $ARM19}\nmuscle: {curves: paper2021}\nhorizon: {window: 5, ratio: 3}\n" \
    "solver: {plugin: mhe.solver.rti}\ncosts: [mhe.cost.emg-markers-high]\n"               \
    "data: {markers: " MODELS "demo_markers.trc, emg: " MODELS "demo_emg.sto}\n"

typedef struct answer {
    double reaction[6 * BODIES], q[N_Q];
    char name[BODIES][128];
    int32_t n;
} answer;

/* The first estimate, by the axes of `output`. */
static void estimate(const char *output, answer *out) {
    char yaml[2048];
    test_fixture f;
    mhi_recording *r = NULL;
    (void)snprintf(yaml, sizeof yaml, CONFIG "output: {%s}\n", output);
    if (test_fixture_open(&f, yaml) != MHE_OK ||
        mhi_recording_read(f.run, mhi_system_description(f.system), &f.host, &r, &f.err) !=
            MHE_OK) {
        fail_msg("%s", f.err.text);
    }
    mhe_estimator_info info = {.size = sizeof info};
    assert_int_equal(mhe_estimator_describe(f.estimator, &info), MHE_OK);
    out->n = -1;
    for (int32_t k = 0; k < N_FRAMES && out->n < 0; k++) {
        mhe_estimate e = {.size = sizeof e};
        int32_t ready = 0;
        const mhe_frame frame = mhi_recording_frame(r, N_K, N_M, k);
        assert_int_equal(mhe_estimator_push(f.estimator, &frame, &e, &ready, &f.err), MHE_OK);
        if (!ready) {
            continue;
        }
        out->n = info.n_joints;
        assert_true(info.n_joints <= BODIES && (info.n_joints > 0) == (e.reactions != NULL));
        memcpy(out->q, e.q, sizeof out->q);
        for (int32_t i = 0; i < 6 * info.n_joints; i++) {
            assert_true(isfinite(e.reactions[i]));
            out->reaction[i] = e.reactions[i];
            (void)snprintf(out->name[i / 6], sizeof out->name[0], "%s", info.joint_names[i / 6]);
        }
    }
    assert_true(out->n >= 0);
    mhi_recording_free(r);
    test_fixture_close(&f);
}

static double size(const double *v) {
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static void axes_turn_the_same_vectors(void **state) {
    static answer child, parent, ground, none;
    double largest = 0;
    (void)state;
    estimate("reactions: child", &child);
    estimate("reactions: parent", &parent);
    estimate("reactions: ground", &ground);
    estimate("reactions: none", &none);
    assert_int_equal(none.n, 0);
    assert_true(child.n > 3 && parent.n == child.n && ground.n == child.n);
    int32_t turned = 0;
    for (int32_t i = 0; i < 2 * child.n; i++) {
        const double *a = child.reaction + 3 * i, *b = parent.reaction + 3 * i;
        const double *c = ground.reaction + 3 * i;
        assert_true(fabs(size(a) - size(c)) < 1e-9 * (1 + size(c)));
        assert_true(fabs(size(b) - size(c)) < 1e-9 * (1 + size(c)));
        turned += fabs(a[0] - c[0]) + fabs(a[1] - c[1]) > 1e-3 * size(c) + 1e-6;
        largest = fmax(largest, size(c));
    }
    assert_true(turned > 0 && largest > 100); /* muscles press joints together */
    assert_non_null(strstr(ground.name[0], "_in_ground"));
    assert_string_not_equal(child.name[child.n - 1], parent.name[child.n - 1]);
}

/* At rest, without any muscle: joints hold up what hangs on them. */
static void joints_hold_up_the_weight(void **state) {
    test_fixture f;
    mhi_reactions *r = NULL;
    (void)state;
    assert_int_equal(test_fixture_open(&f, CONFIG), MHE_OK);
    const mhe_description *d = mhi_system_description(f.system);
    mhe_description bare = *d;
    bare.n_muscles = bare.n_paths = 0;
    const mhi_system_setup setup = {.host = &f.host,
                                    .description = &bare,
                                    .model = f.run->model.plugin,
                                    .model_config = f.run->model.config,
                                    .muscle = f.run->muscle.plugin,
                                    .muscle_config = f.run->muscle.config,
                                    .residual_torques = 1};
    mhi_system *system = NULL;
    mhi_system_context *context = NULL;
    if (mhi_system_create(&setup, &system, &f.err) != MHE_OK ||
        mhi_system_context_create(system, &context, &f.err) != MHE_OK ||
        mhi_reactions_create(&setup, system, &r, &f.err) != MHE_OK) {
        fail_msg("%s", f.err.text);
    }
    const mhe_system *face = mhi_system_face(system);
    double x[2 * N_Q] = {0.2, -0.3, 0.1, 0.8}, u[N_Q] = {0}, out[6 * BODIES], vdot[N_Q];
    mhe_system_point at;
    mhe_acceleration wanted = {.size = sizeof wanted, .vdot = vdot};
    mhi_system_point(system, x, u, NULL, &at);
    double A[N_Q][N_Q + 1]; /* torques that keep it still: vdot is linear in them */
    for (int32_t j = -1; j < N_Q; j++) {
        memset(u, 0, sizeof u);
        if (j >= 0) {
            u[j] = 1;
        }
        assert_int_equal(face->acceleration(face, context, &at, &wanted, &f.err), MHE_OK);
        for (int32_t i = 0; i < N_Q; i++) {
            A[i][j < 0 ? N_Q : j] = j < 0 ? -vdot[i] : vdot[i] + A[i][N_Q];
        }
    }
    for (int32_t k = 0; k < N_Q; k++) { /* Gauss-Jordan */
        for (int32_t i = 0; i < N_Q; i++) {
            const double factor = i == k ? 0 : A[i][k] / A[k][k];
            for (int32_t j = 0; j <= N_Q; j++) {
                A[i][j] -= factor * A[k][j];
            }
        }
    }
    for (int32_t k = 0; k < N_Q; k++) {
        u[k] = A[k][N_Q] / A[k][k];
    }
    assert_int_equal(mhi_reactions_solve(r, context, &at, MHI_IN_GROUND, out, &f.err), MHE_OK);
    for (int32_t i = 0; i < d->n_bodies; i++) {
        double mass = 0;
        for (int32_t k = 0; k < d->n_bodies; k++) { /* of all that hangs on body i */
            int32_t up = k;
            while (up > i) {
                up = d->bodies[up].parent;
            }
            mass += up == i ? d->bodies[k].mass : 0;
        }
        for (int32_t k = 0; k < 3; k++) {
            assert_true(fabs(out[6 * i + k] + mass * d->gravity[k]) < 1e-6);
        }
    }
    mhi_reactions_free(r);
    mhi_system_context_free(context);
    mhi_system_free(system);
    test_fixture_close(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(axes_turn_the_same_vectors),
                                       cmocka_unit_test(joints_hold_up_the_weight)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

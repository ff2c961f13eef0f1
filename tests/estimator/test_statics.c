/* SPDX-License-Identifier: Apache-2.0 */
/* Static optimisation that a window begins with: activations and torques make the motion that was
 * asked for, with no more effort than another way, and where it cannot be done it says so. */
#include "base/arena.h"
#include "estimator/statics.h"
#include "fixture.h"
#include "support.h"

#include <math.h>
#include <string.h>

#define MOST 64

typedef struct subject {
    test_fixture f;
    mhi_system_context *context;
    const mhe_system *face;
    mhi_arena arena;
    mhi_statics statics;
    double q[MOST], v[MOST];
} subject;

static void subject_open(subject *s, const char *config) {
    memset(s, 0, sizeof *s);
    if (test_fixture_open(&s->f, config) != MHE_OK) {
        fail_msg("%s", s->f.err.text);
    }
    mhe_error err = {0};
    s->face = mhi_system_face(s->f.system);
    assert_true(s->face->n_q <= MOST && s->face->n_m <= MOST && s->face->n_r <= MOST);
    assert_int_equal(mhi_system_context_create(s->f.system, &s->context, &err), MHE_OK);
    assert_int_equal(mhi_statics_create(&s->statics, s->f.system, &s->arena, &err), MHE_OK);
    const mhe_description *d = mhi_system_description(s->f.system);
    for (int32_t i = 0; i < s->face->n_q; i++) {
        s->q[i] = d->coordinates[i].value + 0.1 * sin(1 + i);
        s->v[i] = cos(2 * i);
    }
}

static void subject_close(subject *s) {
    mhi_system_context_free(s->context);
    mhi_arena_free(&s->arena);
    test_fixture_close(&s->f);
}

static void accelerate(subject *s, const double *a, const double *r, double *vdot) {
    const mhe_system_point at = {.size = sizeof at, .q = s->q, .v = s->v, .a = a, .c = a, .r = r};
    const mhe_acceleration out = {.size = sizeof out, .vdot = vdot};
    mhe_error err = {0};
    if (s->face->acceleration(s->face, s->context, &at, &out, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
}

static double effort(const double *a, int32_t n) {
    double sum = 0;
    for (int32_t i = 0; i < n; i++) {
        sum += a[i] * a[i];
    }
    return sum;
}

static void a_motion_comes_back_with_less_effort(void **state) {
    (void)state;
    static const char *const formulations[] = {"activation", "excitation"};
    for (int k = 0; k < 2; k++) {
        char config[512];
        subject s;
        (void)snprintf(config, sizeof config,
                       "model:\n  file: $ARM19\nformulation: %s\nbounds: {residual_torques: "
                       "true}\ncosts: [mhe.cost.emg-markers-high]\n",
                       formulations[k]);
        subject_open(&s, config);
        double known[MOST], a[MOST], lower[MOST], upper[MOST], r[MOST] = {0}, wanted[MOST],
                                                               vdot[MOST], unlike = 0;
        for (int32_t i = 0; i < s.face->n_m; i++) {
            known[i] = 0.3 + 0.25 * sin(3 * i);
            a[i] = 0.1;
            lower[i] = 0.01;
            upper[i] = 0.6;
        }
        accelerate(&s, known, r, wanted);
        accelerate(&s, a, r, vdot);
        for (int32_t i = 0; i < s.face->n_q; i++) {
            unlike = fmax(unlike, fabs(vdot[i] - wanted[i]));
        }
        assert_true(unlike > 1);
        assert_int_equal(
            mhi_statics_solve(&s.statics, s.context, s.q, s.v, NULL, wanted, lower, upper, a, r),
            0);
        accelerate(&s, a, r, vdot);
        for (int32_t i = 0; i < s.face->n_q; i++) {
            assert_true(fabs(vdot[i] - wanted[i]) < 0.01 * unlike); /* all but linear in a */
        }
        for (int32_t i = 0; i < s.face->n_m; i++) {
            assert_true(a[i] >= lower[i] && a[i] <= upper[i]);
        }
        print_message("%s: effort %.3f of %.3f, unlike by %.1f rad/s^2 before\n", formulations[k],
                      effort(a, s.face->n_m), effort(known, s.face->n_m), unlike);
        assert_true(effort(a, s.face->n_m) < effort(known, s.face->n_m));
        /* the muscles do it, not the torques: without these little is missing */
        double without[MOST] = {0}, missing = 0;
        accelerate(&s, a, without, vdot);
        for (int32_t i = 0; i < s.face->n_q; i++) {
            missing = fmax(missing, fabs(vdot[i] - wanted[i]));
        }
        assert_true(missing < 0.2 * unlike);
        /* nothing is made of a state that is none */
        s.q[0] = NAN;
        a[0] = 0.25;
        assert_int_not_equal(
            mhi_statics_solve(&s.statics, s.context, s.q, s.v, NULL, wanted, lower, upper, a, r),
            0);
        assert_true(a[0] == 0.25);
        subject_close(&s);
    }
}

static void elastic_tendons_are_left_alone(void **state) {
    (void)state;
    subject s;
    double x[MOST] = {0};
    subject_open(&s, "model:\n  file: $ARM19\nmuscle: {curves: degroote2016, tendon: elastic}\n"
                     "costs: [mhe.cost.emg-markers-high]\n");
    assert_int_not_equal(mhi_statics_solve(&s.statics, s.context, s.q, s.v, NULL, x, x, x, x, x),
                         0);
    subject_close(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_motion_comes_back_with_less_effort),
                                       cmocka_unit_test(elastic_tendons_are_left_alone)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

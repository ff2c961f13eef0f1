/* SPDX-License-Identifier: Apache-2.0 */
/* Bushings: their force is the slope of their energy, their damping takes what it should, every
 * derivative is exact, and on the neck model they are OpenSim's. */
#include "json.h"
#include "use.h"

#include "io/model_file.h"
#include "model/system.h"

#include <cjson/cJSON.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAX_Q 32

typedef struct rig {
    mhe_description *d;
    mhi_system *system;
    mhi_system_context *context;
    const mhe_system *face;
    const double *other; /* speeds, where positions are varied, and the other way round */
} rig;

static void open_system(rig *r, const char *springs_yaml) {
    const mhe_plugin *model = test_plugin("mhe.model.simbody", MHE_MODEL_IFACE);
    const mhe_plugin *muscle = test_plugin("mhe.muscle.hill", MHE_MUSCLE_IFACE);
    const mhe_plugin *springs = test_plugin("mhe.force.model-springs", MHE_FORCE_IFACE);
    mhe_error err = {0};
    if (model == NULL || muscle == NULL || springs == NULL) {
        skip();
    }
    const mhi_force_setup force = {.plugin = springs, .config = test_config(springs, springs_yaml)};
    const mhi_system_setup setup = {.host = test_host(),
                                    .description = r->d,
                                    .model = model,
                                    .model_config = test_config(model, ""),
                                    .muscle = muscle,
                                    .muscle_config = test_config(muscle, ""),
                                    .formulation = MHE_FORMULATION_EXCITATION,
                                    .forces = &force,
                                    .n_forces = 1};
    if (mhi_system_create(&setup, &r->system, &err) != MHE_OK ||
        mhi_system_context_create(r->system, &r->context, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    r->face = mhi_system_face(r->system);
    assert_true(r->face->n_q <= MAX_Q);
}

/* The two bodies of bushings.osim. */
static void open_chain(rig *r, int damped) {
    mhe_error err = {0};
    *r = (rig){0};
    if (mhi_model_read(MHE_TEST_SOURCE_DIR "/tests/model/bushings.osim", &r->d, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    assert_int_equal(r->d->n_unsupported, 0);
    assert_int_equal(r->d->n_bushings, 2);
    for (int32_t i = 0; i < 2 && !damped; i++) {
        mhe_bushing *b = (mhe_bushing *)(uintptr_t)&r->d->bushings[i];
        memset(b->rotational_damping, 0, sizeof b->rotational_damping);
        memset(b->translational_damping, 0, sizeof b->translational_damping);
    }
    open_system(r, "");
}

static void close_system(rig *r) {
    mhi_system_context_free(r->context);
    mhi_system_free(r->system);
}

static void close_rig(rig *r) {
    close_system(r);
    mhi_description_free(r->d);
}

static void accelerate(rig *r, const double *q, const double *v, const mhe_acceleration *out) {
    static const double activation[128];
    const mhe_system_point at = {
        .size = sizeof at, .q = q, .v = v, .a = activation, .c = activation};
    mhe_error err = {0};
    if (r->face->acceleration(r->face, r->context, &at, out, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
}

/* A model instance beside the system, for masses and poses. */
typedef struct skeleton {
    const mhe_model_ops *ops;
    void *self, *context;
} skeleton;

static void open_skeleton(skeleton *s, const mhe_description *d) {
    const mhe_plugin *model = test_plugin("mhe.model.simbody", MHE_MODEL_IFACE);
    s->ops = model->ops;
    assert_int_equal(s->ops->create(test_host(), d, test_config(model, ""), &s->self, NULL),
                     MHE_OK);
    assert_int_equal(s->ops->context_create(s->self, &s->context, NULL), MHE_OK);
}

static void close_skeleton(skeleton *s) {
    s->ops->context_destroy(s->context);
    s->ops->destroy(s->self);
}

/* What the springs do: M (vdot with them - vdot without). */
static void force_of(rig *with, rig *without, const skeleton *s, const double *q, const double *v,
                     double *tau) {
    const int32_t n = with->face->n_q;
    double mass[MAX_Q * MAX_Q], one[MAX_Q], two[MAX_Q];
    const mhe_kinematics out = {.size = sizeof out, .mass = mass};
    assert_int_equal(s->ops->kinematics(s->context, q, v, &out, NULL), MHE_OK);
    accelerate(with, q, v, &(mhe_acceleration){.size = sizeof(mhe_acceleration), .vdot = one});
    accelerate(without, q, v, &(mhe_acceleration){.size = sizeof(mhe_acceleration), .vdot = two});
    for (int32_t i = 0; i < n; i++) {
        tau[i] = 0;
        for (int32_t j = 0; j < n; j++) {
            tau[i] += mass[i * n + j] * (one[j] - two[j]);
        }
    }
}

/* Angles (x-y-z, body-fixed) and place of frame 2 in frame 1, from the bodies' poses. */
static void deflection(const mhe_bushing *b, const double *body, double *y) {
    static const double ground[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    double x[2][3], r[2][9], m[9];
    for (int k = 0; k < 2; k++) {
        const double *at = b->body[k] < 0 ? ground : body + 12 * b->body[k];
        for (int i = 0; i < 3; i++) {
            x[k][i] = at[i];
            for (int j = 0; j < 3; j++) {
                x[k][i] += at[3 + 3 * i + j] * b->p[k][j];
                r[k][3 * i + j] = 0;
                for (int l = 0; l < 3; l++) {
                    r[k][3 * i + j] += at[3 + 3 * i + l] * b->r[k][3 * l + j];
                }
            }
        }
    }
    for (int i = 0; i < 3; i++) {
        y[3 + i] = 0;
        for (int j = 0; j < 3; j++) {
            y[3 + i] += r[0][3 * j + i] * (x[1][j] - x[0][j]);
            m[3 * i + j] = 0;
            for (int l = 0; l < 3; l++) {
                m[3 * i + j] += r[0][3 * l + i] * r[1][3 * l + j];
            }
        }
    }
    y[0] = atan2(-m[5], m[8]);
    y[1] = asin(m[2]);
    y[2] = atan2(-m[1], m[0]);
}

static double energy(const rig *r, const skeleton *s, const double *q) {
    static const double still[MAX_Q];
    double body[12 * 8], sum = 0;
    const mhe_kinematics out = {.size = sizeof out, .body = body};
    assert_int_equal(s->ops->kinematics(s->context, q, still, &out, NULL), MHE_OK);
    for (int32_t i = 0; i < r->d->n_bushings; i++) {
        const mhe_bushing *b = &r->d->bushings[i];
        double y[6];
        deflection(b, body, y);
        for (int k = 0; k < 3; k++) {
            sum += 0.5 * b->rotational_stiffness[k] * y[k] * y[k] +
                   0.5 * b->translational_stiffness[k] * y[3 + k] * y[3 + k];
        }
    }
    return sum;
}

static void random_state(uint64_t *seed, double *q, double *v) {
    for (int i = 0; i < 6; i++) {
        q[i] = test_random(seed, -0.7, 0.7);
        v[i] = test_random(seed, -2, 2);
    }
}

static void the_force_is_the_slope_of_the_energy(void **state) {
    (void)state;
    rig with, without;
    skeleton s;
    uint64_t seed = 41;
    double worst = 0;
    open_chain(&with, 0);
    without = with;
    open_system(&without, "scale: 0");
    open_skeleton(&s, with.d);
    for (int i = 0; i < 10; i++) {
        double q[6], v[6], tau[MAX_Q];
        random_state(&seed, q, v);
        force_of(&with, &without, &s, q, v, tau);
        for (int k = 0; k < 6; k++) {
            const double h = 1e-4, at = q[k];
            double e[4];
            for (int j = 0; j < 4; j++) {
                q[k] = at + h * (j < 2 ? j - 2 : j - 1);
                e[j] = energy(&with, &s, q);
            }
            q[k] = at;
            const double slope = (e[0] - 8 * e[1] + 8 * e[2] - e[3]) / (12 * h);
            worst = fmax(worst, fabs(tau[k] + slope) / (1 + fabs(slope)));
        }
    }
    print_message("force against the slope of the energy: %.1e\n", worst);
    assert_true(worst < 1e-9);
    close_skeleton(&s);
    close_system(&without);
    close_rig(&with);
}

/* With D = 0.02 K the damping is what the spring would do at the deflection's rate times 0.02: its
 * power is minus the squares of the rates, by the difference of deflections along the motion. */
static void damping_takes_the_squares_of_the_rates(void **state) {
    (void)state;
    rig damped, stiff;
    skeleton s;
    uint64_t seed = 42;
    open_chain(&damped, 1);
    open_chain(&stiff, 0);
    open_skeleton(&s, damped.d);
    for (int i = 0; i < 10; i++) {
        double q[6], v[6], tau[MAX_Q], power = 0, expected = 0;
        random_state(&seed, q, v);
        force_of(&damped, &stiff, &s, q, v, tau);
        for (int k = 0; k < 6; k++) {
            power += tau[k] * v[k];
        }
        const double h = 1e-4;
        for (int32_t b = 0; b < 2; b++) {
            double y[4][6];
            for (int j = 0; j < 4; j++) {
                double at[6], body[12 * 8];
                for (int k = 0; k < 6; k++) {
                    at[k] = q[k] + h * (j < 2 ? j - 2 : j - 1) * v[k];
                }
                const mhe_kinematics out = {.size = sizeof out, .body = body};
                assert_int_equal(s.ops->kinematics(s.context, at, v, &out, NULL), MHE_OK);
                deflection(&damped.d->bushings[b], body, y[j]);
            }
            const double *const damping[2] = {damped.d->bushings[b].rotational_damping,
                                              damped.d->bushings[b].translational_damping};
            for (int k = 0; k < 6; k++) {
                const double rate = (y[0][k] - 8 * y[1][k] + 8 * y[2][k] - y[3][k]) / (12 * h);
                expected -= rate * rate * damping[k / 3][k % 3];
            }
        }
        assert_true(fabs(power - expected) < 1e-8 * (1 + fabs(expected)));
    }
    close_skeleton(&s);
    close_rig(&stiff);
    close_rig(&damped);
}

static int by_q(void *data, const double *q, double *y) {
    rig *r = data;
    accelerate(r, q, r->other, &(mhe_acceleration){.size = sizeof(mhe_acceleration), .vdot = y});
    return 0;
}
static int by_v(void *data, const double *v, double *y) {
    rig *r = data;
    accelerate(r, r->other, v, &(mhe_acceleration){.size = sizeof(mhe_acceleration), .vdot = y});
    return 0;
}

static void derivatives_are_exact(void **state) {
    (void)state;
    rig r;
    uint64_t seed = 43;
    double worst = 0;
    open_chain(&r, 1);
    for (int i = 0; i < 20; i++) {
        double q[6], v[6], vdot[6], vdot_q[36], vdot_v[36];
        random_state(&seed, q, v);
        const mhe_acceleration all = {
            .size = sizeof all, .vdot = vdot, .vdot_q = vdot_q, .vdot_v = vdot_v};
        accelerate(&r, q, v, &all);
        r.other = v;
        worst = fmax(worst, test_jacobian_error(by_q, &r, q, 6, 6, vdot_q));
        r.other = q;
        worst = fmax(worst, test_jacobian_error(by_v, &r, v, 6, 6, vdot_v));
    }
    print_message("derivatives: %.1e\n", worst);
    assert_true(worst < 1e-7);
    close_rig(&r);
}

static double member(const cJSON *object, const char *name) {
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, name);
    return item == NULL ? 0 : item->valuedouble;
}

/* tau [n] += what a record of a bushing ("NAME.body.torque.X" and so on, on a body, in ground)
 * does. */
static void add_record(const rig *r, const cJSON *values, const double *body_q, double *tau) {
    const cJSON *value = NULL;
    const int32_t n = r->face->n_q;
    cJSON_ArrayForEach(value, values) {
        const char *of = strchr(value->string, '.') + 1;
        const char *dot = strchr(of, '.');
        const int moment = strncmp(dot, ".torque.", 8) == 0;
        const int axis = dot[moment ? 8 : 7] - 'X';
        for (int32_t b = 0; b < r->d->n_bodies; b++) {
            const char *name = r->d->bodies[b].name;
            if (strlen(name) == (size_t)(dot - of) && strncmp(name, of, strlen(name)) == 0) {
                const double *row = body_q + (6 * b + (moment ? 0 : 3) + axis) * n;
                for (int32_t j = 0; j < n; j++) {
                    tau[j] += row[j] * value->valuedouble;
                }
            }
        }
    }
}

/* The neck model's eight bushings; they turn only, at the origins of the bodies. */
static void the_necks_bushings_are_opensims(void **state) {
    (void)state;
    char osim[1024], oracle[1024];
    mhe_error err = {0};
    rig with = {0}, without;
    skeleton s;
    double worst = 0, largest = 0;
    if (test_data_path(osim, sizeof osim, "opensim/HYOID.osim") == NULL ||
        test_data_path(oracle, sizeof oracle, "opensim/HYOID.oracle.json") == NULL) {
        skip();
    }
    if (mhi_model_read(osim, &with.d, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    assert_int_equal(with.d->n_bushings, 8);
    assert_int_equal(with.d->n_unsupported, 0);
    open_system(&with, "");
    without = with;
    open_system(&without, "scale: 0");
    open_skeleton(&s, with.d);
    cJSON *root = test_json(oracle);
    const cJSON *pose = NULL;
    double *body_q = calloc((size_t)(6 * with.d->n_bodies * with.face->n_q), sizeof *body_q);
    cJSON_ArrayForEach(pose, cJSON_GetObjectItemCaseSensitive(root, "poses")) {
        const cJSON *q_all = cJSON_GetObjectItemCaseSensitive(pose, "q"), *force = NULL;
        const cJSON *v_all = cJSON_GetObjectItemCaseSensitive(pose, "u");
        double q[MAX_Q], v[MAX_Q], tau[MAX_Q], expected[MAX_Q] = {0};
        for (int32_t i = 0; i < with.face->n_q; i++) {
            q[i] = member(q_all, with.d->coordinates[i].name);
            v[i] = member(v_all, with.d->coordinates[i].name);
        }
        force_of(&with, &without, &s, q, v, tau);
        const mhe_kinematics out = {.size = sizeof out, .body_q = body_q};
        assert_int_equal(s.ops->kinematics(s.context, q, v, &out, NULL), MHE_OK);
        cJSON_ArrayForEach(force, cJSON_GetObjectItemCaseSensitive(pose, "other_forces")) {
            if (strstr(force->string, "Bushing") != NULL) {
                add_record(&with, cJSON_GetObjectItemCaseSensitive(force, "values"), body_q,
                           expected);
            }
        }
        for (int32_t i = 0; i < with.face->n_q; i++) {
            worst = fmax(worst, fabs(tau[i] - expected[i]));
            largest = fmax(largest, fabs(expected[i]));
        }
    }
    print_message("neck: up to %.3g N m, off by %.1e\n", largest, worst);
    assert_true(largest > 1);
    assert_true(worst < 1e-8 * largest);
    free(body_q);
    cJSON_Delete(root);
    close_skeleton(&s);
    close_system(&without);
    close_rig(&with);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_force_is_the_slope_of_the_energy),
        cmocka_unit_test(damping_takes_the_squares_of_the_rates),
        cmocka_unit_test(derivatives_are_exact),
        cmocka_unit_test(the_necks_bushings_are_opensims),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

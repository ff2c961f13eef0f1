/* SPDX-License-Identifier: Apache-2.0 */
/* .bioMod reader: what is read, what is repaired, and what each mistake is called. */
#include "base/pi.h"
#include "io/description_builder.h"
#include "io/model_file.h"
#include "support.h"

#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static mhe_description *parse(const char *text) {
    mhe_description *d = NULL;
    mhe_error err = {0};
    if (mhi_biomod_parse("m.bioMod", text, strlen(text), &d, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    return d;
}

#define ARM                                                                                   \
    "version 3\n"                                                                             \
    "segment Trunk\n RTinMatrix 1 RT 1 0 0 0.1  0 1 0 0.2  0 0 1 0.3  0 0 0 1\n endsegment\n" \
    "segment Arm\n parent Trunk\n RT pi/2 0 -pi/4 zyx 0.5 0 0\n rotations yxy\n mass 2\n"     \
    " inertia 1 0 0 0 2 0 0 0 2.5\n com 0 -0.1 0\nendsegment\n"

static void reads_a_small_arm(void **state) {
    (void)state;
    mhe_description *d =
        parse(ARM "marker M1\n Parent Arm\n position 1 2 3\n technical 1\nendmarker\n"
                  "musclegroup G\n OriginParent Trunk\n InsertionParent Arm\n"
                  "endmusclegroup\n"
                  "muscle Long\n Type hilldegroote\n statetype degroote\n"
                  " musclegroup G\n OriginPosition 0 0 0\n"
                  " InsertionPosition 0 -0.3 0\n optimalLength 0.1\n"
                  " maximalForce 500\n tendonSlackLength 0.2\n PCSA 3\nendmuscle\n"
                  "viapoint a\n parent Arm\n muscle Long\n musclegroup G\n"
                  " position 0 -0.1 0.01\nendviapoint\n"
                  "viapoint a\n parent Trunk\n muscle Long\n musclegroup G\n"
                  " position 0 -0.2 0.01\nendviapoint\n");
    assert_string_equal(d->name, "m");
    assert_true(d->gravity[2] == -9.81);
    assert_int_equal(d->n_bodies, 2);
    assert_int_equal(d->bodies[0].parent, -1);
    assert_int_equal(d->bodies[1].parent, 0);
    assert_true(d->bodies[0].mass == 1e-5);
    assert_true(d->bodies[0].joint_p[1] == 0.2);
    assert_int_equal(d->n_coordinates, 3);
    assert_string_equal(d->coordinates[0].name, "Arm_RotY");
    assert_string_equal(d->coordinates[1].name, "Arm_RotX");
    assert_string_equal(d->coordinates[2].name, "Arm_RotY2");
    assert_true(d->coordinates[2].upper == MHI_PI);
    /* Rz(90) Ry(0) Rx(-45): x goes to y, y goes to -x cos45 - z sin45 */
    const double *r = d->bodies[1].joint_r, half = sqrt(0.5);
    assert_true(fabs(r[3] - 1) < 1e-15 && fabs(r[1] + half) < 1e-15 && fabs(r[7] + half) < 1e-15);
    const mhe_muscle *m = &d->muscles[0];
    assert_int_equal(m->type, MHE_MUSCLE_HILL_DEGROOTE);
    assert_int_equal(d->paths[0].n_points, 4);
    const int bodies[] = {0, 1, 0, 1};
    for (int i = 0; i < 4; i++) {
        assert_int_equal(d->paths[0].points[i].body, bodies[i]);
    }
    assert_true(m->pennation_angle == 0 && isnan(m->max_contraction_velocity));
    assert_int_equal(d->markers[0].body, 1);
    assert_int_equal(d->n_warnings + d->n_unsupported, 0);
    mhi_description_free(d);
}

static void comments_arithmetic_and_variables(void **state) {
    (void)state;
    mhe_description *d =
        parse("/* a comment // of two\n lines */ version 4 // the version\n"
              "gravity 0 -9.81 0\nroot_actuated 1\nexternal_forces 0\n"
              "variables\n $long 0.3\n $twice 2*$long\nendvariables\n"
              "segment A // comment\n translations xz /* rotations xyz */ rotations z\n"
              " rangesQ -1 1\n -(1+2)*$long 1/2\n -2*pi +pi\n mass $twice\n com 0 -$long/3 2e-005\n"
              " meshfile Geometry/a.vtp\n meshcolor 1 0 0\n mesh 0 0 0\n mesh 1 0 0\n"
              " meshrt 0 0 0 xyz 0 0 0\nendsegment\n");
    assert_true(d->gravity[1] == -9.81 && d->gravity[2] == 0);
    assert_int_equal(d->n_coordinates, 3);
    assert_string_equal(d->coordinates[1].name, "A_TransZ");
    assert_int_equal(d->coordinates[1].rotational, 0);
    assert_true(fabs(d->coordinates[1].lower + 0.9) < 1e-15);
    assert_true(d->coordinates[1].upper == 0.5);
    assert_true(d->coordinates[2].lower == -2 * MHI_PI);
    assert_true(d->bodies[0].mass == 0.6);
    assert_true(fabs(d->bodies[0].com[1] + 0.1) < 1e-15 && d->bodies[0].com[2] == 2e-5);
    assert_int_equal(d->bodies[0].n_motions, 3);
    assert_int_equal(d->bodies[0].motions[0].kind, MHE_MOTION_TRANSLATION);
    assert_int_equal(d->n_warnings + d->n_unsupported, 0);
    mhi_description_free(d);
}

static void numbers_do_not_depend_on_the_locale(void **state) {
    (void)state;
    /* a comma locale where the machine has one; without it the test says the same in C */
    (void)setlocale(LC_NUMERIC, "de_DE.UTF-8");
    mhe_description *d = parse("version 3\nsegment A\n mass 2.5\nendsegment\n");
    assert_true(d->bodies[0].mass == 2.5);
    mhi_description_free(d);
    (void)setlocale(LC_NUMERIC, "C");
}

static void unsupported_blocks_are_named(void **state) {
    (void)state;
    mhe_description *d =
        parse(ARM "wrapping W\n parent Arm\n radius 0.1\nendwrapping\n"
                  "imu I\n parent Arm\n position 0 0 0\nendimu\n"
                  "contact C\n parent Arm\nendcontact\nligament L\nendligament\n"
                  "passivetorque P\n type constant\nendpassivetorque\nquux 1 2 3\n");
    assert_int_equal(d->n_unsupported, 5);
    assert_string_equal(d->unsupported[0], "m.bioMod:13: wrapping 'W'");
    assert_string_equal(d->unsupported[4], "m.bioMod:26: passivetorque 'P'");
    assert_int_equal(d->n_warnings, 1);
    assert_string_equal(d->warnings[0], "m.bioMod:29: unknown word 'quux' skipped");
    mhi_description_free(d);
}

static void stray_words_are_skipped(void **state) {
    (void)state;
    mhe_description *d =
        parse("version 3\nsegment A\n z mass 3\n glitter 1 2 3\nendsegment\n/* open\n");
    assert_true(d->bodies[0].mass == 3);
    assert_int_equal(d->n_warnings, 3);
    assert_string_equal(d->warnings[0], "m.bioMod:6: this comment is never closed");
    assert_string_equal(d->warnings[1], "m.bioMod:3: unknown word 'z' skipped");
    assert_string_equal(d->warnings[2], "m.bioMod:4: unknown word 'glitter' skipped");
    mhi_description_free(d);
}

/* A pair of reflections, as osim_to_biomod writes it, cancels: B ends up in place, unturned. */
static void left_handed_frames_are_turned(void **state) {
    (void)state;
    mhe_description *d =
        parse("version 4\nsegment A\n RTinMatrix 1 RT 0 0 1 1  0 1 0 2  1 0 0 3  0 0 0 1\n mass 1\n"
              " com 0 0 0.5\nendsegment\n"
              "segment B\n parent A\n RTinMatrix 1 RT 0 0 1 0  0 1 0 0  1 0 0 0.25  0 0 0 1\n"
              "endsegment\n"
              "marker M\n parent A\n position 0.1 0.2 0.3\nendmarker\n");
    const double marker[] = {1.3, 2.2, 3.1}, com[] = {1.5, 2, 3}, origin[] = {1.25, 2, 3};
    const double *r = d->bodies[0].joint_r, *p = d->bodies[0].joint_p;
    for (int i = 0; i < 3; i++) {
        const double *m = d->markers[0].location, *c = d->bodies[0].com, *o = d->bodies[1].joint_p;
        const double *row = &r[3 * i];
        assert_true(fabs(p[i] + row[0] * m[0] + row[1] * m[1] + row[2] * m[2] - marker[i]) < 1e-15);
        assert_true(fabs(p[i] + row[0] * c[0] + row[1] * c[1] + row[2] * c[2] - com[i]) < 1e-15);
        assert_true(fabs(p[i] + row[0] * o[0] + row[1] * o[1] + row[2] * o[2] - origin[i]) < 1e-15);
        for (int k = 0; k < 3; k++) {
            const double *s = d->bodies[1].joint_r;
            double turned = row[0] * s[k] + row[1] * s[3 + k] + row[2] * s[6 + k];
            assert_true(turned == (i == k));
        }
    }
    assert_true(r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) +
                    r[2] * (r[3] * r[7] - r[4] * r[6]) ==
                1);
    assert_int_equal(d->n_warnings, 1);
    mhi_description_free(d);
}

/* The frame of a body of the tree at q. */
static mhi_transform frame_of(const mhe_description *d, int32_t body, const double *q) {
    mhi_transform x = mhi_transform_identity();
    if (body < 0) {
        return x;
    }
    const mhe_body *b = &d->bodies[body];
    mhi_transform parent = frame_of(d, b->parent, q), joint, moved;
    memcpy(joint.r, b->joint_r, sizeof joint.r);
    memcpy(joint.p, b->joint_p, sizeof joint.p);
    memcpy(moved.r, b->body_r, sizeof moved.r);
    memcpy(moved.p, b->body_p, sizeof moved.p);
    x = mhi_transform_times(&parent, &joint);
    for (int32_t i = 0; i < b->n_motions; i++) {
        const mhe_motion *m = &b->motions[i];
        const double t = mhi_function_value(&m->function, q[m->coordinate]), *a = m->axis;
        mhi_transform step = mhi_transform_identity();
        const double skew[9] = {0, -a[2], a[1], a[2], 0, -a[0], -a[1], a[0], 0};
        for (int r = 0; r < 9 && m->kind == MHE_MOTION_ROTATION; r++) { /* Rodrigues */
            double square = 0;
            for (int k = 0; k < 3; k++) {
                square += skew[r / 3 * 3 + k] * skew[3 * k + r % 3];
            }
            step.r[r] = (r % 4 == 0) + sin(t) * skew[r] + (1 - cos(t)) * square;
        }
        for (int k = 0; k < 3 && m->kind == MHE_MOTION_TRANSLATION; k++) {
            step.p[k] = t * a[k];
        }
        x = mhi_transform_times(&x, &step);
    }
    return mhi_transform_times(&x, &moved);
}

/* Every point is where the product of the file's matrices, reflections and all, puts it: the frame
 * of A swaps x and z, then A slides along z by q0 and turns about x by q1; B sits on it, turned. */
static void a_left_handed_joint_moves_as_the_file_says(void **state) {
    (void)state;
    mhe_description *d =
        parse("version 4\nsegment A\n RTinMatrix 1 RT 0 0 1 1  0 1 0 2  1 0 0 3  0 0 0 1\n"
              " translations z rotations x\nendsegment\n"
              "segment B\n parent A\n RT 0 0 0 xyz 0 0.5 0\n rotations z\nendsegment\n"
              "marker M\n parent A\n position 0.1 0.2 0.3\nendmarker\n"
              "marker N\n parent B\n position 0.1 0.2 0.3\nendmarker\n");
    const double q[3] = {0.2, 0.7, -0.4};
    const double on_b[3] = {0.1 * cos(q[2]) - 0.2 * sin(q[2]),
                            0.5 + 0.1 * sin(q[2]) + 0.2 * cos(q[2]), 0.3};
    const double in_a[2][3] = {{0.1, 0.2, 0.3}, {on_b[0], on_b[1], on_b[2]}};
    for (int i = 0; i < 2; i++) {
        const double *p = in_a[i];
        const double turned[3] = {p[0], cos(q[1]) * p[1] - sin(q[1]) * p[2],
                                  q[0] + sin(q[1]) * p[1] + cos(q[1]) * p[2]};
        const double want[3] = {1 + turned[2], 2 + turned[1], 3 + turned[0]};
        const mhe_marker *m = &d->markers[i];
        const mhi_transform x = frame_of(d, m->body, q);
        double is[3];
        mhi_transform_point(&x, m->location, is);
        for (int k = 0; k < 3; k++) {
            assert_true(fabs(is[k] - want[k]) < 1e-12);
        }
    }
    assert_string_equal(d->warnings[0],
                        "m.bioMod:2: the frame of body 'A' is left-handed: its z axis is flipped");
    mhi_description_free(d);
}

static void what_exports_do_is_read(void **state) {
    (void)state;
    static const char bom[] = "\xef\xbb\xbf" ARM;
    mhe_description *d = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_model_parse("m.bioMod", bom, sizeof bom - 1, &d, &err), MHE_OK);
    assert_int_equal(d->n_bodies, 2);
    mhi_description_free(d);
    d = parse("VERSION 4\nSEGMENT A\n MASS 3\nENDSEGMENT\n"
              "MARKER M\n PARENT A\n POSITION 1 2 3\n axestoremove xy\nENDMARKER\n"
              "marker M\n parent A\n position 4 5 6\nendmarker\n"
              "customrt F\n parent A\n rt 0 0 0 xyz 0 0 0\nendcustomrt\n");
    assert_true(d->bodies[0].mass == 3);
    assert_int_equal(d->n_markers, 1);
    assert_true(d->markers[0].location[2] == 3);
    assert_int_equal(d->n_unsupported, 0);
    assert_int_equal(d->n_warnings, 3);
    assert_non_null(strstr(d->warnings[0], "m.bioMod:8: axestoremove of marker 'M'"));
    assert_non_null(strstr(d->warnings[1], "m.bioMod:14: customrt 'F'"));
    assert_non_null(strstr(d->warnings[2], "m.bioMod:10: marker 'M' is there twice: the first, in "
                                           "line 5, is used"));
    mhi_description_free(d);
}

#define MUSCLE(lines)                                                                       \
    ARM "musclegroup G\n OriginParent Trunk\n InsertionParent Arm\nendmusclegroup\n"        \
        "muscle Long\n musclegroup G\n OriginPosition 0 0 0\n InsertionPosition 0 -0.3 0\n" \
        " optimalLength 0.1\n maximalForce 500\n" lines "endmuscle\n"

static void mistakes_are_named_with_their_line(void **state) {
    (void)state;
    const struct {
        const char *text, *message;
    } cases[] = {
        {"",
         "m:1: neither an .osim (XML) nor a .bioMod, which begins with 'version 1' to 'version 4'"},
        {"version 9\n",
         "m:1: neither an .osim (XML) nor a .bioMod, which begins with 'version 1' to 'version 4'"},
        {"version 3\nsegment A\n mass -1\nendsegment\n",
         "m:2: body 'A' has a negative mass (-1 kg)"},
        {"version 3\nsegment A\n mass two\nendsegment\n",
         "m:3: 'mass' needs 1 number; 'two' is none"},
        {"version 3\nsegment A\n mass 1/0\nendsegment\n", "m:3: '1/0' of 'mass' is not finite"},
        {"version 3\nsegment A\n com 1 2\nendsegment\n",
         "m:4: 'com' needs 3 numbers; 'endsegment' is none"},
        {"version 3\nsegment A\n rt 0 0 0 xyw 0 0 0\nendsegment\n",
         "m:3: 'xyw' is no sequence of three axes such as xyz"},
        {"version 3\nsegment A\n rtinmatrix 1\n rt 2 0 0 0  0 1 0 0  0 0 1 0  0 0 0 "
         "1\nendsegment\n",
         "m:2: the frame of body 'A' is not a rotation (R'R is off by 3)"},
        {"version 3\nsegment A\n rotations xyzx\nendsegment\n",
         "m:3: 'rotations xyzx': up to 3 of the axes x, y, z are possible"},
        {"version 3\nsegment A\n rotations xy\n ranges -1 1\nendsegment\n",
         "m:4: segment 'A' has 2 degrees of freedom: 4 numbers, not 2"},
        {"version 3\nsegment A\n rotations x\n ranges 1 -1\nendsegment\n",
         "m:2: the range of coordinate 'A_RotX' ends (-1) before it begins (1)"},
        {"version 3\nsegment A\n mass 1\n", "m:4: the segment of line 2 has no endsegment"},
        {"version 3\nsegment A\nsegment B\nendsegment\n",
         "m:3: the segment of line 2 has no endsegment"},
        {"version 3\nsegment A\nendsegment\nsegment A\nendsegment\n",
         "m:4: body 'A' is there twice (first in line 2)"},
        {"version 3\nsegment Arm\n parent Thorx\nendsegment\nsegment Thorax\nendsegment\n",
         "m:2: body 'Arm' names an unknown body 'Thorx' (did you mean 'Thorax'?)"},
        {"version 3\nsegment A\n parent B\nendsegment\nsegment B\n parent A\nendsegment\n",
         "m:2: body 'A' is its own ancestor"},
        {ARM "marker M\n parent Amr\nendmarker\n",
         "m:13: marker 'M' names an unknown body 'Amr' (did you mean 'Arm'?)"},
        {ARM "wrapping W\n", "m:13: the wrapping of line 13 has no endwrapping"},
        {MUSCLE("optimalLength 0\n"), "m:17: muscle 'Long': the optimal fibre length cannot be 0"},
        {MUSCLE("maximalForce -5\n"),
         "m:17: muscle 'Long': the maximal isometric force cannot be -5"},
        {MUSCLE("musclegroup H\n"),
         "m:17: muscle 'Long' is in an unknown musclegroup 'H' (did you mean 'G'?)"},
        {MUSCLE("") "viapoint v\n muscle Lon\n parent Arm\n position 0 0 0\nendviapoint\n",
         "m:24: via point 'v' is of an unknown muscle 'Lon' (did you mean 'Long'?)"},
        {MUSCLE("") "viapoint v\n muscle Long\n parent Leg\n position 0 0 0\nendviapoint\n",
         "m:24: muscle 'Long' names an unknown body 'Leg' (valid: Trunk, Arm)"},
        {ARM "musclegroup G\n OriginParent Arm\n InsertionParent Arm\nendmusclegroup\n"
             "muscle X\n musclegroup G\n OriginPosition 0 0 0\nendmuscle\n",
         "m:17: muscle 'X' has no InsertionPosition"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        mhe_description *d = NULL;
        mhe_error err = {0};
        int32_t status = mhi_biomod_parse("m", cases[i].text, strlen(cases[i].text), &d, &err);
        assert_string_equal(err.text, cases[i].message);
        assert_int_equal(status, MHE_E_INPUT);
        assert_null(d);
    }
}

static void unknown_blocks_are_named(void **state) {
    (void)state;
    mhe_description *d =
        parse(MUSCLE(" Type degrootefatigable\n FatigueParameters\n Type Xia\n rate 1\n"
                     "endfatigueparameters\n") "glow G\n parent Arm\nENDGLOW\n");
    assert_int_equal(d->muscles[0].type, MHE_MUSCLE_HILL_DEGROOTE);
    assert_int_equal(d->n_unsupported, 3);
    assert_string_equal(d->unsupported[0], "m.bioMod:23: fatigue of muscle 'Long'");
    assert_string_equal(d->unsupported[1], "m.bioMod:24: FatigueParameters of muscle 'Long'");
    assert_string_equal(d->unsupported[2], "m.bioMod:29: glow 'G'");
    mhi_description_free(d);
}

static void a_million_strange_words_are_a_few_lines(void **state) {
    (void)state;
    const size_t n = 1000000;
    char *text = malloc(2 * n + 64);
    assert_non_null(text);
    int used = sprintf(text, "version 4\nsegment A\nendsegment\n");
    memset(text + used, ' ', 2 * n);
    for (size_t i = 0; i < n; i++) {
        text[(size_t)used + 2 * i] = 'x';
    }
    text[(size_t)used + 2 * n] = '\0';
    mhe_description *d = parse(text);
    assert_int_equal(d->n_warnings, 4);
    assert_non_null(strstr(d->warnings[3], "999996 more of this kind, the last in line 4"));
    mhi_description_free(d);
    free(text);
}

static void impossible_inertia_is_a_warning(void **state) {
    (void)state;
    mhe_description *d = parse("version 3\nsegment A\n inertia 1 0 0 0 1 0 0 0 3\nendsegment\n");
    assert_int_equal(d->n_warnings, 1);
    assert_non_null(strstr(d->warnings[0], "m.bioMod:2: the inertia of body 'A'"));
    mhi_description_free(d);
    d = parse("version 3\nsegment A\n inertia 1 2 0 2 1 0 0 0 1\nendsegment\n");
    assert_int_equal(d->n_warnings, 1);
    assert_non_null(strstr(d->warnings[0], "is not positive about every axis"));
    mhi_description_free(d);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(reads_a_small_arm),
                                       cmocka_unit_test(comments_arithmetic_and_variables),
                                       cmocka_unit_test(numbers_do_not_depend_on_the_locale),
                                       cmocka_unit_test(unsupported_blocks_are_named),
                                       cmocka_unit_test(stray_words_are_skipped),
                                       cmocka_unit_test(left_handed_frames_are_turned),
                                       cmocka_unit_test(a_left_handed_joint_moves_as_the_file_says),
                                       cmocka_unit_test(what_exports_do_is_read),
                                       cmocka_unit_test(unknown_blocks_are_named),
                                       cmocka_unit_test(a_million_strange_words_are_a_few_lines),
                                       cmocka_unit_test(mistakes_are_named_with_their_line),
                                       cmocka_unit_test(impossible_inertia_is_a_warning)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

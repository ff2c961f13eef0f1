/* SPDX-License-Identifier: Apache-2.0 */
/* .bioMod reader: what is read, what is repaired, and what each mistake is called. */
#include "io/model_file.h"
#include "support.h"

#include <locale.h>
#include <math.h>
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
    assert_true(d->coordinates[2].upper == acos(-1));
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
    assert_true(d->coordinates[2].lower == -2 * acos(-1));
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

static void a_left_handed_joint_is_refused(void **state) {
    (void)state;
    mhe_description *d = NULL;
    mhe_error err = {0};
    const char *moving = "version 4\nsegment A\n"
                         " RTinMatrix 1 RT 0 0 1 1  0 1 0 2  1 0 0 3  0 0 0 1\n"
                         " rotations x\nendsegment\n";
    assert_int_equal(mhi_biomod_parse("m", moving, strlen(moving), &d, &err), MHE_E_INPUT);
    assert_string_equal(err.text, "m: body 'A' moves in a left-handed frame");
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
        {"", "m:1: a .bioMod file begins with 'version 1' to 'version 4'"},
        {"version 9\n", "m:1: a .bioMod file begins with 'version 1' to 'version 4'"},
        {"version 3\nsegment A\n mass -1\nendsegment\n",
         "m:2: body 'A' has a negative mass (-1 kg)"},
        {"version 3\nsegment A\n mass two\nendsegment\n",
         "m:3: 'mass' needs 1 number; 'two' is none"},
        {"version 3\nsegment A\n mass 1/0\nendsegment\n", "m:3: '1/0' of 'mass' is not finite"},
        {"version 3\nsegment A\n com 1 2\nendsegment\n",
         "m:4: 'com' needs 3 numbers; 'endsegment' is none"},
        {"version 3\nsegment A\n inertia -1 0 0 0 1 0 0 0 1\nendsegment\n",
         "m:2: the inertia of body 'A' is not positive"},
        {"version 3\nsegment A\n inertia 1 2 0 2 1 0 0 0 1\nendsegment\n",
         "m:2: the inertia of body 'A' is not positive"},
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
        {ARM "wrapping W\n", "m:14: the wrapping of line 13 has no endwrapping"},
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

static void impossible_inertia_is_a_warning(void **state) {
    (void)state;
    mhe_description *d = parse("version 3\nsegment A\n inertia 1 0 0 0 1 0 0 0 3\nendsegment\n");
    assert_int_equal(d->n_warnings, 1);
    assert_non_null(strstr(d->warnings[0], "m.bioMod:2: the inertia of body 'A'"));
    mhi_description_free(d);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(reads_a_small_arm),
                                       cmocka_unit_test(comments_arithmetic_and_variables),
                                       cmocka_unit_test(numbers_do_not_depend_on_the_locale),
                                       cmocka_unit_test(unsupported_blocks_are_named),
                                       cmocka_unit_test(stray_words_are_skipped),
                                       cmocka_unit_test(left_handed_frames_are_turned),
                                       cmocka_unit_test(a_left_handed_joint_is_refused),
                                       cmocka_unit_test(mistakes_are_named_with_their_line),
                                       cmocka_unit_test(impossible_inertia_is_a_warning)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

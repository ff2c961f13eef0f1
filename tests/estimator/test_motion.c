/* SPDX-License-Identifier: Apache-2.0 */
/* The motion that a run knows of before it begins: its range, from which file, and mistakes. */
#include "fixture.h"
#include "model/system.h"
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define FOLDER MHE_TEST_BINARY_DIR "/"
#define HEAD "model:\n  file: $ARM19\n"
#define COSTS "costs: [mhe.cost.emg-markers-high]\n"

static void write_file(const char *path, const char *text) {
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

static int setup(void **state) {
    (void)state;
    write_file(FOLDER "motion.mot", "motion\nversion=1\nnRows=3\nnColumns=3\ninDegrees=yes\n"
                                    "endheader\ntime\tArm_RotX\tq_LowerArm1_RotZ\n"
                                    "0\t-30\t10\n0.1\tnan\t90\n0.2\t-60\t45\n");
    write_file(FOLDER "angles.sto",
               "angles\nversion=1\nnRows=2\nnColumns=2\ninDegrees=no\nendheader\n"
               "time\tArm_RotY\n0\t0.25\n0.1\t-0.5\n");
    write_file(FOLDER "radians.mot", "motion\nversion=1\nnRows=2\nnColumns=5\ninDegrees=yes\n"
                                     "endheader\ntime\tArm_RotY\tArm_RotX\tArm_RotZ\t"
                                     "q_LowerArm1_RotZ\n0\t0.1\t-0.5\t0\t1.5\n"
                                     "0.1\t0.2\t-1.1\t0\t2.2\n");
    write_file(FOLDER "other.mot", "other\nversion=1\nnRows=1\nnColumns=2\ninDegrees=no\n"
                                   "endheader\ntime\tknee\n0\t1\n");
    return 0;
}

static void expect_range(const mhe_description *d, int32_t i, double lower, double upper) {
    if (isnan(lower)) {
        assert_true(isnan(d->motion_lower[i]) && isnan(d->motion_upper[i]));
        return;
    }
    assert_true(fabs(d->motion_lower[i] - lower) < 1e-12);
    assert_true(fabs(d->motion_upper[i] - upper) < 1e-12);
}

static const mhe_description *open_config(test_fixture *f, const char *config) {
    if (test_fixture_open(f, config) != MHE_OK) {
        fail_msg("%s", f->err.text);
    }
    return mhi_system_description(f->system);
}

static void its_range_is_read(void **state) {
    (void)state;
    const double degree = 3.14159265358979323846 / 180;
    test_fixture f;
    const mhe_description *d = open_config(&f, HEAD "  motion: " FOLDER "motion.mot\n"
                                                    "data: {angles: " FOLDER "angles.sto}\n" COSTS);
    expect_range(d, 0, NAN, NAN);
    expect_range(d, 1, -60 * degree, -30 * degree);
    expect_range(d, 3, 10 * degree, 90 * degree);
    test_fixture_close(&f);
    d = open_config(&f, HEAD "data: {angles: " FOLDER "angles.sto}\n" COSTS);
    expect_range(d, 0, -0.5, 0.25);
    expect_range(d, 1, NAN, NAN);
    test_fixture_close(&f);
    d = open_config(&f, HEAD "  locked: [Arm_RotY]\n  motion: " FOLDER "motion.mot\n" COSTS);
    expect_range(d, 0, -60 * degree, -30 * degree); /* by name, whatever is locked */
    test_fixture_close(&f);
    d = open_config(&f, HEAD COSTS);
    assert_null(d->motion_lower);
    test_fixture_close(&f);
}

static void mistakes_are_named(void **state) {
    (void)state;
    test_fixture f;
    assert_int_equal(test_fixture_open(&f, HEAD "  motion: " FOLDER "other.mot\n" COSTS),
                     MHE_E_INPUT);
    assert_non_null(strstr(f.err.text, "other.mot:8: model.motion: no column is a coordinate of "
                                       "the model ('Arm_RotY', ...)"));
    test_fixture_close(&f);
    assert_int_equal(test_fixture_open(&f, HEAD "  motion: " FOLDER "radians.mot\n" COSTS), MHE_OK);
    assert_non_null(strstr(f.told, "radians.mot:8: model.motion: no angle is larger than 2.2 "
                                   "degrees: if they are radians, write 'inDegrees=no'"));
    test_fixture_close(&f);
    assert_int_equal(test_fixture_open(&f, HEAD "  motion: " FOLDER "absent.mot\n" COSTS),
                     MHE_E_INPUT);
    assert_non_null(strstr(f.err.text, "absent.mot"));
    test_fixture_close(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(its_range_is_read),
                                       cmocka_unit_test(mistakes_are_named)};
    return cmocka_run_group_tests(tests, setup, NULL);
}

/* SPDX-License-Identifier: Apache-2.0 */
/* The picture of a result folder, made of two seconds of invented motion. */
#include "io/slurp.h"
#include "picture.h"
#include "support.h"
#include <mhe/outbox.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define N_Q 4
#define N_M 19

static char folder[256];
static char labels[2 * N_Q + N_M][32];
static const char *names[2 * N_Q + N_M];

static void invent(mhe_outbox *outbox, const char *name, const char *q, const char *f,
                   double error) {
    static const char *const muscles[] = {"Pec", "Lat", "Delt", "Tri", "Bi"};
    int n = 0, has_forces = f != NULL;
    double row[N_Q + N_M];
    for (int i = 0; q != NULL && i < N_Q; i++, n++) {
        (void)snprintf(labels[n], sizeof labels[n], "%sjoint_%d", q, i + 1);
    }
    for (int i = 0; has_forces && i < N_M; i++, n++) {
        (void)snprintf(labels[n], sizeof labels[n], "%s%s'%d", f, muscles[i % 5], i);
    }
    for (int i = 0; i < n; i++) {
        names[i] = labels[i];
    }
    mhe_sink *sink = NULL;
    assert_int_equal(mhe_sink_sto(outbox, name, "t", names, n, &sink, NULL), MHE_OK);
    for (int k = 0; k <= 200; k++) {
        double t = 0.01 * k;
        int at = 0;
        for (int i = 0; q != NULL && i < N_Q; i++) {
            row[at++] = (0.3 + 0.2 * i) * sin(3 * t + i) + error * cos(40 * t);
        }
        for (int i = 0; has_forces && i < N_M; i++) {
            double base = (20 + 25 * ((i * 7) % N_M)) * (1 + sin(4 * t + 0.7 * i));
            row[at++] = k > 90 && k < 100 && i == 9 ? NAN : base * (1 + error * sin(50 * t));
        }
        assert_int_equal(mhe_sink_row(sink, t, row, NULL), MHE_OK);
    }
}

static int make_results(void **state) {
    (void)state;
    (void)snprintf(folder, sizeof folder, "%s/picture's test", MHE_TEST_BINARY_DIR);
    mhe_outbox *outbox = NULL;
    if (mhe_outbox_open(folder, &outbox, NULL) != MHE_OK) {
        return 1;
    }
    invent(outbox, "estimates.sto", "q_", NULL, 0.01);
    invent(outbox, "forces.sto", NULL, "", 0.1);
    invent(outbox, "reference.sto", "q_", "F_", 0);
    mhe_status status = mhe_outbox_commit(outbox, NULL);
    mhe_outbox_close(outbox);
    return status != MHE_OK;
}

static const char *path_of(const char *name) {
    static char path[512];
    (void)snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static void has(const char *file, const char *text, int32_t expected) {
    char *content = NULL;
    size_t length = 0;
    assert_int_equal(mhi_slurp(path_of(file), &content, &length, NULL), MHE_OK);
    int32_t found = strstr(content, text) != NULL;
    free(content);
    if (found != expected) {
        fail_msg("%s: '%s' is %s", file, text, found ? "there" : "absent");
    }
}

static void with_reference(void **state) {
    (void)state;
    mhe_error err = {0};
    char reference[512];
    (void)snprintf(reference, sizeof reference, "%s", path_of("reference.sto"));
    (void)unlink(path_of("estimates.svg"));
    mhe_status status = picture_estimates(folder, reference, &err);
    has("estimates.gp", "set label 'true'", 1);
    has("estimates.gp", "the 8 strongest of 19", 1);
    if (status == MHE_E_UNSUPPORTED) {
        skip(); /* no gnuplot here */
    }
    if (status != MHE_OK) {
        fail_msg("%s", err.text);
    }
    has("estimates.svg", "</svg>", 1);
    has("estimates.svg", "joint_4", 1);
    has("estimates.svg", "strongest of 19", 1);
}

static void without_reference(void **state) {
    (void)state;
    mhe_error err = {0};
    mhe_status status = picture_estimates(folder, NULL, &err);
    has("estimates.gp", "set label 'true'", 0);
    assert_true(status == MHE_OK || status == MHE_E_UNSUPPORTED);
}

static void without_gnuplot(void **state) {
    (void)state;
    mhe_error err = {0};
    char *path = strdup(getenv("PATH"));
    assert_non_null(path);
    (void)setenv("PATH", "/nowhere", 1);
    mhe_status status = picture_estimates(folder, NULL, &err);
    (void)setenv("PATH", path, 1);
    free(path);
    assert_int_equal(status, MHE_E_UNSUPPORTED);
    assert_non_null(strstr(err.text, "install gnuplot"));
}

static void without_results(void **state) {
    (void)state;
    mhe_error err = {0};
    assert_int_equal(picture_estimates("/nowhere", NULL, &err), MHE_E_INPUT);
    assert_non_null(strstr(err.text, "/nowhere/estimates.sto: cannot be opened"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(without_reference), cmocka_unit_test(without_gnuplot),
        cmocka_unit_test(without_results), cmocka_unit_test(with_reference)};
    return cmocka_run_group_tests(tests, make_results, NULL);
}

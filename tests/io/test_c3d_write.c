/* SPDX-License-Identifier: Apache-2.0 */
/* What is written as .c3d reads back: labels, times, units, gaps; what a .c3d cannot hold. */
#include "io/c3d.h"
#include "io/c3d_write.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define FRAMES 7
#define PER_FRAME 4

static char folder[256];
static const char *const markers[] = {"STER", "a longer label than sixteen", "C7"};
static const char *const channels[] = {"Delt", "Biceps.EMG"};
static double points[FRAMES * 9], analog[FRAMES * PER_FRAME * 2];

static mhi_c3d_content usual(void) {
    for (int i = 0; i < FRAMES * 9; i++) {
        points[i] = 0.001 * i - 0.02;
    }
    for (int i = 0; i < FRAMES * PER_FRAME * 2; i++) {
        analog[i] = 1e-5 * (i - 20);
    }
    points[9 * 2 + 4] = NAN;
    return (mhi_c3d_content){.markers = markers,
                             .channels = channels,
                             .unit = "V",
                             .n_markers = 3,
                             .n_channels = 2,
                             .n_frames = FRAMES,
                             .per_frame = PER_FRAME,
                             .rate = 50,
                             .first = 0.24,
                             .points = points,
                             .analog = analog};
}

static mhe_status put(const mhi_c3d_content *content, mhe_error *err) {
    mhe_outbox *outbox = NULL;
    assert_int_equal(mhe_outbox_open(folder, &outbox, err), MHE_OK);
    mhe_status status = mhi_outbox_c3d(outbox, "a.c3d", content, err);
    if (status == MHE_OK) {
        status = mhe_outbox_commit(outbox, err);
    }
    mhe_outbox_close(outbox);
    return status;
}

static void reads_back(void **state) {
    (void)state;
    const mhi_c3d_content c = usual();
    mhi_table *p = NULL, *a = NULL;
    mhe_error err = {0};
    char path[300];
    (void)snprintf(path, sizeof path, "%s/a.c3d", folder);
    assert_int_equal(put(&c, &err), MHE_OK);
    assert_int_equal(mhi_c3d_read(path, &p, &a, &err), MHE_OK);
    assert_int_equal(p->n_rows, FRAMES);
    assert_int_equal(p->n_warnings + a->n_warnings, 0);
    assert_true(p->rate == 50 && a->rate == 200 && p->unit == 1e-3);
    for (int i = 0; i < 3; i++) {
        assert_string_equal(p->labels[i], markers[i]);
    }
    for (int i = 0; i < 2; i++) {
        assert_string_equal(a->labels[i], channels[i]);
    }
    for (int k = 0; k < FRAMES; k++) {
        assert_true(fabs(p->time[k] - (0.24 + 0.02 * k)) < 1e-12);
        for (int i = 0; i < 9; i++) {
            const double is = p->values[9 * k + i], want = points[9 * k + i];
            assert_true(k == 2 && i / 3 == 1 ? isnan(is) : fabs(is - want) < 1e-8);
        }
    }
    assert_int_equal(a->n_rows, FRAMES * PER_FRAME);
    for (int k = 0; k < FRAMES * PER_FRAME; k++) {
        assert_true(fabs(a->time[k] - (0.24 + 0.005 * k)) < 1e-12);
        for (int i = 0; i < 2; i++) {
            assert_true(a->values[2 * k + i] == (double)(float)analog[2 * k + i]);
        }
    }
    mhi_table_free(p);
    mhi_table_free(a);
    (void)unlink(path);
}

static void markers_alone(void **state) {
    (void)state;
    mhi_c3d_content c = usual();
    mhi_table *p = NULL, *a = NULL;
    mhe_error err = {0};
    char path[300];
    (void)snprintf(path, sizeof path, "%s/a.c3d", folder);
    c.n_channels = 0;
    c.per_frame = 1;
    assert_int_equal(put(&c, &err), MHE_OK);
    assert_int_equal(mhi_c3d_read(path, &p, &a, &err), MHE_OK);
    assert_int_equal(p->n_rows, FRAMES);
    assert_null(a);
    mhi_table_free(p);
    (void)unlink(path);
}

static void refused(const mhi_c3d_content *c, const char *text) {
    mhe_error err = {0};
    assert_int_equal(put(c, &err), MHE_E_INPUT);
    if (strstr(err.text, text) == NULL) {
        fail_msg("'%s' is not in '%s'", text, err.text);
    }
    assert_int_equal(rmdir(folder), 0); /* nothing was left in it */
    assert_int_equal(put(c, &err), MHE_E_INPUT);
}

static void what_a_c3d_cannot_hold(void **state) {
    (void)state;
    mhi_c3d_content c = usual();
    c.n_markers = 256;
    refused(&c, "at most 255");
    c = usual();
    c.per_frame = 40000;
    refused(&c, "more than 65535 analog samples in a frame");
    c = usual();
    c.first = 0.245;
    refused(&c, "must be a multiple of 0.02 s");
    c = usual();
    c.first = -0.2;
    refused(&c, "the first at 0 s");
    c = usual();
    c.n_frames = 65530;
    refused(&c, "frames 1 to 65535");
    c = usual();
    analog[2 * PER_FRAME * 3 + 1] = NAN;
    refused(&c, "channel 'Biceps.EMG' has no sample in frame 4");
}

int main(void) {
    if (test_folder(folder, sizeof folder) == NULL) {
        return 1;
    }
    const struct CMUnitTest tests[] = {cmocka_unit_test(reads_back),
                                       cmocka_unit_test(markers_alone),
                                       cmocka_unit_test(what_a_c3d_cannot_hold)};
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    return rmdir(folder) != 0 || failed;
}

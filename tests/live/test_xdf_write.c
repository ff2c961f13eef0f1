/* SPDX-License-Identifier: Apache-2.0 */
/* What is recorded is read back to the bit, at any moment of the recording. */
#include "io/xdf.h"
#include "live/recorded.h"
#include "live/taping.h"
#include "live/xdf_write.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void to_the_bit(void **state) {
    (void)state;
    char folder[256], path[300];
    assert_non_null(test_folder(folder, sizeof folder));
    (void)snprintf(path, sizeof path, "%s/a.xdf", folder);
    mhi_xdf_writer *w = NULL;
    mhi_xdf *back = NULL;
    mhe_error err = {0};
    const mhi_xdf_column columns[] = {{.label = "bic <1> & co", .unit = "V"},
                                      {.label = "tri", .named = "1"}};
    const double stamps[] = {1.0 / 3, 2.0 / 3, 7.1}, values[] = {0.1, -1e-300, 3, 1e300, -0.0, 7};
    uint32_t id = 0;
    assert_int_equal(mhi_xdf_create(path, &w, &err), MHE_OK);
    assert_int_equal(mhi_xdf_add_stream(w, "emg", "EMG", 0, columns, 2, "a\nnote", &id, &err),
                     MHE_OK);
    assert_int_equal(mhi_xdf_put(w, id, 2, 2, stamps, values, &err), MHE_OK);
    assert_int_equal(mhi_xdf_read(path, &back, &err), MHE_OK); /* while it is written */
    assert_int_equal(back->streams[0].n_samples, 2);
    mhi_xdf_free(back);
    assert_int_equal(mhi_xdf_put(w, id, 2, 1, stamps + 2, values + 4, &err), MHE_OK);
    assert_int_equal(mhi_xdf_put_offset(w, id, 1, -5, &err), MHE_OK);
    assert_int_equal(mhi_xdf_close(w, &err), MHE_OK);
    assert_int_equal(mhi_xdf_read(path, &back, &err), MHE_OK);
    const mhi_xdf_stream *s = &back->streams[0];
    assert_string_equal(s->channels[0].label, "bic <1> & co");
    assert_string_equal(s->channels[0].unit, "V");
    assert_int_equal(s->n_samples, 3);
    assert_memory_equal(s->stamp, stamps, sizeof stamps);
    assert_memory_equal(s->values, values, sizeof values);
    assert_true(s->time[0] == stamps[0] - 5);
    mhi_xdf_free(back);
    assert_int_equal(mhi_xdf_create(path, &w, &err), MHE_E_IO); /* never over another */
    assert_non_null(strstr(err.text, "a.xdf: cannot be begun"));
    (void)unlink(path);
    (void)rmdir(folder);
}

#define TIMES 300 /* that the device comes */
#define CHUNK 27  /* samples of a packet */

static void say(mhi_taping *tape, int32_t time) {
    mhe_error err = {0};
    char label[16];
    (void)snprintf(label, sizeof label, "of_%d", (int)time);
    const char *labels[] = {label};
    const mhe_stream_info info = {.size = sizeof info,
                                  .kind = MHE_STREAM_EMG,
                                  .name = "emg",
                                  .n_channels = 1,
                                  .labels = labels,
                                  .rate = 2000,
                                  .up = -1};
    mhi_packet *p = mhi_packet_stream(0, 0, &info);
    assert_non_null(p);
    assert_int_equal(mhi_taping_take(tape, p, &err), MHE_OK);
    mhi_packet_free(p);
}

static void send(mhi_taping *tape, double received, double offset) {
    mhe_error err = {0};
    double stamp[CHUNK], values[CHUNK];
    for (int32_t i = 0; i < CHUNK; i++) {
        stamp[i] = received - offset + (i - CHUNK) / 2000.0;
        values[i] = received;
    }
    mhi_packet p = {.kind = MHI_PACKET_SAMPLES,
                    .n = CHUNK,
                    .n_channels = 1,
                    .received = received,
                    .offset = offset,
                    .stamp = stamp,
                    .values = values};
    assert_int_equal(mhi_taping_take(tape, &p, &err), MHE_OK);
}

/* A device that comes again hundreds of times, each time with other labels: each has its samples.
 */
static void comes_again_and_again(void **state) {
    (void)state;
    char folder[256], path[300];
    assert_non_null(test_folder(folder, sizeof folder));
    (void)snprintf(path, sizeof path, "%s/a.xdf", folder);
    mhi_taping *tape = NULL;
    const mhe_recorded *back = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_taping_open(path, "a", &tape, &err), MHE_OK);
    for (int32_t i = 0; i < TIMES; i++) {
        say(tape, i);
        send(tape, i + 1, 0.25);
    }
    assert_int_equal(mhi_taping_close(tape, &err), MHE_OK);
    assert_int_equal(mhi_recorded_service.read(path, MHE_STREAM_EMG, &back, &err), MHE_OK);
    assert_int_equal(back->n_streams, TIMES);
    assert_int_equal(back->n_arrivals, TIMES);
    for (int32_t i = 0; i < TIMES; i++) {
        const mhe_recorded_stream *s = &back->streams[i];
        char label[16];
        (void)snprintf(label, sizeof label, "of_%d", (int)i);
        assert_string_equal(s->about.labels[0], label);
        assert_int_equal(s->n, CHUNK);
        assert_true(s->values[0] == i + 1);
        assert_int_equal(s->replaces, i - 1);
        assert_int_equal(back->arrivals[i].stream, i);
    }
    mhi_recorded_service.free(back);
}

/* A sender's clock that drifts: its offset stands in the file every few seconds, however its
 * samples come. */
static void a_clock_that_drifts(void **state) {
    (void)state;
    char folder[256], path[300];
    assert_non_null(test_folder(folder, sizeof folder));
    (void)snprintf(path, sizeof path, "%s/a.xdf", folder);
    mhi_taping *tape = NULL;
    mhi_xdf *back = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_taping_open(path, "a", &tape, &err), MHE_OK);
    say(tape, 0);
    for (int32_t k = 0; k < 4445; k++) { /* a minute */
        const double time = 100 + k * CHUNK / 2000.0;
        send(tape, time, 40 + 1e-4 * (time - 100));
    }
    assert_int_equal(mhi_taping_close(tape, &err), MHE_OK);
    assert_int_equal(mhi_xdf_read(path, &back, &err), MHE_OK);
    const mhi_xdf_stream *s = NULL;
    for (int32_t i = 0; i < back->n_streams; i++) {
        s = strcmp(back->streams[i].type, "EMG") == 0 ? &back->streams[i] : s;
    }
    assert_non_null(s);
    assert_in_range(s->n_offsets, 11, 13);
    /* and so its times are the receiver's from begin to end */
    for (int64_t i = 0; i < s->n_samples; i += CHUNK) {
        assert_true(fabs(s->time[i] - (s->values[i] - CHUNK / 2000.0)) < 1e-4);
    }
    mhi_xdf_free(back);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(to_the_bit),
                                       cmocka_unit_test(comes_again_and_again),
                                       cmocka_unit_test(a_clock_that_drifts)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

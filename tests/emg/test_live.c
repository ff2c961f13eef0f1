/* SPDX-License-Identifier: Apache-2.0 */
/* The public stream of EMG against mhe-run's reading of the same samples: the same bits. */
#include "estimator/recording.h"
#include "fixture.h"
#include "support.h"

#include <math.h>
#include <mhe/emg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define ROWS 3000
#define MUSCLES 19

static const char *const columns[] = {"A", "unused", "B"};

static double raw_at(int32_t k, int32_t column) {
    return 1e-4 * (0.6 - 0.4 * cos(0.004 * k)) * sin(0.6 * k + 0.001 * k * column);
}

static const char config[] = "model: {file: $ARM19}\n"
                             "data: {emg: raw.sto, emg_offset: 0.25}\n"
                             "emg:\n  delay: 0.1\n  channels:\n"
                             "    - {name: B, muscles: [BRA, BRD], gains: [1, 0.5], mvc: 1e-4}\n"
                             "    - {name: A, muscles: Deltoid1, mvc: 2e-4}\n"
                             "costs: [mhe.cost.min-excitation]\n";

static void write_raw(const char *path) {
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    (void)fprintf(file, "endheader\ntime\tA\tunused\tB\n");
    for (int32_t k = 0; k < ROWS; k++) {
        (void)fprintf(file, "%.3f\t%.17g\t%.17g\t%.17g\n", k / 1000.0, raw_at(k, 0), raw_at(k, 1),
                      raw_at(k, 2));
    }
    assert_int_equal(fclose(file), 0);
}

static void live_is_as_recorded(void **state) {
    (void)state;
    test_fixture f;
    if (test_fixture_open(&f, config) != MHE_OK) {
        fail_msg("%s", f.err.text);
    }
    char raw[320], path[320];
    (void)snprintf(raw, sizeof raw, "%s/raw.sto", f.folder);
    (void)snprintf(path, sizeof path, "%s/config.yaml", f.folder);
    write_raw(raw);
    mhi_recording *r = NULL;
    const mhe_description *model = mhi_system_description(f.system);
    assert_int_equal(mhi_recording_read(f.run, model, &f.host, &r, &f.err), MHE_OK);
    assert_int_equal(r->n_frames, 300); /* 100 Hz where there are no markers */
    mhe_emg *live = NULL;
    assert_int_equal(mhe_emg_open(path, NULL, 0, columns, 3, 1000, NULL, &live, &f.err), MHE_OK);
    assert_true(mhe_emg_lag(live) == r->emg_report.lag);
    int32_t next = 0, compared = 0;
    for (int32_t k = 0; k < r->n_frames; k++) {
        double values[MUSCLES];
        for (; next < ROWS && next / 1000.0 + 0.25 <= r->time[k] + 1e-6; next++) {
            const double sample[] = {raw_at(next, 0), raw_at(next, 1), raw_at(next, 2)};
            assert_int_equal(mhe_emg_push(live, next / 1000.0, sample, &f.err), MHE_OK);
        }
        assert_int_equal(mhe_emg_at(live, r->time[k], values, MUSCLES, &f.err), MHE_OK);
        for (int32_t i = 0; i < MUSCLES; i++) {
            const double recorded = r->emg[(ptrdiff_t)k * MUSCLES + i];
            assert_true(values[i] == recorded || (isnan(values[i]) && isnan(recorded)));
            compared += !isnan(recorded);
        }
    }
    assert_true(compared > 3 * 250);
    double few[3] = {7, 7, 7}; /* no more than there is room for */
    assert_int_equal(mhe_emg_at(live, 1, few, 2, &f.err), MHE_OK);
    assert_true(few[2] == 7);
    assert_int_equal(mhe_emg_at(live, 1, NULL, 2, &f.err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_emg_at(live, 1, few, -1, &f.err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_emg_push(live, 1, NULL, &f.err), MHE_E_ARGUMENT);
    mhe_emg_close(live);
    const char *set = "emg.zero_phase=true";
    assert_int_equal(mhe_emg_open(path, &set, 1, columns, 3, 1000, NULL, &live, &f.err),
                     MHE_E_CONFIG);
    assert_non_null(strstr(f.err.text, "config.yaml:3: emg: 'zero_phase' looks ahead"));
    assert_null(live);
    /* a stream without one of the channels goes on with the others; one with none does not */
    assert_int_equal(mhe_emg_open(path, NULL, 0, columns, 2, 1000, NULL, &live, &f.err), MHE_OK);
    mhe_emg_close(live);
    static const char *const strangers[] = {"X", "Y"};
    assert_int_equal(mhe_emg_open(path, NULL, 0, strangers, 2, 1000, NULL, &live, &f.err),
                     MHE_E_INPUT);
    assert_non_null(strstr(f.err.text, "no column for any channel: 'B'"));
    mhi_recording_free(r);
    (void)unlink(raw);
    test_fixture_close(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(live_is_as_recorded)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

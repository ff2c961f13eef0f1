/* SPDX-License-Identifier: Apache-2.0 */
/* Electrodes: mapping, times, a recording against the same samples one by one, and bad data. */
#include "emg/electrodes.h"

#include "base/pi.h"
#include "near.h"
#include "rig.h"

#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define ROWS 4000
#define FRAMES 200

static void check_told(const emg_rig *rig, const char *text) {
    if (strstr(rig->told, text) == NULL) {
        fail_msg("'%s' is not in: %s", text, rig->told);
    }
}

static void check_refused(emg_rig *rig, mhe_status status, const char *text) {
    double emg[3 * FRAMES];
    mhi_table *table = rig_table(ROWS);
    assert_int_equal(rig_read(rig, table, FRAMES, emg), status);
    if (strstr(rig->err.text, text) == NULL) {
        fail_msg("'%s' is not in: %s", text, rig->err.text);
    }
    mhi_table_free(table);
}

static void live_and_recorded_are_the_same_bits(void **state) {
    (void)state;
    const double delays[] = {0, 0.2}; /* beside a filter delay of 0.04 s */
    for (int d = 0; d < 2; d++) {
        emg_rig rig;
        double whole[3 * FRAMES], one[3], ones[] = {0.001, 1};
        rig_open(&rig);
        rig.run.emg.delay = delays[d];
        mhi_table *table = rig_table(ROWS);
        assert_int_equal(rig_read(&rig, table, FRAMES, whole), MHE_OK);
        assert_near(rig.report.lag, d == 0 ? rig.report.filter_delay : 0, 1e-15);
        mhi_electrodes *e = NULL;
        assert_int_equal(mhi_electrodes_open(&rig.run, &rig.model, "live",
                                             (const char *const *)table->labels, 3, RIG_RATE, ones,
                                             &e, &rig.err),
                         MHE_OK);
        int32_t next = 0, compared = 0;
        for (int32_t k = 0; k < FRAMES; k++) {
            /* samples come in parcels of 17, so that some are ahead of the frame */
            while (next < ROWS && table->time[next] < k / 100.0 + 0.0085) {
                for (int32_t end = next + 17; next < end && next < ROWS; next++) {
                    mhi_electrodes_push(e, table->time[next], table->values + 3 * next);
                }
            }
            mhi_electrodes_at(e, k / 100.0, one);
            for (int i = 0; i < 3; i++) {
                const double want = whole[3 * k + i];
                assert_true(one[i] == want || (isnan(one[i]) && isnan(want)));
                compared += !isnan(want);
            }
        }
        assert_true(compared > 400);
        mhi_electrodes_close(e);
        mhi_table_free(table);
        rig_close(&rig);
    }
}

static void electrodes_become_muscles(void **state) {
    (void)state;
    emg_rig rig;
    double emg[3 * FRAMES];
    rig_open(&rig);
    rig.run.emg.channels[1].gain = 10; /* B: 5 times its MVC, cut */
    mhi_table *table = rig_table(ROWS);
    assert_int_equal(rig_read(&rig, table, FRAMES, emg), MHE_OK);
    assert_int_equal(rig.n_found, 3);
    assert_int_equal(rig.report.n_channels, 2);
    assert_near(rig.report.rate, RIG_RATE, 0.0);
    check_told(&rig, "far above their MVC, which may be too small: B (3");
    for (int k = 30; k < FRAMES; k++) {
        const double t = k / 100.0 - rig.report.filter_delay;
        assert_near(emg[3 * k], 2 / MHI_PI * rig_force(t), 0.01);
        assert_near(emg[3 * k + 2], 0.5 * emg[3 * k], 1e-15);
        assert_near(emg[3 * k + 1], 1, 0.0);
    }
    rig.run.emg.n_channels = 1; /* the triceps is left without */
    assert_int_equal(rig_read(&rig, table, FRAMES, emg), MHE_OK);
    assert_int_equal(rig.n_found, 2);
    for (int k = 0; k < FRAMES; k++) {
        assert_true(isnan(emg[3 * k + 1]));
    }
    mhi_table_free(table);
    rig_close(&rig);
}

/* The newest sample at or before a frame, `offset` later; nothing beyond the ends. */
static void times_are_aligned(void **state) {
    (void)state;
    emg_rig rig;
    double emg[3 * FRAMES];
    rig_open(&rig);
    rig.run.emg.process = 0;
    rig.run.emg.channels[0].mvc = 4000;
    rig.run.data.emg_offset = 0.0303; /* frame k meets sample 20 k - 60.6: the one before */
    mhi_table *table = rig_table(2000);
    for (int32_t k = 0; k < 2000; k++) {
        table->values[3 * k + 1] = k;
    }
    assert_int_equal(rig_read(&rig, table, FRAMES, emg), MHE_OK);
    for (int k = 0; k < FRAMES; k++) {
        if (k < 4 || k > 104) {
            assert_true(isnan(emg[3 * k]));
        } else {
            const double sample = 20 * k - 61 < 1999 ? 20 * k - 61 : 1999;
            assert_near(emg[3 * k], sample / 4000, 1e-12);
        }
    }
    mhi_table_free(table);
    rig.run.data.emg_offset = 1000;
    check_refused(&rig, MHE_E_INPUT, "is no time in common (data.emg_offset moves the EMG)");
    rig_close(&rig);
}

static void missing_rows_are_a_gap(void **state) {
    (void)state;
    emg_rig rig;
    double emg[3 * FRAMES];
    rig_open(&rig);
    mhi_table *table = rig_table(ROWS);
    for (int32_t k = 2000; k < ROWS; k++) {
        table->time[k] += 0.05;
    }
    assert_int_equal(rig_read(&rig, table, FRAMES, emg), MHE_OK);
    assert_true(!isnan(emg[3 * 100]));
    for (int k = 102; k < 115; k++) { /* the gap, then the filters fill */
        assert_true(isnan(emg[3 * k]));
    }
    assert_true(!isnan(emg[3 * 125]));
    mhi_table_free(table);
    rig_close(&rig);
}

static void an_mvc_file_gives_the_scale(void **state) {
    (void)state;
    static const char row[] = "endheader\ntime\tB\tA\n0\t0.25\t0.002\n";
    char folder[256], path[300];
    emg_rig rig;
    double given[3 * FRAMES], found[3 * FRAMES];
    rig_open(&rig);
    mhi_table *table = rig_table(ROWS);
    rig.run.emg.channels[0].mvc = 0.002;
    rig.run.emg.channels[1].mvc = 0.5;
    assert_int_equal(rig_read(&rig, table, FRAMES, given), MHE_OK);
    assert_non_null(test_folder(folder, sizeof folder));
    (void)snprintf(path, sizeof path, "%s/mvc.sto", folder);
    const int file = open(path, O_RDWR | O_CREAT, 0600);
    assert_true(file >= 0 && write(file, row, sizeof row - 1) == sizeof row - 1);
    rig.run.emg.channels[0].mvc = 0;
    rig.run.emg.mvc_file = path;
    assert_int_equal(rig_read(&rig, table, FRAMES, found), MHE_OK);
    for (int i = 200; i < 3 * FRAMES; i++) {
        assert_true(found[i] == given[i]);
    }
    /* a recording: its largest envelope */
    FILE *out = fdopen(file, "w");
    assert_non_null(out);
    rewind(out);
    (void)fprintf(out, "endheader\ntime\tA\tB\n");
    for (int k = 0; k < 4000; k++) {
        (void)fprintf(out, "%.4f\t%.12g\t%.12g\n", k / RIG_RATE, 2 * table->values[3 * k + 1],
                      table->values[3 * k + 2]);
    }
    assert_int_equal(fclose(out), 0);
    assert_int_equal(rig_read(&rig, table, FRAMES, found), MHE_OK);
    double most = 0;
    for (int k = 0; k < FRAMES; k++) {
        most = fmax(most, found[3 * k]);
    }
    assert_near(most, 0.5, 1e-3); /* the crest falls between frames */
    /* where no channel needs it, it is not looked at, and that is told */
    assert_null(strstr(rig.told, "mvc_file"));
    rig.run.emg.channels[0].mvc = 0.002;
    rig.run.emg.mvc_file = "/no/such.sto";
    assert_int_equal(rig_read(&rig, table, FRAMES, found), MHE_OK);
    assert_non_null(strstr(rig.told, "emg.mvc_file: /no/such.sto is not looked at"));
    (void)unlink(path);
    mhi_table_free(table);
    rig_close(&rig);
}

static void wrong_names_are_refused(void **state) {
    (void)state;
    emg_rig rig;
    static const char *const near[] = {"bicepz"}, *const twice[] = {"brachialis"};
    rig_open(&rig);
    rig.run.emg.channels[0].name = "spere";
    rig.run.emg.channels[1].name = "spere2";
    check_refused(&rig, MHE_E_INPUT,
                  "raw.sto: no column for any channel: 'spere' (did you mean 'spare'?)");
    rig.run.emg.channels[1].name = "B";
    rig.run.emg.channels[0].name = "A";
    rig.run.emg.channels[1].muscles.values = near;
    check_refused(&rig, MHE_E_CONFIG, "no muscle 'bicepz' (did you mean 'biceps'?)");
    rig.run.emg.channels[1].muscles.values = twice;
    check_refused(&rig, MHE_E_CONFIG, "'brachialis' stands at two channels, 'A' and 'B'");
    rig_close(&rig);
}

static void mixed_up_units_are_refused(void **state) {
    (void)state;
    emg_rig rig;
    rig_open(&rig);
    rig.run.emg.channels[0].mvc = 1e-6; /* V instead of mV */
    check_refused(&rig, MHE_E_INPUT, "channel 'A' reaches 4.4");
    rig.run.emg.channels[0].mvc = 1;
    rig.run.emg.channels[1].mvc = 1000;
    check_refused(&rig, MHE_E_INPUT, "no channel reaches 1 % of its MVC");
    rig_close(&rig);
}

static void times_in_ms_are_named(void **state) {
    (void)state;
    emg_rig rig;
    double emg[3 * FRAMES];
    rig_open(&rig);
    mhi_table *table = rig_table(ROWS);
    for (int32_t k = 0; k < ROWS; k++) {
        table->time[k] *= 1000;
    }
    table->rate = RIG_RATE / 1000;
    assert_int_equal(rig_read(&rig, table, FRAMES, emg), MHE_E_INPUT);
    assert_non_null(strstr(rig.err.text, "are its times in ms instead of s?"));
    /* a recording so short that it could be s */
    table->n_rows = 40;
    assert_int_equal(rig_read(&rig, table, FRAMES, emg), MHE_E_INPUT);
    assert_non_null(strstr(rig.err.text, "raw.sto: a band-pass from 20 to 450 Hz"));
    assert_non_null(strstr(rig.err.text, "(are its times in ms instead of s?)"));
    mhi_table_free(table);
    rig_close(&rig);
}

static void dead_channels_are_told_and_missing(void **state) {
    (void)state;
    emg_rig rig;
    double emg[3 * FRAMES];
    rig_open(&rig);
    mhi_table *table = rig_table(ROWS);
    for (int32_t k = 0; k < ROWS; k++) {
        double *a = &table->values[3 * k + 1], *b = &table->values[3 * k + 2];
        *a = k < 2000 ? NAN : *a;         /* the first second */
        *b = fmin(fmax(*b, -0.25), 0.25); /* saturated */
    }
    assert_int_equal(rig_read(&rig, table, FRAMES, emg), MHE_OK);
    check_told(&rig, "not tracked there: A (50 %)");
    check_told(&rig, "(amplifier saturated?): B (");
    for (int k = 0; k < FRAMES; k++) {
        assert_true(k >= 100 || isnan(emg[3 * k]));
        assert_true(k < 115 || !isnan(emg[3 * k]));
    }
    for (int32_t k = 0; k < ROWS; k++) {
        table->values[3 * k + 2] = 0;
    }
    assert_int_equal(rig_read(&rig, table, FRAMES, emg), MHE_OK);
    check_told(&rig, "(electrode off?) are not tracked there: B (100 %)");
    for (int k = 60; k < FRAMES; k++) {
        assert_true(isnan(emg[3 * k + 1]));
    }
    mhi_table_free(table);
    rig_close(&rig);
}

static void three_rows_are_no_signal(void **state) {
    (void)state;
    for (int zero_phase = 0; zero_phase < 2; zero_phase++) {
        emg_rig rig;
        double emg[9];
        rig_open(&rig);
        rig.run.emg.zero_phase = zero_phase;
        mhi_table *table = rig_table(3);
        assert_int_equal(rig_read(&rig, table, 3, emg), MHE_OK);
        for (int i = 0; i < 9; i++) {
            assert_true(isnan(emg[i]));
        }
        mhi_table_free(table);
        rig_close(&rig);
    }
}

static void zero_phase_follows_without_delay(void **state) {
    (void)state;
    emg_rig rig;
    double emg[3 * FRAMES];
    rig_open(&rig);
    rig.run.emg.zero_phase = 1;
    mhi_table *table = rig_table(ROWS);
    assert_int_equal(rig_read(&rig, table, FRAMES, emg), MHE_OK);
    assert_near(rig.report.filter_delay, 0, 0.0);
    for (int k = 20; k < FRAMES - 20; k++) {
        assert_near(emg[3 * k], 2 / MHI_PI * rig_force(k / 100.0), 0.01);
    }
    mhi_table_free(table);
    rig_close(&rig);
}

/* Lloyd and Besier (2003): excitation (exp(A e) - 1) / (exp(A) - 1), one A for a channel or one a
 * muscle; a channel with a delay of its own shows what was that much before, the others do not. */
static void channels_have_shapes_and_delays(void **state) {
    enum { TRICEPS = 1, BRACHIALIS = 2 };
    (void)state;
    const double shapes[] = {-2, 0}, one[] = {-1};
    double plain[3 * FRAMES], bent[3 * FRAMES];
    for (int32_t late = 0; late < 2; late++) {
        emg_rig rig;
        rig_open(&rig);
        mhi_table *table = rig_table(ROWS);
        assert_int_equal(rig_read(&rig, table, FRAMES, plain), MHE_OK);
        mhi_table_free(table);
        rig.run.emg.channels[0].shape = (mhe_real_list){shapes, 2};
        rig.run.emg.channels[1].shape = (mhe_real_list){one, 1};
        rig.run.emg.channels[1].delay = late ? 0.3 + rig.report.filter_delay : -1;
        table = rig_table(ROWS);
        assert_int_equal(rig_read(&rig, table, FRAMES, bent), MHE_OK);
        mhi_table_free(table);
        int32_t compared = 0;
        const int32_t frames = late ? 30 : 0;
        for (int32_t k = 60; k < FRAMES; k++) {
            const double *then = plain + 3 * (k - frames), *now = plain + 3 * k;
            assert_near(bent[3 * k], expm1(-2 * now[0]) / expm1(-2), 1e-12);
            assert_true(bent[3 * k + BRACHIALIS] == now[BRACHIALIS]); /* A = 0 */
            assert_near(bent[3 * k + TRICEPS], expm1(-then[TRICEPS]) / expm1(-1), 1e-12);
            assert_true(bent[3 * k] >= now[0]);
            compared += now[0] > 0.01;
        }
        assert_true(compared > 50);
        rig_close(&rig);
    }
}

/* Names without a side, and patterns: of one leg's electrodes on a model of two. */
static void sides_and_patterns(void **state) {
    static const mhe_muscle muscles[] = {
        {.name = "biceps_r"}, {.name = "brachialis_r"}, {.name = "biceps_l"}};
    static const char *const all[] = {"b*"}, *const one[] = {"biceps"}, *const none[] = {"soleus"};
    emg_rig rig;
    double emg[3 * FRAMES];
    (void)state;
    rig_open(&rig);
    rig.model.muscles = muscles;
    mhi_emg_channel channels[2] = {rig.run.emg.channels[0], rig.run.emg.channels[1]};
    mhi_emg_channel *const own = rig.run.emg.channels;
    rig.run.emg.channels = channels;
    rig.run.emg.n_channels = 1;
    channels[0].gains.n = 0;
    channels[0].muscles = (mhe_text_list){all, 1};
    rig.run.emg.side = MHI_EMG_RIGHT;
    mhi_table *table = rig_table(ROWS);
    assert_int_equal(rig_read(&rig, table, FRAMES, emg), MHE_OK);
    assert_int_equal(rig.n_found, 3); /* the pattern holds for both sides as it is */
    channels[0].muscles = (mhe_text_list){one, 1};
    assert_int_equal(rig_read(&rig, table, FRAMES, emg), MHE_OK);
    assert_int_equal(rig.n_found, 1);
    assert_true(isfinite(emg[3 * 100]) && isnan(emg[3 * 100 + 1]) && isnan(emg[3 * 100 + 2]));
    rig.run.emg.side = MHI_EMG_LEFT;
    assert_int_equal(rig_read(&rig, table, FRAMES, emg), MHE_OK);
    assert_true(isnan(emg[3 * 100]) && isfinite(emg[3 * 100 + 2]));
    mhi_table_free(table);
    channels[0].muscles = (mhe_text_list){none, 1};
    check_refused(&rig, MHE_E_CONFIG, "the model has no muscle 'soleus'");
    rig.run.emg.side = MHI_EMG_NO_SIDE;
    channels[0].muscles = (mhe_text_list){one, 1};
    check_refused(&rig, MHE_E_CONFIG, "did you mean 'biceps_");
    rig.run.emg.channels = own;
    rig_close(&rig);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sides_and_patterns),
        cmocka_unit_test(live_and_recorded_are_the_same_bits),
        cmocka_unit_test(electrodes_become_muscles),
        cmocka_unit_test(times_are_aligned),
        cmocka_unit_test(missing_rows_are_a_gap),
        cmocka_unit_test(an_mvc_file_gives_the_scale),
        cmocka_unit_test(wrong_names_are_refused),
        cmocka_unit_test(mixed_up_units_are_refused),
        cmocka_unit_test(times_in_ms_are_named),
        cmocka_unit_test(dead_channels_are_told_and_missing),
        cmocka_unit_test(three_rows_are_no_signal),
        cmocka_unit_test(zero_phase_follows_without_delay),
        cmocka_unit_test(channels_have_shapes_and_delays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

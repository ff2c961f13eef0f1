/* SPDX-License-Identifier: Apache-2.0 */
/* What each check of the room says of data that are wrong in one way, and of sound ones: nothing.
 * The markers' frame and the estimate's verdict are asked by tests/cases and corruptions.sh. */
#include "believe_rig.h"

#include <math.h>
#include <string.h>

static mhe_status check_emg(rig *r) {
    return mhi_believe_emg(&r->run, &believe_model, &r->recording, &r->findings, &r->err);
}

static mhe_status check_angles(rig *r, int32_t in_degrees) {
    const mhi_angles_source source = {"a.mot", 7, in_degrees};
    return mhi_believe_angles(&believe_model, &r->recording, &source, &r->findings, &r->err);
}

static void sound_data_give_no_finding(void **state) {
    (void)state;
    rig *r = new_rig();
    assert_int_equal(check_emg(r), MHE_OK);
    assert_int_equal(check_angles(r, 0), MHE_OK);
    mhi_believe_markers(&r->run, &believe_model, &r->recording, &r->findings);
    assert_int_equal(r->findings.n, 0);
    assert_string_equal(mhi_usable(mhi_findings_weight(&r->findings)), "yes");
    free_rig(r);
}

static void emg_that_is_none_is_refused(void **state) {
    (void)state;
    static const struct {
        double factor, offset;
        const char *text;
    } cases[] = {{100, 0, "percent?"}, {4000, 0, "raw EMG?"}, {1, -0.2, "is this raw EMG?"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        rig *r = new_rig();
        for (int k = 0; k < FRAMES * MUSCLES; k++) {
            r->emg[k] = cases[i].factor * r->emg[k] + cases[i].offset;
        }
        assert_int_equal(check_emg(r), MHE_E_INPUT);
        assert_non_null(strstr(r->err.text, "emg.sto: values from"));
        assert_non_null(strstr(r->err.text, cases[i].text));
        free_rig(r);
    }
}

static void doubtful_emg_is_named(void **state) {
    (void)state;
    rig *r = new_rig();
    for (int k = 0; k < FRAMES; k++) {
        r->emg[k * MUSCLES] = 0;                                            /* dead */
        r->emg[k * MUSCLES + 1] = k < 100 ? r->emg[k * MUSCLES + 1] : 0.17; /* held */
    }
    assert_int_equal(check_emg(r), MHE_OK);
    expect(r, MHI_FINDING_DOUBTFUL, "nothing but zeros: A");
    expect(r, MHI_FINDING_DOUBTFUL, "more than 0.3 s: B");
    assert_int_equal(r->findings.n, 2);
    free_rig(r);
    r = new_rig();
    for (int i = 0; i < MUSCLES; i++) {
        double most = 0;
        for (int k = 0; k < FRAMES; k++) {
            most = fmax(most, r->emg[k * MUSCLES + i]);
        }
        for (int k = 0; k < FRAMES; k++) {
            r->emg[k * MUSCLES + i] /= most;
        }
    }
    assert_int_equal(check_emg(r), MHE_OK);
    expect(r, MHI_FINDING_DOUBTFUL, "the maximum is exactly 1 in 4 of 4 channels");
    free_rig(r);
    r = new_rig();
    for (int k = 80 * MUSCLES; k < FRAMES * MUSCLES; k++) {
        r->emg[k] = NAN;
    }
    assert_int_equal(check_emg(r), MHE_OK);
    expect(r, MHI_FINDING_DOUBTFUL, "EMG from 0 to 0.79 s, frames from 0 to 1.99 s: 40 %");
    free_rig(r);
}

static void a_copied_column_is_told(void **state) {
    (void)state;
    rig *r = new_rig();
    for (int k = 0; k < FRAMES; k++) {
        r->emg[k * MUSCLES + 2] = r->emg[k * MUSCLES];
    }
    assert_int_equal(check_emg(r), MHE_OK);
    expect(r, MHI_FINDING_NOTE, "columns that are the same to the last digit: C as A");
    assert_int_equal(r->findings.n, 1);
    r->emg[20 * MUSCLES] += 1e-12;
    mhi_findings_free(&r->findings);
    assert_int_equal(check_emg(r), MHE_OK);
    assert_int_equal(r->findings.n, 0);
    free_rig(r);
}

static void muscles_rest_at_times(void **state) {
    (void)state;
    rig *r = new_rig();
    for (int k = 0; k < FRAMES * MUSCLES; k++) {
        r->emg[k] += r->emg[k] == 0 ? 0.01 : 0; /* rest, written with two decimals */
    }
    assert_int_equal(check_emg(r), MHE_OK);
    assert_int_equal(r->findings.n, 0);
    for (int k = 0; k < FRAMES * MUSCLES; k++) {
        r->emg[k] += k % MUSCLES > 0 ? 0.03 : 0; /* one still rests */
    }
    assert_int_equal(check_emg(r), MHE_OK);
    assert_int_equal(r->findings.n, 1);
    free_rig(r);
    r = new_rig();
    for (int k = 0; k < FRAMES * MUSCLES; k++) {
        r->emg[k] += 0.03 + 1e-4 * (k % 7); /* hum */
    }
    assert_int_equal(check_emg(r), MHE_OK);
    expect(r, MHI_FINDING_DOUBTFUL, "none of 4 muscles is ever at rest");
    assert_int_equal(r->findings.n, 1);
    free_rig(r);
}

static void a_cost_without_its_emg_is_told(void **state) {
    (void)state;
    static const mhe_plugin cost = {.id = "mhe.cost.emg-markers-high"};
    mhi_use use = {.plugin = &cost, .weight = 1};
    rig *r = new_rig();
    r->recording.emg = NULL;
    r->run.costs = &use;
    r->run.n_costs = 1;
    assert_int_equal(check_emg(r), MHE_OK);
    expect(r, MHI_FINDING_DOUBTFUL, "a cost tracks EMG, but data.emg is not given");
    free_rig(r);
}

static void angles_against_their_ranges(void **state) {
    (void)state;
    rig *r = new_rig();
    for (int k = 0; k < FRAMES; k++) {
        r->angles[2 * k] *= 57.29577951308232;
    }
    assert_int_equal(check_angles(r, 0), MHE_E_INPUT);
    assert_non_null(strstr(r->err.text, "a.mot:7: 'flex' goes from 11.4"));
    assert_non_null(strstr(r->err.text, "'inDegrees=yes'"));
    free_rig(r);
    r = new_rig();
    for (int k = 0; k < FRAMES; k++) {
        r->angles[2 * k] /= 57.29577951308232; /* radians that the header calls degrees */
    }
    assert_int_equal(check_angles(r, 1), MHE_OK);
    expect(r, MHI_FINDING_DOUBTFUL, "no angle is larger than 0.8 degrees");
    free_rig(r);
    r = new_rig();
    for (int k = 0; k < FRAMES; k++) {
        r->angles[2 * k] *= -1; /* the wrong sign */
    }
    assert_int_equal(check_angles(r, 0), MHE_OK);
    expect(r, MHI_FINDING_DOUBTFUL, "'flex' goes from -0.8 to -0.2");
    free_rig(r);
}

static void markers_that_jump_together(void **state) {
    (void)state;
    const int width = 3 * MARKERS;
    rig *r = new_rig();
    for (int k = 120 * width; k < FRAMES * width; k++) {
        r->markers[k] += k % 3 == 1 ? 0.04 : 0; /* someone bumps into a camera */
    }
    mhi_believe_markers(&r->run, &believe_model, &r->recording, &r->findings);
    expect(r, MHI_FINDING_DOUBTFUL, "most markers jump by 40 mm from 1.19 to 1.2 s");
    assert_int_equal(r->findings.n, 1);
    free_rig(r);
    r = new_rig();
    for (int k = 0; k < FRAMES; k++) {
        r->time[k] += k >= 120 ? 0.5 : 0; /* a gap in which they moved */
        for (int i = 0; i < width; i++) {
            r->markers[k * width + i] += k >= 120 ? 0.04 : 0;
        }
        /* carried by the ground: it rests */
        memcpy(&r->markers[k * width + 6], &r->markers[6], 3 * sizeof(double));
    }
    mhi_believe_markers(&r->run, &believe_model, &r->recording, &r->findings);
    assert_int_equal(r->findings.n, 0);
    free_rig(r);
}

static void markers_that_hold_or_are_gone(void **state) {
    (void)state;
    const int width = 3 * MARKERS;
    rig *r = new_rig();
    for (int k = 100; k < 150; k++) {
        memcpy(&r->markers[k * width], &r->markers[99 * width], 3 * sizeof(double));
    }
    mhi_believe_markers(&r->run, &believe_model, &r->recording, &r->findings);
    expect(r, MHI_FINDING_DOUBTFUL, "repeat to the last digit: K (25 %");
    assert_int_equal(r->findings.n, 1);
    free_rig(r);
    r = new_rig();
    for (int k = 1; k < FRAMES; k += 2) { /* 50 Hz written at 100 Hz */
        memcpy(&r->markers[k * width], &r->markers[(k - 1) * width],
               (size_t)width * sizeof(double));
    }
    mhi_believe_markers(&r->run, &believe_model, &r->recording, &r->findings);
    expect(r, MHI_FINDING_DOUBTFUL, "50 % of the frames repeat all markers of the one before");
    assert_int_equal(r->findings.n, 1);
    free_rig(r);
    r = new_rig();
    for (int k = 0; k < FRAMES * width; k++) {
        r->markers[k] = k < 60 * width ? NAN : r->markers[k];
    }
    mhi_believe_markers(&r->run, &believe_model, &r->recording, &r->findings);
    expect(r, MHI_FINDING_DOUBTFUL, "30 % of the frames have no marker");
    for (int k = 0; k < FRAMES * width; k++) {
        r->markers[k] = NAN;
    }
    mhi_believe_markers(&r->run, &believe_model, &r->recording, &r->findings);
    expect(r, MHI_FINDING_USELESS, "no marker of the model is there in any frame");
    assert_string_equal(mhi_usable(mhi_findings_weight(&r->findings)), "no");
    free_rig(r);
}

static void gaps_that_hide_themselves(void **state) {
    (void)state;
    const int width = 3 * MARKERS;
    rig *r = new_rig();
    for (int k = 60; k < 100; k++) { /* a line drawn over a gap, rounded as files round */
        for (int i = 0; i < 3; i++) {
            const double from = r->markers[59 * width + i], to = r->markers[100 * width + i];
            r->markers[k * width + i] = 1e-6 * round(1e6 * (from + (to - from) * (k - 59) / 41));
        }
    }
    mhi_believe_markers(&r->run, &believe_model, &r->recording, &r->findings);
    expect(r, MHI_FINDING_DOUBTFUL, "along a straight line at one speed: K (20 %");
    assert_int_equal(r->findings.n, 1);
    free_rig(r);
    for (int begin = 0; begin <= 100; begin += 50) {
        r = new_rig();
        for (int k = begin; k < begin + 35; k++) { /* less than a fifth, but at once */
            for (int i = 0; i < width; i++) {
                r->markers[k * width + i] = NAN;
            }
        }
        mhi_believe_markers(&r->run, &believe_model, &r->recording, &r->findings);
        expect(r, MHI_FINDING_DOUBTFUL,
               begin == 0    ? "no marker from 0 to 0.34 s"
               : begin == 50 ? "no marker from 0.5 to 0.84 s"
                             : "no marker from 1 to 1.34 s");
        assert_int_equal(r->findings.n, 1);
        assert_int_equal(strstr(mhi_finding_remedy(&r->findings.all[0]), "where the body began") !=
                             NULL,
                         begin == 0);
        free_rig(r);
    }
}

static void emg_of_an_amplifier_alone(void **state) {
    (void)state;
    static mhi_emg_channel channels[] = {{.name = "E1"}, {.name = "E2"}};
    rig *r = new_rig();
    for (int k = 0; k < FRAMES; k++) {
        r->emg[k * MUSCLES + 1] = 0.002 * k + 0.01 * (k % 3); /* drifts */
    }
    assert_int_equal(check_emg(r), MHE_OK);
    expect(r, MHI_FINDING_DOUBTFUL, "nothing but a straight line: B (by 0.4");
    assert_int_equal(r->findings.n, 1);
    free_rig(r);
    r = new_rig(); /* one sample of a cable, cut to emg.max in what is followed */
    r->run.emg.channels = channels;
    r->run.emg.n_channels = 2;
    r->recording.emg_report = (mhi_emg_report){.n_channels = 2, .peak = 18.6, .peak_channel = 1};
    assert_int_equal(check_emg(r), MHE_OK);
    expect(r, MHI_FINDING_DOUBTFUL, "channel 'E2' reaches 1.86e+03 % of its MVC");
    assert_int_equal(r->findings.n, 1);
    free_rig(r);
}

static void emg_of_another_model(void **state) {
    (void)state;
    mhe_description larger = believe_model;
    for (int32_t found = 1; found <= 2; found++) {
        rig *r = new_rig();
        mhe_muscle muscles[5] = {
            {.name = "A"}, {.name = "B"}, {.name = "C"}, {.name = "D"}, {.name = "E"}};
        double emg[FRAMES * 5];
        for (int k = 0; k < FRAMES; k++) {
            for (int i = 0; i < 5; i++) {
                emg[5 * k + i] = i < found ? r->emg[k * MUSCLES + i] : NAN;
            }
        }
        larger.n_muscles = 5;
        larger.muscles = muscles;
        r->recording.emg = emg;
        r->recording.n_emg_found = found;
        r->recording.n_emg_columns = 6;
        assert_int_equal(mhi_believe_emg(&r->run, &larger, &r->recording, &r->findings, &r->err),
                         MHE_OK);
        assert_int_equal(r->findings.n, found == 1);
        if (found == 1) {
            expect(r, MHI_FINDING_DOUBTFUL, "of 6 columns 1 are muscles of the model, which has 5");
        }
        free_rig(r);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sound_data_give_no_finding),
        cmocka_unit_test(emg_that_is_none_is_refused),
        cmocka_unit_test(doubtful_emg_is_named),
        cmocka_unit_test(a_copied_column_is_told),
        cmocka_unit_test(muscles_rest_at_times),
        cmocka_unit_test(a_cost_without_its_emg_is_told),
        cmocka_unit_test(angles_against_their_ranges),
        cmocka_unit_test(markers_that_hold_or_are_gone),
        cmocka_unit_test(markers_that_jump_together),
        cmocka_unit_test(gaps_that_hide_themselves),
        cmocka_unit_test(emg_of_an_amplifier_alone),
        cmocka_unit_test(emg_of_another_model),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
